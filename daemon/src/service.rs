//! What all parts of the service share.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::Duration;

use regrid::RegridSettings;
use relief_api::{Event, Scan, ScannerLink, ScannerStatus, Status};
use scanner_driver::Scanner;
use scanner_protocol::Identity;
use storage::Disk;

use crate::acquisition::describe_trouble;
use crate::config::{Config, Reloaded};
use crate::error::ServiceError;
use crate::events::Hub;
use crate::ids::{Ids, now};
use crate::jobs::Queue;
use crate::laser::{Laser, Watched};
use crate::liveness::Liveness;
use crate::scans::Slot;
use crate::space::Measured;
use crate::spool::Spool;
use crate::store::Store;
use crate::tokens::Tokens;

/// What outlives the process, and where it is kept.
pub(crate) struct Kept {
    pub(crate) disk: Arc<dyn Disk>,
    pub(crate) store: Store,
    pub(crate) spool: Spool,
    pub(crate) tokens: Tokens,
    pub(crate) laser: Laser,
}

/// What all parts of the service share.
pub(crate) struct Service {
    pub(crate) scanner: Arc<dyn Scanner>,
    /// Where everything is kept that must survive.
    pub(crate) disk: Arc<dyn Disk>,
    pub(crate) store: Store,
    pub(crate) spool: Spool,
    pub(crate) tokens: Tokens,
    pub(crate) laser: Arc<Laser>,
    pub(crate) hub: Hub,
    pub(crate) ids: Ids,
    pub(crate) queue: Queue,
    pub(crate) liveness: Liveness,
    /// The scan under way, if any.
    pub(crate) slot: Mutex<Slot>,
    /// Threads of scans; all but the last are about to end, if they have not yet.
    pub(crate) scan_threads: Mutex<Vec<JoinHandle<()>>>,
    config: RwLock<Arc<Config>>,
    scans_dir: PathBuf,
    scanner_status: Mutex<ScannerStatus>,
    grids: Mutex<BTreeMap<String, KeptGrid>>,
    /// Scans that are over and whose records the disk refused.
    pub(crate) unkept: Mutex<Vec<Scan>>,
    /// Room on the disks, as of the last look.
    pub(crate) measured: Mutex<Measured>,
    started_at: String,
    stopping: Mutex<bool>,
    stop_told: Condvar,
}

/// A range image that acquisition has put aside on disk.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KeptGrid {
    /// What it was made with; a job with other settings cannot use it.
    pub(crate) settings: RegridSettings,
}

impl Service {
    pub(crate) fn new(
        config: Config,
        scanner: Arc<dyn Scanner>,
        kept: Kept,
        scans_dir: PathBuf,
    ) -> Self {
        let Kept {
            disk,
            store,
            spool,
            tokens,
            laser,
        } = kept;
        let endpoint = config.scanner.place();
        let laser = Arc::new(laser);
        Self {
            scanner: Arc::new(Watched::new(scanner, Arc::clone(&laser))),
            disk,
            store,
            spool,
            tokens,
            laser,
            hub: Hub::default(),
            ids: Ids::default(),
            queue: Queue::default(),
            liveness: Liveness::default(),
            slot: Mutex::new(Slot::Free),
            scan_threads: Mutex::default(),
            config: RwLock::new(Arc::new(config)),
            scans_dir,
            scanner_status: Mutex::new(ScannerStatus {
                link: ScannerLink::Unknown,
                endpoint,
                model: None,
                serial: None,
                firmware: None,
                problem: None,
            }),
            grids: Mutex::default(),
            unkept: Mutex::default(),
            measured: Mutex::default(),
            started_at: now(),
            stopping: Mutex::new(false),
            stop_told: Condvar::new(),
        }
    }

