//! The noise of a range image, measured in the image itself.

use crate::grid::Grid;

/// Noise below this share of the pitch is of no account to any decision.
const LEAST_SHARE_OF_PITCH: f64 = 1e-3;

/// Standard deviation of z about the surface, millimetres.
///
/// From third differences, which no quadratic surface disturbs, along columns and rows. The
/// median keeps creases and steps out. Regridded noise is alike in neighbouring nodes, which
/// hides it from differences of neighbours, so those over every second node are taken as
/// well, and the greater figure counts.
pub(crate) fn noise_mm(grid: &Grid<'_>) -> f64 {
    let near = third_differences(grid, 1);
    let far = third_differences(grid, 2);
    near.max(far).max(LEAST_SHARE_OF_PITCH * grid.pitch_mm)
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
