//! The registered nominal as the camera sees it: along z of the scan's frame, on its lattice.

use glam::DVec3;
use range_image::{Cancelled, Monitor, RangeImage};
use rayon::prelude::*;

use crate::error::CompareError;
use crate::nominal::Nominal;
use crate::pose::Pose;

/// Most nodes looked at: as many as two scans of ten million samples.
const NODES_MAX: usize = 1 << 25;
/// Nodes up to this many samples' distances from a step or an end of the nominal are its edges:
/// spots of light on them are torn between two surfaces.
const EDGE_SPACINGS: f64 = 1.5;

/// The nominal on the lattice.
pub(crate) struct Seen {
    i_first: i64,
    j_first: i64,
    columns: usize,
    rows: usize,
    /// z in the scan's frame; NaN where nothing is seen.
    z_mm: Vec<f64>,
    /// Cosine between normal and line of sight.
    cosine: Vec<f64>,
    is_edge: Vec<bool>,
}

impl Seen {
    /// Looks at the nominal along every node of its box and the image's.
    pub(crate) fn new(
        nominal: &Nominal,
        pose: &Pose,
        image: &RangeImage,
        spacing_mm: f64,
        monitor: &dyn Monitor,
    ) -> Result<Self, CompareError> {
        let back = pose.inverse();
        let (low, high) = nominal.extent_mm();
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in 0..8 {
            let side = |axis: usize| {
                if corner >> axis & 1 == 0 {
                    low[axis]
                } else {
                    high[axis]
                }
            };
            let at = back.point(DVec3::new(side(0), side(1), side(2)));
            (least, most) = (least.min(at), most.max(at));
        }
        let lattice = image.lattice();
        let (i_image, j_image) = image.origin();
        let i_first = i_image.min(lattice.first_at_or_above(least.x));
        let j_first = j_image.min(lattice.first_at_or_above(least.y));
        let i_last = (i_image + image.columns() as i64 - 1).max(lattice.last_at_or_below(most.x));
        let j_last = (j_image + image.rows() as i64 - 1).max(lattice.last_at_or_below(most.y));
        let side = |first: i64, last: i64| usize::try_from(last - first + 1).unwrap_or(0);
        let (columns, rows) = (side(i_first, i_last), side(j_first, j_last));
        if columns.saturating_mul(rows) > NODES_MAX {
            return Err(CompareError::TooManyNodes {
                columns,
                rows,
                pitch_mm: lattice.pitch_mm,
            });
        }
        let above_mm = most.z + 1.0;
        let down = pose.direction(DVec3::NEG_Z);
        let met: Result<Vec<Vec<(f64, f64)>>, Cancelled> = (0..columns)
            .into_par_iter()
            .map(|column| {
                monitor.check()?;
                let x = lattice.line_mm(i_first + column as i64);
                let each = (0..rows).map(|row| {
                    let y = lattice.line_mm(j_first + row as i64);
                    let origin = pose.point(DVec3::new(x, y, above_mm));
                    match nominal.first_met(origin, down) {
                        Some(foot) => (back.point(foot.point_mm).z, -foot.normal.dot(down)),
                        None => (f64::NAN, 0.0),
                    }
                });
                Ok(each.collect())
            })
            .collect();
        let (z_mm, cosine) = met?.into_iter().flatten().unzip();
        let mut seen = Self {
            i_first,
            j_first,
            columns,
            rows,
            z_mm,
            cosine,
            is_edge: Vec::new(),
        };
        seen.mark_edges(lattice.pitch_mm, spacing_mm);
        Ok(seen)
    }

    /// Index of the node nearest to a place; `None` outside.
    pub(crate) fn index(&self, i: i64, j: i64) -> Option<usize> {
        let column = usize::try_from(i - self.i_first).ok()?;
        let row = usize::try_from(j - self.j_first).ok()?;
        (column < self.columns && row < self.rows).then(|| column * self.rows + row)
    }

    /// z and the cosine of the incidence at a node; `None` where nothing is seen.
    pub(crate) fn at(&self, index: usize) -> Option<(f64, f64)> {
        let z = *self.z_mm.get(index)?;
        (!z.is_nan()).then(|| (z, self.cosine.get(index).copied().unwrap_or(0.0)))
    }

    /// Whether a node lies at a step or an end of the nominal.
    pub(crate) fn is_edge(&self, index: usize) -> bool {
        self.is_edge.get(index).copied().unwrap_or(true)
    }

    /// Lattice indices of all nodes at which something is seen, and the areas they stand for in
    /// units of a node's square.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = (i64, i64, f64)> {
        let places = (0..self.columns).flat_map(|c| (0..self.rows).map(move |r| (c, r)));
        places
            .zip(&self.cosine)
            .filter(|(_, cosine)| **cosine > 0.0)
            .map(|((c, r), cosine)| {
                (
                    self.i_first + c as i64,
                    self.j_first + r as i64,
                    1.0 / cosine,
                )
            })
    }

    fn mark_edges(&mut self, pitch_mm: f64, spacing_mm: f64) {
        let reach = (EDGE_SPACINGS * spacing_mm / pitch_mm)
            .ceil()
            .clamp(1.0, 64.0) as usize;
        let slope = |cosine: f64| (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
        // Neighbours that no slope of theirs can join lie on both sides of a step.
        let is_joined = |a: usize, b: usize| match (self.at(a), self.at(b)) {
            (Some((za, ca)), Some((zb, cb))) => {
                (za - zb).abs() <= (slope(ca).max(slope(cb)) + 1.0) * pitch_mm
            }
            _ => false,
        };
        let mut beside = vec![false; self.z_mm.len()];
        for column in 0..self.columns {
            for row in 0..self.rows {
                let here = column * self.rows + row;
                let ends =
                    column == 0 || row == 0 || column + 1 == self.columns || row + 1 == self.rows;
                if let Some(mark) = beside.get_mut(here) {
                    *mark = ends
                        || !is_joined(here, here - 1)
                        || !is_joined(here, here + 1)
                        || !is_joined(here, here - self.rows)
                        || !is_joined(here, here + self.rows);
                }
            }
        }
        // A square grown around each, first along columns, then along rows. The node beside a
        // step is itself within the first pitch.
        let grow = reach - 1;
        let along = spread(&beside, self.rows, 1, self.rows, grow);
        self.is_edge = spread(&along, self.columns, self.rows, self.rows, grow);
    }
}

/// Marks what lies up to `reach` nodes from a mark along lines of `length` nodes, neighbours on a
/// line `stride` apart. `rows` is the length of a column.
fn spread(marks: &[bool], length: usize, stride: usize, rows: usize, reach: usize) -> Vec<bool> {
    let mut wide = vec![false; marks.len()];
    for (index, _) in marks.iter().enumerate().filter(|(_, mark)| **mark) {
        let place = if stride == 1 {
            index % rows
        } else {
            index / rows
        };
        let before = place.min(reach);
        let behind = (length - 1 - place).min(reach);
        for step in 0..=before + behind {
            if let Some(mark) = wide.get_mut(index - before * stride + step * stride) {
                *mark = true;
            }
        }
    }
    wide
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_spread_along_lines_and_not_over_their_ends() {
        // Two columns of four rows.
        let marks = [true, false, false, false, false, false, false, true];
        let along = spread(&marks, 4, 1, 4, 1);
        assert_eq!(along, [true, true, false, false, false, false, true, true]);
        let across = spread(&marks, 2, 4, 4, 5);
        assert_eq!(across, [true, false, false, true, true, false, false, true]);
    }
}
