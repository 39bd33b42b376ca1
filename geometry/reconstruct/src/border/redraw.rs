//! A path drawn again by fewer numbers.

use nalgebra::{DMatrix, DVector};
use nurbs::PiecewiseCubic;

use super::layout::Splines;
use super::likelihood::bind;
use super::path::hermite;

/// Places of the old path that the new one comes near to lie so far apart, pitches.
const STEP: f64 = 0.25;
/// How much more than a place the ends of the path count.
const HELD: f64 = 1e6;

/// The spline nearest to a path, from the same start to the same end. `path` gives the place at
/// a length from its start.
pub(crate) fn redraw(
    path: impl Fn(f64) -> [f64; 2],
    splines: &Splines,
) -> Option<PiecewiseCubic<2>> {
    let length = splines.knots.domain().1;
    let count = splines.count();
    let mut matrix = DMatrix::<f64>::zeros(count, count);
    let mut right = [DVector::<f64>::zeros(count), DVector::<f64>::zeros(count)];
    let steps = (length / STEP).ceil() as usize;
    for k in 0..=steps {
        let along = length * k as f64 / steps as f64;
        let weight = if k == 0 || k == steps { HELD } else { 1.0 };
        let place = path(along);
        let basis = splines.at(along, 0);
        for (row, value) in basis.values.iter().take(4).enumerate() {
            for d in 0..2 {
                right[d][basis.first + row] += weight * value * place[d];
            }
            for (column, other) in basis.values.iter().take(4).enumerate() {
                matrix[(basis.first + row, basis.first + column)] += weight * value * other;
            }
        }
    }
    bind(&mut matrix, &splines.conditions());
    let solver = matrix.cholesky()?;
    let [x, y] = right.map(|right| solver.solve(&right));
    let value = |along: f64, order: usize| {
        let basis = splines.at(along, order);
        let mut sum = [0.0; 2];
        for (k, value) in basis.values.iter().take(4).enumerate() {
            sum[0] += value * x[basis.first + k];
            sum[1] += value * y[basis.first + k];
        }
        sum
    };
    let mut places: Vec<[f64; 2]> = splines.breaks.iter().map(|b| value(*b, 0)).collect();
    let mut tangents: Vec<[f64; 2]> = splines.breaks.iter().map(|b| value(*b, 1)).collect();
    let end = places.len() - 1;
    (places[0], places[end]) = (path(0.0), path(length));
    if splines.closed {
        tangents[end] = tangents[0];
    }
    let pieces = (0..end)
        .map(|k| {
            let width = splines.breaks[k + 1] - splines.breaks[k];
            if splines.is_line[k] {
                return [0, 1].map(|d| {
                    let slope = (places[k + 1][d] - places[k][d]) / width;
                    [places[k][d], slope, 0.0, 0.0]
                });
            }
            hermite(
                places[k],
                tangents[k],
                places[k + 1],
                tangents[k + 1],
                width,
            )
        })
        .collect();
    PiecewiseCubic::new(splines.breaks.clone(), pieces).ok()
}
