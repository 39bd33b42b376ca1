//! The folders in which scans and results are kept.

use std::path::Path;

use rustix::fs::{Access, access, statvfs};

use super::finding::Finding;

/// Less than this is not enough for a day's scans.
const LOW_BYTES: u64 = 2 << 30;
/// Less than this is not enough for one large scan.
const FULL_BYTES: u64 = 100 << 20;

/// Whether a folder is there, writable and has room.
pub(super) fn check(what: &'static str, setting: &str, folder: &Path) -> Finding {
    let shown = folder.display();
    if !folder.is_dir() {
        return Finding::bad(
            what,
            format!("there is no folder {shown}"),
            format!(
                "make it for the service's user (install -d -o relief {shown}), or change {setting}"
            ),
        );
    }
    if access(folder, Access::READ_OK | Access::WRITE_OK | Access::EXEC_OK).is_err() {
        return Finding::bad(
            what,
            format!("{shown} may not be written by this user"),
            format!(
                "if the service runs as this user: chown it, or change {setting}; else run doctor as the service's user"
            ),
        );
    }
    let free = match statvfs(folder) {
        Ok(disk) => disk.f_bavail.saturating_mul(disk.f_frsize),
        Err(error) => {
            return Finding::doubtful(
                what,
                format!("the free space of {shown} is not known: {error}"),
                "look at it with df",
            );
        }
    };
    let found = format!("{shown} is writable, {:.1} GB free", free as f64 * 1e-9);
    let remedy = "remove results and scans that are no longer needed, or move to a larger disk";
    if free < FULL_BYTES {
        Finding::bad(what, found, remedy)
    } else if free < LOW_BYTES {
        Finding::doubtful(what, found, remedy)
    } else {
        Finding::good(what, found)
    }
}

#[cfg(test)]
mod tests {
    use super::super::finding::Grade;
    use super::*;

    #[test]
    fn a_missing_folder_is_trouble_and_the_remedy_names_its_setting() {
        let folder = tempfile::tempdir().unwrap();
        let missing = check("spool", "service.spool_dir", &folder.path().join("none"));
        assert_eq!(missing.grade, Grade::Bad);
        assert!(missing.remedy.unwrap().contains("service.spool_dir"));
        let there = check("spool", "service.spool_dir", folder.path());
        assert!(there.found.contains("GB free"), "{}", there.found);
    }
}
