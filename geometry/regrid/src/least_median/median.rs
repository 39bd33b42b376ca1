//! Medians of squared residuals in double precision.

use pulp::Simd;

use super::window::Window;
use crate::plane::Plane;

/// Up to as many squares above the median are passed one by one.
const STEPS: usize = 10;

/// The median of squared residuals, if it is below `least`.
#[inline(always)]
pub(super) fn median_below<S: Simd>(
    simd: S,
    window: &mut Window,
    plane: &Plane,
    least: f64,
) -> Option<f64> {
    let (len, middle) = (window.len(), window.middle());
    let (samples, squares) = window.squares();
    let (mut number, mut greatest) = square_residuals(simd, samples, plane, squares, least);
    if number <= middle {
        return None;
    }
    if number > middle + STEPS {
        let squares = &mut squares[..len];
        return Some(*squares.select_nth_unstable_by(middle, f64::total_cmp).1);
    }
    // The greatest square below the limit, then the greatest below that, and so on, until no
    // more are left than lie below a median.
    while number > middle + 1 {
        let (fewer, next) = below(simd, squares, greatest);
        if fewer <= middle {
            break;
        }
        (number, greatest) = (fewer, next);
    }
    Some(greatest)
}

/// Squares the residuals, as [`Plane::residual`] has them, operation for operation; and as
/// [`below`].
#[inline(always)]
fn square_residuals<S: Simd>(
    simd: S,
    samples: [&[f64]; 3],
    plane: &Plane,
    squares: &mut [f64],
    limit: f64,
) -> (usize, f64) {
    let [x, y, z] = samples.map(|numbers| S::as_simd_f64s(numbers).0);
    let [a, b, c] = [plane.a, plane.b, plane.c].map(|number| simd.splat_f64s(number));
    let mut below = Below::new(simd, limit);
    let squares = S::as_mut_simd_f64s(squares).0;
    for (((square, x), y), z) in squares.iter_mut().zip(x).zip(y).zip(z) {
        let slope = simd.add_f64s(simd.mul_f64s(a, *x), simd.mul_f64s(b, *y));
        let residual = simd.sub_f64s(*z, simd.add_f64s(slope, c));
        *square = simd.mul_f64s(residual, residual);
        below.add(simd, *square);
    }
    below.told(simd)
}

/// How many squares are below a limit, and the greatest of those.
#[inline(always)]
fn below<S: Simd>(simd: S, squares: &[f64], limit: f64) -> (usize, f64) {
    let mut below = Below::new(simd, limit);
    for square in S::as_simd_f64s(squares).0 {
        below.add(simd, *square);
    }
    below.told(simd)
}

/// What [`below`] tells, in lanes.
struct Below<S: Simd> {
    limit: S::f64s,
    number: S::f64s,
    greatest: S::f64s,
}

impl<S: Simd> Below<S> {
    #[inline(always)]
    fn new(simd: S, limit: f64) -> Self {
        Self {
            limit: simd.splat_f64s(limit),
            number: simd.splat_f64s(0.0),
            greatest: simd.splat_f64s(0.0),
        }
    }

    #[inline(always)]
    fn add(&mut self, simd: S, square: S::f64s) {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let is_below = simd.less_than_f64s(square, self.limit);
        self.number = simd.add_f64s(self.number, simd.select_f64s(is_below, one, zero));
        let square = simd.select_f64s(is_below, square, zero);
        self.greatest = simd.max_f64s(self.greatest, square);
    }

    #[inline(always)]
    fn told(self, simd: S) -> (usize, f64) {
        let number = simd.reduce_sum_f64s(self.number) as usize;
        (number, simd.reduce_max_f64s(self.greatest))
    }
}
