//! The page: its text stands in `page.md`, with a place for each table.

use anyhow::{Context, Result, ensure};

use crate::bars::bars;
use crate::check::TOLERANCES;
use crate::conditions::{COLUMNS, DROPOUTS, MIXED, NOISE_MM, OUTLIERS, SAMPLES, SEEDS};
use crate::regions::Reference;
use crate::results::Results;
use crate::tables::{Kind, nodes, regions, regions_over_seeds, seconds, seeds, wholes};
use crate::upright::intervals;

const TEXT: &str = include_str!("page.md");

/// The whole page.
///
/// # Errors
/// When the text has a place for something that does not exist.
pub(crate) fn page(results: &Results) -> Result<String> {
    let per_cent = |share: f64| format!("{}", share * 100.0);
    let tolerances = TOLERANCES.iter().filter(|(_, most)| most.is_finite());
    let tolerances: Vec<String> = tolerances
        .map(|(unit, most)| format!("{most} {unit}"))
        .collect();
    let places = [
        ("noise", NOISE_MM.to_string()),
        ("outliers", per_cent(OUTLIERS)),
        ("mixed", per_cent(MIXED)),
        ("dropouts", per_cent(DROPOUTS)),
        ("columns", COLUMNS.to_string()),
        ("samples", SAMPLES.to_string()),
        ("first seed", SEEDS.start().to_string()),
        ("seeds", seeds()),
        ("tolerances", tolerances.join(", ")),
        ("bars", bars(results)),
        ("regions by image", regions(results, Reference::RangeImage)),
        ("regions by truth", regions(results, Reference::Truth)),
        (
            "regions by image over seeds",
            regions_over_seeds(results, Reference::RangeImage),
        ),
        (
            "regions by truth over seeds",
            regions_over_seeds(results, Reference::Truth),
        ),
        ("nodes", nodes(results)),
        ("images", wholes(results, Kind::AgainstImage, false)),
        (
            "images over seeds",
            wholes(results, Kind::AgainstImage, true),
        ),
        ("truth", wholes(results, Kind::AgainstTruth, false)),
        (
            "truth over seeds",
            wholes(results, Kind::AgainstTruth, true),
        ),
        ("borders", wholes(results, Kind::Borders, false)),
        ("borders over seeds", wholes(results, Kind::Borders, true)),
        ("intervals", intervals(&results.upright)),
        ("seconds", seconds(results)),
    ];
    let mut text = TEXT.to_owned();
    for (name, value) in &places {
        let place = format!("{{{{{name}}}}}");
        ensure!(text.contains(&place), "the page has no place for {name}");
        text = text.replace(&place, value);
    }
    ensure!(!text.contains("{{"), "the page has a place for nothing");
    Ok(text)
}

/// The part of a page under the first heading that contains these words.
///
/// # Errors
/// When there is no such heading; the message lists them.
pub(crate) fn section<'a>(page: &'a str, words: &str) -> Result<&'a str> {
    let headings = || page.match_indices("\n## ").map(|(at, _)| at + 1);
    let title = |at: usize| page[at..].lines().next().unwrap_or_default();
    let known: Vec<&str> = headings()
        .map(|at| title(at).trim_start_matches("## "))
        .collect();
    let wanted = words.to_lowercase();
    let start = headings()
        .find(|&at| title(at).to_lowercase().contains(&wanted))
        .with_context(|| {
            format!(
                "no part is called {words:?}; there are: {}",
                known.join(", ")
            )
        })?;
    let end = headings().find(|&at| at > start).unwrap_or(page.len());
    Ok(&page[start..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_filled_even_without_results() {
        let page = page(&Results::default()).unwrap();
        assert!(page.contains("**missed**") && !page.contains("held |"));
        for words in ["Table 1", "section vi", "Table 3"] {
            assert!(
                section(&page, words).unwrap().contains("| Cylinder"),
                "{words}"
            );
        }
        let unknown = section(&page, "Table 9").unwrap_err().to_string();
        assert!(unknown.contains("Table 9") && unknown.contains("Table 3"));
    }
}
