//! Appending a scan to disk while it is measured.

use std::io::{self, Write};
use std::path::Path;

use storage::{Appender, Disk, LocalDisk};

use crate::column::RawColumn;
use crate::format::{
    COLUMN_HEAD_BYTES, END_HEAD_BYTES, KIND_COLUMN, KIND_END, KIND_HEADER, MAGIC, MAX_HEADER_BYTES,
    MAX_REASON_BYTES, MAX_SAMPLES, PREAMBLE_BYTES, RECORD_HEAD_BYTES, SAMPLE_BYTES, checksum,
    record_head,
};
use crate::header::Header;
use crate::reader::Continuation;

/// Where a journal goes. A file in service; tests put a failing or forgetful medium here.
pub trait Storage: Write {
    /// Returns once everything written so far would survive a power failure.
    ///
    /// # Errors
    /// When the medium could not promise that.
    fn sync_data(&mut self) -> io::Result<()>;

    /// Gives back room that was set aside and is not needed. What is written stays.
    ///
    /// # Errors
    /// When the medium could not.
    fn release(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Storage for Appender {
    fn sync_data(&mut self) -> io::Result<()> {
        Appender::sync_data(self)
    }

    fn release(&mut self) -> io::Result<()> {
        // Room beyond the end goes with the cut.
        self.file().set_len(self.bytes())
    }
}

/// A journal in memory, for whoever passes its bytes on.
impl Storage for Vec<u8> {
    fn sync_data(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Why a scan ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EndCause {
    /// Every planned column was taken.
    Complete,
    /// Somebody, named in the text, asked for the end.
    Aborted(String),
    /// Something, named in the text, went wrong.
    Fault(String),
}

/// A journal could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The medium refused.
    #[error("cannot write the scan journal: {0}")]
    Io(#[from] io::Error),
    /// The header's byte strings are larger than a reader would accept.
    #[error("the scan's header has {bytes} bytes, at most {MAX_HEADER_BYTES} are allowed")]
    HeaderTooLarge {
        /// Size of the header's payload.
        bytes: usize,
    },
    /// A column is larger than a reader would accept.
    #[error("column {index} has {samples} samples, at most {MAX_SAMPLES} are allowed")]
    ColumnTooLarge {
        /// The column's number.
        index: u32,
        /// How many samples it has.
        samples: usize,
    },
    /// Columns must come in ascending order.
    #[error("column {index} cannot follow column {last}: columns are kept in ascending order")]
    OutOfOrder {
        /// The column that was refused.
        index: u32,
        /// The last one that was kept.
        last: u32,
    },
    /// An earlier write failed, so what follows it could not be read again.
    #[error("the scan journal takes no more columns after an earlier write failed")]
    Failed,
}

/// Writes one journal.
#[derive(Debug)]
pub struct JournalWriter<S: Storage = Appender> {
    storage: S,
    record: Vec<u8>,
    payload: Vec<u8>,
    last_index: Option<u32>,
    columns: u32,
    bytes: u64,
    failed: bool,
}

impl JournalWriter {
    /// As [`JournalWriter::create_on`], on the file system of this machine.
    ///
    /// # Errors
    /// As there.
    pub fn create(path: &Path, header: &Header) -> Result<Self, WriteError> {
        Self::create_on(&LocalDisk, path, header)
    }

    /// Makes the file, which must not exist yet, and syncs the header and the folder's
    /// entry, so that even a scan cut short at once can be found.
    ///
    /// # Errors
    /// [`WriteError::Io`], among others when the file exists.
    pub fn create_on(disk: &dyn Disk, path: &Path, header: &Header) -> Result<Self, WriteError> {
        let writer = Self::new(Appender::new(disk.create(path)?), header)?;
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            disk.sync_dir(folder)?;
        }
        Ok(writer)
    }

    /// Goes on with a journal that was cut short: what stands behind its last sound record is
    /// cut off, and what stands before it is synced.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn continue_on(
        disk: &dyn Disk,
        path: &Path,
        continuation: Continuation,
    ) -> Result<Self, WriteError> {
        let file = disk.open(path)?;
        file.set_len(continuation.at_byte)?;
        let mut writer = Self {
            storage: Appender::behind(file, continuation.at_byte),
            record: Vec::new(),
            payload: Vec::new(),
            last_index: continuation.last_index,
            columns: continuation.columns,
            bytes: continuation.at_byte,
            failed: false,
        };
        // Its columns may never have been: a process that is killed has no time for it.
        writer.sync()?;
        Ok(writer)
    }
}

impl JournalWriter {
    /// Sets room aside for so many columns more, so that it cannot end for want of it. What is not
    /// needed is given back by [`JournalWriter::finish`].
    ///
    /// # Errors
    /// [`WriteError::Io`] when there is not so much; the journal is as it was.
    pub fn reserve(&mut self, columns: u32, samples: u32) -> Result<(), WriteError> {
        let rest = most_bytes(columns, samples).saturating_sub(HEADER_ROOM_BYTES);
        Ok(self.storage.file().reserve(self.bytes + rest)?)
    }
}

/// What a header takes at most in a service's journals.
const HEADER_ROOM_BYTES: u64 = 64 << 10;

/// Most bytes of a journal with so many columns of so many samples.
#[must_use]
pub fn most_bytes(columns: u32, samples: u32) -> u64 {
    let framing = (RECORD_HEAD_BYTES + size_of::<u32>()) as u64;
    let column = COLUMN_HEAD_BYTES as u64 + u64::from(samples) * SAMPLE_BYTES as u64;
    let end = (END_HEAD_BYTES + MAX_REASON_BYTES) as u64;
    HEADER_ROOM_BYTES + u64::from(columns) * (framing + column) + framing + end
}

impl<S: Storage> JournalWriter<S> {
    /// Writes and syncs the header.
    ///
    /// # Errors
    /// [`WriteError::HeaderTooLarge`] and [`WriteError::Io`].
    pub fn new(storage: S, header: &Header) -> Result<Self, WriteError> {
        let payload = header.encode();
        if payload.len() > MAX_HEADER_BYTES {
            return Err(WriteError::HeaderTooLarge {
                bytes: payload.len(),
            });
        }
        let mut writer = Self {
            storage,
            record: Vec::new(),
            payload,
            last_index: None,
            columns: 0,
            bytes: PREAMBLE_BYTES as u64,
            failed: false,
        };
        let [low, high] = header.version().to_le_bytes();
        writer.storage.write_all(&MAGIC)?;
        writer.storage.write_all(&[low, high, 0, 0])?;
        writer.write_record(KIND_HEADER)?;
        writer.sync()?;
        Ok(writer)
    }

    /// Adds a column. It is safe once [`Self::sync`] has returned after this.
    ///
    /// # Errors
    /// [`WriteError::ColumnTooLarge`] and [`WriteError::OutOfOrder`] leave the journal as
    /// it was; after [`WriteError::Io`] it takes no more columns.
    pub fn append(&mut self, column: &RawColumn) -> Result<(), WriteError> {
        if column.samples.len() > MAX_SAMPLES {
            return Err(WriteError::ColumnTooLarge {
                index: column.index,
                samples: column.samples.len(),
            });
        }
        if let Some(last) = self.last_index.filter(|&last| column.index <= last) {
            return Err(WriteError::OutOfOrder {
                index: column.index,
                last,
            });
        }
        self.payload.clear();
        column.encode(&mut self.payload);
        self.write_record(KIND_COLUMN)?;
        self.last_index = Some(column.index);
        self.columns += 1;
        Ok(())
    }

    /// Returns once all columns appended so far would survive a power failure.
    ///
    /// # Errors
    /// [`WriteError::Io`]; which columns are safe is then unknown, and no more are taken.
    pub fn sync(&mut self) -> Result<(), WriteError> {
        if self.failed {
            return Err(WriteError::Failed);
        }
        // A sync that failed once may report success the next time without having
        // written the lost pages, so there is no second try.
        self.storage
            .sync_data()
            .inspect_err(|_| self.failed = true)?;
        Ok(())
    }

    /// Writes the end record, syncs, and gives the storage back.
    ///
    /// # Errors
    /// [`WriteError::Io`]; the columns synced before are safe all the same.
    pub fn finish(mut self, cause: &EndCause) -> Result<S, WriteError> {
        let (code, reason) = match cause {
            EndCause::Complete => (0, ""),
            EndCause::Aborted(reason) => (1, reason.as_str()),
            EndCause::Fault(reason) => (2, reason.as_str()),
        };
        let mut cut = MAX_REASON_BYTES.min(reason.len());
        while !reason.is_char_boundary(cut) {
            cut -= 1;
        }
        self.payload.clear();
        self.payload.push(code);
        self.payload.extend_from_slice(&self.columns.to_le_bytes());
        self.payload.extend_from_slice(&reason.as_bytes()[..cut]);
        let written = self.write_record(KIND_END);
        // Also of a journal that could not be written to its end, which gets no longer.
        let released = self.storage.release();
        written?;
        released?;
        self.sync()?;
        Ok(self.storage)
    }

    /// Columns in it.
    #[must_use]
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Its size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// One `write` for a record, so that a full disk tears one record and not two.
    fn write_record(&mut self, kind: u8) -> Result<(), WriteError> {
        if self.failed {
            return Err(WriteError::Failed);
        }
        let head = record_head(kind, self.payload.len());
        self.record.clear();
        self.record.extend_from_slice(&head);
        self.record.extend_from_slice(&self.payload);
        self.record
            .extend_from_slice(&checksum(&head, &self.payload).to_le_bytes());
        self.storage
            .write_all(&self.record)
            .inspect_err(|_| self.failed = true)?;
        self.bytes += self.record.len() as u64;
        Ok(())
    }
}
