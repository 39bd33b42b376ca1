//! Two transports joined in memory, for tests of whatever talks to a device.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::Transport;

/// Most bytes under way in one direction, as in a pseudo-terminal.
pub const CAPACITY: usize = 12 * 1024;

/// One end of a pair of pipes. Dropping it hangs up.
#[derive(Debug)]
pub struct MemoryTransport {
    incoming: Arc<Pipe>,
    outgoing: Arc<Pipe>,
}

#[derive(Debug, Default)]
struct Pipe {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    bytes: VecDeque<u8>,
    closed: bool,
}

/// Two transports: what is written to one is read from the other.
#[must_use]
pub fn pair() -> (MemoryTransport, MemoryTransport) {
    let (there, back) = (Arc::new(Pipe::default()), Arc::new(Pipe::default()));
    (
        MemoryTransport {
            incoming: Arc::clone(&back),
            outgoing: Arc::clone(&there),
        },
        MemoryTransport {
            incoming: there,
            outgoing: back,
        },
    )
}

impl Pipe {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is whole after every step, so that a panic elsewhere does no harm.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `ready`, or the pipe is closed, or the time is up.
    fn wait(&self, timeout: Duration, ready: impl Fn(&State) -> bool) -> MutexGuard<'_, State> {
        let until = Instant::now() + timeout;
        let mut state = self.lock();
        while !ready(&state) && !state.closed {
            let Some(left) = until.checked_duration_since(Instant::now()) else {
                break;
            };
            state = self
                .changed
                .wait_timeout(state, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        state
    }

    fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }
}

impl Transport for MemoryTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut state = self.incoming.wait(timeout, |state| !state.bytes.is_empty());
        if state.bytes.is_empty() && state.closed {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        let count = buffer.len().min(state.bytes.len());
        for (to, from) in buffer.iter_mut().zip(state.bytes.drain(..count)) {
            *to = from;
        }
        self.incoming.changed.notify_all();
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize> {
        let mut state = self
            .outgoing
            .wait(timeout, |state| state.bytes.len() < CAPACITY);
        if state.closed {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        let count = bytes.len().min(CAPACITY - state.bytes.len());
        state.bytes.extend(bytes.iter().take(count));
        self.outgoing.changed.notify_all();
        Ok(count)
    }
}

impl Drop for MemoryTransport {
    fn drop(&mut self) {
        self.incoming.close();
        self.outgoing.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_a_hang_up_is_seen_after_it() {
        let (mut left, mut right) = pair();
        assert_eq!(left.write(b"hello", Duration::ZERO).unwrap(), 5);
        drop(left);
        let mut buffer = [0; 3];
        assert_eq!(right.read(&mut buffer, Duration::ZERO).unwrap(), 3);
        assert_eq!(right.read(&mut buffer, Duration::ZERO).unwrap(), 2);
        assert!(right.read(&mut buffer, Duration::ZERO).is_err());
        assert!(right.write(b"x", Duration::ZERO).is_err());
    }

    #[test]
    fn a_full_pipe_takes_no_more() {
        let (mut left, mut right) = pair();
        let many = vec![7; CAPACITY + 10];
        assert_eq!(left.write(&many, Duration::ZERO).unwrap(), CAPACITY);
        assert_eq!(left.write(&many, Duration::ZERO).unwrap(), 0);
        assert_eq!(right.read(&mut [0; 4], Duration::ZERO).unwrap(), 4);
        assert_eq!(left.write(&many, Duration::ZERO).unwrap(), 4);
    }
}
