//! The spool: a result is made beside its place and put there whole by one rename.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use relief_api::{SpoolEntry, SpoolFile};
use rustix::fs::{self as fs_at, Mode, OFlags};
use rustix::io::Errno;
use storage::{Disk, create_dir_all, remove_dir_if_there};

/// Begins the name of a folder that is still being filled.
const INCOMING: &str = ".incoming-";

/// Something about the spool does not work.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} in the spool {}: {source}", path.display())]
pub struct SpoolError {
    /// What was tried.
    pub action: &'static str,
    /// Where.
    pub path: PathBuf,
    /// What the system said.
    pub source: io::Error,
}

impl SpoolError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> String {
        match self.source.kind() {
            io::ErrorKind::PermissionDenied => format!(
                "let the user of reliefd write to {} (chown or chmod), or set \
                 service.spool_dir to another folder",
                self.path.display()
            ),
            io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => format!(
                "{} is no folder: move away what is there, or set service.spool_dir to \
                 another folder",
                self.path.display()
            ),
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                "make room on the disk, then retry the job".to_owned()
            }
            io::ErrorKind::ReadOnlyFilesystem => {
                "the file system is mounted read-only: mount it writable, then retry the job"
                    .to_owned()
            }
            _ => "mend the cause, then retry the job".to_owned(),
        }
    }
}

/// The spool folder.
#[derive(Debug, Clone)]
pub(crate) struct Spool {
    root: PathBuf,
    disk: Arc<dyn Disk>,
}

impl Spool {
    /// Makes the folder if need be, proves that it can be written, and removes what an
    /// earlier run left unfinished.
    pub(crate) fn open(disk: Arc<dyn Disk>, root: &Path) -> Result<Self, SpoolError> {
        create_dir_all(&*disk, root).map_err(error("make the folder", root))?;
        // Results are told to clients that may run elsewhere in the tree.
        let root = root
            .canonicalize()
            .map_err(error("find the folder", root))?;
        let spool = Self { root, disk };
        spool.remove_unfinished()?;
        let probe = spool.root.join(format!("{INCOMING}probe"));
        spool
            .disk
            .create_dir(&probe)
            .and_then(|()| spool.disk.remove_dir_all(&probe))
            .map_err(error("write", &spool.root))?;
        // What an earlier run put in place may have its name in memory alone.
        spool.sync_names()?;
        Ok(spool)
    }

    /// The folder.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Where a result is, or will be.
    pub(crate) fn directory(&self, result: &str) -> PathBuf {
        self.root.join(result)
    }

    /// True when the result is there, and thus whole. A symbolic link is none: it could
    /// lead anywhere.
    pub(crate) fn has(&self, result: &str) -> bool {
        let found = self.directory(result).symlink_metadata();
        found.is_ok_and(|metadata| metadata.is_dir())
    }

    /// Where the result is, if it is there, and safe: who put it there may have failed before
    /// its name was on the medium.
    pub(crate) fn published(&self, result: &str) -> Result<Option<PathBuf>, SpoolError> {
        if !self.has(result) {
            return Ok(None);
        }
        self.sync_names()?;
        Ok(Some(self.directory(result)))
    }

    fn sync_names(&self) -> Result<(), SpoolError> {
        self.disk
            .sync_dir(&self.root)
            .map_err(error("sync the folder", &self.root))
    }

    /// A new empty folder for the making of a result.
    pub(crate) fn begin(&self, result: &str) -> Result<PathBuf, SpoolError> {
        let incoming = self.root.join(format!("{INCOMING}{result}"));
        remove_dir_if_there(&*self.disk, &incoming)
            .map_err(error("remove an unfinished result", &self.root))?;
        self.disk
            .create_dir(&incoming)
            .map_err(error("make a folder", &self.root))?;
        Ok(incoming)
    }

