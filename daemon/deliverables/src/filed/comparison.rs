//! The page of a scan held against its nominal.

use jiff::Timestamp;
use page::{Block, Column, Fact, Level, Line, Page, Section, Table, Verdict};

use super::{date, figure, of_a_kind, origin, per_cent, picture, producer, signed, triple};
use crate::comparison::{AlignmentReport, ComparisonReport};

/// The page of a comparison, with its map. `name` is that of the part, `time` when it was scanned.
#[must_use]
pub fn comparison_page(
    report: &ComparisonReport,
    name: &str,
    time: Timestamp,
    map: Vec<u8>,
) -> Page {
    let mut sections = Vec::new();
    if !report.warnings.is_empty() {
        sections.push(Section {
            id: "warnings",
            heading: "Warnings".into(),
            blocks: vec![Block::Warnings(report.warnings.clone())],
        });
    }
    sections.push(flaws(report));
    sections.push(deviations(report, map));
    sections.push(alignment(&report.alignment));
    sections.push(decision(report));
    let mut facts = vec![Fact::new("Scanned", time.to_string())];
    facts.extend(origin(&report.scan));
    let nominal = &report.nominal;
    facts.push(Fact::new("Nominal", Line::new().foreign(&nominal.source)));
    let size = of_a_kind(nominal.facets, "facet", "facets").text(", ");
    let size = size.line(triple(nominal.low_mm, 2)).text(" to ");
    facts.push(Fact::new(
        "Its extent",
        size.line(triple(nominal.high_mm, 2)).text(" mm"),
    ));
    facts.push(Fact::new("Tolerance", tolerance(report)));
    Page {
        title: name.to_owned(),
        kind: "Comparison with the nominal".into(),
        verdict: verdict(report),
        facts,
        sections,
        producer: producer(),
        date: date(time),
    }
}

fn tolerance(report: &ComparisonReport) -> Line {
    match report.tolerance {
        Some(limits) => signed(limits.lower_mm, 3)
            .text(" to ")
            .line(signed(limits.upper_mm, 3))
            .text(" mm"),
        None => "none given: what is significant is told".into(),
    }
}

fn verdict(report: &ComparisonReport) -> Verdict {
    let Some(worst) = report.regions.first() else {
        return Verdict {
            level: if report.warnings.is_empty() {
                Level::Good
            } else {
                Level::Watch
            },
            line: "Passed: nothing lies significantly beyond the limits.".into(),
        };
    };
    let line = Line::new().text("Out of tolerance: ");
    let line = line.line(of_a_kind(report.regions.len(), "area", "areas"));
    let line = line.text(" beyond the limits, the worst ");
    Verdict {
        level: Level::Bad,
        line: line.line(signed(worst.deviation_mm, 4)).text(" mm."),
    }
}

fn flaws(report: &ComparisonReport) -> Section {
    let blocks = if report.regions.is_empty() {
        vec![Block::Text(
            "No area lies significantly beyond the limits.".into(),
        )]
    } else {
        let rows = (1..)
            .zip(&report.regions)
            .map(|(rank, region): (usize, _)| {
                let [x, y, z] = region.centre_mm.map(|value| figure(Some(value), 2));
                let [wide, high] = region.size_mm.map(|value| figure(Some(value), 1));
                vec![
                    Line::new().count(rank),
                    x,
                    y,
                    z,
                    wide,
                    high,
                    figure(Some(region.area_mm2), 1),
                    signed(region.deviation_mm, 4),
                    figure(Some(region.standard_error_mm), 4),
                    triple(region.nominal_centre_mm, 2),
                ]
            });
        vec![Block::Table(Table {
            caption: "Areas beyond the limits, the worst first; numbered in the map. Depth is the \
                      greatest local mean, with its standard error."
                .into(),
            columns: vec![
                Column::words("Area"),
                Column::numbers("x, mm"),
                Column::numbers("y, mm"),
                Column::numbers("z, mm"),
                Column::numbers("Width, mm"),
                Column::numbers("Height, mm"),
                Column::numbers("Area, mm\u{b2}"),
                Column::numbers("Depth, mm"),
                Column::numbers("Error, mm"),
                Column::numbers("On the nominal, mm"),
            ],
            rows: rows.collect(),
        })]
    };
    Section {
        id: "flaws",
        heading: "Beyond the limits".into(),
        blocks,
    }
}

