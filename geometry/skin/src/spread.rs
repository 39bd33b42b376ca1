//! Fewer rows of control points than sections: least squares over all of them at once.

use nurbs::{BandedMatrix, KnotVector};
use range_image::{Cancelled, Monitor};

use crate::around::{Ring, STIFFNESS, feet, is_done, reweigh};
use crate::basis::Basis;
use crate::space::{greatest, is_nearer, plus, times};
use crate::stack::Stack;

/// A net of control points: those of a row are around, rows are across.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Net {
    pub(crate) basis: Basis,
    pub(crate) across: KnotVector,
    /// Row by row.
    pub(crate) points: Vec<[f64; 3]>,
    /// Of each section: feet and distances.
    pub(crate) rings: Vec<Ring>,
    pub(crate) most_mm: f64,
}

impl Net {
    /// Control points as they are written.
    pub(crate) fn written(&self) -> usize {
        self.basis.written() * self.across.control_count()
    }

    /// Through curves that are there: a row for each, so that the surface has each of them.
    pub(crate) fn through(
        basis: Basis,
        rings: Vec<Ring>,
        heights: &[f64],
        degree: usize,
    ) -> Option<Self> {
        let across = averaged(heights, degree)?;
        let functions = basis.functions();
        let rows = across.control_count();
        let mut points = vec![[0.0; 3]; functions * rows];
        for function in 0..functions {
            let column: Vec<[f64; 3]> = rings.iter().map(|ring| ring.points[function]).collect();
            let found = column_of(&across, heights, &column)?;
            for (row, point) in found.into_iter().enumerate() {
                points[row * functions + function] = point;
            }
        }
        let most_mm = greatest(rings.iter().map(|ring| ring.most_mm));
        Some(Self {
            basis,
            across,
            points,
            rings,
            most_mm,
        })
    }

    /// Least squares over all sections, led towards the least greatest deviation as
    /// [`crate::around::ring`] is.
    pub(crate) fn least_squares(
        stack: &Stack,
        basis: &Basis,
        across: &KnotVector,
        starts: &[Vec<f64>],
        (rounds, tolerance_mm): (usize, f64),
        monitor: &dyn Monitor,
    ) -> Result<Option<Self>, Cancelled> {
        let mut at = starts.to_vec();
        let mut weights: Vec<Vec<f64>> = at.iter().map(|of| vec![1.0; of.len()]).collect();
        let mut best: Option<Self> = None;
        for round in 0..rounds {
            monitor.check()?;
            let Some(points) = solved(stack, basis, across, &at, &weights) else {
                return Ok(None);
            };
            let mut rings = Vec::with_capacity(at.len());
            for ((course, height), at) in stack.courses.iter().zip(&stack.heights).zip(&mut at) {
                let points = row_at(basis, across, &points, *height);
                let Some(curve) = basis.curve(&points) else {
                    return Ok(None);
                };
                let off_mm = feet(&curve, basis.is_closed, &course.points, at);
                let most_mm = greatest(off_mm.iter().copied());
                rings.push(Ring {
                    points,
                    at: at.clone(),
                    off_mm,
                    most_mm,
                });
            }
            let most_mm = greatest(rings.iter().map(|ring| ring.most_mm));
            let off_mm: Vec<&[f64]> = rings.iter().map(|ring| &*ring.off_mm).collect();
            reweigh(&mut weights, &off_mm, most_mm);
            if best
                .as_ref()
                .is_none_or(|best| is_nearer(most_mm, best.most_mm))
            {
                best = Some(Self {
                    basis: basis.clone(),
                    across: across.clone(),
                    points,
                    rings,
                    most_mm,
                });
            }
            if is_done(round, most_mm, tolerance_mm) {
                break;
            }
        }
        Ok(best)
    }

    /// Multiplications of one least squares with so many functions around and rows.
    pub(crate) fn work(functions: usize, rows: usize, degree: usize) -> usize {
        let band = (degree + 1).saturating_mul(functions);
        let size = rows.saturating_mul(functions);
        size.saturating_mul(band).saturating_mul(band)
    }
}

/// Control points around of the curve at a height.
fn row_at(basis: &Basis, across: &KnotVector, points: &[[f64; 3]], height: f64) -> Vec<[f64; 3]> {
    let functions = basis.functions();
    let local = across.basis(height);
    let at = |function: usize| {
        (0..=across.degree()).fold([0.0; 3], |sum, k| {
            let point = points[(local.first + k) * functions + function];
            plus(sum, times(point, local.values[k]))
        })
    };
    (0..functions).map(at).collect()
}

/// Knots across so that each section has a row (Piegl & Tiller 1997, equation 9.8): means of the
/// heights.
pub(crate) fn averaged(heights: &[f64], degree: usize) -> Option<KnotVector> {
    let degree = degree.min(heights.len() - 1);
    let inner = (1..heights.len() - degree)
        .map(|j| heights[j..j + degree].iter().sum::<f64>() / degree as f64);
    clamped(degree, inner)
}

/// Knots across for fewer rows than sections (their equation 9.69): a section in each span at least.
pub(crate) fn thinned(heights: &[f64], degree: usize, rows: usize) -> Option<KnotVector> {
    let d = heights.len() as f64 / (rows - degree) as f64;
    let inner = (1..rows - degree).map(|j| {
        let at = j as f64 * d;
        let (i, share) = (at as usize, at - at.floor());
        (1.0 - share) * heights[i - 1] + share * heights[i]
    });
    clamped(degree, inner)
}

