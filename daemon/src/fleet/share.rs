//! The columns of scans go to the depot while the scan is taken, so that little is left to be sent
//! when it is complete.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};
use std::time::Duration;

use job_queue::QueueError;
use job_queue::depot::{CHUNK_BYTES, Kind, Parcel};

use relief_api::JobId;

use super::Fleet;
use crate::service::{Service, lock};

/// How often it is looked whether scans have grown.
const LOOK: Duration = Duration::from_millis(250);
/// How long the depot is left alone after it refused something.
const PAUSE: Duration = Duration::from_secs(5);

/// Sends what scans under way have kept, chunk by chunk, until the service stops. Runs on a thread
/// of its own.
pub(super) fn share(service: &Arc<Service>, fleet: &Arc<Fleet>) {
    while !service.wait_for_stop(LOOK) {
        if !fleet.queue.is_connected() {
            continue;
        }
        let scans: Vec<String> = service
            .stations
            .iter()
            .filter_map(|station| Some(station.active_scan()?.id))
            .collect();
        for scan in &scans {
            if let Err(error) = fleet.share_more(service, scan) {
                // The scan goes on whatever happens here; what is missing is sent at its end.
                tracing::debug!(scan, %error, "columns are sent later");
                fleet.trouble(Some(&error));
                if service.wait_for_stop(PAUSE) {
                    return;
                }
            }
        }
    }
}

fn reading(lock: &RwLock<()>) -> RwLockReadGuard<'_, ()> {
    lock.read().unwrap_or_else(PoisonError::into_inner)
}

fn records(path: &Path) -> impl Fn(io::Error) -> QueueError {
    move |error| QueueError::Records(format!("{}: {error}", path.display()))
}

impl Fleet {
    /// Sends the chunks that a journal has whole and that were not sent.
    fn share_more(&self, service: &Service, scan: &str) -> Result<(), QueueError> {
        let path = service.journal_path(scan);
        let Ok(mut file) = File::open(&path) else {
            // It is about to be made.
            return Ok(());
        };
        let bytes = file.metadata().map_err(records(&path))?.len();
        loop {
            let sent = lock(&self.shared).get(scan).map_or(0, Vec::len);
            let from = (sent * CHUNK_BYTES) as u64;
            if bytes < from + CHUNK_BYTES as u64 {
                return Ok(());
            }
            let mut raw = vec![0; CHUNK_BYTES];
            file.seek(SeekFrom::Start(from)).map_err(records(&path))?;
            file.read_exact(&mut raw).map_err(records(&path))?;
            let _sending = reading(&self.sending);
            let chunk = self.depot.put_chunk(&self.bench, Kind::Journal, &raw)?;
            let mut shared = lock(&self.shared);
            shared.entry(scan.to_owned()).or_default().push(chunk);
            drop(shared);
            if service.wait_for_stop(Duration::ZERO) {
                return Ok(());
            }
        }
    }

    /// Sends what is missing of a journal that has its end; all of it where a worker has missed
    /// something.
    pub(super) fn share_whole(
        &self,
        service: &Service,
        job: JobId,
        scan: &str,
        is_missed: bool,
    ) -> Result<Parcel, QueueError> {
        let path = service.journal_path(scan);
        let mut file = File::open(&path).map_err(records(&path))?;
        let _sending = reading(&self.sending);
        // Chunks are known by what is in them: those that were sent are not sent again.
        let parcel = if is_missed {
            self.depot.put_anew(&self.bench, Kind::Journal, &mut file)?
        } else {
            self.depot.put(&self.bench, Kind::Journal, &mut file)?
        };
        if let Some(handed) = lock(&self.handed).get_mut(&job) {
            handed.chunks.clone_from(&parcel.chunks);
        }
        lock(&self.shared).remove(scan);
        Ok(parcel)
    }
}
