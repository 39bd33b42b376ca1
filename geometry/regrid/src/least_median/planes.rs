//! Planes through triples of samples, solved side by side in single precision.

use super::lanes::Lanes;
use super::rough::{Bounds, level, solve};
use super::window::{UP, Window};
use crate::draws::Draws;
use crate::plane::{LEAST_SINE, Plane};

/// Triples drawn side by side.
pub(super) const DRAWN: usize = 16;
/// Triples held at a time.
pub(super) const MOST: usize = 64;
/// Vectors of planes counted side by side, for as many samples to be had by one read.
const SIDE_BY_SIDE: usize = 2;

/// Triples in the order of the draws, and the planes through them.
#[derive(Debug)]
pub(super) struct Planes {
    /// Of each corner, which sample it is.
    triples: [[u32; MOST]; 3],
    a: [f32; MOST],
    b: [f32; MOST],
    c: [f32; MOST],
    /// How much a residual may differ from the one in double precision. Without end below 0 where
    /// there is no plane, above where it has to be looked at in double precision.
    slack: [f32; MOST],
    /// A multiple of [`DRAWN`].
    len: usize,
}

impl Default for Planes {
    fn default() -> Self {
        Self {
            triples: [[0; MOST]; 3],
            a: [0.0; MOST],
            b: [0.0; MOST],
            c: [0.0; MOST],
            slack: [0.0; MOST],
            len: 0,
        }
    }
}

impl Planes {
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn is_full(&self) -> bool {
        self.len == MOST
    }

    /// The plane of a slot in double precision.
    #[inline(always)]
    pub(super) fn plane(&self, window: &Window, slot: usize) -> Option<Plane> {
        let [p, q, r] = &self.triples;
        let (p, q, r) = (p[slot], q[slot], r[slot]);
        let (p, q, r) = (window.sample(p), window.sample(q), window.sample(r));
        Plane::through_points(p, q, r, LEAST_SINE)
    }

    /// Draws so many triples, [`DRAWN`] at most, and says how many of them span planes.
    #[inline(always)]
    pub(super) fn draw<L: Lanes>(
        &mut self,
        lanes: L,
        window: &Window,
        bounds: &Bounds,
        number: usize,
        draws: &mut Draws,
    ) -> usize {
        let start = self.len;
        let slots = start..start + DRAWN;
        let drawn = draws.triples::<DRAWN>(number, window.len() as u32);
        for (triples, drawn) in self.triples.iter_mut().zip(&drawn) {
            triples[slots.clone()].copy_from_slice(drawn);
        }
        self.len += DRAWN;
        let [p, q, r] = &drawn;
        let [p, q, r] = [p, q, r].map(|indices| L::as_simd_u32s(indices).0);
        let a = L::as_mut_simd_f32s(&mut self.a[slots.clone()]).0;
        let b = L::as_mut_simd_f32s(&mut self.b[slots.clone()]).0;
        let c = L::as_mut_simd_f32s(&mut self.c[slots.clone()]).0;
        let slack = L::as_mut_simd_f32s(&mut self.slack[slots]).0;
        let none = lanes.splat_f32s(f32::NEG_INFINITY);
        let (mut good, mut unsure) = (0_u32, 0_u32);
        let samples = window.rough();
        for (k, slack) in slack.iter_mut().enumerate() {
            let p = pick(lanes, samples, p[k]);
            let q = pick(lanes, samples, q[k]);
            let r = pick(lanes, samples, r[k]);
            let solved = solve(lanes, [p, q, r], bounds);
            (a[k], b[k], c[k]) = (solved.a, solved.b, solved.c);
            *slack = lanes.select_f32s(solved.good, solved.slack, none);
            let first = k * L::F32_LANES;
            good |= lanes.bits_m32s(solved.good) << first;
            let sure = lanes.or_m32s(solved.good, solved.bad);
            let all = u32::MAX >> (32 - L::F32_LANES);
            unsure |= (!lanes.bits_m32s(sure) & all) << first;
        }
        let wanted = u32::MAX >> (32 - number);
        if number < DRAWN {
            self.slack[start + number..start + DRAWN].fill(f32::NEG_INFINITY);
        }
        let mut planes = (good & wanted).count_ones() as usize;
        if unsure & wanted != 0 {
            planes += self.decide(window, start, unsure & wanted);
        }
        planes
    }

    /// Decides in double precision which of these slots hold planes. Those are left to be looked
    /// at in double precision again, whatever single precision says.
    #[cold]
    fn decide(&mut self, window: &Window, start: usize, unsure: u32) -> usize {
        let mut planes = 0;
        for slot in (start..start + DRAWN).filter(|slot| unsure >> (slot - start) & 1 == 1) {
            if self.plane(window, slot).is_some() {
                (self.a[slot], self.b[slot], self.c[slot]) = (0.0, 0.0, 0.0);
                self.slack[slot] = f32::INFINITY;
                planes += 1;
            }
        }
        planes
    }

