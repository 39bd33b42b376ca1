//! Files that are whole: hashed while written, synced, put in place in one step.

use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use storage::{Appender, Disk, LocalDisk};

use crate::manifest::ManifestFile;

/// Passes bytes on and keeps their number and SHA-256.
struct Hashing<W> {
    sink: W,
    digest: Sha256,
    bytes: u64,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let taken = self.sink.write(buffer)?;
        self.digest.update(buffer.get(..taken).unwrap_or(buffer));
        self.bytes += taken as u64;
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

/// Writes a file under its final name, syncs it, and tells what it holds.
pub(crate) fn write_synced<E: From<io::Error>>(
    disk: &dyn Disk,
    directory: &Path,
    name: &str,
    content: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<ManifestFile, E> {
    fill(emptied(disk, &directory.join(name))?, name, content)
}

/// A file without content, whatever it held before.
fn emptied(disk: &dyn Disk, path: &Path) -> io::Result<Appender> {
    let file = disk.open(path)?;
    file.set_len(0)?;
    Ok(Appender::new(file))
}

fn fill<E: From<io::Error>>(
    file: Appender,
    name: &str,
    content: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<ManifestFile, E> {
    // The hash stands behind the buffer, so that it sees few large pieces.
    let mut sink = BufWriter::with_capacity(
        1 << 16,
        Hashing {
            sink: file,
            digest: Sha256::new(),
            bytes: 0,
        },
    );
    content(&mut sink)?;
    let hashed = sink.into_inner().map_err(io::IntoInnerError::into_error)?;
    hashed.sink.sync_data()?;
    Ok(ManifestFile {
        name: name.to_owned(),
        bytes: hashed.bytes,
        sha256: hexadecimal(&hashed.digest.finalize()),
    })
}

/// Writes one file so that its name never shows half a content: into a temporary file in
/// the same directory, synced, then renamed. On failure the temporary file is removed
/// and whatever had the name before is untouched.
///
/// # Errors
/// What the content or the file system reports.
pub fn write_atomically<E: From<io::Error>>(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<ManifestFile, E> {
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?
        .to_string_lossy()
        .into_owned();
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    let temporary = directory.join(format!(".{name}.{}.part", std::process::id()));
    let written = emptied(&LocalDisk, &temporary)
        .map_err(E::from)
        .and_then(|file| fill(file, &name, content))
        .and_then(|entry| {
            fs::rename(&temporary, path)?;
            LocalDisk.sync_dir(&directory)?;
            Ok(entry)
        });
    if written.is_err() {
        // The first error is the one worth telling; a leftover is only untidy.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// SHA-256 of all that a reader gives, 64 lower-case hexadecimal digits.
///
/// # Errors
/// What the reader reports.
pub fn sha256_of(mut reader: impl Read) -> io::Result<String> {
    let mut digest = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match reader.read(&mut buffer) {
            Ok(0) => return Ok(hexadecimal(&digest.finalize())),
            Ok(read) => digest.update(buffer.get(..read).unwrap_or(&[])),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Bytes as lower-case hexadecimal digits.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_the_published_one() {
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let directory = tempfile::tempdir().unwrap();
        let entry = write_synced::<io::Error>(&LocalDisk, directory.path(), "a", |sink| {
            sink.write_all(b"a")?;
            sink.write_all(b"bc")
        })
        .unwrap();
        assert_eq!((entry.bytes, entry.sha256.as_str()), (3, expected));
        assert_eq!(sha256_of(&b"abc"[..]).unwrap(), expected);
        assert_eq!(fs::read(directory.path().join("a")).unwrap(), b"abc");
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out.igs");
        fs::write(&path, "old").unwrap();
        let failed = write_atomically::<io::Error>(&path, |sink| {
            sink.write_all(b"half")?;
            Err(io::Error::other("no"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "no");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
        write_atomically::<io::Error>(&path, |sink| sink.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
