//! The base surface of a hole.

use glam::DVec3;
use nurbs::BSplineSurface;
use rayon::prelude::*;

use super::ferguson::Grid;
use crate::implicit::Implicit;

/// Cells across the hole, at least and at most.
const FEWEST_CELLS: f64 = 8.0;
const MOST_CELLS: f64 = 80.0;
/// How far the surface reaches beyond the loop, of its extent.
pub(crate) const MARGIN: f64 = 0.15;

/// Why a hole has no base surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unseen {
    /// Lines along the mean normal miss the implicit surface, or there is no such normal.
    #[error("lines along its mean normal do not meet the surface: it is not seen whole from there")]
    Missed,
    /// The loop crosses itself on the base surface.
    #[error("its loop crosses itself as its mean normal sees it")]
    Crossed,
    /// No elements come out.
    #[error("no elements can be made on its base surface")]
    NoElements,
}

/// The base surface, over millimetres along two axes that see the mean normal's way.
#[derive(Debug, Clone)]
pub(crate) struct Base {
    pub(crate) surface: BSplineSurface,
    origin: DVec3,
    axes: [DVec3; 2],
}

impl Base {
    /// Where a place is seen.
    pub(super) fn seen(&self, place: DVec3) -> [f64; 2] {
        self.axes.map(|axis| axis.dot(place - self.origin))
    }
}

/// Throws a grid of points onto the implicit surface and puts Ferguson patches through it, which reach
/// beyond the loops by a margin, of their extent.
pub(crate) fn base(
    surface: &Implicit,
    loops: &[Vec<DVec3>],
    normal: DVec3,
    edge_mm: f64,
    margin: f64,
) -> Result<Base, Unseen> {
    let places: Vec<DVec3> = loops.iter().flatten().copied().collect();
    if normal == DVec3::ZERO || places.is_empty() {
        return Err(Unseen::Missed);
    }
    let (x, y) = normal.any_orthonormal_pair();
    // Right-handed, so that loops run counter-clockwise.
    let axes = if x.cross(y).dot(normal) > 0.0 {
        [x, y]
    } else {
        [y, x]
    };
    let origin = places.iter().sum::<DVec3>() / places.len() as f64;
    let seen = |p: DVec3| axes.map(|axis| axis.dot(p - origin));
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for own in places.iter().map(|&p| seen(p)) {
        for k in 0..2 {
            low[k] = low[k].min(own[k]);
            high[k] = high[k].max(own[k]);
        }
    }
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let cells = (extent / edge_mm).clamp(FEWEST_CELLS, MOST_CELLS);
    let step = extent * (1.0 + 2.0 * margin) / cells;
    let margin = margin * extent;
    let counts = [0, 1].map(|k| {
        let cells = (high[k] - low[k] + 2.0 * margin) / step;
        (cells.ceil() as usize).max(3) + 1
    });
    let steps = [0, 1].map(|k| (high[k] - low[k] + 2.0 * margin) / (counts[k] - 1) as f64);
    let first = [low[0] - margin, low[1] - margin];
    let reach = 2.0 * extent;
    let thrown = |k: usize| {
        let (i, j) = (k / counts[1], k % counts[1]);
        let (u, v) = (
            first[0] + steps[0] * i as f64,
            first[1] + steps[1] * j as f64,
        );
        let from = origin + u * axes[0] + v * axes[1];
        // From the height of the loop's nearest point, which is near the surface's.
        let near = places.iter().min_by(|a, b| {
            let apart = |p: &DVec3| {
                let own = seen(*p);
                (own[0] - u) * (own[0] - u) + (own[1] - v) * (own[1] - v)
            };
            apart(a).total_cmp(&apart(b))
        })?;
        let height = normal.dot(*near - origin);
        let found = surface
            .along(from + height * normal, normal, reach)
            .or_else(|| surface.along(from, normal, reach))?;
        // What faces away was met from behind.
        (surface.at(found).1.dot(normal) > 0.0).then_some(found)
    };
    let points: Option<Vec<DVec3>> = (0..counts[0] * counts[1])
        .into_par_iter()
        .with_min_len(16)
        .map(thrown)
        .collect();
    let grid = Grid {
        columns: counts[0],
        rows: counts[1],
        points: points.ok_or(Unseen::Missed)?,
    };
    let surface = grid.patches(first, steps).ok_or(Unseen::Missed)?;
    Ok(Base {
        surface,
        origin,
        axes,
    })
}
