//! An acceptance told to people.

use deliverables::AcceptanceReport;

use crate::output;

/// The verdict in one line.
pub(super) fn verdict(report: &AcceptanceReport) -> String {
    let judged = report
        .figures
        .iter()
        .filter(|own| own.passed.is_some())
        .count();
    if report.passed {
        return format!(
            "passed: {} within the maximum permissible error",
            output::counted(judged, "figure")
        );
    }
    let beyond: Vec<&str> = report
        .figures
        .iter()
        .filter(|own| own.passed == Some(false))
        .map(|own| own.name.as_str())
        .collect();
    format!(
        "not passed: beyond the maximum permissible error: {}",
        beyond.join("; ")
    )
}

/// The acceptance in lines.
pub(super) fn told(report: &AcceptanceReport) -> String {
    let number = |value: f64, unit: &str| format!("{value:+.4} {unit}");
    let mut lines = vec![output::table(
        &["FIGURE", "WORST", "PERMITTED", "VALUES", "VERDICT"],
        &[1, 2, 3],
        report.figures.iter().map(|own| {
            let limit = own
                .limit
                .map_or_else(|| "-".into(), |l| format!("{l:.4} {}", own.unit));
            let verdict = match own.passed {
                Some(true) => "within",
                Some(false) => "beyond",
                None => "no limit",
            };
            vec![
                own.name.clone(),
                number(own.worst, &own.unit),
                limit,
                own.count.to_string(),
                verdict.to_owned(),
            ]
        }),
    )];
    if !report.repeatability.is_empty() {
        lines.push(String::new());
        lines.push(output::table(
            &["REPEATS", "MEAN MM", "DEVIATION MM", "RANGE MM", "SCANS"],
            &[1, 2, 3, 4],
            report.repeatability.iter().map(|own| {
                vec![
                    own.figure.clone(),
                    format!("{:+.4}", own.mean_mm),
                    format!("{:.4}", own.standard_deviation_mm),
                    format!("{:.4}", own.range_mm),
                    own.count.to_string(),
                ]
            }),
        ));
    }
    if !report.drift.is_empty() {
        lines.push(String::new());
        lines.push(output::table(
            &[
                "DRIFTS",
                "MM IN AN HOUR",
                "+-",
                "CHANGE MM",
                "SETTLED AFTER",
            ],
            &[1, 2, 3, 4],
            report.drift.iter().map(|own| {
                vec![
                    own.figure.clone(),
                    format!("{:+.4}", own.slope_mm_per_h),
                    format!("{:.4}", own.uncertainty_mm_per_h),
                    format!("{:+.4}", own.change_mm),
                    own.settled_after_h
                        .map_or_else(|| "not yet".into(), |hours| format!("{hours:.2} h")),
                ]
            }),
        ));
    }
    lines.push(String::new());
    lines.push(format!("scanner      {}", report.scanner));
    lines.push(format!("reference    {}", report.reference));
    lines.push(match &report.calibration {
        Some(own) => format!(
            "calibrated   {}, residual {:.4} mm",
            own.date, own.residual_mm
        ),
        None => "calibrated   not: as the device announces".to_owned(),
    });
    // On failure standard error has it.
    lines.push(if report.passed {
        format!("verdict      {}", verdict(report))
    } else {
        "verdict      not passed".to_owned()
    });
    lines.join("\n")
}
