//! How many bytes reach the driver, and how long it waits for them.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use scanner_driver::ScannerError;
use scanner_driver::transport::{Connector, Transport};

/// The account of the driver's reading.
#[derive(Debug, Default)]
pub(crate) struct HostUse {
    read_bytes: AtomicU64,
    waited_ns: AtomicU64,
}

impl HostUse {
    /// Bytes that have been read.
    pub(crate) fn read_bytes(&self) -> u64 {
        self.read_bytes.load(Ordering::Relaxed)
    }

    fn has_read(&self, count: usize) -> usize {
        self.read_bytes.fetch_add(count as u64, Ordering::Relaxed);
        count
    }

    /// Time spent in reads while nothing was there.
    pub(crate) fn waited(&self) -> Duration {
        Duration::from_nanos(self.waited_ns.load(Ordering::Relaxed))
    }
}

/// A way whose reads are watched.
pub(crate) struct Watched {
    connector: Box<dyn Connector>,
    account: Arc<HostUse>,
}

impl Watched {
    pub(crate) fn new(connector: Box<dyn Connector>, account: Arc<HostUse>) -> Self {
        Self { connector, account }
    }
}

impl Connector for Watched {
    fn name(&self) -> String {
        self.connector.name()
    }

    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError> {
        Ok(Box::new(WatchedTransport {
            transport: self.connector.connect()?,
            account: Arc::clone(&self.account),
        }))
    }

    fn appeared(&mut self) -> bool {
        self.connector.appeared()
    }
}

struct WatchedTransport {
    transport: Box<dyn Transport>,
    account: Arc<HostUse>,
}

impl Transport for WatchedTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        // What is there is taken without being counted as waited for.
        let count = self.transport.read(buffer, Duration::ZERO)?;
        if count > 0 || timeout.is_zero() {
            return Ok(self.account.has_read(count));
        }
        let start = Instant::now();
        let result = self.transport.read(buffer, timeout);
        let waited = u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.account.waited_ns.fetch_add(waited, Ordering::Relaxed);
        result.map(|count| self.account.has_read(count))
    }

    fn write(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize> {
        self.transport.write(bytes, timeout)
    }
}
