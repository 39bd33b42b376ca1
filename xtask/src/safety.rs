//! The table of hazards in `docs/safety.md`: every row names tests, and they exist.

use std::fs;

use anyhow::{Context, Result};

use crate::shell;

/// Where the table stands.
const PAGE: &str = "docs/safety.md";

/// Adds what is wrong with the table.
pub(crate) fn check(broken: &mut Vec<String>) -> Result<()> {
    let page = fs::read_to_string(shell::root().join(PAGE))
        .with_context(|| format!("cannot read {PAGE}"))?;
    let mut sources = Vec::new();
    for path in shell::output("git", &["ls-files", "*.rs"])?.lines() {
        // A file may be gone that git still lists.
        sources.extend(fs::read_to_string(shell::root().join(path)));
    }
    broken.extend(missing(&page, &sources));
    Ok(())
}

/// What is wrong: rows without a test, and tests that are not there.
fn missing(page: &str, sources: &[String]) -> Vec<String> {
    let mut broken = Vec::new();
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| ")).collect();
    // The first two are the heading and the rule below it.
    let rows = rows.iter().filter(|row| !row.starts_with("| hazard |"));
    let mut count = 0;
    for row in rows.filter(|row| !row.starts_with("| ---")) {
        count += 1;
        let cell = row.trim_end_matches([' ', '|']).rsplit('|').next();
        let names: Vec<&str> = cell
            .unwrap_or_default()
            .split('`')
            .skip(1)
            .step_by(2)
            .collect();
        let hazard = row.split('|').nth(1).unwrap_or_default().trim();
        if names.is_empty() {
            broken.push(format!("{PAGE}: no test for `{hazard}`"));
        }
        for name in names {
            if !sources.iter().any(|source| has_test(source, name)) {
                broken.push(format!("{PAGE}: there is no test {name}, of `{hazard}`"));
            }
        }
    }
    if count == 0 {
        broken.push(format!("{PAGE}: the table of hazards is missing"));
    }
    broken
}

/// Whether a source has a test of that name, not merely a function.
fn has_test(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim_start).collect();
    let function = format!("fn {name}(");
    lines.iter().enumerate().any(|(at, line)| {
        let attributes = lines[..at]
            .iter()
            .rev()
            .take_while(|line| line.starts_with("#[") || line.starts_with("//"));
        (line.starts_with(&function) || line.starts_with(&format!("async {function}")))
            && attributes
                .copied()
                .any(|line| line.starts_with("#[test]") || line.starts_with("#[tokio::test"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hazard_names_tests_that_exist() {
        let mut broken = Vec::new();
        check(&mut broken).unwrap();
        assert_eq!(broken, Vec::<String>::new());
    }

    #[test]
    fn what_is_missing_is_named() {
        let sources = [
            "#[test]\nfn there() {}\n\nfn helper() {}\n".to_owned(),
            "    #[tokio::test(flavor = \"x\")]\n    async fn also() {}\n".to_owned(),
        ];
        let page = |rows: &str| format!("| hazard | cover | test |\n| --- | --- | --- |\n{rows}");
        let good = page("| a | b | `there`, `also` |\n");
        assert_eq!(missing(&good, &sources), Vec::<String>::new());
        for (rows, wrong) in [
            ("", "the table of hazards is missing"),
            ("| a | b `there` | none |\n", "no test for `a`"),
            ("| a | b | `there`, `gone` |\n", "there is no test gone"),
            ("| a | b | `helper` |\n", "there is no test helper"),
        ] {
            let broken = missing(&page(rows), &sources);
            assert_eq!(broken.len(), 1, "{broken:?}");
            assert!(broken[0].contains(wrong), "{broken:?}");
        }
    }
}
