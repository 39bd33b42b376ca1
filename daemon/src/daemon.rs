//! The service as a whole: started, reloaded, and brought to an orderly end.

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use scanner_driver::{Scanner, ScannerError};
use storage::{Disk, LocalDisk, create_dir_all};
use tokio_util::sync::CancellationToken;

use crate::acquisition::watch;
use crate::config::{Config, HttpConfig, Reloaded, Role};
use crate::discovery::Announcement;
use crate::error::ServiceError;
use crate::events::Hub;
use crate::fleet::{self, Fleet, FleetError};
use crate::http::{ListenError, on_loopback, on_socket, serve};
use crate::jobs::work;
use crate::laser::LaserLogError;
use crate::receivers::{self, ReceiverError, Receivers};
use crate::service::{Kept, Service, remove_if_there};
use crate::space::tidy;
use crate::spool::{Spool, SpoolError};
use crate::station::{OpenScanner, make_all, open_all, open_attached, stop_all};
use crate::store::{Store, StoreError};
use crate::systemd::{Health, Inherited};
use crate::tokens::{TokenError, Tokens};
use crate::traces::{Traces, TracesError};

/// How long connections may take to end once the service stops.
const DRAIN: Duration = Duration::from_secs(5);

/// How long a predecessor that is just ending may hold the records, as in a restart.
const HANDOVER: Duration = Duration::from_secs(3);

