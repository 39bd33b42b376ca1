//! A scan: pace, credit, fragments, and what is asked for again.

use core::time::Duration;
use std::collections::VecDeque;

use scanner_protocol::commands::{Grant, Missing, Resend, Scan as ScanRequest};
use scanner_protocol::events::{LISTED_SAMPLES, Laterals, UNIFORM_SAMPLES};
use scanner_protocol::{
    Activity, ColumnEnd, ColumnFragment, Faults, Reading, Sample as WireSample, ScanEnd,
    ScanEndReason, ScanPlan,
};

use super::events::Event;
use super::{Device, POLL_BYTES};
use crate::Vec3;
use crate::scanner::{Column, Sample};
use crate::source::Accepted;

/// Requests for columns kept until there is room to send: more than a host in its senses has.
const RESENDS_MAX: usize = 256;

/// A scan from its acceptance until the host closes it.
#[derive(Debug)]
pub(super) struct Scan {
    id: u16,
    plan: ScanPlan,
    accepted: Accepted,
    repeat: u64,
    credits_max: u32,
    /// The table is at the first column.
    begun: bool,
    sent: u32,
    acknowledged_below: u32,
    send_below: u32,
    /// When the next column is measured.
    next_column: Duration,
    /// The lack of credit has been told of.
    starved: bool,
    resends: VecDeque<(u32, Missing)>,
    end: Option<(ScanEndReason, Faults)>,
    next_end: Duration,
    /// Where the object stood for the columns below an index, for each time that it was moved:
    /// a column sent again holds what was measured.
    moves: Vec<(u32, Vec3)>,
}

impl Scan {
    pub(super) fn new(
        request: &ScanRequest,
        first_column: u32,
        accepted: Accepted,
        repeat: u64,
        credits_max: u16,
    ) -> Self {
        let credits_max = u32::from(credits_max.max(1));
        Self {
            id: request.scan_id,
            plan: request.plan,
            accepted,
            repeat,
            credits_max,
            begun: false,
            sent: first_column,
            acknowledged_below: first_column,
            send_below: first_column.saturating_add(u32::from(request.credits).min(credits_max)),
            next_column: Duration::ZERO,
            starved: false,
            resends: VecDeque::new(),
            end: None,
            next_end: Duration::ZERO,
            moves: Vec::new(),
        }
    }

    pub(super) fn id(&self) -> u16 {
        self.id
    }

    /// The object is about to be moved from there.
    pub(super) fn note_move(&mut self, from_mm: Vec3) {
        self.moves.push((self.sent, from_mm));
    }

    pub(super) fn sent(&self) -> u32 {
        self.sent
    }

    pub(super) fn acknowledged(&self) -> u32 {
        self.acknowledged_below
    }

    pub(super) fn is_running(&self) -> bool {
        self.end.is_none()
    }

    fn has_credit(&self) -> bool {
        self.sent < self.send_below
    }

    /// What the device is at on account of this scan. `stepped` holds the columns back.
    pub(super) fn activity(&self, stepped: bool) -> Option<Activity> {
        if self.end.is_some() {
            None
        } else if !self.begun {
            Some(Activity::Moving)
        } else if self.has_credit() && !stepped {
            Some(Activity::Scanning)
        } else {
            Some(Activity::Waiting)
        }
    }

    /// When there is something to do.
    pub(super) fn due(&self, stepped: bool, now: Duration) -> Option<Duration> {
        if !self.resends.is_empty() {
            return Some(now);
        }
        match self.end {
            Some(_) => Some(self.next_end),
            None if self.begun && self.sent >= self.accepted.columns => Some(now),
            None if self.begun && self.has_credit() && !stepped => Some(self.next_column.max(now)),
            None => None,
        }
    }
}

impl Device {
    pub(super) fn grant(&mut self, grant: &Grant, now: Duration) {
        let Some(scan) = self.scan.as_mut().filter(|s| s.id == grant.scan_id) else {
            return;
        };
        let below = grant.acknowledged_below.min(scan.sent);
        if below > scan.acknowledged_below {
            scan.acknowledged_below = below;
            self.log.push(Event::Acknowledged(below));
        }
        let most = scan.acknowledged_below.saturating_add(scan.credits_max);
        let had_credit = scan.has_credit();
        scan.send_below = scan.send_below.max(grant.send_below.min(most));
        if !had_credit && scan.has_credit() {
            // The table stood meanwhile: the pace starts afresh.
            scan.starved = false;
            scan.next_column = scan.next_column.max(now);
        }
    }

    pub(super) fn queue_resend(&mut self, resend: &Resend) {
        let Some(scan) = self.scan.as_mut().filter(|s| s.id == resend.scan_id) else {
            return;
        };
        let kept = scan.acknowledged_below..scan.sent;
        let wish = (resend.column, resend.missing.clone());
        if kept.contains(&resend.column)
            && scan.resends.len() < RESENDS_MAX
            && !scan.resends.contains(&wish)
        {
            scan.resends.push_back(wish);
        }
    }

    pub(super) fn end_scan(&mut self, reason: ScanEndReason, now: Duration) {
        let faults = if matches!(reason, ScanEndReason::Fault | ScanEndReason::DeadMan) {
            self.faults
        } else {
            Faults::NONE
        };
        if let Some(scan) = self.scan.as_mut().filter(|s| s.is_running()) {
            scan.end = Some((reason, faults));
            scan.next_end = now;
            self.log.push(Event::ScanEnded(reason));
        }
    }

