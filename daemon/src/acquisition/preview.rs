//! What a scan would be, before it is begun.

use std::f64::consts::PI;

use relief_api::{ScanPreview, SettingOverrides};
use scanner_protocol::Identity;

use super::calibration;
use super::plan::ResolvedPlan;
use super::view::View;
use crate::config::Processing;

/// A window narrower than this many columns or samples spans no plane.
const NARROW: f64 = 3.0;

/// What these come to on this scanner.
pub(crate) fn preview(
    scanner: &str,
    identity: &Identity,
    resolved: &ResolvedPlan,
    processing: &Processing,
) -> ScanPreview {
    let plan = &resolved.plan;
    let calibration = calibration(&identity.calibration);
    let view = View::of(resolved, &calibration);
    let steps = f64::from(plan.samples.saturating_sub(1).max(1));
    let sample_spacing_mm = view
        .and_then(|view| view.y_mm)
        .map(|[first, last]| (last - first).abs() / steps);
    let settings =
        processing.pipeline_settings(resolved.column_pitch_mm, sample_spacing_mm.unwrap_or(0.0));
    let regrid = &settings.regrid;
    let window_mm = sample_spacing_mm.map(|spacing_mm| {
        let of_each_mm2 = resolved.column_pitch_mm * spacing_mm;
        2.0 * (regrid.neighbours as f64 * of_each_mm2 / PI).sqrt()
    });
    let sides_mm = view.and_then(|view| view.sides_mm(&processing.regrid));
    let by_nodes_mm2 = settings.segment.minimum_nodes as f64 * regrid.pitch_mm * regrid.pitch_mm;
    let line_rate_hz = f64::from(identity.limits.max_line_rate_millihz) * 1e-3;
    let mut notes = Vec::new();
    let coarsest_mm = resolved
        .column_pitch_mm
        .max(sample_spacing_mm.unwrap_or_default());
    if regrid.pitch_mm < 0.5 * coarsest_mm {
        notes.push(format!(
            "the grid of {:.3} mm is finer than the samples, which lie {coarsest_mm:.3} mm apart: \
             its nodes share their samples, and show no more detail",
            regrid.pitch_mm
        ));
    }
    if regrid.pitch_mm > 4.0 * coarsest_mm {
        notes.push(format!(
            "the grid of {:.3} mm is much coarser than the samples, which lie {coarsest_mm:.3} mm \
             apart: their detail is lost",
            regrid.pitch_mm
        ));
    }
    if window_mm.is_some_and(|window_mm| window_mm < NARROW * coarsest_mm) {
        notes.push(format!(
            "with regrid.neighbours = {} a node's samples span hardly {NARROW} columns: ask for \
             more, or for a narrower pitch",
            regrid.neighbours
        ));
    }
    ScanPreview {
        scanner: scanner.to_owned(),
        columns: plan.columns,
        column_pitch_mm: resolved.column_pitch_mm,
        x_mm: view.map_or([calibration.x_mm(plan.first_table_counts); 2], |view| {
            view.x_mm
        }),
        samples: plan.samples,
        y_mm: view.and_then(|view| view.y_mm),
        sample_spacing_mm,
        exposure_us: plan.exposure_us,
        least_s: (line_rate_hz > 0.0).then(|| f64::from(plan.columns) / line_rate_hz),
        grid_nodes: sides_mm.map(|sides| sides.map(|mm| (mm / regrid.pitch_mm) as u64 + 1)),
        window_mm,
        least_face_mm2: by_nodes_mm2.max(settings.segment.minimum_area_mm2),
        settings: shaping(&settings),
        journal_bytes: scan_record::most_bytes(plan.columns, plan.samples.into()),
        refused: None,
        notes,
    }
}

/// The settings that shape the result, keyed as in the configuration.
fn shaping(settings: &pipeline::Settings) -> SettingOverrides {
    let (regrid, segment, reconstruct) =
        (&settings.regrid, &settings.segment, &settings.reconstruct);
    let all: [(&str, serde_json::Value); 11] = [
        ("regrid.pitch_mm", regrid.pitch_mm.into()),
        ("regrid.neighbours", regrid.neighbours.into()),
        ("regrid.draws", regrid.draws.into()),
        ("regrid.reach_columns", regrid.reach_columns.into()),
        ("regrid.estimator", regrid.estimator.as_str().into()),
        ("segment.minimum_nodes", segment.minimum_nodes.into()),
        (
            "segment.smooth_joins",
            settings.smooth_joins.as_str().into(),
        ),
        ("reconstruct.kinds", settings.kinds.as_str().into()),
        (
            "reconstruct.regularize",
            settings.regularize.bound().map_or("off".into(), Into::into),
        ),
        ("reconstruct.tolerance_mm", reconstruct.tolerance_mm.into()),
        (
            "reconstruct.knots_per_side",
            reconstruct.knots_per_side.into(),
        ),
    ];
    all.map(|(key, value)| (key.to_owned(), value)).into()
}