    /// The configuration as it holds now.
    pub(crate) fn config(&self) -> Arc<Config> {
        Arc::clone(&self.config.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes over what may change in service.
    pub(crate) fn reload(&self, new: &Config) -> Reloaded {
        let mut config = self.config.write().unwrap_or_else(PoisonError::into_inner);
        let (merged, outcome) = config.reloaded(new);
        *config = Arc::new(merged);
        outcome
    }

    /// The service at a glance.
    pub(crate) fn status(&self) -> Status {
        let (jobs_queued, jobs_running) = self.queue.counts();
        Status {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            started_at: self.started_at.clone(),
            scanner: self.scanner_status(),
            laser: self.laser.latest().map(Box::new),
            scan: self.active_scan(),
            jobs_queued,
            jobs_running,
            spool: self.spool.root().display().to_string(),
            storage: Some(Box::new(self.storage_status())),
        }
    }

    /// Folder of the kept scans.
    pub(crate) fn scans_dir(&self) -> &Path {
        &self.scans_dir
    }

    /// Where a scan's columns are kept.
    pub(crate) fn journal_path(&self, scan: &str) -> PathBuf {
        self.scans_dir.join(format!("{scan}.scan"))
    }

    /// Where a scan's range image is put aside.
    pub(crate) fn grid_path(&self, scan: &str) -> PathBuf {
        self.scans_dir.join(format!("{scan}.grid"))
    }

    /// The range image on disk is whole and made with these settings.
    pub(crate) fn keep_grid(&self, scan: &str, grid: KeptGrid) {
        lock(&self.grids).insert(scan.to_owned(), grid);
    }

    /// The range image that was put aside, if there is one.
    pub(crate) fn kept_grid(&self, scan: &str) -> Option<KeptGrid> {
        lock(&self.grids).get(scan).cloned()
    }

    /// Removes the range image that was put aside.
    pub(crate) fn forget_grid(&self, scan: &str) {
        lock(&self.grids).remove(scan);
        remove_if_there(&self.grid_path(scan));
    }

    /// Removes every range image that was put aside.
    pub(crate) fn forget_grids(&self) {
        let grids = std::mem::take(&mut *lock(&self.grids));
        for scan in grids.keys() {
            remove_if_there(&self.grid_path(scan));
        }
    }

    /// What is known of the scanner.
    pub(crate) fn scanner_status(&self) -> ScannerStatus {
        lock(&self.scanner_status).clone()
    }

    /// Notes who the scanner is.
    pub(crate) fn note_identity(&self, identity: &Identity) {
        self.change_scanner(|status| {
            status.model = Some(identity.model.as_str().to_owned());
            status.serial = Some(identity.serial.as_str().to_owned());
            status.firmware = Some(identity.firmware.as_str().to_owned());
        });
    }

    /// Notes how the scanner does.
    pub(crate) fn note_scanner(&self, link: ScannerLink, problem: Option<String>) {
        self.change_scanner(|status| {
            status.link = link;
            status.problem = problem;
        });
    }

    fn change_scanner(&self, change: impl FnOnce(&mut ScannerStatus)) {
        let status = {
            let mut status = lock(&self.scanner_status);
            let before = status.clone();
            change(&mut status);
            if *status == before {
                return;
            }
            status.clone()
        };
        if let Some(problem) = describe_trouble(&status) {
            tracing::warn!(endpoint = %status.endpoint, %problem, "scanner in trouble");
        }
        self.hub.tell(Event::Scanner(status));
    }

    /// Refuses new work once the service stops.
    pub(crate) fn check_running(&self) -> Result<(), ServiceError> {
        if *lock(&self.stopping) {
            Err(ServiceError::Stopping)
        } else {
            Ok(())
        }
    }

    /// No new work from now on.
    pub(crate) fn begin_stop(&self) {
        *lock(&self.stopping) = true;
        self.stop_told.notify_all();
    }

    /// Waits, and tells whether the service stops.
    pub(crate) fn wait_for_stop(&self, longest: Duration) -> bool {
        let stopping = lock(&self.stopping);
        let waited = self
            .stop_told
            .wait_timeout_while(stopping, longest, |stopping| !*stopping);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// The lock, also after a panic elsewhere: what these locks protect is whole between any
/// two statements.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes a file whose absence is just as well.
pub(crate) fn remove_if_there(path: &Path) {
    if let Err(error) = std::fs::remove_file(path)
        && error.kind() != std::io::ErrorKind::NotFound
    {
        tracing::warn!(file = %path.display(), %error, "cannot remove a file");
    }
}
