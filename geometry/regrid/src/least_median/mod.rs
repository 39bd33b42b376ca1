//! The plane of the least median of squared residuals (equation 2), by planes side by side.
//!
//! Planes are drawn and solved in lanes, in single precision, with a bound of what rounding may
//! do. A pass over many of them counts how many samples may be nearer than the best median known:
//! where those are too few, the plane is not the best. Only what is left is solved and looked at
//! in double precision, the likeliest first, whose median then throws out nearly all others. The
//! limit of the first pass is guessed from the node before; where the guess was too low, there is
//! another pass.
//!
//! The answer is that of trying each plane in double precision in the order of the draws, bit
//! for bit: the guesses, the number of lanes and the instructions of the processor decide the
//! time alone.

mod lanes;
mod median;
mod planes;
mod rough;
mod sift;
mod window;

use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::plane::{Fit, LEAST_SINE, Plane, tolerance};
use lanes::{Lanes, WithLanes};
use median::{Known, median};
use planes::{DRAWN, Planes};
use rough::Bounds;
use window::Window;

pub use window::GREATEST_WINDOW;

/// Collinear triples are drawn again, up to this many draws for each plane wanted.
const DRAWS_PER_PLANE: usize = 8;
/// The limit for a node is guessed as this many times the least median of squares of the node
/// before: more spares passes after a guess that was too low, less throws out more.
const HINT: f64 = 2.0;
/// Fewer planes than this are tried one by one.
const FEW: usize = 4;

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
        let samples = samples.iter().copied();
        let (plane, median) = find(self, samples, planes, &mut Draws::new(seed, 0, 0))?;
        Some(([plane.a, plane.b, plane.c], median))
    }

    /// The same of a node's window, with how far inliers lie from the plane.
    pub(crate) fn fit(
        &mut self,
        window: &[Neighbour],
        planes: usize,
        draws: &mut Draws,
    ) -> Option<Fit> {
        let samples = window.iter().map(|n| [n.dx, n.dy, n.z]);
        let (plane, median) = find(self, samples, planes, draws)?;
        Some(Fit {
            plane,
            tolerance: tolerance(median, window.len()),
        })
    }
}

/// With the widest lanes of this processor.
fn find(
    finder: &mut LeastMedian,
    samples: impl ExactSizeIterator<Item = [f64; 3]>,
    wanted: usize,
    draws: &mut Draws,
) -> Option<(Plane, f64)> {
    lanes::dispatch(Find {
        finder,
        samples,
        wanted,
        draws,
    })
}

/// The search for one window.
struct Find<'a, I> {
    finder: &'a mut LeastMedian,
    /// (x, y, z) in the order in which they are numbered.
    samples: I,
    /// Planes to try.
    wanted: usize,
    draws: &'a mut Draws,
}

impl<I: ExactSizeIterator<Item = [f64; 3]>> WithLanes for Find<'_, I> {
    type Output = Option<(Plane, f64)>;

    #[inline(always)]
    fn with_lanes<L: Lanes>(self, lanes: L) -> Self::Output {
        let LeastMedian {
            window,
            planes,
            hint,
        } = self.finder;
        let extent = window.fill(lanes, self.samples)?;
        let mut search = Search {
            window,
            draws: self.draws,
            wanted: self.wanted,
            left: self.wanted.saturating_mul(DRAWS_PER_PLANE),
            best: None,
            least: hint.unwrap_or(f64::INFINITY),
        };
        if extent.is_moderate() {
            let bounds = Bounds::new(&extent);
            while search.missing() >= FEW {
                search.try_many(lanes, planes, &bounds);
            }
        }
        while search.missing() > 0 {
            lanes::with(lanes, TryOne(&mut search));
        }
        let Search { best, least, .. } = search;
        // Nothing is below 0, which coarse depths often leave.
        *hint = best.map(|_| HINT * least).filter(|limit| *limit > 0.0);
        Some((best?, least))
    }
}

/// [`Search::try_one`], which is not often called, apart from what is.
struct TryOne<'a, 'b>(&'a mut Search<'b>);

impl WithLanes for TryOne<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: Lanes>(self, lanes: L) {
        self.0.try_one(lanes);
    }
}

/// How far the search has come.
struct Search<'a> {
    window: &'a mut Window,
    draws: &'a mut Draws,
    /// Planes still to be tried.
    wanted: usize,
    /// Draws that are left for them.
    left: usize,
    best: Option<Plane>,
    /// The median of the best, or a guess while there is none.
    least: f64,
}

impl Search<'_> {
    /// So many triples can be drawn without one too many.
    fn missing(&self) -> usize {
        self.wanted.min(self.left)
    }

    /// Tries as many planes as are looked at together.
    #[inline(always)]
    fn try_many<L: Lanes>(&mut self, lanes: L, planes: &mut Planes, bounds: &Bounds) {
        planes.clear();
        while !planes.is_full() && self.missing() >= FEW {
            let number = self.missing().min(DRAWN);
            self.left -= number;
            self.wanted -= planes.draw(lanes, self.window, bounds, number, self.draws);
        }
        let is_guess = self.best.is_none();
        let found = sift::best(lanes, self.window, planes, &mut self.least, is_guess);
        self.best = found.or(self.best);
    }

    /// Tries the plane through one triple, in double precision alone.
    #[inline(always)]
    fn try_one<L: Lanes>(&mut self, lanes: L) {
        self.left -= 1;
        let triple = self.draws.triple(self.window.len());
        let [p, q, r] = triple.map(|k| self.window.sample(k as u32));
        let Some(plane) = Plane::through_points(p, q, r, LEAST_SINE) else {
            return;
        };
        self.wanted -= 1;
        let known = match self.best {
            None => Known::Guess(self.least),
            Some(_) => Known::Limit(self.least),
        };
        if let Some(median) = median(lanes, self.window, &plane, known) {
            (self.best, self.least) = (Some(plane), median);
        }
    }
}

#[cfg(test)]
mod tests;
