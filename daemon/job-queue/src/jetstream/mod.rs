//! The queue on NATS JetStream.
//!
//! Two things are kept of an order. Its message, in a stream, is what workers are given, and what
//! the server gives to another one when a worker dies. Its standing, in a bucket, says what became
//! of it. All changes of a standing are made on condition that nobody else has changed it, so that
//! of two workers with the same message one has the order: whatever the messages do, the standing
//! decides. A message without a standing that speaks for it is dropped.

mod connect;
mod depth;
mod kept;
mod lease;
mod names;
mod news;
mod offer;
mod options;
mod pull;
mod registry;
mod stores;
mod take;

use std::collections::HashSet;
use std::future::Future;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use tokio::runtime::Handle;
use tokio::sync::watch;
use tokio::task::JoinHandle;

pub use depth::Depth;
pub use news::News;
pub use options::{Login, Options, Secret};
pub use registry::{BEAT, Node, Role};

pub(crate) use connect::Link;
pub(crate) use names::Names;
pub(crate) use stores::{Stores, find_or_make, random_name};

use crate::order::{JobKey, Order};
use crate::queue::{JobQueue, Lease, QueueError, Standing, Worker};
use take::Lines;

/// How long one call may take, besides what it waits for orders.
const CALL: Duration = Duration::from_secs(15);

/// The queue on NATS JetStream. It is there at once, and answers [`QueueError::Away`] as long as
/// the server is not.
#[derive(Debug)]
pub struct JetStreamQueue {
    shared: Arc<Shared>,
    tasks: Mutex<Vec<JoinHandle<()>>>,
}

/// What calls and tasks share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) options: Options,
    pub(crate) names: Names,
    pub(crate) link: Arc<Link>,
    handle: Handle,
    stores: tokio::sync::Mutex<Option<(u64, Arc<Stores>)>>,
    /// Consumers that are known to be there.
    consumers: Mutex<HashSet<String>>,
    lines: Mutex<Lines>,
    bell: watch::Sender<u64>,
    /// Orders that were given out, which tells when it is the turn of the lowest priority.
    given: AtomicU64,
    /// Tells this one from others of its name.
    instance: String,
}

impl JetStreamQueue {
    /// Begins to connect, on a runtime with threads of its own.
    ///
    /// # Errors
    /// [`QueueError::Refused`] if the options cannot work, whatever the server.
    pub fn new(options: Options, handle: Handle) -> Result<Self, QueueError> {
        options.check()?;
        let shared = Arc::new(Shared {
            names: Names::new(&options.prefix),
            link: Link::new(&options),
            handle: handle.clone(),
            stores: tokio::sync::Mutex::new(None),
            consumers: Mutex::new(HashSet::new()),
            lines: Mutex::new(Lines::default()),
            bell: watch::Sender::new(0),
            given: AtomicU64::new(0),
            instance: random_name(),
            options: options.clone(),
        });
        let connecting = handle.spawn(Arc::clone(&shared.link).establish(options));
        let listening = handle.spawn(Arc::clone(&shared).listen_to_the_bell());
        Ok(Self {
            shared,
            tasks: Mutex::new(vec![connecting, listening]),
        })
    }

