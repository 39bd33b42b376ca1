//! Medians of squared residuals in double precision.

use super::window::{BLOCK, Window};
use crate::plane::Plane;

/// Up to as many squares above the median are passed one by one.
const STEPS: usize = 10;

/// The median of squared residuals, if it is below `least`.
#[inline(always)]
pub(super) fn median_below(window: &mut Window, plane: &Plane, least: f64) -> Option<f64> {
    let middle = window.middle();
    let (samples, squares) = window.squares();
    let mut below = Below::default();
    for (squares, block) in squares.iter_mut().zip(samples) {
        for (k, square) in squares.iter_mut().enumerate() {
            let residual = block.z[k] - plane.at(block.x[k], block.y[k]);
            *square = residual * residual;
            below.add(k, *square, least);
        }
    }
    let mut number = below.number();
    if number <= middle {
        return None;
    }
    if number > middle + STEPS {
        let all = squares.as_flattened_mut();
        return Some(*all.select_nth_unstable_by(middle, f64::total_cmp).1);
    }
    // The greatest square below the limit, then the greatest below that, and so on, until no
    // more are left than lie below a median.
    loop {
        let greatest = below.greatest();
        if number == middle + 1 {
            return Some(greatest);
        }
        below = Below::default();
        for squares in squares.iter() {
            for (k, square) in squares.iter().enumerate() {
                below.add(k, *square, greatest);
            }
        }
        number = below.number();
        if number <= middle {
            return Some(greatest);
        }
    }
}

/// How many squares are below a limit, and the greatest of those, in lanes.
struct Below {
    number: [u64; BLOCK],
    greatest: [f64; BLOCK],
}

impl Default for Below {
    fn default() -> Self {
        Self {
            number: [0; BLOCK],
            greatest: [-1.0; BLOCK],
        }
    }
}

impl Below {
    #[inline(always)]
    fn add(&mut self, lane: usize, square: f64, limit: f64) {
        let is_below = square < limit;
        self.number[lane] += u64::from(is_below);
        let square = if is_below { square } else { -1.0 };
        self.greatest[lane] = greater(square, self.greatest[lane]);
    }

    #[inline(always)]
    fn number(&self) -> usize {
        self.number.iter().sum::<u64>() as usize
    }

    #[inline(always)]
    fn greatest(&self) -> f64 {
        let g = &self.greatest;
        let pairs = [0, 1, 2, 3].map(|k| greater(g[k], g[k + 4]));
        greater(greater(pairs[0], pairs[2]), greater(pairs[1], pairs[3]))
    }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
