//! Planes in single precision, and what rounding may do to residuals from them.

use pulp::Simd;

use super::planes::MOST;
use super::window::{Extent, UNIT, UP};

/// Vectors of planes counted side by side, for as many samples to be had by one read.
const SIDE_BY_SIDE: usize = 2;

/// Planes with heights above the window's reference. Slots that hold no plane have numbers, too,
/// which mean nothing, and nobody asks.
#[derive(Debug)]
pub(super) struct RoughPlanes {
    a: [f32; MOST],
    b: [f32; MOST],
    c: [f32; MOST],
    /// How much a residual in single precision may differ from the one in double precision.
    slack: [f32; MOST],
}

impl Default for RoughPlanes {
    fn default() -> Self {
        Self {
            a: [0.0; MOST],
            b: [0.0; MOST],
            c: [0.0; MOST],
            slack: [0.0; MOST],
        }
    }
}

impl RoughPlanes {
    /// Takes the first `len` planes, and bounds what rounding does to residuals from them.
    ///
    /// Of the residual `z - c - a x - b y` each of a, b, c, x, y and z is rounded once,
    /// each product is, and each of three sums and differences, none of which is greater than
    /// `|a x| + |b y| + |c| + |z|` by more than rounding. That makes 6 units of rounding at most
    /// for a product and 5 for c and z; fused operations round less often. Heights above the
    /// reference are rounded in double precision on the way, as the residual in double precision
    /// itself is, in proportion to the reference, too. 10 units cover what is left out here:
    /// rounding of rounded numbers, and of the bound itself.
    #[inline(always)]
    pub(super) fn fill(&mut self, [a, b, c]: [&[f64; MOST]; 3], len: usize, extent: &Extent) {
        let fine = UP * (16.0 * f64::EPSILON * extent.reference.abs()) as f32;
        for (rough, exact) in self.a[..len].iter_mut().zip(a) {
            *rough = *exact as f32;
        }
        for (rough, exact) in self.b[..len].iter_mut().zip(b) {
            *rough = *exact as f32;
        }
        for (rough, exact) in self.c[..len].iter_mut().zip(c) {
            *rough = (exact - extent.reference) as f32;
        }
        let slopes = self.a.iter().zip(&self.b).zip(&self.c);
        for (slack, ((a, b), c)) in self.slack[..len].iter_mut().zip(slopes) {
            let size = a.abs() * extent.x + b.abs() * extent.y + c.abs() + extent.z;
            // Numbers too small to be rounded in proportion: a few of the least.
            *slack = 10.0 * UNIT * size + fine + f32::MIN_POSITIVE;
        }
    }

    /// For each of the first `len` planes, how many of the samples (x, y, z) are surely farther from
    /// it than the limit; numbers of others mean nothing.
    #[inline(always)]
    pub(super) fn beyond<S: Simd>(
        &self,
        simd: S,
        len: usize,
        [x, y, z]: [&[f32]; 3],
        limit: f32,
        beyond: &mut [u32; MOST],
    ) {
        let lanes = |numbers| S::as_simd_f32s(numbers).0;
        let (a, b, c) = (lanes(&self.a), lanes(&self.b), lanes(&self.c));
        let slack = lanes(&self.slack);
        let beyond = S::as_mut_simd_u32s(beyond).0;
        let (limit, up) = (simd.splat_f32s(limit), simd.splat_f32s(UP));
        let (none, one) = (simd.splat_u32s(0), simd.splat_u32s(1));
        let vectors = len.div_ceil(S::F32_LANES).next_multiple_of(SIDE_BY_SIDE);
        for start in (0..vectors.min(beyond.len())).step_by(SIDE_BY_SIDE) {
            let vectors = [start, start + 1];
            let [a, b, c] = [a, b, c].map(|numbers| vectors.map(|k| numbers[k]));
            let limits = vectors.map(|k| simd.mul_f32s(up, simd.add_f32s(limit, slack[k])));
            let mut counts = [none; SIDE_BY_SIDE];
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                let [x, y, z] = [*x, *y, *z].map(|number| simd.splat_f32s(number));
                for k in 0..SIDE_BY_SIDE {
                    let residual = residual(simd, [a[k], b[k], c[k]], [x, y, z]);
                    let mask = simd.greater_than_f32s(simd.abs_f32s(residual), limits[k]);
                    counts[k] = simd.add_u32s(counts[k], simd.select_u32s(mask, one, none));
                }
            }
            beyond[start..start + SIDE_BY_SIDE].copy_from_slice(&counts);
        }
    }

    /// The same for one plane, samples side by side; those that fill no vector are left out.
    #[inline(always)]
    pub(super) fn beyond_one<S: Simd>(
        &self,
        simd: S,
        index: usize,
        [x, y, z]: [&[f32]; 3],
        limit: f32,
    ) -> u32 {
        let lanes = |numbers| S::as_simd_f32s(numbers).0;
        let [a, b, c] = [&self.a, &self.b, &self.c].map(|numbers| simd.splat_f32s(numbers[index]));
        let limit = simd.splat_f32s(UP * (limit + self.slack[index]));
        let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
        let mut beyond = zero;
        for ((x, y), z) in lanes(x).iter().zip(lanes(y)).zip(lanes(z)) {
            let residual = residual(simd, [a, b, c], [*x, *y, *z]);
            let is_beyond = simd.greater_than_f32s(simd.abs_f32s(residual), limit);
            beyond = simd.add_f32s(beyond, simd.select_f32s(is_beyond, one, zero));
        }
        simd.reduce_sum_f32s(beyond) as u32
    }

    /// A residual in single precision, and its slack.
    #[cfg(test)]
    pub(super) fn residual(&self, index: usize, [x, y, z]: [f32; 3]) -> (f32, f32) {
        let (a, b, c) = (self.a[index], self.b[index], self.c[index]);
        (z - c - a * x - b * y, self.slack[index])
    }
}

/// Fused where that is fast, which the slack covers either way.
#[inline(always)]
fn residual<S: Simd>(simd: S, [a, b, c]: [S::f32s; 3], [x, y, z]: [S::f32s; 3]) -> S::f32s {
    let above = simd.negate_mul_add_e_f32s(a, x, simd.sub_f32s(z, c));
    simd.negate_mul_add_e_f32s(b, y, above)
}
