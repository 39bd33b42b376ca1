//! Room on the disk: whether there is enough for a scan, and what goes to make some.
//!
//! Nothing goes that somebody still needs: a scan stays until it is over and none of its
//! jobs waits, runs or has failed. Range images that were put aside go as soon as the
//! reserve is touched, since a job can make them again.

mod sweep;

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use jiff::Timestamp;
use relief_api::{Event, Job, JobState, Scan, StorageStatus};
use storage::remove_file_if_there;

use crate::error::ServiceError;
use crate::ids::now;
use crate::service::{Service, lock};
use sweep::{Kept, surplus};

/// How often the service tries again what the disk refused ...
const TICK: Duration = Duration::from_secs(1);
/// ... and after how many times it looks for what may go.
const SWEEP_TICKS: u32 = 60;

/// Looks after the disk until the service stops. Runs on a thread of its own.
pub(crate) fn tidy(service: &Arc<Service>) {
    let mut ticks = 0;
    while !service.wait_for_stop(TICK) {
        service.keep_unkept();
        ticks = (ticks + 1) % SWEEP_TICKS;
        if ticks == 0 {
            service.sweep();
        }
    }
}

impl Service {
    /// Refuses a scan for which there is no room, after having made what room can be made.
    pub(crate) fn check_room(&self, columns: u32, samples: u16) -> Result<(), ServiceError> {
        let reserve_bytes = self.config().storage.reserve_bytes();
        let journal_bytes = scan_record::most_bytes(columns, samples.into());
        let look = || {
            let folders = [(self.scans_dir(), journal_bytes), (self.spool.root(), 0)];
            folders.into_iter().try_for_each(|(folder, scan_bytes)| {
                match self.disk.free_bytes(folder) {
                    Ok(Some(free_bytes))
                        if free_bytes < scan_bytes.saturating_add(reserve_bytes) =>
                    {
                        Err(ServiceError::NoRoom {
                            folder: folder.display().to_string(),
                            scan_bytes,
                            reserve_bytes,
                            free_bytes,
                        })
                    }
                    Ok(_) => Ok(()),
                    Err(source) => Err(ServiceError::Io {
                        what: format!("the free space of {}", folder.display()),
                        source,
                    }),
                }
            })
        };
        look().or_else(|_| {
            self.sweep();
            look()
        })
    }

    /// True when so little room is left that what can be done without is done without.
    pub(crate) fn is_short_of_room(&self, folder: &Path) -> bool {
        let reserve = self.config().storage.reserve_bytes();
        self.disk
            .free_bytes(folder)
            .is_ok_and(|free| free.is_some_and(|free| free < reserve))
    }

    /// What kept scans and results take, as of the last look, and what is free.
    pub(crate) fn storage_status(&self) -> StorageStatus {
        let free = |folder| self.disk.free_bytes(folder).ok().flatten();
        let (scans_bytes, results_bytes) = *lock(&self.kept_bytes);
        StorageStatus {
            scans_bytes,
            scans_free_bytes: free(self.scans_dir()),
            results_bytes,
            results_free_bytes: free(self.spool.root()),
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
        let (scans, jobs) = (self.scans()?, self.jobs()?);
        let mut scans_bytes = 0;
        let mut kept = Vec::new();
        for scan in &scans {
            if let Ok(metadata) = fs::metadata(self.journal_path(&scan.id)) {
                scans_bytes += metadata.len();
                kept.push(Kept {
                    id: scan.id.clone(),
                    bytes: metadata.len(),
                    age_s: age_s(scan.ended_at.as_deref(), at),
                    needed: is_needed(scan, &jobs),
                });
            }
        }
        for gone in surplus(kept, limits.scans()) {
            if self.remove_scan(&scans, &gone) {
                scans_bytes -= gone.bytes;
            }
        }
        let results: Vec<Kept> = jobs
            .iter()
            .filter(|job| job.state == JobState::Done)
            .filter_map(|job| kept_result(&self.spool.directory(&job.result), job, at))
            .collect();
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
        *lock(&self.kept_bytes) = (scans_bytes, results_bytes);
        Ok(())
    }

    /// The record stays, and says that the columns are gone; it is kept first, so that none
    /// says otherwise.
    fn remove_scan(&self, scans: &[Scan], gone: &Kept) -> bool {
        let Some(mut scan) = scans.iter().find(|scan| scan.id == gone.id).cloned() else {
            return false;
        };
        scan.removed_at = Some(now());
        let removed = self.store.put_scan(&scan).map_err(ServiceError::from);
        let removed = removed.and_then(|()| {
            remove_file_if_there(&*self.disk, &self.journal_path(&scan.id)).map_err(|source| {
                ServiceError::Io {
                    what: scan.id.clone(),
                    source,
                }
            })
        });
        match removed {
            Ok(()) => {
                tracing::info!(scan = %scan.id, bytes = gone.bytes, "columns of a scan removed");
                self.hub.tell(Event::Scan(scan));
                true
            }
            Err(error) => {
                tracing::warn!(scan = %scan.id, %error, "cannot remove the columns of a scan");
                false
            }
        }
    }
}

/// Its columns may still be asked for.
fn is_needed(scan: &Scan, jobs: &[Job]) -> bool {
    !scan.state.is_over()
        || jobs
            .iter()
            .filter(|job| job.scan == scan.id)
            .any(|job| !job.state.is_over() || job.state == JobState::Failed)
}

fn kept_result(folder: &Path, job: &Job, at: Timestamp) -> Option<Kept> {
    let mut bytes = 0;
    for entry in fs::read_dir(folder).ok()? {
        bytes += entry.ok()?.metadata().ok()?.len();
    }
    Some(Kept {
        id: job.result.clone(),
        bytes,
        age_s: age_s(job.ended_at.as_deref(), at),
        needed: false,
    })
}

/// Seconds since a time; 0 where it is not known or lies ahead.
fn age_s(since: Option<&str>, at: Timestamp) -> u64 {
    let since: Option<Timestamp> = since.and_then(|since| since.parse().ok());
    since
        .map(|since| at.as_second() - since.as_second())
        .and_then(|age| u64::try_from(age).ok())
        .unwrap_or_default()
}
