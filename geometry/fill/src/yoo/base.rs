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
const MARGIN: f64 = 0.15;

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

/// How a grid is thrown.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Throw {
    /// How far the surface reaches beyond the loop, of its extent.
    margin: f64,
    /// Whether nodes that the loops do not enclose may miss the surface; they go on from those beside them.
    may_miss: bool,
}

impl Throw {
    /// Of a whole hole, as the paper has it.
    pub(crate) const WHOLE: Self = Self {
        margin: MARGIN,
        may_miss: false,
    };
    /// Of a part of one: lines beyond it may miss the surface.
    pub(super) const PART: Self = Self {
        margin: 0.04,
        may_miss: true,
    };
}

/// Nodes so far from a loop count as enclosed, in steps of the grid.
const BESIDE: f64 = 1.5;

/// Whether loops enclose a place, or it is beside one.
fn is_enclosed(loops: &[Vec<[f64; 2]>], at: [f64; 2], steps: [f64; 2]) -> bool {
    let mut is_in = false;
    for own in loops {
        for (k, p) in own.iter().enumerate() {
            let q = own[(k + 1) % own.len()];
            if (0..2).all(|c| (p[c] - at[c]).abs() < BESIDE * steps[c]) {
                return true;
            }
            if (p[1] > at[1]) != (q[1] > at[1]) {
                let crossing = p[0] + (at[1] - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
                is_in ^= crossing > at[0];
            }
        }
    }
    is_in
}

/// Nodes that have none go on from those beside them, by parabolas along rows and columns.
fn extended(mut nodes: Vec<Option<DVec3>>, counts: [usize; 2]) -> Option<Vec<DVec3>> {
    while nodes.iter().any(Option::is_none) {
        let mut next = nodes.clone();
        for (k, own) in next.iter_mut().enumerate().filter(|(_, own)| own.is_none()) {
            let place = [(k / counts[1]) as isize, (k % counts[1]) as isize];
            let (mut sum, mut count) = (DVec3::ZERO, 0.0);
            for way in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
                let at = |far: isize| {
                    let node = [0, 1].map(|c| place[c] + far * way[c]);
                    let is_there = (0..2).all(|c| (0..counts[c] as isize).contains(&node[c]));
                    let index =
                        is_there.then(|| node[0] as usize * counts[1] + node[1] as usize)?;
                    nodes[index]
                };
                if let (Some(a), Some(b), Some(c)) = (at(1), at(2), at(3)) {
                    sum += 3.0 * (a - b) + c;
                    count += 1.0;
                }
            }
            *own = (count > 0.0).then(|| sum / count);
        }
        if next == nodes {
            return None;
        }
        nodes = next;
    }
    nodes.into_iter().collect()
}

/// Axes across a normal in which loops are as small as can be, within steps of five degrees.
fn turned([x, y]: [DVec3; 2], places: &[DVec3]) -> [DVec3; 2] {
    let by = |k: i32| {
        let (sin, cos) = libm::sincos(f64::from(5 * k).to_radians());
        [cos * x + sin * y, cos * y - sin * x]
    };
    let size = |k: &i32| {
        let extent = by(*k).map(|axis| {
            let along = places.iter().map(|p| axis.dot(*p));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |own, a| {
                (own.0.min(a), own.1.max(a))
            });
            high - low
        });
        extent[0] * extent[1]
    };
    let best = (0..18).min_by(|a, b| size(a).total_cmp(&size(b)));
    by(best.unwrap_or_default())
}

/// Throws a grid of points onto the implicit surface and puts Ferguson patches through it.
pub(crate) fn base(
    surface: &Implicit,
    loops: &[Vec<DVec3>],
    normal: DVec3,
    edge_mm: f64,
    throw: Throw,
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
    let axes = if throw.may_miss {
        turned(axes, &places)
    } else {
        axes
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
    let step = extent * (1.0 + 2.0 * throw.margin) / cells;
    let margin = throw.margin * extent;
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
    let mut nodes: Vec<Option<DVec3>> = (0..counts[0] * counts[1])
        .into_par_iter()
        .with_min_len(16)
        .map(thrown)
        .collect();
    if throw.may_miss {
        let flat: Vec<Vec<[f64; 2]>> = loops
            .iter()
            .map(|own| own.iter().map(|&p| seen(p)).collect())
            .collect();
        let is_needed = |k: usize| {
            let at = [k / counts[1], k % counts[1]];
            let at = [0, 1].map(|c| first[c] + steps[c] * at[c] as f64);
            is_enclosed(&flat, at, steps)
        };
        if (0..nodes.len()).any(|k| nodes[k].is_none() && is_needed(k)) {
            return Err(Unseen::Missed);
        }
        nodes = extended(nodes, counts)
            .ok_or(Unseen::Missed)?
            .into_iter()
            .map(Some)
            .collect();
    }
    let points: Option<Vec<DVec3>> = nodes.into_iter().collect();
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
