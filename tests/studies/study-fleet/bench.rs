//! The bench.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use job_queue::BenchName;
use job_queue::jetstream::{JetStreamQueue, Options};
use relief_api::{Event, Job, JobList, Scan, ScanState, StartScan, path};
use relief_tests::rig::{Client, GUARD, Program, small_house};
use sim_scanner::config::SimConfig;
use sim_scanner::endpoint::pty::PtyServer;
use tokio::runtime::Handle;

use crate::cluster::{Cluster, urls};

const NAME: &str = "bench-1";
const LOOK: Duration = Duration::from_millis(100);

/// The files of a result by name, but for those that tell how long it took.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// Reads a result.
pub(crate) fn files_of(folder: &Path) -> Result<Files> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_timed = ["manifest.json", "report.json", "report.html", "report.pdf"];
        if !is_timed.contains(&name.as_str()) {
            files.insert(name, std::fs::read(entry.path())?);
        }
    }
    ensure!(
        files.len() > 2,
        "{} has {} files",
        folder.display(),
        files.len()
    );
    Ok(files)
}

/// A service with a scanner.
pub(crate) struct Bench {
    program: PathBuf,
    folder: PathBuf,
    scanner: PtyServer,
    service: Option<Program>,
    /// How often each job was told to be published.
    published: Arc<Mutex<BTreeMap<u64, u32>>>,
}

impl Bench {
    /// One before a scanner of the small house, which does its jobs itself.
    pub(crate) async fn alone(program: &Path, folder: &Path) -> Result<Self> {
        Self::before(program, folder, &small_house()).await
    }

    /// One before this scanner, which does its jobs itself.
    pub(crate) async fn before(program: &Path, folder: &Path, scanner: &SimConfig) -> Result<Self> {
        let scanner = scanner.serve_pty(None)?;
        let mut service = Program::start(program, folder, scanner.port(), LOG)?;
        service.ready().await?;
        Ok(Self {
            program: program.to_owned(),
            folder: folder.to_owned(),
            scanner,
            service: Some(service),
            published: Arc::default(),
        })
    }

    /// Starts it anew without servers: it does its jobs itself again.
    pub(crate) async fn part(&mut self) -> Result<()> {
        if let Some(service) = self.service.take() {
            service.kill()?;
        }
        let mut service = Program::start(&self.program, &self.folder, self.scanner.port(), LOG)?;
        service.ready().await?;
        self.service = Some(service);
        Ok(())
    }

    /// Starts it anew with servers by which all its jobs go elsewhere.
    pub(crate) async fn join(
        &mut self,
        servers: &[String],
        replicas: usize,
        silence_s: u32,
    ) -> Result<()> {
        if let Some(service) = self.service.take() {
            service.kill()?;
        }
        let more = format!(
            "{LOG}\n[nats]\nservers = {servers:?}\nbench = \"{NAME}\"\nreplicas = {replicas}\n\
             silence_s = {silence_s}\nunneeded_s = 10\ncompute_when_away = false\n"
        );
        let roles = "roles = [\"acquire\", \"serve\"]";
        let port = self.scanner.port();
        let mut service = Program::start_as(&self.program, &self.folder, port, roles, &more)?;
        service.ready().await?;
        let mut events = service.client().events().await?;
        let published = Arc::clone(&self.published);
        tokio::spawn(async move {
            while let Ok(Some(event)) = events.next().await {
                if let Event::Published { job, .. } = event {
                    let mut published = published.lock().unwrap_or_else(PoisonError::into_inner);
                    *published.entry(job).or_default() += 1;
                }
            }
        });
        self.service = Some(service);
        Ok(())
    }

    pub(crate) fn client(&self) -> Client {
        Client::new(&self.folder.join("reliefd.sock"))
    }

    pub(crate) fn spool(&self) -> PathBuf {
        self.folder.join("spool")
    }

