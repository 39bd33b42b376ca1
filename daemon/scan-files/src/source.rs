//! From bytes to a parser: decompression and the choice of format, by content.

use std::io::{BufRead, BufReader, Cursor, Read};

use flate2::bufread::MultiGzDecoder;

use crate::error::ScanFileError;
use crate::gather::Gather;
use crate::{ply, text};

const BUFFER_BYTES: usize = 256 * 1024;
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
const PLY_MAGIC: [u8; 3] = *b"ply";

/// Parses a whole file into `gather`.
pub(crate) fn parse(source: impl Read, gather: &mut Gather<'_>) -> Result<(), ScanFileError> {
    let (head, plain) = peek(BufReader::with_capacity(BUFFER_BYTES, source), gather)?;
    if head.starts_with(&GZIP_MAGIC) {
        let unpacked = BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(plain));
        let (head, unpacked) = peek(unpacked, gather)?;
        by_format(&head, unpacked, gather)
    } else {
        by_format(&head, plain, gather)
    }
}

fn by_format(
    head: &[u8],
    reader: impl BufRead,
    gather: &mut Gather<'_>,
) -> Result<(), ScanFileError> {
    if head.starts_with(&PLY_MAGIC) {
        ply::parse(reader, gather)
    } else {
        text::parse(reader, gather)
    }
}

/// The first bytes, and a reader that still delivers them.
fn peek<R: BufRead>(
    mut reader: R,
    gather: &Gather<'_>,
) -> Result<(Vec<u8>, impl BufRead + use<R>), ScanFileError> {
    let mut head = Vec::new();
    reader
        .by_ref()
        .take(PLY_MAGIC.len() as u64)
        .read_to_end(&mut head)
        .map_err(|source| ScanFileError::Read {
            file: gather.file.to_owned(),
            after: "0 bytes".to_owned(),
            source,
        })?;
    Ok((head.clone(), Cursor::new(head).chain(reader)))
}
