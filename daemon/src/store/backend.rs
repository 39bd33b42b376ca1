//! redb's file, written through the service's disk.

use std::fs::{File, OpenOptions};
use std::io;
use std::ops::Bound;
use std::path::Path;

use redb::backends::FileBackend;
use redb::{BackendError, DatabaseError, StorageBackend};
use storage::{Disk, DiskFile};

/// Reads and locks the file itself, and writes through the disk.
#[derive(Debug)]
pub(super) struct RecordsFile {
    reading: FileBackend,
    writing: Box<dyn DiskFile>,
}

impl RecordsFile {
    /// Opens the file, making it if there is none.
    pub(super) fn open(disk: &dyn Disk, path: &Path) -> Result<Self, DatabaseError> {
        let writing = disk.open(path)?;
        // Writable, since some file systems lock no others exclusively.
        let file: File = OpenOptions::new().read(true).write(true).open(path)?;
        Ok(Self {
            reading: FileBackend::new(file)?,
            writing,
        })
    }
}

impl StorageBackend for RecordsFile {
    fn len(&self) -> io::Result<u64> {
        self.reading.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.reading.read(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.writing.set_len(len)
    }

    fn sync_data(&self) -> io::Result<()> {
        self.writing.sync_data()
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.writing.write_at(data, offset)
    }

    fn close(&self) -> io::Result<()> {
        self.reading.close()
    }

    fn try_lock_range(&self, start: Bound<u64>, end: Bound<u64>) -> Result<bool, BackendError> {
        self.reading.try_lock_range(start, end)
    }

    fn try_lock_shared_range(
        &self,
        start: Bound<u64>,
        end: Bound<u64>,
    ) -> Result<bool, BackendError> {
        self.reading.try_lock_shared_range(start, end)
    }

    fn unlock_range(&self, start: Bound<u64>, end: Bound<u64>) -> Result<(), BackendError> {
        self.reading.unlock_range(start, end)
    }
}
