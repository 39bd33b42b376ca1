//! The spool: a result is made beside its place and put there whole by one rename.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use relief_api::{SpoolEntry, SpoolFile};

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
}

impl Spool {
    /// Makes the folder if need be, proves that it can be written, and removes what an
    /// earlier run left unfinished.
    pub(crate) fn open(root: &Path) -> Result<Self, SpoolError> {
        fs::create_dir_all(root).map_err(error("make the folder", root))?;
        // Results are told to clients that may run elsewhere in the tree.
        let root = root
            .canonicalize()
            .map_err(error("find the folder", root))?;
        let spool = Self { root };
        spool.remove_unfinished()?;
        let probe = spool.root.join(format!("{INCOMING}probe"));
        fs::create_dir(&probe)
            .and_then(|()| fs::remove_dir(&probe))
            .map_err(error("write", &spool.root))?;
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

    /// True when the result is there, and thus whole.
    pub(crate) fn has(&self, result: &str) -> bool {
        self.directory(result).is_dir()
    }

    /// A new empty folder for the making of a result.
    pub(crate) fn begin(&self, result: &str) -> Result<PathBuf, SpoolError> {
        let incoming = self.root.join(format!("{INCOMING}{result}"));
        match fs::remove_dir_all(&incoming) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => {
                return Err(error("remove an unfinished result", &self.root)(e));
            }
            _ => {}
        }
        fs::create_dir(&incoming).map_err(error("make a folder", &self.root))?;
        Ok(incoming)
    }

    /// Gives up the making of a result.
    pub(crate) fn discard(&self, result: &str) {
        let incoming = self.root.join(format!("{INCOMING}{result}"));
        if let Err(error) = fs::remove_dir_all(&incoming)
            && error.kind() != io::ErrorKind::NotFound
        {
            tracing::warn!(folder = %incoming.display(), %error, "cannot remove an unfinished result");
        }
    }

    /// Syncs everything in the new folder and puts it in its place. Publishing what is
    /// published already changes nothing.
    pub(crate) fn publish(&self, result: &str) -> Result<PathBuf, SpoolError> {
        let directory = self.directory(result);
        if self.has(result) {
            self.discard(result);
            return Ok(directory);
        }
        let incoming = self.root.join(format!("{INCOMING}{result}"));
        let sync = || -> io::Result<()> {
            for entry in fs::read_dir(&incoming)? {
                File::open(entry?.path())?.sync_all()?;
            }
            File::open(&incoming)?.sync_all()
        };
        sync().map_err(error("sync a result", &self.root))?;
        fs::rename(&incoming, &directory).map_err(error("put a result in place", &self.root))?;
        File::open(&self.root)
            .and_then(|folder| folder.sync_all())
            .map_err(error("sync the folder", &self.root))?;
        Ok(directory)
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
        }))
    }

    /// Path of a file of a result. `None` for names that are not plain, and for what is
    /// not a regular file of the spool itself: a symbolic link could lead anywhere.
    pub(crate) fn file(&self, result: &str, file: &str) -> Option<PathBuf> {
        if !is_plain_name(result) || !is_plain_name(file) {
            return None;
        }
        let path = self.directory(result).join(file);
        let is_own = |path: &Path, want_file: bool| {
            path.symlink_metadata()
                .is_ok_and(|m| if want_file { m.is_file() } else { m.is_dir() })
        };
        (is_own(&self.directory(result), false) && is_own(&path, true)).then_some(path)
    }

    fn remove_unfinished(&self) -> Result<(), SpoolError> {
        for entry in fs::read_dir(&self.root).map_err(error("list the folder", &self.root))? {
            let entry = entry.map_err(error("list the folder", &self.root))?;
            if entry.file_name().to_string_lossy().starts_with(INCOMING) {
                fs::remove_dir_all(entry.path())
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

    #[test]
    fn a_result_appears_whole_and_once() {
        let folder = tempfile::tempdir().unwrap();
        let spool = Spool::open(folder.path()).unwrap();
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
        let spool = Spool::open(folder.path()).unwrap();
        fs::write(spool.begin("b").unwrap().join("half"), "").unwrap();
        Spool::open(folder.path()).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn names_cannot_leave_the_spool() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("secret"), "s").unwrap();
        let spool = Spool::open(&folder.path().join("spool")).unwrap();
        fs::write(spool.begin("a").unwrap().join("x"), "").unwrap();
        spool.publish("a").unwrap();
        std::os::unix::fs::symlink(folder.path().join("secret"), spool.directory("a").join("l"))
            .unwrap();
        assert!(spool.file("a", "x").is_some());
        for (result, file) in [
            ("..", "secret"),
            ("a", "../../secret"),
            ("a/..", "x"),
            ("", "x"),
            ("a", ""),
            ("a", "l"),
            (".", "a"),
        ] {
            assert_eq!(spool.file(result, file), None, "{result}/{file}");
        }
        assert!(spool.entry("..").unwrap().is_none());
    }

    #[test]
    fn an_unusable_spool_says_which_and_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "").unwrap();
        let error = Spool::open(&path).unwrap_err();
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
