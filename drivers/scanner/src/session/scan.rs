//! A running scan: which columns are in flight, what is missing, what may be granted.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use scanner_protocol::commands::{Grant, Resend};
use scanner_protocol::{ColumnEnd, ColumnFragment, ScanEnd, ScanEndReason};

use super::assembly::{Assembly, Contradiction};
use crate::error::ScannerError;
use crate::scanner::{RawColumn, ScanInfo};

/// The bounds of a scan's flow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flow {
    /// Columns in flight.
    pub(super) credits: u16,
    /// Most samples in a column.
    pub(super) max_samples: u16,
    /// See [`crate::LinkSettings::resend_timeout`].
    pub(super) resend_timeout: Duration,
    /// See [`crate::LinkSettings::resend_attempts`].
    pub(super) resend_attempts: u32,
    /// See [`crate::LinkSettings::column_timeout`].
    pub(super) column_timeout: Duration,
}

/// The columns that are safe with the host, in whatever order it says so.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Acknowledged {
    below: u32,
    ahead: BTreeSet<u32>,
}

impl Acknowledged {
    /// All below this index, and no others.
    #[must_use]
    pub fn all_below(below: u32) -> Self {
        Self {
            below,
            ahead: BTreeSet::new(),
        }
    }

    /// Adds a column, if it is one of those `handed` on and is not in already; says whether
    /// all below some further index are safe now.
    pub fn add(&mut self, column: u32, handed: u32) -> bool {
        if column < self.below || column >= handed {
            return false;
        }
        let before = self.below;
        self.ahead.insert(column);
        while self.ahead.remove(&self.below) {
            self.below += 1;
        }
        self.below > before
    }

    /// Every column below is safe.
    #[must_use]
    pub fn below(&self) -> u32 {
        self.below
    }
}

/// Where a scan is taken up; the default is its beginning.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Taken {
    /// The first column to come.
    pub(super) first_column: u32,
    /// Columns below were handed on before.
    pub(super) handed: u32,
    pub(super) acknowledged: Acknowledged,
}

impl Taken {
    /// Every column below is safe and, once those below `next` have come, need not come again.
    fn safe_below(&self, next: u32) -> u32 {
        self.acknowledged.below().min(next)
    }

    /// The device may send columns below this index. Those that were here before need no room,
    /// but for what is under way.
    pub(super) fn granted(&self, next: u32, credits: u16, columns: u32) -> u32 {
        let credits = u32::from(credits);
        let again = self.handed.min(next.saturating_add(credits));
        self.safe_below(next)
            .saturating_add(credits)
            .max(again)
            .min(columns)
    }
}

/// A scan from its acceptance to its last column.
#[derive(Debug)]
pub(super) struct ScanTracker {
    scan_id: u16,
    info: ScanInfo,
    flow: Flow,
    /// Columns that will come: as announced, or fewer once the scan ended early.
    total: u32,
    /// Every column below has been handed on.
    next: u32,
    /// Columns `next..granted()` as far as anything of them has come.
    window: VecDeque<Slot>,
    /// Memory of columns that have been handed on, for those to come.
    spare: Vec<Assembly>,
    /// There is evidence that every column below has been sent once.
    sent_below: u32,
    taken: Taken,
    grant_due: bool,
    end: Option<ScanEnd>,
    /// When the last column became complete, or credit came after there was none.
    progress: Duration,
}

#[derive(Debug, Default)]
struct Slot {
    assembly: Assembly,
    column: Option<RawColumn>,
    /// When missing parts were last asked for, or some last came.
    touched: Option<Duration>,
    /// Requests for missing parts since one last came.
    attempts: u32,
    /// How often what came made no sense together.
    restarts: u32,
}

impl ScanTracker {
    pub(super) fn new(
        scan_id: u16,
        info: ScanInfo,
        flow: Flow,
        taken: Taken,
        now: Duration,
    ) -> Self {
        Self {
            scan_id,
            info,
            flow,
            total: info.columns,
            next: taken.first_column,
            window: VecDeque::new(),
            spare: Vec::new(),
            sent_below: taken.first_column,
            taken,
            grant_due: false,
            end: None,
            progress: now,
        }
    }

