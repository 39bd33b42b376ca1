//! Results that were made elsewhere go into the spool as those that are made here.

use std::io::{self, Write};
use std::path::PathBuf;

use job_queue::QueueError;
use job_queue::depot::{BundledFile, Kind};
use relief_api::Job;
use storage::Appender;

use super::Fleet;
use super::order::Delivered;
use crate::service::Service;
use crate::spool::SpoolError;

/// A file of a result, which is safe on the disk once it is whole.
struct Kept(Appender);

impl Write for Kept {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()?;
        self.0.sync_data()
    }
}

fn told(error: SpoolError) -> QueueError {
    QueueError::Records(format!("{error}; {}", error.hint()))
}

impl Fleet {
    /// Puts a result into the spool, whole or not at all; gives where it is.
    pub(super) fn fetch(
        &self,
        service: &Service,
        job: &Job,
        delivered: &Delivered,
    ) -> Result<PathBuf, QueueError> {
        let incoming = service.spool.begin(&job.result).map_err(told)?;
        let mut create = |file: &BundledFile| -> io::Result<Box<dyn Write>> {
            let created = service.disk.create(&incoming.join(&file.name))?;
            Ok(Box::new(Kept(Appender::new(created))))
        };
        let bundle = &delivered.bundle;
        let fetched = self
            .depot
            .fetch_bundle(&self.bench, Kind::Result, bundle, &mut create);
        if let Err(error) = fetched {
            service.spool.discard(&job.result);
            return Err(error);
        }
        service.spool.publish(&job.result).map_err(told)
    }
}
