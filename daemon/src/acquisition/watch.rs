//! Keeping an eye on the scanner while it is idle.

use std::sync::Arc;
use std::time::Duration;

use relief_api::{ScannerLink, ScannerStatus};
use scanner_driver::ScannerError;

use crate::service::Service;
use crate::station::Station;

/// How often an idle scanner is looked at.
const INTERVAL: Duration = Duration::from_secs(2);

/// Looks at a scanner until the service stops. Runs on a thread of its own.
pub(crate) fn watch(service: &Arc<Service>, station: &Station) {
    let pulse = service.liveness.begin(station.loop_name("scanner-watch"));
    loop {
        if !station.is_scanning() {
            pulse.work(station.longest_wait);
            look(service, station);
            pulse.rest();
        }
        if service.wait_for_stop(INTERVAL) {
            return;
        }
    }
}

fn look(service: &Service, station: &Station) {
    // Each time, since cables are swapped; the driver knows it from when it connected.
    let identified = station.identify();
    let identified = identified.map(|identity| station.note_identity(&identity));
    // A scan may have begun while this waited for its answer; then the scan knows better, and
    // the scanner is not asked otherwise.
    if station.is_scanning() {
        return;
    }
    let result = identified.and_then(|()| station.scanner.status());
    if station.is_scanning() {
        return;
    }
    if let Ok(status) = &result {
        service.metrics.line(station.name(), status.line);
    }
    let (link, problem) = match result {
        Ok(status) if status.faults.is_empty() => (ScannerLink::Ready, None),
        Ok(status) => {
            let fault = ScannerError::Fault(status.faults).to_string();
            (ScannerLink::Trouble, Some(fault))
        }
        Err(error) => (ScannerLink::Trouble, Some(error.to_string())),
    };
    service.note_scanner(station, link, problem);
}

/// One line on what is wrong, for the log; `None` when nothing is.
pub(crate) fn describe_trouble(status: &ScannerStatus) -> Option<&str> {
    match status.link {
        ScannerLink::Trouble => status.problem.as_deref(),
        _ => None,
    }
}
