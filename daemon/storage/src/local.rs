//! The file system of this machine.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use rustix::fs::{FallocateFlags, fallocate, statvfs};

use crate::{Disk, DiskFile};

/// The file system of this machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct LocalDisk;

impl Disk for LocalDisk {
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        Ok(Box::new(file))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        let file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        Ok(Box::new(file))
    }

    fn create_dir(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir_all(path)
    }

    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }

    fn free_bytes(&self, path: &Path) -> io::Result<Option<u64>> {
        let disk = statvfs(path)?;
        // One without any blocks does not count them.
        let counted = disk.f_blocks > 0;
        Ok(counted.then(|| disk.f_bavail.saturating_mul(disk.f_frsize)))
    }
}

impl DiskFile for File {
    fn write_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        self.write_all_at(bytes, offset)
    }

    fn set_len(&self, bytes: u64) -> io::Result<()> {
        File::set_len(self, bytes)
    }

    fn reserve(&self, bytes: u64) -> io::Result<()> {
        match fallocate(self, FallocateFlags::KEEP_SIZE, 0, bytes) {
            // A file system that cannot set room aside; writing will show.
            Err(rustix::io::Errno::OPNOTSUPP | rustix::io::Errno::NOSYS) => Ok(()),
            other => Ok(other?),
        }
    }

    fn sync_data(&self) -> io::Result<()> {
        File::sync_data(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::create_dir_all;

    #[test]
    fn room_that_is_set_aside_does_not_show_in_the_length() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b/file");
        let parent = path.parent().unwrap();
        create_dir_all(&LocalDisk, parent).unwrap();
        create_dir_all(&LocalDisk, parent).unwrap();
        let file = LocalDisk.create(&path).unwrap();
        file.reserve(1 << 20).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().len(), 0);
        file.write_at(b"abc", 2).unwrap();
        file.sync_data().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"\0\0abc");
        file.set_len(3).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"\0\0a");
        let error = LocalDisk.create(&path).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        LocalDisk.open(&path).unwrap().write_at(b"x", 0).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"x\0a");
        assert_ne!(LocalDisk.free_bytes(parent).unwrap(), Some(0));
        // More than any disk has.
        assert!(file.reserve(1 << 60).is_err());
    }
}
