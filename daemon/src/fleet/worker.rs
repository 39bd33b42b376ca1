//! A worker without scanners, records or an API: it takes orders, and keeps nothing.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use job_queue::jetstream::{BEAT, JetStreamQueue};
use job_queue::{BenchName, QueueError, Worker};

use super::attendance::Attendance;
use super::remote::Remote;
use super::work_folder::WorkFolder;
use super::{FleetError, connect};
use crate::config::NatsConfig;
use crate::jobs::{Hand, be_nice};
use crate::liveness::Liveness;
use crate::stopping::Stopping;

/// Share of the machine's memory that jobs may take.
const MEMORY_SHARE: (u64, u64) = (3, 4);
/// How long it waits for an order before it looks around.
const LOOK: Duration = Duration::from_millis(500);

/// What a worker is to be.
#[derive(Debug, Clone)]
pub struct WorkerOptions {
    /// The servers, and what this machine has.
    pub nats: NatsConfig,
    /// Jobs at a time.
    pub workers: usize,
    /// Threads of each of them; 0 for the machine's cores, shared by the jobs.
    pub threads: usize,
    /// Where files are kept while a job is worked on.
    pub folder: PathBuf,
    /// Ends by itself when there was nothing to do for so long.
    pub idle: Option<Duration>,
}

/// A worker cannot work.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// What is configured cannot work.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// The servers refuse this worker.
    #[error("{0}")]
    Refused(QueueError),
    /// The folder for files does not work.
    #[error("cannot use the folder {} for what is worked on: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The system has no more threads.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
}

/// A worker that can be asked to stop.
#[derive(Debug, Clone, Default)]
pub struct BareWorker {
    stopping: Arc<Stopping>,
}

impl BareWorker {
    /// Asks it to stop: what it has is given back, and others take it.
    pub fn stop(&self) {
        self.stopping.begin();
    }

    /// Works until it is asked to stop; gives how many orders it has taken. Blocks, and is not to
    /// be called from an asynchronous task.
    ///
    /// # Errors
    /// Any [`WorkerError`]. That the servers are away is none: it waits for them.
    pub fn run(&self, options: &WorkerOptions) -> Result<u64, WorkerError> {
        let all = options.folder.join("relief-worker");
        let folder = WorkFolder::make(&all).map_err(|source| WorkerError::Folder {
            path: all.clone(),
            source,
        })?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(WorkerError::Thread)?;
        let name = options.nats.bench_name();
        let mut connection = connect::options(&options.nats, &name).map_err(FleetError::from)?;
        // Benches know on how many servers everything is to be kept.
        connection.makes_missing = false;
        let queue =
            JetStreamQueue::new(connection, runtime.handle().clone()).map_err(FleetError::from)?;
        match queue.wait_connected(LOOK) {
            Ok(()) => tracing::info!(worker = %name, "ready for orders"),
            Err(error @ QueueError::Refused(_)) => return Err(WorkerError::Refused(error)),
            Err(error) => tracing::warn!(%error, "waiting for the servers"),
        }
        let taken = AtomicU64::new(0);
        let attendance = Attendance::default();
        std::thread::scope(|scope| {
            let thread = |name: String| std::thread::Builder::new().name(name);
            for number in 1..=options.workers {
                let hand = Bare {
                    options,
                    queue: &queue,
                    attendance: &attendance,
                    stopping: &self.stopping,
                    taken: &taken,
                    folder: folder.path(),
                    worker: worker(options, &name, number),
                };
                attendance.comes(&hand.worker, hand.threads());
                thread(format!("worker-{number}"))
                    .spawn_scoped(scope, move || hand.work())
                    .map_err(|error| self.give_up(error))?;
            }
            thread("beat".to_owned())
                .spawn_scoped(scope, || self.beat(&queue, &attendance))
                .map_err(|error| self.give_up(error))?;
            Ok::<(), WorkerError>(())
        })?;
        Ok(taken.into_inner())
    }

    fn give_up(&self, error: io::Error) -> WorkerError {
        self.stopping.begin();
        WorkerError::Thread(error)
    }

    fn beat(&self, queue: &JetStreamQueue, attendance: &Attendance) {
        let mut told: Option<Instant> = None;
        while !self.stopping.wait(LOOK) {
            if !queue.is_connected() {
                told = None;
            } else if told.is_none_or(|at| at.elapsed() >= BEAT) {
                told = Some(Instant::now());
                if let Err(error) = attendance.tell(queue) {
                    tracing::debug!(%error, "cannot tell that this worker is there");
                }
            }
        }
        if queue.is_connected() {
            attendance.leave(queue);
        }
    }
}

fn worker(options: &WorkerOptions, name: &BenchName, number: usize) -> Worker {
    let mut worker = Worker::named(&match options.workers {
        1 => name.to_string(),
        _ => format!("{name}-{number}"),
    });
    worker.tools.clone_from(&options.nats.tools);
    let share = || memory_mib(options.workers);
    worker.memory_mib = Some(options.nats.memory_mib.unwrap_or_else(share));
    worker
}

/// Memory in MiB that a job may take beside others on this machine.
pub(super) fn memory_mib(workers: usize) -> u64 {
    let system = rustix::system::sysinfo();
    let total = (system.totalram as u64).saturating_mul(system.mem_unit.into());
    (total / MEMORY_SHARE.1 * MEMORY_SHARE.0 / workers.max(1) as u64) >> 20
}

/// One of the jobs at a time.
struct Bare<'a> {
    options: &'a WorkerOptions,
    queue: &'a JetStreamQueue,
    attendance: &'a Attendance,
    stopping: &'a Stopping,
    taken: &'a AtomicU64,
    folder: &'a Path,
    worker: Worker,
}

impl Bare<'_> {
    fn threads(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        match self.options.threads {
            0 => (cores / self.options.workers.max(1)).max(1),
            configured => configured,
        }
    }

    fn work(&self) {
        be_nice();
        let pulse = Liveness::default().begin(self.worker.name.clone());
        let is_to_stop = |longest| self.stopping.wait(longest);
        let remote = Remote {
            name: &self.worker.name,
            depot: &self.queue.depot(),
            folder: self.folder,
            threads: &|| self.threads(),
            is_to_stop: &is_to_stop,
            attendance: self.attendance,
        };
        let hand = Hand {
            queue: self.queue,
            worker: &self.worker,
            craft: &remote,
            pulse: &pulse,
            is_to_stop: &is_to_stop,
        };
        let mut busy = Instant::now();
        while !self.stopping.wait(Duration::ZERO) {
            if hand.work_once(LOOK) {
                self.taken.fetch_add(1, Ordering::Relaxed);
                busy = Instant::now();
            } else if self.options.idle.is_some_and(|idle| busy.elapsed() >= idle) {
                self.stopping.begin();
            }
        }
    }
}
