//! The page of a scanner held against references.

use jiff::Timestamp;
use page::{Block, Column, Fact, Level, Line, Page, Section, Table, Verdict};

use super::{calibrated, date, figure, of_a_kind, producer, signed, triple};
use crate::acceptance::{AcceptanceReport, FigureReport};

/// The page of an acceptance; `time` is that of the last scan.
#[must_use]
pub fn acceptance_page(report: &AcceptanceReport, time: Timestamp) -> Page {
    let mut sections = Vec::new();
    if !report.warnings.is_empty() {
        sections.push(Section {
            id: "warnings",
            heading: "Warnings".into(),
            blocks: vec![Block::Warnings(report.warnings.clone())],
        });
    }
    sections.push(figures(report));
    sections.push(scans(report));
    if !report.repeatability.is_empty() {
        sections.push(repeatability(report));
    }
    if !report.drift.is_empty() {
        sections.push(drift(report));
    }
    let mut facts = vec![
        Fact::new("Scanner", Line::new().foreign(&report.scanner)),
        Fact::new("Reference", Line::new().foreign(&report.reference)),
        Fact::new("Scanned", time.to_string()),
        Fact::new("Scans", Line::new().count(report.scans.len())),
    ];
    facts.push(Fact::new(
        "Calibrated",
        report
            .calibration
            .as_ref()
            .map_or_else(|| "not: as the device announces".into(), calibrated),
    ));
    Page {
        title: report.scanner.clone(),
        kind: "Acceptance".into(),
        verdict: verdict(report),
        facts,
        sections,
        producer: producer(),
        date: date(time),
    }
}

fn verdict(report: &AcceptanceReport) -> Verdict {
    let limits = report.figures.iter().filter(|own| own.passed.is_some());
    let failed = report
        .figures
        .iter()
        .filter(|own| own.passed == Some(false));
    let (limits, failed) = (limits.count(), failed.count());
    let line = if report.passed {
        Line::from("Passed: ")
            .line(of_a_kind(limits, "figure is", "figures are"))
            .text(" within the maximum permissible error")
    } else {
        Line::from("Not passed: ")
            .count(failed)
            .text(" of ")
            .line(of_a_kind(limits, "figure", "figures"))
            .text(" beyond the maximum permissible error")
    };
    Verdict {
        level: if report.passed {
            Level::Good
        } else {
            Level::Bad
        },
        line,
    }
}

fn figures(report: &AcceptanceReport) -> Section {
    let row = |own: &FigureReport| {
        let verdict = match own.passed {
            Some(true) => "within",
            Some(false) => "beyond",
            None => "no limit",
        };
        vec![
            own.name.clone().into(),
            signed(own.worst, 4).text(format!(" {}", own.unit)),
            match own.limit {
                Some(limit) => figure(Some(limit), 4).text(format!(" {}", own.unit)),
                None => "-".into(),
            },
            verdict.into(),
            Line::new().count(own.count),
        ]
    };
    Section {
        id: "figures",
        heading: "Figures".into(),
        blocks: vec![
            Block::Table(Table {
                caption: "The worst value of each figure against its maximum permissible error."
                    .into(),
                columns: vec![
                    Column::words("Figure"),
                    Column::numbers("Worst"),
                    Column::numbers("Permitted"),
                    Column::words("Verdict"),
                    Column::numbers("Values"),
                ],
                rows: report.figures.iter().map(row).collect(),
            }),
            Block::Text(
                "In the manner of VDI/VDE 2634 part 2: least squares over the samples of all rays \
                 that meet a sphere at 60\u{b0} or less, or a plate away from its rim, without the \
                 3 of 1000 that lie farthest off. This is no certificate: which references stand \
                 where, and under which conditions, is up to who scans."
                    .into(),
            ),
        ],
    }
}

fn scans(report: &AcceptanceReport) -> Section {
    let mut rows = Vec::new();
    for scan in &report.scans {
        let named = || Line::new().foreign(&scan.scan);
        for sphere in &scan.spheres {
            let size = signed(sphere.size_error_mm, 4).text(" \u{b1} ");
            rows.push(vec![
                named(),
                Line::from("sphere at ").line(triple(sphere.centre_mm, 1)),
                size.line(figure(Some(sphere.size_uncertainty_mm), 4)),
                figure(Some(sphere.form_mm), 4),
                Line::new().count(sphere.samples),
            ]);
        }
        let mut row = |what: &str, error_mm: f64| {
            rows.push(vec![
                named(),
                what.into(),
                signed(error_mm, 4),
                "".into(),
                "".into(),
            ]);
        };
        if let Some(error_mm) = scan.sphere_spacing_error_mm {
            row("distance of spheres", error_mm);
        }
        if let Some(flatness_mm) = scan.flatness_mm {
            row("flatness", flatness_mm);
        }
        for (step, error_mm) in (1..).zip(&scan.step_errors_mm) {
            if let Some(error_mm) = error_mm {
                row(&format!("step {step}"), *error_mm);
            }
        }
    }
    Section {
        id: "scans",
        heading: "Scans".into(),
        blocks: vec![Block::Table(Table {
            caption: "What each scan shows: errors with k = 1, in millimetres.".into(),
            columns: vec![
                Column::words("Scan"),
                Column::words("Of"),
                Column::numbers("Error, mm"),
                Column::numbers("Form, mm"),
                Column::numbers("Samples"),
            ],
            rows,
        })],
    }
}

fn repeatability(report: &AcceptanceReport) -> Section {
    let rows = report.repeatability.iter().map(|own| {
        vec![
            own.figure.clone().into(),
            figure(Some(own.mean_mm), 4),
            figure(Some(own.standard_deviation_mm), 4),
            figure(Some(own.range_mm), 4),
            Line::new().count(own.count),
        ]
    });
    Section {
        id: "repeatability",
        heading: "Repeatability".into(),
        blocks: vec![Block::Table(Table {
            caption: "The same figure of several scans, in millimetres.".into(),
            columns: vec![
                Column::words("Figure"),
                Column::numbers("Mean"),
                Column::numbers("Standard deviation"),
                Column::numbers("Range"),
                Column::numbers("Values"),
            ],
            rows: rows.collect(),
        })],
    }
}

fn drift(report: &AcceptanceReport) -> Section {
    let rows = report.drift.iter().map(|own| {
        let slope = signed(own.slope_mm_per_h, 4).text(" \u{b1} ");
        vec![
            own.figure.clone().into(),
            slope.line(figure(Some(own.uncertainty_mm_per_h), 4)),
            signed(own.change_mm, 4),
            match own.settled_after_h {
                Some(hours) => figure(Some(hours), 2).text(" h"),
                None => "not yet".into(),
            },
        ]
    });
    Section {
        id: "drift",
        heading: "Drift".into(),
        blocks: vec![Block::Table(Table {
            caption: "Figures against the time since the first scan.".into(),
            columns: vec![
                Column::words("Figure"),
                Column::numbers("mm in an hour"),
                Column::numbers("Change, mm"),
                Column::numbers("Settled after"),
            ],
            rows: rows.collect(),
        })],
    }
}
