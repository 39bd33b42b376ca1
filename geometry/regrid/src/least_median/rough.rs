//! Planes in single precision, and what rounding may do to residuals from them.

use super::planes::{MOST, Planes};
use super::window::{BLOCK, Block, Extent, UNIT, UP};

/// Planes counted side by side.
pub(super) const LANES: usize = 16;
const _: () = assert!(MOST.is_multiple_of(LANES));

/// Planes with heights above the window's reference. All slots are filled, also those that hold
/// no plane: their numbers mean nothing, and nobody asks.
pub(super) struct RoughPlanes {
    a: [f32; MOST],
    b: [f32; MOST],
    c: [f32; MOST],
    /// How much a residual in single precision may differ from the one in double precision.
    slack: [f32; MOST],
}

impl RoughPlanes {
    /// The bound: of the residual `z - c - a x - b y` each of a, b, c, x, y and z is rounded once,
    /// each product is, and each of three sums and differences, none of which is greater than
    /// `|a x| + |b y| + |c| + |z|` by more than rounding. That makes 6 units of rounding at most
    /// for a product and 5 for c and z; fused operations round less often. Heights above the
    /// reference are rounded in double precision on the way, as the residual in double precision
    /// itself is, in proportion to the reference, too. 10 units cover what is left out here:
    /// rounding of rounded numbers, and of the bound itself.
    #[inline(always)]
    pub(super) fn new(planes: &Planes, extent: &Extent) -> Self {
        let mut rough = Self {
            a: [0.0; MOST],
            b: [0.0; MOST],
            c: [0.0; MOST],
            slack: [0.0; MOST],
        };
        let fine = UP * (16.0 * f64::EPSILON * extent.reference.abs()) as f32;
        for start in (0..planes.len()).step_by(LANES) {
            for k in start..start + LANES {
                let (a, b) = (planes.a[k] as f32, planes.b[k] as f32);
                let c = (planes.c[k] - extent.reference) as f32;
                let size = a.abs() * extent.x + b.abs() * extent.y + c.abs() + extent.z;
                (rough.a[k], rough.b[k], rough.c[k]) = (a, b, c);
                // Numbers too small to be rounded in proportion: a few of the least.
                rough.slack[k] = 10.0 * UNIT * size + fine + f32::MIN_POSITIVE;
            }
        }
        rough
    }

    /// For the planes from `start` on, how many of the samples are surely farther from them than
    /// the limit.
    #[inline(always)]
    pub(super) fn beyond<const FUSED: bool>(
        &self,
        start: usize,
        samples: &[Block<f32>],
        limit: f32,
    ) -> [u32; LANES] {
        let lanes = |values: &[f32; MOST]| {
            let mut lanes = [0.0; LANES];
            lanes.copy_from_slice(&values[start..start + LANES]);
            lanes
        };
        let (a, b, c) = (lanes(&self.a), lanes(&self.b), lanes(&self.c));
        let limits = lanes(&self.slack).map(|slack| UP * (limit + slack));
        let mut beyond = [0; LANES];
        for block in samples {
            for ((x, y), z) in block.x.iter().zip(&block.y).zip(&block.z) {
                for l in 0..LANES {
                    let residual = residual::<FUSED>([a[l], b[l], c[l]], *x, *y, *z);
                    beyond[l] += u32::from(residual.abs() > limits[l]);
                }
            }
        }
        beyond
    }

    /// The same for one plane.
    #[inline(always)]
    pub(super) fn beyond_one<const FUSED: bool>(
        &self,
        index: usize,
        samples: &[Block<f32>],
        limit: f32,
    ) -> u32 {
        let plane = [self.a[index], self.b[index], self.c[index]];
        let limit = UP * (limit + self.slack[index]);
        let mut beyond = [0; BLOCK];
        for block in samples {
            for (k, beyond) in beyond.iter_mut().enumerate() {
                let residual = residual::<FUSED>(plane, block.x[k], block.y[k], block.z[k]);
                *beyond += u32::from(residual.abs() > limit);
            }
        }
        beyond.iter().sum()
    }

    #[cfg(test)]
    pub(super) fn residual(&self, index: usize, [x, y, z]: [f32; 3]) -> (f32, f32) {
        let plane = [self.a[index], self.b[index], self.c[index]];
        (residual::<false>(plane, x, y, z), self.slack[index])
    }
}

#[inline(always)]
fn residual<const FUSED: bool>([a, b, c]: [f32; 3], x: f32, y: f32, z: f32) -> f32 {
    if FUSED {
        (-b).mul_add(y, (-a).mul_add(x, z - c))
    } else {
        z - c - a * x - b * y
    }
}
