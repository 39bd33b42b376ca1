//! The seam between the service and its disk.
//!
//! Everything that must survive a power failure goes through [`Disk`]: journals, records,
//! results. [`LocalDisk`] is the file system as it is. Tests put others in its place, which
//! note every step, forget what was never synced, or refuse ([`HinderedDisk`]).
//!
//! # What is assumed of a file system
//!
//! - What was written to a file is safe once [`DiskFile::sync_data`] has returned for it, and
//!   not before: until then any part of any write may be on the medium, in any order, the last
//!   one torn.
//! - A name made, renamed or removed in a folder is safe once [`Disk::sync_dir`] has returned
//!   for that folder. Until then the changes of one folder reach the medium in their order, but
//!   any number of the last may be missing; syncing a file says nothing about its name.
//! - A rename within a folder is there or not, never half.
//!
//! Reading needs no seam: what can be read back is what was written.

mod appender;
mod hindered;
mod local;

use std::fmt::Debug;
use std::io;
use std::path::Path;

pub use appender::Appender;
pub use hindered::{Deed, HinderedDisk, Hindrance};
pub use local::LocalDisk;

/// What the service asks of the place where it keeps things.
///
/// # Errors
/// Every method reports what the system says.
pub trait Disk: Debug + Send + Sync + 'static {
    /// Makes a file, which must not exist yet, for writing.
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>>;

    /// Opens a file for writing where one is, or else makes it.
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskFile>>;

    /// Makes a folder, which must not exist yet, in one that does.
    fn create_dir(&self, path: &Path) -> io::Result<()>;

    /// Gives a file or folder another name in the same folder; what was a file of that name
    /// goes.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;

    /// Removes a folder and all that is in it.
    fn remove_dir_all(&self, path: &Path) -> io::Result<()>;

    /// Returns once the names in a folder would survive a power failure.
    fn sync_dir(&self, path: &Path) -> io::Result<()>;

    /// Bytes that may still be written to the file system of this path; `None` where it does
    /// not tell, as one in memory may not.
    fn free_bytes(&self, path: &Path) -> io::Result<Option<u64>>;
}

/// A file that is written.
///
/// # Errors
/// Every method reports what the system says.
pub trait DiskFile: Debug + Send + Sync {
    /// Writes all bytes from `offset` on.
    fn write_at(&self, bytes: &[u8], offset: u64) -> io::Result<()>;

    /// Cuts the file to a length in bytes, or fills it up with zeros.
    fn set_len(&self, bytes: u64) -> io::Result<()>;

    /// Sets room aside for the first `bytes` of the file without changing its length, so
    /// that writing there cannot fail for want of it.
    fn reserve(&self, bytes: u64) -> io::Result<()>;

    /// Returns once everything written so far would survive a power failure.
    fn sync_data(&self) -> io::Result<()>;
}

/// Makes a folder and those above it that are missing, so that they survive a power failure.
///
/// # Errors
/// What the disk reports.
pub fn create_dir_all(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => {
            create_dir_all(disk, parent)?;
            parent
        }
        _ => Path::new("."),
    };
    match disk.create_dir(path) {
        // Somebody else was quicker.
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => {}
        other => other?,
    }
    disk.sync_dir(parent)
}

/// Removes a file; that there is none is just as well.
///
/// # Errors
/// What the disk reports, but for a missing file.
pub fn remove_file_if_there(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    match disk.remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Removes a folder with all that is in it; that there is none is just as well.
///
/// # Errors
/// What the disk reports, but for a missing folder.
pub fn remove_dir_if_there(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    match disk.remove_dir_all(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