    pub(super) fn scan_id(&self) -> u16 {
        self.scan_id
    }

    /// The device may send columns below this index.
    fn granted(&self) -> u32 {
        self.taken
            .granted(self.next, self.flow.credits, self.info.columns)
    }

    /// The slot of a column in flight; `None` for one handed on already, or never granted.
    fn slot(&mut self, column: u32) -> Option<&mut Slot> {
        if column >= self.granted() {
            return None;
        }
        let at = usize::try_from(column.checked_sub(self.next)?).ok()?;
        while at >= self.window.len() {
            self.window.push_back(Slot {
                assembly: self.spare.pop().unwrap_or_default(),
                ..Slot::default()
            });
        }
        self.window.get_mut(at)
    }

    pub(super) fn fragment(&mut self, fragment: &ColumnFragment, now: Duration) {
        if fragment.scan_id != self.scan_id {
            return;
        }
        let max_samples = self.flow.max_samples;
        let Some(slot) = self.slot(fragment.column) else {
            return;
        };
        if slot.column.is_none() {
            match slot.assembly.fragment(fragment, max_samples) {
                Ok(true) => slot.attempts = 0,
                Ok(false) => {}
                Err(contradiction) => slot.restart(fragment.column, contradiction),
            }
            // What comes now may be the answer to a request: wait for its rest.
            if slot.touched.is_some() {
                slot.touched = Some(now);
            }
            self.complete(fragment.column, now);
        }
        // Columns are first sent in order, so that all before this one have been.
        self.sent_below = self.sent_below.max(fragment.column);
    }

    pub(super) fn column_end(&mut self, end: &ColumnEnd, now: Duration) {
        if end.scan_id != self.scan_id {
            return;
        }
        let max_samples = self.flow.max_samples;
        let Some(slot) = self.slot(end.column) else {
            return;
        };
        if slot.column.is_none() {
            if let Err(contradiction) = slot.assembly.end(end, max_samples) {
                slot.restart(end.column, contradiction);
            } else if slot.attempts == 0 {
                // The answer to the last request is over, and has brought something: what is
                // still missing is asked for at once. An answer without anything new is a
                // sign of a burst of noise, which is better waited out.
                slot.touched = None;
            }
            self.complete(end.column, now);
        }
        self.sent_below = self.sent_below.max(end.column + 1);
    }

    /// Turns a column's fragments into the column, if they are all there.
    fn complete(&mut self, index: u32, now: Duration) {
        let Some(slot) = self.slot(index) else {
            return;
        };
        if !slot.assembly.is_complete() {
            return;
        }
        match slot.assembly.finish(index) {
            Ok(column) => {
                slot.column = Some(column);
                self.progress = now;
            }
            Err(contradiction) => slot.restart(index, contradiction),
        }
    }

    /// The device told how many columns it has sent.
    pub(super) fn sent(&mut self, columns: u32) {
        self.sent_below = self.sent_below.max(columns.min(self.granted()));
    }

    /// No more columns will be measured.
    pub(super) fn scan_end(&mut self, end: ScanEnd) {
        if end.scan_id != self.scan_id || self.end.is_some() {
            return;
        }
        self.total = self.total.min(end.columns);
        self.sent(end.columns);
        self.end = Some(end);
    }

    /// The next column in order, if it is complete.
    pub(super) fn take(&mut self) -> Option<RawColumn> {
        let column = self.window.front_mut()?.column.take()?;
        self.spare
            .extend(self.window.pop_front().map(|slot| slot.assembly));
        self.next += 1;
        // Of columns measured again those that have come are safe: the device need not keep
        // them, and may have no room for more.
        self.grant_due |= self.next <= self.taken.handed;
        Some(column)
    }

    /// How the scan went, once all its columns have been taken.
    ///
    /// The device's own word on the end is not waited for when every column is there: it
    /// may be lost, and would add nothing.
    pub(super) fn over(&self) -> Option<Result<(), ScannerError>> {
        if self.next < self.total {
            return None;
        }
        if self.total == self.info.columns {
            return Some(Ok(()));
        }
        let end = self.end.as_ref()?;
        Some(Err(match end.reason {
            ScanEndReason::Complete => ScannerError::Protocol(format!(
                "it announced {} columns and ended the scan after {}",
                self.info.columns, self.total
            )),
            ScanEndReason::Closed => ScannerError::Aborted,
            ScanEndReason::Fault => ScannerError::Fault(end.faults),
            ScanEndReason::DeadMan => ScannerError::DeadMan,
            ScanEndReason::Operator => ScannerError::StoppedAtDevice,
            ScanEndReason::Other(code) => {
                ScannerError::Protocol(format!("it ended the scan for the unknown reason {code}"))
            }
        }))
    }

