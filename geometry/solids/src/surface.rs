//! Surfaces that carry faces.

use core::f64::consts::{FRAC_PI_2, TAU};

use crate::spline::SplineSurface;
use crate::{Curve, Point};

/// Right-angled, right-handed axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Where they cross.
    pub origin_mm: Point,
    /// Unit directions.
    pub x: Point,
    /// The second one.
    pub y: Point,
    /// The third one, the axis of what has one.
    pub z: Point,
}

impl Frame {
    /// Axes of which the third has a direction, and the first is as near to another as can be;
    /// `None` where both are parallel, or no directions.
    #[must_use]
    pub fn new(origin_mm: Point, axis: &Point, towards: &Point) -> Option<Self> {
        let z = axis.try_normalize(0.0)?;
        let x = (towards - z * z.dot(towards)).try_normalize(1e-9 * towards.norm())?;
        Some(Self {
            origin_mm,
            x,
            y: z.cross(&x),
            z,
        })
    }

    pub(crate) fn coordinates(&self, point_mm: &Point) -> [f64; 3] {
        let from = point_mm - self.origin_mm;
        [self.x, self.y, self.z].map(|axis| axis.dot(&from))
    }

    /// Outwards from the axis at an angle, and along the circle there.
    fn around(&self, angle: f64) -> (Point, Point) {
        let (sine, cosine) = libm::sincos(angle);
        (
            self.x * cosine + self.y * sine,
            self.y * cosine - self.x * sine,
        )
    }
}

/// A surface in space. Its normal is the derivative in u times that in v.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// Parameters are millimetres along the first two axes.
    Plane(Frame),
    /// Parameters are the angle and the way along the axis.
    Cylinder {
        /// Its axis is the third.
        frame: Frame,
        /// Its radius.
        radius_mm: f64,
    },
    /// Parameters are the angle and the way along the axis, along which it opens.
    Cone {
        /// Its axis is the third.
        frame: Frame,
        /// Its radius at the origin.
        radius_mm: f64,
        /// Tangent of the angle between axis and surface.
        slope: f64,
    },
    /// Parameters are longitude and latitude.
    Sphere {
        /// The centre, and the axis to the pole.
        frame: Frame,
        /// Its radius.
        radius_mm: f64,
    },
    /// Parameters are the angle around the axis, and that around the tube.
    Torus {
        /// Its axis is the third.
        frame: Frame,
        /// Radius of the circle amid the tube.
        radius_mm: f64,
        /// Radius of the tube.
        tube_mm: f64,
    },
    /// A curve moved along a direction: its parameter, and the way in millimetres.
    Swept {
        /// The curve.
        curve: Curve,
        /// Unit direction.
        along: Point,
    },
    /// A curve turned about the third axis: the angle, and its parameter.
    Turned {
        /// The axis is the third.
        frame: Frame,
        /// The curve at angle zero.
        curve: Curve,
    },
    /// A spline.
    Spline(SplineSurface),
}

impl Surface {
    /// The point at parameters, and the derivatives there.
    #[must_use]
    pub fn at(&self, [u, v]: [f64; 2]) -> (Point, [Point; 2]) {
        match self {
            Self::Plane(frame) => (
                frame.origin_mm + frame.x * u + frame.y * v,
                [frame.x, frame.y],
            ),
            Self::Cylinder { frame, radius_mm } => {
                let (out, round) = frame.around(u);
                let at = frame.origin_mm + out * *radius_mm + frame.z * v;
                (at, [round * *radius_mm, frame.z])
            }
            Self::Cone {
                frame,
                radius_mm,
                slope,
            } => {
                let (out, round) = frame.around(u);
                let radius_mm = radius_mm + v * slope;
                let at = frame.origin_mm + out * radius_mm + frame.z * v;
                (at, [round * radius_mm, frame.z + out * *slope])
            }
            Self::Sphere { frame, radius_mm } => {
                let (out, round) = frame.around(u);
                let (sine, cosine) = libm::sincos(v);
                let at = frame.origin_mm + (out * cosine + frame.z * sine) * *radius_mm;
                let north = frame.z * cosine - out * sine;
                (at, [round * (radius_mm * cosine), north * *radius_mm])
            }
            Self::Torus {
                frame,
                radius_mm,
                tube_mm,
            } => {
                let (out, round) = frame.around(u);
                let (sine, cosine) = libm::sincos(v);
                let from_axis_mm = radius_mm + tube_mm * cosine;
                let at = frame.origin_mm + out * from_axis_mm + frame.z * (tube_mm * sine);
                let about = frame.z * cosine - out * sine;
                (at, [round * from_axis_mm, about * *tube_mm])
            }
            Self::Swept { curve, along } => {
                let (at, tangent) = curve.at(u);
                (at + along * v, [tangent, *along])
            }
            Self::Turned { frame, curve } => {
                let (at, tangent) = curve.at(v);
                let turned = |p: Point| {
                    let (out, round) = frame.around(u);
                    let [x, y, z] = [frame.x, frame.y, frame.z].map(|axis| axis.dot(&p));
                    out * x + round * y + frame.z * z
                };
                let from = turned(at - frame.origin_mm);
                let along_u = frame.z.cross(&from);
                (frame.origin_mm + from, [along_u, turned(tangent)])
            }
            Self::Spline(spline) => spline.at([u, v]),
        }
    }

    /// Of each parameter, after how much the surface comes back to where it was.
    #[must_use]
    pub(crate) fn periods(&self) -> [Option<f64>; 2] {
        match self {
            Self::Plane(_) => [None; 2],
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Sphere { .. } => [Some(TAU), None],
            Self::Torus { .. } => [Some(TAU); 2],
            Self::Swept { curve, .. } => [curve.period(), None],
            Self::Turned { curve, .. } => [Some(TAU), curve.period()],
            Self::Spline(spline) => [0, 1].map(|axis| {
                let (first, last) = spline.domain(axis);
                let (low, high) = spline.domain(1 - axis);
                let at = |own: f64, other: f64| {
                    let place = if axis == 0 {
                        [own, other]
                    } else {
                        [other, own]
                    };
                    spline.at(place).0
                };
                let middle = (first + last) / 2.0;
                let is_closed = (0..=8).all(|k| {
                    let other = low + (high - low) * f64::from(k) / 8.0;
                    let size_mm = (at(middle, other) - at(first, other)).norm();
                    (at(first, other) - at(last, other)).norm() <= 1e-6 * size_mm.max(1e-3)
                });
                is_closed.then_some(last - first)
            }),
        }
    }

    /// Of each parameter, what lies within its ends, where it has such.
    #[must_use]
    pub(crate) fn domain(&self) -> [Option<(f64, f64)>; 2] {
        match self {
            Self::Sphere { .. } => [None, Some((-FRAC_PI_2, FRAC_PI_2))],
            Self::Cone {
                radius_mm, slope, ..
            } => {
                let tip = -radius_mm / slope;
                if *slope > 0.0 {
                    [None, Some((tip, f64::INFINITY))]
                } else {
                    [None, Some((f64::NEG_INFINITY, tip))]
                }
            }
            Self::Swept { curve, .. } => [curve.domain(), None],
            Self::Turned { curve, .. } => [None, curve.domain()],
            Self::Spline(spline) => [Some(spline.domain(0)), Some(spline.domain(1))],
            _ => [None; 2],
        }
    }
}
