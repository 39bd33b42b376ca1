//! The lowest layer: bytes to 80-column lines, sorted into sections.

use std::io::Read;
use std::ops::Range;

use super::error::ReadError;

/// Largest file that is read, bytes; it is held in memory as a whole. Some four million
/// points fit.
pub const MAX_FILE_BYTES: u64 = 1 << 27;

/// Columns of a line.
const COLUMNS: usize = 80;
/// Index of the section letter, column 73.
const LETTER: usize = 72;

/// A line of a section.
#[derive(Debug, Clone)]
struct Line {
    /// Of the file, counted from 1.
    number: usize,
    bytes: Range<usize>,
}

/// A section of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Section {
    Start,
    Global,
    Directory,
    Parameter,
    Terminate,
}

impl Section {
    fn of(letter: u8) -> Option<Self> {
        Some(match letter {
            b'S' => Self::Start,
            b'G' => Self::Global,
            b'D' => Self::Directory,
            b'P' => Self::Parameter,
            b'T' => Self::Terminate,
            _ => return None,
        })
    }

    fn name(self) -> &'static str {
        match self {
            Self::Start => "Start",
            Self::Global => "Global",
            Self::Directory => "Directory",
            Self::Parameter => "Parameter",
            Self::Terminate => "Terminate",
        }
    }
}

/// A file as lines.
#[derive(Debug)]
pub(super) struct Lines {
    bytes: Vec<u8>,
    sections: [Vec<Line>; 5],
}

impl Lines {
    pub(super) fn read(source: impl Read) -> Result<Self, ReadError> {
        let mut bytes = Vec::new();
        source.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(ReadError::TooLarge {
                limit: MAX_FILE_BYTES,
            });
        }
        let mut sections: [Vec<Line>; 5] = Default::default();
        let mut current = Section::Start;
        let mut number = 0;
        'file: for physical in physical_lines(&bytes) {
            let text = trimmed(&bytes, &physical);
            if text.is_empty() {
                number += 1;
                continue;
            }
            // Some files have no line ends at all.
            let mut from = physical.start;
            while from < text.end {
                number += 1;
                let record = from..(from + COLUMNS).min(physical.end);
                let section = section_of(&bytes, &record, number, text.len())?;
                if section < current {
                    return Err(ReadError::Line {
                        line: number,
                        reason: format!(
                            "a line of the {} section stands in or after the {} section",
                            section.name(),
                            current.name()
                        ),
                    });
                }
                current = section;
                let lines = &mut sections[section as usize];
                check_sequence(&bytes, &record, number, section, lines.len() + 1)?;
                from = record.end;
                lines.push(Line {
                    number,
                    bytes: record,
                });
                if section == Section::Terminate {
                    // Whatever follows is not part of the file.
                    break 'file;
                }
            }
        }
        Self { bytes, sections }.whole()
    }

    fn whole(self) -> Result<Self, ReadError> {
        if self.sections.iter().all(Vec::is_empty) {
            return Err(ReadError::Empty);
        }
        for section in [Section::Global, Section::Terminate] {
            if self.count(section) == 0 {
                return Err(ReadError::Section {
                    section: section.name(),
                });
            }
        }
        Ok(self)
    }

    /// Number of lines of a section.
    pub(super) fn count(&self, section: Section) -> usize {
        self.sections[section as usize].len()
    }

    /// Columns of a line of a section, both counted from 0; short where the line is.
    pub(super) fn columns(&self, section: Section, line: usize, columns: Range<usize>) -> &[u8] {
        let Some(line) = self.sections[section as usize].get(line) else {
            return &[];
        };
        let end = (line.bytes.start + columns.end).min(line.bytes.end);
        self.bytes
            .get(line.bytes.start + columns.start..end)
            .unwrap_or_default()
    }

    /// Number in the file, from 1, of a line of a section, counted from 0.
    pub(super) fn number(&self, section: Section, line: usize) -> usize {
        let lines = &self.sections[section as usize];
        lines
            .get(line)
            .or(lines.last())
            .map_or(0, |line| line.number)
    }
}

/// Ranges between line ends of any kind: LF, CR LF or CR.
fn physical_lines(bytes: &[u8]) -> impl Iterator<Item = Range<usize>> {
    let mut from = 0;
    std::iter::from_fn(move || {
        let rest = bytes.get(from..).filter(|rest| !rest.is_empty())?;
        let length = rest
            .iter()
            .position(|b| matches!(b, b'\n' | b'\r'))
            .unwrap_or(rest.len());
        let line = from..from + length;
        let ending = if rest[length..].starts_with(b"\r\n") {
            2
        } else {
            1
        };
        from += length + ending;
        Some(line)
    })
}

