//! What the session is asked to do.

use std::time::Duration;

use scanner_protocol::commands::{
    Abort, ClearFaults, ClearNamed, CloseScan, Continue, Heartbeat, Home, Move, Scan, SetLaser,
};
use scanner_protocol::{Faults, ScanPlan};

use super::request::{GoOn, Purpose};
use super::scan::{Acknowledged, Flow, Taken};
use super::{Command, Phase, Session, Ticket};
use crate::error::ScannerError;

impl Session {
    /// Has faults cleared whose cause is gone. A device of version 1 knows no difference between
    /// them.
    pub(super) fn clear_faults(&mut self, faults: Faults, purpose: Purpose) {
        if self.version >= ClearNamed::SINCE_VERSION {
            self.requests.push(&ClearNamed { faults }, purpose);
        } else {
            self.requests.push(&ClearFaults {}, purpose);
        }
    }

    /// Has a command carried out. Its outcome comes as [`super::Event::Finished`] with the
    /// ticket. Commands given before the device is ready wait, except for an abort.
    pub fn command(&mut self, ticket: Ticket, command: Command, now: Duration) {
        let begins = matches!(
            command,
            Command::Home
                | Command::HomeAgain { .. }
                | Command::Move(_)
                | Command::Laser(true)
                | Command::Scan(_)
        );
        if begins && self.scan_over {
            // Every column of the last scan is here, though not all are acknowledged. The
            // device may not have noticed its end yet, and would call itself busy.
            self.close_scan();
        }
        match (self.phase, command) {
            (Phase::Dead, _) => self.finish(ticket, Err(ScannerError::Closed)),
            (_, Command::Abort) => self.abort(Some(ticket)),
            (Phase::Opening, command) => self.waiting.push_back((ticket, command)),
            (Phase::Ready, Command::Status) => {
                self.status_asked = now;
                self.requests.push(&Heartbeat {}, Purpose::Status(ticket));
            }
            (Phase::Ready, Command::Home) => self.requests.push(&Home {}, Purpose::Home(ticket)),
            (Phase::Ready, Command::HomeAgain { attended }) => self
                .requests
                .push(&Home {}, Purpose::HomeAgain(ticket, attended)),
            (Phase::Ready, Command::Move(table_counts)) => self
                .requests
                .push(&Move { table_counts }, Purpose::Move(ticket, table_counts)),
            (Phase::Ready, Command::Laser(on)) => {
                self.requests.push(&SetLaser { on }, Purpose::Laser(ticket));
            }
            (Phase::Ready, Command::ClearFaults(faults)) => {
                self.clear_faults(faults, Purpose::ClearFaults(ticket));
            }
            (Phase::Ready, Command::Scan(plan)) => self.start_scan(ticket, plan),
        }
        self.poll(now);
    }

    /// Takes up a scan whose columns below `handed` are here, from `first_column` on. Its
    /// outcome comes like that of a command; those columns come again.
    pub fn go_on(
        &mut self,
        ticket: Ticket,
        plan: ScanPlan,
        first_column: u32,
        handed: u32,
        acknowledged: Acknowledged,
        now: Duration,
    ) {
        if self.phase != Phase::Ready || self.scan.is_some() || self.requests.has_scan() {
            return self.finish(ticket, Err(ScannerError::ScanRunning));
        }
        self.next_scan_id = self.next_scan_id.wrapping_add(1);
        let scan_id = self.next_scan_id;
        let taken = Taken {
            first_column,
            handed,
            acknowledged,
        };
        let send_below = taken.granted(first_column, self.flow(&plan).credits, plan.columns);
        self.requests.push(
            &Continue {
                scan_id,
                credits: u16::try_from(send_below.saturating_sub(first_column)).unwrap_or(u16::MAX),
                first_column,
                plan,
            },
            Purpose::Continue(Box::new(GoOn {
                ticket,
                scan_id,
                plan,
                taken,
            })),
        );
        self.poll(now);
    }

