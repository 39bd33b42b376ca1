//! Surfaces that formats know by a curve and what sweeps it: of linear extrusion and of revolution
//! (in STEP `swept_surface` of ISO 10303-42, in IGES 5.3 entities 122 and 120).

use std::sync::Arc;

use nalgebra::Vector3;
use nurbs::PiecewiseCubic;
use reconstruct::Face;
use shapes::{Motion, Swept};

use super::analytic::{Around, loops};
use super::bend::bent;

/// An extrusion goes on beyond its face by this share of the face's length.
const BEYOND: f64 = 0.1;

/// A face of a revolution keeps so far from the axis, millimetres.
const LEAST_RADIUS_MM: f64 = 1e-3;

/// A surface by its profile.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Generated {
    pub(crate) swept: Arc<Swept>,
    pub(crate) by: By,
}

/// How the profile is swept.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum By {
    /// From its place so far, and as far as that.
    Shift {
        from_mm: Vector3<f64>,
        along_mm: Vector3<f64>,
    },
    /// All around.
    Turn {
        /// Towards the seam, square to the axis.
        x: Vector3<f64>,
        /// Two of the face's loops go around the axis: it is to be cut open between them.
        is_ring: bool,
    },
}

impl Generated {
    /// The surface of a face of this form, if its border lies within the profile and keeps clear of
    /// seam and axis.
    pub(super) fn of(face: &Face, swept: &Arc<Swept>) -> Option<Self> {
        let loops = loops(face);
        let sweep = &swept.sweep;
        let (first, last) = swept.profile.domain();
        let places = || loops.iter().flatten();
        let is_within = |place: &Vector3<f64>| {
            let s_mm = sweep.place(place).s_mm;
            first < s_mm && s_mm < last
        };
        if !places().all(is_within) {
            return None;
        }
        let by = match sweep.motion {
            Motion::Extrusion => {
                let along = |place: &Vector3<f64>| (place - sweep.origin_mm).dot(&sweep.axis);
                let low = places().map(along).fold(f64::INFINITY, f64::min);
                let high = places().map(along).fold(f64::NEG_INFINITY, f64::max);
                let beyond = BEYOND * (high - low);
                By::Shift {
                    from_mm: sweep.axis * (low - beyond),
                    along_mm: sweep.axis * (high - low + 2.0 * beyond),
                }
            }
            Motion::Revolution => {
                let around = Around::of(&loops, &sweep.origin_mm, &sweep.axis)?;
                if around.out_mm.iter().any(|out| *out < LEAST_RADIUS_MM) {
                    return None;
                }
                By::Turn {
                    x: around.seam,
                    is_ring: around.is_ring,
                }
            }
        };
        Some(Self {
            swept: Arc::clone(swept),
            by,
        })
    }

    /// The curve that is swept, in such a sense that the surface's normal is that of the face: the
    /// velocity of the motion follows the tangent of an extruded curve, as STEP and IGES have it, and
    /// comes before that of a turned one, as STEP has it.
    pub(crate) fn curve(&self) -> PiecewiseCubic<3> {
        match &self.by {
            By::Shift { from_mm, .. } => {
                // Whatever the direction: an extrusion has but one profile.
                let mut curve = self.swept.generatrix(from_mm);
                for piece in &mut curve.pieces {
                    for (coordinate, by) in piece.iter_mut().zip(from_mm) {
                        coordinate[0] += by;
                    }
                }
                curve
            }
            By::Turn { x, .. } => {
                let curve = self.swept.generatrix(x);
                // Along the axis the tangent leads that way for what is seen from without, outwards
                // for what is seen from below.
                if self.swept.sweep.is_flat() == self.swept.is_hollow {
                    curve.reversed()
                } else {
                    curve
                }
            }
        }
    }

    /// The curve of the surface that lies in the half-plane with its axis and its seam, between two
    /// points of it.
    pub(super) fn meridian(&self, [from, to]: [[f64; 3]; 2]) -> Option<PiecewiseCubic<3>> {
        let By::Turn { x, .. } = &self.by else {
            return None;
        };
        let [begin, end] = [from, to].map(|at| self.swept.sweep.place(&at.into()).s_mm);
        let curve = self.swept.generatrix(x);
        let part = curve.restricted(begin.min(end), begin.max(end))?;
        let part = if begin < end { part } else { part.reversed() };
        Some(bent(&part, from, to))
    }
}
