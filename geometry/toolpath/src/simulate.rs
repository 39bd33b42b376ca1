//! What the moves leave of the stock: a field of heights from which cutters take material.
//!
//! Nothing here knows how the moves were found. At each node the height that a move leaves is the
//! least of `z(t) + h(rho(t))` over the way `t` of the tool, `h` being the cutter's profile and
//! `rho` the distance from its axis: convex along a straight move, and found by the sign of its
//! derivative. Arcs are taken as chords.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::cutter::Cutter;
use crate::error::ToolpathError;
use crate::machine::Cuboid;
use crate::motion::{Operation, Travel};
use crate::surface::Surface;
use crate::way::Way;

/// Nodes at most.
const MOST_NODES: usize = 16_000_000;
/// How far chords may lie off arcs.
const CHORD_MM: f64 = 5e-5;
/// Rapid moves that take more than this run into material.
const RAPID_MM: f64 = 1e-3;
/// Rows that a task looks after.
const BAND: usize = 16;

/// Heights over a grid, columns along x, rows along y. Millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    /// Place of the first node.
    pub origin_mm: [f64; 2],
    /// Distance of nodes.
    pub pitch_mm: f64,
    /// Along x.
    pub columns: usize,
    /// Along y.
    pub rows: usize,
    /// By rows.
    pub heights_mm: Vec<f64>,
}

/// What was removed, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Removal {
    /// What is left.
    pub field: HeightField,
    /// Deepest that a rapid move cut into material, and where; 0 where none did.
    pub rapid_cut_mm: f64,
    /// Where that was.
    pub rapid_cut_at_mm: [f64; 2],
}

/// A straight move of a cutter.
struct Stroke {
    cutter: usize,
    from: [f64; 3],
    to: [f64; 3],
    is_rapid: bool,
}

impl HeightField {
    /// The top of a box, over the part of it that is within the given limits along x and y.
    ///
    /// # Errors
    /// [`ToolpathError::TooMany`]
    pub fn of_stock(
        stock: &Cuboid,
        within_mm: [[f64; 2]; 2],
        pitch_mm: f64,
    ) -> Result<Self, ToolpathError> {
        let side = |[low, high]: [f64; 2]| ((high - low) / pitch_mm).floor().max(0.0) as usize + 1;
        let (columns, rows) = (side(within_mm[0]), side(within_mm[1]));
        let wanted = columns.saturating_mul(rows);
        if wanted > MOST_NODES {
            return Err(ToolpathError::TooMany {
                what: "nodes of the simulation",
                wanted,
                most: MOST_NODES,
                mend: "choose a larger pitch",
            });
        }
        Ok(Self {
            origin_mm: [within_mm[0][0], within_mm[1][0]],
            pitch_mm,
            columns,
            rows,
            heights_mm: vec![stock.z_mm[1]; wanted],
        })
    }

    /// Place of a node.
    #[must_use]
    pub fn place_mm(&self, column: usize, row: usize) -> [f64; 2] {
        [
            self.origin_mm[0] + column as f64 * self.pitch_mm,
            self.origin_mm[1] + row as f64 * self.pitch_mm,
        ]
    }

