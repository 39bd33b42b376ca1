//! What must survive a restart: the scans' records, the job queue and the messages to webhooks, in
//! one redb file.
//!
//! Records are JSON in a versioned envelope, so that a later version of the service can
//! tell what it reads. redb locks the file, which keeps a second service out. A file that is
//! damaged is moved aside, and what can still be read of it goes into a new one; an error of
//! the disk closes the file until it is next needed.

mod backend;
mod error;
mod messages;
mod pages;
mod record;
mod salvage;

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition};
use relief_api::{Job, JobId, Scan};
use serde::de::DeserializeOwned;
use storage::{Disk, remove_file_if_there};

pub use error::StoreError;
pub(crate) use messages::{Added, Message, Outgoing};

use backend::RecordsFile;
use error::is_trouble_of_the_disk;
use messages::{LOG, WAITING};
use record::decode;

const SCANS: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("scans");
const JOBS: TableDefinition<'_, JobId, &[u8]> = TableDefinition::new("jobs");

/// Memory for pages of the file; a record has about a kilobyte. More would mostly be scattered
/// over the heaps of the threads that happen to read, and the system keeps the file's pages, too.
const CACHE_BYTES: usize = 1 << 20;

/// How often a locked file is tried again.
const RETRY: Duration = Duration::from_millis(20);

/// The records.
#[derive(Debug)]
pub(crate) struct Store {
    state: RwLock<State>,
    disk: Arc<dyn Disk>,
    path: PathBuf,
}

#[derive(Debug)]
enum State {
    Open(Database),
    /// The disk refused something: redb wants the file opened anew.
    Shut,
    /// For good: whoever still holds the service then holds no lock on the file.
    Closed,
}

impl Store {
    /// Opens the records, waiting a while for a service that is just about to end.
    pub(crate) async fn open_soon(
        disk: &Arc<dyn Disk>,
        path: &Path,
        longest: Duration,
    ) -> Result<Self, StoreError> {
        let begun = Instant::now();
        loop {
            match Self::open(Arc::clone(disk), path) {
                Err(StoreError::Locked { .. }) if begun.elapsed() < longest => {
                    tokio::time::sleep(RETRY).await;
                }
                other => return other,
            }
        }
    }

    /// Opens the records, making them if there are none, and mending them if need be.
    pub(crate) fn open(disk: Arc<dyn Disk>, path: &Path) -> Result<Self, StoreError> {
        let failed = |error: &redb::Error| StoreError::of(path, error);
        let _making = make_alone(path)?;
        if !path.exists() && !salvage::take_up(&*disk, path)? {
            put_new(&*disk, path).map_err(|error| failed(&error))?;
        }
        let database = match salvage::open_whole(&*disk, path)? {
            Ok(database) => database,
            Err(damage) => {
                salvage::replace(&*disk, path, &damage)?;
                open_database(&*disk, path).map_err(|error| failed(&error))?
            }
        };
        Ok(Self {
            state: RwLock::new(State::Open(database)),
            disk,
            path: path.to_owned(),
        })
    }

    /// Closes the records, once what is being read or written is done; the next service
    /// may open them when this returns.
    pub(crate) fn close(&self) {
        *self.state.write().unwrap_or_else(PoisonError::into_inner) = State::Closed;
    }

    fn with<T>(
        &self,
        work: impl FnOnce(&Database) -> Result<T, redb::Error>,
    ) -> Result<T, StoreError> {
        self.reopen()?;
        let state = self.state.read().unwrap_or_else(PoisonError::into_inner);
        let error = match &*state {
            State::Open(database) => match work(database) {
                Ok(done) => return Ok(done),
                Err(error) => error,
            },
            State::Shut => redb::Error::PreviousIo,
            State::Closed => {
                return Err(StoreError::Closed {
                    path: self.path.clone(),
                });
            }
        };
        drop(state);
        if is_trouble_of_the_disk(&error) {
            let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
            if matches!(*state, State::Open(_)) {
                *state = State::Shut;
            }
        }
        Err(StoreError::of(&self.path, &error))
    }

