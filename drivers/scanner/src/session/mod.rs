//! The conversation with one device, without I/O: bytes and the time go in; bytes, events
//! and the next deadline come out.
//!
//! Time is a [`Duration`] since any fixed start, and never runs backwards.

mod assembly;
mod commands;
mod event;
mod opening;
mod receive;
mod request;
mod scan;

use std::collections::VecDeque;
use std::time::Duration;

use scanner_protocol::commands::Nameplate;
use scanner_protocol::{Activity, Calibration, Decoder, Frame, Identity, Message, Status};

pub use event::{Answer, Command, Event, Ticket};
use request::{Due, Purpose, Requests};
pub use scan::Acknowledged;
use scan::ScanTracker;

use crate::error::ScannerError;
use crate::limits::MAX_OUTBOX;
use crate::scanner::{DeviceStatus, LineCounts};
use crate::settings::LinkSettings;

/// The conversation with one device, from the greeting on.
#[derive(Debug)]
pub struct Session {
    /// The port's name, for messages.
    port: String,
    settings: LinkSettings,
    decoder: Decoder,
    outbox: Vec<u8>,
    events: VecDeque<Event>,
    phase: Phase,
    requests: Requests,
    /// Commands given before the device was ready.
    waiting: VecDeque<(Ticket, Command)>,
    boot_id: u32,
    /// The version agreed upon; 0 until then.
    version: u8,
    /// The parts of the identity that have come while opening.
    nameplate: Option<Nameplate>,
    calibration: Option<Calibration>,
    identity: Option<Identity>,
    motion: Option<Motion>,
    /// The command for whose sake faults were cleared last.
    recovered: Option<Ticket>,
    scan: Option<ScanTracker>,
    /// All columns of `scan` have been handed on; it is kept until they are acknowledged.
    scan_over: bool,
    /// Why nobody knows whether the device has closed the last scan.
    unclosed: Option<ScannerError>,
    next_scan_id: u16,
    /// Running number of frames that are not requests.
    stream_tag: u16,
    last_sent: Duration,
    last_heard: Duration,
    status_asked: Duration,
    resends: u64,
    heard: Vec<u8>,
    echoes: u64,
    unreadable: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The device has yet to identify itself.
    Opening,
    Ready,
    /// The session is lost.
    Dead,
}

/// A homing or move under way.
#[derive(Debug, Clone, Copy)]
struct Motion {
    ticket: Ticket,
    /// `None` for homing.
    target_counts: Option<i32>,
    due: Duration,
}

impl Session {
    /// Begins a session: the first bytes to send are there at once.
    ///
    /// Requests are numbered from `first_tag` on. Where that is the [`Session::next_tag`] of the
    /// session before, the device knows what the line still holds of that one, and passes it
    /// over.
    #[must_use]
    pub fn new(port: &str, settings: LinkSettings, first_tag: u16, now: Duration) -> Self {
        let mut session = Self {
            port: port.to_owned(),
            settings,
            decoder: Decoder::new(),
            outbox: Vec::new(),
            events: VecDeque::new(),
            phase: Phase::Opening,
            requests: Requests::new(first_tag),
            waiting: VecDeque::new(),
            boot_id: 0,
            version: 0,
            nameplate: None,
            calibration: None,
            identity: None,
            motion: None,
            recovered: None,
            scan: None,
            scan_over: false,
            unclosed: None,
            // No scan takes less than a request, so this is ahead of earlier scans' too.
            next_scan_id: first_tag,
            stream_tag: 0,
            last_sent: now,
            last_heard: now,
            status_asked: now,
            resends: 0,
            heard: Vec::new(),
            echoes: 0,
            unreadable: 0,
        };
        session.open(now);
        session
    }

    /// The tag of the next request, for the session after this one to begin with.
    #[must_use]
    pub fn next_tag(&self) -> u16 {
        self.requests.next_tag()
    }

