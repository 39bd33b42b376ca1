//! The surfaces of regions, carried on into gaps.

use fill::{FitSettings, Implicit, Sample};
use glam::DVec3;

use crate::find::Place;
use crate::sight::Sight;

/// Width of what is taken around a gap, of its size, and in nodes at least and at most.
const WIDTH: f64 = 0.5;
const LEAST_RINGS: f64 = 4.0;
const MOST_RINGS: f64 = 24.0;
/// Nodes to either side by which a node's normal is found.
const AROUND: i64 = 2;
/// Points of the dense part of the solver: gaps are many, and what is around them is smooth.
const MOST_CENTRES: usize = 250;

/// The surface of a region around a gap.
pub(crate) struct Surface {
    implicit: Implicit,
    reach_mm: f64,
}

impl Surface {
    /// That of a region; `None` where there is too little of it.
    pub(crate) fn new(
        sight: &Sight<'_>,
        labels: &[u16],
        place: &Place,
        region: u16,
    ) -> Option<Self> {
        let size = place.size();
        let rings = (WIDTH * size).clamp(LEAST_RINGS, MOST_RINGS);
        let own = place.beside.get(&region)?;
        let around = sight
            .grid()
            .rings(own.iter().copied(), rings as usize, |node| {
                labels[node] == region
            });
        let pitch_mm = sight.image.pitch_mm();
        let samples: Vec<Sample> = around
            .iter()
            .filter_map(|(&node, &steps)| {
                Some(Sample {
                    place_mm: sight.point(node)?,
                    normal: normal(sight, labels, node),
                    reach_mm: steps as f64 * pitch_mm,
                })
            })
            .collect();
        let settings = FitSettings {
            most_centres: MOST_CENTRES,
            ..FitSettings::default()
        };
        let size_mm = (size * pitch_mm).max(2.0 * pitch_mm);
        let implicit = Implicit::fit(&samples, size_mm, &settings).ok()?;
        Some(Self {
            implicit,
            reach_mm: size_mm * REACH,
        })
    }

    /// Its height at x and y of a place, sought from the place's z.
    pub(crate) fn height_mm(&self, from_mm: DVec3) -> Option<f64> {
        let on = self.implicit.along(from_mm, DVec3::Z, self.reach_mm)?;
        Some(on.z)
    }
}

/// How far above or below the nodes beside it a surface may run in a gap, of its size.
const REACH: f64 = 4.0;

/// Unit normal, towards the scanner, of the plane through the nodes of the same region around a node;
/// zero where they determine none.
fn normal(sight: &Sight<'_>, labels: &[u16], node: usize) -> DVec3 {
    let grid = sight.grid();
    let (column, row) = grid.place(node);
    let Some(centre) = sight.point(node) else {
        return DVec3::ZERO;
    };
    let (mut n, mut sum, mut squares, mut rise) = (0.0, DVec3::ZERO, [0.0; 3], [0.0; 2]);
    let mut take = |c: i64, r: i64| {
        let other = grid.node(column as i64 + c, row as i64 + r)?;
        let arm = (labels[other] == labels[node]).then(|| sight.point(other))?? - centre;
        n += 1.0;
        sum += arm;
        squares = [
            squares[0] + arm.x * arm.x,
            squares[1] + arm.x * arm.y,
            squares[2] + arm.y * arm.y,
        ];
        rise = [rise[0] + arm.x * arm.z, rise[1] + arm.y * arm.z];
        Some(())
    };
    for c in -AROUND..=AROUND {
        for r in -AROUND..=AROUND {
            take(c, r);
        }
    }
    let xx = squares[0] - sum.x * sum.x / n;
    let xy = squares[1] - sum.x * sum.y / n;
    let yy = squares[2] - sum.y * sum.y / n;
    let xz = rise[0] - sum.x * sum.z / n;
    let yz = rise[1] - sum.y * sum.z / n;
    let determinant = xx * yy - xy * xy;
    let pitch_mm = sight.image.pitch_mm();
    let is_spread = determinant > LEAST_SPREAD * pitch_mm.powi(4);
    if !is_spread {
        return DVec3::ZERO;
    }
    let slope = [
        (xz * yy - yz * xy) / determinant,
        (yz * xx - xz * xy) / determinant,
    ];
    DVec3::new(-slope[0], -slope[1], 1.0).normalize()
}

/// Nodes in a line, or two, determine no plane: their spread in pitches to the fourth.
const LEAST_SPREAD: f64 = 1.0;
