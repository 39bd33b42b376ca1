//! What is to go somewhere: the files of a result, the manifest last, so that it is there only once
//! all others are.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use deliverables::{MANIFEST_NAME, Manifest, hexadecimal};
use glob::Pattern;
use sha2::{Digest, Sha256};

/// The files of a result that go somewhere.
#[derive(Debug)]
pub(super) struct Parcel {
    /// The result's name.
    pub(super) result: String,
    /// Where it is.
    pub(super) directory: PathBuf,
    /// The manifest last.
    pub(super) files: Vec<Piece>,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) name: String,
    pub(super) sha256: [u8; 32],
}

impl Parcel {
    /// Those files of a result whose names match one of the patterns.
    pub(super) fn of(result: &str, directory: &Path, patterns: &[String]) -> Result<Self, String> {
        let path = directory.join(MANIFEST_NAME);
        let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let bytes = fs::read(&path).map_err(|error| failed(&error))?;
        let manifest: Manifest = serde_json::from_slice(&bytes).map_err(|error| failed(&error))?;
        // What is no pattern was refused with the configuration.
        let patterns: Vec<Pattern> = patterns
            .iter()
            .filter_map(|pattern| Pattern::new(pattern).ok())
            .collect();
        let mut files = Vec::new();
        for file in manifest.files {
            if !patterns.iter().any(|pattern| pattern.matches(&file.name)) {
                continue;
            }
            let sha256 = of_hexadecimal(&file.sha256)
                .ok_or_else(|| failed(&format_args!("{} has no SHA-256", file.name)))?;
            let name = file.name;
            files.push(Piece { name, sha256 });
        }
        files.push(Piece {
            name: MANIFEST_NAME.to_owned(),
            sha256: Sha256::digest(&bytes).into(),
        });
        Ok(Self {
            result: result.to_owned(),
            directory: directory.to_owned(),
            files,
        })
    }

    /// The file, once it was found to be what the manifest says.
    pub(super) fn open(&self, piece: &Piece) -> Result<File, String> {
        let path = self.directory.join(&piece.name);
        let failed = |error: io::Error| format!("{}: {error}", path.display());
        let mut file = File::open(&path).map_err(failed)?;
        if digest(&mut file).map_err(failed)? != piece.sha256 {
            return Err(format!(
                "{} is not what {MANIFEST_NAME} says: relief rerun makes the result anew",
                path.display()
            ));
        }
        io::Seek::rewind(&mut file).map_err(failed)?;
        Ok(file)
    }
}

/// The SHA-256 of what is left to read.
pub(super) fn digest(file: &mut impl Read) -> io::Result<[u8; 32]> {
    let mut hash = Sha256::new();
    let mut bytes = vec![0; 1 << 16];
    loop {
        match file.read(&mut bytes)? {
            0 => return Ok(hash.finalize().into()),
            count => hash.update(&bytes[..count]),
        }
    }
}

fn of_hexadecimal(text: &str) -> Option<[u8; 32]> {
    let mut bytes = [0; 32];
    for (byte, at) in bytes.iter_mut().zip((0..).step_by(2)) {
        *byte = u8::from_str_radix(text.get(at..at + 2)?, 16).ok()?;
    }
    (hexadecimal(&bytes) == text).then_some(bytes)
}
