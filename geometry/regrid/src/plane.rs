//! Planes through a window of samples.

use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::solve::solve;

/// Triples are taken as collinear when the sine of their angle at the first sample is
/// below this: such a plane would magnify noise without bound.
pub(crate) const LEAST_SINE: f64 = 0.02;
/// Collinear triples are drawn again, up to this many draws for each plane wanted.
const DRAWS_PER_PLANE: usize = 8;

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
        let (qx, qy, qz) = (q.dx - p.dx, q.dy - p.dy, q.z - p.z);
        let (rx, ry, rz) = (r.dx - p.dx, r.dy - p.dy, r.z - p.z);
        let cross = qx * ry - rx * qy;
        let lengths2 = (qx * qx + qy * qy) * (rx * rx + ry * ry);
        if cross * cross <= least_sine * least_sine * lengths2 {
            return None;
        }
        let a = (qz * ry - rz * qy) / cross;
        let b = (qx * rz - rx * qz) / cross;
        let c = p.z - a * p.dx - b * p.dy;
        Some(Self { a, b, c })
    }

    /// Height of a sample above the plane.
    pub(crate) fn residual(&self, n: &Neighbour) -> f64 {
        n.z - self.at(n.dx, n.dy)
    }

    /// Its height at an offset from the node.
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

/// Finds planes; keeps its buffers from node to node.
#[derive(Debug, Default)]
pub(crate) struct PlaneFinder {
    dx: Vec<f64>,
    dy: Vec<f64>,
    z: Vec<f64>,
    squares: Vec<f64>,
}

impl PlaneFinder {
    /// The plane with the least median of squared residuals over the window (equation 2),
    /// of `planes` drawn; of equal ones the first drawn. `None` when the window's samples
    /// are collinear, as far as the draws show.
    pub(crate) fn least_median(
        &mut self,
        window: &[Neighbour],
        planes: usize,
        draws: &mut Draws,
    ) -> Option<Fit> {
        let number = window.len();
        if number < 3 {
            return None;
        }
        self.load(window);
        // The median of an even number is the lower one: at a node between two surfaces that
        // share its window equally, each then beats the planes that join them.
        let middle = (number - 1) / 2;
        let mut best: Option<(f64, Plane)> = None;
        let mut tried = 0;
        for _ in 0..planes.saturating_mul(DRAWS_PER_PLANE) {
            if tried == planes {
                break;
            }
            let [p, q, r] = draws.triple(number);
            let Some(plane) = Plane::through(&window[p], &window[q], &window[r], LEAST_SINE) else {
                continue;
            };
            tried += 1;
            let limit = best.map_or(f64::INFINITY, |(median, _)| median);
            // Only if more than `middle` squares lie below the best median so far can this
            // plane's median, the square with `middle` below it, do so: an exact test that
            // spares most selections.
            if self.square_residuals(&plane, limit) <= middle {
                continue;
            }
            let median = *self
                .squares
                .select_nth_unstable_by(middle, f64::total_cmp)
                .1;
            best = Some((median, plane));
        }
        let (median, plane) = best?;
        Some(Fit {
            plane,
            tolerance: tolerance(median, number),
        })
    }

    /// The least-squares plane. `None` when the samples are collinear.
    pub(crate) fn least_squares(&mut self, window: &[Neighbour]) -> Option<Fit> {
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
        Some(Fit {
            plane,
            tolerance: INLIER_DEVIATIONS * (squares / (number - 3.0).max(1.0)).sqrt(),
        })
    }

    fn load(&mut self, window: &[Neighbour]) {
        self.dx.clear();
        self.dy.clear();
        self.z.clear();
        self.dx.extend(window.iter().map(|n| n.dx));
        self.dy.extend(window.iter().map(|n| n.dy));
        self.z.extend(window.iter().map(|n| n.z));
        self.squares.resize(window.len(), 0.0);
    }

    /// Fills in the squared residuals and counts those below the limit. One plain loop over
    /// separate arrays, for the compiler to vectorise.
    fn square_residuals(&mut self, plane: &Plane, limit: f64) -> usize {
        let mut below = 0;
        for (((square, dx), dy), z) in self
            .squares
            .iter_mut()
            .zip(&self.dx)
            .zip(&self.dy)
            .zip(&self.z)
        {
            let residual = z - (plane.a * dx + plane.b * dy + plane.c);
            *square = residual * residual;
            below += usize::from(*square < limit);
        }
        below
    }
}
