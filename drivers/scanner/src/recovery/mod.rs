//! One scan across interruptions: lost lines, restarts of the device, faults that pass.
//!
//! ```text
//!              columns                 trouble
//!  running -------------> handed on ------------> waiting <---------+
//!     ^                                  |           | device there |
//!     |                       a person   |           v              | trouble
//!     |                       must look  |        homing -----------+
//!     |                                  v           |              |
//!     |                             told to go on    v              |
//!     +--- the last columns, measured again, are ---- continuing ---+
//!          as they were
//! ```
//!
//! Like the session it knows neither I/O nor clocks: events of the session and the time go
//! in; columns, each once, and word of pauses come out.

mod interrupted;
mod on_request;
mod overlap;
mod pause;

use std::collections::VecDeque;
use std::time::Duration;

use scanner_protocol::{Faults, Head, Identity, ScanPlan};

pub use interrupted::{ColumnSource, InterruptedScan};
use overlap::Kept;
pub use pause::Pause;
use pause::{Class, class, for_a_person};

use crate::error::ScannerError;
use crate::limits::MAX_CREDITS;
use crate::scanner::{RawColumn, ScanInfo};
use crate::session::{Acknowledged, Answer, Command, Event, Session, Ticket};
use crate::settings::ResumeSettings;

/// Tickets from here on are a recovery's own.
const OWN_TICKETS: u64 = 1 << 63;

/// Longer than a scan that runs is ever left alone.
const AWAY: Duration = Duration::from_secs(1);

/// What a scan comes to, in order.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// The next column.
    Column(RawColumn),
    /// It has stopped after the last column; or it has, and the reason has changed.
    Paused(Pause),
    /// It goes on: the columns before and after fit together.
    Resumed,
    /// No column will come any more.
    Over(Result<(), ScannerError>),
}

/// A scan from its acceptance to its end, across interruptions.
#[derive(Debug)]
pub struct Recovery {
    /// Without them the first trouble ends the scan.
    settings: Option<ResumeSettings>,
    source: ColumnSource,
    plan: ScanPlan,
    info: ScanInfo,
    state: State,
    progress: VecDeque<Progress>,
    /// When the scan was last looked after.
    looked: Duration,
    /// Columns below may have been measured before the computer slept: they may have waited in
    /// buffers, or be sent again.
    old_below: u32,
    /// Until then the laser may come on again without a person's word: so long after the last
    /// column came that had just been measured, or else after the scan was accepted, since for all
    /// that is known nobody has seen the laser on since.
    unattended_until: Duration,
    /// Every column below has been handed on.
    handed: u32,
    acknowledged: Acknowledged,
    /// The last columns handed on, to be compared.
    kept: Kept,
    /// Those of them that have come again.
    again: Vec<RawColumn>,
    pause: Option<Paused>,
    /// Attempts to go on since a column was last handed on.
    attempts: u32,
    /// The device at the other end is the one the scan was begun with.
    same_device: bool,
    next_ticket: u64,
}

/// A pause that has been told of.
#[derive(Debug)]
struct Paused {
    told: Pause,
    /// Until then the laser may go on again without a person's word.
    unattended_until: Duration,
    /// Faults that a person has been told of and has not yet said a word about.
    shown: Faults,
    /// Faults that a person has seen to: they may be cleared, once.
    attended: Faults,
    /// Failures since it began.
    failures: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Columns come; in a pause they are those to compare.
    Running,
    /// Goes on from this time on, as soon as the device is there.
    Waiting(Duration),
    /// Waits for a person.
    Attended,
    /// Where it was paused meanwhile, a person is waited for once the table is at home.
    Homing(Ticket),
    Homed,
    /// Where it was paused meanwhile, what the device begins is unwanted.
    Continuing(Ticket),
    /// The scan on the device is unwanted; then a person is waited for.
    Refused,
    Over,
}

impl Recovery {
    /// A scan that the device has accepted just now.
    #[must_use]
    pub fn begun(
        settings: Option<ResumeSettings>,
        identity: Box<Identity>,
        plan: ScanPlan,
        info: ScanInfo,
        now: Duration,
    ) -> Self {
        let unattended = settings.as_ref().map(|settings| settings.unattended);
        let unattended_until = now + unattended.unwrap_or_default();
        Self {
            settings,
            source: ColumnSource::of(&identity),
            plan,
            info,
            state: State::Running,
            progress: VecDeque::new(),
            looked: now,
            old_below: 0,
            unattended_until,
            handed: 0,
            acknowledged: Acknowledged::default(),
            kept: Kept::default(),
            again: Vec::new(),
            pause: None,
            attempts: 0,
            same_device: true,
            next_ticket: OWN_TICKETS,
        }
    }

