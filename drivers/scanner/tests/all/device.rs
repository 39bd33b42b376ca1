//! A device as the protocol page describes it, as small as can be: bytes and time in,
//! frames out.

use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

use scanner_driver::protocol::commands::*;
use scanner_driver::protocol::events::*;
use scanner_driver::protocol::*;

pub(crate) struct Device {
    pub(crate) boot_id: u32,
    pub(crate) version: u8,
    pub(crate) serial: &'static str,
    /// Depth of a count, picometres.
    pub(crate) count_pm: u32,
    pub(crate) homed: bool,
    pub(crate) faults: Faults,
    /// Faults whose cause is there still.
    pub(crate) lasting: Faults,
    /// Faults that come up just before the next clearing.
    pub(crate) before_clearing: Faults,
    pub(crate) laser_on: bool,
    pub(crate) activity: Activity,
    pub(crate) table_counts: i32,
    pub(crate) max_credits: u16,
    pub(crate) dead_man_limit_ms: u16,
    /// Columns announced in place of those planned.
    pub(crate) announce: Option<u32>,
    /// Most columns sent at one poll.
    pub(crate) columns_per_poll: usize,
    /// Sends columns whose fragments disagree.
    pub(crate) contradictory: bool,
    /// Columns in which nothing stands.
    pub(crate) gap: Range<u32>,
    /// How far the object has been moved, counts of range.
    pub(crate) moved_counts: i32,
    /// How often each kind of request was carried out.
    pub(crate) homings: u32,
    /// The tags of all but heartbeats and stream frames, each once.
    pub(crate) asked: Vec<u16>,
    pub(crate) scans: u32,
    pub(crate) aborts: u32,
    pub(crate) most_unacknowledged: u32,
    pub(crate) decoder: Decoder,
    pub(crate) once: OnceOnly,
    pub(crate) in_session: bool,
    pub(crate) out: VecDeque<Frame>,
    pub(crate) tag: u16,
    pub(crate) heard: Duration,
    pub(crate) dead_man: Duration,
    pub(crate) homing_until: Option<Duration>,
    pub(crate) scan: Option<Scanning>,
}

pub(crate) struct Scanning {
    id: u16,
    columns: u32,
    next: u32,
    acknowledged_below: u32,
    send_below: u32,
    resend: VecDeque<Resend>,
    end: Option<(ScanEnd, Duration)>,
}

/// What a column holds: a few shapes in turn, empty and irregular ones among them.
pub(crate) fn samples_of(column: u32) -> Vec<Sample> {
    let count = [17, 0, 1, 40, 15, 93][column as usize % 6];
    (0..count)
        .map(|i| Sample {
            lateral_counts: -500 + 25 * i + if column.is_multiple_of(4) { i % 3 } else { 0 },
            reading: if (i + column as i32) % 11 == 5 {
                Reading::NO_RETURN
            } else {
                Reading {
                    range_counts: 70_000 + 13 * i - column as i32,
                    intensity: (i * 5) as u8,
                    no_return: false,
                    saturated: i % 13 == 0,
                }
            },
        })
        .collect()
}

pub(crate) fn table_of(column: u32) -> i32 {
    1_000 + 40 * column as i32
}

impl Device {
    pub(crate) fn new() -> Self {
        Self {
            boot_id: 77,
            version: MAX_VERSION,
            serial: "0001",
            count_pm: 10_000,
            homed: false,
            faults: Faults::NONE,
            lasting: Faults::NONE,
            before_clearing: Faults::NONE,
            laser_on: false,
            activity: Activity::Idle,
            table_counts: 0,
            max_credits: 16,
            dead_man_limit_ms: 5_000,
            announce: None,
            columns_per_poll: 2,
            contradictory: false,
            gap: 0..0,
            moved_counts: 0,
            homings: 0,
            asked: Vec::new(),
            scans: 0,
            aborts: 0,
            most_unacknowledged: 0,
            decoder: Decoder::new(),
            once: OnceOnly::default(),
            in_session: false,
            out: VecDeque::new(),
            tag: 0,
            heard: Duration::ZERO,
            dead_man: Duration::MAX,
            homing_until: None,
            scan: None,
        }
    }

    pub(crate) fn homed() -> Self {
        Self {
            homed: true,
            ..Self::new()
        }
    }

    pub(crate) fn is_measuring(&self) -> bool {
        self.scan.as_ref().is_some_and(|scan| scan.end.is_none())
    }

