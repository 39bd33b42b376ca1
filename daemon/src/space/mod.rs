//! Room on the disk: whether there is enough for a scan, and what goes to make some.
//!
//! Nothing goes that somebody still needs: a scan stays until it is over and none of its
//! jobs waits, runs or has failed; a result until no hook is to be run for it any more, and, if the
//! configuration says so, until somebody has acknowledged it. Range images that were put aside go as soon as the
//! reserve is touched, since a job can make them again.

mod low;
mod promise;
mod sweep;

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use jiff::Timestamp;
use relief_api::{Event, Job, JobState, Scan, ScanState, StorageStatus};
use storage::remove_file_if_there;

use crate::config::Unacknowledged;
use crate::error::ServiceError;
use crate::ids::now;
use crate::service::{Service, lock};
use low::Low;
use promise::taken_bytes;
pub(crate) use promise::{Promise, Promises};
use sweep::{Kept, surplus};

/// How often the service tries again what the disk refused ...
const TICK: Duration = Duration::from_secs(1);
/// ... and after how many times it looks for what may go.
const SWEEP_TICKS: u32 = 60;

/// A turn that takes longer hangs: on a disk that answers no more, or on a lock.
const LONGEST_TURN: Duration = Duration::from_secs(15 * 60);

/// What kept scans and results take, and what is free, as of the last look.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Measured {
    scans_bytes: u64,
    results_bytes: u64,
    scans_free_bytes: Option<u64>,
    results_free_bytes: Option<u64>,
}

/// Looks after the disk until the service stops. Runs on a thread of its own.
pub(crate) fn tidy(service: &Arc<Service>) {
    let pulse = service.liveness.begin("tidy");
    let mut ticks = 0;
    let mut low = Low::default();
    while !service.wait_for_stop(TICK) {
        pulse.work(LONGEST_TURN);
        service.keep_unkept();
        ticks = (ticks + 1) % SWEEP_TICKS;
        if ticks == 0 {
            service.sweep();
        }
        service.measure_free();
        service.tell_if_low(&mut low);
        pulse.rest();
    }
}

impl Service {
    /// Promises a scan the room that it may take, after having made what room can be made.
    /// Refuses one for which there is none beside the scans that are under way.
    pub(crate) fn promise_room(
        &self,
        scan: &str,
        columns: u32,
        samples: u16,
    ) -> Result<Promise, ServiceError> {
        let journal_bytes = scan_record::most_bytes(columns, samples.into());
        // Of a scan that is gone on with, some of it is there.
        let missing_bytes = journal_bytes.saturating_sub(taken_bytes(&self.journal_path(scan)));
        let look = |promised_bytes| match missing_bytes {
            // All of it is set aside already.
            0 => Ok(()),
            missing_bytes => self.refuse_without_room(missing_bytes, promised_bytes),
        };
        let make = || {
            let journal = self.journal_path(scan);
            self.promises.make(journal, journal_bytes, look)
        };
        let promise = make().or_else(|_| {
            self.sweep();
            make()
        });
        self.measure_free();
        promise
    }

    /// Refuses a scan of so many columns for which there is no room at this moment; promises
    /// none, and makes none.
    pub(crate) fn look_for_room(&self, columns: u32, samples: u16) -> Result<(), ServiceError> {
        let journal_bytes = scan_record::most_bytes(columns, samples.into());
        self.refuse_without_room(journal_bytes, self.promises.outstanding())
    }

    /// Refuses where a scan that needs so much finds no room beside what was promised.
    fn refuse_without_room(
        &self,
        scan_bytes: u64,
        promised_bytes: u64,
    ) -> Result<(), ServiceError> {
        let reserve_bytes = self.config().storage.reserve_bytes();
        let folders = [
            (self.scans_dir(), scan_bytes, promised_bytes),
            (self.spool.root(), 0, 0),
        ];
        let mut folders = folders.into_iter();
        folders.try_for_each(|(folder, scan_bytes, promised_bytes)| {
            let needed = scan_bytes
                .saturating_add(promised_bytes)
                .saturating_add(reserve_bytes);
            match self.disk.free_bytes(folder) {
                Ok(Some(free_bytes)) if free_bytes < needed => Err(ServiceError::NoRoom {
                    folder: folder.display().to_string(),
                    scan_bytes,
                    reserve_bytes,
                    free_bytes,
                    promised_bytes,
                }),
                Ok(_) => Ok(()),
                Err(source) => Err(ServiceError::Io {
                    what: format!("the free space of {}", folder.display()),
                    source,
                }),
            }
        })
    }

