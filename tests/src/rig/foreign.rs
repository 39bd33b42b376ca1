//! A device of another kind on a pseudo-terminal, which talks without being asked.

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use anyhow::Result;
use rustix::event::{PollFd, PollFlags};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Answers whatever it hears with one text, until dropped.
#[derive(Debug)]
pub struct Foreign {
    port: PathBuf,
    stop: UnixStream,
    thread: Option<JoinHandle<()>>,
    /// Held open, so that the thread never sees a hang-up.
    _host_side: OwnedFd,
}

impl Foreign {
    /// Starts it.
    ///
    /// # Errors
    /// When the system gives no pseudo-terminal.
    pub fn saying(text: &'static str) -> Result<Self> {
        let main = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&main)?;
        unlockpt(&main)?;
        let port = PathBuf::from(ptsname(&main, Vec::new())?.into_string()?);
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let host_side = rustix::fs::open(&port, flags, Mode::empty())?;
        let mut modes = tcgetattr(&host_side)?;
        modes.make_raw();
        tcsetattr(&host_side, OptionalActions::Now, &modes)?;
        let (stop, stopped) = UnixStream::pair()?;
        let thread = std::thread::Builder::new()
            .name("foreign".into())
            .spawn(move || {
                // Whatever goes wrong here, the test sees a device that says nothing.
                let _ = answer(main, &stopped, text);
            })?;
        Ok(Self {
            port,
            stop,
            thread: Some(thread),
            _host_side: host_side,
        })
    }

    /// Where it is.
    #[must_use]
    pub fn port(&self) -> &Path {
        &self.port
    }
}

impl Drop for Foreign {
    fn drop(&mut self) {
        let _ = self.stop.shutdown(std::net::Shutdown::Both);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn answer(main: OwnedFd, stopped: &UnixStream, text: &str) -> io::Result<()> {
    let mut line = std::fs::File::from(main);
    let mut buffer = [0; 512];
    loop {
        let mut watched = [
            PollFd::new(&line, PollFlags::IN),
            PollFd::from_borrowed_fd(stopped.as_fd(), PollFlags::IN),
        ];
        rustix::event::poll(&mut watched, None)?;
        if !watched[1].revents().is_empty() {
            return Ok(());
        }
        if line.read(&mut buffer)? > 0 {
            line.write_all(text.as_bytes())?;
        }
    }
}
