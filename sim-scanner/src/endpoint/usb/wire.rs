//! The packets of USB/IP 1.1.1, as the Linux kernel documents them
//! (`Documentation/usb/usbip_protocol.rst`). All numbers are big endian.
//!
//! Whoever connects is a stranger: every length is held against a bound before anything is
//! done with it, and memory grows only with the bytes that have come.

use thiserror::Error;

use super::descriptors::{CONFIGURATION, Descriptors};
use scanner_protocol::usb::VENDOR_ID;

/// Longest transfer taken. Linux asks for at most 16 KiB of a bulk endpoint at a time from
/// user space, and its drivers for less.
pub(super) const MAX_TRANSFER: usize = 1 << 20;

/// Name under which the device is offered.
pub(super) const BUS_ID: &str = "1-1";
/// Bus and device number behind that name.
pub(super) const BUS_AND_DEVICE: u32 = 0x0001_0001;

/// High speed, as USB/IP and `vhci_hcd` number it.
pub(super) const SPEED_HIGH: u32 = 3;

/// Linux's error numbers, which go over the wire as they are.
pub(super) mod status {
    pub(in super::super) const DONE: i32 = 0;
    pub(in super::super) const STALLED: i32 = -32;
    pub(in super::super) const UNLINKED: i32 = -104;
}

const VERSION: u16 = 0x0111;
const OP_REQ_DEVLIST: u16 = 0x8005;
const OP_REP_DEVLIST: u16 = 0x0005;
const OP_REQ_IMPORT: u16 = 0x8003;
const OP_REP_IMPORT: u16 = 0x0003;
const OP_HEADER: usize = 8;
const BUS_ID_BYTES: usize = 32;

const CMD_SUBMIT: u32 = 1;
const CMD_UNLINK: u32 = 2;
const RET_SUBMIT: u32 = 3;
const RET_UNLINK: u32 = 4;
const URB_HEADER: usize = 48;

/// Why a connection is given up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub(super) enum WireError {
    #[error("it speaks version {0:#06x} of USB/IP instead of {VERSION:#06x}")]
    Version(u16),
    #[error("unknown operation {0:#06x}")]
    Operation(u16),
    #[error("unknown command {0:#010x}")]
    Command(u32),
    #[error("a transfer of {0} bytes; at most {MAX_TRANSFER} are taken")]
    Length(u32),
    #[error("an isochronous transfer; the device has no such endpoint")]
    Isochronous,
    #[error("more transfers are under way than any host needs")]
    TooMany,
}

/// What is asked before a device is attached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operation {
    List,
    Import {
        /// Whether the device asked for is the one offered.
        ours: bool,
    },
}

/// How an import is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Import {
    Done,
    Busy,
    NoSuchDevice,
}

/// What an attached host asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Command {
    Submit(Submit),
    Unlink { sequence: u32, victim: u32 },
}

/// A transfer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Submit {
    pub(super) sequence: u32,
    pub(super) endpoint: u8,
    /// Towards the host.
    pub(super) incoming: bool,
    /// Most bytes to give, or the number of bytes that came along.
    pub(super) length: usize,
    pub(super) setup: [u8; 8],
    /// What is sent to the device.
    pub(super) data: Vec<u8>,
}

/// Bytes that have come and are not yet understood.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    bytes: Vec<u8>,
    read: usize,
}

