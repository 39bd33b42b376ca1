//! Several files as one.

use std::collections::BTreeSet;
use std::io::{self, Read, Write};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::parcel::{hex, is_hash};
use super::{Depot, Kind, Parcel};
use crate::order::BenchName;
use crate::queue::QueueError;

/// Longest name of a file.
const MOST_NAME_BYTES: usize = 200;

/// A file of a bundle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BundledFile {
    /// Its name, without a folder.
    pub name: String,
    /// How many bytes it has.
    pub bytes: u64,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// Files that are in the depot one behind the other, so that a dozen small ones are one object.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bundle {
    /// The files, in order.
    pub files: Vec<BundledFile>,
    /// All their bytes.
    pub parcel: Parcel,
}

impl Bundle {
    /// Whether it can be one at all: it comes from another machine.
    fn check(&self) -> Result<(), QueueError> {
        let mut names = BTreeSet::new();
        let mut bytes = 0_u64;
        for file in &self.files {
            check_name(&file.name)?;
            if !names.insert(&file.name) || !is_hash(&file.sha256) {
                return Err(damaged(&file.name, "it is there twice, or has no hash"));
            }
            bytes = bytes.saturating_add(file.bytes);
        }
        if bytes != self.parcel.bytes {
            return Err(damaged("a bundle", "its files are not all of its bytes"));
        }
        self.parcel.check()
    }
}

impl Depot {
    /// Puts files, each with its name.
    ///
    /// # Errors
    /// As [`Depot::put`]; [`QueueError::Damaged`] for a name that is none.
    pub fn put_bundle(
        &self,
        bench: &BenchName,
        kind: Kind,
        files: Vec<(String, Box<dyn Read>)>,
    ) -> Result<Bundle, QueueError> {
        for (name, _) in &files {
            check_name(name)?;
        }
        let mut chain = Chain {
            files: files.into_iter().rev().collect(),
            hash: Sha256::new(),
            bytes: 0,
            done: Vec::new(),
        };
        let parcel = self.put(bench, kind, &mut chain)?;
        let bundle = Bundle {
            files: chain.done,
            parcel,
        };
        bundle.check()?;
        Ok(bundle)
    }

    /// Writes the files of a bundle into what `create` gives for each name.
    ///
    /// # Errors
    /// As [`Depot::fetch`]. Files may have been written in part.
    pub fn fetch_bundle(
        &self,
        bench: &BenchName,
        kind: Kind,
        bundle: &Bundle,
        create: &mut dyn FnMut(&BundledFile) -> io::Result<Box<dyn Write>>,
    ) -> Result<(), QueueError> {
        bundle.check()?;
        let mut split = Split {
            files: bundle.files.iter(),
            create,
            now: None,
            wrong: None,
        };
        let fetched = self.fetch(bench, kind, &bundle.parcel, &mut split);
        // What went wrong with a file says more than that not all was written.
        if let Some(name) = split.wrong.take() {
            return Err(damaged(&name, "it is not what was put"));
        }
        fetched?;
        split.write(&[]).map_err(|error| QueueError::Damaged {
            what: "a bundle".to_owned(),
            why: error.to_string(),
        })?;
        Ok(())
    }
}

fn damaged(what: &str, why: &str) -> QueueError {
    QueueError::Damaged {
        what: what.to_owned(),
        why: why.to_owned(),
    }
}

/// Refuses what would leave its folder, or hide in it.
fn check_name(name: &str) -> Result<(), QueueError> {
    let plain = |c: char| !c.is_control() && !matches!(c, '/' | '\\');
    if (1..=MOST_NAME_BYTES).contains(&name.len())
        && !name.starts_with('.')
        && name.chars().all(plain)
    {
        Ok(())
    } else {
        Err(damaged(
            &format!("file {name:?}"),
            "a name of 1 to 200 bytes without `/`, and without a dot in front, is wanted",
        ))
    }
}

/// Reads one file behind the other.
struct Chain {
    /// The next one is last.
    files: Vec<(String, Box<dyn Read>)>,
    hash: Sha256,
    bytes: u64,
    done: Vec<BundledFile>,
}

impl Read for Chain {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while let Some((_, file)) = self.files.last_mut() {
            let read = file.read(into)?;
            self.hash.update(&into[..read]);
            self.bytes += read as u64;
            if read > 0 || into.is_empty() {
                return Ok(read);
            }
            if let Some((name, _)) = self.files.pop() {
                self.done.push(BundledFile {
                    name,
                    bytes: std::mem::take(&mut self.bytes),
                    sha256: hex(&std::mem::take(&mut self.hash).finalize()),
                });
            }
        }
        Ok(0)
    }
}

/// A file that is being written.
struct Open<'a> {
    file: &'a BundledFile,
    to: Box<dyn Write>,
    left: u64,
    hash: Sha256,
}

/// Writes one file behind the other.
struct Split<'a> {
    files: std::slice::Iter<'a, BundledFile>,
    create: &'a mut dyn FnMut(&BundledFile) -> io::Result<Box<dyn Write>>,
    now: Option<Open<'a>>,
    wrong: Option<String>,
}

impl Split<'_> {
    /// Ends files that are whole, and begins the next.
    fn turn(&mut self) -> io::Result<()> {
        loop {
            if let Some(open) = &mut self.now {
                if open.left > 0 {
                    return Ok(());
                }
                open.to.flush()?;
                if hex(&std::mem::take(&mut open.hash).finalize()) != open.file.sha256 {
                    self.wrong = Some(open.file.name.clone());
                    return Err(io::Error::other("a file is not what was put"));
                }
            }
            let Some(file) = self.files.next() else {
                self.now = None;
                return Ok(());
            };
            self.now = Some(Open {
                file,
                to: (self.create)(file)?,
                left: file.bytes,
                hash: Sha256::new(),
            });
        }
    }
}

impl Write for Split<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.turn()?;
        let Some(open) = &mut self.now else {
            return Ok(0);
        };
        let most = usize::try_from(open.left).unwrap_or(usize::MAX);
        let bytes = &bytes[..bytes.len().min(most)];
        let written = open.to.write(bytes)?;
        open.hash.update(&bytes[..written]);
        open.left -= written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        for name in ["", "..", ".hidden", "a/b", "a\\b", "a\0b", "/etc/passwd"] {
            assert!(check_name(name).is_err(), "{name:?}");
        }
        for name in ["part.step", "view 1.glb", "a..b"] {
            check_name(name).unwrap();
        }
    }
}
