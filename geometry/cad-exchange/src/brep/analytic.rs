//! Surfaces that formats know by their numbers: cylinders, cones, spheres and tori (in STEP
//! `elementary_surface` of ISO 10303-42, in IGES 5.3 entities 192 to 198).
//!
//! Their parameters run around axes, so each has a seam where they begin anew. It is put on the
//! side that a face leaves free; one that leaves none free stays a spline.

use nalgebra::Vector3;
use reconstruct::{Face, Loop};
use shapes::Shape;

/// A face keeps so far from the seam and the poles of its surface, radians.
const CLEAR_RAD: f64 = 0.1;

/// A cone is placed where it has at least this radius, millimetres: its apex belongs to no face.
const LEAST_RADIUS_MM: f64 = 1e-3;

/// Places of each piece of an edge at which its distance from the surface is taken.
const PROBES: usize = 4;

/// A surface by its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Analytic {
    pub(crate) shape: Shape,
    pub(crate) origin_mm: [f64; 3],
    pub(crate) axis: [f64; 3],
    /// Towards the seam, square to the axis.
    pub(crate) x: [f64; 3],
    /// Radii, millimetres: of a cone that at its origin, of a torus that of the tube last.
    pub(crate) lengths_mm: Vec<f64>,
    /// The half angle of a cone, radians.
    pub(crate) angle_rad: Option<f64>,
    /// The surface's own normal, outwards, is that of the face.
    pub(crate) same_sense: bool,
}

impl Analytic {
    /// The surface of a face whose shape is known, if its edges lie within `most_mm` of it.
    pub(super) fn of(face: &Face, most_mm: f64) -> Option<Self> {
        let shape = face.shape.as_ref()?;
        let places = places(face);
        let off = places.iter().map(|p| shape.distance_mm(p).abs());
        let gap_mm = off.fold(0.0, f64::max);
        if gap_mm.is_nan() || gap_mm > most_mm {
            return None;
        }
        let around = |centre: &Vector3<f64>, axis: &Vector3<f64>| Around::of(&places, centre, axis);
        let (origin, axis, seam, lengths_mm, angle_rad, is_hollow) = match shape {
            Shape::Plane(_) => return None,
            Shape::Cylinder(c) => {
                let around = around(&c.point_mm, &c.axis)?;
                let lengths = vec![c.radius_mm];
                (c.point_mm, c.axis, around.seam, lengths, None, c.is_hollow)
            }
            Shape::Cone(c) => {
                let around = around(&c.apex_mm, &c.axis)?;
                let up_mm = around.up_mm.iter().sum::<f64>() / around.up_mm.len() as f64;
                let radius_mm = up_mm * libm::tan(c.half_angle_rad);
                if radius_mm.is_nan() || radius_mm < LEAST_RADIUS_MM {
                    return None;
                }
                let origin = c.apex_mm + c.axis * up_mm;
                let (lengths, angle) = (vec![radius_mm], Some(c.half_angle_rad));
                (origin, c.axis, around.seam, lengths, angle, c.is_hollow)
            }
            Shape::Sphere(s) => {
                // An axis across the face, so that the poles lie beside it.
                let out = mean(places.iter().map(|p| p - s.centre_mm))?;
                let axis = across(&out);
                let around = around(&s.centre_mm, &axis)?;
                let highest = libm::cos(CLEAR_RAD) * s.radius_mm;
                if around.up_mm.iter().any(|up| up.abs() > highest) {
                    return None;
                }
                let lengths = vec![s.radius_mm];
                (s.centre_mm, axis, around.seam, lengths, None, s.is_hollow)
            }
            Shape::Torus(t) => {
                if t.tube_mm >= t.radius_mm {
                    return None;
                }
                let around = around(&t.centre_mm, &t.axis)?;
                // The seam of the tube is its outermost circle.
                let both = around.up_mm.iter().zip(&around.out_mm);
                let mut angles = both.map(|(up, out)| libm::atan2(*up, out - t.radius_mm));
                if angles.any(|angle| angle.abs() < CLEAR_RAD) {
                    return None;
                }
                let lengths = vec![t.radius_mm, t.tube_mm];
                (t.centre_mm, t.axis, around.seam, lengths, None, t.is_hollow)
            }
        };
        Some(Self {
            shape: *shape,
            origin_mm: origin.into(),
            axis: axis.into(),
            x: seam.into(),
            lengths_mm,
            angle_rad,
            same_sense: !is_hollow,
        })
    }
}

/// Places of a face's border, seen from an axis.
struct Around {
    /// Unit vector square to the axis that points away from the face.
    seam: Vector3<f64>,
    /// How far along the axis each place lies, and how far off it.
    up_mm: Vec<f64>,
    out_mm: Vec<f64>,
}

impl Around {
    /// `None` where the border comes near the seam, or goes around the axis.
    fn of(places: &[Vector3<f64>], centre: &Vector3<f64>, axis: &Vector3<f64>) -> Option<Self> {
        let up_mm: Vec<f64> = places.iter().map(|p| (p - centre).dot(axis)).collect();
        let off: Vec<Vector3<f64>> = places
            .iter()
            .zip(&up_mm)
            .map(|(p, up)| p - centre - axis * *up)
            .collect();
        let seam = -mean(off.iter().map(|off| off.normalize()))?;
        let farthest = libm::cos(CLEAR_RAD);
        let is_clear = |off: &Vector3<f64>| off.normalize().dot(&seam) < farthest;
        off.iter().all(is_clear).then(|| Self {
            seam,
            out_mm: off.iter().map(Vector3::norm).collect(),
            up_mm,
        })
    }
}

/// The direction of a mean; `None` where there is none to speak of.
fn mean(vectors: impl ExactSizeIterator<Item = Vector3<f64>>) -> Option<Vector3<f64>> {
    let count = vectors.len() as f64;
    let mean = vectors.sum::<Vector3<f64>>() / count;
    mean.try_normalize(1e-6)
}

/// A unit vector square to another, near y.
fn across(to: &Vector3<f64>) -> Vector3<f64> {
    let y = if to.y.abs() < 0.9 {
        Vector3::y()
    } else {
        Vector3::x()
    };
    (y - to * to.dot(&y)).normalize()
}

/// Places all along the loops of a face.
fn places(face: &Face) -> Vec<Vector3<f64>> {
    let loops = core::iter::once(&face.outer).chain(&face.inner);
    let curves = loops.flat_map(|border: &Loop| border.coedges.iter().map(|c| &c.space_curve));
    let mut places = Vec::new();
    for curve in curves {
        for (k, ends) in curve.breaks.windows(2).enumerate() {
            let at = |n: usize| (ends[1] - ends[0]) * n as f64 / PROBES as f64;
            places.extend((0..=PROBES).map(|n| Vector3::from(curve.piece_value(k, at(n), 0))));
        }
    }
    places
}
