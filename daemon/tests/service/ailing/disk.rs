//! A disk that refuses when told to.

use std::io;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex};

use rustix::io::Errno;
use storage::{Deed, Disk as _, Hindrance, LocalDisk};

/// What the disk refuses.
#[derive(Debug, Clone, Copy, Default)]
struct Ailment {
    error: Option<Errno>,
    /// Only for files whose names end so.
    ending: &'static str,
    /// Files can be made and opened all the same, as on a full disk.
    only_writes: bool,
    free_bytes: Option<u64>,
    /// It falls ill with this once a result gets its name in the spool.
    from_result_on: Option<(&'static str, Errno)>,
    /// How often it has refused something.
    refusals: u32,
    /// It does not say what is free until it is healed.
    hangs: bool,
    /// How many wait for it to say so.
    waiting: u32,
    /// How often it was asked.
    looks: u32,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Ailing(Arc<Mutex<Ailment>>, Arc<Condvar>);

impl Ailing {
    /// From now on writing to files whose names end so is refused.
    pub(crate) fn refuse(&self, ending: &'static str, error: Errno) {
        let mut ailment = self.0.lock().unwrap();
        ailment.error = Some(error);
        ailment.ending = ending;
    }

    /// The same from the moment on in which the next result gets its name in the spool.
    pub(crate) fn refuse_from_result_on(&self, ending: &'static str, error: Errno) {
        self.0.lock().unwrap().from_result_on = Some((ending, error));
    }

    /// From now on such files can be made, but nothing is written to them.
    pub(crate) fn refuse_writes(&self, ending: &'static str, error: Errno) {
        self.refuse(ending, error);
        self.0.lock().unwrap().only_writes = true;
    }

    /// From now on so much is free.
    pub(crate) fn has_free(&self, bytes: u64) {
        self.0.lock().unwrap().free_bytes = Some(bytes);
    }

    /// How often it was asked what is free.
    pub(crate) fn looks(&self) -> u32 {
        self.0.lock().unwrap().looks
    }

    /// Waits until something was refused.
    pub(crate) async fn has_refused(&self) {
        while self.0.lock().unwrap().refusals == 0 {
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
        }
    }

    /// From now on nobody is told what is free. Returns once somebody waits to be told.
    pub(crate) async fn hang(&self) {
        self.0.lock().unwrap().hangs = true;
        while self.0.lock().unwrap().waiting == 0 {
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
        }
    }

    /// All is well again.
    pub(crate) fn heal(&self) {
        *self.0.lock().unwrap() = Ailment::default();
        self.1.notify_all();
    }
}

impl Hindrance for Ailing {
    fn before(&self, deed: Deed, path: &Path) -> io::Result<()> {
        let mut ailment = self.0.lock().unwrap();
        let in_spool = path
            .parent()
            .is_some_and(|folder| folder.ends_with("spool"));
        if deed == Deed::Rename
            && in_spool
            && let Some((ending, error)) = ailment.from_result_on.take()
        {
            (ailment.ending, ailment.error) = (ending, Some(error));
        }
        match ailment.error {
            Some(error)
                if deed != Deed::Remove
                    && !(deed == Deed::Open && ailment.only_writes)
                    && path.to_string_lossy().ends_with(ailment.ending) =>
            {
                ailment.refusals += 1;
                Err(error.into())
            }
            _ => Ok(()),
        }
    }

    fn free_bytes(&self, path: &Path) -> io::Result<Option<u64>> {
        let mut ailment = self.0.lock().unwrap();
        ailment.waiting += 1;
        let mut ailment = self.1.wait_while(ailment, |ailment| ailment.hangs).unwrap();
        ailment.waiting = ailment.waiting.saturating_sub(1);
        ailment.looks += 1;
        let free = ailment.free_bytes;
        drop(ailment);
        free.map_or_else(|| LocalDisk.free_bytes(path), |free| Ok(Some(free)))
    }
}
