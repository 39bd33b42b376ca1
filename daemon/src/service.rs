//! What all parts of the service share.

#[cfg(test)]
pub(crate) mod testing;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};
use std::time::Duration;

use job_queue::BenchName;
use regrid::RegridSettings;
use relief_api::{LaserEntry, Scan, ScannerList, Status};
use storage::Disk;

use crate::acquisition::presence::Presence;
use crate::config::{Config, Reloaded};
use crate::error::ServiceError;
use crate::events::Hub;
use crate::fleet::Fleet;
use crate::ids::{Ids, now};
use crate::jobs::Queue;
use crate::laser::MOST_SHOWN;
use crate::liveness::Liveness;
use crate::metrics::Metrics;
use crate::receivers::Receivers;
use crate::space::{Measured, Promises};
use crate::spool::Spool;
use crate::starts::UnderWay;
use crate::station::Station;
use crate::stopping::Stopping;
use crate::store::Store;
use crate::tokens::Tokens;
use crate::traces::Traces;

/// What outlives the process, and where it is kept.
pub(crate) struct Kept {
    pub(crate) disk: Arc<dyn Disk>,
    pub(crate) store: Store,
    pub(crate) spool: Spool,
    pub(crate) tokens: Tokens,
    /// With the messages that wait for them.
    pub(crate) receivers: Receivers,
}

/// What all parts of the service share.
pub(crate) struct Service {
    /// In the order of their names; at least one.
    pub(crate) stations: Vec<Arc<Station>>,
    /// Where everything is kept that must survive.
    pub(crate) disk: Arc<dyn Disk>,
    pub(crate) store: Store,
    pub(crate) spool: Spool,
    pub(crate) tokens: Tokens,
    pub(crate) receivers: Receivers,
    pub(crate) hub: Arc<Hub>,
    pub(crate) ids: Ids,
    pub(crate) queue: Queue,
    pub(crate) liveness: Liveness,
    /// Room on the disk that scans under way may still take.
    pub(crate) promises: Arc<Promises>,
    config: RwLock<Arc<Config>>,
    scans_dir: PathBuf,
    grids: Mutex<BTreeMap<String, KeptGrid>>,
    /// Scans that are over and whose records the disk refused.
    pub(crate) unkept: Mutex<Vec<Scan>>,
    /// What is counted.
    pub(crate) metrics: Metrics,
    /// Who is told how long things took; nobody until the service has set it up.
    pub(crate) traces: OnceLock<Traces>,
    /// The way to workers elsewhere, where there is one.
    pub(crate) fleet: OnceLock<Arc<Fleet>>,
    /// Held by whoever regrids for showing.
    pub(crate) regridding: Mutex<()>,
    /// Keyed requests that are just being done.
    pub(crate) starts: UnderWay,
    /// Room on the disks, as of the last look.
    pub(crate) measured: Mutex<Measured>,
    /// What this service is called among others.
    pub(crate) bench: BenchName,
    started_at: String,
    stopping: Stopping,
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
        stations: Vec<Arc<Station>>,
        hub: Arc<Hub>,
        kept: Kept,
        scans_dir: PathBuf,
    ) -> Self {
        let Kept {
            disk,
            store,
            spool,
            tokens,
            receivers,
        } = kept;
        Self {
            stations,
            disk,
            store,
            spool,
            tokens,
            receivers,
            hub,
            ids: Ids::default(),
            queue: Queue::default(),
            liveness: Liveness::default(),
            promises: Arc::default(),
            bench: config.nats.bench_name(),
            config: RwLock::new(Arc::new(config)),
            scans_dir,
            grids: Mutex::default(),
            unkept: Mutex::default(),
            metrics: Metrics::default(),
            traces: OnceLock::new(),
            fleet: OnceLock::new(),
            regridding: Mutex::default(),
            starts: UnderWay::default(),
            measured: Mutex::default(),
            started_at: now(),
            stopping: Stopping::default(),
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
        let scanners = self.scanners().scanners;
        // There is at least one.
        let first = scanners[0].clone();
        Status {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            started_at: self.started_at.clone(),
            scanner: first.status,
            scanners,
            laser: first.laser,
            scan: first.scan,
            jobs_queued,
            jobs_running,
            spool: self.spool.root().display().to_string(),
            storage: Some(Box::new(self.storage_status())),
        }
    }

    /// The scanners at a glance.
    pub(crate) fn scanners(&self) -> ScannerList {
        ScannerList {
            scanners: self.stations.iter().map(|s| s.summary()).collect(),
        }
    }

    /// Threads that a job which begins now may use: scans under way keep theirs.
    pub(crate) fn threads_of_a_job(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let scanners = self.scanners().scanners;
        let scans = scanners.iter().filter(|own| own.scan.is_some()).count();
        self.config().queue.threads_beside(cores, scans)
    }

    /// The station of this name; of an empty name, the only one.
    pub(crate) fn station(&self, name: &str) -> Result<&Arc<Station>, ServiceError> {
        let found = match (&*self.stations, name) {
            ([only], "") => Some(only),
            (all, _) => all.iter().find(|station| station.name() == name),
        };
        found.ok_or_else(|| {
            let known = self.stations.iter().map(|s| s.name().to_owned()).collect();
            match name {
                "" => ServiceError::WhichScanner { known },
                _ => ServiceError::NoSuchScanner {
                    name: name.to_owned(),
                    known,
                },
            }
        })
    }

    /// The latest changes of all lasers, oldest first.
    pub(crate) fn laser_entries(&self) -> Vec<LaserEntry> {
        let mut all: Vec<LaserEntry> = Vec::new();
        for station in &self.stations {
            all.extend(station.laser.entries());
        }
        // Times are of one length and in UTC; those of one laser are in order already.
        all.sort_by(|a, b| a.at.cmp(&b.at));
        all.drain(..all.len().saturating_sub(MOST_SHOWN));
        all
    }

    /// Folder of the kept scans.
    pub(crate) fn scans_dir(&self) -> &Path {
        &self.scans_dir
    }

    /// Folder of what is worked on for other services; nothing in it outlives a job.
    pub(crate) fn elsewhere_dir(&self) -> PathBuf {
        self.scans_dir.with_file_name("elsewhere")
    }

    /// Where a scan's columns are kept.
    pub(crate) fn journal_path(&self, scan: &str) -> PathBuf {
        self.scans_dir.join(format!("{scan}.scan"))
    }

    /// Where a scan's range image is put aside.
    pub(crate) fn grid_path(&self, scan: &str) -> PathBuf {
        self.scans_dir.join(format!("{scan}.grid"))
    }

    /// Where it stands that a scan goes on by itself.
    pub(crate) fn presence_path(&self, scan: &str) -> PathBuf {
        self.scans_dir.join(format!("{scan}.presence"))
    }

    /// That a scan goes on by itself.
    pub(crate) fn presence(&self, scan: &str) -> Presence {
        Presence::new(self.presence_path(scan))
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

    /// Refuses new work once the service stops.
    pub(crate) fn check_running(&self) -> Result<(), ServiceError> {
        if self.stopping.has_come() {
            Err(ServiceError::Stopping)
        } else {
            Ok(())
        }
    }

    /// No new work from now on.
    pub(crate) fn begin_stop(&self) {
        self.stopping.begin();
    }

    /// Waits, and tells whether the service stops.
    pub(crate) fn wait_for_stop(&self, longest: Duration) -> bool {
        self.stopping.wait(longest)
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
