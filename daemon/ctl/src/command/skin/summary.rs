//! A skinned surface told to people.

use super::run::Skinned;
use crate::output;

/// Sections listed one by one.
const MOST_SECTIONS: usize = 40;

pub(super) fn told(skinned: &Skinned) -> String {
    let mut lines = vec![sections(skinned)];
    let hidden = skinned.figures.sections.len().saturating_sub(MOST_SECTIONS);
    if hidden > 0 {
        lines.push(format!("... and {hidden} more"));
    }
    lines.push(String::new());
    let counts = &skinned.figures.counts;
    if let Some(merged) = counts.knots_merged {
        lines.push(format!(
            "knots        {merged} around once those of all sections are merged, {} when removed",
            counts.knots_around
        ));
    }
    lines.push(format!(
        "control points  {} around by {} across: {}; {} knots around",
        counts.points_around, counts.points_across, counts.points, counts.knots_around
    ));
    let deviation = &skinned.figures.deviation;
    lines.push(format!(
        "deviation    rms {:.4}, at most {:.4} of {} mm; {:.2} % of the data points within",
        deviation.rms_mm,
        deviation.max_mm,
        skinned.figures.tolerance_mm,
        100.0 * deviation.within_tolerance_share
    ));
    lines.push(format!("written to   {}", skinned.output.display()));
    let pictures = skinned.pictures.iter();
    lines.extend(pictures.map(|path| format!("picture      {}", path.display())));
    lines.join("\n")
}

fn sections(skinned: &Skinned) -> String {
    let has_knots = skinned
        .figures
        .sections
        .iter()
        .any(|own| own.knots.is_some());
    let mut heading = vec!["SECTION", "POINTS", "RMS MM", "MAX MM"];
    let mut numbers = vec![1, 2, 3];
    if has_knots {
        heading.insert(2, "KNOTS");
        numbers.push(4);
    }
    let lines = skinned
        .figures
        .sections
        .iter()
        .take(MOST_SECTIONS)
        .map(|own| {
            let mut line = vec![
                own.name.clone(),
                own.points.to_string(),
                format!("{:.4}", own.rms_mm),
                format!("{:.4}", own.max_mm),
            ];
            if has_knots {
                line.insert(
                    2,
                    own.knots.map(|knots| knots.to_string()).unwrap_or_default(),
                );
            }
            line
        });
    output::table(&heading, &numbers, lines)
}