    /// Takes scans, and waits for their results.
    pub(crate) async fn take(&mut self, count: usize) -> Result<Vec<String>> {
        let service = self.service.as_mut().context("no service runs")?;
        let mut scans = Vec::new();
        for number in 1..=count {
            let request = StartScan {
                name: format!("part-{number}"),
                ..StartScan::default()
            };
            let scan: Scan = service.client().post(path::SCANS, &request).await?;
            service.idle().await?;
            let scan: Scan = service.client().get(&path::scan(&scan.id)).await?;
            ensure!(scan.state == ScanState::Complete, "{:?}", scan.reason);
            scans.push(scan.id);
        }
        Ok(scans)
    }

    /// Jobs that are over, by their numbers.
    pub(crate) async fn jobs_over(&self) -> Result<BTreeMap<u64, Job>> {
        let client = self.client();
        let mut over = BTreeMap::new();
        let mut before: Option<u64> = None;
        loop {
            let part = before.map_or_else(String::new, |id| format!("?before={id}"));
            let list: JobList = client.get(&format!("{}{part}", path::JOBS)).await?;
            let jobs = list.jobs.into_iter().filter(|job| job.state.is_over());
            over.extend(jobs.map(|job| (job.id, job)));
            match list.next {
                Some(next) => before = Some(next),
                None => return Ok(over),
            }
        }
    }

    /// How often each job was told to be published.
    pub(crate) fn published(&self) -> BTreeMap<u64, u32> {
        self.published
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Waits until the bench itself has cleared up all that is its on the servers: orders, standings,
    /// objects, and messages that no object's name leads to. Fails if that takes longer.
    pub(crate) async fn is_cleared_up(&self, cluster: &Cluster, longest: Duration) -> Result<()> {
        let mut options = Options::new(urls(&cluster.ports()));
        options.makes_missing = false;
        let handle = Handle::current();
        let queue = tokio::task::spawn_blocking(move || -> Result<_> {
            let queue = JetStreamQueue::new(options, handle)?;
            queue.wait_connected(GUARD)?;
            Ok(Arc::new(queue))
        })
        .await??;
        let begun = Instant::now();
        loop {
            let queue = Arc::clone(&queue);
            let look = move || -> Result<[u64; 3]> {
                let bench = BenchName::try_from(NAME.to_owned())?;
                let depth = queue.depth()?;
                Ok([
                    depth.waiting.values().sum::<u64>() + depth.running,
                    queue.standings(&bench)?.len() as u64,
                    queue.depot().list(&bench)?.len() as u64,
                ])
            };
            // The servers may just be finding a leader.
            let left = tokio::task::spawn_blocking(look).await?;
            let messages = cluster.messages(&format!("OBJ_relief-{NAME}"));
            if matches!(left, Ok([0, 0, 0])) && messages == Some(0) {
                return Ok(());
            }
            ensure!(
                begun.elapsed() < longest,
                "left on the servers: [orders, standings, objects] = {left:?}, messages of objects = \
                 {messages:?}"
            );
            tokio::time::sleep(LOOK).await;
        }
    }

    /// When a job was first told to run, and when it was over.
    pub(crate) async fn follow(&self, jobs: usize) -> Result<(Instant, Instant)> {
        let mut events = self.client().events().await?;
        let (mut first, mut over) = (None, 0);
        let begun = Instant::now();
        while over < jobs {
            let Some(event) = events.next().await? else {
                bail!("the service says nothing more");
            };
            if let Event::Job(job) = event {
                first = first.or(job.started_at.is_some().then(Instant::now));
                over += usize::from(job.state.is_over());
            }
            ensure!(begun.elapsed() < GUARD * 10, "the jobs take too long");
        }
        Ok((first.unwrap_or(begun), Instant::now()))
    }
}

/// What it logs.
const LOG: &str = "[log]\nlevel = \"info,reliefd=debug\"\nformat = \"text\"";
