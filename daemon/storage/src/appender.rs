//! Writing a file from its beginning to its end.

use std::io::{self, Write};

use crate::DiskFile;

/// Writes one piece behind the other.
///
/// Nothing is buffered: a `write` is one [`DiskFile::write_at`], so that a failure leaves at
/// most one piece torn.
#[derive(Debug)]
pub struct Appender {
    file: Box<dyn DiskFile>,
    at_byte: u64,
}

impl Appender {
    /// Writes to a file that is still empty.
    #[must_use]
    pub fn new(file: Box<dyn DiskFile>) -> Self {
        Self { file, at_byte: 0 }
    }

    /// Goes on with a file of so many bytes.
    #[must_use]
    pub fn behind(file: Box<dyn DiskFile>, bytes: u64) -> Self {
        Self {
            file,
            at_byte: bytes,
        }
    }

    /// The file.
    #[must_use]
    pub fn file(&self) -> &dyn DiskFile {
        &*self.file
    }

    /// Bytes written so far, those that were there before included.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.at_byte
    }

    /// Returns once everything written so far would survive a power failure.
    ///
    /// # Errors
    /// What the disk reports.
    pub fn sync_data(&self) -> io::Result<()> {
        self.file.sync_data()
    }
}

impl Write for Appender {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write_at(bytes, self.at_byte)?;
        self.at_byte += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