    /// The planes to which so many samples may be nearer than the limit; all for which that is so
    /// are among them.
    #[inline(always)]
    pub(super) fn sift<L: Lanes>(
        &self,
        lanes: L,
        window: &Window,
        limit: f32,
        fewest: u32,
    ) -> Sifted {
        let ([x, y, z], len) = (window.rough(), window.len());
        let vectors = |numbers| L::as_simd_f32s(numbers).0;
        let (a, b, c) = (vectors(&self.a), vectors(&self.b), vectors(&self.c));
        let (slack, order) = (vectors(&self.slack), vectors(&ORDER));
        let (limit, up) = (lanes.splat_f32s(limit), lanes.splat_f32s(UP));
        let (none, one) = (lanes.splat_f32s(0.0), lanes.splat_f32s(1.0));
        let most = lanes.splat_f32s(MOST as f32);
        let fewest = lanes.splat_f32s(fewest as f32);
        let used = (self.len / L::F32_LANES).min(c.len());
        let (mut left, mut likeliest) = (0_u64, none);
        let (x, y, z) = (&x[..len], &y[..len], &z[..len]);
        for start in (0..used).step_by(SIDE_BY_SIDE) {
            let mut slopes = [[a[start], b[start]]; SIDE_BY_SIDE];
            let mut bounds = [[none; 2]; SIDE_BY_SIDE];
            for k in 0..SIDE_BY_SIDE {
                let vector = (start + k).min(used - 1);
                slopes[k] = [a[vector], b[vector]];
                let width = lanes.mul_f32s(up, lanes.add_f32s(limit, slack[vector]));
                bounds[k] = [
                    lanes.sub_f32s(c[vector], width),
                    lanes.add_f32s(c[vector], width),
                ];
            }
            let mut counts = [none; SIDE_BY_SIDE];
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                let sample = [
                    lanes.splat_f32s(*x),
                    lanes.splat_f32s(*y),
                    lanes.splat_f32s(*z),
                ];
                for k in 0..SIDE_BY_SIDE {
                    let level = level(lanes, slopes[k], sample);
                    let is_within = lanes.is_within(bounds[k], level);
                    let more = lanes.add_f32s(counts[k], one);
                    counts[k] = lanes.select_f32s(is_within, more, counts[k]);
                }
            }
            for (k, count) in counts.into_iter().enumerate() {
                let vector = (start + k).min(used - 1);
                let enough = lanes.less_than_or_equal_f32s(fewest, count);
                left |= u64::from(lanes.bits_m32s(enough)) << (vector * L::F32_LANES);
                let ordered = lanes.mul_add_e_f32s(count, most, order[vector]);
                likeliest = lanes.max_f32s(likeliest, ordered);
            }
        }
        let likeliest = MOST - 1 - lanes.reduce_max_f32s(likeliest) as usize % MOST;
        Sifted { left, likeliest }
    }

    /// The same for one slot, samples side by side.
    #[inline(always)]
    pub(super) fn within_one<L: Lanes>(
        &self,
        lanes: L,
        slot: usize,
        [x, y, z]: [&[f32]; 3],
        limit: f32,
    ) -> u32 {
        let width = UP * (limit + self.slack[slot]);
        let (lowest, highest) = (self.c[slot] - width, self.c[slot] + width);
        let slopes = [self.a[slot], self.b[slot]].map(|slope| lanes.splat_f32s(slope));
        let bounds = [lowest, highest].map(|bound| lanes.splat_f32s(bound));
        let vectors = |numbers| L::as_simd_f32s(numbers).0;
        let (x, y, z) = (vectors(x), vectors(y), vectors(z));
        let mut within = 0;
        for ((x, y), z) in x.iter().zip(y).zip(z) {
            let level = level(lanes, slopes, [*x, *y, *z]);
            within += lanes.bits_m32s(lanes.is_within(bounds, level)).count_ones();
        }
        within
    }

    #[cfg(test)]
    pub(super) fn has_plane(&self, slot: usize) -> bool {
        self.slack[slot] > f32::NEG_INFINITY
    }

    /// A residual in single precision, and its slack.
    #[cfg(test)]
    pub(super) fn residual(&self, slot: usize, sample: [f32; 3]) -> (f64, f32) {
        let slopes = [self.a[slot], self.b[slot]];
        let level = level(pulp::Scalar::new(), slopes, sample);
        (f64::from(level) - f64::from(self.c[slot]), self.slack[slot])
    }
}

/// What a rough look leaves.
pub(super) struct Sifted {
    /// A bit for each slot.
    pub(super) left: u64,
    /// The slot with most samples within the limit, the first of equal ones.
    pub(super) likeliest: usize,
}

/// Slots from the last to the first, for the greatest of what is counted to be the first of equal
/// ones.
const ORDER: [f32; MOST] = {
    let mut order = [0.0; MOST];
    let mut k = 0;
    while k < MOST {
        order[k] = (MOST - 1 - k) as f32;
        k += 1;
    }
    order
};

/// The samples at these indices. Every call has to become part of what is compiled for these
/// lanes, which closures handed on do not.
#[inline(always)]
fn pick<L: Lanes>(lanes: L, [x, y, z]: [&[f32]; 3], indices: L::u32s) -> [L::f32s; 3] {
    [
        lanes.pick(x, indices),
        lanes.pick(y, indices),
        lanes.pick(z, indices),
    ]
}