fn clamped(degree: usize, inner: impl Iterator<Item = f64>) -> Option<KnotVector> {
    let knots = core::iter::repeat_n(0.0, degree + 1).chain(inner);
    let knots = knots.chain(core::iter::repeat_n(1.0, degree + 1));
    KnotVector::new(degree, knots.collect()).ok()
}

/// Control points over knots across that give values at the heights, or come nearest to them.
pub(crate) fn column_of(
    across: &KnotVector,
    heights: &[f64],
    values: &[[f64; 3]],
) -> Option<Vec<[f64; 3]>> {
    let (rows, degree) = (across.control_count(), across.degree());
    let mut matrix = BandedMatrix::zero(rows, degree);
    let mut sums = vec![[0.0; 3]; rows];
    for (height, value) in heights.iter().zip(values) {
        let local = across.basis(*height);
        for a in 0..=degree {
            for b in 0..=a {
                let (row, column) = (local.first + a, local.first + b);
                matrix.add(row, column, local.values[a] * local.values[b]);
            }
            let sum = &mut sums[local.first + a];
            (0..3).for_each(|d| sum[d] += local.values[a] * value[d]);
        }
    }
    let factor = matrix.cholesky().ok()?;
    Some(factor.solve_points(&sums))
}

/// The net with the least sum of weighted squares.
fn solved(
    stack: &Stack,
    basis: &Basis,
    across: &KnotVector,
    at: &[Vec<f64>],
    weights: &[Vec<f64>],
) -> Option<Vec<[f64; 3]>> {
    let (functions, rows, degree) = (basis.functions(), across.control_count(), across.degree());
    let size = functions * rows;
    let mut matrix = BandedMatrix::zero(size, (degree.max(2) + 1) * functions - 1);
    let mut sums = vec![[0.0; 3]; size];
    let mut count = 0;
    let of_courses = stack.courses.iter().zip(&stack.heights);
    for ((course, height), (at, weights)) in of_courses.zip(at.iter().zip(weights)) {
        let up = across.basis(*height);
        count += at.len();
        for ((place, t), weight) in course.points.iter().zip(at).zip(weights) {
            let local = basis.at(*t);
            let mut elements = Vec::with_capacity(local.len() * (degree + 1));
            for k in 0..=degree {
                for (function, value) in local {
                    elements.push(((up.first + k) * functions + function, up.values[k] * value));
                }
            }
            for &(row, value) in &elements {
                for &(column, other) in &elements {
                    if column <= row {
                        matrix.add(row, column, weight * value * other);
                    }
                }
                let sum = &mut sums[row];
                (0..3).for_each(|d| sum[d] += weight * value * place[d]);
            }
        }
    }
    let stiffness = STIFFNESS * count as f64 / size as f64;
    for row in 0..rows {
        let middles = if basis.is_closed {
            0..functions
        } else {
            1..functions - 1
        };
        for middle in middles {
            let index = |by: usize| row * functions + (middle + by) % functions;
            stiffen(
                &mut matrix,
                [index(functions - 1), index(0), index(1)],
                stiffness,
            );
        }
    }
    for row in 1..rows.saturating_sub(1) {
        for function in 0..functions {
            let index = |by: usize| (row + by - 1) * functions + function;
            stiffen(&mut matrix, [index(0), index(1), index(2)], stiffness);
        }
    }
    for k in 0..size {
        matrix.add(k, k, stiffness * STIFFNESS);
    }
    let factor = matrix.cholesky().ok()?;
    Some(factor.solve_points(&sums))
}

/// Adds the square of a second difference.
fn stiffen(matrix: &mut BandedMatrix, of: [usize; 3], stiffness: f64) {
    for (a, own) in of.into_iter().zip([1.0, -2.0, 1.0]) {
        for (b, other) in of.into_iter().zip([1.0, -2.0, 1.0]) {
            if b <= a {
                matrix.add(a, b, stiffness * own * other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::settings::Settings;
    use crate::testing::waisted;

    #[test]
    fn rounds_lower_the_greatest_deviation_of_fewer_rows() {
        let stack = Stack::of(&waisted(9, 90), &Settings::new(1.0)).unwrap();
        let basis = Basis {
            breaks: (0..=7).map(|k| f64::from(k) / 7.0).collect(),
            is_closed: true,
        };
        let across = thinned(&stack.heights, 3, 6).unwrap();
        let starts: Vec<Vec<f64>> = stack.courses.iter().map(|own| own.at.clone()).collect();
        let most = |rounds: usize| {
            let asked = (rounds, 0.0);
            let net = Net::least_squares(&stack, &basis, &across, &starts, asked, &Unmonitored);
            net.unwrap().unwrap().most_mm
        };
        let (plain, led) = (most(1), most(12));
        assert!(led < 0.8 * plain, "{plain} {led}");
    }

    #[test]
    fn columns_go_through_their_values_where_there_is_a_row_for_each() {
        let heights = [0.0, 0.2, 0.3, 0.7, 1.0];
        let values: Vec<[f64; 3]> = (0..5)
            .map(|k| [f64::from(k * k), 1.0, f64::from(k)])
            .collect();
        for degree in 1..=4 {
            let across = averaged(&heights, degree).unwrap();
            let points = column_of(&across, &heights, &values).unwrap();
            let curve = nurbs::BSplineCurve::new(across, points).unwrap();
            for (height, value) in heights.iter().zip(&values) {
                let on = curve.evaluate(*height);
                assert!(crate::space::distance(on, *value) < 1e-9, "{degree}");
            }
        }
    }
}
