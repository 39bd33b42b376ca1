//! Scans that the service was in when it last ended, and that can be gone on with.

use std::sync::Arc;

use jiff::Timestamp;
use relief_api::{Interruption, Scan, ScanState};
use scanner_driver::ScannerError;

use super::Found;
use crate::acquisition::presence::last_seen;
use crate::acquisition::{Rest, TakeUp, Task, not_taken_up};
use crate::config::Role;
use crate::error::ServiceError;
use crate::ids::{at, now};
use crate::service::{Service, lock, remove_if_there};

/// After so many ends of the service in a row without a new column a person is asked: the scan
/// itself may be what ends it.
const MOST_IN_A_ROW: u32 = 3;

/// After so many it is left alone.
const FAR_TOO_MANY: u32 = 10;

/// What a person is told to do.
const ASKED: &str = "; see to it, then let the scan go on with `relief resume`";

/// A scan that the service was in when it last ended, and that can be gone on with.
#[derive(Debug)]
pub(crate) struct CutShort {
    scan: Scan,
    rest: Rest,
    how: TakeUp,
}

impl Service {
    /// How a scan can be gone on with whose journal has this in it.
    ///
    /// # Errors
    /// In words, why it cannot.
    pub(super) fn may_go_on(&self, scan: &Scan, found: &Found) -> Result<CutShort, String> {
        let rest = found.rest.clone()?;
        let station = self.station(&scan.scanner).map_err(|e| e.to_string())?;
        let config = self.config();
        if !config.has(Role::Acquire) {
            return Err("the service takes no scans any more ([service] roles)".to_owned());
        }
        let mut scanners = config.each_scanner().into_iter();
        if !scanners.any(|scanner| scanner.name == station.name() && scanner.config.resume) {
            return Err(format!("[{}] resume is false", station.section()));
        }
        let last = scan.interruption.as_ref();
        // Fewer are there if the computer lost its power before those of another start were safe.
        let last = last.filter(|last| last.columns >= found.columns);
        let times = last.map_or(0, |last| last.times) + 1;
        if times > FAR_TOO_MANY {
            return Err(format!(
                "the service has ended {times} times in a row at this column"
            ));
        }
        let since = last
            .map(|last| last.since.clone())
            .or_else(|| self.journal_written(&scan.id).map(at))
            .unwrap_or_else(now);
        let seen = last_seen(&self.presence_path(&scan.id));
        let mut scan = scan.clone();
        let waits_for = if scan.needs_person {
            scan.reason.take()
        } else if times >= MOST_IN_A_ROW {
            Some(format!(
                "the service has ended {times} times in a row at this column{ASKED}"
            ))
        } else if seen.is_none() {
            Some(format!(
                "nothing tells that it went on by itself a short while ago: the computer was started \
                 anew, or somebody had been asked or had ended it{ASKED}"
            ))
        } else {
            None
        };
        scan.interruption = Some(Interruption {
            since,
            columns: found.columns,
            times,
        });
        scan.needs_person = waits_for.is_some();
        // Paused once the driver has it, and can be told to go on.
        scan.state = ScanState::Starting;
        let before = waits_for.clone();
        scan.reason = Some(ScannerError::ProgramEnded { before }.to_string());
        scan.columns = found.columns;
        scan.columns_planned = rest.columns;
        Ok(CutShort {
            scan,
            rest,
            how: TakeUp {
                seen,
                waits_for,
                live: times < MOST_IN_A_ROW,
            },
        })
    }

    /// Goes on with scans that were cut short. One that cannot be gone on with after all stays
    /// as it is, with all columns that are kept.
    pub(crate) fn take_up_scans(self: &Arc<Self>, scans: Vec<CutShort>) {
        // The newest first: of two on one scanner it is the one that was under way.
        for CutShort { scan, rest, how } in scans.into_iter().rev() {
            if let Err(error) = self.take_up_scan(&scan, &rest, how) {
                let mut left = scan;
                tracing::warn!(scan = %left.id, %error, "a scan that was cut short is not gone on with");
                left.state = ScanState::Interrupted;
                left.reason = Some(not_taken_up(&error.to_string()));
                left.needs_person = false;
                left.ended_at = Some(now());
                self.give_back_room(&left.id);
                self.presence(&left.id).end();
                if let Err(error) = self.keep_ended(&mut left) {
                    tracing::error!(scan = %left.id, %error, "cannot keep the record of a scan now");
                    lock(&self.unkept).push(left);
                }
            }
        }
    }

    fn take_up_scan(
        self: &Arc<Self>,
        scan: &Scan,
        rest: &Rest,
        how: TakeUp,
    ) -> Result<(), ServiceError> {
        let processing = self.config().processing().with_overrides(&scan.settings)?;
        let reservation = self.station(&scan.scanner)?.reserve()?;
        let room = self.promise_room(&scan.id, rest.columns, rest.samples)?;
        self.begin_scan(reservation, scan, Task::TakeUp(how), processing, room)
    }

    /// Of other scans nobody will ask.
    pub(super) fn forget_presences(&self, cut_short: &[CutShort]) {
        for entry in std::fs::read_dir(self.scans_dir())
            .into_iter()
            .flatten()
            .flatten()
        {
            let path = entry.path();
            let is_wanted = |cut: &CutShort| path == self.presence_path(&cut.scan.id);
            if path.extension().is_some_and(|e| e == "presence") && !cut_short.iter().any(is_wanted)
            {
                remove_if_there(&path);
            }
        }
    }

    /// When the scan's journal was last written, as far as the disk says so.
    fn journal_written(&self, scan: &str) -> Option<Timestamp> {
        let written = std::fs::metadata(self.journal_path(scan)).ok()?.modified();
        Timestamp::try_from(written.ok()?).ok()
    }
}
