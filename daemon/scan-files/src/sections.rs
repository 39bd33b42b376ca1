//! Stacked cross-sections as text: a block of points for each.
//!
//! A block ends at a blank line, or where a line begins with `section`. That line may say `open` or
//! `closed`, and give a name; else a section's ends tell what it is. Points are written as in scan
//! files.

use std::io::BufRead;

use crate::error::ScanFileError;
use crate::text::{Layouts, Lines};
use crate::units::Units;

/// Most points of a file.
const MOST_POINTS: usize = 1 << 22;

/// A section as the file has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RawSection {
    /// The name that the file gives.
    pub name: Option<String>,
    /// Line of its first point, from 1.
    pub line: u64,
    /// Millimetres.
    pub points: Vec<[f64; 3]>,
    /// Whether it is closed, where the file says so.
    pub is_closed: Option<bool>,
}

/// Reads sections from text; `file` stands for it in errors.
///
/// # Errors
/// [`ScanFileError`], naming the line; [`ScanFileError::NoPoints`] where there are none.
pub fn read_sections(
    reader: impl BufRead,
    file: &str,
    units: Option<Units>,
) -> Result<Vec<RawSection>, ScanFileError> {
    let scale_mm = units.unwrap_or(Units::Millimetre).in_mm();
    let mut lines = Lines::new(reader, file);
    let mut sections = Vec::new();
    let mut own = RawSection::default();
    let mut layouts = Layouts::default();
    let mut count = 0;
    while let Some(line) = lines.next()? {
        let (number, content) = (line.number, line.text.trim());
        let head = heading(content);
        if content.is_empty() || head.is_some() {
            if !own.points.is_empty() {
                sections.push(std::mem::take(&mut own));
            }
            if let Some(head) = head {
                own = head;
            }
            continue;
        }
        let Some(layout) = layouts.of(content) else {
            continue;
        };
        let point = layout
            .point(content)
            .map_err(|problem| problem.at(file, number))?;
        count += 1;
        if count > MOST_POINTS {
            return Err(ScanFileError::TooManyPoints {
                file: file.to_owned(),
                limit: MOST_POINTS,
            });
        }
        if own.points.is_empty() {
            own.line = number;
        }
        own.points.push(point.xyz.map(|c| c * scale_mm));
    }
    if !own.points.is_empty() {
        sections.push(own);
    }
    if sections.is_empty() {
        return Err(ScanFileError::NoPoints {
            file: file.to_owned(),
        });
    }
    Ok(sections)
}

/// What a line says that begins a section.
fn heading(content: &str) -> Option<RawSection> {
    let mut words = content.split_whitespace();
    let first = words.next()?;
    if !first.eq_ignore_ascii_case("section") {
        return None;
    }
    let (mut name, mut is_closed) = (Vec::new(), None);
    for word in words {
        match word.to_ascii_lowercase().as_str() {
            "open" => is_closed = Some(false),
            "closed" => is_closed = Some(true),
            _ => name.push(word),
        }
    }
    Some(RawSection {
        name: (!name.is_empty()).then(|| name.join(" ")),
        is_closed,
        ..RawSection::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<RawSection>, ScanFileError> {
        read_sections(text.as_bytes(), "a.txt", None)
    }

    #[test]
    fn blank_lines_and_headings_part_sections() {
        let text = "# a body\n0 0 1\n1 0 1\n\n\n0 0 2\n1 0 2\n1 1 2\nsection waist closed\n0,0,3\n";
        let sections = read(text).unwrap();
        let shape: Vec<(u64, usize)> = sections.iter().map(|s| (s.line, s.points.len())).collect();
        assert_eq!(shape, [(2, 2), (6, 3), (10, 1)]);
        assert_eq!(sections[2].name.as_deref(), Some("waist"));
        assert_eq!(
            (sections[2].is_closed, sections[1].is_closed),
            (Some(true), None)
        );
        assert_eq!(sections[1].points[2], [1.0, 1.0, 2.0]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let error = |text: &str| read(text).unwrap_err().to_string();
        assert!(error("0 0 1\n1 x 1\n").contains("line 2"));
        assert!(error("0 0 1\n1 2\n").contains("line 2"));
        assert!(error("section\n\n").contains("a.txt"));
    }

    #[test]
    fn units_become_millimetres() {
        let metres = read_sections("1 2 3\n".as_bytes(), "a", Some(Units::Metre)).unwrap();
        assert_eq!(metres[0].points, [[1000.0, 2000.0, 3000.0]]);
    }
}
