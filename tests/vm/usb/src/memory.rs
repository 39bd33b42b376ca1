//! The simulated device in this process, without any line: what all others are compared with.

use std::io;
use std::time::{Duration, Instant};

use scanner_driver::ScannerError;
use scanner_driver::transport::{Connector, Transport};
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::memory::MemoryLink;
use sim_scanner::source::Source;

/// Gives the device to the first who connects.
pub(crate) struct MemoryConnector {
    transport: Option<MemoryTransport>,
}

impl MemoryConnector {
    pub(crate) fn new(source: Source, settings: DeviceSettings, seed: u64) -> Self {
        Self {
            transport: Some(MemoryTransport {
                link: MemoryLink::new(source, settings, seed),
                unread: Vec::new(),
                since: Instant::now(),
            }),
        }
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
}

impl MemoryTransport {
    fn catch_up(&mut self) {
        let passed = self.since.elapsed().saturating_sub(self.link.now());
        self.link.pass(passed);
        self.unread.extend(self.link.take());
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
