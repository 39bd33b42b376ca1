//! Standard output: text for people, or one JSON document for programs.

use std::io::Write;

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use relief_api::THE_SCANNER;
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

/// The same of things that scanners did; their names come in at column `at`, unless nobody has
/// given the only scanner one.
pub(crate) fn of_scanners<'a>(
    heading: &[&str],
    at: usize,
    numbers: &[usize],
    lines: impl Iterator<Item = (&'a str, Vec<String>)>,
) -> String {
    let lines: Vec<(&str, Vec<String>)> = lines.collect();
    let named = |(name, _): &(&str, Vec<String>)| !matches!(*name, "" | THE_SCANNER);
    if !lines.iter().any(named) {
        return table(heading, numbers, lines.into_iter().map(|(_, line)| line));
    }
    let mut heading = heading.to_vec();
    heading.insert(at, "SCANNER");
    let numbers: Vec<usize> = numbers.iter().map(|&n| n + usize::from(n >= at)).collect();
    let lines = lines.into_iter().map(|(name, mut line)| {
        line.insert(at, name.to_owned());
        line
    });
    table(&heading, &numbers, lines)
}

/// A scanner in a sentence; one that nobody has named is "scanner".
pub(crate) fn scanner(name: &str) -> String {
    match name {
        "" | THE_SCANNER => "scanner".to_owned(),
        name => format!("scanner {name}"),
    }
}

/// " on" a scanner, behind what it did; nothing where nobody has given the only one a name.
pub(crate) fn on_scanner(name: &str) -> String {
    match name {
        "" | THE_SCANNER => String::new(),
        name => format!(" on {name}"),
    }
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

    #[test]
    fn scanners_are_told_apart_where_they_have_names() {
        let told = |scanners: [&'static str; 2]| {
            let line = |n: &str| vec![n.to_owned(), "7".to_owned()];
            let lines = scanners.into_iter().zip([line("a"), line("b")]);
            of_scanners(&["SCAN", "COLUMNS"], 1, &[1], lines)
        };
        let without = "SCAN   COLUMNS\na            7\nb            7";
        assert_eq!(told(["", "scanner"]), without);
        assert_eq!(
            told(["left", "scanner"]),
            "SCAN   SCANNER   COLUMNS\na      left            7\nb      scanner         7"
        );
    }
}
