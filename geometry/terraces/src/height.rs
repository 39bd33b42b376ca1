//! The surfaces that a part's top is made of, each a height over the plan.

use std::sync::Arc;

use nurbs::BSplineSurface;

use crate::plan::{P2, Support, add, cross, distance, dot, left, norm, scale, sub};

/// Nearer to the rim of a round than this counts as on it, millimetres: heights there change
/// without bound along the plan.
const RIM_MM: f64 = 1e-7;

/// A height over the plan, millimetres.
#[derive(Debug, Clone)]
pub(crate) enum Height {
    Level {
        z: f64,
    },
    /// `z + slope . (x, y)`.
    Plane {
        z: f64,
        slope: P2,
    },
    /// A cone around a vertical axis: `z + slope * distance from c`.
    Cone {
        c: P2,
        z: f64,
        slope: f64,
    },
    /// A tube of radius `r` around a horizontal circle of radius `ring` at `z`, its upper (1) or
    /// lower (-1) half; a sphere where the ring is a point.
    Ring {
        c: P2,
        ring: f64,
        z: f64,
        r: f64,
        side: f64,
    },
    /// A cylinder around a horizontal line at `z`, its upper or lower half.
    Bar {
        p: P2,
        d: P2,
        z: f64,
        r: f64,
        side: f64,
    },
    /// Heights whose parameters are x and y.
    Spline(Arc<BSplineSurface<1>>),
}

impl Height {
    pub(crate) fn at(&self, q: P2) -> f64 {
        match *self {
            Self::Level { z } => z,
            Self::Plane { z, slope } => z + dot(slope, q),
            Self::Cone { c, z, slope } => z + slope * distance(q, c),
            Self::Ring {
                c,
                ring,
                z,
                r,
                side,
            } => z + side * half_circle(r, distance(q, c) - ring),
            Self::Bar { p, d, z, r, side } => z + side * half_circle(r, cross(d, sub(q, p))),
            Self::Spline(ref spline) => {
                let ((u0, u1), (v0, v1)) = (spline.u_knots().domain(), spline.v_knots().domain());
                spline.evaluate(q[0].clamp(u0, u1), q[1].clamp(v0, v1))[0]
            }
        }
    }

    /// Distance of a point in space from the surface, to first order where it is a spline.
    pub(crate) fn off(&self, q: [f64; 3]) -> f64 {
        let plan = [q[0], q[1]];
        match *self {
            Self::Ring { c, ring, z, r, .. } => {
                (libm::hypot(distance(plan, c) - ring, q[2] - z) - r).abs()
            }
            Self::Bar { p, d, z, r, .. } => {
                (libm::hypot(cross(d, sub(plan, p)), q[2] - z) - r).abs()
            }
            _ => (q[2] - self.at(plan)).abs(),
        }
    }