    /// Gives up the making of a result.
    pub(crate) fn discard(&self, result: &str) {
        let incoming = self.root.join(format!("{INCOMING}{result}"));
        if let Err(error) = remove_dir_if_there(&*self.disk, &incoming) {
            tracing::warn!(folder = %incoming.display(), %error, "cannot remove an unfinished result");
        }
    }

    /// Puts the new folder, whose files are synced, in its place. Publishing what is
    /// published already changes nothing.
    pub(crate) fn publish(&self, result: &str) -> Result<PathBuf, SpoolError> {
        if let Some(directory) = self.published(result)? {
            self.discard(result);
            return Ok(directory);
        }
        let directory = self.directory(result);
        let incoming = self.root.join(format!("{INCOMING}{result}"));
        self.disk
            .sync_dir(&incoming)
            .map_err(error("sync a result", &self.root))?;
        self.disk
            .rename(&incoming, &directory)
            .map_err(error("put a result in place", &self.root))?;
        self.sync_names()?;
        Ok(directory)
    }

    /// Removes a result. It is gone at once, and never half: its files go only when its name is
    /// gone from the medium.
    pub(crate) fn remove(&self, result: &str) -> Result<(), SpoolError> {
        let gone = self.root.join(format!("{INCOMING}removed-{result}"));
        self.disk
            .rename(&self.directory(result), &gone)
            .and_then(|()| self.disk.sync_dir(&self.root))
            .and_then(|()| self.disk.remove_dir_all(&gone))
            .map_err(error("remove a result", &self.root))
    }

    /// What is in a result's folder; `None` when there is none of that name.
    pub(crate) fn entry(&self, result: &str) -> Result<Option<SpoolEntry>, SpoolError> {
        if !is_plain_name(result) || !self.has(result) {
            return Ok(None);
        }
        let directory = self.directory(result);
        let list = || -> io::Result<Vec<SpoolFile>> {
            let mut files = Vec::new();
            for entry in fs::read_dir(&directory)? {
                let entry = entry?;
                let metadata = entry.metadata()?;
                if metadata.is_file() {
                    files.push(SpoolFile {
                        name: entry.file_name().to_string_lossy().into_owned(),
                        bytes: metadata.len(),
                    });
                }
            }
            files.sort_by(|a, b| a.name.cmp(&b.name));
            Ok(files)
        };
        Ok(Some(SpoolEntry {
            result: result.to_owned(),
            directory: directory.to_string_lossy().into_owned(),
            files: list().map_err(error("list a result", &directory))?,
            acknowledged_at: None,
            acknowledged_by: None,
        }))
    }

