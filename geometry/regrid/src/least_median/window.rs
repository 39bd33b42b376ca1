//! A window's samples, ready for lanes.

use pulp::Simd;

/// Most samples of a window.
pub const GREATEST_WINDOW: usize = 1024;
/// Numbers are there up to a multiple of so many samples, which every width of lanes divides.
const PADDING: usize = 16;

/// What the largest numbers of a window are, rounded up, for what rounding may do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub(super) x: f32,
    pub(super) y: f32,
    /// Of z less the reference.
    pub(super) z: f32,
    /// Samples in single precision are as high above this height.
    pub(super) reference: f64,
}

type Numbers<T> = Box<[T; GREATEST_WINDOW]>;

#[derive(Debug)]
pub(super) struct Window {
    /// (x, y, z) and nothing, for samples to be picked one by one.
    samples: Numbers<[f64; 4]>,
    /// The same by coordinate; beyond the last sample z is no number, neither below nor beyond
    /// anything.
    exact: [Numbers<f64>; 3],
    /// The same in single precision, z above the reference; 0 beyond the last sample.
    rough: [Numbers<f32>; 3],
    squares: Numbers<f64>,
    len: usize,
}

impl Default for Window {
    fn default() -> Self {
        let zeros = || Box::new([0.0; GREATEST_WINDOW]);
        let rough_zeros = || Box::new([0.0; GREATEST_WINDOW]);
        Self {
            samples: Box::new([[0.0; 4]; GREATEST_WINDOW]),
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
    /// Takes samples (x, y, z) in the order in which they are numbered. `None` if they span no
    /// plane or are too many.
    pub(super) fn fill(&mut self, samples: impl ExactSizeIterator<Item = [f64; 3]>) -> Option<()> {
        self.len = samples.len();
        if !(3..=GREATEST_WINDOW).contains(&self.len) {
            return None;
        }
        for (slot, [x, y, z]) in self.samples.iter_mut().zip(samples) {
            *slot = [x, y, z, 0.0];
        }
        Some(())
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Squares below the median.
    pub(super) fn middle(&self) -> usize {
        (self.len - 1) / 2
    }

    /// (x, y, z) and nothing of a sample.
    #[inline(always)]
    pub(super) fn sample(&self, index: u32) -> [f64; 4] {
        self.samples[index as usize % GREATEST_WINDOW]
    }

    /// x, y and z of the samples in single precision.
    #[inline(always)]
    pub(super) fn rough(&self) -> [&[f32]; 3] {
        let [x, y, z] = &self.rough;
        [&x[..self.len], &y[..self.len], &z[..self.len]]
    }

    /// x, y and z of the samples, and room for the square of each one's residual; with what is
    /// there beyond the last sample.
    #[inline(always)]
    pub(super) fn squares(&mut self) -> ([&[f64]; 3], &mut [f64]) {
        let padded = self.len.next_multiple_of(PADDING);
        let [x, y, z] = &self.exact;
        let exact = [&x[..padded], &y[..padded], &z[..padded]];
        (exact, &mut self.squares[..padded])
    }

    /// Lays the samples out for lanes, in both precisions. Heights in single precision are taken
    /// from the nearest sample's, so that little is lost to rounding.
    #[inline(always)]
    pub(super) fn lay_out<S: Simd>(&mut self, simd: S) -> Extent {
        let (len, padded) = (self.len, self.len.next_multiple_of(PADDING));
        let reference = self.samples[0][2];
        let origins = [0.0, 0.0, reference];
        let mut greatest = [0.0; 3];
        for k in 0..3 {
            let (exact, rough) = (&mut self.exact[k], &mut self.rough[k]);
            for (number, sample) in exact[..len].iter_mut().zip(&self.samples[..len]) {
                *number = sample[k];
            }
            exact[len..padded].fill(f64::NAN);
            let origin = origins[k];
            for (number, exact) in rough[..len].iter_mut().zip(&exact[..len]) {
                *number = (exact - origin) as f32;
            }
            rough[len..padded].fill(0.0);
            let mut lanes = simd.splat_f32s(0.0);
            for numbers in S::as_simd_f32s(&rough[..padded]).0 {
                lanes = simd.max_f32s(lanes, simd.abs_f32s(*numbers));
            }
            greatest[k] = UP * simd.reduce_max_f32s(lanes);
        }
        let [x, y, z] = greatest;
        Extent { x, y, z, reference }
    }
}
