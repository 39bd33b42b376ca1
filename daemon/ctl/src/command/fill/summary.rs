//! Loops told to people.

use super::run::Told;
use crate::output;

/// Loops listed one by one.
const MOST_LOOPS: usize = 60;

pub(super) fn told(told: &Told) -> String {
    let mut lines = Vec::new();
    if !told.loops.is_empty() {
        lines.push(table(told));
        let hidden = told.loops.len().saturating_sub(MOST_LOOPS);
        if hidden > 0 {
            lines.push(format!("... and {hidden} more; --json tells all"));
        }
        lines.push(String::new());
    }
    let counts = format!("{} triangles, {} vertices", told.triangles, told.vertices);
    match &told.output {
        None if told.loops.is_empty() => lines.push(format!("mesh       {counts}: it is closed")),
        None => lines.push(format!("mesh       {counts}")),
        Some(output) => {
            lines.push(format!(
                "mesh       {counts}; {} of the triangles are new",
                told.new_triangles
            ));
            lines.push(format!("written    {}", output.display()));
        }
    }
    if let Some(patches) = &told.patches {
        lines.push(format!("patches    {}", patches.display()));
    }
    lines.join("\n")
}

fn table(told: &Told) -> String {
    let heading = [
        "LOOP",
        "IS",
        "EDGES",
        "LENGTH MM",
        "SIZE MM",
        "CENTRE MM",
        "TRIANGLES",
        "NOISE MM",
    ];
    let is_filled = told.output.is_some();
    let columns = if is_filled { heading.len() } else { 6 };
    let lines = told.loops.iter().take(MOST_LOOPS).map(|own| {
        let is = match (own.outcome, own.within) {
            (Some(outcome @ ("filled" | "kept" | "open")), _) => outcome.to_owned(),
            (_, Some(hole)) => format!("island in {hole}"),
            _ => own.kind.to_owned(),
        };
        let [x, y, z] = own.centre_mm;
        let filling = own.filling.as_ref();
        let mut line = vec![
            own.number.to_string(),
            is,
            own.edges.to_string(),
            format!("{:.3}", own.length_mm),
            format!("{:.3}", own.size_mm),
            format!("{x:.3} {y:.3} {z:.3}"),
            filling
                .map(|own| own.triangles.to_string())
                .unwrap_or_default(),
            filling
                .map(|own| format!("{:.4}", own.noise_mm))
                .unwrap_or_default(),
        ];
        line.truncate(columns);
        line
    });
    output::table(
        &heading[..columns],
        &[0, 2, 3, 4, 6, 7][..if is_filled { 6 } else { 4 }],
        lines,
    )
}