    /// The same surface within a distance.
    pub(crate) fn is(&self, other: &Self, tolerance_mm: f64) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() < tolerance_mm;
        let fine = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let same = |a: P2, b: P2| distance(a, b) < 1e-9;
        match (self, other) {
            (Self::Level { z }, Self::Level { z: w }) => near(*z, *w),
            (Self::Plane { z, slope }, Self::Plane { z: w, slope: t }) => {
                fine(*z, *w) && same(*slope, *t)
            }
            (
                Self::Cone { c, z, slope },
                Self::Cone {
                    c: e,
                    z: w,
                    slope: t,
                },
            ) => same(*c, *e) && fine(*z, *w) && fine(*slope, *t),
            (
                Self::Ring {
                    c,
                    ring,
                    z,
                    r,
                    side,
                },
                Self::Ring {
                    c: e,
                    ring: o,
                    z: w,
                    r: s,
                    side: t,
                },
            ) => same(*c, *e) && fine(*ring, *o) && fine(*z, *w) && fine(*r, *s) && side == t,
            (
                Self::Bar { p, d, z, r, side },
                Self::Bar {
                    p: q,
                    d: e,
                    z: w,
                    r: s,
                    side: t,
                },
            ) => {
                let on = cross(*d, sub(*q, *p)).abs() < 1e-9 && cross(*d, *e).abs() < 1e-9;
                on && fine(*z, *w) && fine(*r, *s) && side == t
            }
            (Self::Spline(a), Self::Spline(b)) => a == b,
            _ => false,
        }
    }

    /// The axis around which a face of it may run all round.
    pub(crate) fn axis(&self) -> Option<P2> {
        match *self {
            Self::Cone { c, .. } | Self::Ring { c, .. } => Some(c),
            _ => None,
        }
    }

    /// Where both are as high, if that is along lines and circles; `None` if it is not, or not known.
    pub(crate) fn crossing(&self, other: &Self) -> Option<Vec<Support>> {
        match (self, other) {
            (Self::Level { z }, Self::Plane { z: w, slope })
            | (Self::Plane { z: w, slope }, Self::Level { z }) => Some(plane_zero(w - z, *slope)?),
            (Self::Plane { z, slope }, Self::Plane { z: w, slope: t }) => {
                Some(plane_zero(z - w, sub(*slope, *t))?)
            }
            (Self::Level { z }, Self::Cone { c, z: w, slope })
            | (Self::Cone { c, z: w, slope }, Self::Level { z }) => {
                Some(circles(*c, &[(z - w) / slope]))
            }
            (
                Self::Cone { c, z, slope },
                Self::Cone {
                    c: e,
                    z: w,
                    slope: t,
                },
            ) if distance(*c, *e) < 1e-9 => Some(circles(*c, &[(w - z) / (slope - t)])),
            (
                Self::Level { z },
                Self::Ring {
                    c,
                    ring,
                    z: w,
                    r,
                    side,
                },
            )
            | (
                Self::Ring {
                    c,
                    ring,
                    z: w,
                    r,
                    side,
                },
                Self::Level { z },
            ) => {
                let up = side * (z - w);
                let off = half_circle(*r, up);
                let is_met = up > 0.0 && up < *r;
                Some(if is_met {
                    circles(*c, &[ring - off, ring + off])
                } else {
                    Vec::new()
                })
            }
            (
                Self::Level { z },
                Self::Bar {
                    p,
                    d,
                    z: w,
                    r,
                    side,
                },
            )
            | (
                Self::Bar {
                    p,
                    d,
                    z: w,
                    r,
                    side,
                },
                Self::Level { z },
            ) => {
                let up = side * (z - w);
                let off = half_circle(*r, up);
                let line = |off: f64| Support::Line {
                    p: add(*p, scale(left(*d), off)),
                    d: *d,
                };
                let is_met = up > 0.0 && up < *r;
                Some(if is_met {
                    vec![line(-off), line(off)]
                } else {
                    Vec::new()
                })
            }
            _ => None,
        }
    }

    /// A field in the plan whose divergence is the height: what flows out of a region is the
    /// integral over it. Of tubes it may not hold the axis.
    pub(crate) fn flux(&self, q: P2) -> P2 {
        match *self {
            Self::Level { z } => scale(q, 0.5 * z),
            Self::Plane { z, slope } => {
                // z / 2 (x, y) and a x^2 / 2 along x, b y^2 / 2 along y.
                let along = [0.5 * slope[0] * q[0] * q[0], 0.5 * slope[1] * q[1] * q[1]];
                add(scale(q, 0.5 * z), along)
            }
            Self::Cone { c, z, slope } => {
                let from = sub(q, c);
                scale(from, 0.5 * z + slope * norm(from) / 3.0)
            }
            Self::Ring {
                c,
                ring,
                z,
                r,
                side,
            } => {
                let from = sub(q, c);
                let rho = norm(from);
                let s = (rho - ring).clamp(-r, r);
                // The integral of half_circle(s) (ring + s) ds, from the axis where it is a sphere.
                let height = half_circle(r, s);
                let start = if ring == 0.0 { r * r * r / 3.0 } else { 0.0 };
                let first = start - height * height * height / 3.0;
                let sum = side * (ring * segment(r, s) + first);
                let rest = if rho > 0.0 {
                    sum / (rho * rho)
                } else {
                    0.5 * side * r
                };
                scale(from, 0.5 * z + rest)
            }
            Self::Bar { p, d, z, r, side } => {
                let s = cross(d, sub(q, p)).clamp(-r, r);
                add(scale(q, 0.5 * z), scale(left(d), side * segment(r, s)))
            }
            Self::Spline(ref spline) => {
                let (from, to) = spline.u_knots().domain();
                let to = q[0].clamp(from, to);
                let breaks = spline.u_knots().breaks();
                let sum: f64 = breaks
                    .windows(2)
                    .filter(|pair| pair[0] < to)
                    .map(|pair| {
                        let end = pair[1].min(to);
                        let half = 0.5 * (end - pair[0]);
                        let terms = GAUSS.iter().map(|&(x, weight)| {
                            let x = pair[0] + half * (1.0 + x);
                            half * weight * self.at([x, q[1]])
                        });
                        terms.sum::<f64>()
                    })
                    .sum();
                [sum, 0.0]
            }
        }
    }
}

