//! Curves through sections: least squares, led towards the least greatest deviation.

use nurbs::{BSplineCurve, BandedMatrix};

use crate::basis::{Basis, DEGREE};
use crate::space::{distance, dot, greatest, is_nearer, minus};
use crate::stack::Course;

/// Share of the second differences of control points in what is minimised: it only decides where no
/// data do.
pub(crate) const STIFFNESS: f64 = 1e-9;

/// Newton steps that lead a parameter to the foot of its data point.
const STEPS: usize = 3;

/// What a weight keeps of itself at a data point that is on the curve.
const LEAST_WEIGHT: f64 = 1e-3;

/// After so many rounds a fit that is off by this many tolerances is given up.
const PATIENCE: usize = 3;
const HOPELESS: f64 = 1.7;

/// Whether rounds are at their end: the tolerance is held, or will not be.
pub(crate) fn is_done(round: usize, most_mm: f64, tolerance_mm: f64) -> bool {
    let is_hopeless = round + 1 >= PATIENCE && tolerance_mm > 0.0;
    most_mm <= tolerance_mm || (is_hopeless && most_mm > HOPELESS * tolerance_mm)
}

/// The curve of a section, and where its data points have their feet on it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ring {
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) at: Vec<f64>,
    pub(crate) off_mm: Vec<f64>,
    pub(crate) most_mm: f64,
}

/// A section's curve over a basis: in each round the least squares with the weights and parameters
/// of the one before; parameters are led to the feet of the data points, and weights grow with their
/// distances (Lawson 1961), so that the greatest of these becomes as small as it can be. The best
/// round counts, and the first that holds the tolerance is the last. `None` where breaks do not
/// ascend.
pub(crate) fn ring(
    course: &Course,
    basis: &Basis,
    start: &[f64],
    (rounds, tolerance_mm): (usize, f64),
) -> Option<Ring> {
    let mut at = start.to_vec();
    let mut weights = vec![1.0; at.len()];
    let mut best: Option<Ring> = None;
    for round in 0..rounds {
        let points = least_squares(basis, &course.points, &at, &weights)?;
        let curve = basis.curve(&points)?;
        let off_mm = feet(&curve, basis.is_closed, &course.points, &mut at);
        let most_mm = greatest(off_mm.iter().copied());
        reweigh(core::slice::from_mut(&mut weights), &[&off_mm], most_mm);
        if best
            .as_ref()
            .is_none_or(|best| is_nearer(most_mm, best.most_mm))
        {
            best = Some(Ring {
                points,
                at: at.clone(),
                off_mm,
                most_mm,
            });
        }
        if is_done(round, most_mm, tolerance_mm) {
            break;
        }
    }
    best
}

/// Lawson's weights of the next round, of each section's data points, with a mean of 1 over all.
pub(crate) fn reweigh(weights: &mut [Vec<f64>], off_mm: &[&[f64]], most_mm: f64) {
    if most_mm.is_nan() || most_mm <= 0.0 {
        return;
    }
    let (mut sum, mut count) = (0.0, 0);
    for (weights, off_mm) in weights.iter_mut().zip(off_mm) {
        for (weight, off_mm) in weights.iter_mut().zip(*off_mm) {
            *weight *= (off_mm / most_mm).max(LEAST_WEIGHT);
            sum += *weight;
        }
        count += weights.len();
    }
    let mean = sum / count as f64;
    for weight in weights.iter_mut().flatten() {
        *weight = (*weight / mean).max(LEAST_WEIGHT);
    }
}

/// Leads parameters to the feet of their data points; gives the distances.
pub(crate) fn feet(
    curve: &BSplineCurve<3>,
    is_closed: bool,
    places: &[[f64; 3]],
    at: &mut [f64],
) -> Vec<f64> {
    let off = |place: [f64; 3], t: f64| distance(curve.evaluate(t), place);
    let lead = |(place, at): (&[f64; 3], &mut f64)| {
        let mut own = off(*place, *at);
        for _ in 0..STEPS {
            let [on, along, bend] = [0, 1, 2].map(|order| curve.derivative(*at, order));
            let r = minus(on, *place);
            let speed = dot(along, along);
            let curved = speed + dot(r, bend);
            let step = -dot(r, along) / if curved > 0.1 * speed { curved } else { speed };
            let next = *at + step;
            let next = if is_closed {
                next - next.floor()
            } else {
                next.clamp(0.0, 1.0)
            };
            let nearer = off(*place, next);
            if nearer.is_nan() || nearer >= own {
                break;
            }
            (*at, own) = (next, nearer);
        }
        own
    };
    places.iter().zip(at).map(lead).collect()
}

/// The place of a control point in the equations: those of a closed curve from both ends in turn, so
/// that neighbours over the seam stay neighbours.
fn folded(basis: &Basis, function: usize) -> usize {
    let functions = basis.functions();
    match (basis.is_closed, 2 * function < functions) {
        (false, _) => function,
        (true, true) => 2 * function,
        (true, false) => 2 * (functions - 1 - function) + 1,
    }
}