    /// Waits so long for the connection.
    ///
    /// # Errors
    /// Why it is not there: [`QueueError::Refused`] at once if the server does not accept the
    /// login, else [`QueueError::Away`].
    pub fn wait_connected(&self, longest: Duration) -> Result<(), QueueError> {
        let end = Instant::now() + longest;
        loop {
            match self.shared.link.client() {
                Ok(_) => return Ok(()),
                Err(QueueError::Away(_)) if Instant::now() < end => {}
                Err(error) => return Err(error),
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Whether the connection is there.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.shared.link.is_up()
    }

    /// Since when it is not, if it is not.
    #[must_use]
    pub fn away_since(&self) -> Option<Instant> {
        self.shared.link.away_since()
    }

    /// What calls and tasks share.
    pub(crate) fn share(&self) -> Arc<Shared> {
        Arc::clone(&self.shared)
    }

    /// Takes back what was offered: the bench has what it needs of it, or wants it no more and
    /// does not ask what becomes of it. A worker that has it finds it lost; no [`News`] tell of it.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn forget(&self, key: &JobKey) -> Result<(), QueueError> {
        self.shared.run(CALL, self.shared.forget(key))
    }
}

impl Drop for JetStreamQueue {
    fn drop(&mut self) {
        for task in locked(&self.tasks).iter() {
            task.abort();
        }
    }
}

impl JobQueue for JetStreamQueue {
    fn offer(&self, order: &Order) -> Result<(), QueueError> {
        self.shared.run(CALL, self.shared.offer(order))
    }

    fn cancel(&self, key: &JobKey) -> Result<(), QueueError> {
        self.shared.run(CALL, self.shared.cancel(key))
    }

    fn standing(&self, key: &JobKey) -> Result<Option<Standing>, QueueError> {
        self.shared.run(CALL, async {
            let stores = self.shared.stores().await?;
            Ok(stores.read(key).await?.map(|(kept, _)| kept.standing))
        })
    }

    fn take(
        &self,
        worker: &Worker,
        longest: Duration,
    ) -> Result<Option<Box<dyn Lease>>, QueueError> {
        let taken = self
            .shared
            .run(CALL + longest, take::take(&self.shared, worker, longest))?;
        Ok(taken.map(|lease| Box::new(lease) as Box<dyn Lease>))
    }
}

impl Shared {
    /// Blocks until the work is done, the connection is lost, or it takes too long.
    pub(crate) fn run<T>(
        &self,
        longest: Duration,
        work: impl Future<Output = Result<T, QueueError>>,
    ) -> Result<T, QueueError> {
        let begun = Instant::now();
        let done = self.handle.block_on(async {
            self.link.client()?;
            tokio::select! {
                done = work => done,
                lost = self.link.lost() => Err(lost),
                forbidden = self.link.forbidden() => Err(forbidden),
                () = tokio::time::sleep(longest) => Err(QueueError::Away(format!(
                    "NATS did not answer within {} s",
                    longest.as_secs()
                ))),
            }
        });
        done.map_err(|error| self.link.or_forbidden(begun, error))
    }

    /// Streams and buckets; looked for anew after each connection, as a server may have lost them.
    pub(crate) async fn stores(&self) -> Result<Arc<Stores>, QueueError> {
        let client = self.link.client()?;
        let times = self.link.times();
        let mut kept = self.stores.lock().await;
        if let Some((at, stores)) = &*kept
            && *at == times
        {
            return Ok(Arc::clone(stores));
        }
        let stores = Arc::new(Stores::open(client, &self.options, &self.names).await?);
        self.forget_consumers();
        *kept = Some((times, Arc::clone(&stores)));
        Ok(stores)
    }

    /// Has streams and buckets looked for anew.
    pub(crate) async fn doubt_stores(&self) {
        *self.stores.lock().await = None;
    }

    fn forget_consumers(&self) {
        locked(&self.consumers).clear();
        locked(&self.lines).outdate();
    }

    async fn listen_to_the_bell(self: Arc<Self>) {
        let mut up = self.link.watch();
        loop {
            if up.wait_for(|up| up.there).await.is_err() {
                return;
            }
            // The client subscribes again by itself when it connects again.
            if let Ok(client) = self.link.client()
                && let Ok(mut rung) = client.subscribe(self.names.bell()).await
            {
                while let Some(message) = rung.next().await {
                    locked(&self.lines).heard_of(&String::from_utf8_lossy(&message.payload));
                    self.bell.send_modify(|times| *times += 1);
                }
            }
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
    }
}

/// A lock whose holders do not panic in the midst of a change.
pub(crate) fn locked<T>(lock: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    lock.lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}
