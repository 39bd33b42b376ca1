//! The thread that joins the device to whoever attaches it.

use std::io;
use std::net::TcpListener;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec};

use super::connection::Connection;
use super::function::Function;
use super::vhci::{self, VhciError};
use super::wire::{self, Import, Operation};
use crate::control::{Running, Shared};
use crate::device::Device;
use crate::line::{BadLine, Direction, LineFaults};

/// Bytes that end a burst: what a host fetches at a time.
const BURST_BYTES: usize = 16 * 1024;

/// Most connections that have not yet said what they want.
const MAX_STRANGERS: usize = 16;

pub(super) struct Worker {
    woken: UnixStream,
    shared: Arc<Shared>,
    function: Function,
    to_host: BadLine,
    to_device: BadLine,
    /// Where hosts come from; without it, the host is this machine.
    listener: Option<TcpListener>,
    strangers: Vec<Connection>,
    /// The host that has the device attached.
    host: Option<Connection>,
    /// A stall of the line lasts until then.
    silent_until: Duration,
    /// The plug was pulled, as far as has been noticed.
    unplugged: bool,
}

impl Worker {
    pub(super) fn new(
        woken: UnixStream,
        shared: Arc<Shared>,
        function: Function,
        faults: &LineFaults,
        listener: Option<TcpListener>,
    ) -> Self {
        Self {
            woken,
            shared,
            function,
            to_host: BadLine::new(faults, Direction::ToHost),
            to_device: BadLine::new(faults, Direction::ToDevice),
            listener,
            strangers: Vec::new(),
            host: None,
            silent_until: Duration::ZERO,
            unplugged: false,
        }
    }

    pub(super) fn attach_to_this_machine(&mut self) -> Result<(), VhciError> {
        let socket = vhci::attach()?;
        self.host = Some(Connection::new(socket, self.shared.now()));
        Ok(())
    }

    pub(super) fn run(mut self) {
        while let Some(until) = self.turn() {
            if self.sleep(until).is_err() {
                break;
            }
        }
        self.shared.notify();
    }

    /// Takes in, works, gives out; then says until when to wait for bytes, or
    /// `None` at the end.
    fn turn(&mut self) -> Option<Option<Duration>> {
        let shared = Arc::clone(&self.shared);
        let mut running = shared.lock();
        if running.ended {
            return None;
        }
        let now = shared.now();
        self.mind_the_plug(&running);
        // Before another host may come: it begins with a device as if just plugged in.
        self.note_connection(&mut running, now);
        self.meet_strangers(now);
        if self.host.is_some() && self.serve_host().is_err() {
            self.host = None;
        }
        self.note_connection(&mut running, now);
        if std::mem::take(&mut running.halt_endpoint) {
            self.function.halt();
        }
        let wake = self.join(&mut running, now);
        let waits = !self.function.has_spoken();
        running.note_line(now, waits);
        drop(running);
        shared.notify();
        if let Some(host) = &mut self.host {
            host.send(&self.function.take_answers());
            if host.write().is_err() {
                self.host = None;
                return Some(Some(now));
            }
        }
        let handshakes = self.strangers.iter().map(Connection::deadline);
        Some(wake.into_iter().chain(handshakes).min())
    }

    /// Pulls the plug, or puts it back.
    fn mind_the_plug(&mut self, running: &Running) {
        let unplugged = running.is_unplugged();
        if unplugged && !self.unplugged {
            self.host = None;
            self.strangers.clear();
            self.to_host.cut_off();
            self.to_device.cut_off();
        }
        if self.unplugged && !unplugged && self.listener.is_none() {
            // The port may be taken by now; then the device stays unplugged.
            let _ = self.attach_to_this_machine();
        }
        self.unplugged = unplugged;
    }

    fn note_connection(&mut self, running: &mut Running, now: Duration) {
        let connected = self.host.is_some();
        if running.host_connected == Some(connected) {
            return;
        }
        if running.host_connected == Some(true) {
            running.device.lose_line(now);
            self.function.reset();
        }
        running.host_connected = Some(connected);
    }

    /// Bytes between device and transfers; gives the time of the next work.
    fn join(&mut self, running: &mut Running, now: Duration) -> Option<Duration> {
        if running.stalled || now < self.silent_until {
            // The device hears nothing, yet its dead-man time runs on.
            let poll = running.device.poll(now);
            self.speak(running, &poll.bytes, now);
            let silence = (now < self.silent_until).then_some(self.silent_until);
            return [poll.wake, silence].into_iter().flatten().min();
        }
        let heard = self.function.hear();
        if !heard.is_empty() || self.to_device.due().is_some_and(|due| due <= now) {
            running.note_from_host(heard.len());
            running
                .device
                .receive(&self.to_device.carry(&heard, now), now);
        }
        if self.function.has_spoken() {
            let (bytes, wake) = poll_burst(&mut running.device, now);
            self.speak(running, &bytes, now);
            if !bytes.is_empty() && self.function.has_spoken() {
                // All of it has been fetched, and there may be more.
                return Some(now);
            }
            return [wake, self.to_host.due(), self.to_device.due()]
                .into_iter()
                .flatten()
                .min();
        }
        // The host does not fetch: no more columns, but laser and table stay guarded.
        let due = running.device.safety_wake(now)?;
        if due <= now {
            running.device.guard(now);
        }
        Some(due)
    }

