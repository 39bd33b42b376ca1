//! A connection to a host, or to somebody who may become one.

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::Duration;

use rustix::io::Errno;

use super::wire::{Command, Inbox, Operation, WireError};

/// Most bytes kept for a host that does not take them.
const MAX_UNSENT: usize = 4 << 20;

/// How long somebody may take to say what is wanted.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// A socket that never blocks, with what has come and what is to go.
#[derive(Debug)]
pub(super) struct Connection {
    socket: OwnedFd,
    inbox: Inbox,
    unsent: Vec<u8>,
    /// When it is given up unless a device has been attached by then.
    deadline: Duration,
    /// The answer is under way, and after it nothing more is said.
    last_words: bool,
}

impl Connection {
    pub(super) fn new(socket: OwnedFd, now: Duration) -> Self {
        Self {
            socket,
            inbox: Inbox::default(),
            unsent: Vec::new(),
            deadline: now + HANDSHAKE,
            last_words: false,
        }
    }

    pub(super) fn deadline(&self) -> Duration {
        self.deadline
    }

    pub(super) fn socket(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }

    /// Takes in a piece of what has come; `false` if there was none.
    ///
    /// An error means that the other end is gone.
    pub(super) fn read(&mut self) -> io::Result<bool> {
        let mut buffer = [0; 16 * 1024];
        match rustix::io::read(&self.socket, &mut buffer) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                self.inbox.push(buffer.get(..count).unwrap_or(&buffer));
                Ok(true)
            }
            Err(Errno::AGAIN | Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    pub(super) fn operation(&mut self) -> Result<Option<Operation>, WireError> {
        self.inbox.operation()
    }

    pub(super) fn command(&mut self) -> Result<Option<Command>, WireError> {
        self.inbox.command()
    }

    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.unsent.extend_from_slice(bytes);
    }

    /// Nothing is awaited any more: the connection ends when all is sent.
    pub(super) fn end(&mut self) {
        self.last_words = true;
    }

    pub(super) fn is_over(&self) -> bool {
        self.last_words && self.unsent.is_empty()
    }

    pub(super) fn has_unsent(&self) -> bool {
        !self.unsent.is_empty()
    }

    /// Whether there is so much to send that nothing new should be begun.
    pub(super) fn is_behind(&self) -> bool {
        self.unsent.len() > MAX_UNSENT
    }

    /// Sends what the other end takes.
    ///
    /// An error means that it is gone.
    pub(super) fn write(&mut self) -> io::Result<()> {
        while !self.unsent.is_empty() {
            match rustix::io::write(&self.socket, &self.unsent) {
                Ok(count) => {
                    self.unsent.drain(..count);
                }
                Err(Errno::AGAIN) => return Ok(()),
                Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }
}