    /// A file of a result, for reading. `None` for names that are not plain, and for what
    /// is not a regular file of the spool itself: a symbolic link could lead anywhere.
    pub(crate) fn file(&self, result: &str, file: &str) -> io::Result<Option<File>> {
        if !is_plain_name(result) || !is_plain_name(file) {
            return Ok(None);
        }
        // Step by step from a folder that is held, so that nothing can be put in the way
        // between a check and its use. A pipe must not keep the reader waiting either.
        let opened = || -> rustix::io::Result<File> {
            let here = OFlags::NOFOLLOW | OFlags::CLOEXEC | OFlags::NONBLOCK;
            let root = fs_at::open(
                &self.root,
                OFlags::DIRECTORY | OFlags::CLOEXEC,
                Mode::empty(),
            )?;
            let folder = fs_at::openat(&root, result, here | OFlags::DIRECTORY, Mode::empty())?;
            fs_at::openat(&folder, file, here, Mode::empty()).map(File::from)
        };
        match opened() {
            Ok(file) if file.metadata()?.is_file() => Ok(Some(file)),
            Ok(_) => Ok(None),
            Err(Errno::NOENT | Errno::NOTDIR | Errno::LOOP | Errno::NAMETOOLONG | Errno::NXIO) => {
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    fn remove_unfinished(&self) -> Result<(), SpoolError> {
        for entry in fs::read_dir(&self.root).map_err(error("list the folder", &self.root))? {
            let entry = entry.map_err(error("list the folder", &self.root))?;
            if entry.file_name().to_string_lossy().starts_with(INCOMING) {
                self.disk
                    .remove_dir_all(&entry.path())
                    .map_err(error("remove an unfinished result", &self.root))?;
            }
        }
        Ok(())
    }
}

/// A name that cannot leave its folder and is not hidden.
fn is_plain_name(name: &str) -> bool {
    !name.is_empty()
        && !name.starts_with('.')
        && !name.contains(['/', '\\', '\0'])
        && name.len() <= 255
}

fn error(action: &'static str, path: &Path) -> impl Fn(io::Error) -> SpoolError {
    move |source| SpoolError {
        action,
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use storage::LocalDisk;

    fn open(root: &Path) -> Result<Spool, SpoolError> {
        Spool::open(Arc::new(LocalDisk), root)
    }

    #[test]
    fn a_result_appears_whole_and_once() {
        let folder = tempfile::tempdir().unwrap();
        let spool = open(folder.path()).unwrap();
        let incoming = spool.begin("a").unwrap();
        fs::write(incoming.join("x.igs"), "first").unwrap();
        assert!(!spool.has("a"));
        let directory = spool.publish("a").unwrap();
        assert_eq!(
            fs::read_to_string(directory.join("x.igs")).unwrap(),
            "first"
        );

        let incoming = spool.begin("a").unwrap();
        fs::write(incoming.join("x.igs"), "second").unwrap();
        spool.publish("a").unwrap();
        assert_eq!(
            fs::read_to_string(directory.join("x.igs")).unwrap(),
            "first"
        );
        assert_eq!(fs::read_dir(spool.root()).unwrap().count(), 1);
    }

    #[test]
    fn what_a_crash_left_is_removed_at_the_next_start() {
        let folder = tempfile::tempdir().unwrap();
        let spool = open(folder.path()).unwrap();
        fs::write(spool.begin("b").unwrap().join("half"), "").unwrap();
        open(folder.path()).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn names_cannot_leave_the_spool() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("secret"), "s").unwrap();
        let spool = open(&folder.path().join("spool")).unwrap();
        fs::write(spool.begin("a").unwrap().join("x"), "").unwrap();
        spool.publish("a").unwrap();
        std::os::unix::fs::symlink(folder.path().join("secret"), spool.directory("a").join("l"))
            .unwrap();
        std::os::unix::fs::symlink(folder.path(), spool.directory("out")).unwrap();
        rustix::fs::mkfifoat(rustix::fs::CWD, spool.directory("a").join("p"), Mode::RUSR).unwrap();
        assert!(spool.file("a", "x").unwrap().is_some());
        let long = "x".repeat(300);
        for (result, file) in [
            ("..", "secret"),
            ("a", "../../secret"),
            ("a/..", "x"),
            ("", "x"),
            ("a", ""),
            ("a", "l"),
            (".", "a"),
            ("a", "p"),
            ("a", "."),
            ("out", "secret"),
            ("a", "x\0"),
            ("a", &long),
            ("a", "absent"),
            ("absent", "x"),
        ] {
            let found = spool.file(result, file).unwrap();
            assert!(found.is_none(), "{result}/{file}");
        }
        for result in ["..", ".", "out", "a/..", ""] {
            assert!(spool.entry(result).unwrap().is_none(), "{result}");
        }
        let listed = spool.entry("a").unwrap().unwrap();
        let names: Vec<&str> = listed.files.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["x"], "neither link nor pipe");
    }

    #[test]
    fn an_unusable_spool_says_which_and_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "").unwrap();
        let error = open(&path).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "cannot make the folder in the spool {}: File exists (os error 17)",
                path.display()
            )
        );
        let denied = SpoolError {
            action: "write",
            path: "/srv/spool".into(),
            source: io::ErrorKind::PermissionDenied.into(),
        };
        assert!(denied.hint().contains("chown"), "{}", denied.hint());
    }
}
