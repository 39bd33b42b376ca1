//! A grid to be fitted within a tolerance, and how well knots do at it.

use range_image::Monitor;
use rayon::prelude::*;

use crate::axis::Axis;
use crate::fit;
use crate::grid::HeightGrid;
use crate::infill;
use crate::knots::Knots;

/// How far beyond the data's range holes may be filled, as a share of it.
const SWING: f64 = 0.1;

/// The deviations of the nodes with a value.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Score {
    pub(crate) max: f64,
    /// Sum of (deviation / tolerance)^12: near the maximum, but every large deviation counts.
    pub(crate) soft: f64,
    /// Sum of (deviation / tolerance)^4, which tells sooner where knots are wanted.
    pub(crate) gentle: f64,
    pub(crate) sum_of_squares: f64,
    pub(crate) within: usize,
}

/// A fitted surface.
pub(crate) struct Fit {
    /// y fastest.
    pub(crate) coefficients: Vec<f64>,
    pub(crate) score: Score,
}

/// The data with their holes filled.
pub(crate) struct Problem<'a> {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) z: Vec<f64>,
    pub(crate) is_data: Vec<bool>,
    pub(crate) is_full: bool,
    /// Greatest deviation wanted, millimetres.
    pub(crate) tolerance: f64,
    /// Whether small systems of grids with holes are eliminated: far faster where little of the grid has
    /// data. Over the whole of a scan more control points come of it, or fewer.
    may_eliminate: bool,
    /// Who may end the work. Fits end early then, and are worth nothing.
    monitor: &'a dyn Monitor,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(grid: &HeightGrid, tolerance: f64, monitor: &'a dyn Monitor) -> Self {
        let raw = grid.raw_z_mm();
        Self {
            columns: grid.columns(),
            rows: grid.rows(),
            z: infill::fill(raw, grid.columns(), grid.rows()),
            is_data: raw.iter().map(|z| !z.is_nan()).collect(),
            is_full: grid.is_full(),
            tolerance,
            may_eliminate: false,
            monitor,
        }
    }

    /// For a part of a grid that has few data within its rectangle.
    pub(crate) fn of_part(grid: &HeightGrid, tolerance: f64, monitor: &'a dyn Monitor) -> Self {
        Self {
            may_eliminate: true,
            ..Self::new(grid, tolerance, monitor)
        }
    }

    /// Number of nodes, and so roughly the work of a fit.
    pub(crate) fn nodes(&self) -> usize {
        self.z.len()
    }

    /// Least squares with these knots; `None` where the nodes do not hold them.
    pub(crate) fn fit(&self, knots: &Knots) -> Option<Fit> {
        let (u, v) = (Axis::new(&knots.u)?, Axis::new(&knots.v)?);
        Some(self.fit_axes(&u, &v))
    }

    pub(crate) fn fit_axes(&self, u: &Axis, v: &Axis) -> Fit {
        let mut coefficients = fit::full(u, v, &self.z);
        if !self.is_full {
            coefficients = fit::masked(
                u,
                v,
                (&self.z, &self.is_data),
                coefficients,
                self.may_eliminate,
                self.monitor,
            );
        }
        Fit {
            score: self.score(u, v, &coefficients),
            coefficients,
        }
    }

    /// How far the nodes with a value lie off.
    pub(crate) fn score(&self, u: &Axis, v: &Axis, coefficients: &[f64]) -> Score {
        let rows = self.rows;
        let of_column = |i: usize| {
            let mut score = Score::default();
            let line = fit::section(&u.at[i], coefficients, v.count);
            let here = i * rows..(i + 1) * rows;
            let data = self.z[here.clone()].iter().zip(&self.is_data[here]);
            for ((z, &is_data), node) in data.zip(&v.at) {
                if is_data {
                    let off = (z - fit::at(&line, node)).abs();
                    score.max = score.max.max(off);
                    score.sum_of_squares += off * off;
                    let square = (off / self.tolerance) * (off / self.tolerance);
                    let fourth = square * square;
                    score.gentle += fourth;
                    score.soft += fourth * fourth * fourth;
                    score.within += usize::from(off <= self.tolerance);
                }
            }
            score
        };
        let columns: Vec<Score> = (0..self.columns)
            .into_par_iter()
            .with_min_len(16)
            .map(of_column)
            .collect();
        // One after the other, so that the sums do not depend on the threads.
        columns
            .into_iter()
            .fold(Score::default(), |sum, column| Score {
                max: sum.max.max(column.max),
                soft: sum.soft + column.soft,
                gentle: sum.gentle + column.gentle,
                sum_of_squares: sum.sum_of_squares + column.sum_of_squares,
                within: sum.within + column.within,
            })
    }

    /// Greatest deviation in each column of the nodes from what knots along x alone come to.
    pub(crate) fn columns_off(&self, u: &Axis) -> Vec<f64> {
        let coefficients = fit::along_u(u, &self.z, self.rows);
        (0..self.columns)
            .into_par_iter()
            .with_min_len(16)
            .map(|i| {
                let line = fit::section(&u.at[i], &coefficients, self.rows);
                let here = i * self.rows..(i + 1) * self.rows;
                let data = self.z[here.clone()].iter().zip(&self.is_data[here]);
                let off = data
                    .zip(&line)
                    .filter(|((_, is_data), _)| **is_data)
                    .map(|((z, _), f)| (z - f).abs());
                off.fold(0.0, f64::max)
            })
            .collect()
    }

    /// The same of each row and knots along y.
    pub(crate) fn rows_off(&self, v: &Axis) -> Vec<f64> {
        let coefficients = fit::along_v(v, &self.z);
        let mut worst = vec![0.0_f64; self.rows];
        for i in 0..self.columns {
            let line = &coefficients[i * v.count..(i + 1) * v.count];
            for (j, node) in v.at.iter().enumerate() {
                let n = i * self.rows + j;
                if self.is_data[n] {
                    worst[j] = worst[j].max((self.z[n] - fit::at(line, node)).abs());
                }
            }
        }
        worst
    }

    /// Lets masked nodes lie where a fitted surface passes, so that they do not bend the next, but
    /// hardly beyond the data's range: a cubic that nothing holds swings far.
    pub(crate) fn refill(&mut self, knots: &Knots) {
        if self.is_full {
            return;
        }
        let (Some(u), Some(v)) = (Axis::new(&knots.u), Axis::new(&knots.v)) else {
            return;
        };
        let mut extent = (f64::INFINITY, f64::NEG_INFINITY);
        for (z, _) in self.z.iter().zip(&self.is_data).filter(|(_, is)| **is) {
            extent = (extent.0.min(*z), extent.1.max(*z));
        }
        let beyond = SWING * (extent.1 - extent.0);
        let fitted = fit::values(&u, &v, &self.fit_axes(&u, &v).coefficients);
        for ((z, &is_data), fitted) in self.z.iter_mut().zip(&self.is_data).zip(fitted) {
            if !is_data {
                *z = fitted.clamp(extent.0 - beyond, extent.1 + beyond);
            }
        }
    }
}
