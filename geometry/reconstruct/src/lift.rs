//! Space curves: paths of the x-y plane carried onto a surface (equation 8).

use nurbs::{PatchSurface, PiecewiseCubic};

use crate::model::SPACE_CURVE_TOLERANCE_MM;

/// Most times a piece is halved to follow its surface.
const MAX_DEPTH: usize = 14;

/// The composition of a surface and a path, approximated by cubics over the same
/// parameter to [`SPACE_CURVE_TOLERANCE_MM`]; x and y are those of the path.
pub(crate) fn lift(surface: &PatchSurface, path: &PiecewiseCubic<2>) -> PiecewiseCubic<3> {
    let mut curve = PiecewiseCubic {
        breaks: vec![path.breaks.first().copied().unwrap_or(0.0)],
        pieces: Vec::new(),
    };
    for (k, piece) in path.pieces.iter().enumerate() {
        let width = path.breaks[k + 1] - path.breaks[k];
        let mut cuts = vec![0.0, width];
        crossings(&piece[0], width, &surface.u_breaks, &mut cuts);
        crossings(&piece[1], width, &surface.v_breaks, &mut cuts);
        cuts.sort_by(f64::total_cmp);
        let least = width * 1e-7;
        let mut from = 0.0;
        for (n, &to) in cuts.iter().enumerate().skip(1) {
            let last = n + 1 == cuts.len();
            if !last && (to - from < least || width - to < least) {
                continue;
            }
            let composed = Composed::new(surface, piece, (from + to) / 2.0);
            composed.follow(&mut curve, path.breaks[k], (from, to), MAX_DEPTH);
            from = to;
        }
        // The sum of the cuts must not move the break.
        if let Some(b) = curve.breaks.last_mut() {
            *b = path.breaks[k + 1];
        }
    }
    curve
}

fn value(c: &[f64; 4], s: f64) -> f64 {
    c[0] + s * (c[1] + s * (c[2] + s * c[3]))
}

fn slope(c: &[f64; 4], s: f64) -> f64 {
    c[1] + s * (2.0 * c[2] + s * 3.0 * c[3])
}

/// Adds the parameters inside `0..width` at which a cubic passes one of the breaks.
fn crossings(c: &[f64; 4], width: f64, breaks: &[f64], cuts: &mut Vec<f64>) {
    let mut turns = vec![0.0, width];
    let discriminant = c[2] * c[2] - 3.0 * c[1] * c[3];
    if discriminant > 0.0 {
        // The form of the roots that does not cancel.
        let q = -(c[2] + discriminant.sqrt().copysign(c[2]));
        for root in [q / (3.0 * c[3]), c[1] / q] {
            if root > 0.0 && root < width {
                turns.push(root);
            }
        }
    }
    turns.sort_by(f64::total_cmp);
    for pair in turns.windows(2) {
        let (a, b) = (value(c, pair[0]), value(c, pair[1]));
        let (low, high) = (a.min(b), a.max(b));
        let first = breaks.partition_point(|&v| v <= low);
        for &level in breaks[first..].iter().take_while(|&&v| v < high) {
            let (mut from, mut to) = (pair[0], pair[1]);
            for _ in 0..60 {
                let middle = (from + to) / 2.0;
                if (value(c, middle) < level) == (a < b) {
                    from = middle;
                } else {
                    to = middle;
                }
            }
            cuts.push((from + to) / 2.0);
        }
    }
}

/// A piece of a path on one patch.
struct Composed<'a> {
    piece: &'a [[f64; 4]; 2],
    patch: &'a [[f64; 4]; 4],
    corner: [f64; 2],
}

impl<'a> Composed<'a> {
    /// The patch is the one on which the path lies at parameter `at`.
    fn new(surface: &'a PatchSurface, piece: &'a [[f64; 4]; 2], at: f64) -> Self {
        let index = |breaks: &[f64], x: f64| {
            let after = breaks.partition_point(|&b| b <= x);
            after.saturating_sub(1).min(breaks.len() - 2)
        };
        let i = index(&surface.u_breaks, value(&piece[0], at));
        let j = index(&surface.v_breaks, value(&piece[1], at));
        Self {
            piece,
            patch: &surface.patches[i * (surface.v_breaks.len() - 1) + j],
            corner: [surface.u_breaks[i], surface.v_breaks[j]],
        }
    }

