//! Parameters of points on surfaces.

use core::f64::consts::TAU;

use crate::spline::{spread, spread_in_spans};
use crate::{Curve, Frame, Point, Surface, wrapped};

/// Rounds of Newton's method, and halvings of a step that leads away.
const ROUNDS: usize = 30;
const SHORTER: usize = 12;
/// Places looked at before it in each span of a spline surface for each degree, along curves that
/// are no splines, and from how many of them it begins at most: the nearest one may lie on another
/// bend.
const PER_DEGREE: usize = 3;
const ALONG: usize = 32;
const BEGINNINGS: usize = 5;
/// How near, millimetres, is near enough.
const NEAR_MM: f64 = 1e-6;
/// Derivative, as a share of the other one, at which a parameter tells nothing.
pub(crate) const STILL: f64 = 1e-6;

/// A point's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) at: [f64; 2],
    /// Which of them are free, since the surface has one point for all their values, as at a pole.
    pub(crate) is_free: [bool; 2],
}

/// A surface of which parameters can be asked for.
#[derive(Debug)]
pub(crate) struct Inverse<'a> {
    surface: &'a Surface,
    /// Of a spline some points with their parameters; of what is made by a curve, points of that.
    known: Vec<([f64; 2], Point)>,
    /// So many of them are beside each other along the second parameter.
    width: usize,
}

fn spread_along(curve: &Curve) -> Vec<f64> {
    match curve {
        Curve::Line { .. } => vec![0.0],
        Curve::Ellipse { .. } => spread(0.0, TAU, ALONG).collect(),
        Curve::Spline(spline) => spline.places(),
    }
}

/// Way from an axis, along it, and the angle around it.
fn around(frame: &Frame, point_mm: &Point) -> (f64, f64, f64) {
    let [x, y, z] = frame.coordinates(point_mm);
    (libm::hypot(x, y), z, libm::atan2(y, x))
}

impl<'a> Inverse<'a> {
    pub(crate) fn new(surface: &'a Surface) -> Self {
        let mut width = 1;
        let known = match surface {
            Surface::Spline(spline) => {
                let [us, vs] = [0, 1].map(|axis| {
                    spread_in_spans(&spline.breaks(axis), PER_DEGREE * spline.degree(axis))
                });
                width = vs.len();
                let places = us.iter().flat_map(|u| vs.iter().map(move |v| [*u, *v]));
                places.map(|at| (at, spline.at(at).0)).collect()
            }
            Surface::Swept { curve, .. } => {
                let of = |t: f64| ([t, 0.0], curve.at(t).0);
                spread_along(curve).into_iter().map(of).collect()
            }
            Surface::Turned { curve, .. } => {
                let of = |t: f64| ([0.0, t], curve.at(t).0);
                spread_along(curve).into_iter().map(of).collect()
            }
            _ => Vec::new(),
        };
        Self {
            surface,
            known,
            width,
        }
    }

    /// The parameters of a point on the surface, or near to it.
    pub(crate) fn place(&self, point_mm: &Point) -> Place {
        let at = match self.surface {
            Surface::Plane(frame) => {
                let [x, y, _] = frame.coordinates(point_mm);
                [x, y]
            }
            Surface::Cylinder { frame, .. } | Surface::Cone { frame, .. } => {
                let (_, z, angle) = around(frame, point_mm);
                [angle, z]
            }
            Surface::Sphere { frame, .. } => {
                let (from_axis, z, angle) = around(frame, point_mm);
                [angle, libm::atan2(z, from_axis)]
            }
            Surface::Torus {
                frame, radius_mm, ..
            } => {
                let (from_axis, z, angle) = around(frame, point_mm);
                [angle, libm::atan2(z, from_axis - radius_mm)]
            }
            Surface::Swept { along, .. } => {
                let aside = |p: &Point| {
                    let from = point_mm - p;
                    (from - along * along.dot(&from)).norm_squared()
                };
                self.best(aside, point_mm, |at, p| [at[0], along.dot(&(point_mm - p))])
            }
            Surface::Turned { frame, .. } => {
                let (from_axis, z, angle) = around(frame, point_mm);
                let off = |p: &Point| {
                    let (r, h, _) = around(frame, p);
                    (r - from_axis).powi(2) + (h - z).powi(2)
                };
                self.best(off, point_mm, |at, p| [angle - around(frame, p).2, at[1]])
            }
            Surface::Spline(_) => {
                self.best(|p| (p - point_mm).norm_squared(), point_mm, |at, _| at)
            }
        };
        let (_, along) = self.surface.at(at);
        let speed = along.map(|d| d.norm());
        let is_free =
            [0, 1].map(|axis| speed[axis] <= STILL * speed[1 - axis].max(f64::MIN_POSITIVE));
        let mut at = at;
        for axis in 0..2 {
            // Rounding must leave no gap between a pole and the border of the plane.
            if is_free[axis]
                && let Some((first, last)) = self.surface.domain()[1 - axis]
            {
                let own = &mut at[1 - axis];
                let end = if *own - first < last - *own {
                    first
                } else {
                    last
                };
                if (*own - end).abs() <= STILL * end.abs().max(1.0) {
                    *own = end;
                }
            }
        }
        Place { at, is_free }
    }

