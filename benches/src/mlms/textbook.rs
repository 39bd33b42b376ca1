//! Least median of squares as a textbook has it: draw, solve, square, sort. What our kernel is
//! measured against, so it stays as it is; it may not call anything of the product.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Sines of the angle at a triple's first sample below which it is drawn again.
const LEAST_SINE: f64 = 0.02;
/// Draws for each plane at most.
const DRAWS: usize = 8;

/// The plane `z = a x + b y + c` of the least median of squared residuals, and that median.
pub(crate) fn least_median(
    samples: &[[f64; 3]],
    planes: usize,
    seed: u64,
) -> Option<([f64; 3], f64)> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(key(seed));
    let mut best: Option<([f64; 3], f64)> = None;
    let mut tried = 0;
    for _ in 0..planes * DRAWS {
        if tried == planes {
            break;
        }
        let triple = draw(&mut generator, samples.len()).map(|index| samples[index]);
        let Some(plane) = solve(triple) else {
            continue;
        };
        tried += 1;
        let mut squares: Vec<f64> = samples
            .iter()
            .map(|[x, y, z]| {
                let residual = plane[0] * x + plane[1] * y + plane[2] - z;
                residual * residual
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        let median = squares[(squares.len() - 1) / 2];
        if best.is_none_or(|(_, least)| median < least) {
            best = Some((plane, median));
        }
    }
    best
}

/// The plane through three samples; `None` of collinear ones.
fn solve(triple: [[f64; 3]; 3]) -> Option<[f64; 3]> {
    let [p, q, r] = triple;
    let (qx, qy) = (q[0] - p[0], q[1] - p[1]);
    let (rx, ry) = (r[0] - p[0], r[1] - p[1]);
    let cross = qx * ry - rx * qy;
    if cross.abs() <= LEAST_SINE * ((qx * qx + qy * qy) * (rx * rx + ry * ry)).sqrt() {
        return None;
    }
    // Gauss-Jordan elimination with row pivots.
    let mut m = triple.map(|[x, y, z]| [x, y, 1.0, z]);
    for k in 0..3 {
        let pivot = (k..3).max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs()))?;
        m.swap(k, pivot);
        for row in 0..3 {
            if row != k {
                let factor = m[row][k] / m[k][k];
                let pivot = m[k];
                for (value, above) in m[row].iter_mut().zip(pivot) {
                    *value -= factor * above;
                }
            }
        }
    }
    Some([0, 1, 2].map(|k| m[k][3] / m[k][k]))
}

/// Three distinct indices, in the way of the product, so that answers can be compared.
fn draw(generator: &mut Xoshiro256PlusPlus, number: usize) -> [usize; 3] {
    let random = generator.next_u64();
    let below = |shift: u32, limit: usize| {
        let part = (random >> shift) & ((1 << 21) - 1);
        ((part * limit as u64) >> 21) as usize
    };
    let first = below(0, number);
    let mut second = below(21, number - 1);
    second += usize::from(second >= first);
    let mut third = below(42, number - 2);
    third += usize::from(third >= first.min(second));
    third += usize::from(third >= first.max(second));
    [first, second, third]
}

/// The seed of node (0, 0) in a scan with this seed.
fn key(seed: u64) -> u64 {
    mix(mix(seed ^ mix(0)))
}

/// The finaliser of SplitMix64.
fn mix(key: u64) -> u64 {
    let key = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let key = (key ^ (key >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let key = (key ^ (key >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    key ^ (key >> 31)
}
