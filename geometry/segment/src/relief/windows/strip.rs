//! Planes over all windows of a strip of columns, eight rows side by side.
//!
//! Windows are summed up along rows first, then along columns, which costs by their side, not by
//! their area. Each sum takes its terms in the same order whatever the lanes, and however the
//! columns are shared out.

use core::ops::Range;

use pulp::{Simd, WithSimd};

use super::WindowPlane;
use super::lanes::{LANES, Lanes};
use crate::grid::Grid;

/// Sums over lines of nodes along their columns: count, v, v v, z, v z, z z.
type Lines = [Lanes; 6];

/// The columns whose windows are wanted, and where their planes go.
pub(super) struct Strip<'a> {
    pub(super) grid: &'a Grid<'a>,
    /// Half the side of the windows.
    pub(super) reach: usize,
    /// What z is counted from.
    pub(super) reference_mm: f64,
    pub(super) columns: Range<usize>,
    pub(super) planes: &'a mut [WindowPlane],
}

impl WithSimd for Strip<'_> {
    type Output = ();

    /// Written without a word of lanes: the compiler finds those of the processor that it is
    /// inlined for.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            grid,
            reach,
            reference_mm,
            columns,
            planes,
        } = self;
        let rows = grid.rows;
        let tiles = rows.div_ceil(LANES);
        let side = 2 * reach + 1;
        let least = ((side * side) / 2) as f64;
        // The lines of so many columns as a window is wide.
        let mut ring = vec![Lines::default(); side * tiles];
        let mut column_mm = Padded::new(rows, reach);
        let mut next = columns.start.saturating_sub(reach);
        for (column, planes) in columns.zip(planes.chunks_exact_mut(rows)) {
            let from = column.saturating_sub(reach);
            let to = (column + reach + 1).min(grid.columns);
            while next < to {
                let z_mm = &grid.z_mm[next * rows..][..rows];
                column_mm.take(z_mm, reference_mm);
                column_mm.sum_up(&mut ring[next % side * tiles..][..tiles]);
                next += 1;
            }
            let z_mm = &grid.z_mm[column * rows..][..rows];
            let out = planes.chunks_mut(LANES).zip(z_mm.chunks(LANES));
            for (tile, (planes, z_mm)) in out.enumerate() {
                let mut sums = WindowSums::default();
                for c in from..to {
                    sums.add(&ring[c % side * tiles + tile], c as f64 - column as f64);
                }
                sums.tell(least, z_mm, planes);
            }
        }
    }
}

/// A column's z with masked nodes beyond both its ends, so that each line of it is whole.
struct Padded {
    /// 0 where masked.
    z_mm: Vec<f64>,
    /// 1 where there is a value, else 0.
    count: Vec<f64>,
    reach: usize,
}

impl Padded {
    fn new(rows: usize, reach: usize) -> Self {
        let len = rows.next_multiple_of(LANES) + 2 * reach;
        Self {
            z_mm: vec![0.0; len],
            count: vec![0.0; len],
            reach,
        }
    }

    #[inline(always)]
    fn take(&mut self, z_mm: &[f64], reference_mm: f64) {
        let own = self.z_mm[self.reach..].iter_mut();
        for ((own, count), z_mm) in own.zip(&mut self.count[self.reach..]).zip(z_mm) {
            let z_mm = z_mm - reference_mm;
            (*own, *count) = if z_mm.is_nan() {
                (0.0, 0.0)
            } else {
                (z_mm, 1.0)
            };
        }
    }

    /// Sums of the lines that reach so far to either side of each row.
    #[inline(always)]
    fn sum_up(&self, lines: &mut [Lines]) {
        for (tile, lines) in lines.iter_mut().enumerate() {
            let mut sums = Lines::default();
            let heights = self.z_mm[tile * LANES..].windows(LANES);
            let counts = self.count[tile * LANES..].windows(LANES);
            let along = heights.zip(counts).take(2 * self.reach + 1);
            for (k, (heights, counts)) in along.enumerate() {
                let v = Lanes::all(k as f64 - self.reach as f64);
                let (z, count) = (Lanes::of(heights), Lanes::of(counts));
                let terms = [count, v * count, v * v * count, z, v * z, z * z];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += term;
                }
            }
            *lines = sums;
        }
    }
}

/// Sums over windows: those over their lines, and those that the place of a line has a part in.
#[derive(Default)]
struct WindowSums {
    lines: Lines,
    u: Lanes,
    uu: Lanes,
    uv: Lanes,
    uz: Lanes,
}

impl WindowSums {
    /// Adds the lines of the column at u.
    #[inline(always)]
    fn add(&mut self, lines: &Lines, u: f64) {
        let u = Lanes::all(u);
        let [n, v, _, z, ..] = *lines;
        for (sum, line) in self.lines.iter_mut().zip(lines) {
            *sum += *line;
        }
        self.u += u * n;
        self.uu += u * u * n;
        self.uv += u * v;
        self.uz += u * z;
    }

    /// The planes of windows of at least so many nodes, at rows that have a value.
    #[inline(always)]
    fn tell(&self, least: f64, z_mm: &[f64], planes: &mut [WindowPlane]) {
        let [n, v, vv, z, vz, zz] = self.lines;
        let Self { u, uu, uv, uz, .. } = *self;
        let (uu, uv, vv) = (uu - u * u / n, uv - u * v / n, vv - v * v / n);
        let (uz, vz, zz) = (uz - u * z / n, vz - v * z / n, zz - z * z / n);
        let determinant = uu * vv - uv * uv;
        let a = (uz * vv - vz * uv) / determinant;
        let b = (vz * uu - uz * uv) / determinant;
        let left = (zz - a * uz - b * vz).at_least_0();
        let variance = left / (n - Lanes::all(3.0));
        for (lane, (plane, z_mm)) in planes.iter_mut().zip(z_mm).enumerate() {
            let n = n.0[lane];
            let is_plane = n >= least && n >= 4.0 && determinant.0[lane] >= 1e-6;
            *plane = if is_plane && !z_mm.is_nan() {
                WindowPlane {
                    rise_mm: [a.0[lane] as f32, b.0[lane] as f32],
                    variance_mm2: variance.0[lane] as f32,
                }
            } else {
                WindowPlane::NONE
            };
        }
    }
}
