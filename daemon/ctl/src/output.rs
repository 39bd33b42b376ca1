//! Standard output: text for people, or one JSON document for programs.

use std::io::Write;

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use serde::Serialize;

use crate::failure::Failure;

/// Prints text, ending it with a line break.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", text.trim_end())
        .and_then(|()| out.flush())
        .map_err(Failure::Output)
}

/// Prints a JSON document.
pub(crate) fn json(document: &impl Serialize) -> Result<(), Failure> {
    let rendered = serde_json::to_string_pretty(document)
        .map_err(|error| Failure::Output(std::io::Error::other(error)))?;
    text(&rendered)
}

/// Prints a document as JSON, or what `told` makes of it as text.
pub(crate) fn either<T: Serialize>(
    as_json: bool,
    document: &T,
    told: impl FnOnce(&T) -> String,
) -> Result<(), Failure> {
    if as_json {
        json(document)
    } else {
        text(&told(document))
    }
}

/// Lines in columns under a heading; the columns named in `numbers` are set to the right.
pub(crate) fn table(
    heading: &[&str],
    numbers: &[usize],
    lines: impl IntoIterator<Item = Vec<String>>,
) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(heading.iter().copied());
    table.add_rows(lines);
    let columns = heading.len();
    for (index, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, if index + 1 < columns { 3 } else { 0 }));
        if numbers.contains(&index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let lines: Vec<String> = table
        .lines()
        .map(|line| line.trim_end().to_owned())
        .collect();
    lines.join("\n")
}

/// "1 job", "3 jobs".
pub(crate) fn counted(number: usize, noun: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_and_numbers_stand_right() {
        let lines = [["a", "5", "x"], ["long", "123", ""]].map(|l| l.map(String::from).to_vec());
        let table = table(&["name", "n", "note"], &[1], lines);
        assert_eq!(table, "name     n   note\na        5   x\nlong   123");
    }
}
