//! Telling the others that this service is there, looking who else is, and clearing up.

use std::collections::HashSet;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use job_queue::depot::{Chunk, Kind};
use job_queue::jetstream::{BEAT, Depth, Node, Role as NodeRole};
use job_queue::{FORMAT, OLDEST_FORMAT, Order, QueueError, Standing};
use relief_api::{JobId, JobState};

use super::Fleet;
use super::order::{Answer, Delivered, turn};
use crate::ids::now;
use crate::service::{Service, lock};

/// How often what nobody needs is looked for in the depot, unless it is to stay there for less.
const SWEEP: Duration = Duration::from_secs(10 * 60);

/// How long what does not work is left alone.
const PAUSE: Duration = Duration::from_secs(2);

/// Most jobs of this service elsewhere at a time, however many workers there are.
const MOST_HANDED_OVER: usize = 64;
/// So many when nothing is known of workers.
const HANDED_OVER: usize = 4;

/// For each so many nodes that there are, it looks around once less often: all of them look.
const NODES_FOR_ANOTHER_BEAT: usize = 100;
/// What was seen is told to whoever asks for so long before it looks again.
const FRESH: Duration = Duration::from_secs(2);

/// What was last seen of the others.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    pub(super) nodes: Vec<Node>,
    pub(super) depth: Option<Depth>,
    at: Option<Instant>,
}

impl Seen {
    fn is_older(&self, than: Duration) -> bool {
        self.at.is_none_or(|at| at.elapsed() >= than)
    }

    fn next_look(&self) -> Duration {
        BEAT * (1 + self.nodes.len() / NODES_FOR_ANOTHER_BEAT) as u32
    }
}

/// Beats until the service stops. Runs on a thread of its own.
pub(super) fn beat(service: &Arc<Service>, fleet: &Arc<Fleet>) {
    let since = now();
    let mut swept = Instant::now();
    let mut beaten: Option<Instant> = None;
    while !service.wait_for_stop(Duration::from_millis(500)) {
        if !fleet.queue.is_connected() {
            // Told anew as soon as somebody can hear it.
            beaten = None;
            continue;
        }
        if beaten.is_none_or(|at| at.elapsed() >= BEAT) {
            beaten = Some(Instant::now());
            let told = fleet.queue.beat(&fleet.node(service, &since));
            let told = told.and_then(|()| fleet.attendance.tell(&fleet.queue));
            if let Err(error) = told {
                tracing::debug!(%error, "cannot tell that this service is there");
            }
            let next_look = lock(&fleet.seen).next_look();
            fleet.look_if_older(next_look);
        }
        if fleet.has_left.swap(false, Ordering::Relaxed)
            && let Err(error) = fleet.clear_up(service)
        {
            tracing::debug!(%error, "what nobody needs on the servers is cleared up later");
            fleet.has_left.store(true, Ordering::Relaxed);
            service.wait_for_stop(PAUSE);
        }
        // A worker may just be about to name it.
        let grace = Duration::from_secs(fleet.config.unneeded_s.into());
        if swept.elapsed() >= SWEEP.min(grace) {
            swept = Instant::now();
            fleet.sweep(service, grace);
        }
    }
    if fleet.queue.is_connected() {
        // Whoever hears nothing more knows it a minute later.
        let _ = fleet.queue.leave(&fleet.node(service, &since));
        fleet.attendance.leave(&fleet.queue);
    }
}

