//! A disk that works, and notes every step and everything the world was told meanwhile.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use storage::{Disk, DiskFile, LocalDisk};

/// Number of a file in the order of opening.
pub(crate) type FileId = usize;

/// What was done, in order.
#[derive(Debug, Clone)]
pub(crate) enum Step {
    /// The file was opened, or made where there was none.
    Open {
        path: PathBuf,
        file: FileId,
    },
    Write {
        file: FileId,
        offset: u64,
        bytes: Vec<u8>,
    },
    SetLen {
        file: FileId,
        bytes: u64,
    },
    SyncFile {
        file: FileId,
    },
    CreateDir {
        path: PathBuf,
    },
    Rename {
        from: PathBuf,
        to: PathBuf,
    },
    Remove {
        path: PathBuf,
    },
    SyncDir {
        path: PathBuf,
    },
    /// Nothing of the disk's: what somebody outside may rely on from here on.
    Told(Told),
}

/// What somebody outside may rely on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Told {
    /// The scan was accepted.
    Accepted(String),
    /// The scanner may forget this column.
    Acknowledged(u32),
    /// All columns are kept.
    Complete(String),
    /// The rerun was accepted.
    Queued(u64),
    /// The result is in the spool.
    Published(String),
    /// From here on the result may go.
    Retired(String),
}

/// The disk, and its notes.
#[derive(Debug, Default, Clone)]
pub(crate) struct Recorder {
    notes: Arc<Mutex<Notes>>,
}

#[derive(Debug, Default)]
struct Notes {
    steps: Vec<Step>,
    files: FileId,
}

impl Recorder {
    pub(crate) fn tell(&self, told: Told) {
        self.notes.lock().unwrap().steps.push(Step::Told(told));
    }

    pub(crate) fn steps(&self) -> Vec<Step> {
        self.notes.lock().unwrap().steps.clone()
    }

    /// Does something and notes it, so that the notes have the order of the deeds.
    fn noted<T>(
        &self,
        deed: impl FnOnce() -> io::Result<T>,
        step: impl FnOnce() -> Step,
    ) -> io::Result<T> {
        let mut notes = self.notes.lock().unwrap();
        let done = deed()?;
        notes.steps.push(step());
        Ok(done)
    }

    fn opened(&self, path: &Path, file: Box<dyn DiskFile>) -> Box<dyn DiskFile> {
        let mut notes = self.notes.lock().unwrap();
        let number = notes.files;
        notes.files += 1;
        notes.steps.push(Step::Open {
            path: path.to_owned(),
            file: number,
        });
        Box::new(RecordedFile {
            recorder: self.clone(),
            number,
            file,
        })
    }
}

impl Disk for Recorder {
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        Ok(self.opened(path, LocalDisk.create(path)?))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        Ok(self.opened(path, LocalDisk.open(path)?))
    }

    fn create_dir(&self, path: &Path) -> io::Result<()> {
        let step = || Step::CreateDir {
            path: path.to_owned(),
        };
        self.noted(|| LocalDisk.create_dir(path), step)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let step = || Step::Rename {
            from: from.to_owned(),
            to: to.to_owned(),
        };
        self.noted(|| LocalDisk.rename(from, to), step)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        let step = || Step::Remove {
            path: path.to_owned(),
        };
        self.noted(|| LocalDisk.remove_file(path), step)
    }

    /// One after the other, since the power may fail in between.
    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        for entry in std::fs::read_dir(path)? {
            let entry = entry?;
            if entry.file_type()?.is_dir() {
                self.remove_dir_all(&entry.path())?;
            } else {
                self.remove_file(&entry.path())?;
            }
        }
        let step = || Step::Remove {
            path: path.to_owned(),
        };
        self.noted(|| LocalDisk.remove_dir_all(path), step)
    }

    /// The power fails on paper only, so that nothing need wait for the medium.
    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        let step = || Step::SyncDir {
            path: path.to_owned(),
        };
        self.noted(|| Ok(()), step)
    }

    fn free_bytes(&self, path: &Path) -> io::Result<Option<u64>> {
        LocalDisk.free_bytes(path)
    }
}

#[derive(Debug)]
struct RecordedFile {
    recorder: Recorder,
    number: FileId,
    file: Box<dyn DiskFile>,
}

impl DiskFile for RecordedFile {
    fn write_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        let step = || Step::Write {
            file: self.number,
            offset,
            bytes: bytes.to_vec(),
        };
        self.recorder
            .noted(|| self.file.write_at(bytes, offset), step)
    }

    fn set_len(&self, bytes: u64) -> io::Result<()> {
        let step = || Step::SetLen {
            file: self.number,
            bytes,
        };
        self.recorder.noted(|| self.file.set_len(bytes), step)
    }

    fn reserve(&self, bytes: u64) -> io::Result<()> {
        self.file.reserve(bytes)
    }

    fn sync_data(&self) -> io::Result<()> {
        let step = || Step::SyncFile { file: self.number };
        self.recorder.noted(|| Ok(()), step)
    }
}
