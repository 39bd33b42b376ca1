//! A device on a pseudo-terminal, as if on a serial port.
//!
//! While no host has the port open, what the device sends is lost, as on a real line.

use std::fs::{self, OpenOptions};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::fs::OFlags;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use thiserror::Error;

use crate::control::{Control, Shared};
use crate::device::{Device, DeviceSettings};
use crate::line::{BadLine, Direction, LineFaults};
use crate::source::Source;

/// Why a pseudo-terminal cannot be offered.
#[derive(Debug, Error)]
pub enum PtyError {
    /// The system gives no pseudo-terminal.
    #[error("no pseudo-terminal to be had: {0}")]
    Open(#[source] io::Error),
    /// Something other than a link is in the link's place.
    #[error("{0} exists and is not a symbolic link: not replaced; choose another place")]
    Occupied(PathBuf),
    /// The link cannot be made.
    #[error("cannot make the link {link}: {source}")]
    Link {
        /// Where.
        link: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The thread that serves cannot be started.
    #[error("cannot start serving: {0}")]
    Thread(#[source] io::Error),
}

/// A device that is served until this is dropped; then the link is removed.
#[derive(Debug)]
pub struct PtyServer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    port: PathBuf,
    link: Option<PathBuf>,
}

/// Offers a device on a new pseudo-terminal, and links it at `link` if that is given; a link
/// that is there already is replaced in one step.
///
/// # Errors
/// [`PtyError`] says what stands in the way.
pub fn serve(
    source: Source,
    settings: DeviceSettings,
    seed: u64,
    faults: &LineFaults,
    link: Option<&Path>,
) -> Result<PtyServer, PtyError> {
    let open = |error: rustix::io::Errno| PtyError::Open(error.into());
    let main =
        openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).map_err(open)?;
    grantpt(&main).map_err(open)?;
    unlockpt(&main).map_err(open)?;
    let name = ptsname(&main, Vec::new()).map_err(open)?;
    let port = PathBuf::from(std::ffi::OsStr::from_bytes(name.as_bytes()));
    make_raw(&port).map_err(PtyError::Open)?;
    rustix::io::ioctl_fionbio(&main, true).map_err(open)?;

    let (waker, woken) = UnixStream::pair().map_err(PtyError::Thread)?;
    waker.set_nonblocking(true).map_err(PtyError::Thread)?;
    woken.set_nonblocking(true).map_err(PtyError::Thread)?;
    let started = Instant::now();
    let device = Device::new(source, settings, seed, Duration::ZERO);
    let shared = Shared::new(device, waker, started);
    let worker = Worker {
        main,
        woken,
        shared: Arc::clone(&shared),
        to_host: BadLine::new(faults, Direction::ToHost),
        to_device: BadLine::new(faults, Direction::ToDevice),
        pending: Vec::new(),
        silent_until: Duration::ZERO,
        connected: false,
    };
    if let Some(link) = link {
        put_link(&port, link)?;
    }
    let mut server = PtyServer {
        shared,
        thread: None,
        port,
        link: link.map(Path::to_path_buf),
    };
    let thread = std::thread::Builder::new()
        .name("sim-scanner".into())
        .spawn(move || worker.run())
        .map_err(PtyError::Thread)?;
    server.thread = Some(thread);
    Ok(server)
}

impl PtyServer {
    /// The pseudo-terminal's own path.
    #[must_use]
    pub fn port(&self) -> &Path {
        &self.port
    }

    /// A hand on the device.
    #[must_use]
    pub fn control(&self) -> Control {
        Control::new(Arc::clone(&self.shared))
    }
}

impl Drop for PtyServer {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.wake();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        self.shared.notify();
        // Somebody else's link may be there by now.
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.port)
        {
            let _ = fs::remove_file(link);
        }
    }
}

/// No echo, no line discipline: bytes pass as they are from the first one on, even if the
/// host changes nothing.
fn make_raw(port: &Path) -> io::Result<()> {
    let host_side = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(OFlags::NOCTTY.bits() as i32)
        .open(port)?;
    let mut modes = tcgetattr(&host_side)?;
    modes.make_raw();
    tcsetattr(&host_side, OptionalActions::Now, &modes)?;
    Ok(())
}

/// Makes the link beside its place and renames it there, so that it never is missing.
fn put_link(port: &Path, link: &Path) -> Result<(), PtyError> {
    if fs::symlink_metadata(link).is_ok_and(|found| !found.file_type().is_symlink()) {
        return Err(PtyError::Occupied(link.to_path_buf()));
    }
    let failed = |source| PtyError::Link {
        link: link.to_path_buf(),
        source,
    };
    let mut beside = link.as_os_str().to_owned();
    beside.push(format!(".{}.new", std::process::id()));
    let beside = PathBuf::from(beside);
    let _ = fs::remove_file(&beside);
    std::os::unix::fs::symlink(port, &beside).map_err(failed)?;
    fs::rename(&beside, link).map_err(|error| {
        let _ = fs::remove_file(&beside);
        failed(error)
    })
}

/// The thread that joins the device to the pseudo-terminal.
struct Worker {
    main: OwnedFd,
    woken: UnixStream,
    shared: Arc<Shared>,
    to_host: BadLine,
    to_device: BadLine,
    /// Bytes for the host that the pseudo-terminal has not yet taken.
    pending: Vec<u8>,
    /// A stall of the line lasts until then.
    silent_until: Duration,
    connected: bool,
}

/// How often a closed port is looked at: a pseudo-terminal gives no sign of being opened.
const CLOSED_LOOK: Duration = Duration::from_millis(10);

