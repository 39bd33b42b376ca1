//! A `nats-server` as a child that comes and goes, on the same port and folder.

use std::ffi::OsString;
use std::fs;
use std::io::{self, BufRead, BufReader, Error, ErrorKind, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// What has a server keep streams, buckets and objects in its folder.
pub const KEEPS: &str = "jetstream { store_dir: \"FOLDER/kept\" }";

/// Set where tests are to fail, not to be skipped, when there is no server.
const NEEDED: &str = "RELIEF_NEEDS_NATS";

/// The server's program where it is not the one of the path: another version, say.
const CHOSEN: &str = "RELIEF_NATS_SERVER";

fn program() -> OsString {
    std::env::var_os(CHOSEN).unwrap_or_else(|| "nats-server".into())
}

/// What the server calls itself and its version.
///
/// # Errors
/// When it cannot be started.
pub fn version() -> io::Result<String> {
    let output = Command::new(program())
        .arg("--version")
        .output()
        .map_err(|error| cannot_start(&error))?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn cannot_start(error: &Error) -> Error {
    let program = program();
    let told = format!(
        "cannot start {}: {error}; install it (`cargo xtask nats`), or name it in {CHOSEN}",
        program.display()
    );
    Error::new(error.kind(), told)
}

/// How long one may take to listen.
const LIMIT: Duration = Duration::from_secs(60);

/// Whether tests are to go on that need a server: it is installed, or has to be, and then they fail
/// with what is missing.
#[must_use]
pub fn is_wanted() -> bool {
    match version() {
        Ok(_) => true,
        Err(_) if std::env::var_os(NEEDED).is_some() => true,
        Err(error) => {
            println!("skipped: {error}");
            false
        }
    }
}

/// A port of this machine that nobody has now. Whoever else is given it meanwhile has the server not
/// start, and does no other harm.
///
/// # Errors
/// When the system has none left.
pub fn free_port() -> io::Result<u16> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    Ok(listener.local_addr()?.port())
}

/// A server, which is killed when dropped.
#[derive(Debug)]
pub struct Server {
    folder: TempDir,
    port: u16,
    child: Mutex<Option<Child>>,
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
    }
}

impl Server {
    /// One that is not started yet, and listens on a port that nobody has. `FOLDER` in the lines of its
    /// configuration stands for a folder of its own.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn new(lines: &str) -> io::Result<Self> {
        Self::in_folder(tempfile::tempdir()?, free_port()?, lines)
    }

    /// The same on this port, and in this folder, which may have files that the lines name.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn in_folder(folder: TempDir, port: u16, lines: &str) -> io::Result<Self> {
        let place = folder.path().display().to_string();
        let lines = lines.replace("FOLDER", &place);
        let text = format!("listen: \"127.0.0.1:{port}\"\nlog_file: \"{place}/log\"\n{lines}\n");
        let server = Self {
            folder,
            port,
            child: Mutex::new(None),
        };
        fs::write(server.file("server.conf"), text)?;
        Ok(server)
    }

    /// Starts it with what it has kept, and waits until it listens.
    ///
    /// # Errors
    /// When it is not installed, ends, or does not come to listen; with what it has told.
    pub fn start(&self) -> io::Result<()> {
        let child = Command::new(program())
            .arg("-c")
            .arg(self.file("server.conf"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| cannot_start(&error))?;
        *self.child() = Some(child);
        let begun = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).is_err() {
            let ended = match self.child().as_mut() {
                Some(child) => child.try_wait()?.is_some(),
                None => true,
            };
            if ended || begun.elapsed() > LIMIT {
                let log = fs::read_to_string(self.file("log")).unwrap_or_default();
                let told = format!("{} does not listen: {log}", program().display());
                return Err(Error::new(ErrorKind::TimedOut, told));
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    /// Kills it, without a chance to put anything in order.
    pub fn kill(&self) {
        if let Some(mut child) = self.child().take() {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// Loses the messages of a stream, as a server does that was killed at a bad moment.
    ///
    /// # Errors
    /// When it does not answer, or has no such stream; with its answer.
    pub fn lose(&self, stream: &str) -> io::Result<()> {
        let connection = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port))?;
        connection.set_read_timeout(Some(LIMIT))?;
        write!(
            &connection,
            "CONNECT {{\"verbose\":false}}\r\nSUB answer 1\r\n\
             PUB $JS.API.STREAM.PURGE.{stream} answer 0\r\n\r\n"
        )?;
        let mut lines = BufReader::new(&connection).lines();
        let mut answers = lines.by_ref().skip_while(|line| {
            let is_told = |line: &String| line.starts_with("MSG answer ");
            !line.as_ref().is_ok_and(is_told)
        });
        let answer = answers.nth(1).transpose()?.unwrap_or_default();
        if answer.contains("\"success\":true") {
            Ok(())
        } else {
            Err(Error::other(answer))
        }
    }

    /// Loses all that it has kept.
    ///
    /// # Errors
    /// When it has kept nothing.
    pub fn wipe(&self) -> io::Result<()> {
        fs::remove_dir_all(self.file("kept"))
    }

    /// Its folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A file in its folder.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    /// The port on which it listens.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Its address without TLS.
    #[must_use]
    pub fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }

    fn child(&self) -> MutexGuard<'_, Option<Child>> {
        self.child.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
