//! What must survive a restart: the scans' records and the job queue, in one redb file.
//!
//! Records are JSON in a versioned envelope, so that a later version of the service can
//! tell what it reads. redb locks the file, which keeps a second service out.

use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};
use std::time::{Duration, Instant};

use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition};
use relief_api::{Job, JobId, Scan};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

const SCANS: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("scans");
const JOBS: TableDefinition<'_, JobId, &[u8]> = TableDefinition::new("jobs");
const RECORD_VERSION: u32 = 1;

/// How often a locked file is tried again.
const RETRY: Duration = Duration::from_millis(20);

/// The records cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another process has them.
    #[error(
        "{} is in use by another reliefd: stop that one, or give this one another state_dir",
        path.display()
    )]
    Locked {
        /// The file.
        path: PathBuf,
    },
    /// The service has ended.
    #[error("the records in {} are closed, since the service ends", path.display())]
    Closed {
        /// The file.
        path: PathBuf,
    },
    /// The file is damaged, or the disk refuses.
    #[error("cannot use the records in {}: {message}", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// What the store says.
        message: String,
    },
    /// Written by a newer service.
    #[error(
        "{} holds a record of version {found}, this service knows up to {RECORD_VERSION}: \
         use a newer reliefd",
        path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Version of the record.
        found: u32,
    },
}

/// The records.
#[derive(Debug)]
pub(crate) struct Store {
    /// `None` once closed: whoever still holds the service then holds no lock on the file.
    database: RwLock<Option<Database>>,
    path: PathBuf,
}

/// A record as it is kept.
#[derive(Serialize, Deserialize)]
struct Envelope<T> {
    version: u32,
    record: T,
}

impl Store {
    /// Opens the records, waiting a while for a service that is just about to end.
    pub(crate) async fn open_soon(path: &Path, longest: Duration) -> Result<Self, StoreError> {
        let begun = Instant::now();
        loop {
            match Self::open(path) {
                Err(StoreError::Locked { .. }) if begun.elapsed() < longest => {
                    tokio::time::sleep(RETRY).await;
                }
                other => return other,
            }
        }
    }

    /// Opens the records, making them if there are none.
    pub(crate) fn open(path: &Path) -> Result<Self, StoreError> {
        let unusable = |message: String| StoreError::Unusable {
            path: path.to_owned(),
            message,
        };
        let database = Database::create(path).map_err(|error| match error {
            redb::DatabaseError::DatabaseAlreadyOpen => StoreError::Locked {
                path: path.to_owned(),
            },
            other => unusable(other.to_string()),
        })?;
        let make = || -> Result<(), redb::Error> {
            let transaction = database.begin_write()?;
            transaction.open_table(SCANS)?;
            transaction.open_table(JOBS)?;
            transaction.commit()?;
            Ok(())
        };
        make().map_err(|error| unusable(error.to_string()))?;
        Ok(Self {
            database: RwLock::new(Some(database)),
            path: path.to_owned(),
        })
    }

    /// Closes the records, once what is being read or written is done; the next service
    /// may open them when this returns.
    pub(crate) fn close(&self) {
        let mut database = self
            .database
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        *database = None;
    }

    fn with<T>(
        &self,
        work: impl FnOnce(&Database) -> Result<T, redb::Error>,
    ) -> Result<T, StoreError> {
        let database = self.database.read().unwrap_or_else(PoisonError::into_inner);
        let Some(database) = &*database else {
            return Err(StoreError::Closed {
                path: self.path.clone(),
            });
        };
        work(database).map_err(|error| self.unusable(&error))
    }

