//! Settings, those first that someone chose.

use page::{Block, Column, Line, Section, Table};
use pipeline::{Method, Settings};

use crate::export::{CadOptions, Schema};
use crate::report::{Report, SettingsReport};
use crate::summary;

pub(super) fn section(report: &Report) -> Section {
    let used = told(&report.settings);
    let usual = told(&defaults(report));
    let pairs: Vec<_> = used.into_iter().zip(usual).collect();
    let (chosen, left): (Vec<_>, Vec<_>) = pairs
        .into_iter()
        .partition(|((_, used), (_, usual))| used != usual);
    let mut blocks = Vec::new();
    if chosen.is_empty() {
        blocks.push(Block::Text(
            "All settings are as they are by default.".into(),
        ));
    } else {
        let rows = chosen.into_iter();
        blocks.push(Block::Table(Table {
            caption: "Settings that differ from the default.".into(),
            columns: vec![
                Column::words("Setting"),
                Column::words("Value"),
                Column::words("Default"),
            ],
            rows: rows
                .map(|((key, used), (_, usual))| {
                    vec![Line::new().code(key), used.into(), usual.into()]
                })
                .collect(),
        }));
    }
    let rows = left.into_iter();
    blocks.push(Block::Table(Table {
        caption: "Settings at their defaults; the pitch follows the scan where none is set.".into(),
        columns: vec![Column::words("Setting"), Column::words("Value")],
        rows: rows
            .map(|((key, used), _)| vec![Line::new().code(key), used.into()])
            .collect(),
    }));
    Section {
        id: "settings",
        heading: "Settings".into(),
        blocks,
    }
}

/// What the settings would be had nobody chosen any but the method.
fn defaults(report: &Report) -> SettingsReport {
    let used = &report.settings;
    let method = if used.method == Method::ShimLee.as_str() {
        Method::ShimLee
    } else {
        Method::Relief
    };
    let settings = Settings::new(used.pitch_mm).with_method(method);
    // Only the service writes a STEP file of itself.
    let cad = CadOptions {
        step: report.scan.id.as_ref().map(|_| Schema::Ap242),
        ..CadOptions::default()
    };
    SettingsReport {
        method: Method::Relief.as_str().to_owned(),
        ..summary::settings(&settings, &cad)
    }
}

/// Settings by their names in the configuration.
fn told(settings: &SettingsReport) -> Vec<(&'static str, String)> {
    let limits = |[low, high]: [Option<f64>; 2]| match (low, high) {
        (None, None) => "no limits".to_owned(),
        (low, high) => {
            let shown = |limit: Option<f64>| limit.map_or_else(String::new, |mm| mm.to_string());
            format!("{} to {}", shown(low), shown(high))
        }
    };
    let mut told = vec![
        ("reconstruct.method", settings.method.clone()),
        ("reconstruct.kinds", settings.kinds.clone()),
        (
            "reconstruct.tolerance_mm",
            settings.tolerance_mm.to_string(),
        ),
        ("regrid.pitch_mm", settings.pitch_mm.to_string()),
        ("regrid.estimator", settings.estimator.clone()),
        ("regrid.neighbours", settings.neighbours.to_string()),
        ("regrid.draws", settings.draws.to_string()),
        ("regrid.reach_columns", settings.reach_columns.to_string()),
        ("regrid.seed", settings.seed.to_string()),
        ("regrid.roi_x_mm", limits(settings.roi_x_mm)),
        ("regrid.roi_y_mm", limits(settings.roi_y_mm)),
        ("regrid.roi_z_mm", limits(settings.roi_z_mm)),
        ("segment.background", settings.background.clone()),
        ("segment.clusters", settings.clusters.to_string()),
        (
            "segment.crease_angle_rad",
            settings.crease_angle_rad.to_string(),
        ),
        ("segment.step_factor", settings.step_factor.to_string()),
        ("segment.minimum_nodes", settings.minimum_nodes.to_string()),
        (
            "segment.minimum_area_mm2",
            settings.minimum_area_mm2.to_string(),
        ),
        ("fill.mode", settings.fill.clone()),
        ("fill.max_size_mm", settings.fill_max_size_mm.to_string()),
        ("deliverables.entities", settings.iges_entities.to_string()),
        ("deliverables.step", settings.step.clone()),
        ("deliverables.step_units", settings.step_units.clone()),
    ];
    told.extend(further(settings));
    told
}

/// What is asked for beside the model, in the words of the configuration.
fn further(settings: &SettingsReport) -> [(&'static str, String); 3] {
    let off = || "off".to_owned();
    let surface = settings.surface.as_ref().map_or_else(off, |own| {
        let fair = own.fair_mm.map(|mm| format!(", fair_mm {mm}"));
        let fair = fair.unwrap_or_default();
        format!(
            "tolerance_mm {}, knots {}{fair}",
            own.tolerance_mm, own.knots
        )
    });
    let skin = settings.skin.as_ref().map_or_else(off, |own| {
        let every = own.every_mm.map(|mm| format!(", every_mm {mm}"));
        let every = every.unwrap_or_default();
        let (method, degree) = (&own.method, own.degree);
        let tolerance = own.tolerance_mm;
        format!("tolerance_mm {tolerance}, method {method}, degree {degree}{every}")
    });
    let toolpath = settings.toolpath.as_ref().map_or_else(off, |own| {
        let rough = own.rough.as_ref().map(|rough| format!(", rough {rough}"));
        let rough = rough.unwrap_or_default();
        format!(
            "of {}, tool {}{rough}, scallop_mm {}, pattern {}",
            own.of, own.tool, own.scallop_mm, own.pattern
        )
    });
    [
        ("deliverables.surface", surface),
        ("deliverables.skin", skin),
        ("deliverables.toolpath", toolpath),
    ]
}
