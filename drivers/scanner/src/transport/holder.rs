//! Who holds a port, as far as this user may see.

use std::fs;
use std::path::Path;

/// Name and process id of a program that has the file open, such as
/// `ModemManager (process 812)`.
pub(super) fn holder(port: &Path) -> Option<String> {
    let port = fs::canonicalize(port).ok()?;
    fs::read_dir("/proc").ok()?.flatten().find_map(|process| {
        let pid: u32 = process.file_name().to_str()?.parse().ok()?;
        let holds = fs::read_dir(process.path().join("fd"))
            .ok()?
            .flatten()
            .any(|fd| fs::read_link(fd.path()).is_ok_and(|target| target == port));
        holds.then(|| {
            let name = fs::read_to_string(process.path().join("comm")).unwrap_or_default();
            format!("{} (process {pid})", name.trim())
        })
    })
}

/// Name of the group a file belongs to, or its number.
pub(super) fn group_of(path: &Path) -> String {
    use std::os::unix::fs::MetadataExt;
    let Ok(metadata) = fs::metadata(path) else {
        return "unknown".to_owned();
    };
    let gid = metadata.gid().to_string();
    let named = fs::read_to_string("/etc/group").ok().and_then(|groups| {
        groups.lines().find_map(|line| {
            let mut fields = line.split(':');
            let name = fields.next()?;
            (fields.nth(1)? == gid).then(|| name.to_owned())
        })
    });
    named.unwrap_or(gid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_file_has_this_process_as_its_holder() {
        let path = std::env::temp_dir().join(format!("relief-holder-{}", std::process::id()));
        let file = fs::File::create(&path).unwrap();
        let held_by = holder(&path);
        drop(file);
        let afterwards = holder(&path);
        fs::remove_file(&path).unwrap();
        let pid = format!("(process {})", std::process::id());
        assert!(
            held_by.as_deref().is_some_and(|text| text.ends_with(&pid)),
            "{held_by:?}"
        );
        assert_eq!(afterwards, None);
    }
}
