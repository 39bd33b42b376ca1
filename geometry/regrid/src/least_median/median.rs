//! Medians of squared residuals in double precision.

use super::lanes::Lanes;
use super::window::Window;
use crate::plane::Plane;

/// So few squares on one side of the median are passed one by one at once.
const STEPS: usize = 2;
/// As many are, if that is as near as it gets.
const MOST_STEPS: usize = 8;
/// Limits that are tried to come as near to the median.
const LIMITS: usize = 3;

/// What is known of a median that is looked for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Known {
    /// It is of no use unless it is below this.
    Limit(f64),
    /// It is about this.
    Guess(f64),
}

/// The median of squared residuals, if it is of use.
#[inline(always)]
pub(super) fn median<L: Lanes>(
    lanes: L,
    window: &mut Window,
    plane: &Plane,
    known: Known,
) -> Option<f64> {
    let (len, middle) = (window.len(), window.middle());
    let (samples, squares) = window.squares();
    let (Known::Limit(limit) | Known::Guess(limit)) = known;
    let number = square_residuals(lanes, samples, plane, squares, limit);
    let (low, high) = if number > middle {
        ((0.0, 0), (limit, number))
    } else if matches!(known, Known::Guess(_)) {
        ((limit, number), (f64::INFINITY, len))
    } else {
        return None;
    };
    Some(select(lanes, squares, len, middle, low, high))
}

/// Squares the residuals, as [`Plane::residual`] has them, operation for operation, and counts
/// those below a limit.
#[inline(always)]
fn square_residuals<L: Lanes>(
    lanes: L,
    samples: [&[f64]; 3],
    plane: &Plane,
    squares: &mut [f64],
    limit: f64,
) -> usize {
    let [x, y, z] = samples.map(|numbers| L::as_simd_f64s(numbers).0);
    let (a, b) = (lanes.splat_f64s(plane.a), lanes.splat_f64s(plane.b));
    let c = lanes.splat_f64s(plane.c);
    let limit = lanes.splat_f64s(limit);
    let squares = L::as_mut_simd_f64s(squares).0;
    let mut number = 0;
    for (((square, x), y), z) in squares.iter_mut().zip(x).zip(y).zip(z) {
        let slope = lanes.add_f64s(lanes.mul_f64s(a, *x), lanes.mul_f64s(b, *y));
        let residual = lanes.sub_f64s(*z, lanes.add_f64s(slope, c));
        *square = lanes.mul_f64s(residual, residual);
        let is_below = lanes.less_than_f64s(*square, limit);
        number += lanes.bits_m64s(is_below).count_ones();
    }
    number as usize
}

/// The square that `middle` others come before in their order, between two limits, which so many
/// are below.
#[inline(always)]
fn select<L: Lanes>(
    lanes: L,
    squares: &mut [f64],
    len: usize,
    middle: usize,
    (mut low, below_low): (f64, usize),
    (mut high, below_high): (f64, usize),
) -> f64 {
    let (mut fewer, mut more) = (middle - below_low, below_high - middle - 1);
    for _ in 0..LIMITS {
        if fewer.min(more) <= STEPS || high == f64::INFINITY {
            break;
        }
        // Residuals are about evenly distributed, so their number grows as the root of the limit.
        let share = (fewer + 1) as f64 / (fewer + more + 1) as f64;
        let limit = low + (high - low) * if low > 0.0 { share } else { share * share };
        let below = count_below(lanes, squares, limit);
        if below > middle {
            (high, more) = (limit, below - middle - 1);
        } else {
            (low, fewer) = (limit, middle - below);
        }
    }
    if fewer.min(more) > MOST_STEPS {
        return *squares[..len]
            .select_nth_unstable_by(middle, f64::total_cmp)
            .1;
    }
    if more <= fewer {
        step_down(lanes, squares, middle, high)
    } else {
        step_up(lanes, squares, middle, low)
    }
}

/// The greatest square below a limit, then the greatest below that, and so on, until no more are
/// left than lie below a median. The limit itself, if no more are below that.
#[inline(always)]
fn step_down<L: Lanes>(lanes: L, squares: &[f64], middle: usize, limit: f64) -> f64 {
    let mut last = limit;
    loop {
        let (number, greatest) = greatest_below(lanes, squares, last);
        if number <= middle {
            return last;
        }
        last = greatest;
    }
}

/// The least square from a limit on, then the least above that, and so on, until more are left
/// behind than lie below a median, or none comes after.
#[inline(always)]
fn step_up<L: Lanes>(lanes: L, squares: &[f64], middle: usize, limit: f64) -> f64 {
    let mut last = least_from(lanes, squares, limit).1;
    loop {
        let (number, least) = least_from(lanes, squares, last.next_up());
        if number > middle || last == f64::INFINITY {
            return last;
        }
        last = least;
    }
}

/// How many squares are below a limit.
#[inline(always)]
fn count_below<L: Lanes>(lanes: L, squares: &[f64], limit: f64) -> usize {
    let limit = lanes.splat_f64s(limit);
    let mut number = 0;
    for square in L::as_simd_f64s(squares).0 {
        let is_below = lanes.less_than_f64s(*square, limit);
        number += lanes.bits_m64s(is_below).count_ones();
    }
    number as usize
}

/// How many squares are below a limit, and the greatest of those.
#[inline(always)]
fn greatest_below<L: Lanes>(lanes: L, squares: &[f64], limit: f64) -> (usize, f64) {
    let (limit, none) = (lanes.splat_f64s(limit), lanes.splat_f64s(0.0));
    let (mut number, mut greatest) = (0, none);
    for square in L::as_simd_f64s(squares).0 {
        let is_below = lanes.less_than_f64s(*square, limit);
        number += lanes.bits_m64s(is_below).count_ones();
        let counts = lanes.select_f64s(is_below, *square, none);
        greatest = lanes.max_f64s(greatest, counts);
    }
    (number as usize, lanes.reduce_max_f64s(greatest))
}

/// How many squares are below a limit, and the least of the others.
#[inline(always)]
fn least_from<L: Lanes>(lanes: L, squares: &[f64], limit: f64) -> (usize, f64) {
    let (limit, none) = (lanes.splat_f64s(limit), lanes.splat_f64s(f64::INFINITY));
    let (mut number, mut least) = (0, none);
    for square in L::as_simd_f64s(squares).0 {
        let is_below = lanes.less_than_f64s(*square, limit);
        number += lanes.bits_m64s(is_below).count_ones();
        let is_not = lanes.greater_than_or_equal_f64s(*square, limit);
        let counts = lanes.select_f64s(is_not, *square, none);
        least = lanes.min_f64s(least, counts);
    }
    (number as usize, lanes.reduce_min_f64s(least))
}
