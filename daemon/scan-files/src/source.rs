//! From bytes to a parser: decompression and the choice of format, by content.

use std::io::{BufRead, BufReader, Cursor, Read};

use flate2::bufread::MultiGzDecoder;

use crate::error::ScanFileError;
use crate::gather::Gather;
use crate::{ply, text};

const BUFFER_BYTES: usize = 256 * 1024;
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
const PLY_MAGIC: [u8; 3] = *b"ply";
/// Enough to tell the formats apart.
const HEAD_BYTES: u64 = 16;
/// How files begin that users may take for scan files.
const OTHERS: [(&[u8], &str); 11] = [
    (b"P2\n", "a PGM picture"),
    (b"P5\n", "a PGM picture"),
    (b"\x89PNG", "a PNG picture"),
    (b"{", "a JSON file"),
    (b"solid ", "an STL mesh"),
    (b"ISO-10303-21", "a STEP file"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"ASTM-E57", "an E57 point cloud"),
    (b"LASF", "a LAS point cloud"),
    (b"# .PCD", "a PCD point cloud"),
];

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
    } else if let Some((_, format)) = OTHERS.iter().find(|(magic, _)| head.starts_with(magic)) {
        Err(ScanFileError::OtherFormat {
            file: gather.file.to_owned(),
            format,
        })
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
        .take(HEAD_BYTES)
        .read_to_end(&mut head)
        .map_err(|source| ScanFileError::Read {
            file: gather.file.to_owned(),
            after: "0 bytes".to_owned(),
            source,
        })?;
    Ok((head.clone(), Cursor::new(head).chain(reader)))
}
