//! A scanner of which each call that may switch the laser is noted.

use std::sync::Arc;

use relief_api::LaserState;
use scanner_driver::{DeviceStatus, InterruptedScan, ScanStream, Scanner, ScannerError};
use scanner_protocol::{Identity, ScanPlan};

use super::Laser;
use crate::service::lock;

/// A scanner whose laser is watched: every call that may switch it is noted.
pub(crate) struct Watched {
    scanner: Arc<dyn Scanner>,
    laser: Arc<Laser>,
}

impl Watched {
    pub(crate) fn new(scanner: Arc<dyn Scanner>, laser: Arc<Laser>) -> Self {
        Self { scanner, laser }
    }
}

impl Scanner for Watched {
    fn identify(&self) -> Result<Identity, ScannerError> {
        self.scanner.identify()
    }

    fn home(&self) -> Result<(), ScannerError> {
        self.scanner.home()
    }

    fn status(&self) -> Result<DeviceStatus, ScannerError> {
        let acts = lock(&self.laser.known).acts;
        let status = self.scanner.status();
        let answer = |laser, cause: &str| self.laser.note_answer(acts, laser, cause);
        match &status {
            Ok(status) if status.laser_on => {
                answer(LaserState::On, "the scanner says that it is on");
            }
            Ok(_) => answer(LaserState::Off, "the scanner says that it is off"),
            Err(error) if self.laser.state() == Some(LaserState::On) => {
                answer(LaserState::Unknown, &error.to_string());
            }
            Err(_) => {}
        }
        status
    }

    fn start_scan(&self, plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
        self.laser.begin();
        let started = self.scanner.start_scan(plan);
        self.laser.begun(started.as_ref().err());
        started
    }

    fn take_up_scan(&self, scan: InterruptedScan) -> Result<ScanStream, ScannerError> {
        self.laser.take_up();
        self.scanner.take_up_scan(scan).inspect_err(|error| {
            // Not known before either, and still worth a line.
            lock(&self.laser.known).add(LaserState::Unknown, &error.to_string());
        })
    }

    fn resume_scan(&self) -> Result<(), ScannerError> {
        self.scanner
            .resume_scan()
            .inspect(|()| self.laser.told_to_go_on())
    }

    fn pause_scan(&self) -> Result<(), ScannerError> {
        let lit = lock(&self.laser.known).lit;
        self.scanner
            .pause_scan()
            .inspect(|()| self.laser.closed_for_a_pause(lit))
    }

    fn abort(&self) -> Result<(), ScannerError> {
        // Before: a scan that ends meanwhile takes its reason with it.
        let reason = self.laser.stopping();
        let stopped = self.scanner.abort();
        self.laser.stopped(reason.as_deref(), &stopped);
        stopped
    }
}