    /// A scan that the program was in when it last ended: a pause like others, that ends as soon
    /// as the device is there and what is kept has been measured again, or once a person says so.
    #[must_use]
    pub fn taken_up(settings: ResumeSettings, scan: InterruptedScan, now: Duration) -> Self {
        let mut kept = Kept::default();
        for column in scan.kept.into_columns() {
            kept.push(column, settings.overlap_columns);
        }
        let unattended = settings.unattended;
        let needs_person = scan.waits_for.is_some() || scan.silent >= unattended;
        let unattended_until = now + unattended.saturating_sub(scan.silent);
        let told = Pause {
            cause: ScannerError::ProgramEnded {
                before: scan.waits_for,
            },
            needs_person,
            columns: scan.columns,
        };
        Self {
            settings: Some(settings),
            source: scan.source,
            plan: scan.plan,
            info: scan.info,
            state: if needs_person {
                State::Attended
            } else {
                State::Waiting(now)
            },
            progress: VecDeque::from([Progress::Paused(told.clone())]),
            looked: now,
            old_below: 0,
            unattended_until,
            handed: scan.columns,
            acknowledged: Acknowledged::all_below(scan.columns),
            kept,
            again: Vec::new(),
            pause: Some(Paused {
                told,
                unattended_until,
                shown: Faults::NONE,
                attended: Faults::NONE,
                failures: 0,
            }),
            attempts: 0,
            // Said by the device as soon as it is there.
            same_device: true,
            next_ticket: OWN_TICKETS,
        }
    }

    /// What has come of the scan, in order.
    pub fn next_progress(&mut self) -> Option<Progress> {
        self.progress.pop_front()
    }

    /// Whether it has stopped and may go on.
    #[must_use]
    pub fn is_paused(&self) -> bool {
        self.pause.is_some() && self.state != State::Over
    }

    /// A column is safe with the host.
    pub fn acknowledge(&mut self, column: u32) {
        self.acknowledged.add(column, self.handed);
    }

    /// A person says that the scan may go on.
    ///
    /// # Errors
    /// [`ScannerError::NothingPaused`] if it has not stopped.
    pub fn resume(&mut self, now: Duration) -> Result<(), ScannerError> {
        let unattended = self.unattended();
        let (Some(pause), false) = (&mut self.pause, self.state == State::Over) else {
            return Err(ScannerError::NothingPaused);
        };
        pause.unattended_until = now + unattended;
        pause.failures = 0;
        // The same trouble once more is news again.
        if std::mem::take(&mut pause.told.needs_person) {
            pause.attended = std::mem::replace(&mut pause.shown, Faults::NONE);
            if let ScannerError::ProgramEnded { before } = &mut pause.told.cause {
                // That has been seen to.
                *before = None;
            }
            self.progress
                .push_back(Progress::Paused(pause.told.clone()));
        }
        self.attempts = 0;
        if matches!(self.state, State::Waiting(_) | State::Attended) {
            self.state = State::Waiting(now);
        }
        Ok(())
    }

    /// The device cannot be reached, which is news to a scan that is to go on and knows of no
    /// trouble: one that has just been taken up, or was paused on request.
    pub fn unreachable(&mut self, error: &ScannerError) {
        let knows_of_none = |pause: &Paused| match pause.told.cause {
            ScannerError::ProgramEnded { before: None } => true,
            ScannerError::PausedOnRequest => !pause.told.needs_person,
            _ => false,
        };
        if self.pause.as_ref().is_some_and(knows_of_none) {
            self.tell(error.clone(), self.needs_person());
        }
    }

    /// Ends a paused scan; one that runs is ended by the session.
    pub fn abort(&mut self) {
        if self.is_paused() {
            self.end(Err(ScannerError::Aborted));
        }
    }

