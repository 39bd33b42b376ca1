//! The noise of a range image, measured in the image itself.

use crate::grid::Grid;
use range_image::RangeImage;

/// Noise below this share of the pitch is of no account to any decision.
const LEAST_SHARE_OF_PITCH: f64 = 1e-3;
/// Nodes from which on noise is taken to be unlike.
const FAR: usize = 5;
/// Standard deviation that a node is granted, in those of its samples: what is left of their
/// noise, and what its window rounds off at creases.
const TOLD: f64 = 0.75;
/// Quantile of the nodes that tells. Over half of them may lie on terraces of coarse depths,
/// whose samples agree to the last digit.
const TOLD_QUANTILE: f64 = 0.8;
/// What the regridder tells counts as alike over so many nodes at most.
const MOST_ALIKE: f64 = 3.5;
/// Noise is never taken to be alike over more nodes than this.
const GREATEST_AREA: f64 = 25.0;

/// How z strays about the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    /// Standard deviation, millimetres.
    pub(crate) deviation_mm: f64,
    /// So many nodes tell as much as one would whose noise is its own: the sum of the
    /// noise's autocorrelation over the grid.
    pub(crate) area_nodes: f64,
}

/// Slopes raise the noise of z: what strays across the line of sight adds its share.
const ACROSS: f64 = 0.5;

impl Noise {
    /// Standard deviation of z where the surface rises by so many millimetres per pitch.
    pub(crate) fn on_slope_mm(&self, rise_mm: [f64; 2], pitch_mm: f64) -> f64 {
        let square = (rise_mm[0] * rise_mm[0] + rise_mm[1] * rise_mm[1]) / (pitch_mm * pitch_mm);
        self.deviation_mm * libm::sqrt(1.0 + ACROSS * square)
    }
}

/// Measures the noise.
///
/// From third differences, which no quadratic surface disturbs, along columns and rows. The
/// median keeps creases and steps out. Regridded noise is alike in neighbouring nodes, which
/// hides it from differences of neighbours, so those over every second node are taken as
/// well, and the greater figure counts. How much neighbours hide tells how far noise is alike.
///
/// Wide windows make nodes alike farther than differences of any use reach, and round creases
/// by as much as their samples stray. So what the regridder says of each node's samples is
/// asked, too; the greatest figure counts.
pub(crate) fn noise(image: &RangeImage, grid: &Grid<'_>) -> Noise {
    let ((near, middle), far) = rayon::join(
        || rayon::join(|| third_differences(grid, 1), || third_differences(grid, 2)),
        || third_differences(grid, FAR),
    );
    let far = far.min(2.0 * near.max(middle));
    let told = told_mm(image);
    let deviation_mm = near
        .max(middle)
        .max(told)
        .max(LEAST_SHARE_OF_PITCH * grid.pitch_mm);
    Noise {
        deviation_mm,
        area_nodes: area(near, middle.max(far).max(near)).min(MOST_ALIKE),
    }
}

/// The deviation of z that the nodes' samples tell of, millimetres; 0 where nothing is known of
/// them.
fn told_mm(image: &RangeImage) -> f64 {
    let mut scales_mm: Vec<f32> = image
        .qualities()
        .filter(|quality| quality.inliers > 0)
        .map(|quality| quality.scale_mm)
        .collect();
    let place = (TOLD_QUANTILE * scales_mm.len() as f64) as usize;
    if place >= scales_mm.len() {
        return 0.0;
    }
    let (_, scale_mm, _) = scales_mm.select_nth_unstable_by(place, f32::total_cmp);
    TOLD * f64::from(*scale_mm)
}

/// The autocorrelation's sum, taken for a Gaussian, from the deviation seen by third differences
/// of neighbours and the full one.
fn area(near_mm: f64, full_mm: f64) -> f64 {
    if near_mm <= 0.0 || full_mm <= near_mm {
        return 1.0;
    }
    let seen = (near_mm / full_mm) * (near_mm / full_mm);
    // Share of the variance that is seen at correlation r between neighbours, r^4 and r^9
    // between those two and three apart.
    let share = |r: f64| {
        let (r4, r9) = (r * r * r * r, r * r * r * r * r * r * r * r * r);
        1.0 - (15.0 * r - 6.0 * r4 + r9) / 10.0
    };
    let (mut low, mut high) = (0.0, 0.99);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if share(middle) > seen {
            low = middle;
        } else {
            high = middle;
        }
    }
    let r = 0.5 * (low + high);
    // Sum of r^(k k) over all whole k, for columns and for rows.
    let line: f64 = 1.0 + 2.0 * (1..8).map(|k| libm::pow(r, f64::from(k * k))).sum::<f64>();
    (line * line).min(GREATEST_AREA)
}

fn third_differences(grid: &Grid<'_>, lag: usize) -> f64 {
    let mut sizes = Vec::with_capacity(2 * grid.nodes());
    for column in 0..grid.columns {
        for row in 0..grid.rows {
            let node = column * grid.rows + row;
            let mut take = |stride: usize| {
                let z = |k: usize| grid.z_mm[node + k * lag * stride];
                let difference = z(3) - z(0) + 3.0 * (z(1) - z(2));
                if !difference.is_nan() {
                    sizes.push(difference.abs());
                }
            };
            if row + 3 * lag < grid.rows {
                take(1);
            }
            if column + 3 * lag < grid.columns {
                take(grid.rows);
            }
        }
    }
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    // 1.4826: median of sizes to standard deviation; sqrt(1 + 9 + 9 + 1) of the weights.
    1.4826 * *median / libm::sqrt(20.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::{Lattice, NodeQuality};

    /// A plane without any noise whose nodes, all or the first half of the columns, have samples
    /// that stray.
    fn deviation_mm(straying_columns: usize) -> f64 {
        let (side, lattice) = (20, Lattice { pitch_mm: 0.5 });
        let mut image = RangeImage::masked(lattice, 0, 0, side, side);
        for column in 0..side {
            for row in 0..side {
                image.set_z_mm(column, row, Some(0.1 * column as f64));
                let strays = column < straying_columns;
                let quality = NodeQuality {
                    inliers: 40,
                    samples: 49,
                    scale_mm: if strays { 0.1 } else { 0.0 },
                    nearest_mm: 0.1,
                };
                image.set_quality(column, row, quality);
            }
        }
        noise(&image, &Grid::new(&image)).deviation_mm
    }

    #[test]
    fn what_samples_stray_is_granted_to_nodes_that_do_not() {
        assert!((deviation_mm(20) - 0.075).abs() < 1e-6);
        assert!((deviation_mm(8) - 0.075).abs() < 1e-6, "most are terraces");
        assert!(deviation_mm(0) < 1e-3);
    }
}
