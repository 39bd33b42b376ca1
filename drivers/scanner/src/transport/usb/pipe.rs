//! Two bulk endpoints as one stream of bytes each way.

use std::io;
use std::time::Duration;

use nusb::transfer::{Buffer, Bulk, Completion, In, Out, TransferError};
use nusb::{Endpoint, MaybeFuture};

use super::claim::Pipes;
use crate::transport::Transport;

/// Transfers kept under way each way, so that the bus need not wait for this program: while
/// one is being read, the next ones are filled.
const TRANSFERS: usize = 4;

/// Bytes of an incoming transfer: a multiple of every speed's packet, and what Linux moves
/// without splitting.
const IN_BYTES: usize = 16 * 1024;

/// Most bytes of an outgoing transfer.
const OUT_BYTES: usize = 4 * 1024;

/// Halts in a row, without a byte in between, after which the device counts as broken.
const MAX_HALTS: u32 = 3;

/// A claimed interface. Dropping it cancels what is under way and releases the interface.
pub(super) struct UsbTransport {
    incoming: Endpoint<Bulk, In>,
    outgoing: Endpoint<Bulk, Out>,
    /// What has come and is not yet read, and how much of it is.
    unread: Option<(Buffer, usize)>,
    /// Buffers of outgoing transfers that are done.
    idle: Vec<Buffer>,
    halts: u32,
}

impl UsbTransport {
    pub(super) fn new(pipes: Pipes) -> Self {
        let mut transport = Self {
            incoming: pipes.incoming,
            outgoing: pipes.outgoing,
            unread: None,
            idle: Vec::new(),
            halts: 0,
        };
        for _ in 0..TRANSFERS {
            let buffer = transport.incoming.allocate(IN_BYTES);
            transport.incoming.submit(buffer);
        }
        for _ in 0..TRANSFERS {
            let buffer = transport.outgoing.allocate(OUT_BYTES);
            transport.idle.push(buffer);
        }
        transport
    }

    /// Gives a buffer to the next incoming transfer.
    fn listen(&mut self, mut buffer: Buffer) {
        buffer.clear();
        buffer.set_requested_len(IN_BYTES);
        self.incoming.submit(buffer);
    }

    /// Moves unread bytes on; `None` if there are none.
    fn take_unread(&mut self, to: &mut [u8]) -> Option<usize> {
        let (buffer, read) = self.unread.take()?;
        let rest = buffer.get(read..).unwrap_or_default();
        let count = rest.len().min(to.len());
        for (to, from) in to.iter_mut().zip(rest) {
            *to = *from;
        }
        if read + count < buffer.len() {
            self.unread = Some((buffer, read + count));
        } else {
            self.listen(buffer);
        }
        Some(count)
    }

    /// The device halted an endpoint to say that something went wrong. Bytes may be lost;
    /// the protocol asks for them again.
    fn halted(&mut self) -> io::Result<()> {
        self.halts += 1;
        if self.halts > MAX_HALTS {
            return Err(io::Error::other(
                "the device halts its endpoints again and again: its firmware is in trouble",
            ));
        }
        tracing::warn!("the scanner halted an endpoint; it is set going again");
        Ok(())
    }

    fn resume_incoming(&mut self) -> io::Result<()> {
        self.halted()?;
        // A halt may be cleared only when nothing is under way.
        let buffers = drain(&mut self.incoming)?;
        self.incoming.clear_halt().wait().map_err(gone)?;
        for buffer in buffers {
            self.listen(buffer);
        }
        Ok(())
    }

    fn resume_outgoing(&mut self) -> io::Result<()> {
        self.halted()?;
        let buffers = drain(&mut self.outgoing)?;
        self.outgoing.clear_halt().wait().map_err(gone)?;
        self.idle.extend(buffers);
        Ok(())
    }

    /// Takes back one outgoing transfer that is done; `false` if none was in time.
    fn reap(&mut self, timeout: Duration) -> io::Result<bool> {
        let Some(done) = self.outgoing.wait_next_complete(timeout) else {
            return Ok(false);
        };
        let status = done.status;
        self.idle.push(done.buffer);
        match status {
            Ok(()) => {
                self.halts = 0;
                Ok(true)
            }
            Err(TransferError::Stall) => self.resume_outgoing().map(|()| true),
            Err(error) => Err(broken(error)),
        }
    }
}

impl Transport for UsbTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        if let Some(count) = self.take_unread(buffer) {
            return Ok(count);
        }
        if self.incoming.pending() == 0 {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        let Some(done) = self.incoming.wait_next_complete(timeout) else {
            return Ok(0);
        };
        let Completion {
            buffer: came,
            status,
            ..
        } = done;
        match status {
            Ok(()) => {
                if !came.is_empty() {
                    self.halts = 0;
                }
                self.unread = Some((came, 0));
                Ok(self.take_unread(buffer).unwrap_or(0))
            }
            Err(TransferError::Stall) => {
                self.resume_incoming()?;
                self.listen(came);
                Ok(0)
            }
            Err(error) => Err(broken(error)),
        }
    }

    fn write(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize> {
        // All that is done is taken back first: a failure shows as soon as it can.
        while self.outgoing.pending() > 0 && self.reap(Duration::ZERO)? {}
        if self.idle.is_empty() && !(self.outgoing.pending() > 0 && self.reap(timeout)?) {
            return Ok(0);
        }
        let Some(mut buffer) = self.idle.pop() else {
            return Ok(0);
        };
        let part = bytes.get(..OUT_BYTES).unwrap_or(bytes);
        buffer.clear();
        buffer.extend_from_slice(part);
        self.outgoing.submit(buffer);
        Ok(part.len())
    }
}

/// Cancels and collects all that is under way at an endpoint.
fn drain<D: nusb::transfer::EndpointDirection>(
    endpoint: &mut Endpoint<Bulk, D>,
) -> io::Result<Vec<Buffer>> {
    const PATIENCE: Duration = Duration::from_secs(1);
    endpoint.cancel_all();
    let mut buffers = Vec::new();
    while endpoint.pending() > 0 {
        let done = endpoint
            .wait_next_complete(PATIENCE)
            .ok_or_else(|| io::Error::other("a cancelled transfer does not come back"))?;
        buffers.push(done.buffer);
    }
    Ok(buffers)
}

fn gone(error: nusb::Error) -> io::Error {
    match error.kind() {
        nusb::ErrorKind::Disconnected => io::ErrorKind::BrokenPipe.into(),
        _ => error.into(),
    }
}

/// What a failed transfer means for the line.
fn broken(error: TransferError) -> io::Error {
    match error {
        TransferError::Disconnected => io::ErrorKind::BrokenPipe.into(),
        // What most hosts see first of a pulled plug, before the hub tells of it.
        TransferError::Fault => {
            io::Error::other("the USB line failed: unplugged, or a bad cable or hub")
        }
        error => error.into(),
    }
}
