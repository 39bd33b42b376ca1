//! The device's side of USB: control requests, halts, and transfers that wait for data.
//!
//! No I/O and no clock: commands go in, and the bytes of the answers come out.

use std::collections::VecDeque;

use super::descriptors::{BULK_IN, BULK_OUT, CONFIGURATION, Descriptors, NOTIFY_IN, Personality};
use super::wire::{self, Command, Submit, WireError, status};

/// Most transfers under way.
const MAX_PENDING: usize = 1024;

/// Most bytes that the host may have on the way while the device does not listen.
const MAX_UNHEARD: usize = 4 << 20;

/// What the endpoint's end of the cable does with transfers.
#[derive(Debug)]
pub(super) struct Function {
    descriptors: Descriptors,
    configuration: u8,
    halted_in: bool,
    halted_out: bool,
    /// Incoming transfers that wait for data.
    waiting: VecDeque<Waiting>,
    /// Transfers that wait for a notification, of which there is none.
    notifications: VecDeque<u32>,
    /// Outgoing transfers that the device has not yet taken.
    unheard: VecDeque<Submit>,
    unheard_bytes: usize,
    /// What the device has said and no transfer has fetched.
    to_host: VecDeque<u8>,
    line_coding: [u8; 7],
    /// The host has the serial port open (DTR).
    open: bool,
    /// Answers, as they go over the wire.
    answers: Vec<u8>,
}

#[derive(Debug)]
struct Waiting {
    sequence: u32,
    length: usize,
}

impl Function {
    pub(super) fn new(descriptors: Descriptors) -> Self {
        Self {
            descriptors,
            configuration: 0,
            halted_in: false,
            halted_out: false,
            waiting: VecDeque::new(),
            notifications: VecDeque::new(),
            unheard: VecDeque::new(),
            unheard_bytes: 0,
            to_host: VecDeque::new(),
            // 115,200 baud, 1 stop bit, no parity, 8 data bits.
            line_coding: [0x00, 0xc2, 0x01, 0x00, 0, 0, 8],
            open: false,
            answers: Vec::new(),
        }
    }

    pub(super) fn descriptors(&self) -> &Descriptors {
        &self.descriptors
    }

