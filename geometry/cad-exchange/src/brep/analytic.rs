//! Surfaces that formats know by their numbers: cylinders, cones, spheres and tori (in STEP
//! `elementary_surface` of ISO 10303-42, in IGES 5.3 entities 192 to 198).
//!
//! Their parameters run around axes, so each has a seam where they begin anew. It is put on the
//! side that a face leaves free. A ring, between two loops that both go around, leaves none free: it
//! is cut open along its seam.

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
    /// Two of its loops go around the axis: it is to be cut open between them.
    pub(crate) is_ring: bool,
}

impl Analytic {
    /// The surface of a face whose shape is known, if its border keeps clear of seam and poles.
    pub(super) fn of(face: &Face) -> Option<Self> {
        let shape = face.form.as_ref()?.shape()?;
        let loops = loops(face);
        let places: Vec<Vector3<f64>> = loops.iter().flatten().copied().collect();
        let around = |centre: &Vector3<f64>, axis: &Vector3<f64>| Around::of(&loops, centre, axis);
        let (origin, axis, around, lengths_mm, angle_rad, is_hollow) = match shape {
            Shape::Plane(_) => return None,
            Shape::Cylinder(c) => {
                let around = around(&c.point_mm, &c.axis)?;
                let lengths = vec![c.radius_mm];
                (c.point_mm, c.axis, around, lengths, None, c.is_hollow)
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
                (origin, c.axis, around, lengths, angle, c.is_hollow)
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
                (s.centre_mm, axis, around, lengths, None, s.is_hollow)
            }
            Shape::Torus(t) => {
                if t.tube_mm >= t.radius_mm {
                    return None;
                }
                let around = around(&t.centre_mm, &t.axis)?;
                let both = around.up_mm.iter().zip(&around.out_mm);
                let angles = both.map(|(up, out)| libm::atan2(*up, out - t.radius_mm));
                if widest_gap(angles.collect())? < 2.0 * CLEAR_RAD {
                    return None;
                }
                let lengths = vec![t.radius_mm, t.tube_mm];
                (t.centre_mm, t.axis, around, lengths, None, t.is_hollow)
            }
        };
        Some(Self {
            shape: *shape,
            origin_mm: origin.into(),
            axis: axis.into(),
            x: around.seam.into(),
            lengths_mm,
            angle_rad,
            same_sense: !is_hollow,
            is_ring: around.is_ring,
        })
    }
}

/// Places of a face's border, seen from an axis.
pub(super) struct Around {
    /// Unit vector square to the axis that points away from the face, if it is no ring.
    pub(super) seam: Vector3<f64>,
    /// Two loops go around the axis, one each way.
    pub(super) is_ring: bool,
    /// How far along the axis each place lies, and how far off it.
    up_mm: Vec<f64>,
    pub(super) out_mm: Vec<f64>,
}

impl Around {
    /// `None` where the border comes near the seam, unless the face is a ring.
    pub(super) fn of(
        loops: &[Vec<Vector3<f64>>],
        centre: &Vector3<f64>,
        axis: &Vector3<f64>,
    ) -> Option<Self> {
        let places = || loops.iter().flatten();
        let up_mm: Vec<f64> = places().map(|p| (p - centre).dot(axis)).collect();
        let off = |p: &Vector3<f64>| p - centre - axis * (p - centre).dot(axis);
        let around = loops.iter().map(|of| {
            let off: Vec<Vector3<f64>> = of.iter().map(off).collect();
            rounds(&off, axis)
        });
        let around: Vec<f64> = around.filter(|turns| *turns != 0.0).collect();
        let is_ring = around == [1.0, -1.0] || around == [-1.0, 1.0];
        let seam = if is_ring {
            across(axis)
        } else {
            let seam = -mean(places().map(|p| off(p).normalize()))?;
            let farthest = libm::cos(CLEAR_RAD);
            let is_clear = |p: &Vector3<f64>| off(p).normalize().dot(&seam) < farthest;
            if !places().all(is_clear) {
                return None;
            }
            seam
        };
        Some(Self {
            seam,
            is_ring,
            out_mm: places().map(|p| off(p).norm()).collect(),
            up_mm,
        })
    }
}

/// How often a loop goes around the axis that its places are seen from.
fn rounds(off: &[Vector3<f64>], axis: &Vector3<f64>) -> f64 {
    let pairs = off.iter().zip(off.iter().cycle().skip(1));
    let turns = pairs.map(|(a, b)| libm::atan2(a.cross(b).dot(axis), a.dot(b)));
    libm::round(turns.sum::<f64>() / core::f64::consts::TAU)
}

/// The widest of the gaps between angles all around, radians.
fn widest_gap(mut angles: Vec<f64>) -> Option<f64> {
    angles.sort_by(f64::total_cmp);
    let across = core::f64::consts::TAU - (angles.last()? - angles.first()?);
    let between = angles.windows(2).map(|pair| pair[1] - pair[0]);
    Some(between.fold(across, f64::max))
}

/// The direction of a mean; `None` where there is none to speak of.
fn mean(vectors: impl Iterator<Item = Vector3<f64>>) -> Option<Vector3<f64>> {
    let (count, sum) = vectors.fold((0.0, Vector3::zeros()), |(count, sum), vector| {
        (count + 1.0, sum + vector)
    });
    (sum / count).try_normalize(1e-6)
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

/// Places all along each loop of a face.
pub(super) fn loops(face: &Face) -> Vec<Vec<Vector3<f64>>> {
    let loops = core::iter::once(&face.outer).chain(&face.inner);
    loops.map(places).collect()
}

fn places(border: &Loop) -> Vec<Vector3<f64>> {
    let mut places = Vec::new();
    for curve in border.coedges.iter().map(|coedge| &coedge.space_curve) {
        for (k, ends) in curve.breaks.windows(2).enumerate() {
            let at = |n: usize| (ends[1] - ends[0]) * n as f64 / PROBES as f64;
            places.extend((0..=PROBES).map(|n| Vector3::from(curve.piece_value(k, at(n), 0))));
        }
    }
    places
}
