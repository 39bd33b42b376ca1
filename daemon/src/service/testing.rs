//! A service for tests of its parts: without scanners, threads and an API.

use std::path::Path;
use std::sync::Arc;

use relief_api::THE_SCANNER;
use scanner_driver::{DeviceStatus, ScanStream, Scanner, ScannerError};
use scanner_protocol::{Identity, ScanPlan};
use storage::LocalDisk;

use super::{Kept, Service};
use crate::config::Config;
use crate::events::Hub;
use crate::laser::Laser;
use crate::receivers::Receivers;
use crate::spool::Spool;
use crate::station::Station;
use crate::store::Store;
use crate::tokens::Tokens;

/// Nothing is attached.
struct Absent;

impl Scanner for Absent {
    fn identify(&self) -> Result<Identity, ScannerError> {
        Err(ScannerError::Closed)
    }
    fn home(&self) -> Result<(), ScannerError> {
        Err(ScannerError::Closed)
    }
    fn status(&self) -> Result<DeviceStatus, ScannerError> {
        Err(ScannerError::Closed)
    }
    fn start_scan(&self, _plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
        Err(ScannerError::Closed)
    }
    fn abort(&self) -> Result<(), ScannerError> {
        Err(ScannerError::Closed)
    }
}

/// A service that keeps its things in this folder.
pub(crate) fn service_in(folder: &Path) -> Service {
    let config = Config::default();
    let hub = Arc::new(Hub::default());
    let laser = Laser::open(&LocalDisk, folder, THE_SCANNER).unwrap();
    let configured = config.each_scanner()[0];
    let station = Station::new(configured, Arc::new(Absent), laser, Arc::clone(&hub));
    Service::new(
        config,
        vec![Arc::new(station)],
        hub,
        Kept {
            disk: Arc::new(LocalDisk),
            store: Store::open(Arc::new(LocalDisk), &folder.join("store")).unwrap(),
            spool: Spool::open(Arc::new(LocalDisk), &folder.join("spool")).unwrap(),
            tokens: Tokens::open(Arc::new(LocalDisk), &folder.join("tokens.json")).unwrap(),
            receivers: Receivers::default(),
        },
        folder.to_owned(),
    )
}
