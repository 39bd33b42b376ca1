//! The thread that owns the transport.
//!
//! It never blocks on anybody but the transport, and on that only for a few milliseconds at
//! a time: an abort gets through whatever else goes on.

use std::collections::BTreeMap;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError};
use std::time::Duration;

use scanner_protocol::{Identity, ScanPlan};

use super::backoff::Backoff;
use super::clock::Clock;
use super::stream::Stream;
use super::{Call, Outcome, ScanNumber};
use crate::error::ScannerError;
use crate::limits::MAX_OUTBOX;
use crate::recovery::{InterruptedScan, Recovery};
use crate::scanner::ScanInfo;
use crate::session::{Answer, Command, Event, Session, Ticket};
use crate::settings::LinkSettings;
use crate::transport::{Connector, Transport};

/// Longest wait for bytes, and so for a call to be noticed, while a scan runs.
const SCAN_SLICE: Duration = Duration::from_millis(4);

/// The same while none runs.
const IDLE_SLICE: Duration = Duration::from_millis(20);

/// How long the line may hold up a write before the thread looks after other things.
const WRITE_SLICE: Duration = Duration::from_millis(20);

/// How long the last abort may take when the driver is dropped: after that the usual dead-man
/// time has done the same.
const FAREWELL: Duration = Duration::from_secs(2);

/// How often it is looked whether the device has come, while there is none.
const ARRIVAL_LOOK: Duration = Duration::from_millis(200);

type Reply = SyncSender<Result<Outcome, ScannerError>>;

/// The device's thread.
pub(super) struct Worker {
    connector: Box<dyn Connector>,
    settings: LinkSettings,
    calls: Receiver<Call>,
    clock: Clock,
    line: Option<Line>,
    /// The first tag of the next session.
    next_tag: u16,
    backoff: Backoff,
    retry_at: Duration,
    last_attempt: Option<Duration>,
    /// The last failure to connect, so that each is logged once.
    logged: Option<ScannerError>,
    /// Commands that came while there was no connection.
    parked: Vec<(Ticket, Command)>,
    /// Who waits for which outcome.
    callers: BTreeMap<Ticket, Reply>,
    /// What the scans that have been asked for are to be.
    plans: BTreeMap<Ticket, ScanPlan>,
    next_ticket: u64,
    /// Who waits for the identity.
    identify: Vec<Reply>,
    identity: Option<Box<Identity>>,
    stream: Option<Stream>,
    /// Who waits for the device to have closed a scan that is paused on request.
    pausing: Vec<Reply>,
    next_scan: u64,
}

/// An open transport and the session over it.
struct Line {
    transport: Box<dyn Transport>,
    session: Session,
    unsent: Vec<u8>,
}

impl Worker {
    pub(super) fn new(
        connector: Box<dyn Connector>,
        settings: LinkSettings,
        calls: Receiver<Call>,
    ) -> Self {
        let clock = Clock::start();
        Self {
            connector,
            backoff: Backoff::new(&settings),
            settings,
            calls,
            clock,
            line: None,
            next_tag: clock.first_tag(),
            retry_at: Duration::ZERO,
            last_attempt: None,
            logged: None,
            parked: Vec::new(),
            callers: BTreeMap::new(),
            plans: BTreeMap::new(),
            next_ticket: 0,
            identify: Vec::new(),
            identity: None,
            stream: None,
            pausing: Vec::new(),
            next_scan: 0,
        }
    }

    fn now(&self) -> Duration {
        self.clock.now()
    }

    /// Works until the driver is dropped. A defect costs what is under way; the thread begins anew,
    /// since nobody else can speak to the device.
    pub(super) fn run(mut self) {
        while let Err(panic) = catch_unwind(AssertUnwindSafe(|| self.work())) {
            let text = panic.downcast_ref::<&str>().copied();
            let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
            let what = text.unwrap_or("no message").to_owned();
            tracing::error!(what, "a defect in the scanner's driver: it begins anew");
            self.stream = None;
            self.disconnected(&ScannerError::Defect { what });
        }
        self.say_farewell();
    }

    fn work(&mut self) {
        while self.take_calls() {
            if self.line.is_some() {
                self.exchange();
            } else if self.now() >= self.retry_at {
                self.connect();
            }
            self.take_events();
            self.mind_the_scan();
            self.tell_who_pauses();
        }
    }

