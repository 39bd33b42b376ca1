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
//! Where z goes on smoothly over a border, as where a step runs out, both pieces pass the nodes on
//! either side; and borders that leave nodes on the wrong side are drawn closer to the nodes. Pieces
//! are trimmed only if every data point then lies within the tolerance of the face where it is, and
//! pieces meet within it wherever there is no step.
//!
//! A piece is trimmed, and its surface goes on beyond its trims by a few nodes.

mod block;
mod regions;
mod settle;
mod trims;

use std::collections::{BTreeMap, BTreeSet};

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
use trims::{Mend, Trimmed};

/// Shares of the tolerance that pieces which part where they should meet are fitted within the next
/// time: two that pass the same nodes within half of it meet within it. There is none after the last.
const SHARES: [f64; 3] = [0.7, 0.5, 0.5];

/// How trimmed pieces meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lines {
    /// Length of the lines on which two pieces meet within the tolerance, millimetres.
    pub meeting_mm: f64,
    /// Length of those on which z steps from one piece to the other: by no more than it does between
    /// data points within two nodes but for twice the tolerance, and there, carried on straight from
    /// both sides, by half of it more than a crease explains.
    pub step_mm: f64,
    /// Length of the others, on which pieces part by more than the tolerance though the data beside
    /// have no such step: none, or pieces are not trimmed.
    pub open_mm: f64,
    /// Greatest distance in z of two pieces on a line, but for steps, millimetres.
    pub greatest_gap_mm: f64,
    /// Data points that the face where they are, or none, does not pass within the tolerance: none, or
    /// pieces are not trimmed.
    pub nodes_across: usize,
    /// Data points in no piece: none, or pieces are not trimmed.
    pub left_out: usize,
}

impl Lines {
    /// Whether every data point is on a face within the tolerance, and pieces meet within it but for
    /// steps.
    fn hold(&self) -> bool {
        self.nodes_across == 0 && self.left_out == 0 && self.open_mm == 0.0
    }
}

/// Trimmed pieces, and how they were made.
pub(crate) struct Parted {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) model: Model,
    /// Data minus the face where the node is, millimetres.
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
    let part = |from: f64, size: f64| Part {
        monitor,
        from,
        size,
    };
    let image = grid.to_image();
    let Some((image, map)) = regions::regions(grid, &image, tolerance_mm, &part(0.0, 0.3))? else {
        return Ok(None);
    };
    let mut bands = regions::bands(grid, &map, tolerance_mm);
    let mut deviations_mm = vec![f64::NAN; grid.raw_z_mm().len()];
    let mut pieces: Vec<Piece> = Vec::new();
    let mut again: BTreeMap<u16, f64> = (1..=map.regions()).map(|label| (label, 1.0)).collect();
    let round = 0.7 / SHARES.len() as f64;
    for (begun, closer) in SHARES.into_iter().enumerate() {
        let from = 0.3 + round * begun as f64;
        let size = 0.6 * round / again.len().max(1) as f64;
        for (done, (&label, share)) in again.iter().enumerate() {
            let part = part(from + size * done as f64, size);
            let at = usize::from(label) - 1;
            let region = Region {
                map: &map,
                label,
                band: &bands[at],
            };
            let within_mm = share * tolerance_mm;
            let Some(piece) = fitted(grid, &region, within_mm, &mut deviations_mm, &part)? else {
                return Ok(None);
            };
            match pieces.get_mut(at) {
                Some(old) => *old = piece,
                None => pieces.push(piece),
            }
        }
        let part = part(from + 0.6 * round, 0.4 * round);
        let mend = if begun + 1 < SHARES.len() {
            Mend::Surfaces
        } else {
            Mend::Borders
        };
        let trimmed = trims::trimmed(grid, &image, &map, &pieces, tolerance_mm, mend, &part)?;
        let Some(Trimmed {
            model,
            lines,
            open,
            elsewhere,
            across,
        }) = trimmed
        else {
            return Ok(None);
        };
        if lines.hold() {
            for (n, off_mm) in elsewhere {
                deviations_mm[n] = off_mm;
            }
            return Ok(Some(Parted {
                control_points: pieces.iter().map(|p| p.knots.control_points()).sum(),
                pieces,
                model,
                deviations_mm,
                lines,
            }));
        }
        again = open.iter().map(|label| (*label, closer)).collect();
        for (n, label) in across {
            // Where the samples end nothing else is to be had.
            let Some(label) = label else { return Ok(None) };
            // A face that lies where a node of another does passes that, too.
            bands[usize::from(label) - 1].insert(n);
            again.entry(label).or_insert(1.0);
        }
        if again.is_empty() {
            return Ok(None);
        }
    }
    Ok(None)
}

/// The nodes that a piece is to pass.
struct Region<'a> {
    map: &'a RegionMap,
    label: u16,
    /// Nodes of others.
    band: &'a BTreeSet<usize>,
}

/// The surface of one region; `None` where it does not come within the tolerance.
fn fitted(
    grid: &HeightGrid,
    region: &Region<'_>,
    tolerance_mm: f64,
    deviations_mm: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<Option<Piece>, SurfaceError> {
    let is_own = |n: usize| region.map.raw_labels()[n] == region.label;
    let Some(block) = Block::of(grid, |n| is_own(n) || region.band.contains(&n)) else {
        return Ok(None);
    };
    let mut problem = Problem::of_part(&block.grid, tolerance_mm, monitor);
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
            let n = (block.first[0] + i) * grid.rows() + block.first[1] + j;
            if !own[at].is_nan() && is_own(n) {
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