    /// As after pulling and putting back the plug.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.descriptors.clone());
    }

    /// Carries out what the host asks.
    pub(super) fn command(&mut self, command: Command) -> Result<(), WireError> {
        match command {
            Command::Unlink { sequence, victim } => self.unlink(sequence, victim),
            Command::Submit(submit) if submit.endpoint == 0 => self.control(&submit),
            Command::Submit(submit) => self.transfer(submit)?,
        }
        Ok(())
    }

    fn transfer(&mut self, submit: Submit) -> Result<(), WireError> {
        let address = submit.endpoint | if submit.incoming { 0x80 } else { 0 };
        let serial = self.descriptors.personality == Personality::CdcAcm;
        match address {
            BULK_IN => self.waiting.push_back(Waiting {
                sequence: submit.sequence,
                length: submit.length,
            }),
            NOTIFY_IN if serial => self.notifications.push_back(submit.sequence),
            BULK_OUT if self.halted_out => {
                self.finish(submit.sequence, status::STALLED, 0, []);
            }
            BULK_OUT => {
                self.unheard_bytes += submit.data.len();
                self.unheard.push_back(submit);
            }
            _ => self.finish(submit.sequence, status::STALLED, 0, []),
        }
        let pending = self.waiting.len() + self.notifications.len() + self.unheard.len();
        if pending > MAX_PENDING || self.unheard_bytes > MAX_UNHEARD {
            return Err(WireError::TooMany);
        }
        self.move_bytes();
        Ok(())
    }

    fn unlink(&mut self, sequence: u32, victim: u32) {
        let waiting = self.waiting.len();
        self.waiting.retain(|waiting| waiting.sequence != victim);
        let notifications = self.notifications.len();
        self.notifications.retain(|waiting| *waiting != victim);
        let unheard = self.unheard.len();
        self.unheard.retain(|submit| submit.sequence != victim);
        self.unheard_bytes = self.unheard.iter().map(|submit| submit.data.len()).sum();
        let found = waiting != self.waiting.len()
            || notifications != self.notifications.len()
            || unheard != self.unheard.len();
        // A transfer that was done already has had its answer.
        let status = if found {
            status::UNLINKED
        } else {
            status::DONE
        };
        wire::unlinked(&mut self.answers, sequence, status);
    }

    fn control(&mut self, submit: &Submit) {
        match self.request(submit) {
            Some(data) if submit.incoming => {
                let length = data.len().min(submit.length);
                let data = data.into_iter().take(length);
                wire::completed(
                    &mut self.answers,
                    submit.sequence,
                    status::DONE,
                    length,
                    data,
                );
            }
            Some(_) => self.finish(submit.sequence, status::DONE, submit.length, []),
            None => self.finish(submit.sequence, status::STALLED, 0, []),
        }
        self.move_bytes();
    }

    /// What a control request comes to; `None` is a stall, USB's word for "no".
    fn request(&mut self, submit: &Submit) -> Option<Vec<u8>> {
        let [kind, request, value_low, value_high, index, _, _, _] = submit.setup;
        let serial = self.descriptors.personality == Personality::CdcAcm;
        let nothing = Some(Vec::new());
        match (kind, request) {
            // GET_STATUS of the device (self-powered), an interface, an endpoint.
            (0x80, 0) => Some(vec![1, 0]),
            (0x81, 0) => Some(vec![0, 0]),
            (0x82, 0) => Some(vec![u8::from(self.is_halted(index)), 0]),
            // CLEAR_FEATURE and SET_FEATURE, ENDPOINT_HALT.
            (0x02, 1) if value_low == 0 => self.halt_endpoint(index, false).then(Vec::new),
            (0x02, 3) if value_low == 0 => self.halt_endpoint(index, true).then(Vec::new),
            // SET_ADDRESS is the host controller's, and harmless.
            (0x00, 5) => nothing,
            // GET_DESCRIPTOR.
            (0x80, 6) => self.descriptors.get(value_high, value_low),
            // GET_CONFIGURATION, SET_CONFIGURATION.
            (0x80, 8) => Some(vec![self.configuration]),
            (0x00, 9) if value_low <= CONFIGURATION => {
                self.configuration = value_low;
                self.halted_in = false;
                self.halted_out = false;
                nothing
            }
            // GET_INTERFACE, SET_INTERFACE: each has one setting.
            (0x81, 10) => Some(vec![0]),
            (0x01, 11) if value_low == 0 => nothing,
            // SET_LINE_CODING, GET_LINE_CODING, SET_CONTROL_LINE_STATE, SEND_BREAK.
            (0x21, 0x20) if serial => {
                self.line_coding = submit.data.as_slice().try_into().ok()?;
                nothing
            }
            (0xa1, 0x21) if serial => Some(self.line_coding.to_vec()),
            (0x21, 0x22) if serial => {
                self.open = value_low & 1 != 0;
                nothing
            }
            (0x21, 0x23) if serial => nothing,
            _ => None,
        }
    }

    fn is_halted(&self, address: u8) -> bool {
        match address {
            BULK_IN => self.halted_in,
            BULK_OUT => self.halted_out,
            _ => false,
        }
    }

    fn halt_endpoint(&mut self, address: u8, halted: bool) -> bool {
        match address {
            BULK_IN => self.halted_in = halted,
            BULK_OUT => self.halted_out = halted,
            NOTIFY_IN if self.descriptors.personality == Personality::CdcAcm => {}
            _ => return false,
        }
        true
    }

    /// Halts the endpoint to the host, as firmware in trouble does; the host clears it.
    pub(super) fn halt(&mut self) {
        self.halted_in = true;
        self.move_bytes();
    }

    /// Whether all that the device has said is fetched.
    pub(super) fn has_spoken(&self) -> bool {
        self.to_host.is_empty()
    }

    /// What the device says. While the host has the serial port closed it is lost, as with
    /// any USB serial port.
    pub(super) fn speak(&mut self, bytes: &[u8]) {
        if self.descriptors.personality == Personality::CdcAcm && !self.open {
            return;
        }
        self.to_host.extend(bytes);
        self.move_bytes();
    }

    /// What the host has said since it was last asked.
    pub(super) fn hear(&mut self) -> Vec<u8> {
        let mut heard = Vec::new();
        while let Some(submit) = self.unheard.pop_front() {
            let length = submit.data.len();
            heard.extend(submit.data);
            self.finish(submit.sequence, status::DONE, length, []);
        }
        self.unheard_bytes = 0;
        heard
    }

    /// The answers since they were last taken.
    pub(super) fn take_answers(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.answers)
    }

    /// Fills the transfers that wait. One that gets less than it has room for ends there, as
    /// with a short packet.
    fn move_bytes(&mut self) {
        while self.halted_in || !self.to_host.is_empty() {
            let Some(next) = self.waiting.pop_front() else {
                return;
            };
            if self.halted_in {
                self.finish(next.sequence, status::STALLED, 0, []);
                continue;
            }
            let length = next.length.min(self.to_host.len());
            let data = self.to_host.drain(..length);
            wire::completed(&mut self.answers, next.sequence, status::DONE, length, data);
        }
    }

    fn finish<const N: usize>(&mut self, sequence: u32, status: i32, length: usize, data: [u8; N]) {
        wire::completed(&mut self.answers, sequence, status, length, data);
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::Inbox;
    use super::super::wire::tests::{submit, unlink};
    use super::*;
    use crate::random::{Draws, Purpose};

    fn function(personality: Personality) -> Function {
        Function::new(Descriptors::new(personality, "Scanner", "SN"))
    }

    /// Sequence, status and data of every answer to what the host sends.
    fn ask(function: &mut Function, bytes: &[u8]) -> Vec<(u32, i32, Vec<u8>)> {
        let mut inbox = Inbox::default();
        inbox.push(bytes);
        while let Some(command) = inbox.command().expect("well formed") {
            function.command(command).expect("within bounds");
        }
        answers(function)
    }

    fn answers(function: &mut Function) -> Vec<(u32, i32, Vec<u8>)> {
        let bytes = function.take_answers();
        let word = |at: usize| i32::from_be_bytes(bytes[at..at + 4].try_into().expect("four"));
        let (mut at, mut found) = (0, Vec::new());
        while at < bytes.len() {
            // What went to the device is counted, but not sent back.
            let length = match (word(at), word(at + 4)) {
                (3, sequence) if sequence >= IN => word(at + 24) as usize,
                _ => 0,
            };
            let data = bytes[at + 48..at + 48 + length].to_vec();
            found.push((word(at + 4) as u32, word(at + 20), data));
            at += 48 + length;
        }
        found
    }

    /// Incoming transfers have sequence numbers from here on in these tests.
    const IN: i32 = 100;

    fn incoming(sequence: u32) -> Vec<u8> {
        submit(sequence, BULK_IN & 0x0f, true, 512, [0; 8], &[])
    }

    fn outgoing(sequence: u32, data: &[u8]) -> Vec<u8> {
        submit(sequence, BULK_OUT, false, data.len() as u32, [0; 8], data)
    }

    fn request(sequence: u32, setup: [u8; 8]) -> Vec<u8> {
        let incoming = setup[0] & 0x80 != 0;
        let length = u16::from_le_bytes([setup[6], setup[7]]);
        let data = vec![9; if incoming { 0 } else { length.into() }];
        submit(sequence, 0, incoming, length.into(), setup, &data)
    }

    #[test]
    fn incoming_transfers_wait_for_data_and_end_short() {
        let mut function = function(Personality::Vendor);
        assert_eq!(ask(&mut function, &incoming(100)), []);
        assert_eq!(ask(&mut function, &incoming(101)), []);
        function.speak(&[7; 600]);
        assert_eq!(
            answers(&mut function),
            [(100, 0, vec![7; 512]), (101, 0, vec![7; 88])]
        );
        function.speak(b"later");
        assert!(!function.has_spoken());
        assert_eq!(
            ask(&mut function, &incoming(102)),
            [(102, 0, b"later".to_vec())]
        );
        assert!(function.has_spoken());
    }

    #[test]
    fn a_cancelled_transfer_is_answered_once_and_a_finished_one_is_not_undone() {
        let mut function = function(Personality::Vendor);
        ask(&mut function, &incoming(100));
        assert_eq!(ask(&mut function, &unlink(2, 100)), [(2, -104, vec![])]);
        function.speak(b"x");
        assert_eq!(answers(&mut function), []);
        assert_eq!(
            ask(&mut function, &incoming(101)),
            [(101, 0, b"x".to_vec())]
        );
        assert_eq!(ask(&mut function, &unlink(3, 101)), [(3, 0, vec![])]);
        // Nor is one towards the device.
        ask(&mut function, &outgoing(4, b"heard"));
        assert_eq!(ask(&mut function, &unlink(5, 4)), [(5, -104, vec![])]);
        assert_eq!(function.hear(), b"");
    }

    #[test]
    fn outgoing_transfers_end_when_the_device_takes_them() {
        let mut function = function(Personality::Vendor);
        assert_eq!(ask(&mut function, &outgoing(1, b"one")), []);
        assert_eq!(ask(&mut function, &outgoing(2, b"two")), []);
        assert_eq!(function.hear(), b"onetwo");
        assert_eq!(answers(&mut function), [(1, 0, vec![]), (2, 0, vec![])]);
    }

    #[test]
    fn a_halted_endpoint_stalls_until_the_host_clears_it() {
        let mut function = function(Personality::Vendor);
        ask(&mut function, &incoming(100));
        function.halt();
        assert_eq!(answers(&mut function), [(100, -32, vec![])]);
        assert_eq!(ask(&mut function, &incoming(101)), [(101, -32, vec![])]);
        let halt_status = request(102, [0x82, 0, 0, 0, BULK_IN, 0, 2, 0]);
        assert_eq!(ask(&mut function, &halt_status), [(102, 0, vec![1, 0])]);
        let clear = request(3, [0x02, 1, 0, 0, BULK_IN, 0, 0, 0]);
        assert_eq!(ask(&mut function, &clear), [(3, 0, vec![])]);
        function.speak(b"on");
        assert_eq!(
            ask(&mut function, &incoming(103)),
            [(103, 0, b"on".to_vec())]
        );
    }

    #[test]
    fn standard_requests_are_answered_and_others_stall() {
        let mut function = function(Personality::Vendor);
        let mut check = |setup: [u8; 8], status: i32, data: &[u8]| {
            let answer = ask(&mut function, &request(100, setup));
            assert_eq!(answer, [(100, status, data.to_vec())], "{setup:02x?}");
        };
        // No more than is asked for, whatever there is.
        check([0x80, 6, 0, 1, 0, 0, 8, 0], 0, &[18, 1, 0, 2, 0, 0, 0, 64]);
        check([0x80, 6, 0, 6, 0, 0, 10, 0], -32, &[]);
        check([0x80, 8, 0, 0, 0, 0, 1, 0], 0, &[0]);
        check([0x00, 9, 2, 0, 0, 0, 0, 0], -32, &[]);
        check([0x00, 9, 1, 0, 0, 0, 0, 0], 0, &[]);
        check([0x80, 8, 0, 0, 0, 0, 1, 0], 0, &[1]);
        check([0x01, 11, 1, 0, 0, 0, 0, 0], -32, &[]);
        // A vendor's interface is no serial port.
        check([0xa1, 0x21, 0, 0, 0, 0, 7, 0], -32, &[]);
        check([0x40, 1, 0, 0, 0, 0, 0, 0], -32, &[]);
    }

    #[test]
    fn a_serial_port_keeps_its_line_coding_and_is_mute_while_closed() {
        let mut function = function(Personality::CdcAcm);
        function.speak(b"lost");
        let set = request(1, [0x21, 0x20, 0, 0, 0, 0, 7, 0]);
        assert_eq!(ask(&mut function, &set), [(1, 0, vec![])]);
        let get = request(100, [0xa1, 0x21, 0, 0, 0, 0, 7, 0]);
        assert_eq!(ask(&mut function, &get), [(100, 0, vec![9; 7])]);
        let short = request(1, [0x21, 0x20, 0, 0, 0, 0, 3, 0]);
        assert_eq!(ask(&mut function, &short), [(1, -32, vec![])]);
        let open = request(2, [0x21, 0x22, 3, 0, 0, 0, 0, 0]);
        assert_eq!(ask(&mut function, &open), [(2, 0, vec![])]);
        function.speak(b"kept");
        assert_eq!(
            ask(&mut function, &incoming(101)),
            [(101, 0, b"kept".to_vec())]
        );
        let notification = submit(102, NOTIFY_IN & 0x0f, true, 16, [0; 8], &[]);
        assert_eq!(ask(&mut function, &notification), []);
        assert_eq!(ask(&mut function, &unlink(3, 102)), [(3, -104, vec![])]);
    }

    #[test]
    fn whatever_comes_is_refused_or_answered_with_no_more_than_there_is() {
        /// The longest descriptor.
        const CONTROL_BYTES: usize = 255;
        let mut draws = Draws::keyed(11, Purpose::Line, &[]);
        let mut refused = 0;
        for round in 0..300 {
            let mut function = function(match round % 2 {
                0 => Personality::Vendor,
                _ => Personality::CdcAcm,
            });
            let mut inbox = Inbox::default();
            let (mut allowed, mut answered) = (0, 0);
            for _ in 0..40 {
                let bits = draws.bits();
                let words = draws.bits().to_le_bytes();
                let (incoming, length) = (bits & 1 != 0, (bits >> 8) as u32 % 70);
                let mut bytes = submit(
                    (bits >> 16) as u32 % 50,
                    (bits >> 1) as u8 % 4,
                    incoming,
                    length,
                    // Small numbers are the ones that mean something.
                    words.map(|byte| if byte & 0x10 == 0 { byte & 0x83 } else { byte }),
                    &vec![0; if incoming { 0 } else { length as usize }],
                );
                if bits & 0xf000_0000 == 0 {
                    let at = (bits >> 32) as usize % bytes.len();
                    bytes[at] ^= (bits >> 40) as u8;
                }
                inbox.push(&bytes);
                function.speak(&words);
                allowed += words.len();
                let command = inbox.command();
                let outcome = command.and_then(|command| match command {
                    Some(command) => {
                        allowed += 48 + CONTROL_BYTES;
                        function.command(command)
                    }
                    None => Ok(()),
                });
                answered += function.take_answers().len();
                assert!(answered <= allowed, "{answered} bytes, {allowed} allowed");
                if outcome.is_err() {
                    refused += 1;
                    break;
                }
            }
        }
        assert!((10..290).contains(&refused), "{refused}");
    }

    #[test]
    fn a_host_cannot_pile_up_transfers_without_end() {
        let mut endless = function(Personality::Vendor);
        let mut inbox = Inbox::default();
        let mut refused = None;
        for sequence in 0..=MAX_PENDING as u32 {
            inbox.push(&incoming(sequence));
            let command = inbox.command().expect("well formed").expect("whole");
            refused = endless.command(command).err();
        }
        assert_eq!(refused, Some(WireError::TooMany));
    }
}
