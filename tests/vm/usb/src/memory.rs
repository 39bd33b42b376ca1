//! The simulated device in this process, without any line: what all others are compared with.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use scanner_driver::ScannerError;
use scanner_driver::transport::{Connector, Transport};
use scanner_protocol::Activity;
use sim_scanner::control::LineUse;
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::memory::MemoryLink;
use sim_scanner::source::Source;

/// Gives the device to the first who connects.
pub(crate) struct MemoryConnector {
    transport: Option<MemoryTransport>,
}

impl MemoryConnector {
    pub(crate) fn new(
        source: Source,
        settings: DeviceSettings,
        seed: u64,
    ) -> (Self, Arc<Mutex<LineUse>>) {
        let line = Arc::<Mutex<LineUse>>::default();
        let transport = MemoryTransport {
            link: MemoryLink::new(source, settings, seed),
            unread: Vec::new(),
            since: Instant::now(),
            line: Arc::clone(&line),
        };
        let connector = Self {
            transport: Some(transport),
        };
        (connector, line)
    }
}

impl Connector for MemoryConnector {
    fn name(&self) -> String {
        "memory".to_owned()
    }

    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError> {
        match self.transport.take() {
            Some(transport) => Ok(Box::new(transport)),
            None => Err(ScannerError::NoSuchPort { port: self.name() }),
        }
    }
}

/// The device's clock follows ours whenever it is looked at.
struct MemoryTransport {
    link: MemoryLink,
    unread: Vec<u8>,
    since: Instant,
    line: Arc<Mutex<LineUse>>,
}

impl MemoryTransport {
    fn catch_up(&mut self) {
        let waiting =
            self.link.device().snapshot(self.since.elapsed()).activity == Activity::Waiting;
        let passed = self.since.elapsed().saturating_sub(self.link.now());
        self.link.pass(passed);
        let came = self.link.take();
        let mut line = self.line.lock().unwrap_or_else(PoisonError::into_inner);
        line.to_host_bytes += came.len() as u64;
        if waiting {
            line.waited_for_host += passed;
        }
        self.unread.extend(came);
    }
}

impl Transport for MemoryTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        const NAP: Duration = Duration::from_micros(200);
        let until = Instant::now() + timeout;
        loop {
            if self.unread.is_empty() {
                self.catch_up();
            }
            let count = buffer.len().min(self.unread.len());
            for (to, from) in buffer.iter_mut().zip(self.unread.drain(..count)) {
                *to = from;
            }
            if count > 0 || Instant::now() >= until {
                return Ok(count);
            }
            std::thread::sleep(NAP);
        }
    }

    fn write(&mut self, bytes: &[u8], _timeout: Duration) -> io::Result<usize> {
        self.catch_up();
        self.link.send(bytes);
        Ok(bytes.len())
    }
}
