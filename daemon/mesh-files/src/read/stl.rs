//! STL, text and binary.

use std::collections::HashMap;
use std::io::{self, BufRead, Read, Seek, SeekFrom};

use super::{ReadMeshError, Triangles};
use crate::format::TriangleFormat;

/// Length of a binary file's header, its count of facets included, and of each facet.
const HEADER_BYTES: u64 = 84;
const FACET_BYTES: u64 = 50;

/// Whether the number of facets fits the file's length: some binary files begin with `solid`, too.
pub(super) fn has_length(head: &[u8], bytes: u64) -> bool {
    announced(head).is_some_and(|count| HEADER_BYTES + FACET_BYTES * count == bytes)
}

/// A text has no zeros, and binary files have one in all counts below 16 million.
pub(super) fn is_text(head: &[u8], bytes: u64) -> bool {
    let head = &head[..head.len().min(HEADER_BYTES as usize)];
    let is_solid = head.trim_ascii_start().starts_with(b"solid");
    is_solid && !head.contains(&0) && !has_length(head, bytes)
}

fn announced(head: &[u8]) -> Option<u64> {
    let count = head.get(80..84)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(count)))
}

/// A binary file must hold what its header announces.
fn check_length(head: &[u8], bytes: u64) -> Result<(), ReadMeshError> {
    let Some(count) = announced(head) else {
        return Err(ReadMeshError(format!(
            "is no STL file: {bytes} bytes are less than the header of a binary one, and it does \
             not begin with `solid`"
        )));
    };
    let needed = HEADER_BYTES + FACET_BYTES * count;
    if bytes < needed {
        return Err(ReadMeshError(format!(
            "is cut off, or no STL file: its header announces {count} facets, which take {needed} \
             bytes; there are {bytes}"
        )));
    }
    Ok(())
}

/// A file with another beginning. The library takes for text what begins with `solid` and a space:
/// some text files have no space there, and some binary ones begin just so.
struct Reheaded<'a, R> {
    rest: &'a mut R,
    rest_from: u64,
    head: Vec<u8>,
    at: usize,
}

impl<'a, R: Read + Seek> Reheaded<'a, R> {
    /// `head` in the place of the first `instead_of` bytes, behind which the file is.
    fn new(rest: &'a mut R, head: Vec<u8>, instead_of: usize) -> Self {
        Self {
            rest,
            rest_from: instead_of as u64,
            head,
            at: 0,
        }
    }
}

impl<R: Read + Seek> Read for Reheaded<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut left = self.head.get(self.at..).unwrap_or(&[]);
        if left.is_empty() {
            return self.rest.read(buffer);
        }
        let read = left.read(buffer)?;
        self.at += read;
        Ok(read)
    }
}

impl<R: Read + Seek> Seek for Reheaded<'_, R> {
    /// Goes to the beginning, which is all that the library asks for.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if to != SeekFrom::Start(0) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        self.at = 0;
        self.rest.seek(SeekFrom::Start(self.rest_from))?;
        Ok(0)
    }
}

/// Reads an STL file of this length from its beginning, text or binary: vertices each once, and facets
/// as indices of them.
///
/// # Errors
/// [`ReadMeshError`] for what is damaged, no STL file, or has more facets than `most`.
pub fn read(
    source: &mut (impl BufRead + Seek),
    bytes: u64,
    most: usize,
) -> Result<Triangles, ReadMeshError> {
    let cannot = |error: io::Error| ReadMeshError(format!("cannot be read: {error}"));
    let mut head = Vec::new();
    source
        .by_ref()
        .take(HEADER_BYTES)
        .read_to_end(&mut head)
        .map_err(cannot)?;
    let mut solid = if is_text(&head, bytes) {
        source.rewind().map_err(cannot)?;
        let mut line = Vec::new();
        source.read_until(b'\n', &mut line).map_err(cannot)?;
        Reheaded::new(source, b"solid \n".to_vec(), line.len())
    } else {
        check_length(&head, bytes)?;
        head.iter_mut().take(80).for_each(|byte| *byte = 0);
        let length = head.len();
        Reheaded::new(source, head, length)
    };
    facets(&mut solid, most)
}

fn facets(source: &mut (impl Read + Seek), most: usize) -> Result<Triangles, ReadMeshError> {
    let damaged = |facet: usize, error: &io::Error| {
        ReadMeshError(format!(
            "is damaged, or no STL file: facet {facet}: {error}"
        ))
    };
    let reader = stl_io::create_stl_reader(source).map_err(|error| damaged(1, &error))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for (number, triangle) in (1..).zip(reader) {
        let triangle = triangle.map_err(|error| damaged(number, &error))?;
        if number > most {
            return Err(ReadMeshError(format!(
                "has more than {most} facets, the most that are read: decimate the mesh first"
            )));
        }
        triangles.push(triangle.vertices.map(|vertex| {
            // Adding 0 makes one of both zeros.
            let place = [vertex[0], vertex[1], vertex[2]].map(|c: f32| c + 0.0);
            *known.entry(place.map(f32::to_bits)).or_insert_with(|| {
                vertices.push(place.map(f64::from));
                vertices.len() as u32 - 1
            })
        }));
    }
    Ok(Triangles {
        vertices,
        triangles,
        format: TriangleFormat::Stl,
        is_single: true,
    })
}
