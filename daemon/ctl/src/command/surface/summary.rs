//! A surface told to people.

use deliverables::SurfaceFigures;

use super::run::Surfaced;
use crate::output;

/// Pieces told one by one.
const MOST_PIECES: usize = 4;

/// The surface in lines.
pub(super) fn told(surfaced: &Surfaced) -> String {
    let mut lines = vec![surfaced.output.display().to_string()];
    let is_one = surfaced.placements.is_empty();
    let rows: Vec<Vec<String>> = if is_one {
        vec![row(&surfaced.surface)]
    } else {
        surfaced.placements.iter().map(row).collect()
    };
    lines.push(output::table(
        &[
            "KNOTS",
            "X x Y",
            "CONTROL POINTS",
            "MAX mm",
            "RMS mm",
            "WITHIN TOLERANCE",
        ],
        &[2, 3, 4, 5],
        rows,
    ));
    lines.push(format!(
        "grid         {} points at {} mm{}, noise {:.4} mm; tolerance {} mm",
        surfaced.surface.nodes,
        (surfaced.pitch_mm * 1e6).round() / 1e6,
        if surfaced.as_measured {
            " as measured"
        } else {
            ""
        },
        surfaced.noise_mm,
        surfaced.tolerance_mm
    ));
    for line in &surfaced.character_lines {
        let unit = if line.kind == "step" { " mm" } else { "" };
        lines.push(format!(
            "{:<12} at {} {:.2} mm, jump {:.3}{unit}",
            line.kind, line.at, line.at_mm, line.jump
        ));
    }
    if let Some(trimmed) = &surfaced.trimmed {
        lines.push(format!(
            "trimmed      {}; pieces meet on {:.1} mm, z steps on {:.1} mm",
            output::counted(trimmed.faces, "face"),
            trimmed.meeting_mm,
            trimmed.step_mm
        ));
    }
    if let Some(fairing) = &surfaced.fairing {
        lines.push(format!(
            "fairing      curvature variation {:.3e} to {:.3e} mm^-4 (1/{:.0}); moved {:.4} mm rms, \
             at most {:.4} of {} mm, {} to the bound",
            fairing.variation_before,
            fairing.variation_after,
            fairing.variation_before / fairing.variation_after.max(f64::MIN_POSITIVE),
            fairing.rms_move_mm,
            fairing.greatest_move_mm,
            fairing.bound_mm,
            output::counted(fairing.nodes_at_bound, "point")
        ));
    }
    lines.extend(
        surfaced
            .pictures
            .iter()
            .map(|path| format!("picture      {}", path.display())),
    );
    lines.join("\n")
}

fn row(figures: &SurfaceFigures) -> Vec<String> {
    let mut pieces: Vec<String> = figures
        .pieces
        .iter()
        .take(MOST_PIECES)
        .map(|[x, y]| format!("{x} x {y}"))
        .collect();
    if figures.pieces.len() > MOST_PIECES {
        pieces.push(format!("{} more", figures.pieces.len() - MOST_PIECES));
    }
    vec![
        figures.knots.clone(),
        pieces.join(", "),
        figures.control_points.to_string(),
        format!("{:.4}", figures.max_mm),
        format!("{:.4}", figures.rms_mm),
        format!("{:.2} %", 100.0 * figures.within_tolerance_share),
    ]
}