    pub(crate) fn has_scan(&self) -> bool {
        self.scan.is_some()
    }

    pub(crate) fn sent_columns(&self) -> u32 {
        self.scan.as_ref().map_or(0, |scan| scan.next)
    }

    /// Starts anew, as after a power cut.
    pub(crate) fn reboot(&mut self, with_banner: bool) {
        *self = Self {
            boot_id: self.boot_id + 1,
            homings: self.homings,
            scans: self.scans,
            aborts: self.aborts,
            ..Self::new()
        };
        if with_banner {
            self.tell(&Banner {
                min_version: 1,
                max_version: self.version,
                boot_id: self.boot_id,
                cause: ResetCause::BrownOut,
            });
        }
    }

    /// A fault strikes.
    pub(crate) fn strike(&mut self, fault: Faults, now: Duration) {
        self.faults = self.faults | fault;
        self.end_scan(ScanEndReason::Fault, now);
        self.activity = Activity::Faulted;
        self.laser_on = false;
    }

    fn end_scan(&mut self, reason: ScanEndReason, now: Duration) {
        self.laser_on = false;
        self.activity = Activity::Idle;
        let faults = self.faults;
        if let Some(scan) = self.scan.as_mut().filter(|scan| scan.end.is_none()) {
            let end = ScanEnd {
                scan_id: scan.id,
                columns: scan.next,
                reason,
                faults,
            };
            scan.end = Some((end, now));
        }
    }

    pub(crate) fn receive(&mut self, mut bytes: &[u8], now: Duration) {
        while let Some(packet) = self.decoder.next(&mut bytes) {
            self.heard = now;
            if let Some(reply) = self.once.recall(&packet) {
                let reply = reply.clone();
                self.out.push_back(reply);
                continue;
            }
            let Ok(message) = HostMessage::decode(&packet) else {
                continue;
            };
            let tag = packet.tag;
            let counts = !matches!(
                message,
                HostMessage::Heartbeat(_) | HostMessage::Grant(_) | HostMessage::Resend(_)
            );
            if counts && self.asked.last() != Some(&tag) {
                self.asked.push(tag);
            }
            let before = self.out.len();
            let repeatable = matches!(message, HostMessage::Heartbeat(_) | HostMessage::Abort(_));
            self.message(message, tag, packet.kind, now);
            if let Some(reply) = self.out.get(before).filter(|_| !repeatable) {
                self.once.remember(packet, reply.clone());
            }
        }
    }

