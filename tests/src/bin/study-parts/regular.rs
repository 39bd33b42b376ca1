//! The regularities that shapes were given, and whether they are true.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use crate::measure::Measured;

/// What was accepted and refused, by kind.
pub(crate) fn regularities(parts: &[Measured]) -> String {
    let (mut accepted, mut refused): (BTreeMap<&str, usize>, BTreeMap<&str, usize>) =
        (BTreeMap::new(), BTreeMap::new());
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    let mut tied = 0;
    for part in parts {
        let adjusted = |kind: &&pipeline::RegionKind| kind.adjusted.is_some();
        tied += part.outcome.kinds.iter().filter(adjusted).count();
        if let Some(found) = &part.outcome.regularities {
            for own in &found.accepted {
                *accepted.entry(own.kind.as_str()).or_default() += 1;
            }
            for own in &found.refused {
                *refused.entry(own.kind.as_str()).or_default() += 1;
                *reasons.entry(own.reason.as_str()).or_default() += 1;
            }
        }
    }
    let mut out = format!(
        "\n## Regularities\n\n{tied} regions were adjusted.\n\n| kind | accepted | refused \
         |\n| --- | ---: | ---: |\n"
    );
    let kinds: BTreeSet<&str> = accepted.keys().chain(refused.keys()).copied().collect();
    for kind in kinds {
        let count = |of: &BTreeMap<&str, usize>| of.get(kind).copied().unwrap_or(0);
        let _ = writeln!(
            out,
            "| {kind} | {} | {} |",
            count(&accepted),
            count(&refused)
        );
    }
    out += "\n| refused because | how many |\n| --- | ---: |\n";
    for (reason, count) in reasons {
        let _ = writeln!(out, "| {reason} | {count} |");
    }
    out
}
