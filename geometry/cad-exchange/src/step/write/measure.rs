//! Area and centroid of trimmed faces.
//!
//! By Green's theorem the integral of a function over a face is that of its antiderivative
//! in x along the loops. Both integrals are sums of Gauss rules over parts in which the
//! surface is smooth: the curves of the file are cut where they cross the borders of
//! patches.
//!
//! The edge of two faces lies between them. Readers trim each by the foot of the edge on it, so
//! what is between the edge and its foot counts, too.

use nurbs::{PatchSurface, PiecewiseCubic};
use reconstruct::{Model, Surface};

use crate::brep::{Topology, Use};

/// Abscissae and weights of Gauss's rule of six points over -1 to 1, one half of them
/// (Abramowitz & Stegun 1964, table 25.4).
const GAUSS_6: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_35),
];

/// Parts into which a loop is cut along the height of a patch.
const PARTS_PER_PATCH: f64 = 3.0;

/// Parts of a row of a patch for each unit by which its slope changes.
const PARTS_PER_SLOPE: f64 = 2.0;

/// Most parts of a row or a piece; wild surfaces are not worth more.
const MOST_PARTS: f64 = 64.0;

/// Area and its first moments.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Moments {
    pub(super) area_mm2: f64,
    /// Integrals of x, y and z, cubic millimetres.
    first_mm3: [f64; 3],
}

impl Moments {
    /// Of all faces together, within their edges.
    pub(super) fn of(model: &Model, topology: &Topology) -> Self {
        let mut sum = Self::default();
        for (face, loops) in model.faces.iter().zip(&topology.uses) {
            let Surface::Patches(surface) = &face.surface;
            for &Use { edge, forward } in loops.iter().flatten() {
                let curve = topology.edges[edge].directed(forward);
                sum.add_edge(surface, &curve);
            }
        }
        sum
    }

    pub(super) fn centroid_mm(&self) -> [f64; 3] {
        self.first_mm3.map(|moment| moment / self.area_mm2)
    }

    /// What an edge contributes to the integrals over a face that it bounds, which is on its left.
    fn add_edge(&mut self, surface: &PatchSurface, curve: &PiecewiseCubic<3>) {
        for (k, pair) in curve.breaks.windows(2).enumerate() {
            let width = pair[1] - pair[0];
            let middle = curve.piece_value(k, width / 2.0, 0)[1];
            let height = patch_height(surface, middle);
            let rise = curve.piece_value(k, width, 0)[1] - curve.piece_value(k, 0.0, 0)[1];
            let parts = (PARTS_PER_PATCH * rise.abs() / height).ceil();
            for (s, weight) in nodes(0.0, width, parts) {
                let [x, y, z] = curve.piece_value(k, s, 0);
                let [dx, dy, _] = curve.piece_value(k, s, 1);
                let [area, of_x, of_z] = row(surface, x, y);
                // To first order: the way to the foot, seen in x and y, is (on - z) n_z (n_x, n_y), and
                // of the surface there is 1 / n_z as much as is seen.
                let [n_x, n_y, _] = surface.normal(x, y);
                let on = surface.z(x, y);
                let beside = (on - z) * (n_x * dy - n_y * dx);
                self.area_mm2 += weight * (area * dy + beside);
                self.first_mm3[0] += weight * (of_x * dy + beside * x);
                self.first_mm3[1] += weight * y * (area * dy + beside);
                self.first_mm3[2] += weight * (of_z * dy + beside * on);
            }
        }
    }
}

fn index(breaks: &[f64], at: f64) -> usize {
    let after = breaks.partition_point(|&b| b <= at);
    after.saturating_sub(1).min(breaks.len().saturating_sub(2))
}

fn patch_height(surface: &PatchSurface, y: f64) -> f64 {
    let j = index(&surface.v_breaks, y);
    surface.v_breaks[j + 1] - surface.v_breaks[j]
}

/// Abscissae and weights of an integral from `a` to `b` in so many parts.
fn nodes(a: f64, b: f64, parts: f64) -> impl Iterator<Item = (f64, f64)> {
    let parts = if parts >= 1.0 {
        parts.min(MOST_PARTS)
    } else {
        1.0
    };
    let half = (b - a) / parts / 2.0;
    (0..parts as usize).flat_map(move |part| {
        let middle = a + half * (2 * part + 1) as f64;
        GAUSS_6
            .iter()
            .flat_map(move |&(x, weight)| [-x, x].map(|x| (middle + half * x, half * weight)))
    })
}