    fn message(&mut self, message: HostMessage, tag: u16, kind: u8, now: Duration) {
        let reject = |reason, detail| {
            Frame::new(
                tag,
                &Rejected {
                    request: kind,
                    reason,
                    detail,
                },
            )
        };
        let reply = match message {
            HostMessage::Hello(hello) => {
                if !(hello.min_version..=hello.max_version).contains(&self.version) {
                    let both = u32::from(self.version) * 0x101;
                    self.out.push_back(reject(RejectReason::Version, both));
                    return;
                }
                self.once.forget();
                self.in_session = true;
                self.scan = None;
                self.laser_on = false;
                let dead_man_ms = hello.dead_man_ms.min(self.dead_man_limit_ms);
                self.dead_man = Duration::from_millis(dead_man_ms.into());
                Frame::new(
                    tag,
                    &HelloReply {
                        version: self.version,
                        boot_id: self.boot_id,
                        dead_man_ms,
                    },
                )
            }
            HostMessage::Abort(_) => {
                self.aborts += 1;
                self.scan = None;
                self.laser_on = false;
                self.activity = Activity::Idle;
                Frame::new(tag, &Aborted {})
            }
            _ if !self.in_session => reject(RejectReason::NoSession, 0),
            HostMessage::Identify(_) => Frame::new(
                tag,
                &Nameplate {
                    model: text("Bench"),
                    serial: text(self.serial),
                    firmware: text("1.2.3"),
                },
            ),
            HostMessage::GetCalibration(_) => Frame::new(
                tag,
                &Calibration {
                    table_count_pm: 10_000_000,
                    table_origin_nm: 0,
                    head: Head::Cartesian {
                        count_pm: self.count_pm,
                    },
                },
            ),
            HostMessage::GetLimits(_) => Frame::new(tag, &self.limits()),
            HostMessage::Heartbeat(_) => Frame::new(tag, &self.status(now)),
            HostMessage::Home(_) | HostMessage::Scan(_) | HostMessage::Continue(_)
                if !self.faults.is_empty() =>
            {
                reject(RejectReason::Faulted, self.faults.0)
            }
            HostMessage::Home(_) if self.is_measuring() => reject(RejectReason::Busy, 0),
            HostMessage::Home(_) => {
                self.homings += 1;
                self.homed = false;
                self.activity = Activity::Homing;
                self.homing_until = Some(now + Duration::from_millis(700));
                Frame::new(tag, &HomeStarted {})
            }
            HostMessage::Move(to) => {
                self.table_counts = to.table_counts;
                Frame::new(tag, &MoveStarted {})
            }
            HostMessage::SetLaser(set) => {
                self.laser_on = set.on;
                Frame::new(tag, &LaserSet { on: set.on })
            }
            HostMessage::ClearNamed(clear) => {
                assert!(self.version >= 2, "a device of version 1 does not know it");
                // What nobody has seen yet.
                self.faults = self.faults.union(std::mem::take(&mut self.before_clearing));
                self.faults = self.faults.without(clear.faults).union(self.lasting);
                if self.faults.is_empty() {
                    self.activity = Activity::Idle;
                }
                Frame::new(
                    tag,
                    &NamedCleared {
                        remaining: self.faults,
                    },
                )
            }
            HostMessage::ClearFaults(_) => {
                assert!(self.version < 2, "it clears what nobody has seen");
                self.faults = self.lasting;
                self.activity = Activity::Idle;
                Frame::new(
                    tag,
                    &FaultsCleared {
                        remaining: self.faults,
                    },
                )
            }
            HostMessage::Scan(_) | HostMessage::Continue(_) if !self.homed => {
                reject(RejectReason::NotHomed, 0)
            }
            HostMessage::Scan(_) | HostMessage::Continue(_) if self.is_measuring() => {
                reject(RejectReason::Busy, 0)
            }
            HostMessage::Continue(request) => {
                self.scans += 1;
                self.laser_on = true;
                self.activity = Activity::Scanning;
                self.scan = Some(Scanning {
                    id: request.scan_id,
                    columns: request.plan.columns,
                    next: request.first_column,
                    acknowledged_below: request.first_column,
                    send_below: request.first_column + u32::from(request.credits),
                    resend: VecDeque::new(),
                    end: None,
                });
                Frame::new(
                    tag,
                    &ScanContinued {
                        scan_id: request.scan_id,
                        columns: request.plan.columns,
                        spacing_um: 400,
                        uniform: false,
                    },
                )
            }
            HostMessage::Scan(scan) => {
                self.scans += 1;
                self.laser_on = true;
                self.activity = Activity::Scanning;
                let columns = self.announce.unwrap_or(scan.plan.columns);
                self.scan = Some(Scanning {
                    id: scan.scan_id,
                    columns: scan.plan.columns,
                    next: 0,
                    acknowledged_below: 0,
                    send_below: scan.credits.into(),
                    resend: VecDeque::new(),
                    end: None,
                });
                Frame::new(
                    tag,
                    &ScanAccepted {
                        scan_id: scan.scan_id,
                        columns,
                        spacing_um: 400,
                        uniform: false,
                    },
                )
            }
            HostMessage::CloseScan(close) => {
                if self
                    .scan
                    .as_ref()
                    .is_some_and(|scan| scan.id == close.scan_id)
                {
                    self.scan = None;
                    self.laser_on = false;
                    self.activity = Activity::Idle;
                }
                Frame::new(
                    tag,
                    &ScanClosed {
                        scan_id: close.scan_id,
                    },
                )
            }
            HostMessage::Grant(grant) => {
                if let Some(scan) = self.scan.as_mut().filter(|s| s.id == grant.scan_id) {
                    scan.acknowledged_below = scan.acknowledged_below.max(grant.acknowledged_below);
                    scan.send_below = scan.send_below.max(grant.send_below);
                }
                return;
            }
            HostMessage::Resend(resend) => {
                if let Some(scan) = self.scan.as_mut().filter(|s| s.id == resend.scan_id)
                    && (scan.acknowledged_below..scan.next).contains(&resend.column)
                {
                    scan.resend.push_back(resend);
                }
                return;
            }
        };
        self.out.push_back(reply);
    }

