//! Planes through a window of samples.

use crate::neighbours::Neighbour;
use crate::solve::solve;

/// Triples are taken as collinear when the sine of their angle at the first sample is
/// below this: such a plane would magnify noise without bound.
pub(crate) const LEAST_SINE: f64 = 0.02;

/// `z = a dx + b dy + c`, with offsets from the node: `c` is z at the node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    pub(crate) a: f64,
    pub(crate) b: f64,
    pub(crate) c: f64,
}

impl Plane {
    /// `None` when the sine of the samples' angle at the first is `least_sine` or less.
    pub(crate) fn through(
        p: &Neighbour,
        q: &Neighbour,
        r: &Neighbour,
        least_sine: f64,
    ) -> Option<Self> {
        let point = |n: &Neighbour| [n.dx, n.dy, n.z];
        Self::through_points(point(p), point(q), point(r), least_sine)
    }

    /// The same through points (dx, dy, z).
    #[inline]
    pub(crate) fn through_points(
        [px, py, pz]: [f64; 3],
        [qx, qy, qz]: [f64; 3],
        [rx, ry, rz]: [f64; 3],
        least_sine: f64,
    ) -> Option<Self> {
        let (qx, qy, qz) = (qx - px, qy - py, qz - pz);
        let (rx, ry, rz) = (rx - px, ry - py, rz - pz);
        let cross = qx * ry - rx * qy;
        let lengths2 = (qx * qx + qy * qy) * (rx * rx + ry * ry);
        if cross * cross <= least_sine * least_sine * lengths2 {
            return None;
        }
        let a = (qz * ry - rz * qy) / cross;
        let b = (qx * rz - rx * qz) / cross;
        let c = pz - a * px - b * py;
        Some(Self { a, b, c })
    }

    /// Height of a sample above the plane.
    pub(crate) fn residual(&self, n: &Neighbour) -> f64 {
        n.z - self.at(n.dx, n.dy)
    }

    /// Its height at an offset from the node.
    #[inline(always)]
    pub(crate) fn at(&self, dx: f64, dy: f64) -> f64 {
        self.a * dx + self.b * dy + self.c
    }
}

/// Sums for a least-squares plane.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PlaneSums {
    one: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    z: f64,
    xz: f64,
    yz: f64,
}

impl From<[f64; 9]> for PlaneSums {
    /// Of weights, of weighted x, y, x x, x y, y y, z, x z and y z.
    fn from([one, x, y, xx, xy, yy, z, xz, yz]: [f64; 9]) -> Self {
        Self {
            one,
            x,
            y,
            xx,
            xy,
            yy,
            z,
            xz,
            yz,
        }
    }
}

impl PlaneSums {
    pub(crate) fn add(&mut self, x: f64, y: f64, z: f64, weight: f64) {
        let (wx, wy) = (weight * x, weight * y);
        self.one += weight;
        self.x += wx;
        self.y += wy;
        self.xx += wx * x;
        self.xy += wx * y;
        self.yy += wy * y;
        self.z += weight * z;
        self.xz += wx * z;
        self.yz += wy * z;
    }

    /// `None` where the samples are collinear.
    pub(crate) fn plane(&self) -> Option<Plane> {
        let matrix = [
            [self.one, 0.0, 0.0],
            [self.x, self.xx, 0.0],
            [self.y, self.xy, self.yy],
        ];
        let [c, a, b] = solve(matrix, [self.z, self.xz, self.yz])?;
        Some(Plane { a, b, c })
    }
}

/// A plane and how far inliers may lie from it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    pub(crate) plane: Plane,
    /// 2.5 robust standard deviations of the residuals.
    pub(crate) tolerance: f64,
}

impl Fit {
    /// The least-squares plane. `None` when the samples are collinear.
    pub(crate) fn least_squares(window: &[Neighbour]) -> Option<Self> {
        let number = window.len() as f64;
        if window.len() < 3 {
            return None;
        }
        let mean = |value: fn(&Neighbour) -> f64| window.iter().map(value).sum::<f64>() / number;
        let (mx, my, mz) = (mean(|n| n.dx), mean(|n| n.dy), mean(|n| n.z));
        let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for n in window {
            let (x, y, z) = (n.dx - mx, n.dy - my, n.z - mz);
            xx += x * x;
            xy += x * y;
            yy += y * y;
            xz += x * z;
            yz += y * z;
        }
        let determinant = xx * yy - xy * xy;
        if determinant <= LEAST_SINE * LEAST_SINE * xx * yy {
            return None;
        }
        let a = (xz * yy - yz * xy) / determinant;
        let b = (xx * yz - xy * xz) / determinant;
        let plane = Plane {
            a,
            b,
            c: mz - a * mx - b * my,
        };
        let squares: f64 = window
            .iter()
            .map(|n| plane.residual(n))
            .map(|r| r * r)
            .sum();
        Some(Self {
            plane,
            tolerance: INLIER_DEVIATIONS * (squares / (number - 3.0).max(1.0)).sqrt(),
        })
    }

    /// Tells inliers, which may always lie `floor` from the plane: in z, or square to it
    /// where samples are `dense`. On a steep surface that bends away z strays far within a
    /// spacing, but among lone outliers a steep plane joins anything.
    pub(crate) fn agrees(&self, floor: f64, dense: bool) -> impl Fn(&Neighbour) -> bool + use<> {
        let plane = self.plane;
        let slope2 = if dense {
            plane.a * plane.a + plane.b * plane.b
        } else {
            0.0
        };
        let tolerance = self.tolerance.max(floor * (1.0 + slope2).sqrt());
        move |n| plane.residual(n).abs() <= tolerance
    }
}

/// Standard deviations within which a residual is an inlier's.
const INLIER_DEVIATIONS: f64 = 2.5;

/// How far inliers lie from a plane with this median of squared residuals over a window of
/// this many samples: consistent at the normal distribution, with the usual correction for
/// small windows.
pub(crate) fn tolerance(median: f64, number: usize) -> f64 {
    let small = 1.0 + 5.0 / (number as f64 - 3.0).max(1.0);
    INLIER_DEVIATIONS * 1.4826 * small * median.sqrt()
}