    /// The place nearest to a point that known ones lead to, from the least off of those that are
    /// less off than all beside them.
    fn best(
        &self,
        off: impl Fn(&Point) -> f64,
        point_mm: &Point,
        begin: impl Fn([f64; 2], &Point) -> [f64; 2],
    ) -> [f64; 2] {
        let offs: Vec<f64> = self.known.iter().map(|(_, p)| off(p)).collect();
        let is_least = |k: &usize| {
            let column = k % self.width;
            let before = (column > 0).then(|| k - 1);
            let after = (column + 1 < self.width).then(|| k + 1);
            let beside = [
                before,
                after,
                k.checked_sub(self.width),
                Some(k + self.width),
            ];
            let mut beside = beside.into_iter().flatten().filter_map(|j| offs.get(j));
            beside.all(|other| offs[*k] <= *other)
        };
        let mut least: Vec<usize> = (0..offs.len()).filter(is_least).collect();
        least.sort_by(|a, b| offs[*a].total_cmp(&offs[*b]));
        least.truncate(BEGINNINGS);
        let mut best = (f64::INFINITY, [0.0; 2]);
        for k in least {
            let (at, p) = self.known[k];
            let at = self.improved(begin(at, &p), point_mm);
            let off_mm = (self.surface.at(at).0 - point_mm).norm();
            if off_mm < best.0 {
                best = (off_mm, at);
            }
            if off_mm <= NEAR_MM {
                break;
            }
        }
        best.1
    }

