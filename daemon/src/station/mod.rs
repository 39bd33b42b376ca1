//! A station: one scanner, and all that belongs to it alone.
//!
//! Stations share the disk, the records, the queue and the API, and nothing that one of them
//! could hold while its scanner does not answer.

mod open;

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use jiff::Timestamp;
use range_image::Calibration;
use relief_api::{
    CalibrationStatus, Event, Scan, ScanState, ScannerLink, ScannerStatus, ScannerSummary,
    THE_SCANNER,
};
use scanner_driver::{Scanner, ScannerError};
use scanner_protocol::Identity;

use crate::acquisition::{AbortRequest, calibration, describe_trouble};
use crate::calibration::{CalibrationError, InForce};
use crate::config::{NamedScanner, Transport};
use crate::error::ServiceError;
use crate::events::Hub;
use crate::laser::{Laser, Watched};
use crate::service::lock;

pub use open::OpenScanner;
pub(crate) use open::{make_all, open_all, open_attached};

/// The place for the one scan that can be under way on a scanner.
#[derive(Debug)]
enum Slot {
    /// Nothing is under way.
    Free,
    /// The scanner is being asked whether it is there.
    Reserved,
    /// A scan is under way.
    Taken {
        /// As it stands; newer than the kept record.
        scan: Box<Scan>,
        /// Ends it early.
        abort: Arc<AbortRequest>,
    },
}

/// One scanner, and all that belongs to it alone.
pub(crate) struct Station {
    name: String,
    /// Its section of the configuration.
    section: String,
    /// Longer than its driver may take for anything before it gives up.
    pub(crate) longest_wait: Duration,
    pub(crate) scanner: Arc<dyn Scanner>,
    /// What the scanner has to say that its own is.
    serial_number: Option<String>,
    /// How it deviates as it is mounted, if that is known.
    pub(crate) calibration: Option<Box<InForce>>,
    pub(crate) laser: Arc<Laser>,
    hub: Arc<Hub>,
    slot: Mutex<Slot>,
    /// Threads of scans; all but the last are about to end, if they have not yet.
    threads: Mutex<Vec<JoinHandle<()>>>,
    status: Mutex<ScannerStatus>,
}

/// A slot that waits for its scan; free again unless the scan comes.
pub(crate) struct Reservation<'a> {
    station: &'a Station,
    used: bool,
}

impl Drop for Reservation<'_> {
    fn drop(&mut self) {
        if !self.used {
            *lock(&self.station.slot) = Slot::Free;
        }
    }
}

impl Reservation<'_> {
    /// Puts a scan into the slot, unless `begin` fails. Nobody sees the slot meanwhile, so that
    /// the scan's thread finds it taken.
    pub(crate) fn take(
        mut self,
        scan: &Scan,
        abort: Arc<AbortRequest>,
        begin: impl FnOnce() -> Result<JoinHandle<()>, ServiceError>,
    ) -> Result<(), ServiceError> {
        let station = self.station;
        let mut slot = lock(&station.slot);
        let thread = begin()?;
        // The place of a scan is free a moment before its thread has ended, so that the thread
        // is not kept there.
        let mut threads = lock(&station.threads);
        threads.retain(|thread| !thread.is_finished());
        threads.push(thread);
        *slot = Slot::Taken {
            scan: Box::new(scan.clone()),
            abort,
        };
        self.used = true;
        // Before the lock goes, so that nobody hears of what follows first.
        station.hub.tell(Event::Scan(scan.clone()));
        Ok(())
    }
}

