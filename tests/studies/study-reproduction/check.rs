//! The committed page against a new one: text to the letter, numbers within tolerances.

/// Greatest differences by unit. Times are not compared: machines differ. Units that are not
/// listed are exact. The same program gives the same figures anywhere; the tolerances are
/// for changes that do not matter.
pub(crate) const TOLERANCES: [(&str, f64); 4] = [
    ("dB", 0.5),
    ("nodes", 10.0),
    ("pitches", 0.03),
    ("s", f64::INFINITY),
];

/// Which tables of a page are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    All,
    /// Not those whose text speaks of several seeds.
    FirstSeed,
}

/// How two pages differ, a line for each figure or text.
pub(crate) fn differences(committed: &str, fresh: &str, extent: Extent) -> Vec<String> {
    let (old, new): (Vec<&str>, Vec<&str>) = (committed.lines().collect(), fresh.lines().collect());
    let mut found = Vec::new();
    let (mut section, mut lead, mut heads) = ("", "", Vec::new());
    let (mut of_all_seeds, mut before) = (false, "");
    for (k, (was, is)) in old.iter().zip(&new).enumerate() {
        let (cells_was, cells_is) = (cells(was), cells(is));
        if let Some(title) = is.strip_prefix('#') {
            section = title.trim_start_matches('#').trim();
            lead = "";
        } else if cells_is.is_none() && !is.is_empty() {
            lead = is.strip_suffix(':').unwrap_or_default();
            of_all_seeds = (of_all_seeds && !before.is_empty()) || is.contains("seeds");
        }
        before = is;
        if extent == Extent::FirstSeed && of_all_seeds && cells_was.is_some() && cells_is.is_some()
        {
            continue;
        }
        match (cells_was, cells_is) {
            (Some(was), Some(is)) if was.len() == is.len() => {
                if k == 0 || cells(new[k - 1]).is_none() {
                    heads = is.clone();
                }
                let row = row_name(&is);
                let about = [section, lead, &row].map(str::to_owned);
                let about: Vec<String> = about.into_iter().filter(|a| !a.is_empty()).collect();
                for (column, (was, is)) in was.iter().zip(&is).enumerate() {
                    let head = heads.get(column).copied().unwrap_or_default();
                    if let Some(difference) = difference(was, is, head) {
                        found.push(format!("{}: {head}: {difference}", about.join(": ")));
                    }
                }
            }
            _ if was != is => found.push(format!(
                "line {}: {was:?} on the page, {is:?} expected",
                k + 1
            )),
            _ => {}
        }
    }
    if old.len() != new.len() {
        found.push(format!(
            "{} lines on the page, {} expected",
            old.len(),
            new.len()
        ));
    }
    found
}

/// The cells of a line of a table.
fn cells(line: &str) -> Option<Vec<&str>> {
    let inner = line.strip_prefix('|')?.strip_suffix('|')?;
    Some(inner.split('|').map(str::trim).collect())
}

/// What a row is about: its first cell, and those behind it up to one with a number.
fn row_name(cells: &[&str]) -> String {
    let (first, rest) = cells.split_at(1);
    let about = rest
        .iter()
        .take_while(|cell| parts(cell).iter().all(|p| matches!(p, Part::Text(_))));
    let about: Vec<&str> = first.iter().chain(about).copied().collect();
    about.join(", ")
}

#[derive(Debug, Clone, PartialEq)]
enum Part {
    Text(String),
    Number(f64),
}

/// A cell's numbers and what stands between them.
fn parts(cell: &str) -> Vec<Part> {
    let number = |word: &str| word.parse::<f64>().ok().filter(|v| v.is_finite());
    let words = cell.split_whitespace();
    words
        .map(|word| number(word).map_or_else(|| Part::Text(word.to_owned()), Part::Number))
        .collect()
}

fn tolerance(unit: &str) -> f64 {
    let known = TOLERANCES.iter().find(|(name, _)| *name == unit);
    known.map_or(0.0, |(_, most)| *most)
}