    /// Takes away what the operations take, in their order.
    ///
    /// # Errors
    /// [`Cancelled`]
    pub fn remove(
        mut self,
        operations: &[Operation],
        monitor: &dyn Monitor,
    ) -> Result<Removal, Cancelled> {
        let cutters: Vec<Cutter> = operations.iter().map(|o| o.cutter).collect();
        let mut strokes = Vec::new();
        for (cutter, operation) in operations.iter().enumerate() {
            let mut from = operation
                .moves
                .first()
                .map_or([0.0; 3], |first| first.to_mm);
            for step in &operation.moves {
                for to in step.points_mm(from, CHORD_MM) {
                    strokes.push(Stroke {
                        cutter,
                        from,
                        to,
                        is_rapid: step.travel == Travel::Rapid,
                    });
                    from = to;
                }
            }
        }
        let (origin, pitch, columns) = (self.origin_mm, self.pitch_mm, self.columns);
        // Fine paths have millions of strokes: each band looks at those that come near it.
        let mut near: Vec<Vec<u32>> = vec![Vec::new(); self.rows.div_ceil(BAND)];
        for (index, stroke) in (0..).zip(&strokes) {
            let radius = cutters.get(stroke.cutter).map_or(0.0, Cutter::radius_mm);
            let (a, b) = (stroke.from[1], stroke.to[1]);
            let band = |y: f64| ((y - origin[1]) / (BAND as f64 * pitch)).max(0.0) as usize;
            let last = band(a.max(b) + radius + pitch);
            for list in near
                .iter_mut()
                .take(last + 1)
                .skip(band(a.min(b) - radius - pitch))
            {
                list.push(index);
            }
        }
        let bands: Result<Vec<(f64, [f64; 2])>, Cancelled> = self
            .heights_mm
            .par_chunks_mut(BAND * columns.max(1))
            .enumerate()
            .map(|(band_number, heights)| {
                monitor.check()?;
                let mut band = Band {
                    origin: [origin[0], origin[1] + (band_number * BAND) as f64 * pitch],
                    pitch,
                    columns,
                    heights,
                    worst: (0.0, [0.0; 2]),
                };
                for index in &near[band_number] {
                    let stroke = &strokes[*index as usize];
                    if let Some(cutter) = cutters.get(stroke.cutter) {
                        band.cut(cutter, stroke);
                    }
                }
                Ok(band.worst)
            })
            .collect();
        let worst = bands?
            .into_iter()
            .fold((0.0, [0.0; 2]), |a, b| if b.0 > a.0 { b } else { a });
        Ok(Removal {
            field: self,
            rapid_cut_mm: worst.0,
            rapid_cut_at_mm: worst.1,
        })
    }

    /// How far each node lies above the surface below it, along that one's normal; `None` beside
    /// the surface and at its walls.
    #[must_use]
    pub fn deviations_mm(&self, surface: &Surface) -> Vec<Option<f64>> {
        let probe = self.pitch_mm / 50.0;
        let of = |node: usize| {
            let at = self.place_mm(node % self.columns, node / self.columns);
            let here = surface.height_mm(at)?;
            let slope = |axis: usize| {
                let beside = |sign: f64| {
                    let mut place = at;
                    place[axis] += sign * probe;
                    surface.height_mm(place)
                };
                let (low, high) = (beside(-1.0), beside(1.0));
                // At the outline there is one side only.
                match (low, high) {
                    (Some(low), Some(high)) => Some((high - low) / (2.0 * probe)),
                    (Some(low), None) => Some((here - low) / probe),
                    (None, Some(high)) => Some((high - here) / probe),
                    (None, None) => None,
                }
            };
            let (gx, gy) = (slope(0)?, slope(1)?);
            let nz = 1.0 / (1.0 + gx * gx + gy * gy).sqrt();
            (nz > crate::parallel::STEEP).then(|| (self.heights_mm[node] - here) * nz)
        };
        (0..self.heights_mm.len()).into_par_iter().map(of).collect()
    }
}

/// Some rows of the field.
struct Band<'a> {
    origin: [f64; 2],
    pitch: f64,
    columns: usize,
    heights: &'a mut [f64],
    worst: (f64, [f64; 2]),
}

impl Band<'_> {
    fn cut(&mut self, cutter: &Cutter, stroke: &Stroke) {
        let radius = cutter.radius_mm();
        let (a, b) = (stroke.from, stroke.to);
        let rows = self.heights.len() / self.columns.max(1);
        let range = |axis: usize, count: usize| {
            let low = a[axis].min(b[axis]) - radius - self.origin[axis];
            let high = a[axis].max(b[axis]) + radius - self.origin[axis];
            let from = (low / self.pitch).ceil().max(0.0) as usize;
            let to = (high / self.pitch).floor();
            let to = if to < 0.0 { 0 } else { to as usize + 1 };
            from..to.min(count)
        };
        let rows = range(1, rows);
        if rows.is_empty() {
            return;
        }
        let columns = range(0, self.columns);
        let way = Way::new(a, b);
        for row in rows {
            let y = self.origin[1] + row as f64 * self.pitch;
            for column in columns.clone() {
                let height = &mut self.heights[row * self.columns + column];
                // Nothing of the cutter is lower than its tip.
                if *height <= way.lowest_mm {
                    continue;
                }
                let x = self.origin[0] + column as f64 * self.pitch;
                let Some((left, _)) = way.leaves(cutter, [x, y], *height) else {
                    continue;
                };
                let taken = *height - left;
                *height = left;
                if stroke.is_rapid && taken > RAPID_MM && taken > self.worst.0 {
                    self.worst = (taken, [x, y]);
                }
            }
        }
    }
}
