//! Planes through triples of samples, solved side by side.

use pulp::Simd;

use super::rough::RoughPlanes;
use super::window::{Extent, Window};
use crate::draws::Draws;
use crate::plane::{LEAST_SINE, Plane};

/// Planes solved side by side.
const LANES: usize = 8;
/// Planes held at a time.
pub(super) const MOST: usize = 64;
/// Fewer planes than this are solved one by one.
const FEW: usize = 4;

/// Planes in the order of the draws.
#[derive(Debug)]
pub(super) struct Planes {
    pub(super) a: [f64; MOST],
    pub(super) b: [f64; MOST],
    pub(super) c: [f64; MOST],
    pub(super) rough: RoughPlanes,
    len: usize,
}

impl Default for Planes {
    fn default() -> Self {
        Self {
            a: [0.0; MOST],
            b: [0.0; MOST],
            c: [0.0; MOST],
            rough: RoughPlanes::default(),
            len: 0,
        }
    }
}

impl Planes {
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) fn is_full(&self) -> bool {
        self.len == MOST
    }

    /// How many can be drawn at once.
    pub(super) fn room(&self) -> usize {
        (MOST - self.len).min(LANES)
    }

    #[inline(always)]
    pub(super) fn plane(&self, index: usize) -> Plane {
        Plane {
            a: self.a[index],
            b: self.b[index],
            c: self.c[index],
        }
    }

    /// Draws so many triples, no more than there is room for, and adds the planes of those that
    /// are not collinear. Says how many those are.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        window: &Window,
        number: usize,
        draws: &mut Draws,
    ) -> usize {
        let before = self.len;
        if number < FEW {
            self.draw_few(window, number, draws);
        } else {
            self.draw_lanes(simd, window, number, draws);
        }
        self.len - before
    }

    /// Makes all planes in single precision.
    #[inline(always)]
    pub(super) fn roughen(&mut self, extent: &Extent) {
        let Self {
            a,
            b,
            c,
            rough,
            len,
        } = self;
        rough.fill([a, b, c], *len, extent);
    }

    #[inline(always)]
    fn push(&mut self, plane: Plane, kept: bool) {
        let k = self.len % MOST;
        (self.a[k], self.b[k], self.c[k]) = (plane.a, plane.b, plane.c);
        self.len += usize::from(kept);
    }

    #[inline(never)]
    fn draw_few(&mut self, window: &Window, number: usize, draws: &mut Draws) {
        for _ in 0..number {
            let [p, q, r] = draws.triple(window.len()).map(|k| {
                let [x, y, z, _] = window.sample(k as u32);
                [x, y, z]
            });
            if let Some(plane) = Plane::through_points(p, q, r, LEAST_SINE) {
                self.push(plane, true);
            }
        }
    }

    #[inline(always)]
    fn draw_lanes<S: Simd>(&mut self, simd: S, window: &Window, number: usize, draws: &mut Draws) {
        let triples = draws.triples::<LANES>(number, window.len() as u32);
        let mut points = [[[0.0; LANES]; 3]; 3];
        for (corner, indices) in points.iter_mut().zip(&triples) {
            for (lane, index) in indices.iter().enumerate() {
                let [x, y, z, _] = window.sample(*index);
                (corner[0][lane], corner[1][lane], corner[2][lane]) = (x, y, z);
            }
        }
        let mut solved = [[0.0; LANES]; 3];
        let mut good = [0.0; LANES];
        solve(simd, &points, &mut solved, &mut good);
        let end = self.len + LANES;
        if number == LANES && end <= MOST && good == [1.0; LANES] {
            self.a[self.len..end].copy_from_slice(&solved[0]);
            self.b[self.len..end].copy_from_slice(&solved[1]);
            self.c[self.len..end].copy_from_slice(&solved[2]);
            self.len = end;
            return;
        }
        for l in 0..number {
            let [a, b, c] = [solved[0][l], solved[1][l], solved[2][l]];
            self.push(Plane { a, b, c }, good[l] > 0.0);
        }
    }
}

/// As [`Plane::through_points`], operation for operation; `good` is 1 where there is a plane.
#[inline(always)]
fn solve<S: Simd>(
    simd: S,
    points: &[[[f64; LANES]; 3]; 3],
    solved: &mut [[f64; LANES]; 3],
    good: &mut [f64; LANES],
) {
    let lanes = |numbers| S::as_simd_f64s(numbers).0;
    let (sub, mul) = (|a, b| simd.sub_f64s(a, b), |a, b| simd.mul_f64s(a, b));
    let minor = |a, b, c, d| sub(mul(a, b), mul(c, d));
    let length2 = |x, y| simd.add_f64s(mul(x, x), mul(y, y));
    let [a, b, c] = solved;
    let out = [a, b, c, good].map(|numbers| S::as_mut_simd_f64s(numbers).0);
    let [a, b, c, good] = out;
    let least = simd.splat_f64s(LEAST_SINE * LEAST_SINE);
    let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
    for k in 0..good.len() {
        let [[px, py, pz], q, r] = [0, 1, 2].map(|corner| {
            let point: &[[f64; LANES]; 3] = &points[corner];
            [
                lanes(&point[0])[k],
                lanes(&point[1])[k],
                lanes(&point[2])[k],
            ]
        });
        let (qx, qy, qz) = (sub(q[0], px), sub(q[1], py), sub(q[2], pz));
        let (rx, ry, rz) = (sub(r[0], px), sub(r[1], py), sub(r[2], pz));
        let cross = minor(qx, ry, rx, qy);
        let lengths2 = mul(length2(qx, qy), length2(rx, ry));
        let told = simd.less_than_f64s(mul(least, lengths2), mul(cross, cross));
        good[k] = simd.select_f64s(told, one, zero);
        a[k] = simd.div_f64s(minor(qz, ry, rz, qy), cross);
        b[k] = simd.div_f64s(minor(qx, rz, rx, qz), cross);
        c[k] = sub(sub(pz, mul(a[k], px)), mul(b[k], py));
    }
}
