//! From the configuration to the stations.

use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;

use scanner_driver::{Scanner, ScannerError, SerialScanner, UsbScanner};

use super::Station;
use storage::Disk;

use crate::config::{Config, NamedScanner, Transport};
use crate::daemon::StartError;
use crate::events::Hub;
use crate::laser::{Laser, end_other_logs};

/// Gives a scanner that the configuration names.
pub type OpenScanner<'a> =
    dyn Fn(NamedScanner<'_>) -> Result<Arc<dyn Scanner>, ScannerError> + Send + Sync + 'a;

/// The scanner that is attached.
pub(crate) fn open_attached(named: NamedScanner<'_>) -> Result<Arc<dyn Scanner>, ScannerError> {
    let config = named.config;
    Ok(match config.transport {
        Transport::Serial => {
            let mut settings = config.serial();
            settings.link.jitter_seed = jitter_seed();
            Arc::new(SerialScanner::open(settings)?)
        }
        Transport::Usb => {
            let mut settings = config.usb();
            settings.link.jitter_seed = jitter_seed();
            Arc::new(UsbScanner::open(settings)?)
        }
    })
}

/// Another for each scanner of each service: those that lost the same hub are not to come back
/// in step.
fn jitter_seed() -> u64 {
    // The standard library's source of numbers that nobody can foresee.
    RandomState::new().hash_one(())
}

/// A scanner for each section, in the order of their names.
pub(crate) fn open_all(
    config: &Config,
    open: &OpenScanner<'_>,
) -> Result<Vec<Arc<dyn Scanner>>, StartError> {
    let named = config.each_scanner().into_iter();
    let opened = named.map(|named| {
        open(named).map_err(|source| StartError::Scanner {
            section: named.section(),
            source,
        })
    });
    opened.collect()
}

/// A station for each scanner.
pub(crate) fn make_all(
    config: &Config,
    scanners: Vec<Arc<dyn Scanner>>,
    hub: &Arc<Hub>,
    disk: &dyn Disk,
) -> Result<Vec<Arc<Station>>, StartError> {
    let state_dir = &config.service.state_dir;
    let named = config.each_scanner();
    let names: Vec<&str> = named.iter().map(|named| named.name).collect();
    end_other_logs(disk, state_dir, &names);
    let stations = named.into_iter().zip(scanners).map(|(named, scanner)| {
        let laser = Laser::open(disk, state_dir, named.name)?;
        let station = Station::new(named, scanner, laser, Arc::clone(hub));
        Ok(Arc::new(station))
    });
    stations.collect()
}