impl Worker {
    fn run(mut self) {
        while let Some(wait) = self.turn() {
            if self.sleep(wait).is_err() {
                break;
            }
        }
        self.shared.notify();
    }

    /// Takes in, works, gives out; then says what to wait for, or `None` at the end.
    fn turn(&mut self) -> Option<Wait> {
        let shared = Arc::clone(&self.shared);
        let mut running = shared.lock();
        if running.ended {
            return None;
        }
        let connected = self.host_is_there();
        if connected != self.connected {
            self.connected = connected;
            running.host_connected = Some(connected);
        }
        let now = shared.now();
        if running.is_unplugged() {
            self.lose_everything();
            let poll = running.device.poll(now);
            shared.notify();
            return Some(Wait {
                readable: true,
                writable: false,
                until: poll.wake,
            });
        }
        let line_silent = now < self.silent_until;
        if running.stalled || line_silent {
            // The device hears nothing, yet its dead-man time runs on.
            let poll = running.device.poll(now);
            self.queue(&poll.bytes);
            shared.notify();
            return Some(Wait {
                readable: false,
                writable: false,
                until: [poll.wake, line_silent.then_some(self.silent_until)]
                    .into_iter()
                    .flatten()
                    .min(),
            });
        }
        let mut buffer = [0; 4096];
        while self.connected {
            match rustix::io::read(&self.main, &mut buffer) {
                Ok(0) | Err(_) => break,
                Ok(count) => {
                    let bytes = buffer.get(..count).unwrap_or_default();
                    running.note_from_host(count);
                    running
                        .device
                        .receive(&self.to_device.carry(bytes, now), now);
                }
            }
        }
        if self.to_device.due().is_some_and(|due| due <= now) {
            running.device.receive(&self.to_device.carry(&[], now), now);
        }
        let was_busy = !self.pending.is_empty();
        let mut wake = None;
        if self.pending.is_empty() {
            let poll = running.device.poll(now);
            running.note_to_host(poll.bytes.len());
            self.queue(&poll.bytes);
            wake = poll.wake;
        } else if let Some(due) = running.device.safety_wake(now) {
            // The host does not read: no more columns, but laser and table stay guarded.
            if due <= now {
                running.device.guard(now);
            }
            wake = Some(due);
        }
        // What has just been queued has not yet had its chance.
        running.note_line(now, was_busy);
        drop(running);
        shared.notify();
        self.write_out();
        if was_busy && self.pending.is_empty() {
            // There is room again, and the device has not been asked since.
            wake = Some(now);
        }
        Some(Wait {
            readable: true,
            writable: !self.pending.is_empty(),
            // What is due for a host that does not read waits for room, not for a time.
            until: [
                wake,
                self.to_host.due().filter(|_| self.pending.is_empty()),
                self.to_device.due(),
            ]
            .into_iter()
            .flatten()
            .min(),
        })
    }

    /// The cable is out: what is under way, in both directions, is lost.
    fn lose_everything(&mut self) {
        let mut sink = [0; 4096];
        while self.connected && matches!(rustix::io::read(&self.main, &mut sink), Ok(1..)) {}
        self.pending.clear();
        self.to_host.cut_off();
        self.to_device.cut_off();
        self.silent_until = Duration::ZERO;
    }

    fn queue(&mut self, bytes: &[u8]) {
        let now = self.shared.now();
        let carried = self.to_host.carry(bytes, now);
        self.pending.extend(carried);
        let stalls = [self.to_host.take_stall(), self.to_device.take_stall()];
        for stall in stalls.into_iter().flatten() {
            self.silent_until = self.shared.now() + stall;
        }
    }

    fn write_out(&mut self) {
        if !self.connected {
            self.pending.clear();
            return;
        }
        while !self.pending.is_empty() {
            match rustix::io::write(&self.main, &self.pending) {
                Ok(count) if count > 0 => {
                    self.pending.drain(..count);
                }
                _ => break,
            }
        }
    }

    fn host_is_there(&self) -> bool {
        let mut watched = [PollFd::new(&self.main, PollFlags::IN)];
        let at_once = Timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        match rustix::event::poll(&mut watched, Some(&at_once)) {
            Ok(_) => !watched[0].revents().contains(PollFlags::HUP),
            Err(_) => false,
        }
    }

    fn sleep(&mut self, wait: Wait) -> io::Result<()> {
        let mut timeout = wait
            .until
            .map(|until| until.saturating_sub(self.shared.now()));
        let mut watched = vec![PollFd::from_borrowed_fd(self.woken.as_fd(), PollFlags::IN)];
        if self.connected {
            let mut flags = PollFlags::empty();
            flags.set(PollFlags::IN, wait.readable);
            flags.set(PollFlags::OUT, wait.writable);
            if flags.is_empty() {
                // Hanging up cannot be masked; do not spin on it while stalled.
            } else {
                watched.push(PollFd::new(&self.main, flags));
            }
        } else {
            timeout = Some(timeout.unwrap_or(CLOSED_LOOK).min(CLOSED_LOOK));
        }
        let timespec = timeout.map(|duration| Timespec {
            tv_sec: i64::try_from(duration.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: i64::from(duration.subsec_nanos()),
        });
        match rustix::event::poll(&mut watched, timespec.as_ref()) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let mut sink = [0; 64];
        while matches!(io::Read::read(&mut self.woken, &mut sink), Ok(count) if count > 0) {}
        Ok(())
    }
}

/// What ends the worker's sleep.
struct Wait {
    readable: bool,
    writable: bool,
    until: Option<Duration>,
}