    /// Takes the calls that have come; without a connection it waits for them until the
    /// next attempt to connect is due. `false` means shutdown.
    fn take_calls(&mut self) -> bool {
        if self.line.is_none() {
            let pause = self.retry_at.saturating_sub(self.now());
            match self.calls.recv_timeout(pause.min(ARRIVAL_LOOK)) {
                Ok(call) => {
                    if !self.take_call(call) {
                        return false;
                    }
                }
                Err(RecvTimeoutError::Timeout) => self.look_for_arrival(),
                Err(RecvTimeoutError::Disconnected) => return false,
            }
        }
        loop {
            match self.calls.try_recv() {
                Ok(call) => {
                    if !self.take_call(call) {
                        return false;
                    }
                }
                Err(TryRecvError::Empty) => return true,
                Err(TryRecvError::Disconnected) => return false,
            }
        }
    }

    fn take_call(&mut self, call: Call) -> bool {
        let now = self.now();
        match call {
            Call::Shutdown => return false,
            Call::Identify(reply) => match &self.identity {
                Some(identity) => {
                    let _ = reply.send(Ok(Outcome::Identity(identity.clone())));
                }
                None => {
                    self.identify.push(reply);
                    self.hurry();
                }
            },
            Call::Resume(reply) => {
                let resumed = match &mut self.stream {
                    Some(stream) => stream.scan.resume(now),
                    None => Err(ScannerError::NothingPaused),
                };
                let _ = reply.send(resumed.map(|()| Outcome::Done));
                self.hurry();
            }
            Call::Pause(reply) => match self.pause() {
                Ok(()) => self.pausing.push(reply),
                Err(error) => {
                    let _ = reply.send(Err(error));
                }
            },
            Call::TakeUp(scan, reply) => {
                let begun = self.take_up(*scan, now);
                let _ = reply.send(begun);
                self.hurry();
            }
            Call::Do(Command::Scan(_), reply) if self.is_paused() => {
                let _ = reply.send(Err(ScannerError::ScanRunning));
            }
            Call::Do(command, reply) => {
                if command == Command::Abort {
                    if let Some(stream) = &mut self.stream {
                        stream.scan.abort();
                    }
                    self.answer_who_pauses(&Err(ScannerError::Aborted));
                }
                self.next_ticket += 1;
                let ticket = Ticket(self.next_ticket);
                self.callers.insert(ticket, reply);
                if let Command::Scan(plan) = command {
                    self.plans.insert(ticket, plan);
                }
                match &mut self.line {
                    Some(line) => line.session.command(ticket, command, now),
                    None => {
                        self.parked.push((ticket, command));
                        self.hurry();
                    }
                }
            }
            Call::Acknowledge(number, column) => {
                if let Some(stream) = self.stream.as_mut().filter(|s| s.number == number) {
                    stream.scan.acknowledge(column);
                    if let Some(line) = &mut self.line {
                        line.session.acknowledge(column, now);
                    }
                }
            }
            Call::CloseScan(number) => {
                if self.stream.as_ref().is_some_and(|s| s.number == number) {
                    self.stream = None;
                    if let Some(line) = &mut self.line {
                        line.session.close_scan();
                    }
                }
            }
        }
        true
    }

    fn is_paused(&self) -> bool {
        self.stream
            .as_ref()
            .is_some_and(|stream| stream.scan.is_paused())
    }

    /// Has the scan stop until a person lets it go on.
    fn pause(&mut self) -> Result<(), ScannerError> {
        // What has come is handed on, and a scan that is over with it is not paused.
        self.take_events();
        if !self.plans.is_empty() {
            return Err(ScannerError::CannotPause(
                "it is just being begun; try again in a moment, or abort it".to_owned(),
            ));
        }
        match &mut self.stream {
            Some(stream) => stream.scan.pause(),
            None => Err(ScannerError::NothingToPause),
        }
    }

    /// Answers those who asked for a pause, once the device has closed the scan.
    fn tell_who_pauses(&mut self) {
        let stopping = self.stream.as_ref().is_some_and(|s| s.scan.is_stopping());
        if self.pausing.is_empty() || stopping {
            return;
        }
        let closed = match &self.line {
            Some(line) => line.session.closed(),
            None => Some(Err(self.logged.clone().unwrap_or(ScannerError::Closed))),
        };
        if let Some(closed) = closed {
            self.answer_who_pauses(&closed);
        }
    }

