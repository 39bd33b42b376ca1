//! Debian's `nats-server`, as a child.

use std::fs;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, LazyLock, Mutex, Weak};
use std::time::{Duration, Instant};

use job_queue::jetstream::{JetStreamQueue, Options};
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

/// A server that comes and goes, on the same port and folder.
#[derive(Debug)]
pub(crate) struct Server {
    folder: tempfile::TempDir,
    port: u16,
    arguments: Vec<String>,
    child: Mutex<Option<Child>>,
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A port that nobody has now.
pub(crate) fn free_port() -> u16 {
    // Whoever else is given it meanwhile has the test fail, and nothing else.
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    listener.local_addr().unwrap().port()
}

fn is_installed() -> bool {
    let found = Command::new("nats-server")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok();
    assert!(
        found || std::env::var_os("RELIEF_NEEDS_NATS").is_none(),
        "nats-server is missing"
    );
    if !found {
        println!("skipped: no nats-server");
    }
    found
}

impl Server {
    /// Whether there is a nats-server.
    pub(crate) fn is_there() -> bool {
        is_installed()
    }

    /// One that runs. None where there is no nats-server, unless there has to be one.
    pub(crate) fn start() -> Option<Arc<Self>> {
        Self::configured("")
    }

    /// One that runs with more lines in its configuration.
    pub(crate) fn configured(more: &str) -> Option<Arc<Self>> {
        is_installed().then(|| Self::on(free_port(), more))
    }

    /// One that runs on this port; `FOLDER` in its configuration is replaced by its own.
    pub(crate) fn on(port: u16, more: &str) -> Arc<Self> {
        let folder = tempfile::tempdir().unwrap();
        Self::in_folder(folder, port, more)
    }

    /// One that runs in this folder, which may have files that its configuration names.
    pub(crate) fn in_folder(folder: tempfile::TempDir, port: u16, more: &str) -> Arc<Self> {
        let place = folder.path().display().to_string();
        let config = folder.path().join("nats.conf");
        let text = format!(
            "listen: \"127.0.0.1:{port}\"\njetstream {{ store_dir: \"{place}/store\" }}\n{}\n",
            more.replace("FOLDER", &place)
        );
        fs::write(&config, text).unwrap();
        let log = folder.path().join("log");
        let server = Self {
            arguments: vec![
                "-c".to_owned(),
                config.display().to_string(),
                "-l".to_owned(),
                log.display().to_string(),
            ],
            folder,
            port,
            child: Mutex::new(None),
        };
        server.run();
        Arc::new(server)
    }

    /// Starts it again, and waits until it listens.
    pub(crate) fn run(&self) {
        let child = Command::new("nats-server")
            .args(&self.arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        *self.child.lock().unwrap() = Some(child);
        let begun = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).is_err() {
            assert!(
                begun.elapsed() < LIMIT,
                "nats-server does not listen: {}",
                fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Kills it, without a chance to put anything in order.
    pub(crate) fn kill(&self) {
        if let Some(mut child) = self.child.lock().unwrap().take() {
            let _ = child.kill();
            child.wait().unwrap();
        }
    }

    /// Loses all that it has kept.
    pub(crate) fn wipe(&self) {
        let store = self.folder.path().join("store");
        fs::remove_dir_all(store).unwrap();
    }

    pub(crate) fn port(&self) -> u16 {
        self.port
    }

    pub(crate) fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }
}

/// The server that tests share which do it no harm. It ends with the last of them.
pub(crate) fn shared() -> Option<Arc<Server>> {
    static SHARED: Mutex<Weak<Server>> = Mutex::new(Weak::new());
    let mut shared = SHARED.lock().unwrap();
    if let Some(server) = shared.upgrade() {
        return Some(server);
    }
    let server = Server::start()?;
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