impl Inbox {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.read);
        self.read = 0;
        self.bytes.extend_from_slice(bytes);
    }

    fn peek(&self, length: usize) -> Option<&[u8]> {
        self.bytes.get(self.read..)?.get(..length)
    }

    fn take(&mut self, length: usize) -> Option<Vec<u8>> {
        let taken = self.peek(length)?.to_vec();
        self.read += length;
        Some(taken)
    }

    /// The next operation, once it is whole.
    pub(super) fn operation(&mut self) -> Result<Option<Operation>, WireError> {
        let Some(header) = self.peek(OP_HEADER) else {
            return Ok(None);
        };
        let version = u16_at(header, 0);
        if version != VERSION {
            return Err(WireError::Version(version));
        }
        match u16_at(header, 2) {
            OP_REQ_DEVLIST => {
                self.read += OP_HEADER;
                Ok(Some(Operation::List))
            }
            OP_REQ_IMPORT => Ok(self.take(OP_HEADER + BUS_ID_BYTES).map(|request| {
                let name = request.get(OP_HEADER..).unwrap_or_default();
                let end = name.iter().position(|b| *b == 0).unwrap_or(name.len());
                Operation::Import {
                    ours: name.get(..end) == Some(BUS_ID.as_bytes()),
                }
            })),
            other => Err(WireError::Operation(other)),
        }
    }

    /// The next command, once it is whole.
    pub(super) fn command(&mut self) -> Result<Option<Command>, WireError> {
        let Some(header) = self.peek(URB_HEADER) else {
            return Ok(None);
        };
        let sequence = u32_at(header, 4);
        match u32_at(header, 0) {
            CMD_SUBMIT => {}
            CMD_UNLINK => {
                let victim = u32_at(header, 20);
                self.read += URB_HEADER;
                return Ok(Some(Command::Unlink { sequence, victim }));
            }
            other => return Err(WireError::Command(other)),
        }
        let length = u32_at(header, 24);
        if length as usize > MAX_TRANSFER {
            return Err(WireError::Length(length));
        }
        // All ones stand for "not isochronous"; older kernels write 0.
        if !matches!(u32_at(header, 32), 0 | u32::MAX) {
            return Err(WireError::Isochronous);
        }
        let length = length as usize;
        let mut submit = Submit {
            sequence,
            incoming: u32_at(header, 12) != 0,
            endpoint: (u32_at(header, 16) & 0x0f) as u8,
            length,
            setup: [0; 8],
            data: Vec::new(),
        };
        for (to, from) in submit.setup.iter_mut().zip(header.iter().skip(40)) {
            *to = *from;
        }
        let follows = if submit.incoming { 0 } else { length };
        let Some(whole) = self.take(URB_HEADER + follows) else {
            return Ok(None);
        };
        submit.data = whole.get(URB_HEADER..).unwrap_or_default().to_vec();
        Ok(Some(Command::Submit(submit)))
    }
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    bytes
        .iter()
        .skip(at)
        .take(2)
        .fold(0, |number, byte| number << 8 | u16::from(*byte))
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    bytes
        .iter()
        .skip(at)
        .take(4)
        .fold(0, |number, byte| number << 8 | u32::from(*byte))
}

/// The answer to a request for the list of devices; `offered` unless it is taken.
pub(super) fn devices(descriptors: &Descriptors, offered: bool) -> Vec<u8> {
    let mut out = operation(OP_REP_DEVLIST, 0);
    out.extend(u32::from(offered).to_be_bytes());
    if offered {
        device(&mut out, descriptors);
        for class in &descriptors.interfaces {
            out.extend([class.class, class.subclass, class.protocol, 0]);
        }
    }
    out
}

/// The answer to a request to attach the device.
pub(super) fn imported(descriptors: &Descriptors, outcome: Import) -> Vec<u8> {
    let status = match outcome {
        Import::Done => 0,
        Import::Busy => 2,
        Import::NoSuchDevice => 4,
    };
    let mut out = operation(OP_REP_IMPORT, status);
    if outcome == Import::Done {
        device(&mut out, descriptors);
    }
    out
}

fn operation(code: u16, status: u32) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend(VERSION.to_be_bytes());
    out.extend(code.to_be_bytes());
    out.extend(status.to_be_bytes());
    out
}

fn device(out: &mut Vec<u8>, descriptors: &Descriptors) {
    const PATH_BYTES: usize = 256;
    let padded = |out: &mut Vec<u8>, text: &str, length: usize| {
        let end = out.len() + length;
        out.extend(text.bytes().take(length - 1));
        out.resize(end, 0);
    };
    padded(out, "/relief/sim-scanner", PATH_BYTES);
    padded(out, BUS_ID, BUS_ID_BYTES);
    out.extend((BUS_AND_DEVICE >> 16).to_be_bytes());
    out.extend((BUS_AND_DEVICE & 0xffff).to_be_bytes());
    out.extend(SPEED_HIGH.to_be_bytes());
    out.extend(VENDOR_ID.to_be_bytes());
    out.extend(descriptors.product_id().to_be_bytes());
    out.extend(0x0100_u16.to_be_bytes());
    let class = descriptors.get(1, 0).and_then(|d| d.get(4).copied());
    out.extend([class.unwrap_or(0), 0, 0, CONFIGURATION, 1]);
    out.push(descriptors.interfaces.len() as u8);
}

/// The end of a transfer: its status, and how many bytes went; those that went to the host
/// come along.
pub(super) fn completed(
    out: &mut Vec<u8>,
    sequence: u32,
    status: i32,
    length: usize,
    data: impl IntoIterator<Item = u8>,
) {
    header(out, RET_SUBMIT, sequence);
    out.extend(status.to_be_bytes());
    out.extend((length as u32).to_be_bytes());
    // Start frame, number of packets (all ones: not isochronous), errors, padding.
    out.extend([0; 4]);
    out.extend([0xff; 4]);
    out.extend([0; 12]);
    out.extend(data);
}

/// The answer to a request to cancel a transfer.
pub(super) fn unlinked(out: &mut Vec<u8>, sequence: u32, status: i32) {
    header(out, RET_UNLINK, sequence);
    out.extend(status.to_be_bytes());
    out.extend([0; 24]);
}