/// Abscissae and weights of Gauss's rule of five points over -1 to 1 (Abramowitz & Stegun 1964,
/// table 25.4).
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Height of a circle of radius `r` at `s` from its middle.
fn half_circle(r: f64, s: f64) -> f64 {
    let s = s.abs();
    if s > r - RIM_MM {
        return 0.0;
    }
    ((r - s) * (r + s)).sqrt()
}

/// The integral of [`half_circle`] from 0 to `s`.
fn segment(r: f64, s: f64) -> f64 {
    0.5 * (s * half_circle(r, s) + r * r * libm::asin((s / r).clamp(-1.0, 1.0)))
}

/// The line where `z + slope . q` is 0.
fn plane_zero(z: f64, slope: P2) -> Option<Vec<Support>> {
    let steep = norm(slope);
    if steep < 1e-12 {
        return None;
    }
    let n = scale(slope, 1.0 / steep);
    let p = scale(n, -z / steep);
    Some(vec![Support::Line { p, d: left(n) }])
}

fn circles(c: P2, radii: &[f64]) -> Vec<Support> {
    let real = radii.iter().filter(|r| r.is_finite() && **r > 1e-3);
    real.map(|&r| Support::Circle { c, r }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nurbs::KnotVector;

    #[test]
    fn what_flows_out_of_a_square_is_what_is_under_the_surface() {
        let knots = || KnotVector::uniform(3, 4, -10.0, 20.0).unwrap();
        let points = (0..49).map(|k| [2.0 + 0.1 * f64::from(k % 7) - 0.05 * f64::from(k / 7)]);
        let spline = BSplineSurface::new(knots(), knots(), points.collect()).unwrap();
        let heights = [
            Height::Level { z: 2.5 },
            Height::Plane {
                z: 1.0,
                slope: [0.2, -0.3],
            },
            Height::Cone {
                c: [1.5, 2.0],
                z: 1.0,
                slope: 0.7,
            },
            Height::Ring {
                c: [-3.0, 1.0],
                ring: 6.0,
                z: 2.0,
                r: 4.0,
                side: -1.0,
            },
            Height::Ring {
                c: [1.4, 2.2],
                ring: 0.0,
                z: 2.0,
                r: 4.0,
                side: 1.0,
            },
            Height::Bar {
                p: [1.0, 1.0],
                d: [0.6, 0.8],
                z: 3.0,
                r: 5.0,
                side: -1.0,
            },
            Height::Spline(Arc::new(spline)),
        ];
        let corners = [[1.0, 1.0], [3.0, 1.0], [3.0, 4.0], [1.0, 4.0]];
        for height in heights {
            let n = 300;
            let mut sum = 0.0;
            for i in 0..n {
                for j in 0..n {
                    let place =
                        |k: i32, width: f64| 1.0 + width * (f64::from(k) + 0.5) / f64::from(n);
                    sum += height.at([place(i, 2.0), place(j, 3.0)]) * 6.0 / f64::from(n * n);
                }
            }
            let mut flow = 0.0;
            for k in 0..4 {
                let (a, b) = (corners[k], corners[(k + 1) % 4]);
                for part in 0..20 {
                    for (x, weight) in GAUSS {
                        let t = (f64::from(part) + 0.5 + 0.5 * x) / 20.0;
                        let q = add(a, scale(sub(b, a), t));
                        flow += weight / 40.0 * cross(height.flux(q), sub(b, a));
                    }
                }
            }
            assert!(
                (flow - sum).abs() < 2e-4 * sum.abs(),
                "{height:?}: {flow} {sum}"
            );
        }
    }
}