    /// A column is safe with the host.
    pub(super) fn acknowledge(&mut self, column: u32, now: Duration) {
        let starved = self.next >= self.granted();
        let handed = self.next.max(self.taken.handed);
        if self.taken.acknowledged.add(column, handed) {
            self.grant_due = true;
        }
        if starved && self.next < self.granted() {
            // The wait so far was for the host, not for the device.
            self.progress = now;
        }
    }

    pub(super) fn all_acknowledged(&self) -> bool {
        self.taken.acknowledged.below() >= self.total
    }

    /// The grant to be sent now, if there is news, or anyway if `repeat`.
    pub(super) fn grant(&mut self, repeat: bool) -> Option<Grant> {
        if !(self.grant_due || repeat) {
            return None;
        }
        self.grant_due = false;
        Some(Grant {
            scan_id: self.scan_id,
            acknowledged_below: self.taken.safe_below(self.next),
            send_below: self.granted(),
        })
    }

    /// What has to be asked for again now.
    ///
    /// # Errors
    /// [`ScannerError::ColumnLost`] when a column has been asked for too often.
    pub(super) fn resends(&mut self, now: Duration) -> Result<Vec<Resend>, ScannerError> {
        let mut requests = Vec::new();
        for (column, slot) in Self::gaps(self.next, self.sent_below, &mut self.window) {
            if slot
                .touched
                .is_some_and(|touched| now < touched + self.flow.resend_timeout)
            {
                continue;
            }
            let attempts = slot.attempts.max(slot.restarts);
            if attempts >= self.flow.resend_attempts {
                return Err(ScannerError::ColumnLost { column, attempts });
            }
            slot.attempts += 1;
            slot.touched = Some(now);
            requests.push(Resend {
                scan_id: self.scan_id,
                column,
                missing: slot.assembly.missing(),
            });
        }
        Ok(requests)
    }

    /// The columns that have been sent and are not complete.
    fn gaps(
        next: u32,
        sent_below: u32,
        window: &mut VecDeque<Slot>,
    ) -> impl Iterator<Item = (u32, &mut Slot)> {
        let sent = usize::try_from(sent_below.saturating_sub(next)).unwrap_or(usize::MAX);
        // `sent_below` is never above what was granted, which bounds the window.
        if window.len() < sent {
            window.resize_with(sent, Slot::default);
        }
        (next..sent_below)
            .zip(window.iter_mut())
            .filter(|(_, slot)| slot.column.is_none())
    }

    /// Whether the device has kept the host waiting too long.
    pub(super) fn overdue(&self, now: Duration) -> bool {
        self.column_deadline().is_some_and(|due| now >= due)
    }

    /// The device is on its way and will need longer, as on the drive to the first column.
    pub(super) fn excuse(&mut self, now: Duration) {
        self.progress = now;
    }

    fn column_deadline(&self) -> Option<Duration> {
        (self.next < self.granted().min(self.total))
            .then(|| self.progress + self.flow.column_timeout)
    }

    /// When to look at the scan again, if nothing comes before.
    pub(super) fn deadline(&self) -> Option<Duration> {
        let resend = self
            .window
            .iter()
            .filter(|slot| slot.column.is_none())
            .filter_map(|slot| slot.touched)
            .min()
            .map(|touched| touched + self.flow.resend_timeout);
        resend.into_iter().chain(self.column_deadline()).min()
    }
}

impl Slot {
    /// Begins the column anew. It is asked for again at the next look, as any gap is.
    fn restart(&mut self, column: u32, contradiction: Contradiction) {
        tracing::warn!(column, reason = contradiction.0, "column discarded");
        self.assembly.clear();
        self.column = None;
        self.restarts += 1;
    }
}
