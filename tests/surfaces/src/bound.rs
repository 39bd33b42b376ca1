//! The fewest control points that any knots could do with.
//!
//! Along each line of the grid a surface is a cubic spline with the knots of that direction. So
//! where no places of `k` knots let one spline of each line come within the tolerance, there
//! must be more. How near the best spline of a line comes has a bound from below: with `r` what
//! least squares leave, and `s` any spline with the same knots, `|z - s| . |r| >= (z - s) . r = r . r`,
//! since `r` is orthogonal to all of them.

use nurbs::{BandedMatrix, KnotVector};
use rayon::prelude::*;
use surfacing::HeightGrid;

const DEGREE: usize = 3;
/// Knots whose places are all searched, at most.
const MOST: usize = 4;
/// Places per direction that are searched first, for each number of knots; the best are then moved
/// by ever smaller steps.
const PLACES: [usize; MOST] = [118, 60, 30, 20];
/// The last step, nodes.
const LAST_STEP: f64 = 0.2;

/// No fewer control points than this hold the tolerance, whatever their knots, as far as the search
/// for their places finds the best.
pub(crate) fn fewest(grid: &HeightGrid, tolerance_mm: f64) -> usize {
    let along_x: Vec<Vec<f64>> = (0..grid.rows()).map(|j| grid.row(j)).collect();
    let along_y: Vec<Vec<f64>> = (0..grid.columns())
        .map(|i| grid.column(i).to_vec())
        .collect();
    let along = |lines: &[Vec<f64>]| knots_needed(lines, tolerance_mm) + DEGREE + 1;
    along(&along_x) * along(&along_y)
}

/// The least number of knots that are not ruled out.
fn knots_needed(lines: &[Vec<f64>], tolerance_mm: f64) -> usize {
    (0..=MOST)
        .find(|&count| nearest(lines, count) <= tolerance_mm)
        .unwrap_or(MOST + 1)
}

/// The least, over all places of so many knots, of the worst line's bound, millimetres.
fn nearest(lines: &[Vec<f64>], count: usize) -> f64 {
    let last = lines.first().map_or(0, Vec::len).saturating_sub(1) as f64;
    let Some(&places) = count.checked_sub(1).and_then(|n| PLACES.get(n)) else {
        return worst(lines, &[], last);
    };
    let step = last / (places + 1) as f64;
    let mut choices = Vec::new();
    choose(places, count, &mut Vec::new(), &mut choices);
    let best = choices
        .into_par_iter()
        .map(|choice| {
            let knots: Vec<f64> = choice.into_iter().map(|k| k as f64 * step).collect();
            (worst(lines, &knots, last), knots)
        })
        .min_by(|a, b| {
            a.0.total_cmp(&b.0)
                .then(a.1.partial_cmp(&b.1).unwrap_or(core::cmp::Ordering::Equal))
        });
    let Some((mut least, mut knots)) = best else {
        return f64::INFINITY;
    };
    let mut step = step / 2.0;
    while step > LAST_STEP {
        let before = least;
        for k in 0..count {
            for by in [step, -step] {
                let mut moved = knots.clone();
                moved[k] = (moved[k] + by).clamp(0.5, last - 0.5);
                moved.sort_by(f64::total_cmp);
                let bound = worst(lines, &moved, last);
                if bound < least {
                    (least, knots) = (bound, moved);
                }
            }
        }
        if least > 0.999 * before {
            step /= 2.0;
        }
    }
    least
}

/// All ascending choices of `count` of `1..=places`.
fn choose(places: usize, count: usize, chosen: &mut Vec<usize>, choices: &mut Vec<Vec<usize>>) {
    if chosen.len() == count {
        choices.push(chosen.clone());
        return;
    }
    for next in chosen.last().map_or(1, |last| last + 1)..=places {
        chosen.push(next);
        choose(places, count, chosen, choices);
        chosen.pop();
    }
}

/// The greatest of the lines' bounds with these knots; infinite where the nodes do not hold them.
fn worst(lines: &[Vec<f64>], inner: &[f64], last: f64) -> f64 {
    let mut knots = vec![0.0; DEGREE + 1];
    knots.extend(inner);
    knots.extend([last; DEGREE + 1]);
    let Ok(knots) = KnotVector::new(DEGREE, knots) else {
        return f64::INFINITY;
    };
    let nodes = lines.first().map_or(0, Vec::len);
    let at: Vec<_> = (0..nodes).map(|i| knots.basis(i as f64)).collect();
    let mut matrix = BandedMatrix::zero(knots.control_count(), DEGREE);
    for node in &at {
        for k in 0..=DEGREE {
            for l in 0..=k {
                matrix.add(
                    node.first + k,
                    node.first + l,
                    node.values[k] * node.values[l],
                );
            }
        }
    }
    let Ok(system) = matrix.cholesky() else {
        return f64::INFINITY;
    };
    let mut most = 0.0_f64;
    let mut coefficients = vec![0.0; knots.control_count()];
    for line in lines {
        coefficients.fill(0.0);
        for (node, z) in at.iter().zip(line) {
            for k in 0..=DEGREE {
                coefficients[node.first + k] += node.values[k] * z;
            }
        }
        system.solve(&mut coefficients);
        let (mut squares, mut sum) = (0.0, 0.0);
        for (node, z) in at.iter().zip(line) {
            let products = (0..=DEGREE).map(|k| coefficients[node.first + k] * node.values[k]);
            let off = z - products.sum::<f64>();
            squares += off * off;
            sum += off.abs();
        }
        if sum > 0.0 {
            most = most.max(squares / sum);
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(t: f64) -> f64 {
        t.max(0.0) * t.max(0.0) * t.max(0.0)
    }

    #[test]
    fn a_spline_needs_as_many_knots_as_it_has() {
        let line = |scale: f64| -> Vec<f64> {
            let at = (0..81).map(|n| f64::from(n) / 80.0);
            at.map(|t| scale * (40.0 * cube(t - 0.31) - 90.0 * cube(t - 0.62)))
                .collect()
        };
        let lines = [line(1.0), line(-0.4)];
        assert_eq!(knots_needed(&lines, 0.01), 2);
        // Fewer are ruled out by less and less.
        let bounds = [0, 1, 2].map(|count| nearest(&lines, count));
        assert!(
            bounds[0] > 2.0 * bounds[1] && bounds[1] > 0.01,
            "{bounds:?}"
        );
        assert!(bounds[2] < 0.01, "{bounds:?}");
    }

    #[test]
    fn the_bound_is_below_what_a_cubic_comes_to() {
        // Of t^4 over -1 to 1 the best cubic is off by 1/8 (Chebyshev).
        let line: Vec<f64> = (0..201)
            .map(|n| {
                let t = f64::from(n) / 100.0 - 1.0;
                t * t * t * t
            })
            .collect();
        let bound = nearest(&[line], 0);
        assert!(bound < 0.125 && bound > 0.09, "{bound}");
    }
}