    fn answer_who_pauses(&mut self, closed: &Result<(), ScannerError>) {
        for reply in self.pausing.drain(..) {
            let _ = reply.send(closed.clone().map(|()| Outcome::Done));
        }
    }

    /// A device that has just been plugged in is tried at once, and then, since it may need a
    /// moment, with the shortest pauses.
    fn look_for_arrival(&mut self) {
        if self.connector.appeared() {
            self.backoff.reset();
            self.retry_at = self.now();
        }
    }

    /// Somebody waits: tries to connect now, unless it has only just been tried.
    fn hurry(&mut self) {
        let earliest = self
            .last_attempt
            .map_or(Duration::ZERO, |last| last + self.settings.reconnect_first);
        self.retry_at = self.retry_at.min(earliest);
    }

    fn connect(&mut self) {
        let now = self.now();
        self.last_attempt = Some(now);
        match self.connector.connect() {
            Ok(transport) => {
                let name = self.connector.name();
                let settings = self.settings.clone();
                let mut session = Session::new(&name, settings, self.next_tag, now);
                for (ticket, command) in self.parked.drain(..) {
                    session.command(ticket, command, now);
                }
                self.line = Some(Line {
                    transport,
                    session,
                    unsent: Vec::new(),
                });
            }
            Err(error) => self.disconnected(&error),
        }
    }

    /// Moves bytes both ways once.
    fn exchange(&mut self) {
        let now = self.now();
        let scanning = self.stream.is_some();
        let Some(line) = &mut self.line else { return };
        line.session.poll(now);
        if let Err(error) = line.exchange(scanning, self.clock) {
            line.session.lose(ScannerError::LostConnection {
                port: self.connector.name(),
                why: hang_up(&error),
            });
        }
    }

    fn take_events(&mut self) {
        while let Some(event) = self
            .line
            .as_mut()
            .and_then(|line| line.session.next_event())
        {
            self.event(event);
        }
    }

    fn event(&mut self, event: Event) {
        let now = self.now();
        let event = match &mut self.stream {
            Some(stream) => stream.scan.event(event, now),
            None => Some(event),
        };
        let Some(event) = event else { return };
        match event {
            Event::Ready(identity) => {
                tracing::info!(
                    port = self.connector.name(),
                    model = identity.model.as_str(),
                    serial = identity.serial.as_str(),
                    "scanner connected"
                );
                self.backoff.reset();
                self.logged = None;
                for reply in self.identify.drain(..) {
                    let _ = reply.send(Ok(Outcome::Identity(identity.clone())));
                }
                self.identity = Some(identity);
            }
            Event::Finished(ticket, Ok(Answer::Scan(info))) => self.begin_stream(ticket, info),
            Event::Finished(ticket, result) => {
                self.plans.remove(&ticket);
                if let Some(reply) = self.callers.remove(&ticket) {
                    // Whoever asked may have gone.
                    let _ = reply.send(result.map(Outcome::from));
                }
            }
            // Of a scan that nobody reads any more.
            Event::Column(_) | Event::ScanOver(_) => {}
            Event::Lost(error) => self.disconnected(&error),
        }
    }

    fn begin_stream(&mut self, ticket: Ticket, info: ScanInfo) {
        self.next_scan += 1;
        let number = ScanNumber(self.next_scan);
        let begun = self.plans.remove(&ticket).zip(self.identity.clone());
        let reply = self.callers.remove(&ticket);
        if let (Some((plan, identity)), Some(reply)) = (begun, reply) {
            let resume = self.settings.resume.clone();
            let scan = Recovery::begun(resume, identity, plan, info, self.now());
            let (stream, items) = Stream::new(number, scan, self.settings.credits);
            if reply.send(Ok(Outcome::Scan(info, number, items))).is_ok() {
                self.stream = Some(stream);
                return;
            }
        }
        if let Some(line) = &mut self.line {
            line.session.close_scan();
        }
    }