    /// Parameters led to the nearest point.
    fn improved(&self, mut at: [f64; 2], point_mm: &Point) -> [f64; 2] {
        let periods = self.surface.periods();
        let domain = self.surface.domain();
        for _ in 0..ROUNDS {
            let (p, [du, dv]) = self.surface.at(at);
            let off = point_mm - p;
            let (uu, uv, vv) = (du.norm_squared(), du.dot(&dv), dv.norm_squared());
            let (bu, bv) = (du.dot(&off), dv.dot(&off));
            let determinant = uu * vv - uv * uv;
            let step = if determinant > 1e-12 * uu * vv {
                [
                    (bu * vv - bv * uv) / determinant,
                    (bv * uu - bu * uv) / determinant,
                ]
            } else if uu > vv {
                [bu / uu, 0.0]
            } else if vv > 0.0 {
                [0.0, bv / vv]
            } else {
                break;
            };
            let next = |share: f64| {
                [0, 1].map(|axis| {
                    let next = at[axis] + share * step[axis];
                    match (domain[axis], periods[axis]) {
                        (Some((first, _)), Some(period)) => wrapped(next, first, period),
                        (Some((first, last)), None) => next.clamp(first, last),
                        (None, _) => next,
                    }
                })
            };
            // On a bend a whole step may lead away.
            let off_mm = |at: [f64; 2]| (point_mm - self.surface.at(at).0).norm();
            let shares = core::iter::successors(Some(1.0), |share| Some(share / 2.0));
            let mut tried = shares.take(SHORTER).map(next);
            let Some(better) = tried.find(|next| off_mm(*next) < off.norm()) else {
                break;
            };
            at = better;
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Knots, SplineCurve, SplineSurface};

    fn frame() -> Frame {
        let axis = Point::new(0.3, -0.2, 0.9);
        Frame::new(Point::new(4.0, -7.0, 11.0), &axis, &Point::x()).unwrap()
    }

    fn profile() -> Curve {
        let points = [
            [9.0, 0.0, 0.0],
            [14.0, 0.0, 5.0],
            [8.0, 0.0, 10.0],
            [12.0, 0.0, 16.0],
        ];
        let in_frame = points.map(|[x, _, z]| frame().origin_mm + frame().x * x + frame().z * z);
        let values = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let knots = Knots { degree: 3, values };
        Curve::Spline(SplineCurve::new(&knots, &in_frame, &[1.0, 2.0, 0.5, 1.0]).unwrap())
    }

    #[test]
    fn parameters_of_points_of_every_surface_are_found() {
        let wavy: Vec<Point> = (0..5)
            .flat_map(|i| (0..6).map(move |j| (f64::from(i), f64::from(j))))
            .map(|(i, j)| Point::new(8.0 * i, 6.0 * j, 4.0 * libm::sin(i + 0.7 * j)))
            .collect();
        // The first ones are no more equal than any others.
        let knots = |count: i32| Knots {
            degree: 3,
            values: (-3..=count)
                .map(|k| f64::from(k) / f64::from(count - 3))
                .collect(),
        };
        let weights: Vec<f64> = (0..30).map(|k| 1.0 + 0.1 * f64::from(k % 4)).collect();
        let spline = SplineSurface::new(&[knots(5), knots(6)], &wavy, &weights).unwrap();
        let (frame, radius_mm) = (frame(), 12.0);
        let surfaces = [
            Surface::Plane(frame),
            Surface::Cylinder { frame, radius_mm },
            Surface::Cone {
                frame,
                radius_mm,
                slope: 0.4,
            },
            Surface::Sphere { frame, radius_mm },
            Surface::Torus {
                frame,
                radius_mm,
                tube_mm: 3.0,
            },
            Surface::Swept {
                curve: profile(),
                along: frame.y,
            },
            Surface::Turned {
                frame,
                curve: profile(),
            },
            Surface::Spline(spline),
        ];
        for surface in &surfaces {
            let inverse = Inverse::new(surface);
            for k in 0..40 {
                let at = [0.02 + 0.024 * f64::from(k), 0.97 - 0.023 * f64::from(k)];
                let (p, along) = surface.at(at);
                let found = inverse.place(&p);
                assert_eq!(found.is_free, [false; 2]);
                for axis in 0..2 {
                    let off_mm = (found.at[axis] - at[axis]).abs() * along[axis].norm();
                    assert!(off_mm < 1e-9, "{surface:?} {at:?} {found:?}");
                }
                // Derivatives agree with differences.
                let step = 1e-6;
                for (axis, moved) in [[at[0] + step, at[1]], [at[0], at[1] + step]]
                    .into_iter()
                    .enumerate()
                {
                    let difference = (surface.at(moved).0 - p) / step;
                    assert!(
                        (difference - along[axis]).norm() < 1e-3,
                        "{surface:?} {axis}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_point_on_a_sharp_bend_is_found() {
        let points: Vec<Point> = (0..12)
            .map(|k| Point::new(f64::from(k), 40.0 * f64::from(k % 2), 0.0))
            .collect();
        let mut values = vec![0.0; 4];
        values.extend((1..9).map(f64::from));
        values.extend([9.0; 4]);
        let knots = Knots { degree: 3, values };
        let curve = Curve::Spline(SplineCurve::new(&knots, &points, &[1.0; 12]).unwrap());
        let surface = Surface::Swept {
            curve,
            along: Point::z(),
        };
        let inverse = Inverse::new(&surface);
        for k in 0..400 {
            let at = [0.01 + 0.0224 * f64::from(k), 3.0];
            let found = inverse.place(&surface.at(at).0);
            assert!((found.at[0] - at[0]).abs() < 1e-7, "{at:?} {found:?}");
        }
    }

    #[test]
    fn at_a_pole_and_a_tip_the_angle_is_free() {
        let frame = frame();
        let sphere = Surface::Sphere {
            frame,
            radius_mm: 5.0,
        };
        let pole = frame.origin_mm + frame.z * 5.0;
        assert_eq!(Inverse::new(&sphere).place(&pole).is_free, [true, false]);
        let cone = Surface::Cone {
            frame,
            radius_mm: 5.0,
            slope: 0.5,
        };
        let tip = frame.origin_mm - frame.z * 10.0;
        assert_eq!(Inverse::new(&cone).place(&tip).is_free, [true, false]);
    }
}
