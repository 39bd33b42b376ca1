//! What the device does when asked.

use core::time::Duration;

use scanner_protocol::commands::{
    Aborted, ClearNamed, Continue, FaultsCleared, Hello, HelloReply, HomeStarted, LaserSet, Move,
    MoveStarted, NamedCleared, Nameplate, Scan as ScanRequest, ScanAccepted, ScanClosed,
    ScanContinued,
};
use scanner_protocol::{
    Faults, Frame, HostMessage, MIN_VERSION, Message, Packet, RejectReason, ScanEndReason, text,
};

use super::events::Event;
use super::scan::Scan;
use super::{Device, Task};
use crate::source::{Accepted, Refusal};

impl Device {
    pub(super) fn carry_out(&mut self, packet: Packet, message: HostMessage, now: Duration) {
        // These change nothing when repeated, and are not remembered.
        match &message {
            HostMessage::Hello(hello) => return self.hello(&packet, hello, now),
            HostMessage::Abort(_) => {
                self.halt(ScanEndReason::Closed, now);
                self.scan = None;
                self.log.push(Event::Aborted);
                return self.send(&Frame::new(packet.tag, &Aborted {}));
            }
            HostMessage::Grant(_) | HostMessage::Resend(_) if self.session.is_none() => return,
            _ if self.session.is_none() => {
                return self.reject(&packet, RejectReason::NoSession, 0);
            }
            HostMessage::Heartbeat(_) => {
                let status = self.status(now);
                return self.send(&Frame::new(packet.tag, &status));
            }
            HostMessage::Grant(grant) => return self.grant(grant, now),
            HostMessage::Resend(resend) => return self.queue_resend(resend),
            _ => {}
        }
        if let Some(reply) = self.once.recall(&packet).cloned() {
            return self.send(&reply);
        }
        // Whoever made it has asked for something else since.
        if self.once.is_late(&packet) {
            return;
        }
        let reply = match self.request(&packet, message, now) {
            Ok(reply) => reply,
            Err((reason, detail)) => self.rejection(&packet, reason, detail),
        };
        self.send(&reply);
        self.once.remember(packet, reply);
    }

    fn request(
        &mut self,
        packet: &Packet,
        message: HostMessage,
        now: Duration,
    ) -> Result<Frame, Refusal> {
        let tag = packet.tag;
        match message {
            HostMessage::Identify(_) => Ok(Frame::new(tag, &self.nameplate())),
            HostMessage::GetCalibration(_) => Ok(Frame::new(tag, &self.source.calibration())),
            HostMessage::GetLimits(_) => Ok(Frame::new(tag, &self.limits())),
            HostMessage::Home(_) => {
                self.ready(now)?;
                let reference = self.source.limits().table_min_counts;
                self.homed = false;
                self.start_table(reference, now);
                self.task = Task::Homing;
                reply(tag, &HomeStarted {})
            }
            HostMessage::Move(Move { table_counts }) => {
                self.ready(now)?;
                self.known_place()?;
                let limits = self.source.limits();
                if !(limits.table_min_counts..=limits.table_max_counts).contains(&table_counts) {
                    return Err((RejectReason::TableLimit, 0));
                }
                self.start_table(table_counts, now);
                self.task = Task::Moving;
                reply(tag, &MoveStarted {})
            }
            HostMessage::SetLaser(wish) => {
                if wish.on {
                    self.ready(now)?;
                } else if self.scan.as_ref().is_some_and(Scan::is_running) {
                    return Err((RejectReason::Busy, 0));
                }
                self.laser_by_hand = wish.on;
                self.set_laser(wish.on);
                reply(tag, &LaserSet { on: wish.on })
            }
            HostMessage::Scan(request) => {
                let accepted = self.begin(&request, 0, now)?;
                reply(
                    tag,
                    &ScanAccepted {
                        scan_id: request.scan_id,
                        columns: accepted.columns,
                        spacing_um: accepted.spacing_um,
                        uniform: accepted.uniform,
                    },
                )
            }
            HostMessage::Continue(request) => self.go_on(tag, &request, now),
            HostMessage::CloseScan(close) => {
                if self.scan.as_ref().is_some_and(|s| s.id() == close.scan_id) {
                    if self.scan.as_ref().is_some_and(Scan::is_running) {
                        self.halt(ScanEndReason::Closed, now);
                    }
                    self.scan = None;
                    self.log.push(Event::ScanClosed);
                }
                reply(
                    tag,
                    &ScanClosed {
                        scan_id: close.scan_id,
                    },
                )
            }
            HostMessage::ClearFaults(_) => {
                let remaining = self.clear(self.faults);
                reply(tag, &FaultsCleared { remaining })
            }
            HostMessage::ClearNamed(_) if self.version < ClearNamed::SINCE_VERSION => {
                Err((RejectReason::UnknownCommand, 0))
            }
            HostMessage::ClearNamed(clear) => {
                let remaining = self.clear(clear.faults);
                reply(tag, &NamedCleared { remaining })
            }
            // Handled before: they are not remembered.
            HostMessage::Hello(_)
            | HostMessage::Heartbeat(_)
            | HostMessage::Abort(_)
            | HostMessage::Grant(_)
            | HostMessage::Resend(_) => Err((RejectReason::NotSupported, 0)),
        }
    }

