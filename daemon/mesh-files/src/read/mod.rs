//! Triangles read: STL of both kinds, PLY, Wavefront OBJ.

mod obj;
mod ply;
mod stl;

use std::io::{BufRead, Read, Seek};

use crate::format::TriangleFormat;

pub use stl::read as read_stl;

/// What is said of a file that is none of those that are read.
const FORMATS: &str = "STL, PLY and OBJ files are read";
/// By so many bytes it is told what a file is.
const HEAD_BYTES: u64 = 4096;
/// Most triangles that are read.
pub const MOST_TRIANGLES: usize = 50_000_000;

/// Triangles over shared vertices, as they stand in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangles {
    /// Where triangles have their corners; STL has each place once, other formats as the file has it.
    pub vertices: Vec<[f64; 3]>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// What the file is.
    pub format: TriangleFormat,
    /// Whether its coordinates have 32 bits.
    pub is_single: bool,
}

/// A file could not be read; the message goes on behind the file's name and a colon.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ReadMeshError(pub String);

impl ReadMeshError {
    fn damaged(what: impl std::fmt::Display, error: &dyn std::error::Error) -> Self {
        Self(format!("is damaged, or no {what} file: {error}"))
    }
}

/// Reads triangles; faces of more corners are divided into fans of them. The format is told by the
/// content alone.
///
/// # Errors
/// [`ReadMeshError`] for what is no such file, is damaged, or has more than [`MOST_TRIANGLES`].
pub fn read_triangles(
    source: &mut (impl BufRead + Seek),
    bytes: u64,
) -> Result<Triangles, ReadMeshError> {
    let cannot = |error: std::io::Error| ReadMeshError(format!("cannot be read: {error}"));
    let mut head = Vec::new();
    source
        .by_ref()
        .take(HEAD_BYTES)
        .read_to_end(&mut head)
        .map_err(cannot)?;
    source.rewind().map_err(cannot)?;
    let text = head.trim_ascii_start();
    if head.is_empty() {
        return Err(ReadMeshError("is empty".to_owned()));
    }
    if text.starts_with(b"ply") {
        return ply::read(source, bytes);
    }
    if stl::is_text(&head, bytes) || stl::has_length(&head, bytes) {
        return stl::read(source, bytes, MOST_TRIANGLES);
    }
    if let Some(other) = other_format(&head) {
        return Err(ReadMeshError(format!("is {other}, and no mesh; {FORMATS}")));
    }
    if obj::is_obj(&head) {
        return obj::read(source);
    }
    if head.contains(&0) {
        // Only a binary STL has no mark; its length tells what is wrong with it.
        return stl::read(source, bytes, MOST_TRIANGLES);
    }
    Err(ReadMeshError(format!("is no mesh: {FORMATS}")))
}

fn other_format(head: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 6] = [
        (b"ISO-10303-21", "a STEP file"),
        (b"PK\x03\x04", "a ZIP archive or 3MF file"),
        (b"\x1f\x8b", "compressed with gzip"),
        (b"glTF", "a glTF file"),
        (b"OFF", "an OFF file"),
        (b"\x89PNG", "a picture"),
    ];
    let text = head.trim_ascii_start();
    let found = known.iter().find(|(start, _)| text.starts_with(start));
    let is_iges = head.get(72) == Some(&b'S') && head.get(80).is_some_and(|b| *b < b' ');
    found
        .map(|(_, format)| *format)
        .or(is_iges.then_some("an IGES file"))
}

/// Triangles of a face by its corners.
fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let Some((&first, rest)) = corners.split_first() {
        triangles.extend(rest.windows(2).map(|pair| [first, pair[0], pair[1]]));
    }
}