    fn limits(&self) -> Limits {
        Limits {
            table_min_counts: -1_000_000,
            table_max_counts: 1_000_000,
            lateral_min_counts: -1_000_000,
            lateral_max_counts: 1_000_000,
            max_line_rate_millihz: 0,
            max_columns: 1_000_000,
            max_samples: 2_000,
            max_credits: self.max_credits,
            min_exposure_us: 0,
            max_exposure_us: 1_000_000,
            min_dead_man_ms: 100,
            max_dead_man_ms: self.dead_man_limit_ms,
            proposed: crate::bench::plan(240),
        }
    }

    fn status(&self, now: Duration) -> Status {
        Status {
            boot_id: self.boot_id,
            uptime_ms: now.as_millis() as u32,
            activity: self.activity,
            homed: self.homed,
            laser_on: self.laser_on,
            faults: self.faults,
            table_counts: self.table_counts,
            temperature_cdegc: 3_150,
            scan_id: self.scan.as_ref().map_or(0, |scan| scan.id),
            columns: self.sent_columns(),
        }
    }

    fn tell<M: Message>(&mut self, message: &M) {
        self.tag = self.tag.wrapping_add(1);
        self.out.push_back(Frame::new(self.tag, message));
    }

    fn measure(&self, column: u32) -> Vec<Sample> {
        if self.gap.contains(&column) {
            return Vec::new();
        }
        let mut samples = samples_of(column);
        for sample in samples.iter_mut().filter(|s| !s.reading.no_return) {
            sample.reading.range_counts += self.moved_counts;
        }
        samples
    }

    fn send_column(&mut self, scan_id: u16, column: u32, wanted: &Missing) {
        let samples = self.measure(column);
        let listed = column.is_multiple_of(4);
        let size = if listed {
            LISTED_SAMPLES
        } else {
            UNIFORM_SAMPLES
        };
        let fragments = samples.len().div_ceil(size) as u16;
        for (fragment, chunk) in (0_u16..).zip(samples.chunks(size)) {
            if !wanted.contains(fragment) {
                continue;
            }
            let laterals = if listed {
                Laterals::Listed(heapless_from(chunk.iter().copied()))
            } else {
                Laterals::Uniform {
                    first_counts: chunk[0].lateral_counts,
                    step_counts: 25,
                    readings: heapless_from(chunk.iter().map(|sample| sample.reading)),
                }
            };
            let shift = i32::from(self.contradictory && column == 3) * i32::from(fragment);
            self.tell(&ColumnFragment {
                scan_id,
                column,
                fragment,
                fragments,
                first_sample: fragment * size as u16,
                table_counts: table_of(column) + shift,
                laterals,
            });
        }
        self.tell(&ColumnEnd {
            scan_id,
            column,
            table_counts: table_of(column),
            fragments,
            samples: samples.len() as u16,
        });
    }

    /// What the device sends now.
    pub(crate) fn poll(&mut self, now: Duration) -> Vec<Frame> {
        if self.homing_until.is_some_and(|until| now >= until) {
            self.homing_until = None;
            self.homed = true;
            self.activity = Activity::Idle;
        }
        if now > self.heard.saturating_add(self.dead_man) && self.faults.is_empty() {
            self.faults = Faults::DEAD_MAN;
            self.end_scan(ScanEndReason::DeadMan, now);
        }
        while let Some((id, resend)) = self
            .scan
            .as_mut()
            .and_then(|scan| Some((scan.id, scan.resend.pop_front()?)))
        {
            self.send_column(id, resend.column, &resend.missing);
        }
        for _ in 0..self.columns_per_poll {
            let Some(scan) = self.scan.as_mut().filter(|scan| scan.end.is_none()) else {
                break;
            };
            if scan.next >= scan.columns {
                self.end_scan(ScanEndReason::Complete, now);
                break;
            }
            if scan.next >= scan.send_below {
                break;
            }
            let (id, column) = (scan.id, scan.next);
            scan.next += 1;
            self.most_unacknowledged = self
                .most_unacknowledged
                .max(scan.next - scan.acknowledged_below);
            self.send_column(id, column, &Missing::whole());
        }
        if let Some((end, due)) = self.scan.as_mut().and_then(|scan| scan.end.as_mut())
            && now >= *due
        {
            *due = now + Duration::from_millis(250);
            let end = end.clone();
            self.tell(&end);
        }
        self.out.drain(..).collect()
    }
}

/// A fixed-size list, of a size inferred, from items known to fit.
fn heapless_from<C, T>(items: impl Iterator<Item = T>) -> C
where
    C: Default + Extend<T>,
{
    let mut list = C::default();
    list.extend(items);
    list
}
