//! What the device says, message by message.

use std::time::Duration;

use scanner_protocol::commands::{
    Abort, ClearFaults, ClearNamed, CloseScan, Continue, GetCalibration, GetLimits, Heartbeat,
    Hello, Home, Identify, Move, Scan, ScanAccepted, ScanContinued, SetLaser,
};
use scanner_protocol::{
    Activity, DeviceMessage, Faults, HostMessage, Message, Packet, RejectReason, Rejected, Status,
};

use super::request::Purpose;
use super::scan::{ScanTracker, Taken};
use super::{Answer, Motion, Phase, Session, Ticket, on_its_way};
use crate::error::ScannerError;
use crate::limits::MAX_SCAN_COLUMNS;
use crate::scanner::ScanInfo;

impl Session {
    pub(super) fn packet(&mut self, packet: &Packet, now: Duration) {
        match DeviceMessage::decode(packet) {
            Ok(message) => {
                self.last_heard = now;
                tracing::trace!(name = message.name(), tag = packet.tag, "received");
                self.message(message, packet.tag, now);
            }
            Err(_) if HostMessage::decode(packet).is_ok() => self.echoes += 1,
            Err(error) => {
                self.unreadable += 1;
                tracing::debug!(kind = packet.kind, %error, "unreadable message");
            }
        }
    }

    fn message(&mut self, message: DeviceMessage, tag: u16, now: Duration) {
        match message {
            DeviceMessage::HelloReply(reply) => {
                if self.requests.answered(tag, Hello::KIND).is_some() {
                    self.on_hello(&reply);
                }
            }
            DeviceMessage::Nameplate(nameplate) => {
                if self.requests.answered(tag, Identify::KIND).is_some() {
                    self.on_nameplate(nameplate);
                }
            }
            DeviceMessage::Calibration(calibration) => {
                if self.requests.answered(tag, GetCalibration::KIND).is_some() {
                    self.on_calibration(calibration);
                }
            }
            DeviceMessage::Limits(limits) => {
                if self.requests.answered(tag, GetLimits::KIND).is_some() {
                    self.on_limits(limits, now);
                }
            }
            DeviceMessage::Status(status) => {
                let purpose = self.requests.answered(tag, Heartbeat::KIND);
                if self.on_status(&status, purpose.is_some(), now)
                    && let Some(Purpose::Status(ticket)) = purpose
                {
                    let status = self.device_status(&status);
                    self.finish(ticket, Ok(Answer::Status(status)));
                } else if let Some(purpose) = purpose {
                    self.fail(&purpose, restarted("noticed by its status"));
                }
            }
            DeviceMessage::StatusChanged(status) => {
                self.on_status(&status.0, false, now);
            }
            DeviceMessage::HomeStarted(_) => {
                if let Some(Purpose::Home(ticket) | Purpose::HomeAgain(ticket, _)) =
                    self.requests.answered(tag, Home::KIND)
                {
                    self.start_motion(ticket, None, now);
                }
            }
            DeviceMessage::MoveStarted(_) => {
                if let Some(Purpose::Move(ticket, target)) = self.requests.answered(tag, Move::KIND)
                {
                    self.start_motion(ticket, Some(target), now);
                }
            }
            DeviceMessage::LaserSet(_) => self.done(tag, SetLaser::KIND),
            DeviceMessage::FaultsCleared(reply) => {
                self.on_faults_cleared(reply.remaining, tag, ClearFaults::KIND);
            }
            DeviceMessage::NamedCleared(reply) => {
                self.on_faults_cleared(reply.remaining, tag, ClearNamed::KIND);
            }
            DeviceMessage::ScanClosed(_) => self.done(tag, CloseScan::KIND),
            DeviceMessage::Aborted(_) => self.done(tag, Abort::KIND),
            DeviceMessage::ScanAccepted(reply) => self.on_accepted(&reply, tag, now),
            DeviceMessage::ScanContinued(reply) => self.on_continued(&reply, tag, now),
            DeviceMessage::Rejected(reply) => self.on_rejected(&reply, tag, now),
            DeviceMessage::Banner(banner) => {
                // The banner of the start that we know may come late.
                if self.phase == Phase::Opening || banner.boot_id != self.boot_id {
                    self.restart(&banner.cause.to_string(), now);
                }
            }
            DeviceMessage::ColumnFragment(fragment) => {
                if let Some(scan) = self.scan.as_mut().filter(|_| !self.scan_over) {
                    scan.fragment(&fragment, now);
                }
            }
            DeviceMessage::ColumnEnd(end) => {
                if let Some(scan) = self.scan.as_mut().filter(|_| !self.scan_over) {
                    scan.column_end(&end, now);
                }
            }
            DeviceMessage::ScanEnd(end) => {
                if let Some(scan) = self.scan.as_mut().filter(|_| !self.scan_over) {
                    scan.scan_end(end);
                }
            }
        }
    }

