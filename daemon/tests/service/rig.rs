//! A service in a folder of its own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use relief_api::{Event, Job, JobId, JobList, JobState, Scan, ScanState, StartScan, path};
use reliefd::config::{Kinds, NamedScanner};
use reliefd::{Config, Daemon};
use scanner_driver::Scanner;
use storage::{Disk, LocalDisk};
use tempfile::TempDir;

use crate::client::{Client, Events};
use crate::fake::FakeScanner;

/// Longer than anything takes that is waited for.
pub(crate) const GUARD: Duration = Duration::from_secs(60);

pub(crate) struct Rig {
    pub(crate) daemon: Daemon,
    pub(crate) client: Client,
    /// The first of the scanners.
    pub(crate) scanner: Arc<FakeScanner>,
    /// All of them by name.
    pub(crate) scanners: BTreeMap<String, Arc<FakeScanner>>,
    pub(crate) folder: TempDir,
}

pub(crate) fn config(folder: &Path) -> Config {
    let mut config = Config::default();
    config.service.socket = folder.join("reliefd.sock");
    config.service.state_dir = folder.join("state");
    config.service.spool_dir = folder.join("spool");
    config.queue.threads = 1;
    // What a scan's shapes are takes most of a job's time, and is nothing the service decides.
    config.reconstruct.kinds = Some(Kinds::FreeForm);
    config
}

impl Rig {
    pub(crate) async fn new() -> Self {
        Self::start(tempfile::tempdir().unwrap(), |_| {}).await
    }

    pub(crate) async fn start(folder: TempDir, change: impl FnOnce(&mut Config)) -> Self {
        Self::start_on(folder, Arc::new(LocalDisk), change).await
    }

    pub(crate) async fn start_on(
        folder: TempDir,
        disk: Arc<dyn Disk>,
        change: impl FnOnce(&mut Config),
    ) -> Self {
        Self::start_before(folder, disk, change, |_| {}).await
    }

    /// Starts the service before scanners that were prepared.
    pub(crate) async fn start_before(
        folder: TempDir,
        disk: Arc<dyn Disk>,
        change: impl FnOnce(&mut Config),
        prepare: impl Fn(&FakeScanner),
    ) -> Self {
        let mut config = config(folder.path());
        change(&mut config);
        let names = config.each_scanner();
        let scanners: BTreeMap<String, Arc<FakeScanner>> = names
            .iter()
            .map(|named| (named.name.to_owned(), FakeScanner::new()))
            .collect();
        scanners.values().for_each(|scanner| prepare(scanner));
        let scanner = Arc::clone(&scanners[names[0].name]);
        let open = |named: NamedScanner<'_>| {
            let scanner: Arc<dyn Scanner> = scanners[named.name].clone();
            Ok(scanner)
        };
        let daemon = Daemon::start_among(config, &open, disk).await.unwrap();
        Self {
            client: Client::new(daemon.socket()),
            daemon,
            scanner,
            scanners,
            folder,
        }
    }

    /// The scanner of this name.
    pub(crate) fn of(&self, name: &str) -> &Arc<FakeScanner> {
        &self.scanners[name]
    }

    /// Ends the service and starts another on what it left.
    pub(crate) async fn restart(self) -> Self {
        self.restart_with(|_| {}).await
    }

    pub(crate) async fn restart_with(self, change: impl FnOnce(&mut Config)) -> Self {
        self.daemon.shutdown().await;
        Self::start(self.folder, change).await
    }

    pub(crate) fn journal(&self, scan: &str) -> PathBuf {
        self.folder
            .path()
            .join("state/scans")
            .join(format!("{scan}.scan"))
    }

    pub(crate) async fn start_scan(&self, name: &str) -> Scan {
        let request = StartScan {
            name: name.into(),
            ..StartScan::default()
        };
        self.client.post(path::SCANS, &request).await
    }

    /// Takes a scan and waits for its result.
    pub(crate) async fn scan_to_result(&self, name: &str) -> (Scan, Job) {
        let mut events = self.client.events().await;
        let scan = self.start_scan(name).await;
        let scan = ended(&mut events, &scan.id).await;
        assert_eq!(scan.state, ScanState::Complete, "{:?}", scan.reason);
        let job = job_over(&mut events, self, scan.jobs[0]).await;
        assert_eq!(job.state, JobState::Done, "{:?}", job.error);
        (scan, job)
    }
}

/// Waits for a scan's end.
pub(crate) async fn ended(events: &mut Events, id: &str) -> Scan {
    let find = |event: &Event| match event {
        Event::Scan(scan) if scan.id == id && scan.state.is_over() => Some(scan.clone()),
        _ => None,
    };
    events.until(find).await.1
}

/// The scan once its state is no longer `starting`.
pub(crate) async fn settled(client: &Client, id: &str) -> Scan {
    let settled = async {
        loop {
            let scan: Scan = client.get(&path::scan(id)).await;
            if scan.state != ScanState::Starting {
                return scan;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let settled = tokio::time::timeout(GUARD, settled).await;
    settled.expect("the scan stays as it is")
}

/// Waits for the end of a job, which may be over already, or not be there before its scan is over. The
/// stream may still hold the end of an earlier attempt, so that it only tells when to ask again.
pub(crate) async fn job_over(events: &mut Events, rig: &Rig, id: JobId) -> Job {
    let itself = format!("{}?limit=1&before={}", path::JOBS, id + 1);
    loop {
        let mut list: JobList = rig.client.get(&itself).await;
        let found = list.jobs.pop();
        if let Some(job) = found.filter(|job| job.id == id && job.state.is_over()) {
            return job;
        }
        let over = |event: &Event| match event {
            Event::Job(job) if job.id == id && job.state.is_over() => Some(()),
            _ => None,
        };
        events.until(over).await;
    }
}

pub(crate) fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}