    /// True when so little room is left that what can be done without is done without.
    pub(crate) fn is_short_of_room(&self, folder: &Path) -> bool {
        let reserve = self.config().storage.reserve_bytes();
        self.disk
            .free_bytes(folder)
            .is_ok_and(|free| free.is_some_and(|free| free < reserve))
    }

    /// Notes what is free. Waits for as long as the disks take to say so.
    pub(crate) fn measure_free(&self) {
        let free = |folder| self.disk.free_bytes(folder).ok().flatten();
        let scans = free(self.scans_dir());
        let results = free(self.spool.root());
        let mut measured = lock(&self.measured);
        measured.scans_free_bytes = scans;
        measured.results_free_bytes = results;
    }

    /// What kept scans and results take, and what is free, as of the last look: a disk that
    /// hangs must not keep those waiting who ask how the service does.
    pub(crate) fn storage_status(&self) -> StorageStatus {
        let measured = *lock(&self.measured);
        StorageStatus {
            scans_bytes: measured.scans_bytes,
            scans_free_bytes: measured.scans_free_bytes,
            results_bytes: measured.results_bytes,
            results_free_bytes: measured.results_free_bytes,
            reserve_bytes: self.config().storage.reserve_bytes(),
        }
    }

    /// Removes what may go by age and size, and what can be made again if room is short.
    pub(crate) fn sweep(&self) {
        if self.is_short_of_room(self.scans_dir()) {
            self.forget_grids();
        }
        if let Err(error) = self.sweep_by_limits() {
            tracing::warn!(%error, "cannot look for scans and results to remove");
        }
    }

    fn sweep_by_limits(&self) -> Result<(), ServiceError> {
        // Nobody asks for a job of a scan that just goes.
        let _order = self.queue.changing();
        let limits = self.config().storage;
        // One time for all: ages in whole seconds must not differ by when they were looked at.
        let at = Timestamp::now();
        // Scans whose columns may still be asked for by a job, and the results that are there.
        let mut asked_for = BTreeSet::new();
        let still_used = self.receivers.results_needed(&self.store)?;
        let results = self.store.of_jobs(|job| {
            let folder = self.spool.directory(&job.result);
            let is_done = job.state == JobState::Done;
            let unfetched =
                limits.unacknowledged == Unacknowledged::Keep && job.acknowledged_at.is_none();
            let needed = unfetched || still_used.contains(&job.result);
            let kept = || kept_result(&folder, &job, at, needed);
            let result = is_done.then(kept).flatten();
            if asks_for_columns(job.state) {
                asked_for.insert(job.scan);
            }
            result
        })?;
        let mut put_back = Vec::new();
        let kept = self.of_scans(|scan| {
            let metadata = fs::metadata(self.journal_path(&scan.id)).ok()?;
            let mut since = scan.put_back_at.as_deref().or(scan.ended_at.as_deref());
            if scan.removed_at.is_some() {
                put_back.push(scan.id.clone());
                since = None;
            }
            Some(Kept {
                bytes: on_disk(&metadata),
                age_s: age_s(since, at),
                acknowledged_s: None,
                needed: may_be_processed(&scan) || asked_for.contains(&scan.id),
                id: scan.id,
            })
        })?;
        for scan in &put_back {
            self.note_put_back(scan)?;
        }
        let mut scans_bytes = kept.iter().map(|kept| kept.bytes).sum();
        for gone in surplus(kept, limits.scans()) {
            if self.remove_scan(&gone) {
                scans_bytes -= gone.bytes;
            }
        }
        let mut results_bytes: u64 = results.iter().map(|kept| kept.bytes).sum();
        for gone in surplus(results, limits.results()) {
            match self.spool.remove(&gone.id) {
                Ok(()) => {
                    results_bytes -= gone.bytes;
                    tracing::info!(result = gone.id, bytes = gone.bytes, "result removed");
                }
                Err(error) => tracing::warn!(%error, "cannot remove a result"),
            }
        }
        let mut measured = lock(&self.measured);
        measured.scans_bytes = scans_bytes;
        measured.results_bytes = results_bytes;
        Ok(())
    }

