//! Planes through triples of samples, solved side by side.

use super::window::Window;
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
    len: usize,
}

impl Default for Planes {
    fn default() -> Self {
        Self {
            a: [0.0; MOST],
            b: [0.0; MOST],
            c: [0.0; MOST],
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
    pub(super) fn draw(&mut self, window: &Window, number: usize, draws: &mut Draws) -> usize {
        let before = self.len;
        if number < FEW {
            self.draw_few(window, number, draws);
        } else {
            self.draw_lanes(window, number, draws);
        }
        self.len - before
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
            let [p, q, r] = draws.triple(window.len()).map(|k| window.sample(k as u32));
            if let Some(plane) = Plane::through_points(p, q, r, LEAST_SINE) {
                self.push(plane, true);
            }
        }
    }

    #[inline(always)]
    fn draw_lanes(&mut self, window: &Window, number: usize, draws: &mut Draws) {
        let triples = draws.triples::<LANES>(number, window.len() as u32);
        let mut points = [[[0.0; LANES]; 3]; 3];
        for (corner, indices) in points.iter_mut().zip(&triples) {
            for (lane, index) in indices.iter().enumerate() {
                let [x, y, z] = window.sample(*index);
                (corner[0][lane], corner[1][lane], corner[2][lane]) = (x, y, z);
            }
        }
        let [p, q, r] = &points;
        let (mut a, mut b, mut c) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut good = [false; LANES];
        // As in `Plane::through_points`, operation for operation.
        for l in 0..LANES {
            let (qx, qy, qz) = (q[0][l] - p[0][l], q[1][l] - p[1][l], q[2][l] - p[2][l]);
            let (rx, ry, rz) = (r[0][l] - p[0][l], r[1][l] - p[1][l], r[2][l] - p[2][l]);
            let cross = qx * ry - rx * qy;
            let lengths2 = (qx * qx + qy * qy) * (rx * rx + ry * ry);
            good[l] = cross * cross > LEAST_SINE * LEAST_SINE * lengths2;
            a[l] = (qz * ry - rz * qy) / cross;
            b[l] = (qx * rz - rx * qz) / cross;
            c[l] = p[2][l] - a[l] * p[0][l] - b[l] * p[1][l];
        }
        let end = self.len + LANES;
        if number == LANES && end <= MOST && good == [true; LANES] {
            self.a[self.len..end].copy_from_slice(&a);
            self.b[self.len..end].copy_from_slice(&b);
            self.c[self.len..end].copy_from_slice(&c);
            self.len = end;
            return;
        }
        for l in 0..number {
            let (a, b, c) = (a[l], b[l], c[l]);
            self.push(Plane { a, b, c }, good[l]);
        }
    }
}
