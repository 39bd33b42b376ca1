//! The five sections as they grow, and their 80-column lines.
//!
//! Entities are added in the order of their directory entries and may point only to
//! entities added before them, so every number is known the moment it is written.

use std::io;

use super::error::{MAX_LINES, WriteError};
use super::fields;

/// Columns of a parameter line that hold values; 65 is blank, 66 to 72 point back.
const PARAMETER_COLUMNS: usize = 64;
/// Columns of a Start or Global line that hold text.
const TEXT_COLUMNS: usize = 72;

/// Sequence number of an entity's first directory line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pointer(usize);

/// The second and fourth pair of digits of the status number (fields 9).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Status {
    /// A thing of its own.
    Independent,
    /// Part of the entity that points to it.
    Dependent,
    /// The same, with coordinates in a parameter plane (use flag 05).
    DependentInParameterPlane,
    /// A definition that others refer to (use flag 02).
    Definition,
    /// The same as part of the entity that points to it.
    DependentDefinition,
}

impl Status {
    fn digits(self) -> &'static str {
        match self {
            Self::Independent => "00000000",
            Self::Dependent => "00010000",
            Self::DependentInParameterPlane => "00010500",
            Self::Definition => "00000200",
            Self::DependentDefinition => "00010200",
        }
    }
}

/// A directory entry, less what the sheet itself knows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<'a> {
    /// Entity type number.
    pub(super) entity: u16,
    /// Form number.
    pub(super) form: u8,
    /// Line font: 1 for solid lines, 0 where there is nothing to draw.
    pub(super) line_font: u8,
    /// Level.
    pub(super) level: u16,
    /// Status digits.
    pub(super) status: Status,
    /// Colour.
    pub(super) colour: ColourField,
    /// Up to eight characters.
    pub(super) label: &'a str,
    /// Number after the label.
    pub(super) subscript: usize,
}

/// The colour field of a directory entry.
#[derive(Debug, Clone, Copy)]
pub(super) enum ColourField {
    /// One of the standard's eight, 0 for none.
    Number(u8),
    /// A definition, entity 314.
    Defined(Pointer),
}

/// The Directory and Parameter sections of a file in the making.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    directory: String,
    directory_lines: usize,
    parameters: String,
    parameter_lines: usize,
}

impl Sheet {
    /// Number of entities so far.
    pub(super) fn entities(&self) -> usize {
        self.directory_lines / 2
    }

    /// Begins an entity; it exists once [`Record::finish`] is called.
    pub(super) fn begin<'a>(&'a mut self, entry: Entry<'a>) -> Record<'a> {
        let first_line = self.parameter_lines + 1;
        let mut record = Record {
            sheet: self,
            entry,
            first_line,
            line: String::with_capacity(80),
        };
        record.integer(usize::from(entry.entity));
        record
    }

    /// Writes the whole file.
    pub(super) fn write(
        &self,
        start: &str,
        global: &[String],
        out: &mut impl io::Write,
    ) -> Result<usize, WriteError> {
        let mut head = String::new();
        let start_lines = section_lines(&mut head, 'S', &wrap_text(start));
        let global_lines = section_lines(&mut head, 'G', &wrap_fields(global));
        out.write_all(head.as_bytes())?;
        out.write_all(self.directory.as_bytes())?;
        out.write_all(self.parameters.as_bytes())?;
        let counts = format!(
            "S{start_lines:7}G{global_lines:7}D{:7}P{:7}",
            self.directory_lines, self.parameter_lines
        );
        let last = format!("{counts:<72}T{:7}\n", 1);
        out.write_all(last.as_bytes())?;
        Ok(head.len() + self.directory.len() + self.parameters.len() + last.len())
    }
}

/// The parameters of one entity. Values are broken over lines between values only.
#[derive(Debug)]
pub(super) struct Record<'a> {
    sheet: &'a mut Sheet,
    entry: Entry<'a>,
    first_line: usize,
    /// Values so far on the line being filled, each with its delimiter.
    line: String,
}

