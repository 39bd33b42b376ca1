//! What the nearest sample tells, to who knows all else.

use std::ops::RangeInclusive;

use range_image::{Column, Lattice};

use crate::figures::{Figures, NEAR_MM};
use crate::scene::{COLUMNS, NOISE_MM, Outliers, PITCH_MM, STEP_MM, Scene};
use crate::{Line, extent_mm};

/// Samples within so many standard deviations of the truth are none of the outliers.
const CLEAN: f64 = 4.0;
/// Columns on either side among which the nearest sample is sought.
const REACH: i64 = 6;

/// Nodes near the step, each put on the plane of the nearest sample that is no outlier. Both
/// planes are known to it, and so are the outliers; that the step is straight is not.
pub(crate) fn line(seeds: RangeInclusive<u64>, outliers: Outliers, share: f64) -> Line {
    let mut figures = Figures::default();
    for seed in seeds {
        let scene = Scene {
            seed,
            outliers,
            share,
        };
        add(&scene, &mut figures);
    }
    Line {
        name: "nearest true sample".to_owned(),
        outliers,
        share,
        figures,
        nodes_per_s: f64::NAN,
    }
}

fn add(scene: &Scene, figures: &mut Figures) {
    let truth = scene.truth();
    let columns = scene.columns();
    let lattice = Lattice { pitch_mm: PITCH_MM };
    let (width_mm, height_mm) = extent_mm();
    for i in 0..=lattice.last_at_or_below(width_mm) {
        let first = (i - REACH).clamp(0, i64::from(COLUMNS)) as usize;
        let last = (i + REACH + 1).clamp(0, i64::from(COLUMNS)) as usize;
        for j in 0..=lattice.last_at_or_below(height_mm) {
            let node = (lattice.line_mm(i), lattice.line_mm(j));
            if truth.distance_to_step_mm(node.0, node.1).abs() >= NEAR_MM {
                continue;
            }
            let clean = |x_mm: f64, y_mm: f64, z_mm: f64| {
                (z_mm - truth.z_mm(x_mm, y_mm)).abs() <= CLEAN * NOISE_MM
            };
            match nearest(&columns[first..last], node, clean) {
                Some((x_mm, y_mm)) => {
                    let upper = truth.distance_to_step_mm(x_mm, y_mm) > 0.0;
                    let step_mm = if upper { STEP_MM } else { 0.0 };
                    figures.node(truth.lower_mm(node.0, node.1) + step_mm, &truth, node);
                }
                None => figures.holes += 1,
            }
        }
    }
}

/// Where the nearest clean sample lies.
fn nearest(
    columns: &[Column],
    node: (f64, f64),
    clean: impl Fn(f64, f64, f64) -> bool,
) -> Option<(f64, f64)> {
    let mut best: Option<(f64, (f64, f64))> = None;
    for column in columns {
        let x_mm = column.x_mm();
        for s in column.samples() {
            let (dx, dy) = (x_mm - node.0, s.y_mm - node.1);
            let distance2 = dx * dx + dy * dy;
            if best.is_none_or(|b| distance2 < b.0) && clean(x_mm, s.y_mm, s.z_mm) {
                best = Some((distance2, (x_mm, s.y_mm)));
            }
        }
    }
    best.map(|b| b.1)
}
