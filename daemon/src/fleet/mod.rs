//! Jobs that are worked on elsewhere, by way of NATS.
//!
//! ```text
//! scans under way --> share --> depot
//! own queue --> dispatch --> hand-over (one for each job) --> orders --> workers
//!                                 ^------ news <-- standings <-----'
//!                                 '-----> spool <-- depot <--------'
//! ```
//!
//! The bench's own records stay what decides: a job is queued there first, and it is over when
//! they say so. What goes elsewhere can be lost, done twice, or come late; the result is published
//! once all the same, since it is the bench that publishes. While the servers are away everything
//! waits, or is done here.

mod attendance;
mod beat;
mod board;
mod connect;
mod dispatch;
mod fetch;
mod hand_over;
mod news;
mod order;
mod remote;
mod share;
mod status;
mod work;
mod work_folder;
mod worker;

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use job_queue::depot::{Chunk, Depot};
use job_queue::jetstream::JetStreamQueue;
use job_queue::{BenchName, JobKey, QueueError};
use relief_api::JobId;
use tokio::runtime::Handle;

use crate::config::NatsConfig;
use crate::receivers::FileError;
use crate::service::{Service, lock};
use attendance::Attendance;
use board::Board;

pub(crate) use connect::check_files;
pub use worker::{BareWorker, WorkerError, WorkerOptions};

/// The way to workers elsewhere, and what is known of them.
pub(crate) struct Fleet {
    pub(crate) queue: Arc<JetStreamQueue>,
    depot: Depot,
    bench: BenchName,
    config: NatsConfig,
    board: Board,
    /// Jobs that are being handed over, or are followed.
    handed: Mutex<BTreeMap<JobId, Handed>>,
    /// Chunks of the journals of scans under way that were sent.
    shared: Mutex<BTreeMap<String, Vec<Chunk>>>,
    /// Held for writing by whoever removes chunks: what is just being sent may be among them, and is
    /// not sent where it is there already.
    sending: RwLock<()>,
    /// Orders or journals may have been left that nobody needs.
    has_left: AtomicBool,
    /// What does not work, as it was last told.
    trouble: Mutex<Option<String>>,
    seen: Mutex<beat::Seen>,
    /// Workers of this service.
    attendance: Attendance,
}

/// A job on its way.
#[derive(Debug, Clone, Default)]
struct Handed {
    scan: String,
    scanner: String,
    /// Chunks of its scan's journal.
    chunks: Vec<Chunk>,
    /// When a worker last told how far it is.
    heard: Option<Instant>,
}

/// Jobs cannot go elsewhere.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// A file with a secret cannot be used.
    #[error("[nats] {0}")]
    File(String),
    /// What is configured cannot work.
    #[error("[nats] {0}")]
    Options(#[from] QueueError),
}

impl From<FileError> for FleetError {
    fn from(error: FileError) -> Self {
        Self::File(error.to_string())
    }
}

impl Fleet {
    /// Begins to connect; whether that works is told later.
    pub(crate) fn open(config: &NatsConfig, handle: Handle) -> Result<Self, FleetError> {
        let bench = config.bench_name();
        let queue = Arc::new(JetStreamQueue::new(
            connect::options(config, &bench)?,
            handle,
        )?);
        Ok(Self {
            depot: queue.depot(),
            queue,
            bench,
            config: config.clone(),
            board: Board::default(),
            handed: Mutex::default(),
            shared: Mutex::default(),
            sending: RwLock::default(),
            has_left: AtomicBool::new(false),
            trouble: Mutex::default(),
            seen: Mutex::default(),
            attendance: Attendance::default(),
        })
    }

    fn key(&self, job: JobId) -> JobKey {
        JobKey {
            bench: self.bench.clone(),
            job,
        }
    }

    /// For how long the servers have been away.
    fn away_for(&self) -> Duration {
        self.queue
            .away_since()
            .map_or(Duration::ZERO, |since| since.elapsed())
    }

    /// After how long away the service's own jobs are done here; never if `None`.
    fn away_limit(&self) -> Option<Duration> {
        let limit = Duration::from_secs(self.config.away_s.into());
        self.config.compute_when_away.then_some(limit)
    }

    /// Whether the service's own jobs are done here now.
    fn is_done_here(&self) -> bool {
        !self.queue.is_connected()
            && self
                .away_limit()
                .is_some_and(|limit| self.away_for() >= limit)
    }

    /// Notes what does not work; told once for as long as it stays the same.
    fn trouble(&self, error: Option<&QueueError>) {
        let text = error.map(ToString::to_string);
        let mut known = lock(&self.trouble);
        if *known == text {
            return;
        }
        match &text {
            // That the servers are away is told by the connection.
            Some(error) if self.queue.is_connected() => {
                tracing::warn!(%error, "jobs cannot go to workers elsewhere; trying again");
            }
            Some(_) => {}
            None => tracing::info!("jobs go to workers elsewhere again"),
        }
        *known = text;
    }
}

/// Starts what looks after the jobs that go elsewhere, and those who work on them here.
pub(crate) fn begin(
    service: &Arc<Service>,
    fleet: &Arc<Fleet>,
    workers: usize,
) -> io::Result<Vec<JoinHandle<()>>> {
    // What was worked on when the service last ended.
    let _ = std::fs::remove_dir_all(service.elsewhere_dir());
    let mut threads = Vec::new();
    let mut start = |name: &str, work: fn(&Arc<Service>, &Arc<Fleet>)| -> io::Result<()> {
        let (service, fleet) = (Arc::clone(service), Arc::clone(fleet));
        let thread = std::thread::Builder::new().name(name.to_owned());
        threads.push(thread.spawn(move || work(&service, &fleet))?);
        Ok(())
    };
    start("fleet-news", news::hear)?;
    start("fleet-share", share::share)?;
    start("fleet-beat", beat::beat)?;
    start("hand-over", dispatch::dispatch)?;
    for number in 1..=workers {
        start(&format!("worker-{number}"), work::work)?;
    }
    Ok(threads)
}