    /// Takes bytes from the device.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) {
        if self.phase == Phase::Dead {
            return;
        }
        self.note_heard(bytes);
        let mut rest = bytes;
        while let Some(packet) = self.decoder.next(&mut rest) {
            self.packet(&packet, now);
        }
        self.poll(now);
    }

    /// Does what is due at this time.
    pub fn poll(&mut self, now: Duration) {
        if self.phase == Phase::Ready && now >= self.last_heard + self.settings.silence {
            let why = format!(
                "nothing heard for {} s",
                self.settings.silence.as_secs_f64()
            );
            self.lose(ScannerError::LostConnection {
                port: self.port.clone(),
                why,
            });
        }
        if self.phase == Phase::Dead {
            return;
        }
        self.poll_scan(now);
        self.poll_motion(now);
        self.poll_heartbeat(now);
        self.poll_requests(now);
    }

    /// The bytes to send, which are then the caller's.
    #[must_use]
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outbox)
    }

    /// The next event, in order.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// When [`Session::poll`] has something to do, if no bytes come before. `None` once the
    /// session is lost.
    #[must_use]
    pub fn deadline(&self) -> Option<Duration> {
        let silence = match self.phase {
            Phase::Dead => return None,
            Phase::Opening => None,
            Phase::Ready => Some(self.last_heard + self.settings.silence),
        };
        let scan = self
            .scan
            .as_ref()
            .filter(|_| !self.scan_over)
            .and_then(ScanTracker::deadline);
        [
            silence,
            scan,
            self.requests.deadline(),
            self.motion.map(|motion| motion.due),
            (self.phase == Phase::Ready && self.requests.is_idle()).then(|| self.heartbeat_due()),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Whether the device has identified itself.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.phase == Phase::Ready
    }

    /// How the line has been so far.
    #[must_use]
    pub fn line(&self) -> LineCounts {
        let counts = self.decoder.counts();
        LineCounts {
            frames: counts.frames,
            bad_frames: counts.bad() + self.unreadable,
            retries: self.requests.retries(),
            resends: self.resends,
        }
    }

    /// Ends the session from outside, as when the transport fails: whoever waits is told.
    pub fn lose(&mut self, error: ScannerError) {
        if self.phase == Phase::Dead {
            return;
        }
        self.fail_all(&error);
        self.phase = Phase::Dead;
        self.events.push_back(Event::Lost(error));
    }

    fn poll_requests(&mut self, now: Duration) {
        let (timeout, attempts) = (
            self.settings.request_timeout,
            self.settings.request_attempts,
        );
        while let Some(due) = self.requests.due(now, timeout, attempts) {
            match due {
                Due::Send(frame) => self.send(&frame, now),
                Due::GivenUp(purpose) => {
                    if purpose.is_opening() {
                        let error = self.opening_failed(&purpose);
                        self.lose(error);
                        return;
                    }
                    let error = ScannerError::Timeout {
                        port: self.port.clone(),
                        awaited: purpose.awaited(),
                        after: timeout * attempts,
                    };
                    if purpose == Purpose::CloseScan {
                        self.unclosed = Some(error.clone());
                    }
                    self.fail(&purpose, error);
                }
            }
        }
    }

    fn poll_scan(&mut self, now: Duration) {
        let Some(scan) = self.scan.as_mut().filter(|_| !self.scan_over) else {
            self.settle_scan(now);
            return;
        };
        while let Some(column) = scan.take() {
            self.events.push_back(Event::Column(column));
        }
        if let Some(result) = scan.over() {
            self.end_scan(result);
        } else if scan.overdue(now) {
            let error = ScannerError::Timeout {
                port: self.port.clone(),
                awaited: "column",
                after: self.settings.column_timeout,
            };
            self.end_scan(Err(error));
        } else if self.outbox.len() < MAX_OUTBOX {
            match scan.resends(now) {
                Ok(requests) => {
                    self.resends += requests.len() as u64;
                    for request in &requests {
                        self.send_stream(request, now);
                    }
                }
                Err(error) => self.end_scan(Err(error)),
            }
        }
        self.settle_scan(now);
    }

    /// Sends the grant that is due, and closes a scan all of whose columns are safe.
    fn settle_scan(&mut self, now: Duration) {
        let Some(scan) = &mut self.scan else { return };
        let finished = self.scan_over && scan.all_acknowledged();
        if let Some(grant) = scan.grant(false) {
            self.send_stream(&grant, now);
        }
        if finished {
            self.close_scan();
        }
    }

    fn poll_motion(&mut self, now: Duration) {
        if let Some(motion) = self.motion.take_if(|motion| now >= motion.due) {
            let error = ScannerError::Timeout {
                port: self.port.clone(),
                awaited: "end of the table's motion",
                after: self.settings.motion_timeout,
            };
            self.finish(motion.ticket, Err(error));
        }
    }

    fn heartbeat_due(&self) -> Duration {
        let interval = self.settings.heartbeat_interval;
        let status = match self.motion {
            Some(_) => self.settings.motion_poll,
            None => interval * 2,
        };
        (self.last_sent + interval).min(self.status_asked + status)
    }

    fn poll_heartbeat(&mut self, now: Duration) {
        if self.phase != Phase::Ready || !self.requests.is_idle() || now < self.heartbeat_due() {
            return;
        }
        self.status_asked = now;
        self.requests.push(
            &scanner_protocol::commands::Heartbeat {},
            Purpose::Heartbeat,
        );
        // A grant may have been lost: without this both ends might wait for each other.
        let again = self.scan.as_mut().and_then(|scan| scan.grant(true));
        if let Some(grant) = again {
            self.send_stream(&grant, now);
        }
    }

    fn send(&mut self, frame: &Frame, now: Duration) {
        self.outbox.extend_from_slice(frame.as_bytes());
        self.last_sent = now;
    }

    /// Sends a message that is not answered.
    fn send_stream<M: Message>(&mut self, message: &M, now: Duration) {
        self.stream_tag = self.stream_tag.wrapping_add(1);
        let frame = Frame::new(self.stream_tag, message);
        self.send(&frame, now);
    }

    fn finish(&mut self, ticket: Ticket, result: Result<Answer, ScannerError>) {
        self.events.push_back(Event::Finished(ticket, result));
    }

    fn fail(&mut self, purpose: &Purpose, error: ScannerError) {
        if let Some(ticket) = purpose.ticket() {
            self.finish(ticket, Err(error));
        }
    }

    /// Tells all who wait, for whatever, that it will not be.
    fn fail_all(&mut self, error: &ScannerError) {
        let purposes: Vec<Purpose> = self
            .requests
            .clear()
            .into_iter()
            .chain(self.requests.clear_abort())
            .collect();
        for purpose in &purposes {
            self.fail(purpose, error.clone());
        }
        while let Some((ticket, _)) = self.waiting.pop_front() {
            self.finish(ticket, Err(error.clone()));
        }
        self.stop_waiting(error);
    }

    /// Ends a motion and a scan under way.
    fn stop_waiting(&mut self, error: &ScannerError) {
        if let Some(motion) = self.motion.take() {
            self.finish(motion.ticket, Err(error.clone()));
        }
        if self.scan.take().is_some() && !self.scan_over {
            self.events.push_back(Event::ScanOver(Err(error.clone())));
        }
        self.scan_over = false;
    }

    fn device_status(&self, status: &Status) -> DeviceStatus {
        DeviceStatus {
            activity: status.activity,
            homed: status.homed,
            laser_on: status.laser_on,
            faults: status.faults,
            table_counts: status.homed.then_some(status.table_counts),
            temperature_c: (status.temperature_cdegc != i16::MIN)
                .then(|| f64::from(status.temperature_cdegc) / 100.0),
            uptime: Duration::from_millis(u64::from(status.uptime_ms)),
            line: self.line(),
        }
    }
}

/// Whether the device is at something that takes its time before the next column.
fn on_its_way(activity: Activity) -> bool {
    matches!(activity, Activity::Homing | Activity::Moving)
}