    /// Sends what is due of the scan, until the line is busy for a while.
    pub(super) fn scan_work(&mut self, now: Duration) {
        while self.out.len() < POLL_BYTES {
            let Some(scan) = self.scan.as_mut() else {
                break;
            };
            if let Some((column, missing)) = scan.resends.pop_front() {
                if column >= scan.acknowledged_below {
                    let before = self.running_tag;
                    self.send_column(column, &missing);
                    let frames = self.running_tag.wrapping_sub(before);
                    self.frames_resent += u64::from(frames);
                    self.log.push(Event::Resent(column));
                }
            } else if let Some((reason, faults)) = scan.end {
                if now < scan.next_end {
                    break;
                }
                scan.next_end = now + self.settings.scan_end_repeat;
                let end = ScanEnd {
                    scan_id: scan.id,
                    columns: scan.sent,
                    reason,
                    faults,
                };
                self.tell(&end);
            } else if !self.measure_next(now) {
                break;
            }
        }
    }

    /// Measures and sends the next column if its time has come.
    fn measure_next(&mut self, now: Duration) -> bool {
        if self.drive.moves(now) {
            return false;
        }
        let stepped = self.stepped();
        let Some(scan) = self.scan.as_mut() else {
            return false;
        };
        if !scan.begun {
            scan.begun = true;
            scan.next_column = now;
            self.log.push(Event::Table { moving: false });
        }
        if scan.sent >= scan.accepted.columns {
            self.set_laser(false);
            self.end_scan(ScanEndReason::Complete, now);
            return true;
        }
        if !scan.has_credit() || stepped {
            if !scan.starved && !stepped {
                scan.starved = true;
                let sent = scan.sent;
                self.log.push(Event::OutOfCredit(sent));
            }
            self.set_laser(false);
            return false;
        }
        if now < scan.next_column {
            return false;
        }
        let index = scan.sent;
        scan.sent += 1;
        scan.next_column = match self.settings.line_rate_hz {
            // A device that was polled late catches up, but not on more than it can buffer.
            Some(rate_hz) => {
                let period = Duration::from_secs_f64(1.0 / rate_hz);
                (scan.next_column + period).max(now.saturating_sub(period * 64))
            }
            None => now,
        };
        self.set_laser(true);
        let table_counts = self.send_column(index, &Missing::whole());
        self.drive = super::table::Drive::standing(table_counts);
        self.bench.column_measured();
        self.log.push(Event::ColumnSent(index));
        self.risk_mishaps(now);
        true
    }

    /// Sends those fragments of a column, and its end; gives the column's table position.
    fn send_column(&mut self, index: u32, missing: &Missing) -> i32 {
        let Some(scan) = &self.scan else { return 0 };
        let scan_id = scan.id;
        let uniform = scan.accepted.uniform;
        let moved = scan.moves.iter().find(|(below, _)| index < *below);
        let column = match (moved, self.source.part_offset_mm()) {
            (Some((_, stood_mm)), stands_mm) => {
                self.source.set_part_offset_mm(*stood_mm);
                let column = self
                    .source
                    .column(&scan.plan, scan.accepted, scan.repeat, index);
                self.source.set_part_offset_mm(stands_mm);
                column
            }
            (None, _) => self
                .source
                .column(&scan.plan, scan.accepted, scan.repeat, index),
        };
        let size = if uniform {
            UNIFORM_SAMPLES
        } else {
            LISTED_SAMPLES
        };
        // The sources bound a column's samples by what the wire can count.
        let fragments = column.samples.len().div_ceil(size) as u16;
        for (fragment, samples) in (0..fragments).zip(column.samples.chunks(size)) {
            if missing.contains(fragment) {
                let laterals = laterals(samples, uniform);
                self.tell(&ColumnFragment {
                    scan_id,
                    column: index,
                    fragment,
                    fragments,
                    first_sample: fragment * size as u16,
                    table_counts: column.table_counts,
                    laterals,
                });
            }
        }
        self.tell(&ColumnEnd {
            scan_id,
            column: index,
            table_counts: column.table_counts,
            fragments,
            samples: samples_of(&column),
        });
        column.table_counts
    }
}

fn samples_of(column: &Column) -> u16 {
    u16::try_from(column.samples.len()).unwrap_or(u16::MAX)
}

fn laterals(samples: &[Sample], uniform: bool) -> Laterals {
    let reading = |sample: &Sample| Reading {
        range_counts: sample.range_counts,
        intensity: sample.intensity,
        no_return: sample.no_return,
        saturated: sample.saturated,
    };
    if uniform {
        let first_counts = samples.first().map_or(0, |s| s.lateral_counts);
        let second = samples.get(1).map_or(first_counts, |s| s.lateral_counts);
        Laterals::Uniform {
            first_counts,
            step_counts: second.saturating_sub(first_counts),
            readings: samples.iter().map(reading).collect(),
        }
    } else {
        Laterals::Listed(
            samples
                .iter()
                .map(|sample| WireSample {
                    lateral_counts: sample.lateral_counts,
                    reading: reading(sample),
                })
                .collect(),
        )
    }
}