    fn speak(&mut self, running: &mut Running, bytes: &[u8], now: Duration) {
        let carried = self.to_host.carry(bytes, now);
        let stalls = [self.to_host.take_stall(), self.to_device.take_stall()];
        for stall in stalls.into_iter().flatten() {
            self.silent_until = now + stall;
        }
        if self.host.is_some() {
            running.note_to_host(carried.len());
            self.function.speak(&carried);
        }
    }

    fn serve_host(&mut self) -> io::Result<()> {
        let Some(host) = &mut self.host else {
            return Ok(());
        };
        while !host.is_behind() {
            while let Some(command) = host.command().map_err(io::Error::other)? {
                self.function.command(command).map_err(io::Error::other)?;
            }
            if !host.read()? {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Connections that want to know what there is, or to attach it.
    fn meet_strangers(&mut self, now: Duration) {
        let Some(listener) = &self.listener else {
            return;
        };
        while let Ok((stream, _)) = listener.accept() {
            // Small packets are answered at once, or every request would wait for the next.
            let ready = stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok();
            if ready {
                self.strangers.push(Connection::new(stream.into(), now));
            }
            // The oldest of too many has had its time: those who say nothing keep nobody out.
            if self.strangers.len() > MAX_STRANGERS {
                self.strangers.remove(0);
            }
        }
        for mut stranger in std::mem::take(&mut self.strangers) {
            match self.answer(&mut stranger) {
                Ok(true) => self.host = Some(stranger),
                Ok(false) if !stranger.is_over() && now < stranger.deadline() => {
                    self.strangers.push(stranger);
                }
                // Gone, or not worth listening to.
                Ok(false) | Err(_) => {}
            }
        }
    }

    /// Answers what is asked; `true` once the device is attached by it.
    fn answer(&mut self, stranger: &mut Connection) -> io::Result<bool> {
        let descriptors = self.function.descriptors();
        loop {
            match stranger.operation().map_err(io::Error::other)? {
                Some(Operation::List) => {
                    let offered = self.host.is_none() && !self.unplugged;
                    stranger.send(&wire::devices(descriptors, offered));
                    stranger.end();
                }
                Some(Operation::Import { ours }) => {
                    let outcome = match ours && !self.unplugged {
                        false => Import::NoSuchDevice,
                        true if self.host.is_some() => Import::Busy,
                        true => Import::Done,
                    };
                    stranger.send(&wire::imported(descriptors, outcome));
                    if outcome == Import::Done {
                        stranger.write()?;
                        return Ok(true);
                    }
                    stranger.end();
                }
                None => {
                    stranger.write()?;
                    if stranger.is_over() || !stranger.read()? {
                        return Ok(false);
                    }
                }
            }
        }
    }

    fn sleep(&mut self, until: Option<Duration>) -> io::Result<()> {
        let timeout = until.map(|until| {
            let left = until.saturating_sub(self.shared.now());
            Timespec {
                tv_sec: i64::try_from(left.as_secs()).unwrap_or(i64::MAX),
                tv_nsec: i64::from(left.subsec_nanos()),
            }
        });
        let mut watched = vec![PollFd::from_borrowed_fd(self.woken.as_fd(), PollFlags::IN)];
        watched.extend(
            self.listener
                .iter()
                .map(|listener| PollFd::from_borrowed_fd(listener.as_fd(), PollFlags::IN)),
        );
        for connection in self.strangers.iter().chain(&self.host) {
            let mut flags = PollFlags::empty();
            flags.set(PollFlags::IN, !connection.is_behind());
            flags.set(PollFlags::OUT, connection.has_unsent());
            watched.push(PollFd::from_borrowed_fd(connection.socket(), flags));
        }
        match rustix::event::poll(&mut watched, timeout.as_ref()) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let mut sink = [0; 64];
        while matches!(io::Read::read(&mut self.woken, &mut sink), Ok(count) if count > 0) {}
        Ok(())
    }
}

/// All that the device has to say now, up to a burst; and when to ask again.
fn poll_burst(device: &mut Device, now: Duration) -> (Vec<u8>, Option<Duration>) {
    let mut bytes = Vec::new();
    loop {
        let poll = device.poll(now);
        let silent = poll.bytes.is_empty();
        bytes.extend(poll.bytes);
        if silent || bytes.len() >= BURST_BYTES || poll.wake.is_none_or(|wake| wake > now) {
            return (bytes, poll.wake);
        }
    }
}