/// The service cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The folder of the kept scans does not work.
    #[error(
        "cannot use the folder {} (service.state_dir): {source}; it must be writable for the \
         user of reliefd",
        path.display()
    )]
    StateDir {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The records do not work.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The spool does not work.
    #[error("{0}; {hint}", hint = .0.hint())]
    Spool(#[from] SpoolError),
    /// The tokens do not work.
    #[error(transparent)]
    Tokens(#[from] TokenError),
    /// Those who are told cannot be.
    #[error(transparent)]
    Receivers(#[from] ReceiverError),
    /// The collector of traces cannot be.
    #[error(transparent)]
    Traces(#[from] TracesError),
    /// Jobs cannot go elsewhere.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// The log of the laser does not work.
    #[error(transparent)]
    Laser(#[from] LaserLogError),
    /// The API cannot be offered.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The link to a scanner cannot be set up.
    #[error("cannot set up the scanner of [{section}]: {source}")]
    Scanner {
        /// Its section of the configuration.
        section: String,
        /// Why not.
        source: ScannerError,
    },
    /// What an earlier run left cannot be taken up.
    #[error("cannot take up where the service last ended: {0}")]
    Recover(ServiceError),
    /// The system has no more threads.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
}

/// A running service.
///
/// Call [`Daemon::shutdown`]; a handle that is merely dropped leaves the service running
/// until the runtime ends.
pub struct Daemon {
    service: Arc<Service>,
    stop: CancellationToken,
    servers: Vec<tokio::task::JoinHandle<()>>,
    threads: Vec<JoinHandle<()>>,
    socket: PathBuf,
    /// Else it goes on without this process.
    socket_is_ours: bool,
    listen: Option<SocketAddr>,
    announcement: Option<Announcement>,
}

impl std::fmt::Debug for Daemon {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Daemon")
            .field("socket", &self.socket)
            .field("listen", &self.listen)
            .finish_non_exhaustive()
    }
}

impl Daemon {
    /// Starts the service with the scanners that the configuration names. They need not be
    /// there yet.
    ///
    /// # Errors
    /// Any [`StartError`].
    pub async fn start(config: Config) -> Result<Self, StartError> {
        Self::start_activated(config, Inherited::default()).await
    }

    /// The same, with the API on sockets that this process was handed over.
    ///
    /// # Errors
    /// Any [`StartError`].
    pub async fn start_activated(config: Config, inherited: Inherited) -> Result<Self, StartError> {
        Self::start_all(config, &open_attached, Arc::new(LocalDisk), inherited).await
    }

    /// Starts the service with any scanner in place of the one that the configuration names.
    ///
    /// # Errors
    /// Any [`StartError`] but [`StartError::Scanner`].
    pub async fn start_with(config: Config, scanner: Arc<dyn Scanner>) -> Result<Self, StartError> {
        Self::start_on(config, scanner, Arc::new(LocalDisk)).await
    }

    /// Starts the service with any scanner on any disk.
    ///
    /// # Errors
    /// Any [`StartError`] but [`StartError::Scanner`].
    pub async fn start_on(
        config: Config,
        scanner: Arc<dyn Scanner>,
        disk: Arc<dyn Disk>,
    ) -> Result<Self, StartError> {
        Self::start_among(config, &|_| Ok(Arc::clone(&scanner)), disk).await
    }

    /// Starts the service with any scanners on any disk: `open` gives each one that the
    /// configuration names.
    ///
    /// # Errors
    /// Any [`StartError`].
    pub async fn start_among(
        config: Config,
        open: &OpenScanner<'_>,
        disk: Arc<dyn Disk>,
    ) -> Result<Self, StartError> {
        Self::start_all(config, open, disk, Inherited::default()).await
    }

    async fn start_all(
        config: Config,
        open: &OpenScanner<'_>,
        disk: Arc<dyn Disk>,
        inherited: Inherited,
    ) -> Result<Self, StartError> {
        // Before anything is touched, as a configuration that is not sound.
        let scanners = open_all(&config, open)?;
        let scans_dir = prepare_state(&*disk, &config.service.state_dir)?;
        let records = config.service.state_dir.join("reliefd.redb");
        let store = Store::open_soon(&disk, &records, HANDOVER).await?;
        remove_grids(&scans_dir);
        let spool = Spool::open(Arc::clone(&disk), &config.service.spool_dir)?;
        let tokens = Tokens::open(
            Arc::clone(&disk),
            &config.service.state_dir.join("tokens.json"),
        )?;
        let receivers = Receivers::open(&config, &store)?;
        let traces = Traces::start(&config.traces)?;
        let nats = &config.nats;
        let fleet = nats
            .is_used()
            .then(|| Fleet::open(nats, tokio::runtime::Handle::current()))
            .transpose()?;
        let hub = Arc::new(Hub::default());
        let stations = make_all(&config, scanners, &hub, &*disk)?;
        let serves = config.has(Role::Serve);
        let offered = if serves {
            Some(inherited.or_bind(&config.service).await?)
        } else {
            None
        };
        let workers = config.queue.workers;
        let limits = Arc::new(config.http.clone());
        let kept = Kept {
            disk,
            store,
            spool,
            tokens,
            receivers,
        };
        let service = Arc::new(Service::new(config, stations, hub, kept, scans_dir));
        // It is new: there are none yet.
        let _ = service.traces.set(traces);
        if let Some(fleet) = fleet {
            let _ = service.fleet.set(Arc::new(fleet));
        }
        let cut_short = service.recover_scans().map_err(StartError::Recover)?;
        service.adopt_journals().map_err(StartError::Recover)?;
        service.recover_jobs().map_err(StartError::Recover)?;
        service.sweep();
        service.measure_free();

        let stop = CancellationToken::new();
        let socket = offered.as_ref().map(|one| one.socket.clone());
        let socket = socket.unwrap_or_default();
        let mut daemon = Self {
            service,
            stop,
            servers: Vec::new(),
            threads: Vec::new(),
            socket,
            socket_is_ours: offered.as_ref().is_some_and(|one| one.socket_is_ours),
            listen: offered.as_ref().and_then(|one| one.listen),
            announcement: None,
        };
        daemon.start_threads(workers).map_err(StartError::Thread)?;
        // Nothing can fail any more that would end the service, and nobody can ask for a scan yet.
        daemon.service.take_up_scans(cut_short);
        if let Some(offered) = offered {
            let app = on_socket(&daemon.service, &daemon.stop);
            daemon.serve(offered.unix, app, Arc::clone(&limits));
            if let Some(tcp) = offered.tcp {
                daemon.serve(tcp, on_loopback(&daemon.service, &daemon.stop), limits);
            }
            daemon.announcement = Announcement::begin(&daemon.service.config());
        }
        tracing::info!(socket = %daemon.socket.display(), "reliefd {} is ready", env!("CARGO_PKG_VERSION"));
        Ok(daemon)
    }

    fn start_threads(&mut self, workers: usize) -> io::Result<()> {
        if let Some(fleet) = self.service.fleet.get() {
            let threads = fleet::begin(&self.service, fleet, workers)?;
            self.threads.extend(threads);
        } else {
            for number in 1..=workers {
                let service = Arc::clone(&self.service);
                self.threads.push(
                    std::thread::Builder::new()
                        .name(format!("worker-{number}"))
                        .spawn(move || work(&service))?,
                );
            }
        }
        let service = Arc::clone(&self.service);
        self.threads.push(
            std::thread::Builder::new()
                .name("tidy".into())
                .spawn(move || tidy(&service))?,
        );
        let service = Arc::clone(&self.service);
        self.threads.push(
            std::thread::Builder::new()
                .name("show".into())
                .spawn(move || receivers::show(&service))?,
        );
        let acquires = self.service.config().has(Role::Acquire);
        for station in self.service.stations.iter().filter(|_| acquires) {
            let (service, station) = (Arc::clone(&self.service), Arc::clone(station));
            self.threads.push(
                std::thread::Builder::new()
                    .name(station.loop_name("scanner-watch"))
                    .spawn(move || watch(&service, &station))?,
            );
        }
        receivers::begin_all(&self.service)
    }

    fn serve<L>(&mut self, listener: L, app: Router, limits: Arc<HttpConfig>)
    where
        L: axum::serve::Listener,
        L::Addr: std::fmt::Debug,
    {
        let serving = serve(listener, app, limits, self.stop.clone());
        self.servers.push(tokio::spawn(serving));
    }

    /// The Unix socket of the API; empty if it is not offered.
    #[must_use]
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// The loopback address of the API, if it is offered on one.
    #[must_use]
    pub fn listen(&self) -> Option<SocketAddr> {
        self.listen
    }

    /// A way to ask how the service does.
    #[must_use]
    pub fn health(&self) -> Health {
        Health::new(&self.service)
    }

    /// The spool's folder.
    #[must_use]
    pub fn spool_dir(&self) -> &Path {
        self.service.spool.root()
    }

    /// Takes over what may change in service; says what became of it.
    #[must_use = "some changes need a restart, which the user should be told"]
    pub fn reload(&self, config: &Config) -> Reloaded {
        let outcome = self.service.reload(config);
        // Also where no key has changed: another secret may stand in the same file.
        receivers::reload(&self.service, config);
        outcome
    }

    /// Brings the service to an orderly end: scans under way are aborted and kept, with the
    /// lasers off; running jobs stop at their next opportunity and are taken up by the
    /// next start; connections are drained. When this returns, another service may take
    /// over the folders and the socket.
    pub async fn shutdown(self) {
        let service = Arc::clone(&self.service);
        service.begin_stop();
        service.queue.stop();
        service.receivers.stop();
        let threads = self.threads;
        let announcement = self.announcement;
        let ended = tokio::task::spawn_blocking(move || {
            stop_all(&service.stations, "the service was stopped");
            service.join_scans();
            for thread in threads {
                let name = thread.thread().name().unwrap_or("?").to_owned();
                if thread.join().is_err() {
                    tracing::error!(thread = name, "a thread ended by a panic");
                }
            }
            service.receivers.join();
            if let Some(traces) = service.traces.get() {
                traces.end();
            }
            if let Some(announcement) = announcement {
                announcement.end();
            }
        })
        .await;
        if ended.is_err() {
            tracing::error!("the orderly end was cut short");
        }
        self.stop.cancel();
        let drain = async {
            for server in self.servers {
                // A server that panicked has ended too.
                let _ = server.await;
            }
        };
        if tokio::time::timeout(DRAIN, drain).await.is_err() {
            tracing::warn!("some connections were cut");
        }
        if self.socket_is_ours {
            remove_if_there(&self.socket);
        }
        // A connection, or a request that waits for the scanner, may hold the service for
        // longer than it is waited for above. The records are given up here in any case,
        // and last: who waits for them finds all else given up too.
        let service = self.service;
        let closed = tokio::task::spawn_blocking(move || service.store.close()).await;
        if closed.is_err() {
            tracing::error!("the records were not closed in good order");
        }
        tracing::info!("reliefd has ended");
    }
}

/// Makes the state folder; gives that of the scans.
fn prepare_state(disk: &dyn Disk, state_dir: &Path) -> Result<PathBuf, StartError> {
    let scans_dir = state_dir.join("scans");
    create_dir_all(disk, &scans_dir).map_err(|source| StartError::StateDir {
        path: state_dir.to_owned(),
        source,
    })?;
    Ok(scans_dir)
}

/// Range images that were put aside are not trusted across a restart.
fn remove_grids(scans_dir: &Path) {
    let Ok(entries) = std::fs::read_dir(scans_dir) else {
        return;
    };
    for entry in entries.flatten() {
        if entry.path().extension().is_some_and(|e| e == "grid") {
            remove_if_there(&entry.path());
        }
    }
}
