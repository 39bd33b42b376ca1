//! Lines of a text file, with any of the three line ends, and never of unbounded length.

use std::io::BufRead;

use crate::MOST_POINTS;
use crate::error::ScanFileError;

/// Longest accepted line, bytes: a point with dozens of further columns fits.
const LINE_LIMIT: usize = 16 * 1024;
/// Most lines that are read: four for each of the points that are. A few kB of gzip can unfold
/// to a thousand million that are blank.
const MOST_LINES: u64 = 4 * MOST_POINTS as u64;
const BYTE_ORDER_MARK: &str = "\u{feff}";
/// Ctrl-Z, the end-of-file mark that some DOS programs leave behind.
const END_MARK: char = '\u{1a}';

/// A line of the file.
pub(crate) struct Line<'a> {
    /// Its number, from 1.
    pub(crate) number: u64,
    pub(crate) text: &'a str,
    /// A line end follows it; false for what a file that was cut off ends with.
    pub(crate) ended: bool,
}

pub(crate) struct Lines<'a, R> {
    reader: R,
    file: &'a str,
    line: Vec<u8>,
    /// Number of the current line, from 1.
    number: u64,
    /// Offset of the current line's first byte.
    start: u64,
    /// Bytes taken from the reader.
    consumed: u64,
    skip_line_feed: bool,
    most_lines: u64,
}

impl<'a, R: BufRead> Lines<'a, R> {
    pub(crate) fn new(reader: R, file: &'a str) -> Self {
        Self {
            reader,
            file,
            line: Vec::new(),
            number: 0,
            start: 0,
            consumed: 0,
            skip_line_feed: false,
            most_lines: MOST_LINES,
        }
    }

    /// The next line, without its end and without a comment that is not UTF-8.
    pub(crate) fn next(&mut self) -> Result<Option<Line<'_>>, ScanFileError> {
        self.line.clear();
        let mut ended = false;
        self.start = self.consumed;
        loop {
            let piece = self
                .reader
                .fill_buf()
                .map_err(|source| ScanFileError::Read {
                    file: self.file.to_owned(),
                    after: format!("line {}", self.number),
                    source,
                })?;
            let Some(&first) = piece.first() else {
                if self.line.is_empty() {
                    return Ok(None);
                }
                break;
            };
            if std::mem::take(&mut self.skip_line_feed) && first == b'\n' {
                self.reader.consume(1);
                self.consumed += 1;
                self.start = self.consumed;
                continue;
            }
            let end = piece.iter().position(|b| matches!(b, b'\n' | b'\r'));
            let content = &piece[..end.unwrap_or(piece.len())];
            self.line.extend_from_slice(content);
            self.skip_line_feed = end.is_some_and(|end| piece[end] == b'\r');
            let used = content.len() + usize::from(end.is_some());
            self.reader.consume(used);
            self.consumed += used as u64;
            if self.line.len() > LINE_LIMIT {
                return Err(ScanFileError::LongLine {
                    file: self.file.to_owned(),
                    line: self.number + 1,
                    limit: LINE_LIMIT,
                });
            }
            if end.is_some() {
                ended = true;
                break;
            }
        }
        if self.number == self.most_lines {
            return Err(ScanFileError::TooManyLines {
                file: self.file.to_owned(),
                limit: self.most_lines,
            });
        }
        self.number += 1;
        let number = self.number;
        self.decoded().map(|text| {
            Some(Line {
                number,
                text,
                ended,
            })
        })
    }

    fn decoded(&self) -> Result<&str, ScanFileError> {
        let not_text = |at: usize| ScanFileError::NotText {
            file: self.file.to_owned(),
            byte: self.start + at as u64,
            value: self.line.get(at).copied().unwrap_or_default(),
        };
        let control = |b: &u8| *b < 0x20 && !matches!(b, b'\t' | 0x0b | 0x0c | 0x1a);
        if let Some(at) = self.line.iter().position(control) {
            return Err(not_text(at));
        }
        // Comments may be in any 8-bit encoding.
        let comment = self.line.iter().position(|b| *b == b'#');
        let content = &self.line[..comment.unwrap_or(self.line.len())];
        let text = std::str::from_utf8(content).map_err(|e| not_text(e.valid_up_to()))?;
        let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
        Ok(text.trim_end_matches(END_MARK))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_without_points_are_not_read_without_end() {
        let mut lines = Lines::new(&b"1 2 3\n\n#\n\n"[..], "test");
        lines.most_lines = 3;
        for _ in 0..3 {
            assert!(lines.next().unwrap().is_some());
        }
        let told = lines.next().map(|_| ()).unwrap_err().to_string();
        assert_eq!(
            told,
            "test: has more than 3 lines, far more than points that are read; leave out blank \
             lines and comments"
        );
    }
}
