//! From the driver's stream to whoever keeps its columns.

use std::sync::mpsc::SyncSender;

use scan_record::RawColumn;
use scanner_driver::{ScanProgress, ScanStream, ScannerError};

use super::columns::kept;
use crate::service::Service;
use crate::station::Station;

/// Something of a scan that is fed to its keeper.
pub(super) enum Fed {
    Column(RawColumn),
    /// The scan stands still.
    Paused {
        reason: String,
        /// Until a person says that it may go on.
        needs_person: bool,
        /// Somebody wants it to.
        on_request: bool,
    },
    Resumed,
    End(Result<(), ScannerError>),
}

/// Moves columns from the driver to the channel until either ends.
pub(super) fn feed(
    service: &Service,
    station: &Station,
    mut stream: ScanStream,
    sender: &SyncSender<Fed>,
) {
    let pulse = service.liveness.begin(station.loop_name("scan-feed"));
    let mut paused = false;
    loop {
        // The driver answers in time, if only with an error; a pause lasts as long as it does.
        if paused {
            pulse.rest();
        } else {
            pulse.work(station.longest_wait);
        }
        let fed = match stream.next_progress() {
            Ok(Some(ScanProgress::Column(column))) => Fed::Column(kept(column)),
            Ok(Some(ScanProgress::Paused(pause))) => {
                paused = true;
                Fed::Paused {
                    reason: pause.to_string(),
                    needs_person: pause.needs_person,
                    on_request: pause.cause == ScannerError::PausedOnRequest,
                }
            }
            Ok(Some(ScanProgress::Resumed)) => {
                paused = false;
                Fed::Resumed
            }
            Ok(None) => Fed::End(Ok(())),
            Err(error) => Fed::End(Err(error)),
        };
        let last = matches!(fed, Fed::End(_));
        // The journal may take its time: then the table waits.
        pulse.rest();
        if sender.send(fed).is_err() || last {
            return;
        }
    }
}