    /// Opens the file again that was shut after an error of the disk.
    fn reopen(&self) -> Result<(), StoreError> {
        if !matches!(
            *self.state.read().unwrap_or_else(PoisonError::into_inner),
            State::Shut
        ) {
            return Ok(());
        }
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        if matches!(*state, State::Shut) {
            // Were it made anew where it is missing, a disk that is not mounted would look like
            // one without scans.
            std::fs::metadata(&self.path)
                .map_err(redb::Error::Io)
                .and_then(|_| open_database(&*self.disk, &self.path))
                .map(|database| *state = State::Open(database))
                .map_err(|error| StoreError::of(&self.path, &error))?;
            tracing::info!(file = %self.path.display(), "the records can be used again");
        }
        Ok(())
    }

    /// All scans, oldest first.
    pub(crate) fn scans(&self) -> Result<Vec<Scan>, StoreError> {
        self.of_scans(Some)
    }

    /// Something of each of some scans, oldest first. Whole records are not in memory at the
    /// same time: they are kept for ever.
    pub(crate) fn of_scans<T>(
        &self,
        pick: impl FnMut(Scan) -> Option<T>,
    ) -> Result<Vec<T>, StoreError> {
        self.with(|database| {
            let table = database.begin_read()?.open_table(SCANS)?;
            self.decode_each(table.iter()?.map(|row| Ok(row?.1)), pick)
        })?
    }

    /// One scan.
    pub(crate) fn scan(&self, id: &str) -> Result<Option<Scan>, StoreError> {
        let read = |database: &Database| -> Result<Option<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(SCANS)?;
            Ok(table.get(id)?.map(|bytes| bytes.value().to_vec()))
        };
        let bytes = self.with(read)?;
        bytes.map(|bytes| decode(&self.path, &bytes)).transpose()
    }

    /// Keeps a scan's record in place of any earlier one.
    pub(crate) fn put_scan(&self, scan: &Scan) -> Result<(), StoreError> {
        self.put_scan_telling(scan, &[]).map(drop)
    }

    /// All jobs, oldest first.
    pub(crate) fn jobs(&self) -> Result<Vec<Job>, StoreError> {
        self.of_jobs(Some)
    }

    /// Something of each of some jobs, oldest first, as [`Store::of_scans`].
    pub(crate) fn of_jobs<T>(
        &self,
        pick: impl FnMut(Job) -> Option<T>,
    ) -> Result<Vec<T>, StoreError> {
        self.with(|database| {
            let table = database.begin_read()?.open_table(JOBS)?;
            self.decode_each(table.iter()?.map(|row| Ok(row?.1)), pick)
        })?
    }

    /// One job.
    pub(crate) fn job(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        let read = |database: &Database| -> Result<Option<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(JOBS)?;
            Ok(table.get(id)?.map(|bytes| bytes.value().to_vec()))
        };
        let bytes = self.with(read)?;
        bytes.map(|bytes| decode(&self.path, &bytes)).transpose()
    }

    /// Keeps a job's record in place of any earlier one.
    pub(crate) fn put_job(&self, job: &Job) -> Result<(), StoreError> {
        self.put_job_telling(job, &[]).map(drop)
    }

    /// What is picked of the rows; inside, that a record cannot be read.
    fn decode_each<'a, R: DeserializeOwned, T>(
        &self,
        rows: impl Iterator<Item = Result<redb::AccessGuard<'a, &'static [u8]>, redb::Error>>,
        mut pick: impl FnMut(R) -> Option<T>,
    ) -> Result<Result<Vec<T>, StoreError>, redb::Error> {
        let mut picked = Vec::new();
        for row in rows {
            match decode(&self.path, row?.value()) {
                Ok(record) => picked.extend(pick(record)),
                Err(error) => return Ok(Err(error)),
            }
        }
        Ok(Ok(picked))
    }
}