impl Station {
    pub(crate) fn new(
        configured: NamedScanner<'_>,
        scanner: Arc<dyn Scanner>,
        laser: Laser,
        hub: Arc<Hub>,
    ) -> Self {
        let laser = Arc::new(laser);
        Self {
            name: configured.name.to_owned(),
            section: configured.section(),
            longest_wait: configured.config.longest_wait(),
            scanner: Arc::new(Watched::new(scanner, Arc::clone(&laser))),
            serial_number: match configured.config.transport {
                Transport::Serial => configured.config.serial_number.clone(),
                // The USB device is chosen by its own.
                Transport::Usb => None,
            },
            calibration: configured.config.in_force.clone(),
            laser,
            hub,
            slot: Mutex::new(Slot::Free),
            threads: Mutex::default(),
            status: Mutex::new(ScannerStatus {
                name: configured.name.to_owned(),
                link: ScannerLink::Unknown,
                endpoint: configured.config.place(),
                model: None,
                serial: None,
                firmware: None,
                problem: None,
                calibration: None,
            }),
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Asks the scanner who it is. Blocks until it has said so.
    ///
    /// # Errors
    /// It cannot be asked, or is another one than the configuration says: names of serial ports
    /// change with the order in which scanners are plugged in.
    pub(crate) fn identify(&self) -> Result<Identity, ScannerError> {
        let identity = self.scanner.identify()?;
        match &self.serial_number {
            Some(wanted) if identity.serial.as_str() != wanted => Err(ScannerError::WrongScanner {
                place: lock(&self.status).endpoint.clone(),
                found: identity.serial.as_str().to_owned(),
                wanted: wanted.clone(),
            }),
            _ => Ok(identity),
        }
    }

    /// Its section of the configuration.
    pub(crate) fn section(&self) -> &str {
        &self.section
    }

    /// Names one of its loops or threads.
    pub(crate) fn loop_name(&self, kind: &str) -> String {
        match self.name.as_str() {
            THE_SCANNER => kind.to_owned(),
            name => format!("{kind} {name}"),
        }
    }

    /// Keeps the place for a scan.
    pub(crate) fn reserve(&self) -> Result<Reservation<'_>, ServiceError> {
        let mut slot = lock(&self.slot);
        self.check_free(&slot)?;
        *slot = Slot::Reserved;
        Ok(Reservation {
            station: self,
            used: false,
        })
    }

    /// Refuses where a scan could not begin now.
    pub(crate) fn refuse_if_busy(&self) -> Result<(), ServiceError> {
        self.check_free(&lock(&self.slot))
    }

    fn check_free(&self, slot: &Slot) -> Result<(), ServiceError> {
        let scan = match slot {
            Slot::Free => return Ok(()),
            Slot::Reserved => None,
            Slot::Taken { scan, .. } => Some(scan.id.clone()),
        };
        Err(ServiceError::ScannerBusy {
            scanner: self.name.clone(),
            scan,
        })
    }

    /// Ends the scan that is under way, if there is one, and if it is the one meant. The laser
    /// is off when this returns, if the scanner can be reached. Gives the scan's id.
    pub(crate) fn stop(&self, id: Option<&str>, reason: &str) -> Option<String> {
        let (stopped, abort) = match &*lock(&self.slot) {
            Slot::Taken { scan, abort } if id.is_none_or(|id| id == scan.id) => {
                (scan.id.clone(), Arc::clone(abort))
            }
            _ => return None,
        };
        // First the reason: whoever takes the scan stops the scanner as soon as it is asked to.
        self.laser.stop_asked(reason);
        abort.ask(reason);
        // No other start of the service is to go on with it.
        let tell = || self.scanner.abort();
        if let Err(error) = self.noting(&|| abort.presence.end(), tell) {
            tracing::warn!(scanner = self.name, %error, "cannot tell the scanner to stop");
        }
        Some(stopped)
    }

    /// Has the scan of this id stand still until a person lets it go on.
    ///
    /// # Errors
    /// As [`Scanner::pause_scan`].
    pub(crate) fn pause(&self, id: &str) -> Result<(), ScannerError> {
        let abort = match &*lock(&self.slot) {
            Slot::Taken { scan, abort } if scan.id == id => Arc::clone(abort),
            _ => return Err(ScannerError::NothingToPause),
        };
        // Another start of the service is to ask as well.
        let tell = || self.scanner.pause_scan();
        let paused = self.noting(&|| abort.presence.withdraw(), tell);
        if let Err(ScannerError::NothingToPause | ScannerError::CannotPause(_)) = paused {
            abort.presence.restore();
        }
        paused
    }

    /// Tells the scanner something while this is noted on disk: what is noted holds from this
    /// moment on, whatever the scanner does, and the scanner does not wait for a disk.
    fn noting<T>(&self, note: &(dyn Fn() + Sync), tell: impl FnOnce() -> T) -> T {
        std::thread::scope(|scope| {
            let thread = std::thread::Builder::new().name(self.loop_name("noted"));
            let noted = thread.spawn_scoped(scope, note);
            let told = tell();
            if noted.is_err() {
                note();
            }
            told
        })
    }

    /// True while a scan is under way or about to be.
    pub(crate) fn is_scanning(&self) -> bool {
        !matches!(*lock(&self.slot), Slot::Free)
    }

    /// The scan under way.
    pub(crate) fn active_scan(&self) -> Option<Scan> {
        match &*lock(&self.slot) {
            Slot::Taken { scan, .. } => Some((**scan).clone()),
            _ => None,
        }
    }

    /// The scan under way, if it stands still.
    pub(crate) fn paused_scan(&self) -> Option<Scan> {
        self.active_scan()
            .filter(|scan| scan.state == ScanState::Paused)
    }

    /// Changes what is known of the scan under way; gives it as it is then.
    pub(crate) fn update_active(&self, change: impl FnOnce(&mut Scan)) -> Option<Scan> {
        match &mut *lock(&self.slot) {
            Slot::Taken { scan, .. } => {
                change(scan);
                Some((**scan).clone())
            }
            _ => None,
        }
    }

    /// Makes room for the next scan.
    pub(crate) fn free(&self) {
        *lock(&self.slot) = Slot::Free;
    }

    /// Waits until the threads of all scans have ended.
    pub(crate) fn join(&self) {
        let threads = std::mem::take(&mut *lock(&self.threads));
        for thread in threads {
            if thread.join().is_err() {
                tracing::error!(scanner = self.name, "the scan's thread ended by a panic");
            }
        }
    }

    /// What is known of the scanner.
    pub(crate) fn status(&self) -> ScannerStatus {
        let mut status = lock(&self.status).clone();
        // Its age goes on while nothing else changes.
        status.calibration = self.calibration.as_ref().map(|own| {
            let now = Timestamp::now();
            CalibrationStatus {
                date: own.file.date.clone(),
                age_days: own.file.age_days(now),
                residual_mm: own.file.residual_after_mm,
                overdue: own.overdue(now).is_some(),
            }
        });
        status
    }

    /// From this scanner's counts to millimetres, corrected where that is known.
    pub(crate) fn calibration(&self, identity: &Identity) -> Result<Calibration, CalibrationError> {
        let mut calibration = calibration(&identity.calibration);
        if let Some(own) = &self.calibration {
            let (model, serial) = (identity.model.as_str(), identity.serial.as_str());
            let correction = own
                .file
                .for_scanner(model, serial, &calibration, &self.section)?;
            calibration.correction = Some(correction);
        }
        Ok(calibration)
    }

    /// The station at a glance.
    pub(crate) fn summary(&self) -> ScannerSummary {
        ScannerSummary {
            status: self.status(),
            laser: self.laser.latest().map(Box::new),
            scan: self.active_scan(),
        }
    }

    /// Notes who the scanner is.
    pub(crate) fn note_identity(&self, identity: &Identity) {
        let changed = self.change(|status| {
            status.model = Some(identity.model.as_str().to_owned());
            status.serial = Some(identity.serial.as_str().to_owned());
            status.firmware = Some(identity.firmware.as_str().to_owned());
        });
        if let Some(status) = changed {
            self.hub.tell(Event::Scanner(status));
        }
    }

    /// Notes how the scanner does. Gives what was wrong before, and what is to be told, if that has
    /// changed.
    pub(crate) fn note(
        &self,
        link: ScannerLink,
        problem: Option<String>,
    ) -> Option<(Option<String>, ScannerStatus)> {
        let mut before = None;
        let changed = self.change(|status| {
            status.link = link;
            before = std::mem::replace(&mut status.problem, problem);
        });
        changed.map(|status| (before, status))
    }

    fn change(&self, change: impl FnOnce(&mut ScannerStatus)) -> Option<ScannerStatus> {
        let status = {
            let mut status = lock(&self.status);
            let before = status.clone();
            change(&mut status);
            if *status == before {
                return None;
            }
            status.clone()
        };
        if let Some(problem) = describe_trouble(&status) {
            tracing::warn!(
                scanner = self.name,
                endpoint = %status.endpoint,
                %problem,
                "scanner in trouble"
            );
        }
        Some(status)
    }
}

/// Ends the scans under way on all stations at once: a scanner that does not answer must not
/// keep another's laser on. Gives their ids.
pub(crate) fn stop_all(stations: &[Arc<Station>], reason: &str) -> Vec<String> {
    std::thread::scope(|scope| {
        let asked: Vec<_> = stations
            .iter()
            .filter(|station| station.active_scan().is_some())
            .map(|station| {
                let stop = move || station.stop(None, reason);
                let thread = std::thread::Builder::new().name(station.loop_name("abort"));
                (station, thread.spawn_scoped(scope, stop))
            })
            .collect();
        let stopped = asked.into_iter().filter_map(|(station, thread)| {
            match thread {
                Ok(thread) => thread.join().unwrap_or_else(|_| {
                    tracing::error!(scanner = station.name, "a thread ended by a panic");
                    None
                }),
                // No thread to be had: one after the other, then.
                Err(_) => station.stop(None, reason),
            }
        });
        stopped.collect()
    })
}