    /// Takes what concerns the scan from an event of the session; the rest is given back.
    pub fn event(&mut self, event: Event, now: Duration) -> Option<Event> {
        self.look(now);
        match event {
            Event::Column(column) => {
                self.column(column, now);
                None
            }
            Event::ScanOver(result) => {
                // Of a scan that has been refused no end is wanted either.
                if self.state == State::Running {
                    match result {
                        Ok(()) => self.end(Ok(())),
                        Err(error) => self.interrupted(error, now),
                    }
                }
                None
            }
            Event::Finished(ticket, result) if ticket.0 >= OWN_TICKETS => {
                self.finished(ticket, result, now);
                None
            }
            Event::Ready(identity) => {
                self.meet(&identity);
                Some(Event::Ready(identity))
            }
            other => Some(other),
        }
    }

    /// Does what is due; `session` is there while there is a connection.
    pub fn poll(&mut self, session: Option<&mut Session>, now: Duration) {
        self.look(now);
        if self.settings.is_none() {
            return;
        }
        if let (State::Waiting(_) | State::Homed, Some(pause)) = (self.state, &mut self.pause)
            && now >= pause.unattended_until
        {
            pause.told.needs_person = true;
            pause.attended = Faults::NONE;
            self.progress
                .push_back(Progress::Paused(pause.told.clone()));
            self.state = State::Attended;
        }
        let Some(session) = session else { return };
        if self.state == State::Refused {
            session.close_scan();
            self.state = if self.needs_person() {
                State::Attended
            } else {
                State::Waiting(now)
            };
        }
        if !session.is_ready() || !self.same_device {
            return;
        }
        match self.state {
            State::Waiting(from) if now >= from => {
                let ticket = self.ticket();
                self.state = State::Homing(ticket);
                // What happens from now on is another matter than what a person has seen to.
                let attended = self
                    .pause
                    .as_mut()
                    .map_or(Faults::NONE, |pause| std::mem::take(&mut pause.attended));
                session.command(ticket, Command::HomeAgain { attended }, now);
            }
            State::Homed => {
                let ticket = self.ticket();
                self.state = State::Continuing(ticket);
                self.attempts += 1;
                let first_column = self.kept.first_index().unwrap_or(self.handed);
                // What comes now is measured now.
                self.old_below = 0;
                session.go_on(
                    ticket,
                    self.plan,
                    first_column,
                    self.handed,
                    self.acknowledged.clone(),
                    now,
                );
            }
            _ => {}
        }
    }

    /// Notices that the computer has slept: a scanner that did not hear from it has stopped by
    /// itself, and has measured no more columns than it had credit for.
    fn look(&mut self, now: Duration) {
        if now >= self.looked + AWAY {
            self.old_below = self.handed.saturating_add(u32::from(MAX_CREDITS));
        }
        self.looked = now;
    }

    /// When [`Recovery::poll`] has something to do, events aside.
    #[must_use]
    pub fn deadline(&self) -> Option<Duration> {
        let pause = self.pause.as_ref().filter(|_| self.settings.is_some())?;
        match self.state {
            State::Waiting(from) => Some(from.min(pause.unattended_until)),
            State::Homed => Some(pause.unattended_until),
            _ => None,
        }
    }

    /// How long the laser may stay off before a person has to say that it may go on again.
    fn unattended(&self) -> Duration {
        self.settings
            .as_ref()
            .map_or(Duration::ZERO, |settings| settings.unattended)
    }

    /// Whether a person has been asked to let the scan go on, and has not done so.
    fn needs_person(&self) -> bool {
        self.pause
            .as_ref()
            .is_some_and(|pause| pause.told.needs_person)
    }

    fn ticket(&mut self) -> Ticket {
        self.next_ticket += 1;
        Ticket(self.next_ticket)
    }

    fn column(&mut self, column: RawColumn, now: Duration) {
        if self.state != State::Running {
            return;
        }
        if column.index < self.handed {
            return self.compare(column, now);
        }
        self.go_on();
        if column.index >= self.old_below {
            self.unattended_until = now + self.unattended();
        }
        self.handed = column.index + 1;
        self.attempts = 0;
        if let Some(settings) = &self.settings {
            self.kept.push(column.clone(), settings.overlap_columns);
        }
        self.progress.push_back(Progress::Column(column));
    }

