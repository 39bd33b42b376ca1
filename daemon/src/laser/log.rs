//! The log on disk: one JSON object a line, only ever appended to.

use std::collections::VecDeque;
use std::fs::{self, File, Permissions};
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use relief_api::LaserEntry;
use serde::{Deserialize, Serialize};
use storage::{Disk, DiskFile};

use super::MOST_SHOWN;

/// How much of the file's end is read at the start: more than the entries that are shown take.
const TAIL_BYTES: u64 = 512 * 1024;
/// For the service's user to write, and for its group to read.
const FILE_MODE: u32 = 0o640;
/// Lines that a disk refuses are kept up to this size: those of some hundred scans.
const MOST_REFUSED_BYTES: usize = 64 * 1024;

/// Version of the lines. Those of version 1 do not say so, and may lack the scanner's name. A
/// change that an older reader would misread makes a new one.
const VERSION: u32 = 2;

/// A line as it is written.
#[derive(Serialize)]
struct Written<'a> {
    version: u32,
    #[serde(flatten)]
    entry: &'a LaserEntry,
}

/// As much of a line as every version has.
#[derive(Deserialize)]
struct Versioned {
    #[serde(default = "unsaid")]
    version: u32,
}

fn unsaid() -> u32 {
    1
}

/// The log's file.
#[derive(Debug)]
pub(super) struct Log {
    path: PathBuf,
    file: Box<dyn DiskFile>,
    /// Bytes up to the end of the last whole line.
    whole_bytes: u64,
    /// Lines that the disk did not take.
    refused: Vec<u8>,
}

impl Log {
    /// Opens the log, making it if there is none; also gives its latest entries.
    pub(super) fn open(disk: &dyn Disk, path: &Path) -> io::Result<(Self, VecDeque<LaserEntry>)> {
        let is_new = !path.exists();
        let file = disk.open(path)?;
        if is_new {
            fs::set_permissions(path, Permissions::from_mode(FILE_MODE))?;
        }
        if let Some(folder) = path.parent() {
            disk.sync_dir(folder)?;
        }
        let (entries, whole_bytes) = read_tail(path)?;
        let log = Self {
            path: path.to_owned(),
            file,
            whole_bytes,
            refused: Vec::new(),
        };
        Ok((log, entries))
    }

    /// Appends an entry, which is on disk when this returns. One that the disk refuses is
    /// appended with the next.
    pub(super) fn append(&mut self, entry: &LaserEntry) -> io::Result<()> {
        let version = VERSION;
        let mut line = serde_json::to_vec(&Written { version, entry })?;
        line.push(b'\n');
        let appended = self.append_behind_refused(&line);
        if appended.is_err() && self.refused.len() + line.len() <= MOST_REFUSED_BYTES {
            self.refused.extend(line);
        }
        appended
    }

    fn append_behind_refused(&mut self, line: &[u8]) -> io::Result<()> {
        let bytes = fs::metadata(&self.path)?.len();
        // What a crash or the disk cut short is ended, or this would be lost with it.
        let end: &[u8] = if bytes == self.whole_bytes {
            b""
        } else {
            b"\n"
        };
        // In one piece, so that no line is ever mixed with another.
        let text = [end, &self.refused, line].concat();
        self.file.write_at(&text, bytes)?;
        self.file.sync_data()?;
        self.whole_bytes = bytes + text.len() as u64;
        self.refused.clear();
        Ok(())
    }
}