fn deviations(report: &ComparisonReport, map: Vec<u8>) -> Section {
    let told = &report.deviation;
    let nodes = &report.nodes;
    let range = signed(told.min_mm, 3)
        .text(" to ")
        .line(signed(told.max_mm, 3));
    let mut facts = vec![
        Fact::new("Nodes", Line::new().count(nodes.compared).text(" compared")),
        Fact::new("Mean", signed(told.mean_mm, 4).text(" mm")),
        Fact::new("rms", figure(Some(told.rms_mm), 4).text(" mm")),
        Fact::new(
            "Deviation",
            figure(Some(told.standard_deviation_mm), 4).text(" mm, standard, about the mean"),
        ),
        Fact::new(
            "95 % within",
            figure(Some(told.percentile_95_mm), 4).text(" mm"),
        ),
        Fact::new("Range", range.text(" mm")),
    ];
    if let Some(share) = told.within_tolerance_share {
        facts.push(Fact::new(
            "In tolerance",
            per_cent(share, 2).text(" of the nodes"),
        ));
    }
    let others = Line::new().count(nodes.at_edges).text(" at edges, ");
    let others = others.count(nodes.foreign).text(" of something else");
    facts.push(Fact::new("Not compared", others));
    let covered = per_cent(report.coverage.covered_share, 1).text(" of ");
    let covered = covered.line(figure(Some(report.coverage.seen_area_mm2), 0));
    facts.push(Fact::new(
        "Coverage",
        covered.text(" mm\u{b2} of the nominal that can be seen"),
    ));
    let seen = format!(
        "Map of the deviations of {} nodes in colours, red where there is more material and blue \
         where there is less, with a histogram below.",
        nodes.compared
    );
    let caption = "Deviations from the nominal along its normals, and how often which occur: red where \
                   there is more material, blue where there is less.";
    Section {
        id: "deviations",
        heading: "Deviations".into(),
        blocks: vec![
            Block::Facts(facts),
            Block::Picture(picture(caption, seen, map)),
        ],
    }
}

fn alignment(alignment: &AlignmentReport) -> Section {
    let mut facts = vec![Fact::new("Method", alignment.method.clone())];
    if let Some(rms_mm) = alignment.rms_mm {
        let steps = of_a_kind(alignment.iterations, "iteration", "iterations").text(" of ");
        let steps = steps.line(of_a_kind(alignment.starts, "start", "starts"));
        facts.extend([
            Fact::new("Shifted", triple(alignment.translation_mm, 4).text(" mm")),
            Fact::new(
                "Turned",
                triple(alignment.rotation_vector_deg, 4).text("\u{b0}"),
            ),
            Fact::new("rms", figure(Some(rms_mm), 4).text(" mm")),
            Fact::new("Found in", steps),
        ]);
    }
    if let Some(uncertainty) = alignment.translation_uncertainty_mm {
        facts.push(Fact::new(
            "Of the shift",
            triple(uncertainty, 4).text(" mm, k = 1"),
        ));
    }
    if let Some(uncertainty) = alignment.rotation_uncertainty_deg {
        let line = triple(uncertainty, 4).text("\u{b0}, k = 1");
        facts.push(Fact::new("Of turning", line));
    }
    for free in &alignment.free {
        let line = Line::new()
            .text(format!("{} ", free.motion))
            .line(triple(free.direction, 3));
        let line = match free.through_mm {
            Some(through) => line.text(" through ").line(triple(through, 2)).text(" mm"),
            None => line,
        };
        facts.push(Fact::new("Left as placed", line));
    }
    Section {
        id: "alignment",
        heading: "Alignment".into(),
        blocks: vec![Block::Facts(facts)],
    }
}

fn decision(report: &ComparisonReport) -> Section {
    let decision = &report.decision;
    let text = Line::new().text("Local means over patches are told once they lie beyond ");
    let text = text.line(signed(decision.lower_mm, 4)).text(" to ");
    let text = text.line(signed(decision.upper_mm, 4)).text(" mm by ");
    let text = text.line(figure(Some(decision.standard_errors), 2));
    let text = text
        .text(" of their standard errors. A part within its limits fails with a probability of ");
    let text = text.number(decision.false_alarm.to_string(), decision.false_alarm);
    let text = text.text(" at most, over ").count(decision.means);
    let text = text
        .text(" means. Noise of single samples: ")
        .line(figure(Some(report.noise_mm), 4));
    let text = text
        .text(" mm. Points farther than ")
        .number(report.limit_mm.to_string(), report.limit_mm);
    let row = |patch: &crate::comparison::PatchReport| {
        vec![
            figure(Some(patch.diameter_mm), 2),
            Line::new().count(patch.means),
            figure(Some(patch.standard_error_mm), 4),
            figure(Some(patch.inflation), 2),
            figure(Some(patch.told_mm), 4),
        ]
    };
    Section {
        id: "decision",
        heading: "How it was decided".into(),
        blocks: vec![
            Block::Text(text.text(" mm from the nominal belong to something else.")),
            Block::Table(Table {
                caption: "Patches; told is what lies beyond a limit by so much.".into(),
                columns: vec![
                    Column::numbers("Diameter, mm"),
                    Column::numbers("Means"),
                    Column::numbers("Standard error, mm"),
                    Column::numbers("Inflation"),
                    Column::numbers("Told, mm"),
                ],
                rows: decision.patches.iter().map(row).collect(),
            }),
        ],
    }
}