    /// A column is safe with the host.
    pub fn acknowledge(&mut self, column: u32, now: Duration) {
        match &mut self.scan {
            Some(scan) => scan.acknowledge(column, now),
            None => self.requests.acknowledge(column),
        }
    }

    /// Ends the scan, if there is one, without an event: nobody wants the rest.
    pub fn close_scan(&mut self) {
        if let Some(scan) = self.scan.take() {
            self.scan_over = false;
            self.unclosed = None;
            self.requests.push(
                &CloseScan {
                    scan_id: scan.scan_id(),
                },
                Purpose::CloseScan,
            );
        }
    }

    /// Whether the device has no scan any more, as far as it has answered; `None` while it has yet
    /// to do so.
    #[must_use]
    pub fn closed(&self) -> Option<Result<(), ScannerError>> {
        if !self.is_ready() || self.requests.has_close() {
            return None;
        }
        Some(self.unclosed.clone().map_or(Ok(()), Err))
    }

    fn abort(&mut self, ticket: Option<Ticket>) {
        // Whatever is open must not be repeated after the abort: a scan command that was
        // lost would start the scan after all.
        let opening: Vec<Purpose> = if self.phase == Phase::Opening {
            Vec::new()
        } else {
            self.requests.clear()
        };
        for purpose in &opening {
            self.fail(purpose, ScannerError::Aborted);
        }
        while let Some((waiting, _)) = self.waiting.pop_front() {
            self.finish(waiting, Err(ScannerError::Aborted));
        }
        self.stop_waiting(&ScannerError::Aborted);
        if let Some(earlier) = self.requests.clear_abort() {
            self.fail(&earlier, ScannerError::Aborted);
        }
        self.requests.push(&Abort {}, Purpose::Abort(ticket));
    }

    fn start_scan(&mut self, ticket: Ticket, plan: ScanPlan) {
        if self.scan.is_some() || self.requests.has_scan() {
            return self.finish(ticket, Err(ScannerError::ScanRunning));
        }
        self.next_scan_id = self.next_scan_id.wrapping_add(1);
        let scan_id = self.next_scan_id;
        self.ask_for_scan(ticket, scan_id, plan);
    }

    fn ask_for_scan(&mut self, ticket: Ticket, scan_id: u16, plan: ScanPlan) {
        let credits = self.flow(&plan).credits;
        self.requests.push(
            &Scan {
                scan_id,
                credits,
                plan,
            },
            Purpose::Scan(ticket, scan_id, plan),
        );
    }

    /// Makes a refused request again, now that the faults are cleared.
    pub(super) fn ask_again(&mut self, refused: Purpose) {
        match refused {
            Purpose::Home(_) | Purpose::HomeAgain(..) => self.requests.push(&Home {}, refused),
            Purpose::Move(_, table_counts) => self.requests.push(&Move { table_counts }, refused),
            Purpose::Scan(ticket, scan_id, plan) => self.ask_for_scan(ticket, scan_id, plan),
            other => self.fail(&other, ScannerError::Closed),
        }
    }

    /// The bounds of a scan's flow: the stricter of the settings' and the device's.
    pub(super) fn flow(&self, plan: &ScanPlan) -> Flow {
        let limits = self.identity.as_ref().map(|identity| &identity.limits);
        Flow {
            credits: limits
                .map_or(1, |limits| limits.max_credits)
                .min(self.settings.credits),
            // A device that plays a recording keeps to its own limit, not to the plan.
            max_samples: limits.map_or(plan.samples, |limits| limits.max_samples),
            resend_timeout: self.settings.resend_timeout,
            resend_attempts: self.settings.resend_attempts,
            column_timeout: self.settings.column_timeout,
        }
    }

    /// Ends the scan with an event.
    pub(super) fn end_scan(&mut self, result: Result<(), ScannerError>) {
        let failed = result.is_err();
        self.events.push_back(super::Event::ScanOver(result));
        self.scan_over = true;
        if failed {
            // Laser off; what is still in the device is not wanted.
            self.close_scan();
        }
    }
}