/// Opens the file with all tables in it.
fn open_database(disk: &dyn Disk, path: &Path) -> Result<Database, redb::Error> {
    let file = RecordsFile::open(disk, path)?;
    let database = Database::builder()
        .set_cache_size(CACHE_BYTES)
        // A damaged file is then told, where redb might otherwise panic on it later.
        .set_check_integrity_on_open(true)
        .create_with_backend(file)?;
    let transaction = database.begin_write()?;
    transaction.open_table(SCANS)?;
    transaction.open_table(JOBS)?;
    transaction.open_table(WAITING)?;
    transaction.open_table(LOG)?;
    transaction.commit()?;
    Ok(database)
}

/// Keeps every other service from making or replacing the file until the lock is dropped. The
/// file's own lock cannot: it is on what may be moved aside or overwritten by a rename.
fn make_alone(path: &Path) -> Result<File, StoreError> {
    let failed = |error: io::Error| StoreError::of(path, &redb::Error::Io(error));
    let lock = File::create(path.with_extension("lock")).map_err(failed)?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(StoreError::Locked {
            path: path.to_owned(),
        }),
        Err(TryLockError::Error(error)) => Err(failed(error)),
    }
}

/// Makes a file without records. It is made under another name: one that is half made, since
/// the power failed, could not be told from one that is damaged.
fn put_new(disk: &dyn Disk, path: &Path) -> Result<(), redb::Error> {
    let new = path.with_extension("redb.new");
    remove_file_if_there(disk, &new)?;
    open_database(disk, &new)?.close()?;
    disk.rename(&new, path)?;
    Ok(sync_folder(disk, path)?)
}

fn sync_folder(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), |folder| disk.sync_dir(folder))
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::mpsc::{Receiver, Sender, channel};

    use storage::{Deed, HinderedDisk, Hindrance, LocalDisk};

    use super::*;

    /// Tells when the new file is about to get its name, and waits for leave.
    #[derive(Debug, Clone)]
    struct BeforeTheName(Arc<Mutex<(Sender<()>, Receiver<()>)>>);

    impl Hindrance for BeforeTheName {
        fn before(&self, deed: Deed, _: &Path) -> io::Result<()> {
            if deed == Deed::Rename {
                let (reached, leave) = &*self.0.lock().unwrap();
                reached.send(()).unwrap();
                leave.recv().unwrap();
            }
            Ok(())
        }
    }

    #[test]
    fn two_first_starts_at_once_make_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("reliefd.redb");
        let (reached, is_reached) = channel();
        let (give_leave, leave) = channel();
        let held = HinderedDisk(BeforeTheName(Arc::new(Mutex::new((reached, leave)))));
        let there = path.clone();
        let first = std::thread::spawn(move || Store::open(Arc::new(held), &there).unwrap());
        is_reached.recv().unwrap();
        // The first has yet to give its file the name.
        let second = || Store::open(Arc::new(LocalDisk), &path);
        let error = second().unwrap_err();
        assert!(matches!(error, StoreError::Locked { .. }), "{error}");
        give_leave.send(()).unwrap();
        let first = first.join().unwrap();
        let error = second().unwrap_err();
        assert!(matches!(error, StoreError::Locked { .. }), "{error}");
        first.close();
        second().unwrap();
    }

    #[tokio::test]
    async fn who_waits_for_the_records_has_them_as_soon_as_they_are_closed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("store");
        let disk: Arc<dyn Disk> = Arc::new(LocalDisk);
        let first = Store::open(Arc::clone(&disk), &path).unwrap();
        let error = Store::open_soon(&disk, &path, Duration::ZERO)
            .await
            .unwrap_err();
        assert!(matches!(error, StoreError::Locked { .. }), "{error}");
        let (second, ()) = tokio::join!(
            // Far longer than this takes.
            Store::open_soon(&disk, &path, Duration::from_secs(600)),
            async { first.close() }
        );
        assert_eq!(second.unwrap().jobs().unwrap(), []);
        let error = first.jobs().unwrap_err();
        assert!(matches!(error, StoreError::Closed { .. }), "{error}");
    }
}