/// The last entries of the log, and the bytes up to the end of its last whole line. A line that
/// was cut short is passed over, as is one of a later version, whose meaning is not known; one that
/// was written again, since the disk had not said that it was safe, counts once.
fn read_tail(path: &Path) -> io::Result<(VecDeque<LaserEntry>, u64)> {
    let mut file = File::open(path)?;
    let bytes = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(bytes.saturating_sub(TAIL_BYTES)))?;
    let mut tail = Vec::new();
    file.take(TAIL_BYTES).read_to_end(&mut tail)?;
    let cut_short = tail.iter().rev().take_while(|&&byte| byte != b'\n').count();
    let mut entries: Vec<LaserEntry> = Vec::new();
    let mut later = Vec::new();
    for line in tail.split(|&byte| byte == b'\n') {
        // Before the rest, which a later version may write in words of its own.
        match serde_json::from_slice(line) {
            Ok(Versioned { version }) if version > VERSION => later.push(version),
            _ => entries.extend(serde_json::from_slice::<LaserEntry>(line).ok()),
        }
    }
    if let Some(version) = later.last() {
        tracing::warn!(
            log = %path.display(),
            lines = later.len(),
            version,
            "lines of the laser's log are of a later version of Relief, and are not shown"
        );
    }
    entries.dedup();
    entries.drain(..entries.len().saturating_sub(MOST_SHOWN));
    Ok((entries.into(), bytes - cut_short as u64))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use relief_api::LaserState;
    use storage::LocalDisk;

    use super::*;

    /// Writes half of what it is given, and then finds the disk full, while it is told so.
    #[derive(Debug)]
    struct Halving(Box<dyn DiskFile>, Arc<AtomicBool>);

    impl DiskFile for Halving {
        fn write_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
            if self.1.load(Ordering::Relaxed) {
                self.0.write_at(&bytes[..bytes.len() / 2], offset)?;
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.0.write_at(bytes, offset)
        }

        fn set_len(&self, bytes: u64) -> io::Result<()> {
            self.0.set_len(bytes)
        }

        fn reserve(&self, bytes: u64) -> io::Result<()> {
            self.0.reserve(bytes)
        }

        fn sync_data(&self) -> io::Result<()> {
            self.0.sync_data()
        }
    }

    fn entry(number: u32) -> LaserEntry {
        LaserEntry {
            at: number.to_string(),
            laser: LaserState::On,
            scanner: "left".into(),
            cause: "c".into(),
            scan: None,
        }
    }

    fn golden(state: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/golden")
            .join(state)
            .join("laser.jsonl")
    }

    #[test]
    fn lines_of_each_version_open_and_are_written_as_the_newest() {
        let folder = tempfile::tempdir().unwrap();
        let (old, new) = (folder.path().join("old"), folder.path().join("new"));
        fs::copy(golden("state-1"), &old).unwrap();
        let (mut log, entries) = Log::open(&LocalDisk, &old).unwrap();
        assert_eq!(entries.len(), 5);
        let (mut copy, none) = Log::open(&LocalDisk, &new).unwrap();
        assert!(none.is_empty());
        for entry in &entries {
            copy.append(entry).unwrap();
        }
        let newest = fs::read(golden("state-2")).unwrap();
        assert_eq!(fs::read(&new).unwrap(), newest);
        assert_eq!(Log::open(&LocalDisk, &new).unwrap().1, entries);
        // Lines of both in one file.
        log.append(&entry(1)).unwrap();
        let grown = Log::open(&LocalDisk, &old).unwrap().1;
        assert_eq!(grown.len(), 6);
        assert_eq!(grown[5], entry(1));
    }

    #[test]
    fn a_line_of_a_later_version_is_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("laser.jsonl");
        let later = r#"{"version":3,"at":"1","laser":"on","cause":"c","scanner":"s"}"#;
        fs::write(&path, format!("{later}\n")).unwrap();
        let (mut log, entries) = Log::open(&LocalDisk, &path).unwrap();
        assert!(entries.is_empty(), "{entries:?}");
        log.append(&entry(2)).unwrap();
        assert!(fs::read_to_string(&path).unwrap().starts_with(later));
        assert_eq!(Log::open(&LocalDisk, &path).unwrap().1, [entry(2)]);
    }

    #[test]
    fn what_a_full_disk_refused_or_cut_short_is_written_with_the_next_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("laser.jsonl");
        let (mut log, _) = Log::open(&LocalDisk, &path).unwrap();
        let is_full = Arc::new(AtomicBool::new(false));
        log.file = Box::new(Halving(log.file, Arc::clone(&is_full)));
        log.append(&entry(0)).unwrap();
        is_full.store(true, Ordering::Relaxed);
        log.append(&entry(1)).unwrap_err();
        log.append(&entry(2)).unwrap_err();
        is_full.store(false, Ordering::Relaxed);
        log.append(&entry(3)).unwrap();
        log.append(&entry(4)).unwrap();
        let (_, entries) = Log::open(&LocalDisk, &path).unwrap();
        assert_eq!(entries, (0..5).map(entry).collect::<Vec<_>>());
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains("\n\n"), "{text}");
    }
}