    /// A reply that tells nothing but that it is done.
    fn done(&mut self, tag: u16, kind: u8) {
        if let Some(ticket) = self
            .requests
            .answered(tag, kind)
            .and_then(|purpose| purpose.ticket())
        {
            self.finish(ticket, Ok(Answer::Done));
        }
    }

    fn on_accepted(&mut self, reply: &ScanAccepted, tag: u16, now: Duration) {
        let Some(Purpose::Scan(ticket, scan_id, plan)) = self.requests.answered(tag, Scan::KIND)
        else {
            return;
        };
        let info = ScanInfo {
            columns: reply.columns,
            spacing_um: reply.spacing_um,
            uniform: reply.uniform,
        };
        let taken = Taken::default();
        self.scan = Some(ScanTracker::new(
            scan_id,
            info,
            self.flow(&plan),
            taken,
            now,
        ));
        self.scan_over = false;
        if reply.columns == 0 || reply.columns > MAX_SCAN_COLUMNS {
            self.close_scan();
            let error = ScannerError::Protocol(format!(
                "it announced {} columns (1 to {MAX_SCAN_COLUMNS} are possible)",
                reply.columns
            ));
            return self.finish(ticket, Err(error));
        }
        self.finish(ticket, Ok(Answer::Scan(info)));
    }

    fn on_continued(&mut self, reply: &ScanContinued, tag: u16, now: Duration) {
        let Some(Purpose::Continue(go_on)) = self.requests.answered(tag, Continue::KIND) else {
            return;
        };
        let info = ScanInfo {
            columns: reply.columns,
            spacing_um: reply.spacing_um,
            uniform: reply.uniform,
        };
        let flow = self.flow(&go_on.plan);
        self.scan = Some(ScanTracker::new(
            go_on.scan_id,
            info,
            flow,
            go_on.taken,
            now,
        ));
        self.scan_over = false;
        // The caller knows how many columns there were before.
        self.finish(go_on.ticket, Ok(Answer::Scan(info)));
    }

    fn on_faults_cleared(&mut self, remaining: Faults, tag: u16, kind: u8) {
        let left = if remaining.is_empty() {
            Ok(Answer::Done)
        } else {
            Err(ScannerError::Fault(remaining))
        };
        match self.requests.answered(tag, kind) {
            Some(Purpose::ClearFaults(ticket)) => self.finish(ticket, left),
            Some(Purpose::Recover(refused)) => match left {
                Ok(_) => self.ask_again(*refused),
                Err(error) => self.fail(&refused, error),
            },
            _ => {}
        }
    }

