//! The plane of the least median of squared residuals (equation 2), by planes side by side.
//!
//! Planes are drawn and solved in lanes. A pass in single precision counts for many of them how
//! many samples lie farther off than the best median known, less what rounding may do: whatever
//! it throws out is not the best. Only what is left is looked at in double precision, the
//! likeliest first, whose median then throws out nearly all others. The limit of the first pass
//! is guessed from the node before; where the guess throws out everything, it is raised.
//!
//! The answer is that of trying each plane in double precision in the order of the draws, bit
//! for bit: the guesses, the number of lanes and the instructions of the processor decide the
//! time alone.

mod median;
mod planes;
mod rough;
mod sift;
mod window;

use pulp::{Arch, Simd, WithSimd};

use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::plane::{Fit, Plane, tolerance};
use planes::Planes;
use window::Window;

pub use window::GREATEST_WINDOW;

/// Collinear triples are drawn again, up to this many draws for each plane wanted.
const DRAWS_PER_PLANE: usize = 8;
/// The limit for a node is guessed as this many times the least median of squares of the node
/// before: more spares passes whose guess was too low, less throws out more.
const HINT: f64 = 3.0;
/// A guess that was too low is raised by this factor, and then given up.
const RAISE: f64 = 16.0;

/// Finds planes; keeps its buffers from window to window.
#[derive(Debug, Default)]
pub struct LeastMedian {
    window: Window,
    planes: Planes,
    hint: Option<f64>,
}

impl LeastMedian {
    /// The plane `z = a x + b y + c` with the least median of squared residuals over samples
    /// (x, y, z), of `planes` planes through three of them each, drawn at random, and that
    /// median; of equal planes the first drawn. The median of n squares is the
    /// `floor((n + 1) / 2)`-th. `None` when all triples drawn are collinear, and of fewer than 3
    /// samples or more than [`GREATEST_WINDOW`].
    ///
    /// ```
    /// use regrid::LeastMedian;
    ///
    /// let samples: Vec<[f64; 3]> = (0..25)
    ///     .map(|k| {
    ///         let (x, y) = (f64::from(k % 5), f64::from(k / 5));
    ///         // Two of five samples are no part of the plane.
    ///         [x, y, if k % 5 < 2 { f64::from(k * k) } else { 1.0 + 0.5 * x }]
    ///     })
    ///     .collect();
    /// let ([a, b, c], median) = LeastMedian::default().plane(&samples, 100, 1).unwrap();
    /// assert_eq!([a, b, c, median], [0.5, 0.0, 1.0, 0.0]);
    /// ```
    pub fn plane(
        &mut self,
        samples: &[[f64; 3]],
        planes: usize,
        seed: u64,
    ) -> Option<([f64; 3], f64)> {
        self.window.fill(samples.iter().copied())?;
        let (plane, median) = find(self, planes, &mut Draws::new(seed, 0, 0))?;
        Some(([plane.a, plane.b, plane.c], median))
    }

    /// The same of a node's window, with how far inliers lie from the plane.
    pub(crate) fn fit(
        &mut self,
        window: &[Neighbour],
        planes: usize,
        draws: &mut Draws,
    ) -> Option<Fit> {
        self.window.fill(window.iter().map(|n| [n.dx, n.dy, n.z]))?;
        let (plane, median) = find(self, planes, draws)?;
        Some(Fit {
            plane,
            tolerance: tolerance(median, window.len()),
        })
    }
}

/// With the widest lanes of this processor.
fn find(finder: &mut LeastMedian, wanted: usize, draws: &mut Draws) -> Option<(Plane, f64)> {
    Arch::new().dispatch(Find {
        finder,
        wanted,
        draws,
    })
}

/// The search for one window.
struct Find<'a> {
    finder: &'a mut LeastMedian,
    /// Planes to try.
    wanted: usize,
    draws: &'a mut Draws,
}

impl WithSimd for Find<'_> {
    type Output = Option<(Plane, f64)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self {
            finder,
            wanted,
            draws,
        } = self;
        let LeastMedian {
            window,
            planes,
            hint,
        } = finder;
        let extent = window.lay_out(simd);
        let (mut tried, mut left) = (0, wanted.saturating_mul(DRAWS_PER_PLANE));
        let mut best: Option<Plane> = None;
        let mut least = hint.unwrap_or(f64::INFINITY);
        while tried < wanted && left > 0 {
            planes.clear();
            while !planes.is_full() && tried < wanted && left > 0 {
                let drawn = planes.room().min(wanted - tried).min(left);
                tried += planes.draw(simd, window, drawn, draws);
                left -= drawn;
            }
            if planes.is_empty() {
                continue;
            }
            planes.roughen(&extent);
            let mut found = sift::best(simd, window, planes, &mut least);
            // Should the guess have thrown out everything, it is raised, and then given up.
            for raised in [RAISE * least, f64::INFINITY] {
                if found.is_none() && best.is_none() {
                    least = raised;
                    found = sift::best(simd, window, planes, &mut least);
                }
            }
            best = found.or(best);
        }
        // Nothing is below 0, which coarse depths often leave.
        *hint = best.map(|_| HINT * least).filter(|limit| *limit > 0.0);
        Some((best?, least))
    }
}

#[cfg(test)]
mod tests;
