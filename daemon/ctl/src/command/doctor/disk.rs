//! The folders in which scans and results are kept.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::fs::{Access, access, statvfs};
use rustix::io::Errno;

use super::finding::Finding;

/// Less than this beside the reserve is not enough for a day's scans.
const LOW_BYTES: u64 = 2 << 30;

/// Whether a folder is there, writable and has room beside what the service keeps free.
pub(super) fn check(
    what: &'static str,
    setting: &str,
    folder: &Path,
    reserve_bytes: u64,
) -> Finding {
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
    if let Err(error) = access(folder, Access::READ_OK | Access::WRITE_OK | Access::EXEC_OK) {
        let owner = folder.metadata().map(|metadata| metadata.uid()).ok();
        let is_own = owner == Some(rustix::process::geteuid().as_raw());
        return not_writable(what, setting, folder, error, is_own);
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
    if free < reserve_bytes {
        let reserve = reserve_bytes as f64 * 1e-9;
        let found = format!(
            "{found}, less than the {reserve:.1} GB that are to stay free \
             (storage.reserve_mb): scans are refused"
        );
        Finding::bad(what, found, remedy)
    } else if free < reserve_bytes.saturating_add(LOW_BYTES) {
        Finding::doubtful(what, found, remedy)
    } else {
        Finding::good(what, found)
    }
}

/// Where the package runs the service, only its own user may write: that is no trouble.
fn not_writable(
    what: &'static str,
    setting: &str,
    folder: &Path,
    error: Errno,
    is_own: bool,
) -> Finding {
    let shown = folder.display();
    if error == Errno::ROFS {
        return Finding::bad(
            what,
            format!("{shown} is on a file system that is mounted read-only"),
            "mount it writable; dmesg tells whether the disk has errors",
        );
    }
    let found = format!("{shown} may not be written by this user");
    if is_own {
        let remedy =
            format!("let its owner write there (chmod u+rwx {shown}), or change {setting}");
        return Finding::bad(what, found, remedy);
    }
    Finding::doubtful(
        what,
        found,
        format!(
            "nothing, if the service runs as another user: `sudo -u relief relief doctor` looks \
             as the package's; if it is to run as this one, chown it, or change {setting}"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::super::finding::Grade;
    use super::*;

    #[test]
    fn a_missing_folder_is_trouble_and_the_remedy_names_its_setting() {
        let folder = tempfile::tempdir().unwrap();
        let missing = check("spool", "service.spool_dir", &folder.path().join("none"), 0);
        assert_eq!(missing.grade, Grade::Bad);
        assert!(missing.remedy.unwrap().contains("service.spool_dir"));
        let there = check("spool", "service.spool_dir", folder.path(), 0);
        assert!(there.found.contains("GB free"), "{}", there.found);
        assert_ne!(there.grade, Grade::Bad);
    }

    #[test]
    fn less_than_the_reserve_is_trouble() {
        let folder = tempfile::tempdir().unwrap();
        let full = check("spool", "service.spool_dir", folder.path(), u64::MAX);
        assert_eq!(full.grade, Grade::Bad);
        assert!(full.found.contains("storage.reserve_mb"), "{}", full.found);
    }

    #[test]
    fn a_folder_of_the_services_user_is_no_trouble() {
        let look = |error, is_own| not_writable("spool", "s", Path::new("/x"), error, is_own);
        let others = look(Errno::ACCESS, false);
        assert_eq!(others.grade, Grade::Doubtful);
        assert!(
            others
                .remedy
                .unwrap()
                .contains("sudo -u relief relief doctor")
        );
        assert_eq!(look(Errno::ACCESS, true).grade, Grade::Bad);
        assert_eq!(look(Errno::ROFS, false).grade, Grade::Bad);
    }
}
