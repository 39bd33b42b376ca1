//! How little time there could be: operations counted by hand, at the rate at which the processor
//! does nothing else.

use std::hint::black_box;
use std::sync::OnceLock;

use pulp::{Arch, Simd, WithSimd};

use crate::timing::seconds;

/// Lanes of single precision in the 256 bits that operations are counted in.
const COUNTED_LANES: f64 = 8.0;
/// Chains of fused products that do not wait for each other: enough for two units of a latency of
/// five.
const CHAINS: usize = 12;
const STEPS: u32 = 2_000_000;
const TURNS: usize = 5;

/// Operations of 256 bits that the kernel of MLMS cannot do without, as `docs/performance.md` counts
/// them: for each candidate 28 and three quarters of one for each sample; 350 for the window and
/// two medians.
pub(crate) fn least_median(samples: usize, planes: usize) -> f64 {
    planes as f64 * (28.0 + 0.75 * samples as f64) + 350.0
}

/// Nanoseconds that so many operations of 256 bits take at least.
pub(crate) fn ns(operations: f64) -> f64 {
    static RATE: OnceLock<f64> = OnceLock::new();
    operations / RATE.get_or_init(operations_per_ns)
}

/// Fused products of 256 bits in a nanosecond; one of wider registers counts for as many.
fn operations_per_ns() -> f64 {
    let arch = Arch::new();
    let mut lanes = 0;
    let fastest_s = (0..TURNS)
        .map(|_| seconds(|| lanes = arch.dispatch(Chains)))
        .fold(f64::INFINITY, f64::min);
    let products = f64::from(STEPS) * CHAINS as f64 * lanes as f64 / COUNTED_LANES;
    1e-9 * products / fastest_s
}

/// Multiplies and adds in chains, and gives the number of lanes.
struct Chains;

impl WithSimd for Chains {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let (factor, term) = (simd.splat_f32s(0.999), simd.splat_f32s(1e-3));
        let mut chains = [simd.splat_f32s(0.5); CHAINS];
        for _ in 0..STEPS {
            for chain in &mut chains {
                *chain = simd.mul_add_e_f32s(*chain, factor, term);
            }
        }
        for chain in chains {
            black_box(simd.reduce_sum_f32s(chain));
        }
        S::F32_LANES
    }
}