    /// The columns of a scan are there again that were removed; it is as young as if it had
    /// just been taken, or it would be removed again at once.
    fn note_put_back(&self, id: &str) -> Result<(), ServiceError> {
        let mut scan = self.scan(id)?;
        scan.removed_at = None;
        scan.put_back_at = Some(now());
        self.store.put_scan(&scan)?;
        tracing::info!(scan = %scan.id, "columns of a scan put back");
        self.hub.tell(Event::Scan(scan));
        Ok(())
    }

    /// The record stays, and says that the columns are gone; it is kept first, so that none
    /// says otherwise.
    fn remove_scan(&self, gone: &Kept) -> bool {
        match self.try_to_remove_scan(&gone.id) {
            Ok(scan) => {
                tracing::info!(scan = %scan.id, bytes = gone.bytes, "columns of a scan removed");
                self.hub.tell(Event::Scan(scan));
                true
            }
            Err(error) => {
                tracing::warn!(scan = %gone.id, %error, "cannot remove the columns of a scan");
                false
            }
        }
    }

    fn try_to_remove_scan(&self, id: &str) -> Result<Scan, ServiceError> {
        let mut scan = self.scan(id)?;
        scan.removed_at = Some(now());
        self.store.put_scan(&scan)?;
        let removed = remove_file_if_there(&*self.disk, &self.journal_path(id));
        if let Err(source) = removed {
            // Or the next look would take them for put back.
            scan.removed_at = None;
            if let Err(error) = self.store.put_scan(&scan) {
                tracing::warn!(scan = %id, %error, "cannot keep the record of a scan");
            }
            return Err(ServiceError::Io {
                what: id.to_owned(),
                source,
            });
        }
        // Left there by a job that failed or was cancelled.
        self.forget_grid(id);
        Ok(scan)
    }
}

/// Its columns are still to be processed.
fn may_be_processed(scan: &Scan) -> bool {
    // Its record was refused, and its job is still to come.
    let is_unprocessed = scan.state == ScanState::Complete && scan.jobs.is_empty();
    !scan.state.is_over() || is_unprocessed
}

/// A job that failed may be tried again.
fn asks_for_columns(state: JobState) -> bool {
    !state.is_over() || state == JobState::Failed
}

fn kept_result(folder: &Path, job: &Job, at: Timestamp, needed: bool) -> Option<Kept> {
    let mut bytes = 0;
    for entry in fs::read_dir(folder).ok()? {
        bytes += on_disk(&entry.ok()?.metadata().ok()?);
    }
    Some(Kept {
        id: job.result.clone(),
        bytes,
        age_s: age_s(job.ended_at.as_deref(), at),
        acknowledged_s: job
            .acknowledged_at
            .as_deref()
            .map(|since| age_s(Some(since), at)),
        needed,
    })
}

/// Bytes that a file takes, room set aside for it included.
fn on_disk(metadata: &fs::Metadata) -> u64 {
    /// Of `st_blocks`, whatever the file system's own are.
    const BLOCK_BYTES: u64 = 512;
    metadata.blocks() * BLOCK_BYTES
}

/// Seconds since a time; 0 where it is not known or lies ahead.
fn age_s(since: Option<&str>, at: Timestamp) -> u64 {
    let since: Option<Timestamp> = since.and_then(|since| since.parse().ok());
    since
        .map(|since| at.as_second() - since.as_second())
        .and_then(|age| u64::try_from(age).ok())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_is_still_to_be_processed_is_needed() {
        let scan = |state: &str, jobs: &[u64]| -> Scan {
            let started_at = "2026-11-21T11:08:30.123Z";
            let scan = json!({
                "id": "s", "name": "s", "state": state, "started_at": started_at, "jobs": jobs,
            });
            serde_json::from_value(scan).unwrap()
        };
        assert!(may_be_processed(&scan("scanning", &[])));
        // Its job is not queued yet.
        assert!(may_be_processed(&scan("complete", &[])));
        assert!(!may_be_processed(&scan("complete", &[1])));
        assert!(!may_be_processed(&scan("aborted", &[])));
        for (state, asks) in [
            (JobState::Queued, true),
            (JobState::Running, true),
            (JobState::Failed, true),
            (JobState::Done, false),
            (JobState::Cancelled, false),
        ] {
            assert_eq!(asks_for_columns(state), asks, "{state:?}");
        }
    }
}