fn header(out: &mut Vec<u8>, command: u32, sequence: u32) {
    out.extend(command.to_be_bytes());
    out.extend(sequence.to_be_bytes());
    // Device, direction and endpoint are the server's to leave out.
    out.extend([0; 12]);
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::descriptors::Personality;
    use super::*;

    /// A transfer as a host sends it.
    pub(in super::super) fn submit(
        sequence: u32,
        endpoint: u8,
        incoming: bool,
        length: u32,
        setup: [u8; 8],
        data: &[u8],
    ) -> Vec<u8> {
        let mut out = Vec::new();
        for word in [
            CMD_SUBMIT,
            sequence,
            BUS_AND_DEVICE,
            u32::from(incoming),
            u32::from(endpoint),
            0,
            length,
            0,
            u32::MAX,
            0,
        ] {
            out.extend(word.to_be_bytes());
        }
        out.extend(setup);
        out.extend(data);
        out
    }

    /// A cancellation as a host sends it.
    pub(in super::super) fn unlink(sequence: u32, victim: u32) -> Vec<u8> {
        let mut out = Vec::new();
        for word in [CMD_UNLINK, sequence, BUS_AND_DEVICE, 0, 0, victim] {
            out.extend(word.to_be_bytes());
        }
        out.resize(URB_HEADER, 0);
        out
    }

    #[test]
    fn commands_are_understood_however_they_are_cut() {
        let mut bytes = submit(7, 1, false, 5, [0; 8], b"hello");
        bytes.extend(submit(8, 1, true, 512, [0; 8], &[]));
        bytes.extend(unlink(9, 8));
        for cut in [1, 3, 47, 48, 49, 500] {
            let mut inbox = Inbox::default();
            let mut commands = Vec::new();
            for piece in bytes.chunks(cut) {
                inbox.push(piece);
                while let Some(command) = inbox.command().expect("well formed") {
                    commands.push(command);
                }
            }
            let [
                Command::Submit(out),
                Command::Submit(incoming),
                Command::Unlink { sequence, victim },
            ] = &commands[..]
            else {
                unreachable!("{commands:?}")
            };
            assert_eq!((out.sequence, &out.data[..]), (7, &b"hello"[..]));
            assert_eq!((incoming.incoming, incoming.length), (true, 512));
            assert_eq!((*sequence, *victim), (9, 8));
        }
    }

    #[test]
    fn lengths_are_held_against_their_bounds_before_anything_comes() {
        for (length, packets, error) in [
            (u32::MAX, u32::MAX, WireError::Length(u32::MAX)),
            (
                MAX_TRANSFER as u32 + 1,
                u32::MAX,
                WireError::Length(MAX_TRANSFER as u32 + 1),
            ),
            (64, 3, WireError::Isochronous),
        ] {
            for incoming in [false, true] {
                let mut bytes = submit(1, 1, incoming, length, [0; 8], &[]);
                bytes[32..36].copy_from_slice(&packets.to_be_bytes());
                let mut inbox = Inbox::default();
                inbox.push(&bytes);
                assert_eq!(inbox.command(), Err(error));
            }
        }
        let mut inbox = Inbox::default();
        inbox.push(&[0; URB_HEADER]);
        assert_eq!(inbox.command(), Err(WireError::Command(0)));
    }

    #[test]
    fn operations_are_understood_or_refused() {
        let mut inbox = Inbox::default();
        inbox.push(&[0x01, 0x11, 0x80, 0x05, 0, 0, 0, 0]);
        assert_eq!(inbox.operation(), Ok(Some(Operation::List)));
        for (name, ours) in [("1-1", true), ("1-10", false), ("", false)] {
            let mut request = vec![0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0];
            request.extend(name.bytes());
            request.resize(OP_HEADER + BUS_ID_BYTES, 0);
            inbox.push(&request[..20]);
            assert_eq!(inbox.operation(), Ok(None));
            inbox.push(&request[20..]);
            assert_eq!(inbox.operation(), Ok(Some(Operation::Import { ours })));
        }
        inbox.push(b"GET / HTTP/1.1\r\n");
        assert_eq!(inbox.operation(), Err(WireError::Version(0x4745)));
    }

    #[test]
    fn answers_have_the_lengths_of_the_kernels_structures() {
        for (personality, interfaces) in [(Personality::Vendor, 1), (Personality::CdcAcm, 2)] {
            let descriptors = Descriptors::new(personality, "Scanner", "1");
            assert_eq!(devices(&descriptors, true).len(), 12 + 312 + 4 * interfaces);
            assert_eq!(devices(&descriptors, false).len(), 12);
            assert_eq!(imported(&descriptors, Import::Done).len(), 8 + 312);
            assert_eq!(
                imported(&descriptors, Import::Busy),
                [1, 0x11, 0, 3, 0, 0, 0, 2]
            );
        }
        let mut out = Vec::new();
        unlinked(&mut out, 1, status::UNLINKED);
        assert_eq!(out.len(), URB_HEADER);
        out.clear();
        completed(&mut out, 1, status::DONE, 2, *b"ab");
        assert_eq!(out.len(), URB_HEADER + 2);
    }
}
