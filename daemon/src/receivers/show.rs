//! How the scanners are, for receivers that keep it for whoever asks.

use std::sync::Arc;
use std::time::Duration;

use relief_api::ScannerState;

use crate::service::Service;

/// Nothing is shown more often.
const INTERVAL: Duration = Duration::from_secs(1);
/// A turn waits for nobody but the processor.
const LONGEST_TURN: Duration = Duration::from_secs(60);

/// Shows how the scanners are until the service stops. Runs on a thread of its own.
pub(crate) fn show(service: &Arc<Service>) {
    let pulse = service.liveness.begin("show");
    loop {
        pulse.work(LONGEST_TURN);
        let receivers = service.receivers.all();
        if !receivers.is_empty() {
            let states = states(service);
            for outbox in receivers {
                outbox.receiver().show(&states);
            }
        }
        pulse.rest();
        if service.wait_for_stop(INTERVAL) {
            return;
        }
    }
}

fn states(service: &Service) -> Vec<ScannerState> {
    let scanners = service.scanners().scanners.into_iter();
    let states = scanners.map(|scanner| ScannerState {
        name: scanner.status.name,
        link: scanner.status.link,
        laser: scanner.laser.map(|entry| entry.laser),
        problem: scanner.status.problem,
        columns: scanner.scan.as_ref().map(|scan| scan.columns),
        columns_planned: scanner.scan.as_ref().map(|scan| scan.columns_planned),
        scan: scanner.scan.map(|scan| scan.id),
    });
    states.collect()
}