    /// All scans, oldest first.
    pub(crate) fn scans(&self) -> Result<Vec<Scan>, StoreError> {
        let read = |database: &Database| -> Result<Vec<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(SCANS)?;
            table
                .iter()?
                .map(|row| Ok(row?.1.value().to_vec()))
                .collect()
        };
        self.decode_all(self.with(read)?)
    }

    /// One scan.
    pub(crate) fn scan(&self, id: &str) -> Result<Option<Scan>, StoreError> {
        let read = |database: &Database| -> Result<Option<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(SCANS)?;
            Ok(table.get(id)?.map(|bytes| bytes.value().to_vec()))
        };
        let bytes = self.with(read)?;
        bytes.map(|bytes| self.decode(&bytes)).transpose()
    }

    /// Keeps a scan's record in place of any earlier one.
    pub(crate) fn put_scan(&self, scan: &Scan) -> Result<(), StoreError> {
        let bytes = self.encode(scan)?;
        let write = |database: &Database| -> Result<(), redb::Error> {
            let transaction = database.begin_write()?;
            transaction
                .open_table(SCANS)?
                .insert(scan.id.as_str(), bytes.as_slice())?;
            transaction.commit()?;
            Ok(())
        };
        self.with(write)
    }

    /// All jobs, oldest first.
    pub(crate) fn jobs(&self) -> Result<Vec<Job>, StoreError> {
        let read = |database: &Database| -> Result<Vec<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(JOBS)?;
            table
                .iter()?
                .map(|row| Ok(row?.1.value().to_vec()))
                .collect()
        };
        self.decode_all(self.with(read)?)
    }

    /// One job.
    pub(crate) fn job(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        let read = |database: &Database| -> Result<Option<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(JOBS)?;
            Ok(table.get(id)?.map(|bytes| bytes.value().to_vec()))
        };
        let bytes = self.with(read)?;
        bytes.map(|bytes| self.decode(&bytes)).transpose()
    }

    /// Keeps a job's record in place of any earlier one.
    pub(crate) fn put_job(&self, job: &Job) -> Result<(), StoreError> {
        let bytes = self.encode(job)?;
        let write = |database: &Database| -> Result<(), redb::Error> {
            let transaction = database.begin_write()?;
            transaction
                .open_table(JOBS)?
                .insert(job.id, bytes.as_slice())?;
            transaction.commit()?;
            Ok(())
        };
        self.with(write)
    }

    /// Keeps a new job under the next number, and notes it on its scan, both or neither.
    /// `finished` is the state in which the scan is kept.
    pub(crate) fn add_job(&self, mut job: Job, scan: &mut Scan) -> Result<Job, StoreError> {
        let write = |database: &Database| -> Result<Job, redb::Error> {
            let transaction = database.begin_write()?;
            {
                let mut jobs = transaction.open_table(JOBS)?;
                job.id = jobs.last()?.map_or(1, |(id, _)| id.value() + 1);
                let bytes = serde_json::to_vec(&Envelope {
                    version: RECORD_VERSION,
                    record: &job,
                })
                .map_err(std::io::Error::from)?;
                jobs.insert(job.id, bytes.as_slice())?;
                scan.jobs.push(job.id);
                let bytes = serde_json::to_vec(&Envelope {
                    version: RECORD_VERSION,
                    record: &*scan,
                })
                .map_err(std::io::Error::from)?;
                transaction
                    .open_table(SCANS)?
                    .insert(scan.id.as_str(), bytes.as_slice())?;
            }
            transaction.commit()?;
            Ok(job)
        };
        self.with(write)
    }

    fn encode<T: Serialize>(&self, record: &T) -> Result<Vec<u8>, StoreError> {
        serde_json::to_vec(&Envelope {
            version: RECORD_VERSION,
            record,
        })
        .map_err(|e| self.unusable(&e))
    }

    fn decode<T: DeserializeOwned>(&self, bytes: &[u8]) -> Result<T, StoreError> {
        #[derive(Deserialize)]
        struct Version {
            version: u32,
        }
        let Version { version } = serde_json::from_slice(bytes).map_err(|e| self.unusable(&e))?;
        if version > RECORD_VERSION {
            return Err(StoreError::Newer {
                path: self.path.clone(),
                found: version,
            });
        }
        let envelope: Envelope<T> = serde_json::from_slice(bytes).map_err(|e| self.unusable(&e))?;
        Ok(envelope.record)
    }

    fn decode_all<T: DeserializeOwned>(&self, rows: Vec<Vec<u8>>) -> Result<Vec<T>, StoreError> {
        rows.iter().map(|bytes| self.decode(bytes)).collect()
    }

    fn unusable(&self, error: &dyn std::fmt::Display) -> StoreError {
        StoreError::Unusable {
            path: self.path.clone(),
            message: error.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn who_waits_for_the_records_has_them_as_soon_as_they_are_closed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("store");
        let first = Store::open(&path).unwrap();
        let error = Store::open_soon(&path, Duration::ZERO).await.unwrap_err();
        assert!(matches!(error, StoreError::Locked { .. }), "{error}");
        let (second, ()) = tokio::join!(
            // Far longer than this takes.
            Store::open_soon(&path, Duration::from_secs(600)),
            async { first.close() }
        );
        assert_eq!(second.unwrap().jobs().unwrap(), []);
        let error = first.jobs().unwrap_err();
        assert!(matches!(error, StoreError::Closed { .. }), "{error}");
    }
}
