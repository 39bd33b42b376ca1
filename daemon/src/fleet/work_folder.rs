//! A worker's folder, which goes with the worker: what one has left that was killed is removed by
//! the next one on this machine.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Keeps others from taking a folder for one that was left.
const LOCK: &str = "lock";

/// A folder that no other worker uses.
#[derive(Debug)]
pub(super) struct WorkFolder {
    path: PathBuf,
    _lock: File,
}

impl WorkFolder {
    /// Makes one below `all`, and removes those whose workers are gone.
    pub(super) fn make(all: &Path) -> io::Result<Self> {
        fs::create_dir_all(all)?;
        for entry in fs::read_dir(all)? {
            remove_if_left(&entry?.path());
        }
        for number in 0.. {
            let path = all.join(format!("{}-{number}", std::process::id()));
            match fs::create_dir(&path) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
            let lock = File::create(path.join(LOCK))?;
            // One that has just looked has found no lock, and has removed it.
            if lock.try_lock().is_ok() && path.join(LOCK).exists() {
                return Ok(Self { path, _lock: lock });
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_dir_all(&self.path) {
            tracing::warn!(folder = %self.path.display(), %error, "cannot remove a folder");
        }
    }
}

fn remove_if_left(folder: &Path) {
    let is_left = match File::open(folder.join(LOCK)) {
        Ok(lock) => lock.try_lock().is_ok(),
        // Its worker was killed before it had one, or is just about to make it, and then makes
        // another folder.
        Err(error) => error.kind() == io::ErrorKind::NotFound,
    };
    if is_left && let Err(error) = fs::remove_dir_all(folder) {
        tracing::warn!(folder = %folder.display(), %error, "cannot remove what a worker has left");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_worker_has_left_goes_and_what_others_use_stays() {
        let all = tempfile::tempdir().unwrap();
        let all = all.path();
        let left = all.join("77-0");
        fs::create_dir(&left).unwrap();
        fs::write(left.join(LOCK), "").unwrap();
        fs::write(left.join("journal.scan"), "half").unwrap();
        let first = WorkFolder::make(all).unwrap();
        assert!(!left.exists());
        fs::write(first.path().join("journal.scan"), "mine").unwrap();
        let second = WorkFolder::make(all).unwrap();
        assert_ne!(first.path(), second.path());
        assert!(first.path().join("journal.scan").exists());
        drop(second);
        drop(first);
        assert_eq!(fs::read_dir(all).unwrap().count(), 0);
    }
}
