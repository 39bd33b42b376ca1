//! A device and a clock in memory, for tests without threads and without waiting.

use core::time::Duration;

use crate::device::{Device, DeviceSettings};
use crate::source::Source;

/// A device on a wire that takes no time, with a clock that the test moves.
#[derive(Debug)]
pub struct MemoryLink {
    device: Device,
    now: Duration,
    wake: Option<Duration>,
    for_host: Vec<u8>,
}

impl MemoryLink {
    /// A device that has just been switched on, at time zero.
    #[must_use]
    pub fn new(source: Source, settings: DeviceSettings, seed: u64) -> Self {
        let now = Duration::ZERO;
        let mut link = Self {
            device: Device::new(source, settings, seed, now),
            now,
            wake: None,
            for_host: Vec::new(),
        };
        link.poll();
        link
    }

    /// The device, for the control side.
    pub fn device(&mut self) -> &mut Device {
        &mut self.device
    }

    /// The time.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Sends bytes to the device, and lets it do what is due at once.
    pub fn send(&mut self, bytes: &[u8]) {
        self.device.receive(bytes, self.now);
        self.settle();
    }

    /// The bytes that the device has sent.
    pub fn take(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.for_host)
    }

    /// Lets time pass; the device is polled when it asked to be.
    pub fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(wake) = self.wake.filter(|wake| *wake <= end) {
            self.now = wake.max(self.now);
            self.poll();
        }
        self.now = end;
        self.settle();
    }

    /// Polls until nothing is due at this time.
    fn settle(&mut self) {
        self.poll();
        while self.wake.is_some_and(|wake| wake <= self.now) {
            self.poll();
        }
    }

    fn poll(&mut self) {
        let poll = self.device.poll(self.now);
        self.for_host.extend(poll.bytes);
        self.wake = poll.wake;
    }
}