impl Fleet {
    fn node(&self, service: &Service, since: &str) -> Node {
        Node {
            role: NodeRole::Bench,
            name: self.bench.to_string(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            formats: (OLDEST_FORMAT, FORMAT),
            memory_mib: None,
            tools: Vec::new(),
            busy_with: None,
            threads: 0,
            waiting: service.queue.untaken() as u64,
            since: since.to_owned(),
        }
    }

    /// Looks who is there and how much there is to do, unless that was seen lately.
    fn look_if_older(&self, than: Duration) {
        if !self.queue.is_connected() || !lock(&self.seen).is_older(than) {
            return;
        }
        let look = || -> Result<Seen, QueueError> {
            Ok(Seen {
                nodes: self.queue.nodes()?,
                depth: Some(self.queue.depth()?),
                at: Some(Instant::now()),
            })
        };
        match look() {
            Ok(seen) => *lock(&self.seen) = seen,
            Err(error) => tracing::debug!(%error, "cannot look who else is there"),
        }
    }

    /// Looks for whoever asks, unless it has just done so.
    pub(super) fn look(&self) {
        self.look_if_older(FRESH);
    }

    /// Most jobs of this service elsewhere at a time: half as many again as there are workers for
    /// each bench that has something to do, so that none has to wait for orders, and no bench takes
    /// up all of them when another one comes.
    pub(super) fn window(&self) -> usize {
        if let Some(configured) = self.config.hand_over {
            return configured;
        }
        let seen = lock(&self.seen);
        let count = |role, is_counted: &dyn Fn(&Node) -> bool| {
            let nodes = seen.nodes.iter();
            nodes
                .filter(|node| node.role == role && is_counted(node))
                .count()
        };
        let workers = count(NodeRole::Worker, &|_| true);
        let own = self.bench.as_str();
        let others = count(NodeRole::Bench, &|node| {
            node.waiting > 0 && node.name != own
        });
        let share = (workers * 3).div_ceil(2 * (1 + others));
        share.clamp(HANDED_OVER, MOST_HANDED_OVER)
    }

    /// Takes back what is left of an order that is over; false if that did not work now.
    pub(super) fn clear(&self, order: &Order, delivered: Option<&Delivered>) -> bool {
        let id = order.key.job;
        let cleared = self.queue.forget(&order.key).and_then(|()| {
            if let Some(delivered) = delivered {
                let chunks = &delivered.bundle.parcel.chunks;
                self.depot.remove(&self.bench, Kind::Result, chunks)?;
            }
            let own = lock(&self.handed).get(&id).cloned().unwrap_or_default();
            let _sending = self.sending.write().unwrap_or_else(PoisonError::into_inner);
            let needed = self.journals_needed(Some(id));
            let mut chunks = own.chunks;
            chunks.retain(|chunk| !needed.contains(&chunk.object(Kind::Journal)));
            self.depot.remove(&self.bench, Kind::Journal, &chunks)
        });
        if let Err(error) = &cleared {
            tracing::debug!(job = id, %error, "what is left of a job is cleared up later");
        }
        cleared.is_ok()
    }

    /// Takes back orders that nobody here waits for, and removes journals that nobody needs.
    fn clear_up(&self, service: &Service) -> Result<(), QueueError> {
        for (key, standing) in self.queue.standings(&self.bench)? {
            if self.is_unwanted(service, key.job, &standing) {
                tracing::info!(job = %key, "taking back a job that is not wanted elsewhere any more");
                self.queue.forget(&key)?;
            }
        }
        self.remove_journals()
    }

    /// Whether nobody here waits for an order: its job was done here meanwhile, or is not known.
    pub(super) fn is_unwanted(&self, service: &Service, job: JobId, standing: &Standing) -> bool {
        if lock(&self.handed).contains_key(&job) {
            return false;
        }
        match service.store.job(job) {
            // One that waits here will be handed over, and finds it.
            Ok(Some(job)) => job.state != JobState::Queued || standing.turn != turn(&job),
            Ok(None) => true,
            // Another time.
            Err(_) => false,
        }
    }

    /// Objects with columns of scans under way, and of jobs on their way but for one.
    fn journals_needed(&self, but_for: Option<JobId>) -> HashSet<String> {
        let name = |chunk: &Chunk| chunk.object(Kind::Journal);
        let mut needed: HashSet<String> = lock(&self.shared).values().flatten().map(name).collect();
        let handed = lock(&self.handed);
        let others = handed.iter().filter(|(id, _)| Some(**id) != but_for);
        needed.extend(others.flat_map(|(_, other)| &other.chunks).map(name));
        needed
    }

    /// Removes journals that nobody needs: no one but this service puts any there.
    fn remove_journals(&self) -> Result<(), QueueError> {
        let _sending = self.sending.write().unwrap_or_else(PoisonError::into_inner);
        let needed = self.journals_needed(None);
        let objects = self.depot.list(&self.bench)?;
        let is_left = |name: &String| !needed.contains(name);
        let names = objects
            .into_iter()
            .map(|object| object.name)
            .filter(is_left);
        let chunk = |name: String| {
            let sha256 = name.strip_prefix(Kind::Journal.prefix())?.to_owned();
            let (bytes, put) = (0, String::new());
            Some(Chunk { sha256, bytes, put })
        };
        let chunks: Vec<Chunk> = names.filter_map(chunk).collect();
        self.depot.remove(&self.bench, Kind::Journal, &chunks)
    }

    /// Forgets which columns were sent of scans that came to nothing: they are aborted, or nobody
    /// waits for their jobs.
    fn forget_ended(&self, service: &Service) {
        let shared: Vec<String> = lock(&self.shared).keys().cloned().collect();
        for scan in shared {
            let Ok(Some(record)) = service.store.scan(&scan) else {
                continue;
            };
            let waits = |id: &JobId| {
                let job = service.store.job(*id);
                !matches!(job, Ok(Some(job)) if job.state.is_over())
            };
            if record.state.is_over() && !record.jobs.iter().any(waits) {
                lock(&self.shared).remove(&scan);
            }
        }
    }

    /// Removes what nobody needs from this bench's depot.
    fn sweep(&self, service: &Service, grace: Duration) {
        self.forget_ended(service);
        let _sending = self.sending.write().unwrap_or_else(PoisonError::into_inner);
        let mut needed = self.journals_needed(None);
        let standings = match self.queue.standings(&self.bench) {
            Ok(standings) => standings,
            Err(error) => {
                tracing::debug!(%error, "the depot is cleared up later");
                return;
            }
        };
        for (_, standing) in standings {
            let result = standing.outcome.and_then(|outcome| match outcome.ending {
                job_queue::Ending::Done { result, .. } => Some(result),
                _ => None,
            });
            let chunks = match result.and_then(|result| serde_json::from_value(result).ok()) {
                Some(Answer::Delivered(delivered)) => delivered.bundle.parcel.chunks,
                _ => Vec::new(),
            };
            needed.extend(chunks.iter().map(|chunk| chunk.object(Kind::Result)));
        }
        match self.depot.sweep(&self.bench, &needed, grace) {
            Ok(swept) if swept.objects + swept.orphan_messages > 0 => {
                tracing::info!(
                    objects = swept.objects,
                    bytes = swept.bytes,
                    "removed what nobody needs from the depot"
                );
            }
            Ok(_) => {}
            Err(error) => tracing::debug!(%error, "the depot is cleared up later"),
        }
    }
}