/// Without the blanks (and the end-of-file mark of old systems) at its end.
fn trimmed(bytes: &[u8], line: &Range<usize>) -> Range<usize> {
    let text = &bytes[line.clone()];
    let length = text
        .iter()
        .rposition(|b| !matches!(b, b' ' | b'\t' | 0 | 0x1a))
        .map_or(0, |last| last + 1);
    line.start..line.start + length
}

fn section_of(
    bytes: &[u8],
    record: &Range<usize>,
    number: usize,
    columns: usize,
) -> Result<Section, ReadError> {
    let letter = bytes
        .get(record.clone())
        .and_then(|record| record.get(LETTER))
        .copied();
    if let Some(section) = letter.and_then(Section::of) {
        return Ok(section);
    }
    if number == 1 {
        match letter {
            Some(b'C') => return Err(ReadError::Form { form: "compressed" }),
            Some(b'B') => return Err(ReadError::Form { form: "binary" }),
            _ => {}
        }
    }
    let found = match letter {
        None if number > 1 && record.end == bytes.len() => {
            "ends before it, and the file with it: the file was cut off".to_owned()
        }
        None => "ends before it".to_owned(),
        Some(letter) => format!("has {:?} there", char::from(letter)),
    };
    Err(ReadError::Line {
        line: number,
        reason: format!(
            "an IGES line has 80 columns and a section letter (S, G, D, P or T) in column 73, \
             but this line of {columns} columns {found}"
        ),
    })
}

/// Lines lost from the middle would shift every pointer, so the numbers that the lines
/// carry must agree with their places where pointers count on them.
fn check_sequence(
    bytes: &[u8],
    record: &Range<usize>,
    number: usize,
    section: Section,
    expected: usize,
) -> Result<(), ReadError> {
    if !matches!(section, Section::Directory | Section::Parameter) {
        return Ok(());
    }
    let digits = bytes
        .get(record.start + LETTER + 1..record.end)
        .and_then(|digits| std::str::from_utf8(digits).ok())
        .unwrap_or_default()
        .trim();
    if digits.parse() == Ok(expected) {
        return Ok(());
    }
    Err(ReadError::Line {
        line: number,
        reason: format!(
            "line {expected} of the {} section is numbered {digits:?}: lines are missing or out \
             of order",
            section.name()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str, letter: char, number: usize) -> String {
        format!("{text:<72}{letter}{number:7}")
    }

    fn sample(ending: &str) -> String {
        [
            line("start", 'S', 1),
            line(",,;", 'G', 1),
            line("S      1G      1", 'T', 1),
        ]
        .join(ending)
    }

    #[test]
    fn any_line_end_and_none() {
        for ending in ["\n", "\r\n", "\r", "", "\n\n", "   \n"] {
            let lines = Lines::read(sample(ending).as_bytes()).unwrap();
            assert_eq!(lines.count(Section::Global), 1, "{ending:?}");
            assert_eq!(lines.columns(Section::Global, 0, 0..3), b",,;");
        }
    }

    #[test]
    fn numbers_are_those_an_editor_shows() {
        let file = sample("\n").replacen('\n', "\n\n", 1);
        let lines = Lines::read(file.as_bytes()).unwrap();
        assert_eq!(lines.number(Section::Start, 0), 1);
        assert_eq!(lines.number(Section::Global, 0), 3);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let check = |file: &str, expected: &str| {
            let error = Lines::read(file.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        check("", "is empty");
        check(" \n\n", "is empty");
        check("solid part\n", "line 1: an IGES line has 80 columns");
        let cut = [line("", 'S', 1), line(",,;", 'G', 1)].join("\n");
        check(&cut[..120], "line 2: an IGES line has 80 columns");
        check(&cut[..120], "the file was cut off");
        check(&line("", 'C', 1), "compressed form");
        check(&line("", 'B', 1), "binary form");
        check(&line("", 'S', 1), "no Global section");
        check(
            &[line("", 'S', 1), line(",,;", 'G', 1)].join("\n"),
            "no Terminate section",
        );
        check(
            &[line("", 'G', 1), line("", 'S', 1)].join("\n"),
            "line 2: a line of the Start",
        );
        check(
            &[line("", 'G', 1), line("", 'D', 2)].join("\n"),
            "numbered \"2\"",
        );
    }
}
