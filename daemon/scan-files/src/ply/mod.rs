//! PLY files, ASCII and binary: the vertices' x, y, z and intensity.

mod header;
mod vertex;

use std::io::{BufRead, Cursor, ErrorKind, Read};

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyType, ScalarType};

use crate::error::{Place, ScanFileError};
use crate::gather::Gather;
use crate::units::Units;

use vertex::{Skipped, Vertex};

/// Entries read at a time: bounds memory beside the points themselves.
const CHUNK: usize = 1 << 15;
/// Bytes after the last entry of a binary file that are taken for padding.
const PADDING_BYTES: usize = 4;
const AXES: [&str; 3] = ["x", "y", "z"];

pub(crate) fn parse(
    mut reader: impl BufRead,
    gather: &mut Gather<'_>,
) -> Result<(), ScanFileError> {
    let cleaned = header::read_cleaned(&mut reader, gather)?;
    let mut reader = Reader::new(Cursor::new(cleaned).chain(header::BoundedLines::new(reader)));
    let mut head = Parser::<Vertex>::new()
        .read_header(&mut reader)
        .map_err(|e| ScanFileError::PlyHeader {
            file: gather.file.to_owned(),
            line: e.line().unwrap_or(1) as u64,
            detail: one_line(&e),
        })?;
    check(&head, gather)?;
    let units = units(&head, gather);
    widen_ascii(&mut head);
    let mut after_vertices = false;
    for element in head.elements.values() {
        if element.name == "vertex" {
            vertices(&mut reader, &head, element, units, gather)?;
            after_vertices = true;
        } else if !after_vertices {
            skip(&mut reader, &head, element, gather)?;
        } else if let Err(error) = skip(&mut reader, &head, element, gather) {
            // The vertices have been read; only what nobody needs is wrong.
            gather.note(format!(
                "the {} data after the vertices do not fit the header ({error}); check that all \
                 points are there",
                element.name
            ));
            return Ok(());
        }
    }
    surplus(&mut reader, &head, gather)
}

/// Refuses a file with more data than announced, whose points would be lost in silence. A
/// line end or two after binary data are no harm.
fn surplus(
    reader: &mut Reader<impl BufRead>,
    head: &Header,
    gather: &Gather<'_>,
) -> Result<(), ScanFileError> {
    let ascii = head.encoding == Encoding::Ascii;
    let failed = |source| ScanFileError::Read {
        file: gather.file.to_owned(),
        after: "the last vertex".to_owned(),
        source,
    };
    let mut left = 0;
    loop {
        let piece = reader.get_mut().fill_buf().map_err(failed)?;
        let length = piece.len();
        let blank = |b: &&u8| ascii && b.is_ascii_whitespace();
        left += length - piece.iter().filter(blank).count();
        if length == 0 {
            return Ok(());
        }
        if left > if ascii { 1 } else { PADDING_BYTES } {
            let vertices = head.elements.get("vertex");
            return Err(ScanFileError::PlySurplus {
                file: gather.file.to_owned(),
                announced: vertices.map_or(0, |element| element.count as u64),
            });
        }
        reader.get_mut().consume(length);
    }
}

/// Refuses headers whose data could not be read or would be meaningless.
fn check(head: &Header, gather: &Gather<'_>) -> Result<(), ScanFileError> {
    let refuse = |detail: String| {
        Err(ScanFileError::PlyHeader {
            file: gather.file.to_owned(),
            line: 1,
            detail,
        })
    };
    let Some(vertex) = head.elements.get("vertex") else {
        return refuse("no `element vertex` in the header; points are read from there".into());
    };
    for axis in AXES {
        match vertex.properties.get(axis).map(|p| &p.data_type) {
            Some(PropertyType::Scalar(_)) => {}
            Some(PropertyType::List(..)) => {
                return refuse(format!("`{axis}` of the vertices is a list, not a number"));
            }
            None => return refuse(format!("the vertices have no property `{axis}`")),
        }
    }
    // Without a byte to each entry the announced number alone would decide how long
    // reading takes and how much memory it needs.
    match head
        .elements
        .values()
        .find(|e| e.properties.is_empty() && e.count > 0)
    {
        Some(empty) => refuse(format!("element `{}` has no properties", empty.name)),
        None => Ok(()),
    }
}

fn units(head: &Header, gather: &mut Gather<'_>) -> Units {
    let cyberware = head.obj_infos.iter().any(|info| {
        let mut words = info.split_whitespace();
        words.next() == Some("is_cyberware_data") && words.next() == Some("1")
    });
    match gather.options.units {
        Some(units) => units,
        None if cyberware => {
            gather.note("scan of a Cyberware scanner: coordinates taken as metres");
            Units::Metre
        }
        None => Units::Millimetre,
    }
}

/// Lets coordinates written in decimal be read as they stand: as the announced `float`
/// they would be rounded to 24 bits, which moves columns 0.1 m away by the 10 nm lattice.
fn widen_ascii(head: &mut Header) {
    if head.encoding != Encoding::Ascii {
        return;
    }
    if let Some(vertex) = head.elements.get_mut("vertex") {
        for axis in AXES {
            if let Some(property) = vertex.properties.get_mut(axis) {
                property.data_type = PropertyType::Scalar(ScalarType::Double);
            }
        }
    }
}

