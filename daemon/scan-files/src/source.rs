//! The choice of a parser, by content.

use crate::error::ScanFileError;
use crate::gather::Gather;
use crate::unpack::Unpacked;
use crate::{ply, text};

const PLY_MAGIC: [u8; 3] = *b"ply";
/// How files begin that users may take for scan files.
const OTHERS: [(&[u8], &str); 26] = [
    (b"P2\n", "a PGM picture"),
    (b"P5\n", "a PGM picture"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"{", "a JSON file"),
    (b"[[", "a JSON file"),
    (b"[{", "a JSON file"),
    (b"<?xml", "an XML file"),
    (b"<!", "an HTML file"),
    (b"<html", "an HTML file"),
    (b"solid ", "an STL mesh"),
    (b"OFF\n", "an OFF mesh"),
    (b"v ", "an OBJ mesh"),
    (b"ISO-10303-21", "a STEP file"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"BZh", "compressed with bzip2"),
    (b"\xfd7zXZ", "compressed with xz"),
    (b"\x28\xb5\x2f\xfd", "compressed with zstd"),
    (b"7z\xbc\xaf", "a 7-Zip archive"),
    (b"ASTM-E57", "an E57 point cloud"),
    (b"LASF", "a LAS point cloud"),
    (b"# .PCD", "a PCD point cloud"),
    (b"\xff\xfe", "text in UTF-16, not UTF-8"),
    (b"\xfe\xff", "text in UTF-16, not UTF-8"),
    (b"RELSCAN\n", "a scan journal"),
];
/// The mark of a tar archive, and where it stands.
const TAR_MAGIC: (usize, &[u8]) = (257, b"ustar");

/// Parses a whole file into `gather`.
pub(crate) fn parse(
    source: &mut Unpacked<'_>,
    gather: &mut Gather<'_>,
) -> Result<(), ScanFileError> {
    if source.layers() > 1 {
        gather.note(format!(
            "the file is gzip-compressed {} times over",
            source.layers()
        ));
    }
    if source.head().starts_with(&PLY_MAGIC) {
        return ply::parse(source, gather);
    }
    match other_format(source.head()) {
        Some(format) => Err(ScanFileError::OtherFormat {
            file: gather.file.to_owned(),
            format,
        }),
        None => text::parse(source, gather),
    }
}

fn other_format(head: &[u8]) -> Option<&'static str> {
    let (place, mark) = TAR_MAGIC;
    if head.get(place..).is_some_and(|rest| rest.starts_with(mark)) {
        return Some("a tar archive");
    }
    let known = OTHERS.iter().find(|(magic, _)| head.starts_with(magic));
    known.map(|(_, format)| *format)
}
