//! What was put, in a few words.

use std::fmt::Write as _;
use std::io::{self, Read};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::Kind;
use crate::jetstream::random_name;
use crate::queue::QueueError;

/// Bytes of a chunk, but for the last one.
pub const CHUNK_BYTES: usize = 1 << 20;

/// A piece of at most [`CHUNK_BYTES`].
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Chunk {
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
    /// How many bytes it has.
    pub bytes: u64,
    /// Of which put it is, where each puts its own; empty where what is the same is there once, and
    /// shared.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub put: String,
}

/// A stream of bytes that is in the depot.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parcel {
    /// How many bytes it has.
    pub bytes: u64,
    /// SHA-256 of all of them, in hexadecimal.
    pub sha256: String,
    /// Its pieces, in order.
    pub chunks: Vec<Chunk>,
}

impl Chunk {
    pub(super) fn of(raw: &[u8], put: &str) -> Result<Self, QueueError> {
        if raw.len() > CHUNK_BYTES {
            return Err(QueueError::Refused(format!(
                "a chunk of {} bytes: cut it into pieces of {CHUNK_BYTES}",
                raw.len()
            )));
        }
        Ok(Self {
            sha256: hex(&Sha256::digest(raw)),
            bytes: raw.len() as u64,
            put: put.to_owned(),
        })
    }

    /// Name of its object.
    #[must_use]
    pub fn object(&self, kind: Kind) -> String {
        let (prefix, dash) = (kind.prefix(), if self.put.is_empty() { "" } else { "-" });
        format!("{prefix}{}{dash}{}", self.put, self.sha256)
    }
}

impl Parcel {
    /// What putting it would give; nothing is put.
    ///
    /// # Errors
    /// [`QueueError::Damaged`] if it cannot be read.
    pub fn of_reader(from: &mut dyn Read) -> Result<Self, QueueError> {
        let mut measured = Measured::default();
        while let Some(raw) = cut(from)? {
            measured.add(&raw)?;
        }
        Ok(measured.end())
    }

    /// Whether it can be one at all: it comes from another machine.
    pub(super) fn check(&self) -> Result<(), QueueError> {
        let damaged = |why: String| {
            Err(QueueError::Damaged {
                what: "a parcel".to_owned(),
                why,
            })
        };
        let mut bytes = 0_u64;
        for (n, chunk) in self.chunks.iter().enumerate() {
            let is_word = chunk.put.len() <= 32 && chunk.put.chars().all(|c| c.is_ascii_hexdigit());
            if chunk.bytes > CHUNK_BYTES as u64 || !is_hash(&chunk.sha256) || !is_word {
                return damaged(format!("its chunk {} cannot be one", n + 1));
            }
            bytes += chunk.bytes;
        }
        if bytes != self.bytes || !is_hash(&self.sha256) {
            return damaged(format!(
                "it has {} bytes, and its chunks have {bytes}",
                self.bytes
            ));
        }
        Ok(())
    }
}

/// A parcel in the making.
#[derive(Default)]
pub(super) struct Measured {
    all: Sha256,
    bytes: u64,
    chunks: Vec<Chunk>,
    put: String,
}

impl Measured {
    /// What is about to be put: results have names of their own, so that what becomes of one is none
    /// of the others' worries, though they be the same.
    pub(super) fn of(kind: Kind) -> Self {
        let put = match kind {
            Kind::Journal => String::new(),
            Kind::Result => random_name(),
        };
        Self {
            put,
            ..Self::default()
        }
    }

    pub(super) fn add(&mut self, raw: &[u8]) -> Result<Chunk, QueueError> {
        let chunk = Chunk::of(raw, &self.put)?;
        self.all.update(raw);
        self.bytes += chunk.bytes;
        self.chunks.push(chunk.clone());
        Ok(chunk)
    }

    pub(super) fn end(self) -> Parcel {
        Parcel {
            bytes: self.bytes,
            sha256: hex(&self.all.finalize()),
            chunks: self.chunks,
        }
    }
}

/// The next chunk, if there is more.
pub(super) fn cut(from: &mut dyn Read) -> Result<Option<Vec<u8>>, QueueError> {
    let mut raw = Vec::new();
    match from.take(CHUNK_BYTES as u64).read_to_end(&mut raw) {
        Ok(0) => Ok(None),
        Ok(_) => Ok(Some(raw)),
        Err(error) => Err(unread(&error)),
    }
}

fn unread(error: &io::Error) -> QueueError {
    QueueError::Damaged {
        what: "what is to be put".to_owned(),
        why: error.to_string(),
    }
}

pub(super) fn is_hash(text: &str) -> bool {
    text.len() == 64 && text.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'))
}

pub(super) fn hex(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() * 2);
    for byte in bytes {
        let _ = write!(text, "{byte:02x}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parcels_are_cut_at_every_mebibyte() {
        let bytes = vec![7_u8; CHUNK_BYTES * 2 + 3];
        let parcel = Parcel::of_reader(&mut bytes.as_slice()).unwrap();
        let sizes: Vec<_> = parcel.chunks.iter().map(|chunk| chunk.bytes).collect();
        assert_eq!(sizes, [1 << 20, 1 << 20, 3]);
        assert_eq!(parcel.chunks[0].sha256, parcel.chunks[1].sha256);
        parcel.check().unwrap();
        let nothing = Parcel::of_reader(&mut io::empty()).unwrap();
        assert!(nothing.chunks.is_empty());
        assert_eq!(
            nothing.sha256,
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
        );
    }

    #[test]
    fn what_cannot_be_a_parcel_is_refused() {
        let good = Parcel::of_reader(&mut [1_u8; 100].as_slice()).unwrap();
        let spoils: [fn(&mut Parcel); 5] = [
            |p| p.chunks[0].put = "a.>".to_owned(),
            |p| p.bytes += 1,
            |p| p.chunks[0].sha256 = "../../etc/passwd".to_owned(),
            |p| p.sha256.clear(),
            |p| {
                p.chunks[0].bytes = u64::MAX;
                p.bytes = u64::MAX;
            },
        ];
        for spoil in spoils {
            let mut parcel = good.clone();
            spoil(&mut parcel);
            assert!(parcel.check().is_err(), "{parcel:?}");
        }
    }
}