fn vertices(
    reader: &mut Reader<impl BufRead>,
    head: &Header,
    element: &ElementDef,
    units: Units,
    gather: &mut Gather<'_>,
) -> Result<(), ScanFileError> {
    let parser = Parser::<Vertex>::new();
    let mut number = 0_u64;
    for chunk in chunks(element) {
        let rows = match parser.read_payload_for_element(reader, &chunk, head) {
            Ok(rows) => rows,
            Err(error) if is_short(&error) && at_end(reader) => {
                return Err(truncated(element, gather));
            }
            Err(error) => return Err(data_error(&error, head, element, number, gather)),
        };
        for row in rows {
            number += 1;
            gather.push(row.xyz, row.intensity, units, Place::Vertex(number))?;
        }
    }
    if head.elements.contains_key("face") {
        gather.note("the file is a mesh: its faces were ignored, its vertices read as samples");
    }
    Ok(())
}

fn skip(
    reader: &mut Reader<impl BufRead>,
    head: &Header,
    element: &ElementDef,
    gather: &Gather<'_>,
) -> Result<(), ScanFileError> {
    let parser = Parser::<Skipped>::new();
    for chunk in chunks(element) {
        parser
            .read_payload_for_element(reader, &chunk, head)
            .map_err(|e| data_error(&e, head, element, 0, gather))?;
    }
    Ok(())
}

/// The element's entries as a sequence of smaller elements.
fn chunks(element: &ElementDef) -> impl Iterator<Item = ElementDef> {
    (0..element.count).step_by(CHUNK).map(|start| {
        let mut chunk = element.clone();
        chunk.count = CHUNK.min(element.count - start);
        chunk
    })
}

fn truncated(element: &ElementDef, gather: &Gather<'_>) -> ScanFileError {
    ScanFileError::PlyTruncated {
        file: gather.file.to_owned(),
        element: element.name.clone(),
        announced: element.count as u64,
    }
}

/// A line of text without all of its values.
fn is_short(error: &ParseError) -> bool {
    error.to_string().contains("found nothing")
}

fn at_end(reader: &mut Reader<impl BufRead>) -> bool {
    reader.get_mut().fill_buf().is_ok_and(<[u8]>::is_empty)
}

fn data_error(
    error: &ParseError,
    head: &Header,
    element: &ElementDef,
    vertices_read: u64,
    gather: &Gather<'_>,
) -> ScanFileError {
    let file = gather.file.to_owned();
    if error.kind() == ErrorKind::UnexpectedEof {
        return truncated(element, gather);
    }
    if let Some(source) = from_below(error) {
        return ScanFileError::Read {
            file,
            after: format!("{vertices_read} vertices"),
            source,
        };
    }
    let place = match (head.encoding, error.line()) {
        (Encoding::Ascii, Some(line)) => Place::Line(line as u64),
        _ => Place::Vertex(vertices_read + 1),
    };
    ScanFileError::PlyData {
        file,
        place,
        detail: detail(error, head),
    }
}

/// An error of the source itself, such as damaged compressed data, which the parser hands on.
fn from_below(error: &ParseError) -> Option<std::io::Error> {
    let text = one_line(error);
    (error.kind() == ErrorKind::InvalidData && text.contains("compressed data"))
        .then(|| std::io::Error::new(ErrorKind::InvalidData, text))
}

/// What is wrong with the data, in the user's words where the parser has none.
fn detail(error: &ParseError, head: &Header) -> String {
    let text = one_line(error);
    if text.contains("valid UTF-8") && head.encoding == Encoding::Ascii {
        return "the data are not text, though the header says `format ascii`".into();
    }
    if is_short(error) {
        let line = text.split('\'').nth(1).unwrap_or_default().trim();
        return format!("`{line}` has fewer values than the header announces");
    }
    if text.contains("unsupported by the destination") {
        return format!(
            "a list of more than {} values; the data are damaged, or not in the byte order and \
             format that the header says",
            vertex::LONGEST_LIST
        );
    }
    text
}

/// The parser's message without its line breaks and the line's number, which stands
/// elsewhere, and short enough for a terminal.
fn one_line(error: &ParseError) -> String {
    const LENGTH: usize = 160;
    let joined = error.to_string();
    let place = error.line().map(|line| format!("Line {line}: "));
    let bare = place.and_then(|place| joined.strip_prefix(&place));
    let bare = bare.unwrap_or(&joined);
    // What the parser's grammar would have taken is of no use to users.
    let bare = bare
        .split_once("Error: ParseError")
        .map_or(bare, |(told, _)| told);
    let words: Vec<&str> = bare.split_whitespace().collect();
    let text = words.join(" ");
    if text.chars().count() <= LENGTH {
        text
    } else {
        text.chars().take(LENGTH).chain("...".chars()).collect()
    }
}
