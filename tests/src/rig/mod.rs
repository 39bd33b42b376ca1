//! Simulated scanners on pseudo-terminals and a private service before them, in a folder
//! that goes when they go.

mod client;
mod events;
mod files;
mod foreign;
mod object;
mod program;
mod wait;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::{Context, Result, ensure};
use relief_api::{Job, JobId, JobState, Rerun, Scan, StartScan, THE_SCANNER, path};
use reliefd::config::{NamedScanner, ScannerConfig};
use reliefd::{Config, Daemon};
use scanner_driver::{Scanner, SerialScanner};
use sim_scanner::config::SimConfig;
use sim_scanner::control::Control;
use sim_scanner::endpoint::pty::PtyServer;
use storage::{Disk, LocalDisk};
use tempfile::TempDir;

pub use client::{Client, Refused, Reply};
pub use events::Events;
pub use files::{Published, journal_columns};
pub use foreign::Foreign;
pub use object::{leisurely_house, recording, small_house};
pub use program::Program;
pub use wait::{Ended, GUARD};

/// The simulated scanner, the service, and a client of it.
///
/// Call [`Rig::end`]: a service that is left running looks for its scanner again, and the
/// system gives the numbers of pseudo-terminals out anew at once.
#[derive(Debug)]
pub struct Rig {
    daemon: Daemon,
    scanners: Scanners,
    client: Client,
    config: Config,
    folder: TempDir,
}

/// The simulated scanners of a rig. A service that was not ended tries its ports again and again, and
/// would take those of another rig for its own, were the same numbers given out anew: so they stay.
#[derive(Debug)]
struct Scanners(BTreeMap<String, PtyServer>);

impl Drop for Scanners {
    fn drop(&mut self) {
        std::mem::forget(std::mem::take(&mut self.0));
    }
}

/// A configuration whose files all lie in one folder, with a scanner at `port`.
#[must_use]
pub fn config(folder: &Path, port: &Path) -> Config {
    let mut config = Config::default();
    config.service.socket = folder.join("reliefd.sock");
    config.service.state_dir = folder.join("state");
    config.service.spool_dir = folder.join("spool");
    config.scanner.port = port.to_owned();
    config
}

impl Rig {
    /// Starts a simulated scanner and a service for it.
    ///
    /// # Errors
    /// Whatever keeps either from starting.
    pub async fn start(scanner: &SimConfig) -> Result<Self> {
        Self::start_with(scanner, |_| {}).await
    }

    /// As [`Rig::start`], with a change to the service's configuration.
    ///
    /// # Errors
    /// As [`Rig::start`].
    pub async fn start_with(scanner: &SimConfig, change: impl FnOnce(&mut Config)) -> Result<Self> {
        Self::start_on(scanner, Arc::new(LocalDisk), change).await
    }

    /// Starts a simulated scanner for each name, and one service for all of them.
    ///
    /// # Errors
    /// As [`Rig::start`].
    pub async fn start_several(scanners: &[(&str, &SimConfig)]) -> Result<Self> {
        let mut servers = BTreeMap::new();
        let mut configured = BTreeMap::new();
        for (name, scanner) in scanners {
            let server = scanner.serve_pty(None)?;
            let attached = ScannerConfig {
                port: server.port().to_owned(),
                ..ScannerConfig::default()
            };
            configured.insert((*name).to_owned(), attached);
            servers.insert((*name).to_owned(), server);
        }
        let change = |config: &mut Config| config.scanners = configured;
        Self::around(servers, Path::new(""), Arc::new(LocalDisk), change).await
    }

    /// As [`Rig::start_with`], with a service that keeps its things on this disk.
    ///
    /// # Errors
    /// As [`Rig::start`].
    pub async fn start_on(
        scanner: &SimConfig,
        disk: Arc<dyn Disk>,
        change: impl FnOnce(&mut Config),
    ) -> Result<Self> {
        let scanner = scanner.serve_pty(None)?;
        let port = scanner.port().to_owned();
        let scanners = BTreeMap::from([(THE_SCANNER.to_owned(), scanner)]);
        Self::around(scanners, &port, disk, change).await
    }

    /// Starts a service alone, for whatever is at `port`.
    ///
    /// # Errors
    /// Whatever keeps the service from starting.
    pub async fn at_port(port: &Path) -> Result<Self> {
        Self::around(BTreeMap::new(), port, Arc::new(LocalDisk), |_| {}).await
    }