/// How two cells differ beyond tolerance, in words.
fn difference(was: &str, is: &str, head: &str) -> Option<String> {
    let of_column = head.rsplit_once(", ").map_or("", |(_, unit)| unit);
    if tolerance(of_column).is_infinite() {
        return None;
    }
    let (old, new) = (parts(was), parts(is));
    let told = |most: f64| match most {
        0.0 => format!("{was} on the page, {is} now"),
        _ => format!("{was} on the page, {is} now, more than {most} apart"),
    };
    if old.len() != new.len() {
        return Some(told(0.0));
    }
    for (k, pair) in old.iter().zip(&new).enumerate() {
        let most = match new.get(k + 1) {
            Some(Part::Text(unit)) if tolerance(unit) > 0.0 => tolerance(unit),
            _ => tolerance(of_column),
        };
        let same = match pair {
            // Decimals as printed are no whole multiples of anything binary.
            (Part::Number(a), Part::Number(b)) => (a - b).abs() <= most + 1e-9,
            (a, b) => a == b,
        };
        if !same {
            return Some(told(most));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# Title\n\nText.\n\n## Table 1\n\nMeasured:\n\n| region | way, dB | lost, nodes | t, s |\n\
                        | --- | --- | --- | --- |\n| top | 81.20 / 82.00 | 31 | 1.2 |\n";

    fn changed(from: &str, to: &str) -> Vec<String> {
        assert!(PAGE.contains(from));
        differences(PAGE, &PAGE.replace(from, to), Extent::All)
    }

    #[test]
    fn small_differences_and_times_pass() {
        assert!(changed("81.20", "81.70").is_empty());
        assert!(changed("31", "41").is_empty());
        assert!(changed("1.2 |", "77.1 |").is_empty());
    }

    #[test]
    fn a_figure_that_differs_is_named() {
        assert_eq!(
            changed("82.00", "82.51"),
            [
                "Table 1: Measured: top: way, dB: 81.20 / 82.00 on the page, 81.20 / 82.51 now, more than \
                 0.5 apart"
            ]
        );
        assert_eq!(changed("31", "42").len(), 1);
        assert_eq!(changed("31", "none").len(), 1);
    }

    #[test]
    fn text_is_compared_to_the_letter() {
        assert_eq!(changed("Text.", "Texts.").len(), 1);
        assert_eq!(changed("top", "side").len(), 1);
        assert_eq!(changed("lost", "found").len(), 1);
        assert_eq!(
            differences(PAGE, &format!("{PAGE}More.\n"), Extent::All),
            ["11 lines on the page, 12 expected"]
        );
    }

    #[test]
    fn a_unit_behind_a_number_counts_for_it() {
        let page = "| what | worst |\n| --- | --- |\n| SNR | 80.1 dB |\n| corners | 9 |\n";
        let changed =
            |from: &str, to: &str| differences(page, &page.replace(from, to), Extent::All);
        assert!(changed("80.1", "80.4").is_empty());
        assert_eq!(changed("80.1", "80.9").len(), 1);
        assert_eq!(changed("9", "8").len(), 1);
    }

    #[test]
    fn of_the_first_seed_all_is_compared_but_tables_over_seeds() {
        let table = "\n\n| what | worst, dB |\n| --- | --- |\n| SNR | ";
        let page = format!(
            "First:{table}70.1 |\n\nWorst over\nseeds 1 to 5,\nall:{table}60.1 |\n\nLast:{table}50.1 |\n"
        );
        let changed = |extent| {
            let of =
                |from: &str, to: &str| differences(&page, &page.replace(from, to), extent).len();
            [
                of("70.1", "71.1"),
                of("60.1", "61.1"),
                of("50.1", "51.1"),
                of("1 to 5", "1 to 4"),
            ]
        };
        assert_eq!(changed(Extent::All), [1; 4]);
        assert_eq!(changed(Extent::FirstSeed), [1, 0, 1, 1]);
    }
}
