//! NATS servers of the tests.

use std::path::{Path, PathBuf};

use nats_child::{KEEPS, Server, free_port, is_wanted};

/// A NATS server on a port and in a folder of its own.
pub(super) struct Nats {
    server: Server,
    scheme: &'static str,
}

impl Nats {
    fn with(server: Server, scheme: &'static str) -> Self {
        Self { server, scheme }
    }

    /// One that is not started yet. None where there is no nats-server, unless there has to be one.
    pub(super) fn new() -> Option<Self> {
        is_wanted().then(|| Self::with(Server::new(KEEPS).unwrap(), "nats"))
    }

    /// One that runs.
    pub(super) fn started() -> Option<Self> {
        let server = Self::new()?;
        server.start();
        Some(server)
    }

    /// One that asks those who come for more than the address; its certificate and theirs are in its
    /// folder, where `make` puts them.
    pub(super) fn secured(lines: &str, make: impl FnOnce(&Path)) -> Option<Self> {
        if !is_wanted() {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        make(folder.path());
        let lines = format!("{KEEPS}\n{lines}");
        let server = Server::in_folder(folder, free_port().unwrap(), &lines).unwrap();
        server.start().unwrap();
        Some(Self::with(server, "tls"))
    }

    /// One that leads to another, which keeps everything in the domain `hub`, and the other.
    pub(super) fn leaf() -> Option<(Self, Self)> {
        if !is_wanted() {
            return None;
        }
        let port = free_port().unwrap();
        let keeps = KEEPS.replace('}', ", domain: hub }");
        let hub = format!("{keeps}\nleafnodes {{ listen: \"127.0.0.1:{port}\" }}");
        let leaf = format!("leafnodes {{ remotes: [{{ url: \"nats://127.0.0.1:{port}\" }}] }}");
        let [hub, leaf] = [hub, leaf].map(|lines| {
            let server = Server::new(&lines).unwrap();
            server.start().unwrap();
            Self::with(server, "nats")
        });
        Some((leaf, hub))
    }

    /// A file in its folder.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.server.file(name)
    }

    /// Starts it with what it has kept, and waits until it listens.
    pub(super) fn start(&self) {
        self.server.start().unwrap();
    }

    /// Kills it, without a chance to put anything in order.
    pub(super) fn stop(&self) {
        self.server.kill();
    }

    /// Loses the orders that wait or run.
    pub(super) fn lose_orders(&self) {
        self.server.lose("RELIEF_JOBS").unwrap();
    }

    pub(super) fn url(&self) -> String {
        self.server.url().replacen("nats", self.scheme, 1)
    }
}
