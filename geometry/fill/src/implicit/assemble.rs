//! Conditions and the matrix of what each radial function contributes to them.

use glam::DVec3;
use rayon::prelude::*;

use super::dense::Square;
use super::kernel::{Kernel, polynomial, terms};

/// What is asked of the function at a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Condition {
    pub(super) at: DVec3,
    /// Direction in which the slope is asked for; zero where the value is.
    pub(super) along: DVec3,
    /// What it is to be.
    pub(super) wanted: f64,
    /// Variance over that of a point's value.
    pub(super) variance: f64,
}

impl Condition {
    pub(super) fn is_slope(&self) -> bool {
        self.along != DVec3::ZERO
    }

    fn scale(&self) -> f64 {
        1.0 / self.variance.sqrt()
    }
}

/// Softness of slopes: that they are one is a choice of scale, and not known.
const SLOPE_SOFTNESS: f64 = 0.3;

fn entry(kernel: Kernel, i: &Condition, j: &Condition) -> f64 {
    let arm = i.at - j.at;
    let own = kernel.at(arm.length_squared());
    match (i.is_slope(), j.is_slope()) {
        (false, false) => own.value,
        (false, true) => -own.slope * j.along.dot(arm),
        (true, false) => own.slope * i.along.dot(arm),
        (true, true) => {
            -(own.slope * i.along.dot(j.along) + own.bend * i.along.dot(arm) * j.along.dot(arm))
        }
    }
}

/// The matrix of conditions, each by its own standard deviation, with the softness of slopes.
pub(super) fn matrix(kernel: Kernel, conditions: &[Condition]) -> Square {
    let size = conditions.len();
    let mut matrix = Square::zero(size);
    let fill = |(k, row): (usize, &mut [f64])| {
        let i = &conditions[k];
        for (value, j) in row.iter_mut().zip(conditions) {
            *value = entry(kernel, i, j) * i.scale() * j.scale();
        }
        if i.is_slope() {
            row[k] += SLOPE_SOFTNESS * i.scale() * i.scale();
        }
    };
    let rows = matrix.values.par_chunks_mut(size.max(1));
    rows.with_min_len(32).enumerate().for_each(fill);
    matrix
}

/// The polynomial's terms under the conditions, by columns, each row by its standard deviation.
pub(super) fn columns(kernel: Kernel, conditions: &[Condition]) -> Vec<Vec<f64>> {
    let count = terms(kernel.degree());
    let mut columns = vec![Vec::with_capacity(conditions.len()); count];
    let mut row = vec![0.0; count];
    for own in conditions {
        polynomial(own.at, own.is_slope().then_some(own.along), &mut row);
        for (column, value) in columns.iter_mut().zip(&row) {
            column.push(value * own.scale());
        }
    }
    columns
}

/// What is wanted, by the standard deviations.
pub(super) fn wanted(conditions: &[Condition]) -> Vec<f64> {
    conditions
        .iter()
        .map(|own| own.wanted * own.scale())
        .collect()
}

/// Weights as they apply to the conditions themselves.
pub(super) fn unscaled(conditions: &[Condition], weights: &mut [f64]) {
    for (weight, own) in weights.iter_mut().zip(conditions) {
        *weight *= own.scale();
    }
}
