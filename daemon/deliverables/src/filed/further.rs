//! Surfaces and NC programs beside the model.

use page::{Block, Column, Fact, Line, Section, Table};

use super::{figure, of_a_kind, per_cent};
use crate::further::{SkinReport, SurfaceReport, ToolpathReport};
use crate::report::Report;

/// A section for each that was made.
pub(super) fn sections(report: &Report) -> Vec<Section> {
    let surface = report.surface.as_ref().map(surface);
    let skin = report.skin.as_ref().map(skin);
    let toolpath = report.toolpath.as_ref().map(toolpath);
    [surface, skin, toolpath].into_iter().flatten().collect()
}

fn file(name: &str) -> Fact {
    Fact::new("File", Line::new().foreign(name))
}

fn surface(report: &SurfaceReport) -> Section {
    let own = &report.surface;
    let points = of_a_kind(own.control_points, "control point", "control points");
    let mut facts = vec![
        file(&report.file),
        Fact::new("Knots", own.knots.clone()),
        Fact::new(
            "Size",
            points
                .text(" for ")
                .line(of_a_kind(own.nodes, "node", "nodes")),
        ),
        Fact::new(
            "Distance in z",
            figure(Some(own.max_mm), 4)
                .text(" mm at most of ")
                .line(figure(Some(report.tolerance_mm), 4))
                .text(" mm, ")
                .line(figure(Some(own.rms_mm), 4))
                .text(" mm rms"),
        ),
    ];
    if let Some(fairing) = &report.fairing {
        let moved = figure(Some(fairing.greatest_move_mm), 4).text(" mm at most of ");
        let moved = moved.line(figure(Some(fairing.bound_mm), 4));
        facts.push(Fact::new("Fairing moved nodes", moved.text(" mm")));
    }
    Section {
        id: "b-spline-surface",
        heading: "B-spline surface".into(),
        blocks: vec![Block::Facts(facts)],
    }
}

fn skin(report: &SkinReport) -> Section {
    let own = &report.figures;
    let sections = of_a_kind(own.sections.len(), "section", "sections").text(", ");
    let sections = sections.line(figure(Some(report.every_mm), 3));
    let facts = vec![
        file(&report.file),
        Fact::new("Skinned over", sections.text(" mm apart")),
        Fact::new(
            "Size",
            of_a_kind(own.counts.points, "control point", "control points"),
        ),
        Fact::new(
            "Distance",
            figure(Some(own.deviation.max_mm), 4)
                .text(" mm at most, ")
                .line(figure(Some(own.deviation.rms_mm), 4))
                .text(" mm rms; ")
                .line(per_cent(own.deviation.within_tolerance_share, 2))
                .text(" within ")
                .line(figure(Some(own.tolerance_mm), 4))
                .text(" mm"),
        ),
    ];
    Section {
        id: "skinned-surface",
        heading: "Skinned surface".into(),
        blocks: vec![Block::Facts(facts)],
    }
}

fn toolpath(report: &ToolpathReport) -> Section {
    let simulation = &report.simulation;
    let facts = vec![
        file(&report.file),
        Fact::new("Mills", format!("the {}", report.of)),
        Fact::new(
            "Estimated time",
            figure(Some(report.total_s), 0).text(" s, tool changes included"),
        ),
        Fact::new(
            "Simulated removal",
            figure(Some(simulation.gouge_mm), 4)
                .text(" mm too deep at most, ")
                .line(figure(Some(simulation.leftover_mm), 4))
                .text(" mm left at most, ")
                .line(figure(Some(simulation.leftover_95_mm), 4))
                .text(" mm on 95 of 100 nodes"),
        ),
    ];
    let rows = report.operations.iter().map(|own| {
        vec![
            own.name.clone().into(),
            Line::new().text("T").count(own.tool as usize),
            own.cutter.clone().into(),
            figure(Some(own.spindle_rpm), 0),
            Line::new().count(own.passes),
            Line::new().count(own.moves),
            figure(Some(own.time_s), 0),
        ]
    });
    let operations = Table {
        caption: "Operations in their order.".into(),
        columns: vec![
            Column::words("Operation"),
            Column::words("Tool"),
            Column::words("Cutter"),
            Column::numbers("Turns per minute"),
            Column::numbers("Passes"),
            Column::numbers("Moves"),
            Column::numbers("Time, s"),
        ],
        rows: rows.collect(),
    };
    Section {
        id: "nc-program",
        heading: "NC program".into(),
        blocks: vec![Block::Facts(facts), Block::Table(operations)],
    }
}