impl Record<'_> {
    pub(super) fn integer(&mut self, value: usize) {
        self.value(|out| out.push_str(&value.to_string()));
    }

    pub(super) fn real(&mut self, value: f64) {
        self.value(|out| fields::real(out, value));
    }

    pub(super) fn reals(&mut self, values: &[f64]) {
        for &value in values {
            self.real(value);
        }
    }

    pub(super) fn text(&mut self, value: &str) {
        self.value(|out| fields::text(out, value));
    }

    pub(super) fn pointer(&mut self, value: Pointer) {
        self.integer(value.0);
    }

    fn value(&mut self, spell: impl FnOnce(&mut String)) {
        let before = self.line.len();
        spell(&mut self.line);
        self.line.push(',');
        if self.line.len() <= PARAMETER_COLUMNS {
            return;
        }
        let value = self.line.split_off(before);
        if before > 0 {
            self.end_line();
        }
        self.line = value;
        // Only a string can be longer than a line; it alone may run on.
        while self.line.len() > PARAMETER_COLUMNS {
            let rest = self.line.split_off(PARAMETER_COLUMNS);
            self.end_line();
            self.line = rest;
        }
    }

    fn end_line(&mut self) {
        use std::fmt::Write as _;
        self.sheet.parameter_lines += 1;
        let owner = self.sheet.directory_lines + 1;
        let number = self.sheet.parameter_lines;
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.sheet.parameters,
            "{:<64} {owner:7}P{number:7}",
            self.line
        );
        self.line.clear();
    }

    /// Ends the record and adds the directory entry.
    pub(super) fn finish(mut self) -> Result<Pointer, WriteError> {
        use std::fmt::Write as _;
        self.line.pop();
        self.line.push(';');
        self.end_line();
        let Self {
            sheet,
            entry,
            first_line,
            ..
        } = self;
        let lines = sheet.parameter_lines + 1 - first_line;
        let pointer = Pointer(sheet.directory_lines + 1);
        let colour = match entry.colour {
            ColourField::Number(number) => number.to_string(),
            ColourField::Defined(Pointer(line)) => format!("-{line}"),
        };
        let _ = writeln!(
            sheet.directory,
            "{:8}{first_line:8}{:8}{:8}{:8}{:8}{:8}{:8}{}D{:7}",
            entry.entity,
            0,
            entry.line_font,
            entry.level,
            0,
            0,
            0,
            entry.status.digits(),
            pointer.0,
        );
        let _ = writeln!(
            sheet.directory,
            "{:8}{:8}{colour:>8}{lines:8}{:8}{:16}{:>8}{:8}D{:7}",
            entry.entity,
            0,
            entry.form,
            "",
            entry.label,
            entry.subscript,
            pointer.0 + 1,
        );
        sheet.directory_lines += 2;
        if sheet.directory_lines.max(sheet.parameter_lines) > MAX_LINES {
            return Err(WriteError::TooLarge);
        }
        Ok(pointer)
    }
}

/// Global fields over lines: broken between fields where a field fits on a line.
fn wrap_fields(fields: &[String]) -> Vec<String> {
    let mut lines = vec![String::new()];
    for (index, field) in fields.iter().enumerate() {
        let delimiter = if index + 1 == fields.len() { ';' } else { ',' };
        let mut value = format!("{field}{delimiter}");
        let used = lines.last().map_or(0, String::len);
        if used > 0 && used + value.len() > TEXT_COLUMNS {
            lines.push(String::new());
        }
        while value.len() > TEXT_COLUMNS {
            let rest = value.split_off(TEXT_COLUMNS);
            if let Some(last) = lines.last_mut() {
                last.push_str(&value);
            }
            lines.push(String::new());
            value = rest;
        }
        if let Some(last) = lines.last_mut() {
            last.push_str(&value);
        }
    }
    lines
}

/// Free text over lines.
fn wrap_text(text: &str) -> Vec<String> {
    let safe: Vec<char> = text.chars().map(fields::printable).collect();
    let lines: Vec<String> = safe
        .chunks(TEXT_COLUMNS)
        .map(|chunk| chunk.iter().collect())
        .collect();
    if lines.is_empty() {
        vec![String::new()]
    } else {
        lines
    }
}

fn section_lines(out: &mut String, letter: char, lines: &[String]) -> usize {
    use std::fmt::Write as _;
    for (index, line) in lines.iter().enumerate() {
        let _ = writeln!(out, "{line:<72}{letter}{:7}", index + 1);
    }
    lines.len()
}
