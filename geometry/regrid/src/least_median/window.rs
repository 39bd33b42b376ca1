//! A window's samples, ready for lanes.

use super::lanes::{Lanes, PICKED};

/// Most samples of a window.
pub const GREATEST_WINDOW: usize = 1024;
/// Samples are laid out so many at a time, which every width of lanes divides.
const LAID_OUT: usize = PICKED;

/// How far a window's samples reach, rounded up, for what rounding may do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// Of x and y from 0.
    pub(super) spread: f32,
    /// Of z from the reference.
    pub(super) height: f32,
    /// Heights in single precision are taken from here.
    pub(super) reference: f64,
}

impl Extent {
    /// Whether nothing that is made of the samples in single precision leaves its range, upwards
    /// or downwards, by the bounds that [`super::rough`] reckons with.
    pub(super) fn is_moderate(&self) -> bool {
        const SPREAD: core::ops::RangeInclusive<f32> = 1e-6..=1e6;
        SPREAD.contains(&self.spread) && self.height <= 1e12
    }
}

/// Every width of lanes divides so many numbers of double precision.
const LANES: usize = 8;

type Numbers<T> = Box<[T; GREATEST_WINDOW]>;

#[derive(Debug)]
pub(super) struct Window {
    /// x, y and z; beyond the last sample z is no number, which is not within anything.
    exact: [Numbers<f64>; 3],
    /// The same in single precision, z above the reference.
    rough: [Numbers<f32>; 3],
    squares: Numbers<f64>,
    len: usize,
}

impl Default for Window {
    fn default() -> Self {
        let zeros = || Box::new([0.0; GREATEST_WINDOW]);
        let rough_zeros = || Box::new([0.0; GREATEST_WINDOW]);
        Self {
            exact: [zeros(), zeros(), zeros()],
            rough: [rough_zeros(), rough_zeros(), rough_zeros()],
            squares: zeros(),
            len: 0,
        }
    }
}

/// More than rounding to single precision a few times takes away.
pub(super) const UP: f32 = 1.0 + 4.0 * UNIT;
/// Relative error of rounding to single precision.
pub(super) const UNIT: f32 = 0.5 * f32::EPSILON;

impl Window {
    /// Takes samples (x, y, z) in the order in which they are numbered, in both precisions. `None`
    /// if they span no plane or are too many. Heights in single precision are taken from the
    /// nearest sample's, so that little is lost to rounding.
    #[inline(always)]
    pub(super) fn fill<L: Lanes>(
        &mut self,
        lanes: L,
        samples: impl ExactSizeIterator<Item = [f64; 3]>,
    ) -> Option<Extent> {
        self.len = samples.len();
        if !(3..=GREATEST_WINDOW).contains(&self.len) {
            return None;
        }
        let [xs, ys, zs] = &mut self.exact;
        for (((x, y), z), sample) in xs.iter_mut().zip(&mut **ys).zip(&mut **zs).zip(samples) {
            [*x, *y, *z] = sample;
        }
        let padded = self.len.next_multiple_of(LAID_OUT);
        xs[self.len..padded].fill(0.0);
        ys[self.len..padded].fill(0.0);
        zs[self.len..padded].fill(f64::NAN);
        let reference = zs[0];
        for (k, origin) in [0.0, 0.0, reference].into_iter().enumerate() {
            round(
                &self.exact[k][..padded],
                origin,
                &mut self.rough[k][..padded],
            );
        }
        let [x, y, z] = self.rough();
        Some(Extent {
            spread: UP * farthest(lanes, [x, y]),
            height: UP * farthest(lanes, [z, z]),
            reference,
        })
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Squares below the median.
    pub(super) fn middle(&self) -> usize {
        (self.len - 1) / 2
    }

    /// (x, y, z) of a sample.
    #[inline(always)]
    pub(super) fn sample(&self, index: u32) -> [f64; 3] {
        let [x, y, z] = &self.exact;
        let index = index as usize % GREATEST_WINDOW;
        [x[index], y[index], z[index]]
    }

    /// x, y and z of the samples in single precision, with what is there beyond the last sample,
    /// up to a multiple of [`PICKED`].
    #[inline(always)]
    pub(super) fn rough(&self) -> [&[f32]; 3] {
        let padded = self.len.next_multiple_of(PICKED);
        let [x, y, z] = &self.rough;
        [&x[..padded], &y[..padded], &z[..padded]]
    }

    /// x, y and z of the samples, and room for the square of each one's residual; with what is
    /// there beyond the last sample.
    #[inline(always)]
    pub(super) fn squares(&mut self) -> ([&[f64]; 3], &mut [f64]) {
        let padded = self.len.next_multiple_of(LANES);
        let [x, y, z] = &self.exact;
        let exact = [&x[..padded], &y[..padded], &z[..padded]];
        (exact, &mut self.squares[..padded])
    }
}

/// Rounds numbers above an origin to single precision.
#[inline(always)]
fn round(exact: &[f64], origin: f64, rough: &mut [f32]) {
    let (exact, _) = exact.as_chunks::<LAID_OUT>();
    let (rough, _) = rough.as_chunks_mut::<LAID_OUT>();
    for (exact, rough) in exact.iter().zip(rough) {
        for (exact, rough) in exact.iter().zip(rough) {
            *rough = (exact - origin) as f32;
        }
    }
}

/// How far the farthest number is from 0. What is no number is not far.
#[inline(always)]
fn farthest<L: Lanes>(lanes: L, [a, b]: [&[f32]; 2]) -> f32 {
    let mut farthest = lanes.splat_f32s(0.0);
    for (a, b) in L::as_simd_f32s(a).0.iter().zip(L::as_simd_f32s(b).0) {
        for number in [lanes.abs_f32s(*a), lanes.abs_f32s(*b)] {
            let is_farther = lanes.less_than_f32s(farthest, number);
            farthest = lanes.select_f32s(is_farther, number, farthest);
        }
    }
    lanes.reduce_max_f32s(farthest)
}
