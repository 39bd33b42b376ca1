//! Pieces that end at character lines in any direction: oblique and curved creases and steps.
//!
//! 1. The grid is segmented at creases and steps far below those that matter, and neighbouring
//!    regions are joined as long as one surface over both takes about as few control points as two
//!    ([`regions`]): what stays apart pays.
//! 2. Each region gets a surface of its own, with as few knots as its own nodes ask for
//!    ([`crate::optimal`]), carried on smoothly beyond them ([`block`]).
//! 3. The borders between regions are drawn and the surfaces trimmed by `reconstruct`: at a crease
//!    by the curve in which both surfaces intersect, at a step by one curve between their nodes.
//!
//! A piece is trimmed, and its surface goes on beyond its trims by a few nodes.

mod block;
mod regions;
mod trims;

use range_image::{Monitor, RegionMap};
use reconstruct::Model;

use crate::axis::Axis;
use crate::error::SurfaceError;
use crate::fit;
use crate::grid::HeightGrid;
use crate::optimal;
use crate::problem::Problem;
use crate::surface::{Part, Piece, in_space};
use crate::within::fit_within;
use block::{Block, MARGIN};

/// How trimmed pieces meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lines {
    /// Length of the lines on which two pieces meet within the tolerance, millimetres.
    pub meeting_mm: f64,
    /// Length of those on which z steps from one piece to the other, as it does between data points
    /// beside.
    pub step_mm: f64,
    /// Length of those on which pieces part by more than the tolerance though the data beside have no
    /// step: their heights, carried on straight from both sides, meet within it.
    pub open_mm: f64,
    /// Greatest distance in z of two pieces on a line, but for steps, millimetres.
    pub greatest_gap_mm: f64,
    /// Data points on the other side of the trim of their piece, and not within the tolerance of what
    /// is there: trims run smoothly between the points, and past a few by less than a pitch.
    pub nodes_across: usize,
    /// Data points, apart from all others, that are too few for a face.
    pub left_out: usize,
}

/// Trimmed pieces, and how they were made.
pub(crate) struct Parted {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) model: Model,
    /// Data minus the surface of the node's own piece, millimetres.
    pub(crate) deviations_mm: Vec<f64>,
    pub(crate) lines: Lines,
    pub(crate) control_points: usize,
}

/// The grid in pieces that are cut along lines in any direction. `None` where there are none, or
/// they cannot be trimmed.
///
/// # Errors
/// [`SurfaceError::Cancelled`] at the monitor's wish.
pub(crate) fn parted(
    grid: &HeightGrid,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<Parted>, SurfaceError> {
    let image = grid.to_image();
    let part = |from: f64, size: f64| Part {
        monitor,
        from,
        size,
    };
    let Some(map) = regions::regions(grid, &image, tolerance_mm, &part(0.0, 0.3))? else {
        return Ok(None);
    };
    let counts = usize::from(map.regions());
    let mut deviations_mm = vec![f64::NAN; grid.raw_z_mm().len()];
    let mut pieces: Vec<Piece> = Vec::new();
    let mut control_points = 0;
    for label in 1..=map.regions() {
        let from = 0.3 + 0.6 * f64::from(label - 1) / counts as f64;
        let part = part(from, 0.6 / counts as f64);
        let Some(piece) = fitted(grid, &map, label, tolerance_mm, &mut deviations_mm, &part)?
        else {
            return Ok(None);
        };
        control_points += piece.knots.control_points();
        pieces.push(piece);
    }
    let trimmed = trims::trimmed(grid, &image, &map, &pieces, tolerance_mm, &part(0.9, 0.1))?;
    Ok(trimmed.map(|(model, lines)| Parted {
        pieces,
        model,
        deviations_mm,
        lines,
        control_points,
    }))
}

/// The surface of one region; `None` where it does not come within the tolerance.
fn fitted(
    grid: &HeightGrid,
    map: &RegionMap,
    label: u16,
    tolerance_mm: f64,
    deviations_mm: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<Option<Piece>, SurfaceError> {
    let Some(block) = Block::of(grid, |n| map.raw_labels()[n] == label) else {
        return Ok(None);
    };
    let mut problem = Problem::new(&block.grid, tolerance_mm, monitor);
    let share = block.grid.raw_z_mm().len() as f64 / grid.raw_z_mm().len() as f64;
    let visits = (optimal::MOST_VISITS as f64 * share.min(1.0)) as usize;
    let knots = optimal::place(&mut problem, &[Vec::new(), Vec::new()], visits, monitor)?;
    let (Some(u), Some(v)) = (Axis::new(&knots.u), Axis::new(&knots.v)) else {
        return Ok(None);
    };
    let fitted = fit_within(&problem, &u, &v, monitor)?.fit;
    monitor.check()?;
    if fitted.score.max > tolerance_mm {
        return Ok(None);
    }
    let z = fit::values(&u, &v, &fitted.coefficients);
    let (own, rows) = (block.grid.raw_z_mm(), block.grid.rows());
    for i in 0..block.extent[0] {
        for j in 0..block.extent[1] {
            let at = (i + MARGIN) * rows + j + MARGIN;
            if !own[at].is_nan() {
                let n = (block.first[0] + i) * grid.rows() + block.first[1] + j;
                deviations_mm[n] = own[at] - z[at];
            }
        }
    }
    let [columns, rows] = [0, 1].map(|d| block.first[d]..block.first[d] + block.extent[d]);
    Ok(Some(Piece {
        surface: in_space(&block.grid, &knots, &fitted.coefficients)?,
        knots,
        columns,
        rows,
    }))
}