    async fn around(
        scanners: BTreeMap<String, PtyServer>,
        port: &Path,
        disk: Arc<dyn Disk>,
        change: impl FnOnce(&mut Config),
    ) -> Result<Self> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let folder = tempfile::Builder::new()
            // Short: the path of a Unix socket has little room.
            .prefix(&format!("rig{}-", NUMBER.fetch_add(1, Ordering::Relaxed)))
            .tempdir()?;
        let mut config = config(folder.path(), port);
        change(&mut config);
        let open = |named: NamedScanner<'_>| {
            let driver: Arc<dyn Scanner> = Arc::new(SerialScanner::open(named.config.serial())?);
            Ok(driver)
        };
        let daemon = Daemon::start_among(config.clone(), &open, disk).await?;
        Ok(Self {
            client: Client::new(daemon.socket()),
            daemon,
            scanners: Scanners(scanners),
            config,
            folder,
        })
    }

    /// Ends the service in good order and starts another on what it left behind, with the
    /// same scanner.
    ///
    /// # Errors
    /// As [`Rig::start`].
    pub async fn restart(self, change: impl FnOnce(&mut Config)) -> Result<Self> {
        let mut config = self.config;
        self.daemon.shutdown().await;
        change(&mut config);
        let daemon = Daemon::start(config.clone()).await?;
        Ok(Self {
            client: Client::new(daemon.socket()),
            daemon,
            scanners: self.scanners,
            config,
            folder: self.folder,
        })
    }

    /// Ends the service in good order, then the scanner, then removes what they kept.
    ///
    /// # Errors
    /// When the folder cannot be removed.
    pub async fn end(self) -> Result<()> {
        self.daemon.shutdown().await;
        let mut scanners = self.scanners;
        drop(std::mem::take(&mut scanners.0));
        Ok(self.folder.close()?)
    }

    /// Speaks to the service.
    #[must_use]
    pub fn client(&self) -> &Client {
        &self.client
    }

    /// A hand on the simulated scanner.
    ///
    /// # Errors
    /// When the rig has none, or several.
    pub fn control(&self) -> Result<Control> {
        self.control_of(THE_SCANNER)
    }

    /// A hand on the simulated scanner of this name.
    ///
    /// # Errors
    /// When the rig has none.
    pub fn control_of(&self, name: &str) -> Result<Control> {
        let scanner = self.scanners.0.get(name);
        Ok(scanner
            .with_context(|| format!("this rig has no scanner {name} of its own"))?
            .control())
    }

    /// Where the scanner is.
    #[must_use]
    pub fn port(&self) -> &Path {
        &self.config.scanner.port
    }

    /// The folder in which results appear.
    #[must_use]
    pub fn spool(&self) -> &Path {
        self.daemon.spool_dir()
    }

    /// A folder for a test's own files.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The folders in the spool, hidden ones included.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn spooled(&self) -> Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in std::fs::read_dir(self.spool())? {
            names.push(entry?.file_name().to_string_lossy().into_owned());
        }
        names.sort();
        Ok(names)
    }

    /// The journal of a scan, as the service hands it out.
    ///
    /// # Errors
    /// When the service refuses, or the file cannot be kept.
    pub async fn journal(&self, scan: &str) -> Result<PathBuf> {
        let bytes = self.client.download(&path::scan_journal(scan)).await?;
        let path = self.folder.path().join(format!("downloaded-{scan}.scan"));
        std::fs::write(&path, bytes)?;
        Ok(path)
    }

    /// Asks for a scan.
    ///
    /// # Errors
    /// When the service refuses.
    pub async fn scan(&self, request: &StartScan) -> Result<Scan> {
        self.client.post(path::SCANS, request).await
    }

    /// Asks for a kept scan to be processed again.
    ///
    /// # Errors
    /// When the service refuses.
    pub async fn rerun(&self, scan: &str, settings: &[(&str, serde_json::Value)]) -> Result<Job> {
        let settings = settings
            .iter()
            .map(|(key, value)| ((*key).to_owned(), value.clone()))
            .collect();
        let request = Rerun {
            settings,
            ..Rerun::default()
        };
        self.client.post(&path::scan_rerun(scan), &request).await
    }

    /// Takes a scan and waits for its result.
    ///
    /// # Errors
    /// When either fails, and how.
    pub async fn scan_to_result(&self, request: &StartScan) -> Result<Ended> {
        let mut events = self.client.events().await?;
        let scan = self.scan(request).await?;
        let scan = events.scan_complete(&scan.id).await?;
        let job = self.first_job(&scan, &mut events).await?;
        Ok(Ended { scan, job })
    }

    /// Waits for the result of a complete scan, from events that began before its end.
    ///
    /// # Errors
    /// When the job does not succeed, and why.
    pub async fn first_job(&self, scan: &Scan, events: &mut Events) -> Result<Job> {
        let id = *scan.jobs.first().context("a complete scan has a job")?;
        self.job_done(events, id).await
    }

    /// Waits for a job's end, which may have come before; the events must have begun by then. As
    /// they may still hold the end of an earlier attempt, they only tell when to ask again.
    ///
    /// # Errors
    /// As [`Events::until`], and when the service does not answer.
    pub async fn job_over(&self, events: &mut Events, id: JobId) -> Result<Job> {
        loop {
            let job: Job = self.client.get(&path::job(id)).await?;
            if job.state.is_over() {
                return Ok(job);
            }
            events.job_becomes(id, JobState::is_over).await?;
        }
    }

    /// Waits for a job's success, as [`Self::job_over`].
    ///
    /// # Errors
    /// When it ends otherwise, and how.
    pub async fn job_done(&self, events: &mut Events, id: JobId) -> Result<Job> {
        let job = self.job_over(events, id).await?;
        ensure!(
            job.state == JobState::Done,
            "job {id} is {}: {}; {}",
            job.state.as_str(),
            job.error.unwrap_or_default(),
            job.hint.unwrap_or_default()
        );
        Ok(job)
    }

    /// Processes a kept scan again and waits for the result.
    ///
    /// # Errors
    /// When the job does not succeed, and why.
    pub async fn rerun_to_result(
        &self,
        scan: &str,
        settings: &[(&str, serde_json::Value)],
    ) -> Result<Job> {
        let mut events = self.client.events().await?;
        let job = self.rerun(scan, settings).await?;
        self.job_done(&mut events, job.id).await
    }

    /// A result, as the service hands it out.
    ///
    /// # Errors
    /// When the service refuses.
    pub async fn result(&self, result: &str) -> Result<Published> {
        Published::fetch(&self.client, result).await
    }
}
