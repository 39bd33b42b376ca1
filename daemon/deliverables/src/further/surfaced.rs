//! What is told of a surface over a grid.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use surfacing::{Made, Placement, Settings};

/// What a placement of knots comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceFigures {
    /// How knots were placed.
    pub knots: String,
    /// Control points along x and y, for each piece.
    pub pieces: Vec<[usize; 2]>,
    /// Control points of all pieces.
    pub control_points: usize,
    /// Greatest distance in z of a grid point.
    pub max_mm: f64,
    /// Root mean square of these distances.
    pub rms_mm: f64,
    /// Grid points.
    pub nodes: usize,
    /// Part of them within the tolerance, 0 to 1.
    pub within_tolerance_share: f64,
}

/// A line along the grid on which z or the slope jumps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CharacterLineFigures {
    /// `step` or `crease`.
    pub kind: String,
    /// The coordinate that is constant on it, `x` or `y`.
    pub at: String,
    /// That coordinate.
    pub at_mm: f64,
    /// Millimetres of a step, change of slope of a crease.
    pub jump: f64,
}

/// How trimmed pieces meet, where character lines run across the grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrimmedFigures {
    /// Trimmed faces.
    pub faces: usize,
    /// Length of the lines on which pieces meet within the tolerance.
    pub meeting_mm: f64,
    /// Length of those on which z steps.
    pub step_mm: f64,
    /// Length of those on which pieces part though the data have no step.
    pub open_mm: f64,
    /// Greatest distance in z of two pieces, but on steps.
    pub greatest_gap_mm: f64,
    /// Grid points past the trim of their piece.
    pub nodes_across: usize,
    /// Grid points in no piece.
    pub left_out: usize,
}

impl TrimmedFigures {
    /// The figures, where pieces are trimmed.
    #[must_use]
    pub fn of(made: &Made) -> Option<Self> {
        let (lines, model) = (made.report.trimmed?, made.trimmed.as_ref()?);
        Some(Self {
            faces: model.faces.len(),
            meeting_mm: lines.meeting_mm,
            step_mm: lines.step_mm,
            open_mm: lines.open_mm,
            greatest_gap_mm: lines.greatest_gap_mm,
            nodes_across: lines.nodes_across,
            left_out: lines.left_out,
        })
    }
}

/// What fairing did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FairingFigures {
    /// No point was moved farther.
    pub bound_mm: f64,
    /// Mean square of the third derivative along x and y, mm^-4.
    pub variation_before: f64,
    /// The same after.
    pub variation_after: f64,
    /// Greatest move of a point.
    pub greatest_move_mm: f64,
    /// Root mean square of the moves.
    pub rms_move_mm: f64,
    /// Points moved as far as the bound.
    pub nodes_at_bound: usize,
}

impl SurfaceFigures {
    /// The figures of a surface.
    #[must_use]
    pub fn of(made: &Made) -> Self {
        let report = &made.report;
        Self {
            knots: report.placement.as_str().to_owned(),
            pieces: report.of_pieces.clone(),
            control_points: report.control_points,
            max_mm: report.max_mm,
            rms_mm: report.rms_mm,
            nodes: report.nodes,
            within_tolerance_share: report.within_tolerance as f64 / report.nodes.max(1) as f64,
        }
    }
}

impl CharacterLineFigures {
    /// Those that were found.
    #[must_use]
    pub fn of(made: &Made) -> Vec<Self> {
        let pitch_mm = made.data.pitch_mm();
        let line = |line: &surfacing::CharacterLine| Self {
            kind: match line.kind {
                surfacing::LineKind::Step => "step",
                surfacing::LineKind::Crease => "crease",
            }
            .to_owned(),
            at: if line.is_at_x { "x" } else { "y" }.to_owned(),
            at_mm: line.at * pitch_mm
                + if line.is_at_x {
                    made.data.x_mm(0)
                } else {
                    made.data.y_mm(0)
                },
            jump: line.jump,
        };
        made.report.lines.iter().map(line).collect()
    }
}

impl FairingFigures {
    /// What it did, where it was asked for.
    #[must_use]
    pub fn of(made: &Made) -> Option<Self> {
        made.report.fairing.map(|fairing| Self {
            bound_mm: fairing.bound_mm,
            variation_before: fairing.variation_before,
            variation_after: fairing.variation_after,
            greatest_move_mm: fairing.greatest_move_mm,
            rms_move_mm: fairing.rms_move_mm,
            nodes_at_bound: fairing.at_bound,
        })
    }
}

/// What the settings are called where the user chose them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SurfaceWords {
    /// Optimal knots.
    pub optimal: &'static str,
    /// The tolerance.
    pub tolerance: &'static str,
    /// Fairing.
    pub fair: &'static str,
    /// The limits of the region of interest.
    pub roi: &'static str,
}

impl SurfaceWords {
    /// On the command line.
    pub const OPTIONS: Self = Self {
        optimal: "--knots optimal",
        tolerance: "--tolerance-mm",
        fair: "--fair-mm",
        roi: "--roi-x-mm, --roi-y-mm and --roi-z-mm",
    };
    /// In the configuration.
    pub const KEYS: Self = Self {
        optimal: "deliverables.surface.knots = \"optimal\"",
        tolerance: "deliverables.surface.tolerance_mm",
        fair: "deliverables.surface.fair_mm",
        roi: "regrid.roi_x_mm, regrid.roi_y_mm and regrid.roi_z_mm",
    };
}

/// What the user ought to know about the surface.
#[must_use]
pub fn surface_remarks(made: &Made, settings: &Settings, words: SurfaceWords) -> Vec<String> {
    let report = &made.report;
    let mut remarks = Vec::new();
    if report.max_mm > settings.tolerance_mm {
        remarks.push(format!(
            "{} knots leave {} of {} grid points outside of the tolerance, the farthest by {:.3} \
             mm; {} keeps to it",
            report.placement.as_str(),
            report.nodes - report.within_tolerance,
            report.nodes,
            report.max_mm - settings.tolerance_mm,
            words.optimal
        ));
    }
    // A surface that needs a control point for every fourth data point follows something else
    // than shape.
    if report.placement == Placement::Optimal && 4 * report.control_points > report.nodes {
        let mut remark = format!(
            "the tolerance asks for {} control points for {} grid points",
            report.control_points, report.nodes
        );
        if report.noise_mm > 0.2 * settings.tolerance_mm {
            let _ = write!(
                remark,
                "; the grid's noise is {:.3} mm, five times of which are a sensible {}, or fair it \
                 with {}",
                report.noise_mm, words.tolerance, words.fair
            );
        } else {
            let _ = write!(
                remark,
                "; steps in the scan may ask for them, which {} can leave out",
                words.roi
            );
        }
        remarks.push(remark);
    }
    remarks
}