/// Integrals of 1, x and z over the surface's strip at height `y`, from its left side to
/// `x`, each times the length of the normal (-dz/dx, -dz/dy, 1).
fn row(surface: &PatchSurface, x: f64, y: f64) -> [f64; 3] {
    let rows = surface.v_breaks.len() - 1;
    let j = index(&surface.v_breaks, y);
    let t = y - surface.v_breaks[j];
    let last = index(&surface.u_breaks, x);
    let mut sum = [0.0; 3];
    for i in 0..=last {
        let from = surface.u_breaks[i];
        let to = if i == last {
            x
        } else {
            surface.u_breaks[i + 1]
        };
        let [p, q, r, s] = &surface.patches[i * rows + j];
        let height: [f64; 4] = core::array::from_fn(|k| p[k] + t * (q[k] + t * (r[k] + t * s[k])));
        let tilt: [f64; 4] = core::array::from_fn(|k| q[k] + t * (2.0 * r[k] + t * 3.0 * s[k]));
        let slopes = |s: f64| {
            let along = height[1] + s * (2.0 * height[2] + s * 3.0 * height[3]);
            let across = tilt[0] + s * (tilt[1] + s * (tilt[2] + s * tilt[3]));
            (along, across)
        };
        let width = to - from;
        let (a, b, c) = (slopes(0.0), slopes(width / 2.0), slopes(width));
        let change = (a.0 - b.0).abs() + (b.0 - c.0).abs() + (a.1 - b.1).abs() + (b.1 - c.1).abs();
        for (s, weight) in nodes(0.0, width, (PARTS_PER_SLOPE * change).ceil()) {
            let (along, across) = slopes(s);
            let element = weight * (1.0 + along * along + across * across).sqrt();
            let z = height[0] + s * (height[1] + s * (height[2] + s * height[3]));
            sum[0] += element;
            sum[1] += element * (from + s);
            sum[2] += element * z;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_a_parabolic_cylinder() {
        // z = x^2 / 40: the length of a row has a closed form.
        let breaks = vec![0.0, 1.0, 20.0, 100.0];
        let surface = PatchSurface::through_thirds(breaks.clone(), vec![0.0, 5.0], |i, _| {
            let piece = (i / 3).min(2);
            let x =
                breaks[piece] + (breaks[piece + 1] - breaks[piece]) * (i - 3 * piece) as f64 / 3.0;
            x * x / 40.0
        })
        .unwrap();
        for x in [0.5, 1.0, 17.0, 60.0, 100.0] {
            let slope: f64 = x / 20.0;
            let root = (1.0 + slope * slope).sqrt();
            let length = 0.5 * (x * root + 20.0 * slope.asinh());
            let of_x = 400.0 / 3.0 * (root * root * root - 1.0);
            let [got, got_x, _] = row(&surface, x, 2.0);
            assert!((got / length - 1.0).abs() < 1e-9, "{x}: {got} {length}");
            assert!((got_x / of_x - 1.0).abs() < 1e-9, "{x}: {got_x} {of_x}");
        }
    }

    #[test]
    fn an_edge_off_the_face_bounds_it_by_its_foot() {
        // A slope of 3 in 4 from x = 0 to 20, whose right edge is lifted by 0.1 along the normal.
        let (u, v) = (vec![0.0, 10.0, 20.0], vec![0.0, 10.0]);
        let height = |i: usize, _| 0.75 * 10.0 * i as f64 / 3.0;
        let slope = PatchSurface::through_thirds(u, v, height).unwrap();
        let lifted = |y: f64| [20.0 - 0.06, y, 15.0 + 0.08];
        let corners = [[0.0; 3], lifted(0.0), lifted(10.0), [0.0, 10.0, 0.0]];
        let mut sum = Moments::default();
        for (k, start) in corners.into_iter().enumerate() {
            let edge = PiecewiseCubic::line(start, corners[(k + 1) % 4], 1.0).unwrap();
            sum.add_edge(&slope, &edge);
        }
        assert!((sum.area_mm2 - 250.0).abs() < 1e-9, "{}", sum.area_mm2);
        for (got, expected) in sum.centroid_mm().into_iter().zip([10.0, 5.0, 7.5]) {
            // The moments of the strip beside the edge are taken at the edge: second order.
            assert!((got - expected).abs() < 1e-4, "{got} {expected}");
        }
    }

    #[test]
    fn the_rule_is_exact_for_polynomials_of_degree_eleven() {
        let sum: f64 = nodes(0.0, 2.0, 1.0).map(|(x, w)| w * x.powi(11)).sum();
        assert!((sum / (4096.0 / 12.0) - 1.0).abs() < 1e-14, "{sum}");
    }
}