    /// A stream of a scan that waits for the device, which need not be there.
    fn take_up(&mut self, scan: InterruptedScan, now: Duration) -> Result<Outcome, ScannerError> {
        if self.stream.is_some() || !self.plans.is_empty() {
            return Err(ScannerError::ScanRunning);
        }
        let Some(settings) = self.settings.resume.clone() else {
            return Err(ScannerError::NotTakenUp(
                "scans do not go on after an interruption: `resume` is off".to_owned(),
            ));
        };
        let info = scan.info();
        let mut scan = Recovery::taken_up(settings, scan, now);
        if let Some(identity) = self.identity.clone() {
            // It has said who it is before, and does not say so again.
            scan.event(Event::Ready(identity), now);
        }
        self.next_scan += 1;
        let number = ScanNumber(self.next_scan);
        let (stream, items) = Stream::new(number, scan, self.settings.credits);
        self.stream = Some(stream);
        Ok(Outcome::Scan(info, number, items))
    }

    /// Lets a paused scan go on, and passes on what has come of it.
    fn mind_the_scan(&mut self) {
        let now = self.now();
        let Some(stream) = &mut self.stream else {
            return;
        };
        let session = self.line.as_mut().map(|line| &mut line.session);
        stream.scan.poll(session, now);
        if stream.pass_on().is_err() {
            // Only possible if columns are acknowledged before they are taken.
            tracing::error!("columns were acknowledged before they were taken; scan closed");
            self.stream = None;
            if let Some(line) = &mut self.line {
                line.session.close_scan();
            }
        }
    }

    /// There is no connection, or no longer: tells all who wait, and plans the next attempt.
    fn disconnected(&mut self, error: &ScannerError) {
        if self.logged.as_ref() != Some(error) {
            tracing::warn!(%error, "scanner not connected");
            self.logged = Some(error.clone());
        }
        if let Some(line) = self.line.take() {
            self.next_tag = line.session.next_tag();
        }
        self.identity = None;
        for reply in self.identify.drain(..) {
            let _ = reply.send(Err(error.clone()));
        }
        self.answer_who_pauses(&Err(error.clone()));
        self.parked.clear();
        for reply in std::mem::take(&mut self.callers).into_values() {
            let _ = reply.send(Err(error.clone()));
        }
        if let Some(stream) = &mut self.stream {
            stream.scan.unreachable(error);
        }
        // A scan that can go on waits for the connection.
        self.mind_the_scan();
        if !self.is_paused() {
            self.stream = None;
        }
        self.plans.clear();
        self.retry_at = self.now() + self.backoff.next();
    }

    /// Laser off and table stopped, as far as the device can still be reached.
    fn say_farewell(&mut self) {
        let until = self.now() + FAREWELL;
        let ticket = Ticket(self.next_ticket + 1);
        let now = self.now();
        let Some(line) = &mut self.line else { return };
        line.session.command(ticket, Command::Abort, now);
        while self.clock.now() < until {
            line.session.poll(self.clock.now());
            if line.exchange(true, self.clock).is_err() {
                return;
            }
            while let Some(event) = line.session.next_event() {
                match event {
                    Event::Finished(finished, _) if finished == ticket => return,
                    Event::Lost(_) => return,
                    _ => {}
                }
            }
        }
    }
}

impl Line {
    /// Sends what is to be sent, then waits a little for bytes and takes them.
    fn exchange(&mut self, scanning: bool, clock: Clock) -> io::Result<()> {
        // A device that does not read must not make the unsent bytes grow without end; the
        // session stops by itself when its own are not taken.
        if self.unsent.len() < MAX_OUTBOX {
            self.unsent.append(&mut self.session.take_output());
        }
        if !self.unsent.is_empty() {
            let sent = self.transport.write(&self.unsent, WRITE_SLICE)?;
            self.unsent.drain(..sent.min(self.unsent.len()));
        }
        let slice = if scanning { SCAN_SLICE } else { IDLE_SLICE };
        let due = self.session.deadline().unwrap_or(Duration::ZERO);
        let wait = due.saturating_sub(clock.now()).min(slice);
        let mut buffer = [0; 4096];
        let count = self.transport.read(&mut buffer, wait)?;
        if count > 0 {
            self.session
                .receive(buffer.get(..count).unwrap_or(&buffer), clock.now());
        }
        Ok(())
    }
}

/// How a broken transport reads to the user.
fn hang_up(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::BrokenPipe | io::ErrorKind::UnexpectedEof => {
            "unplugged or switched off".to_owned()
        }
        _ => error.to_string(),
    }
}
