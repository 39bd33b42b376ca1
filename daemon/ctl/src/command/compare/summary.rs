//! A comparison told to people.

use deliverables::ComparisonReport;

use super::run::Compared;
use crate::output;

/// Regions listed one by one.
const MOST_REGIONS: usize = 24;

/// The verdict in one line.
pub(super) fn verdict(report: &ComparisonReport) -> String {
    let limits = match report.tolerance {
        Some(t) => format!("of {:+} to {:+} mm", t.lower_mm, t.upper_mm),
        None => "of no significant deviation".to_owned(),
    };
    match report.regions.first() {
        None => format!("passed: nothing lies significantly beyond the tolerance {limits}"),
        Some(worst) => format!(
            "out of tolerance: {} beyond the tolerance {limits}, the worst {:+.3} mm at x {:.1}, y \
             {:.1} mm",
            output::counted(report.regions.len(), "area"),
            worst.deviation_mm,
            worst.centre_mm[0],
            worst.centre_mm[1]
        ),
    }
}

/// The comparison in lines.
pub(super) fn told(compared: &Compared) -> String {
    let report = &compared.report;
    let mut lines = Vec::new();
    if !report.regions.is_empty() {
        lines.push(regions(report));
        let hidden = report.regions.len().saturating_sub(MOST_REGIONS);
        if hidden > 0 {
            lines.push(format!("... and {hidden} milder ones"));
        }
        lines.push(String::new());
    }
    alignment(report, &mut lines);
    let deviation = &report.deviation;
    let mut line = format!(
        "deviation    mean {:+.4}, rms {:.4}, standard deviation {:.4}, {:+.3} to {:+.3} mm; 95 % \
         within {:.3} mm",
        deviation.mean_mm,
        deviation.rms_mm,
        deviation.standard_deviation_mm,
        deviation.min_mm,
        deviation.max_mm,
        deviation.percentile_95_mm
    );
    if let Some(share) = deviation.within_tolerance_share {
        line.push_str(&format!("; {:.2} % within tolerance", 100.0 * share));
    }
    lines.push(line);
    let nodes = &report.nodes;
    lines.push(format!(
        "nodes        {} compared, {} at edges, {} of something else, at {} mm",
        nodes.compared, nodes.at_edges, nodes.foreign, report.grid.pitch_mm
    ));
    lines.push(format!(
        "coverage     {:.1} % of the {:.0} mm2 of the nominal that can be seen",
        100.0 * report.coverage.covered_share,
        report.coverage.seen_area_mm2
    ));
    let decision = &report.decision;
    let told: Vec<String> = decision
        .patches
        .iter()
        .map(|patch| format!("{:.3} mm over {:.1} mm", patch.told_mm, patch.diameter_mm))
        .collect();
    lines.push(format!(
        "told         what lies beyond {:+.4} to {:+.4} mm by {}",
        decision.lower_mm,
        decision.upper_mm,
        told.join(", ")
    ));
    lines.push(format!(
        "certainty    noise {:.3} mm; a part within its tolerance fails with a probability of at most {}",
        report.noise_mm, decision.false_alarm
    ));
    // On failure standard error has it.
    if report.passed {
        lines.push(format!("verdict      {}", verdict(report)));
    } else {
        lines.push("verdict      out of tolerance".to_owned());
    }
    lines.join("\n")
}

fn alignment(report: &ComparisonReport, lines: &mut Vec<String>) {
    let alignment = &report.alignment;
    let Some(rms_mm) = alignment.rms_mm else {
        lines.push("alignment    as placed".to_owned());
        return;
    };
    let [x, y, z] = alignment.translation_mm;
    let [a, b, c] = alignment.rotation_vector_deg;
    lines.push(format!(
        "alignment    best fit: turned ({a:.4}, {b:.4}, {c:.4}) deg, then shifted ({x:.4}, {y:.4}, \
         {z:.4}) mm; rms {rms_mm:.4} mm, {} of {}",
        output::counted(alignment.iterations, "iteration"),
        output::counted(alignment.starts, "start"),
    ));
    for free in &alignment.free {
        let [x, y, z] = free.direction;
        let through = free
            .through_mm
            .map(|[x, y, z]| format!(" through ({x:.2}, {y:.2}, {z:.2}) mm"));
        lines.push(format!(
            "free         {} {} ({x:.3}, {y:.3}, {z:.3}){}: left as placed",
            free.motion,
            if through.is_some() { "about" } else { "along" },
            through.unwrap_or_default()
        ));
    }
}

fn regions(report: &ComparisonReport) -> String {
    output::table(
        &[
            "AREA",
            "X MM",
            "Y MM",
            "Z MM",
            "WIDTH MM",
            "HEIGHT MM",
            "AREA MM2",
            "DEVIATION MM",
            "ERROR MM",
        ],
        &[0, 1, 2, 3, 4, 5, 6, 7, 8],
        (1..)
            .zip(report.regions.iter().take(MOST_REGIONS))
            .map(|(number, region): (usize, _)| {
                let [x, y, z] = region.centre_mm;
                vec![
                    number.to_string(),
                    format!("{x:.2}"),
                    format!("{y:.2}"),
                    format!("{z:.2}"),
                    format!("{:.1}", region.size_mm[0]),
                    format!("{:.1}", region.size_mm[1]),
                    format!("{:.1}", region.area_mm2),
                    format!("{:+.4}", region.deviation_mm),
                    format!("{:.4}", region.standard_error_mm),
                ]
            }),
    )
}
