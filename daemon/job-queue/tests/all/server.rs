//! A `nats-server`, as a child.

use std::future::Future;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, LazyLock, Mutex, Weak};
use std::time::Duration;

use async_nats::jetstream::Context;
use job_queue::jetstream::{JetStreamQueue, Options};
use nats_child::{KEEPS, Server, is_wanted};
use tempfile::TempDir;
use tokio::runtime::Runtime;

/// Far longer than anything takes that should happen.
pub(crate) const LIMIT: Duration = Duration::from_secs(60);

/// What all queues of the tests run on.
pub(crate) static RUNTIME: LazyLock<Runtime> = LazyLock::new(|| {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .unwrap()
});

/// A port that nobody has now.
pub(crate) fn free_port() -> u16 {
    nats_child::free_port().unwrap()
}

/// One that runs. None where there is no nats-server, unless there has to be one.
pub(crate) fn start() -> Option<Arc<Server>> {
    configured("")
}

/// One that runs with more lines in its configuration.
pub(crate) fn configured(more: &str) -> Option<Arc<Server>> {
    is_wanted().then(|| on(free_port(), more))
}

/// One that runs on this port.
pub(crate) fn on(port: u16, more: &str) -> Arc<Server> {
    in_folder(tempfile::tempdir().unwrap(), port, more)
}

/// One that runs in this folder, which may have files that its configuration names.
pub(crate) fn in_folder(folder: TempDir, port: u16, more: &str) -> Arc<Server> {
    let server = Server::in_folder(folder, port, &format!("{KEEPS}\n{more}")).unwrap();
    server.start().unwrap();
    Arc::new(server)
}

/// Does something on the server behind the queue's back.
pub(crate) fn behind<T, F: Future<Output = T>>(
    server: &Server,
    work: impl FnOnce(Context) -> F,
) -> T {
    RUNTIME.block_on(async {
        let client = async_nats::connect(server.url()).await.unwrap();
        work(async_nats::jetstream::new(client)).await
    })
}

/// Removes the messages of all orders; gives how many there were.
pub(crate) fn lose_orders(server: &Server, options: &Options) -> u64 {
    let name = format!("{}_JOBS", options.prefix.to_uppercase());
    behind(server, |context| async move {
        let stream = context.get_stream(name).await.unwrap();
        stream.purge().await.unwrap().purged
    })
}

/// The server that tests share which do it no harm. It ends with the last of them.
pub(crate) fn shared() -> Option<Arc<Server>> {
    static SHARED: Mutex<Weak<Server>> = Mutex::new(Weak::new());
    let mut shared = SHARED.lock().unwrap();
    if let Some(server) = shared.upgrade() {
        return Some(server);
    }
    let server = start()?;
    *shared = Arc::downgrade(&server);
    Some(server)
}

/// Options by which tests do not meet, and do not wait for long.
pub(crate) fn options(url: &str) -> Options {
    static TESTS: AtomicU32 = AtomicU32::new(0);
    let mut options = Options::new(vec![url.to_owned()]);
    options.prefix = format!("t{}", TESTS.fetch_add(1, Ordering::Relaxed));
    options.ack_wait = Duration::from_millis(1500);
    options.poll = Duration::from_millis(50);
    options
}

/// A queue that is connected.
pub(crate) fn connect(options: &Options) -> Arc<JetStreamQueue> {
    let queue = JetStreamQueue::new(options.clone(), RUNTIME.handle().clone()).unwrap();
    queue.wait_connected(LIMIT).unwrap();
    Arc::new(queue)
}