/// Control points of the curve with the least sum of weighted squares. `None` where they are not
/// determined.
pub(crate) fn least_squares(
    basis: &Basis,
    places: &[[f64; 3]],
    at: &[f64],
    weights: &[f64],
) -> Option<Vec<[f64; 3]>> {
    let functions = basis.functions();
    let mut matrix = BandedMatrix::zero(functions, 2 * DEGREE + 1);
    let mut sums = vec![[0.0; 3]; functions];
    let mut add = |a: usize, b: usize, value: f64| {
        if a >= b {
            matrix.add(a, b, value);
        }
    };
    for ((place, t), weight) in places.iter().zip(at).zip(weights) {
        let local = basis
            .at(*t)
            .map(|(function, value)| (folded(basis, function), value));
        for (a, value) in local {
            for (b, other) in local {
                add(a, b, weight * value * other);
            }
            let sum = &mut sums[a];
            (0..3).for_each(|d| sum[d] += weight * value * place[d]);
        }
    }
    let stiffness = STIFFNESS * places.len() as f64 / functions as f64;
    let middles = if basis.is_closed {
        0..functions
    } else {
        1..functions - 1
    };
    for middle in middles {
        let of = [functions - 1, 0, 1].map(|by| folded(basis, (middle + by) % functions));
        for (a, own) in of.into_iter().zip([1.0, -2.0, 1.0]) {
            for (b, other) in of.into_iter().zip([1.0, -2.0, 1.0]) {
                add(a, b, stiffness * own * other);
            }
        }
    }
    // A hair of the diagonal, where neither data nor neighbours decide.
    for k in 0..functions {
        add(k, k, stiffness * STIFFNESS);
    }
    let factor = matrix.cholesky().ok()?;
    let solved = factor.solve_points(&sums);
    Some((0..functions).map(|k| solved[folded(basis, k)]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::ellipse;

    fn even(spans: usize) -> Basis {
        Basis {
            breaks: (0..=spans).map(|k| k as f64 / spans as f64).collect(),
            is_closed: true,
        }
    }

    #[test]
    fn a_closed_spline_is_found_again() {
        let basis = even(9);
        let points: Vec<[f64; 3]> = (0..9)
            .map(|k| [f64::from(k * k % 5), f64::from(k * 3 % 7), f64::from(k)])
            .collect();
        let curve = basis.curve(&points).unwrap();
        let at: Vec<f64> = (0..60).map(|k| f64::from(k) / 60.0).collect();
        let places: Vec<[f64; 3]> = at.iter().map(|t| curve.evaluate(*t)).collect();
        let found = least_squares(&basis, &places, &at, &vec![1.0; 60]).unwrap();
        let off = found.iter().zip(&points).map(|(a, b)| distance(*a, *b));
        assert!(off.fold(0.0, f64::max) < 1e-5);
    }

    #[test]
    fn weights_grow_with_deviations_over_all_sections_alike() {
        let mut weights = [vec![1.0; 3], vec![1.0; 3]];
        reweigh(&mut weights, &[&[0.5, 1.0, 0.5], &[4.0, 2.0, 4.0]], 4.0);
        let mean: f64 = weights.iter().flatten().sum::<f64>() / 6.0;
        assert!((mean - 1.0).abs() < 1e-12, "{weights:?}");
        // As their deviations are, within a section and from one to the other.
        assert!((weights[0][1] / weights[0][0] - 2.0).abs() < 1e-12);
        assert!((weights[1][0] / weights[0][1] - 4.0).abs() < 1e-12);
    }

    #[test]
    fn feet_are_where_the_curve_is_nearest() {
        let course = ellipse(60.0, 30.0, 0.0, 40);
        let basis = even(7);
        let points = least_squares(&basis, &course.points, &course.at, &[1.0; 40]).unwrap();
        let curve = basis.curve(&points).unwrap();
        let mut at = course.at.clone();
        let off_mm = feet(&curve, true, &course.points, &mut at);
        for ((place, t), off_mm) in course.points.iter().zip(&at).zip(&off_mm) {
            let on = curve.evaluate(*t);
            assert!((distance(on, *place) - off_mm).abs() < 1e-12);
            let along = curve.derivative(*t, 1);
            let slant = dot(minus(on, *place), along) / crate::space::norm(along);
            assert!(slant.abs() < 1e-4, "{t}: {slant}");
        }
    }

    #[test]
    fn rounds_lower_the_greatest_deviation() {
        let course = ellipse(60.0, 30.0, 0.0, 80);
        let basis = even(6);
        let most = |rounds: usize| {
            ring(&course, &basis, &course.at, (rounds, 0.0))
                .unwrap()
                .most_mm
        };
        let (plain, led) = (most(1), most(20));
        let feet_alone = most(2);
        assert!(
            led < 0.9 * feet_alone && led < 0.75 * plain,
            "{plain} {led}"
        );
        // What is said of the curve is true of it.
        let ring = ring(&course, &basis, &course.at, (20, 0.0)).unwrap();
        let curve = basis.curve(&ring.points).unwrap();
        for (place, off_mm) in course.points.iter().zip(&ring.off_mm) {
            let closest = curve.closest(*place).distance;
            assert!(closest <= off_mm + 1e-9 && off_mm - closest < 1e-3);
        }
    }
}
