//! The file system with something in its way: for tests and studies of disks that are slow,
//! full or broken.

use std::io;
use std::path::{Path, PathBuf};

use crate::{Disk, DiskFile, LocalDisk};

/// What is about to be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deed {
    /// A file is made or opened.
    Open,
    /// A folder is made.
    CreateDir,
    /// Something gets this name.
    Rename,
    /// A file or a folder is removed.
    Remove,
    /// A file is written, cut or given room.
    Write,
    /// A file is synced.
    SyncFile,
    /// A folder is synced.
    SyncDir,
}

/// What comes before the deeds of a [`HinderedDisk`].
pub trait Hindrance: std::fmt::Debug + Clone + Send + Sync + 'static {
    /// Called before each deed; may take its time.
    ///
    /// # Errors
    /// Then the deed is refused for this reason, and not done.
    fn before(&self, deed: Deed, path: &Path) -> io::Result<()>;

    /// As [`Disk::free_bytes`].
    ///
    /// # Errors
    /// What the system says.
    fn free_bytes(&self, path: &Path) -> io::Result<Option<u64>> {
        LocalDisk.free_bytes(path)
    }
}

/// The file system of this machine, with a hindrance before each deed.
#[derive(Debug, Clone)]
pub struct HinderedDisk<H>(pub H);

impl<H: Hindrance> HinderedDisk<H> {
    fn file(&self, path: &Path, file: Box<dyn DiskFile>) -> Box<dyn DiskFile> {
        Box::new(HinderedFile {
            hindrance: self.0.clone(),
            path: path.to_owned(),
            file,
        })
    }
}

impl<H: Hindrance> Disk for HinderedDisk<H> {
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        self.0.before(Deed::Open, path)?;
        Ok(self.file(path, LocalDisk.create(path)?))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        self.0.before(Deed::Open, path)?;
        Ok(self.file(path, LocalDisk.open(path)?))
    }

    fn create_dir(&self, path: &Path) -> io::Result<()> {
        self.0.before(Deed::CreateDir, path)?;
        LocalDisk.create_dir(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.0.before(Deed::Rename, to)?;
        LocalDisk.rename(from, to)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.0.before(Deed::Remove, path)?;
        LocalDisk.remove_file(path)
    }

    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        self.0.before(Deed::Remove, path)?;
        LocalDisk.remove_dir_all(path)
    }

    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        self.0.before(Deed::SyncDir, path)?;
        LocalDisk.sync_dir(path)
    }

    fn free_bytes(&self, path: &Path) -> io::Result<Option<u64>> {
        self.0.free_bytes(path)
    }
}

#[derive(Debug)]
struct HinderedFile<H> {
    hindrance: H,
    path: PathBuf,
    file: Box<dyn DiskFile>,
}

impl<H: Hindrance> DiskFile for HinderedFile<H> {
    fn write_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        self.hindrance.before(Deed::Write, &self.path)?;
        self.file.write_at(bytes, offset)
    }

    fn set_len(&self, bytes: u64) -> io::Result<()> {
        self.hindrance.before(Deed::Write, &self.path)?;
        self.file.set_len(bytes)
    }

    fn reserve(&self, bytes: u64) -> io::Result<()> {
        self.hindrance.before(Deed::Write, &self.path)?;
        self.file.reserve(bytes)
    }

    fn sync_data(&self) -> io::Result<()> {
        self.hindrance.before(Deed::SyncFile, &self.path)?;
        self.file.sync_data()
    }
}
