//! What can be wrong with a scan file.

use std::fmt;
use std::io;

/// Where in a file something is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A line, counted from 1.
    Line(u64),
    /// A vertex of a PLY file, counted from 1.
    Vertex(u64),
    /// A point handed over by another reader, counted from 1.
    Point(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(number) => write!(f, "line {number}"),
            Self::Vertex(number) => write!(f, "vertex {number}"),
            Self::Point(number) => write!(f, "point {number}"),
        }
    }
}

/// Why a scan file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScanFileError {
    /// The file could not be opened.
    #[error("{file}: cannot be opened: {source}")]
    Open {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// Reading or decompressing failed part of the way.
    #[error("{file}: reading failed after {after}: {source}")]
    Read {
        /// The file.
        file: String,
        /// How far reading got.
        after: String,
        /// What the system or the decompressor said.
        source: io::Error,
    },
    /// Compressed data that turn out to be damaged after their content made no sense.
    #[error("{file}: {source}")]
    Damaged {
        /// The file.
        file: String,
        /// What the decompressor said.
        source: io::Error,
    },
    /// Compressed within compressed within compressed.
    #[error("{file}: is gzip-compressed more than {limit} times over; unpack it first")]
    PackedTooOften {
        /// The file.
        file: String,
        /// Most layers accepted.
        limit: u32,
    },
    /// Not a byte.
    #[error("{file}: is empty{}", if *packed { " when unpacked" } else { "" })]
    Empty {
        /// The file.
        file: String,
        /// It is so after decompression.
        packed: bool,
    },
    /// Neither PLY nor text.
    #[error(
        "{file}: byte {byte} (value {value:#04x}) cannot be part of a text file; \
         expected PLY or lines of `x y z`, plain or gzip-compressed"
    )]
    NotText {
        /// The file.
        file: String,
        /// Offset of the offending byte in the decompressed data, from 0.
        byte: u64,
        /// The byte.
        value: u8,
    },
    /// A known format that holds no points, or none that are read.
    #[error(
        "{file}: is {format}, which is not read; expected PLY or lines of `x y z`, plain or \
         gzip-compressed"
    )]
    OtherFormat {
        /// The file.
        file: String,
        /// The format, with its article.
        format: &'static str,
    },
    /// More lines than any file of points that is read.
    #[error(
        "{file}: has more than {limit} lines, far more than points that are read; leave out blank \
         lines and comments"
    )]
    TooManyLines {
        /// The file.
        file: String,
        /// The limit.
        limit: u64,
    },
    /// A line longer than any line of numbers.
    #[error("{file}, line {line}: longer than {limit} bytes; a line holds one point")]
    LongLine {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// The limit.
        limit: usize,
    },
    /// A field that should be a number is not.
    #[error("{file}, line {line}: `{text}` is not a number; expected `x y z`")]
    NotANumber {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// The field.
        text: String,
    },
    /// Numbers with decimal commas where the comma may also separate.
    #[error(
        "{file}, line {line}: `{text}` looks like numbers with decimal commas; \
         write decimal points, or separate the numbers by semicolons"
    )]
    DecimalComma {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// The text.
        text: String,
    },
    /// Fewer than three numbers.
    #[error("{file}, line {line}: {found} value(s); a point needs x, y and z")]
    TooFewValues {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// Values found.
        found: usize,
    },
    /// The last line ends before its point does.
    #[error(
        "{file}, line {line}: the file ends in the middle of this line, after {found} value(s) \
         of `x y z`; it was cut off, copy or export it again"
    )]
    CutOff {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// Whole or broken values found.
        found: usize,
    },
    /// Most points have a coordinate that is NaN or infinite.
    #[error(
        "{file}: {unmeasured} of {all} points have a coordinate that is not a finite number, \
         the first at {first}; is this a file of measured points?"
    )]
    Unmeasured {
        /// The file.
        file: String,
        /// Points with such a coordinate.
        unmeasured: usize,
        /// Points in all.
        all: usize,
        /// Where the first is.
        first: Place,
    },
    /// A coordinate beyond what the 10 nm lattice reaches.
    #[error(
        "{file}, {place}: a coordinate of {} mm is beyond the limit of 21474 mm; \
         check the units, or move the part to the origin", short(*value_mm)
    )]
    TooFar {
        /// The file.
        file: String,
        /// Where.
        place: Place,
        /// The coordinate.
        value_mm: f64,
    },
    /// The header of a PLY file is wrong.
    #[error("{file}, line {line}: {detail}")]
    PlyHeader {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// What is wrong and what was expected.
        detail: String,
    },
    /// The data of a PLY file contradict its header.
    #[error("{file}, {place}: {detail}")]
    PlyData {
        /// The file.
        file: String,
        /// Where.
        place: Place,
        /// What is wrong.
        detail: String,
    },
    /// The file ends before the points that its header announces.
    #[error(
        "{file}: ends before the {announced} {element} entries that its header announces; \
         the file is cut off"
    )]
    PlyTruncated {
        /// The file.
        file: String,
        /// Kind of entry.
        element: String,
        /// Number announced.
        announced: u64,
    },
    /// More data than the header announces.
    #[error(
        "{file}: more data follow the {announced} vertex entries that its header announces; \
         the number or the format in the header is wrong"
    )]
    PlySurplus {
        /// The file.
        file: String,
        /// Number announced.
        announced: u64,
    },
    /// Nothing to work on.
    #[error("{file}: holds no points, only comments, blank lines or a header")]
    NoPoints {
        /// The file.
        file: String,
    },
    /// All points lie on one line of sight.
    #[error("{file}: {}", no_extent(*points))]
    NoExtent {
        /// The file.
        file: String,
        /// Number of distinct points.
        points: usize,
    },
    /// More points than the caller allows.
    #[error(
        "{file}: more than {limit} points, the most that are read; leave out every second column, or \
         cut the file into parts"
    )]
    TooManyPoints {
        /// The file.
        file: String,
        /// The limit.
        limit: usize,
    },
    /// The prescribed column pitch cannot be used.
    #[error("column pitch {pitch_mm} mm: must be finite and at least 0.0001 mm")]
    ColumnPitch {
        /// The pitch.
        pitch_mm: f64,
    },
}

fn no_extent(points: usize) -> String {
    if points == 1 {
        return "holds a single point, perhaps repeated; a surface needs hundreds".into();
    }
    format!(
        "all its points lie at one x and y ({points} different), so that there is no surface \
         between them"
    )
}

/// A number as people write it, whatever its size.
fn short(value: f64) -> String {
    if value.abs() < 1e9 {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}
