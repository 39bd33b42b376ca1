//! The raw header: bounded, and rid of lines that the PLY format does not know.

use std::io::{self, BufRead, Read};

use crate::error::ScanFileError;
use crate::gather::Gather;

/// Longest accepted header, bytes; real ones hold a few hundred.
const HEADER_LIMIT: usize = 256 * 1024;
/// Most entries of a kind that a header may announce; all numbers of 32 bits, with which
/// other programs count.
const MOST_ENTRIES: u64 = u32::MAX as u64;
/// Longest stretch of data without a line end, bytes, where lines are expected.
const LINE_LIMIT: usize = 1 << 20;
const KEYWORDS: [&str; 7] = [
    "ply",
    "format",
    "comment",
    "obj_info",
    "element",
    "property",
    "end_header",
];

/// Takes the header from the reader, `end_header` included. Lines that begin with no
/// known keyword become comments, so that line numbers stay true: scanners' programs
/// have left words of their own there (the Stanford range scans hold three lines `bye`).
pub(super) fn read_cleaned(
    reader: &mut impl BufRead,
    gather: &mut Gather<'_>,
) -> Result<Vec<u8>, ScanFileError> {
    let file = gather.file.to_owned();
    let refuse = |line: u64, detail: &str| ScanFileError::PlyHeader {
        file: file.clone(),
        line,
        detail: detail.to_owned(),
    };
    let mut header = Vec::new();
    let mut strays = Vec::new();
    for number in 1_u64.. {
        let start = header.len();
        // What replaces a line may be longer than the line was.
        let room = HEADER_LIMIT.saturating_sub(start) as u64;
        reader
            .by_ref()
            .take(room)
            .read_until(b'\n', &mut header)
            .map_err(|source| ScanFileError::Read {
                file: file.clone(),
                after: format!("line {}", number - 1),
                source,
            })?;
        let line = &header[start..];
        if !line.ends_with(b"\n") && header.len() >= HEADER_LIMIT {
            return Err(refuse(number, "no `end_header` within the first 256 KiB"));
        }
        if line.is_empty() {
            return Err(refuse(number, "the file ends before `end_header`"));
        }
        let Ok(text) = std::str::from_utf8(line) else {
            // Free text in an 8-bit encoding; what matters in a header is ASCII.
            replace_by_comment(&mut header, start);
            continue;
        };
        let keyword = text.split_whitespace().next().unwrap_or_default();
        if keyword == "end_header" {
            break;
        }
        if let Some(detail) = count_problem(text) {
            return Err(refuse(number, &detail));
        }
        if !KEYWORDS.contains(&keyword) {
            if !keyword.is_empty() {
                strays.push(format!("line {number} `{}`", text.trim()));
            }
            replace_by_comment(&mut header, start);
        }
    }
    if let Some(first) = strays.first() {
        gather.note(format!(
            "{} header line(s) that PLY does not know were ignored, the first: {first}",
            strays.len()
        ));
    }
    Ok(header)
}

/// What is wrong with the number in `element NAME NUMBER`.
fn count_problem(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    if words.next() != Some("element") {
        return None;
    }
    let (name, count) = (words.next()?, words.next().unwrap_or_default());
    let whole = !count.is_empty() && count.bytes().all(|b| b.is_ascii_digit());
    if whole && count.parse::<u64>().is_ok_and(|n| n <= MOST_ENTRIES) {
        return None;
    }
    Some(format!(
        "`{}` should announce how many {name} entries there are, as a whole number up to \
         {MOST_ENTRIES}",
        line.trim()
    ))
}

fn replace_by_comment(header: &mut Vec<u8>, start: usize) {
    header.truncate(start);
    header.extend_from_slice(b"comment\n");
}

/// A reader that fails, rather than filling memory, when someone asks it for lines and
/// none ends. Binary readers, which take exact numbers of bytes, are not bounded.
pub(super) struct BoundedLines<R> {
    inner: R,
    since_line_end: usize,
}

impl<R> BoundedLines<R> {
    pub(super) fn new(inner: R) -> Self {
        Self {
            inner,
            since_line_end: 0,
        }
    }
}

impl<R: BufRead> Read for BoundedLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.since_line_end = 0;
        self.inner.read(buffer)
    }
}

impl<R: BufRead> BufRead for BoundedLines<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.since_line_end > LINE_LIMIT {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "a line of more than 1 MiB; a line holds one entry",
            ));
        }
        self.inner.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        if let Ok(piece) = self.inner.fill_buf() {
            let taken = &piece[..amount.min(piece.len())];
            match taken.iter().rposition(|b| *b == b'\n') {
                Some(end) => self.since_line_end = taken.len() - end - 1,
                None => self.since_line_end += taken.len(),
            }
        }
        self.inner.consume(amount);
    }
}
