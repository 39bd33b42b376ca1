//! Which format a scan file has, by its content, and which its name promises.

use std::path::Path;

/// Column (from 0) of the section letter in a line of IGES, and its columns in all.
const IGES_SECTION_COLUMN: usize = 72;
const IGES_LINE: usize = 80;

/// A format that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    /// Lines of `x y z`, or something that nobody reads.
    Text,
    Ply,
    Iges,
    Journal,
}

impl Format {
    /// By the first bytes. The name decides only between a damaged IGES file and text.
    pub(super) fn of(head: &[u8], path: &Path) -> Self {
        if head.starts_with(&scan_record::MAGIC) {
            Self::Journal
        } else if head.starts_with(b"ply") {
            Self::Ply
        } else if is_iges(head) || (Self::by_name(path) == Some(Self::Iges) && nearly_iges(head)) {
            Self::Iges
        } else {
            Self::Text
        }
    }

    /// By the name, a `.gz` at its end left aside; `None` where it promises nothing.
    fn by_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        match name.rsplit_once('.')?.1 {
            "xyz" | "asc" | "csv" | "txt" => Some(Self::Text),
            "ply" => Some(Self::Ply),
            "igs" | "iges" => Some(Self::Iges),
            "scan" => Some(Self::Journal),
            _ => None,
        }
    }

    fn content(self) -> &'static str {
        match self {
            Self::Text => "text with a point on each line",
            Self::Ply => "a PLY file",
            Self::Iges => "an IGES file",
            Self::Journal => "a scan journal",
        }
    }

    /// What the user should know where name and content differ.
    pub(super) fn note(self, path: &Path, packed: bool) -> Option<String> {
        let named = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let ending = named.strip_suffix(".gz").unwrap_or(&named);
        let ending = ending.rsplit_once('.').map_or("", |(_, ending)| ending);
        if let Some(promised) = Self::by_name(path).filter(|&promised| promised != self) {
            return Some(format!(
                "it is named .{ending} as {} would be, but is {}{}, and was read as that",
                promised.content(),
                self.content(),
                if packed { ", gzip-compressed" } else { "" }
            ));
        }
        match (named.ends_with(".gz"), packed) {
            (true, false) => Some("it is named .gz, but is not compressed".into()),
            (false, true) => Some("it is gzip-compressed, though not named .gz".into()),
            _ => None,
        }
    }

    /// What the name says of a file that could not be read as this format.
    pub(super) fn hint(self, path: &Path) -> Option<&'static str> {
        if self != Self::Text {
            return None;
        }
        match Self::by_name(path)? {
            Self::Text => None,
            Self::Ply => Some("its name says PLY, but a PLY file begins with the line `ply`"),
            Self::Iges => Some(
                "its name says IGES, but the lines of an IGES file have 80 columns, with a \
                 section letter in column 73",
            ),
            Self::Journal => {
                Some("its name says scan journal, but a scan journal begins with `RELSCAN`")
            }
        }
    }
}

fn is_iges(head: &[u8]) -> bool {
    let line = head
        .split(|&b| b == b'\n' || b == b'\r')
        .next()
        .unwrap_or_default();
    let tail = line.get(IGES_SECTION_COLUMN + 1..IGES_LINE);
    matches!(
        line.get(IGES_SECTION_COLUMN),
        Some(b'S' | b'F' | b'B' | b'C')
    ) && tail.is_some_and(|tail| tail.iter().all(|b| b.is_ascii_digit() || *b == b' '))
}

/// Lines that end as those of the first two sections do, whatever their length.
fn nearly_iges(head: &[u8]) -> bool {
    head.split(|&b| b == b'\n' || b == b'\r').any(|line| {
        let line = line.trim_ascii_end();
        let digits = line.iter().rev().take_while(|b| b.is_ascii_digit()).count();
        let before = line[..line.len() - digits].trim_ascii_end();
        digits > 0 && before.len() > 1 && matches!(before.last(), Some(b'S' | b'G'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(letter: char) -> String {
        format!("{:<72}{letter}{:>7}\n", "A scan", 1)
    }

    #[test]
    fn iges_is_told_by_the_letter_of_its_first_line() {
        assert!(is_iges(line('S').as_bytes()));
        assert!(!is_iges(line('x').as_bytes()));
        assert!(!is_iges(b"1.0 2.0 3.0\n"));
        assert!(!is_iges(&[b'S'; 96]));
    }

    #[test]
    fn content_decides_and_the_name_helps_where_iges_is_damaged() {
        let shifted = line('S').replacen("A scan  ", "A scan", 1);
        for (head, name, format) in [
            (line('S').as_str(), "a.xyz", Format::Iges),
            ("ply\n", "a.igs", Format::Ply),
            ("1 2 3\n", "a.igs.gz", Format::Text),
            (&shifted, "A.IGS", Format::Iges),
            (&shifted, "a.xyz", Format::Text),
            ("RELSCAN\n", "a", Format::Journal),
        ] {
            assert_eq!(
                Format::of(head.as_bytes(), Path::new(name)),
                format,
                "{name}"
            );
        }
    }

    #[test]
    fn names_that_promise_something_else_are_remarked_on() {
        let note = |format: Format, name: &str, packed| format.note(Path::new(name), packed);
        assert_eq!(note(Format::Ply, "dir/a.ply", false), None);
        assert_eq!(note(Format::Ply, "a.PLY.gz", true), None);
        assert_eq!(note(Format::Text, "a.dat", false), None);
        let told = note(Format::Text, "a.igs", false).unwrap();
        assert!(told.contains("named .igs") && told.contains("text with a point"));
        assert!(
            note(Format::Text, "a.ply", true)
                .unwrap()
                .contains("gzip-compressed")
        );
        assert!(
            note(Format::Ply, "a.ply", true)
                .unwrap()
                .contains("not named .gz")
        );
        assert!(
            note(Format::Ply, "a.ply.gz", false)
                .unwrap()
                .contains("not compressed")
        );
        assert!(Format::Text.hint(Path::new("a.ply")).is_some());
        assert!(Format::Text.hint(Path::new("a.xyz")).is_none());
    }
}