    /// A column that is there already, measured again; the last of them decides.
    fn compare(&mut self, again: RawColumn, now: Duration) {
        let last = again.index + 1 == self.handed;
        let is_new = again.index >= self.old_below;
        if self.kept.has(again.index) {
            self.again.push(again);
        }
        if !last {
            return;
        }
        let count_mm = match self.source.calibration.head {
            Head::Polar { range_count_pm, .. } => f64::from(range_count_pm) * 1e-9,
            Head::Cartesian { count_pm } => f64::from(count_pm) * 1e-9,
        };
        match overlap::compare(self.kept.iter(), &std::mem::take(&mut self.again), count_mm) {
            Ok(()) => {
                if is_new {
                    // The laser has been seen on.
                    self.unattended_until = now + self.unattended();
                }
                self.go_on();
            }
            Err(how) => {
                let error = ScannerError::Moved {
                    column: self.handed - 1,
                    how,
                };
                self.interrupted(error, now);
                if self.state == State::Attended {
                    self.state = State::Refused;
                }
            }
        }
    }

    fn go_on(&mut self) {
        if self.pause.take().is_some() {
            self.progress.push_back(Progress::Resumed);
        }
    }

    fn meet(&mut self, identity: &Identity) {
        let other = self.source.other_than(&ColumnSource::of(identity));
        self.same_device = other.is_none();
        if let Some(error) = other
            && self.is_paused()
        {
            self.tell(error, self.needs_person());
        }
    }

    fn finished(&mut self, ticket: Ticket, result: Result<Answer, ScannerError>, now: Duration) {
        match (self.state, result) {
            (State::Homing(ours), Ok(_)) if ours == ticket => {
                self.state = if self.needs_person() {
                    State::Attended
                } else {
                    State::Homed
                };
            }
            (State::Continuing(ours), Ok(Answer::Scan(info))) if ours == ticket => {
                if info == self.info {
                    self.state = if self.needs_person() {
                        State::Refused
                    } else {
                        State::Running
                    };
                    self.again.clear();
                } else {
                    self.end(Err(ScannerError::Protocol(format!(
                        "it took up a scan of {} columns as one of {}",
                        self.info.columns, info.columns
                    ))));
                }
            }
            (State::Homing(ours) | State::Continuing(ours), Err(error)) if ours == ticket => {
                self.interrupted(error, now);
            }
            _ => {}
        }
    }

    fn interrupted(&mut self, error: ScannerError, now: Duration) {
        if self.state == State::Over {
            return;
        }
        let class = class(&error);
        let Some(settings) = self.settings.as_ref().filter(|_| class != Class::Final) else {
            return self.end(Err(error));
        };
        // Who has paused it meanwhile has not said yet that it may go on.
        let waited_for = self.needs_person();
        let needs_person =
            waited_for || class == Class::NeedsPerson || self.attempts >= settings.attempts;
        let failures = self.pause.as_ref().map_or(0, |pause| pause.failures);
        let wait = settings
            .first_pause
            .saturating_mul(1 << failures.min(16))
            .min(settings.longest_pause);
        self.state = if needs_person {
            State::Attended
        } else {
            State::Waiting(now + wait)
        };
        let shown = for_a_person(&error);
        // What passes by itself need not be told to whoever is waited for anyway.
        if !waited_for || class == Class::NeedsPerson {
            self.tell(error, needs_person);
        }
        if let Some(pause) = &mut self.pause {
            pause.failures += 1;
            pause.shown = pause.shown.union(shown);
            if needs_person {
                // Whoever has looked has seen what was then; not this.
                pause.attended = Faults::NONE;
            }
        }
    }

    /// Tells of a pause, unless that is known.
    fn tell(&mut self, cause: ScannerError, needs_person: bool) {
        let told = Pause {
            cause,
            needs_person,
            columns: self.handed,
        };
        let unattended_until = self.unattended_until;
        let pause = self.pause.get_or_insert_with(|| Paused {
            told: Pause {
                columns: u32::MAX,
                ..told.clone()
            },
            unattended_until,
            shown: Faults::NONE,
            attended: Faults::NONE,
            failures: 0,
        });
        if pause.told != told {
            pause.told = told.clone();
            self.progress.push_back(Progress::Paused(told));
        }
    }

    fn end(&mut self, result: Result<(), ScannerError>) {
        if self.state != State::Over {
            self.state = State::Over;
            self.progress.push_back(Progress::Over(result));
        }
    }
}
