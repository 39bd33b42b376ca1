//! The part of the grid that a piece is fitted over.

use crate::grid::HeightGrid;

/// Nodes around those of a piece over which its surface is carried on: trims stay within them.
pub(super) const MARGIN: usize = 4;

/// The nodes of a piece within their rectangle and a margin, which may reach beyond the grid.
pub(super) struct Block {
    pub(super) grid: HeightGrid,
    /// The first column and row of the whole grid in it, less the margin: node `(i, j)` of the
    /// block is `(i + first[0] - MARGIN, j + first[1] - MARGIN)`.
    pub(super) first: [usize; 2],
    /// Nodes along x and y without the margin.
    pub(super) extent: [usize; 2],
}

impl Block {
    /// `None` where no node is a member.
    pub(super) fn of(grid: &HeightGrid, member: impl Fn(usize) -> bool) -> Option<Self> {
        let (rows, z) = (grid.rows(), grid.raw_z_mm());
        let is_in = |n: usize| !z[n].is_nan() && member(n);
        let mut low = [usize::MAX; 2];
        let mut high = [0; 2];
        for n in (0..z.len()).filter(|n| is_in(*n)) {
            let place = [n / rows, n % rows];
            for d in 0..2 {
                low[d] = low[d].min(place[d]);
                high[d] = high[d].max(place[d]);
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let extent = [0, 1].map(|d| high[d] - low[d] + 1);
        let sides = extent.map(|nodes| nodes + 2 * MARGIN);
        let mut own = vec![f64::NAN; sides[0] * sides[1]];
        for i in 0..extent[0] {
            for j in 0..extent[1] {
                let n = (low[0] + i) * rows + low[1] + j;
                if is_in(n) {
                    own[(i + MARGIN) * sides[1] + j + MARGIN] = z[n];
                }
            }
        }
        let pitch_mm = grid.pitch_mm();
        let first_mm =
            [grid.x_mm(low[0]), grid.y_mm(low[1])].map(|mm| mm - MARGIN as f64 * pitch_mm);
        let grid = HeightGrid::new(pitch_mm, first_mm, sides[0], sides[1], own).ok()?;
        Some(Self {
            grid,
            first: low,
            extent,
        })
    }
}
