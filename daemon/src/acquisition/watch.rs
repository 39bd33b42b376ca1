//! Keeping an eye on the scanner while it is idle.

use std::sync::Arc;
use std::time::Duration;

use relief_api::{ScannerLink, ScannerStatus};
use scanner_driver::ScannerError;

use crate::service::Service;

/// How often an idle scanner is looked at.
const INTERVAL: Duration = Duration::from_secs(2);

/// Looks at the scanner until the service stops. Runs on a thread of its own.
pub(crate) fn watch(service: &Arc<Service>) {
    let pulse = service.liveness.begin("scanner-watch");
    loop {
        if !service.is_scanning() {
            pulse.work(service.config().scanner.longest_wait());
            look(service);
            pulse.rest();
        }
        if service.wait_for_stop(INTERVAL) {
            return;
        }
    }
}

fn look(service: &Service) {
    let known = service.scanner_status().model.is_some();
    let result = if known {
        service.scanner.status().map(|status| {
            if status.faults.is_empty() {
                Ok(())
            } else {
                Err(ScannerError::Fault(status.faults).to_string())
            }
        })
    } else {
        service.scanner.identify().map(|identity| {
            service.note_identity(&identity);
            Ok(())
        })
    };
    // A scan may have begun while this waited for its answer; then the scan knows better.
    if service.is_scanning() {
        return;
    }
    match result {
        Ok(Ok(())) => service.note_scanner(ScannerLink::Ready, None),
        Ok(Err(fault)) => service.note_scanner(ScannerLink::Trouble, Some(fault)),
        Err(error) => service.note_scanner(ScannerLink::Trouble, Some(error.to_string())),
    }
}

/// One line on what is wrong, for the log; `None` when nothing is.
pub(crate) fn describe_trouble(status: &ScannerStatus) -> Option<&str> {
    match status.link {
        ScannerLink::Trouble => status.problem.as_deref(),
        _ => None,
    }
}