    fn local(&self, s: f64) -> [f64; 2] {
        [0, 1].map(|d| value(&self.piece[d], s) - self.corner[d])
    }

    fn z(&self, s: f64) -> f64 {
        let [u, v] = self.local(s);
        value(&self.patch.map(|row| value(&row, u)), v)
    }

    /// Derivative of z along the path.
    fn rise(&self, s: f64) -> f64 {
        let [u, v] = self.local(s);
        value(&self.patch.map(|row| slope(&row, u)), v) * slope(&self.piece[0], s)
            + slope(&self.patch.map(|row| value(&row, u)), v) * slope(&self.piece[1], s)
    }

    fn follow(
        &self,
        curve: &mut PiecewiseCubic<3>,
        offset: f64,
        (from, to): (f64, f64),
        depth: usize,
    ) {
        let width = to - from;
        let (z0, z1) = (self.z(from), self.z(to));
        let (d0, d1) = (self.rise(from), self.rise(to));
        let mean = (z1 - z0) / width;
        let z = [
            z0,
            d0,
            (3.0 * mean - 2.0 * d0 - d1) / width,
            (d0 + d1 - 2.0 * mean) / (width * width),
        ];
        let off = (1..8).map(|n| {
            let s = width * f64::from(n) / 8.0;
            (value(&z, s) - self.z(from + s)).abs()
        });
        // Sampling may miss the worst place, hence the half.
        if depth > 0 && off.fold(0.0, f64::max) > SPACE_CURVE_TOLERANCE_MM / 2.0 {
            let middle = (from + to) / 2.0;
            self.follow(curve, offset, (from, middle), depth - 1);
            self.follow(curve, offset, (middle, to), depth - 1);
            return;
        }
        let shifted = |c: &[f64; 4]| {
            [
                value(c, from),
                slope(c, from),
                c[2] + 3.0 * c[3] * from,
                c[3],
            ]
        };
        curve
            .pieces
            .push([shifted(&self.piece[0]), shifted(&self.piece[1]), z]);
        curve.breaks.push(offset + to);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_lies_on_the_surface() {
        let f = |u: f64, v: f64| 5.0 * libm::sin(0.3 * u) * libm::cos(0.2 * v);
        let (u, v) = (vec![0.0, 3.0, 6.0, 9.0], vec![0.0, 3.0, 6.0, 9.0]);
        let surface = PatchSurface::through_thirds(u, v, |i, j| f(i as f64, j as f64)).unwrap();
        let points = [[0.5, 0.5], [3.0, 6.0], [6.0, 5.0], [8.5, 8.5]];
        let path = PiecewiseCubic::through_thirds(0.0, 14.0, &points).unwrap();
        let curve = lift(&surface, &path);
        assert_eq!(curve.validate(), Ok(()));
        assert_eq!(curve.domain(), (0.0, 14.0));
        assert!(curve.pieces.len() < 80, "{}", curve.pieces.len());
        for k in 0..=1000 {
            let t = 0.014 * f64::from(k);
            let ([x, y, z], [px, py]) = (curve.evaluate(t), path.evaluate(t));
            assert!((x - px).abs() < 1e-9 && (y - py).abs() < 1e-9);
            assert!((z - surface.z(px, py)).abs() < SPACE_CURVE_TOLERANCE_MM);
        }
    }

    #[test]
    fn a_line_on_a_plane_is_one_piece() {
        let surface = PatchSurface::through_thirds(vec![0.0, 9.0], vec![0.0, 9.0], |i, j| {
            i as f64 - 2.0 * j as f64
        })
        .unwrap();
        let path = PiecewiseCubic::line([1.0, 2.0], [7.0, 8.0], 72.0_f64.sqrt()).unwrap();
        assert_eq!(lift(&surface, &path).pieces.len(), 1);
    }
}