    fn on_rejected(&mut self, reply: &Rejected, tag: u16, now: Duration) {
        let Some(purpose) = self.requests.answered(tag, reply.request) else {
            return;
        };
        if reply.reason == RejectReason::Version {
            let [min, max, ..] = reply.detail.to_le_bytes();
            let error = self.version_error(min, max);
            return self.lose(error);
        }
        if reply.reason == RejectReason::NoSession {
            self.fail(&purpose, restarted("it knows of no session"));
            return self.restart("it knows of no session", now);
        }
        // A fault may be over and only its bit still set; whoever starts something new has
        // seen to it. Tried once, so that a device that contradicts itself ends it.
        let faults = Faults(reply.detail);
        let unseen = faults
            .intersection(Faults::ATTENDED)
            .without(purpose.attended());
        if reply.reason == RejectReason::Faulted && !unseen.is_empty() {
            return self.fail(&purpose, ScannerError::Fault(faults));
        }
        if reply.reason == RejectReason::Faulted
            && purpose.starts_motion()
            && self.recovered != purpose.ticket()
        {
            self.recovered = purpose.ticket();
            // Only what has been told of: what came up since then has been seen by nobody.
            let seen = faults.union(Faults::REPORTED_ONLY);
            self.clear_faults(seen, Purpose::Recover(Box::new(purpose)));
            return;
        }
        let error = ScannerError::Refused {
            command: purpose.verb(),
            reason: reply.reason,
            detail: reply.detail,
        };
        if purpose.is_opening() {
            self.lose(error);
        } else {
            self.fail(&purpose, error);
        }
    }

    /// Takes a status into account; `false` if it shows that the device has restarted. One
    /// that answers a request is `fresh`; another may be late.
    fn on_status(&mut self, status: &Status, fresh: bool, now: Duration) -> bool {
        if self.phase != Phase::Ready {
            return true;
        }
        if status.boot_id != self.boot_id {
            self.restart("noticed by its status", now);
            return false;
        }
        if fresh {
            self.check_motion(status);
        }
        if let Some(scan) = self.scan.as_mut().filter(|_| !self.scan_over) {
            if scan.scan_id() == status.scan_id {
                scan.sent(status.columns);
                if on_its_way(status.activity) {
                    scan.excuse(now);
                }
            } else if fresh {
                self.end_scan(Err(ScannerError::Protocol(
                    "it no longer knows the running scan".to_owned(),
                )));
            }
        } else if fresh && self.scan.is_none() && self.requests.is_idle() && status.scan_id != 0 {
            // A request that came late, or twice: nobody wants this scan, nor to be told of its
            // end again and again.
            tracing::warn!(scan = status.scan_id, "closing a scan nobody asked for");
            let unwanted = CloseScan {
                scan_id: status.scan_id,
            };
            self.requests.push(&unwanted, Purpose::CloseScan);
        }
        true
    }

    fn start_motion(&mut self, ticket: Ticket, target_counts: Option<i32>, now: Duration) {
        self.motion = Some(Motion {
            ticket,
            target_counts,
            due: now + self.settings.motion_timeout,
        });
    }

    fn check_motion(&mut self, status: &Status) {
        let Some(motion) = self.motion else { return };
        let arrived = status.homed
            && motion
                .target_counts
                .is_none_or(|target| target == status.table_counts);
        let result = match status.activity {
            Activity::Idle if arrived => Ok(Answer::Done),
            Activity::Idle | Activity::Faulted => Err(if status.faults.is_empty() {
                ScannerError::Halted
            } else if status.faults == Faults::DEAD_MAN {
                ScannerError::DeadMan
            } else {
                ScannerError::Fault(status.faults)
            }),
            _ => return,
        };
        self.motion = None;
        self.finish(motion.ticket, result);
    }

    /// The device has started anew: all that was under way is void, and it must be greeted.
    fn restart(&mut self, cause: &str, now: Duration) {
        if self.phase == Phase::Opening {
            // Nothing is lost but the greeting. Commands go on waiting.
            self.requests.clear();
        } else {
            tracing::warn!(cause, port = self.port, "the scanner has restarted");
            self.fail_all(&restarted(cause));
        }
        self.open(now);
    }
}

fn restarted(cause: &str) -> ScannerError {
    ScannerError::Restarted {
        cause: cause.to_owned(),
    }
}
