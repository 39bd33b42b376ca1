//! Results that were made elsewhere go into the spool as those that are made here.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use job_queue::QueueError;
use job_queue::depot::{BundledFile, Kind};
use relief_api::Job;
use storage::Appender;

use super::Fleet;
use super::order::Delivered;
use crate::service::{Service, lock};
use crate::spool::SpoolError;

/// Why a result is not in the spool.
pub(super) enum FetchError {
    /// The servers do not give it, or what they give is damaged.
    Queue(QueueError),
    /// The spool does not take it.
    Spool {
        /// Why not.
        error: String,
        /// What to do about it.
        hint: String,
    },
}

impl From<SpoolError> for FetchError {
    fn from(error: SpoolError) -> Self {
        Self::Spool {
            error: error.to_string(),
            hint: error.hint(),
        }
    }
}

/// What the disk last refused.
#[derive(Clone, Default)]
struct Refused(Arc<Mutex<Option<io::Error>>>);

impl Refused {
    /// Keeps what the disk says, and passes on that it says something.
    fn noting<T>(&self, done: io::Result<T>) -> io::Result<T> {
        done.map_err(|error| {
            let told = error.kind().into();
            *lock(&self.0) = Some(error);
            told
        })
    }

    fn take(&self, path: &Path) -> Option<SpoolError> {
        let source = lock(&self.0).take()?;
        Some(SpoolError {
            action: "write a result",
            path: path.to_owned(),
            source,
        })
    }
}

/// A file of a result, which is safe on the disk once it is whole.
struct Kept {
    file: Appender,
    refused: Refused,
}

impl Write for Kept {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.refused.noting(self.file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        let flushed = self.file.flush().and_then(|()| self.file.sync_data());
        self.refused.noting(flushed)
    }
}

impl Fleet {
    /// Puts a result into the spool, whole or not at all; gives where it is.
    pub(super) fn fetch(
        &self,
        service: &Service,
        job: &Job,
        delivered: &Delivered,
    ) -> Result<PathBuf, FetchError> {
        let incoming = service.spool.begin(&job.result)?;
        let refused = Refused::default();
        let mut create = |file: &BundledFile| -> io::Result<Box<dyn Write>> {
            let created = service.disk.create(&incoming.join(&file.name));
            Ok(Box::new(Kept {
                file: Appender::new(refused.noting(created)?),
                refused: refused.clone(),
            }))
        };
        let bundle = &delivered.bundle;
        let fetched = self
            .depot
            .fetch_bundle(&self.bench, Kind::Result, bundle, &mut create);
        if let Err(error) = fetched {
            service.spool.discard(&job.result);
            // To the depot that is a place that cannot be written, and no more.
            return Err(refused
                .take(service.spool.root())
                .map_or(FetchError::Queue(error), FetchError::from));
        }
        Ok(service.spool.publish(&job.result)?)
    }
}
