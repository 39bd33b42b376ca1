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
        // One at a time: a folder without its lock is then one that was left.
        let gate = File::open(all)?;
        gate.lock()?;
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
            lock.lock()?;
            return Ok(Self { path, _lock: lock });
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        remove(&self.path);
    }
}

fn remove_if_left(folder: &Path) {
    let is_left = match File::open(folder.join(LOCK)) {
        Ok(lock) => lock.try_lock().is_ok(),
        // Its worker was killed before it had one.
        Err(error) => error.kind() == io::ErrorKind::NotFound,
    };
    if is_left {
        remove(folder);
    }
}

/// Its own worker and another one may be at it at once.
fn remove(folder: &Path) {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            tracing::warn!(folder = %folder.display(), %error, "cannot remove a worker's folder");
        }
        Ok(()) | Err(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

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

    #[test]
    fn workers_that_start_at_once_take_no_folder_from_each_other() {
        let all = tempfile::tempdir().unwrap();
        let start = Barrier::new(4);
        for _ in 0..100 {
            let made: Vec<_> = std::thread::scope(|scope| {
                let make = || {
                    start.wait();
                    WorkFolder::make(all.path()).unwrap()
                };
                let threads = [(); 4].map(|()| scope.spawn(make));
                threads.map(|thread| thread.join().unwrap()).into()
            });
            for folder in &made {
                assert!(folder.path().join(LOCK).exists());
            }
        }
    }
}