    /// Clears those of these faults whose cause is gone; gives all that remain.
    fn clear(&mut self, faults: Faults) -> Faults {
        let remaining = self.faults.without(faults).union(self.causes);
        if self.faults != remaining {
            self.faults = remaining;
            self.log.push(Event::Faults(remaining));
        }
        remaining
    }

    fn hello(&mut self, packet: &Packet, hello: &Hello, now: Duration) {
        let newest = self.settings.max_version;
        if hello.min_version > newest || hello.max_version < MIN_VERSION {
            let detail = u32::from(MIN_VERSION) | u32::from(newest) << 8;
            return self.reject(packet, RejectReason::Version, detail);
        }
        self.halt(ScanEndReason::Closed, now);
        self.scan = None;
        self.version = newest.min(hello.max_version);
        self.once.opened(self.version, packet.tag);
        // What a silent host brought about is over once there is a new session. What needs a
        // person's eye stays until somebody has said so.
        self.faults = self
            .causes
            .union(self.faults.intersection(Faults::ATTENDED));
        let wish = Duration::from_millis(u64::from(hello.dead_man_ms));
        let dead_man = wish.clamp(
            self.settings.dead_man_min,
            self.settings.dead_man_max.max(self.settings.dead_man_min),
        );
        self.session = Some(dead_man);
        self.log.push(Event::SessionOpened);
        let hello_reply = HelloReply {
            version: self.version,
            boot_id: self.boot_id(),
            dead_man_ms: milliseconds(dead_man),
        };
        self.send(&Frame::new(packet.tag, &hello_reply));
    }

    fn go_on(&mut self, tag: u16, request: &Continue, now: Duration) -> Result<Frame, Refusal> {
        let whole = ScanRequest {
            scan_id: request.scan_id,
            credits: request.credits,
            plan: request.plan,
        };
        let accepted = self.begin(&whole, request.first_column, now)?;
        reply(
            tag,
            &ScanContinued {
                scan_id: request.scan_id,
                columns: accepted.columns,
                spacing_um: accepted.spacing_um,
                uniform: accepted.uniform,
            },
        )
    }

    /// Begins a scan at one of its columns.
    fn begin(
        &mut self,
        request: &ScanRequest,
        first_column: u32,
        now: Duration,
    ) -> Result<Accepted, Refusal> {
        self.ready(now)?;
        self.known_place()?;
        let accepted = self.source.accept(&request.plan)?;
        if first_column >= accepted.columns {
            return Err((RejectReason::Zero, 0));
        }
        let start = self
            .source
            .table_counts(&request.plan, accepted, first_column);
        let repeat = if self.settings.fresh_noise {
            self.scans
        } else {
            0
        };
        self.scans += 1;
        self.laser_by_hand = false;
        self.set_laser(false);
        self.start_table(start, now);
        self.scan = Some(Scan::new(
            request,
            first_column,
            accepted,
            repeat,
            self.settings.credits_max,
        ));
        self.log.push(Event::ScanStarted {
            scan_id: request.scan_id,
            columns: accepted.columns,
        });
        Ok(accepted)
    }

    fn nameplate(&self) -> Nameplate {
        Nameplate {
            model: text(&self.settings.model),
            serial: text(self.serial()),
            firmware: text(&self.settings.firmware),
        }
    }

    fn limits(&self) -> scanner_protocol::Limits {
        let rate_millihz = self.settings.line_rate_hz.unwrap_or(0.0) * 1e3;
        scanner_protocol::Limits {
            max_line_rate_millihz: rate_millihz as u32,
            max_credits: self.settings.credits_max.max(1),
            min_dead_man_ms: milliseconds(self.settings.dead_man_min),
            max_dead_man_ms: milliseconds(self.settings.dead_man_max),
            ..self.source.limits()
        }
    }

    /// Whether something new may begin.
    fn ready(&self, now: Duration) -> Result<(), Refusal> {
        let faults = self.blocking_faults();
        if !faults.is_empty() {
            return Err((RejectReason::Faulted, faults.0));
        }
        let scanning = self.scan.as_ref().is_some_and(Scan::is_running);
        if scanning || self.drive.moves(now) {
            return Err((RejectReason::Busy, 0));
        }
        Ok(())
    }

    fn known_place(&self) -> Result<(), Refusal> {
        if self.homed {
            Ok(())
        } else {
            Err((RejectReason::NotHomed, 0))
        }
    }
}

fn reply<M: Message>(tag: u16, message: &M) -> Result<Frame, Refusal> {
    Ok(Frame::new(tag, message))
}

fn milliseconds(duration: Duration) -> u16 {
    u16::try_from(duration.as_millis()).unwrap_or(u16::MAX)
}
