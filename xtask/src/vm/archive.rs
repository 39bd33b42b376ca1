//! The file system that the kernel unpacks into memory: a cpio archive ("newc", as in the
//! kernel's `Documentation/driver-api/early-userspace/buffer-format.rst`).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::shell;

const FOLDER: u32 = 0o040_755;
const PROGRAM: u32 = 0o100_755;

/// Files by their places, without the leading slash.
#[derive(Debug, Default)]
pub(super) struct Archive {
    /// Folders come before what is in them, as their names are shorter.
    entries: BTreeMap<String, (u32, Vec<u8>)>,
}

impl Archive {
    pub(super) fn folder(&mut self, place: &str) {
        for (end, _) in place.match_indices('/') {
            let parent = place.get(..end).unwrap_or_default();
            self.entries.insert(parent.to_owned(), (FOLDER, Vec::new()));
        }
        self.entries.insert(place.to_owned(), (FOLDER, Vec::new()));
    }

    pub(super) fn text(&mut self, place: &str, text: &str) {
        self.put(place, text.as_bytes().to_vec());
    }

    pub(super) fn file(&mut self, place: &str, from: &Path) -> Result<()> {
        let bytes = fs::read(from).with_context(|| format!("cannot read {}", from.display()))?;
        self.put(place, bytes);
        Ok(())
    }

    /// A program that is linked with libraries, some of which may lie in `folder`; all go
    /// where the loader looks for them.
    pub(super) fn program(&mut self, place: &str, from: &Path, folder: &Path) -> Result<()> {
        self.file(place, from)?;
        for library in libraries(from, folder)? {
            let place = match library.strip_prefix(folder) {
                Ok(name) => Path::new("lib").join(name),
                Err(_) => library.strip_prefix("/").unwrap_or(&library).to_owned(),
            };
            self.file(&place.display().to_string(), &library)?;
        }
        Ok(())
    }

    fn put(&mut self, place: &str, bytes: Vec<u8>) {
        if let Some((folder, _)) = place.rsplit_once('/') {
            self.folder(folder);
        }
        self.entries.insert(place.to_owned(), (PROGRAM, bytes));
    }

    pub(super) fn write(&self, to: &Path) -> Result<()> {
        let mut out = Vec::new();
        for (number, (place, (mode, bytes))) in self.entries.iter().enumerate() {
            entry(&mut out, number as u32 + 1, place, *mode, bytes);
        }
        entry(&mut out, 0, "TRAILER!!!", 0, &[]);
        fs::write(to, out).with_context(|| format!("cannot write {}", to.display()))
    }
}

fn entry(out: &mut Vec<u8>, number: u32, place: &str, mode: u32, bytes: &[u8]) {
    let fields = [
        number,
        mode,
        0, // user
        0, // group
        1, // links
        0, // time
        bytes.len() as u32,
        0, // device
        0,
        0,
        0,
        place.len() as u32 + 1,
        0, // checksum
    ];
    out.extend(b"070701");
    for field in fields {
        out.extend(format!("{field:08x}").bytes());
    }
    out.extend(place.bytes());
    out.push(0);
    pad(out);
    out.extend(bytes);
    pad(out);
}

fn pad(out: &mut Vec<u8>) {
    while !out.len().is_multiple_of(4) {
        out.push(0);
    }
}

fn libraries(program: &Path, folder: &Path) -> Result<Vec<PathBuf>> {
    let path = format!("LD_LIBRARY_PATH={}", folder.display());
    let list = shell::output("env", &[&path, "ldd", &program.display().to_string()])?;
    anyhow::ensure!(
        !list.contains("not found"),
        "{} needs libraries that are not here: {list}",
        program.display()
    );
    Ok(list
        .split_whitespace()
        .filter(|word| word.starts_with('/'))
        .map(PathBuf::from)
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_aligned_and_folders_come_first() {
        let mut archive = Archive::default();
        archive.text("etc/deep/name", "hello");
        archive.text("init", "x");
        let places: Vec<&str> = archive.entries.keys().map(String::as_str).collect();
        assert_eq!(places, ["etc", "etc/deep", "etc/deep/name", "init"]);
        let mut out = Vec::new();
        entry(&mut out, 1, "etc/deep/name", PROGRAM, b"hello");
        // 110 bytes of header, 14 of the name: aligned; then 5 of content and 3 of padding.
        assert_eq!(out.len(), 110 + 14 + 5 + 3);
        assert!(out.starts_with(b"07070100000001000081ed"));
        assert_eq!(out.get(124..129), Some(&b"hello"[..]));
    }
}
