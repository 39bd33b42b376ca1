//! Outlines of the visible faces of a convex solid.
//!
//! A point of a convex solid is seen from a viewer exactly when the viewer is above its
//! tangent plane. Laser and sensor travel with the column, so for a viewer (x + b, v_y, v_z)
//! the condition at a point p with normal n is n . (p_x + b - p_x, v_y - p_y, v_z - p_z) > 0.
//! On a plane n . p = d it becomes n_x (p_x + b) + n_y v_y + n_z v_z > d: a cut at x = const.

use core::f64::consts::{PI, TAU};

use super::{TruthError, VisibleFace};
use crate::Vec3;
use crate::optics::Optics;
use crate::scene::{ConvexSolid, FaceId, Surface};

/// Chords of a full circle.
const CHORDS: usize = 1440;
/// Larger than any object, millimetres.
const FAR_MM: f64 = 1e4;

/// Flat coordinates on a surface, in which an outline is a plane polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Chart {
    Plane {
        u: Vec3,
        v: Vec3,
    },
    Cylinder {
        base_mm: Vec3,
        axis: Vec3,
        /// Where the angle is 0: the middle of what is seen.
        facing: Vec3,
        radius_mm: f64,
    },
}

impl Chart {
    fn flatten(&self, p: Vec3) -> (f64, f64) {
        match *self {
            Self::Plane { u, v } => (u.dot(p), v.dot(p)),
            Self::Cylinder {
                base_mm,
                axis,
                facing,
                radius_mm,
            } => {
                let offset = p - base_mm;
                let angle = libm::atan2(axis.cross(facing).dot(offset), facing.dot(offset));
                (angle * radius_mm, axis.dot(offset))
            }
        }
    }

    /// Whether the foot of a point on the surface lies within the outline (even-odd rule).
    pub(super) fn covers(&self, outline_mm: &[Vec3], point_mm: Vec3) -> bool {
        let (u, v) = self.flatten(point_mm);
        edges(outline_mm)
            .filter(|(from, to)| {
                let (from, to) = (self.flatten(*from), self.flatten(*to));
                (from.1 > v) != (to.1 > v)
                    && u < from.0 + (v - from.1) / (to.1 - from.1) * (to.0 - from.0)
            })
            .count()
            % 2
            == 1
    }
}

/// The edges of a closed polyline.
pub(super) fn edges(points: &[Vec3]) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
    let next = points.iter().cycle().skip(1);
    points.iter().copied().zip(next.copied())
}

/// Distance of a point from a segment, millimetres.
pub(super) fn segment_distance(point: Vec3, from: Vec3, to: Vec3) -> f64 {
    let along = to - from;
    let length2 = along.length_squared();
    let at = if length2 > 0.0 {
        ((point - from).dot(along) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance(from + along * at)
}

pub(super) fn visible_faces(
    solid: &ConvexSolid,
    optics: &Optics,
    incidence_max_rad: f64,
) -> Result<Vec<VisibleFace>, TruthError> {
    let viewers = Viewers {
        laser_mm: optics.laser_mm(0.0),
        sensor_mm: optics.sensor_mm(0.0),
        least_cos: libm::cos(incidence_max_rad).max(0.0),
    };
    let side = side_of(solid);
    let mut faces = Vec::new();
    for (index, surface) in solid.faces().iter().enumerate() {
        let id = FaceId {
            body: 0,
            face: index,
        };
        let face = match *surface {
            Surface::Plane { normal, offset_mm } => match side {
                None => polygon(solid, index, normal, offset_mm, viewers, id)?,
                Some(side) => disc(side, index, normal, offset_mm, viewers, id)?,
            },
            Surface::Cylinder { .. } => {
                let side = side.ok_or(TruthError::Surface(index))?;
                side.visible(viewers, id)
            }
            Surface::Sphere { .. } | Surface::Cone { .. } => {
                return Err(TruthError::Surface(index));
            }
        };
        faces.extend(face);
    }
    Ok(faces)
}

/// Laser and sensor, which travel with the column, where they are at x = 0.
#[derive(Debug, Clone, Copy)]
struct Viewers {
    laser_mm: Vec3,
    sensor_mm: Vec3,
    /// Cosine of the laser's angle of incidence beyond which no light comes back.
    least_cos: f64,
}

impl Viewers {
    /// Whether light comes back from a point.
    fn see(&self, normal: Vec3, point: Vec3) -> bool {
        let laser = above(self.laser_mm, normal, point);
        let distance_mm = (self.laser_mm + Vec3::X * point.x).distance(point);
        laser > self.least_cos * distance_mm && above(self.sensor_mm, normal, point) > 0.0
    }

    /// Whether light comes back from a plane face; from part of one is not foreseen, since
    /// where it ends is no straight line.
    fn light(&self, index: usize, normal: Vec3, outline: &[Vec3]) -> Result<bool, TruthError> {
        match outline.iter().filter(|p| self.see(normal, **p)).count() {
            0 => Ok(false),
            all if all == outline.len() => Ok(true),
            _ => Err(TruthError::Grazed(index)),
        }
    }
}

/// How far a viewer that travels with the column is above the tangent plane at a point.
fn above(viewer_at_0: Vec3, normal: Vec3, point: Vec3) -> f64 {
    normal.dot(viewer_at_0 + Vec3::X * point.x - point)
}

fn basis(normal: Vec3) -> (Vec3, Vec3) {
    let u = normal.any_orthonormal_vector();
    (u, normal.cross(u))
}

fn polygon(
    solid: &ConvexSolid,
    index: usize,
    normal: Vec3,
    offset_mm: f64,
    viewers: Viewers,
    id: FaceId,
) -> Result<Option<VisibleFace>, TruthError> {
    let (u, v) = basis(normal);
    let mut corners: Vec<Vec3> = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .into_iter()
        .map(|(a, b)| normal * offset_mm + (u * a + v * b) * FAR_MM)
        .collect();
    for (other, surface) in solid.faces().iter().enumerate() {
        let Surface::Plane {
            normal: across,
            offset_mm: limit,
        } = *surface
        else {
            return Err(TruthError::Surface(index));
        };
        if other != index {
            corners = clip(&corners, |p| limit - across.dot(p));
        }
    }
    for viewer in [viewers.laser_mm, viewers.sensor_mm] {
        corners = clip(&corners, |p| above(viewer, normal, p));
    }
    if corners.len() < 3 || !viewers.light(index, normal, &corners)? {
        return Ok(None);
    }
    let area_mm2 = edges(&corners)
        .map(|(a, b)| a.cross(b).dot(normal))
        .sum::<f64>()
        / 2.0;
    Ok(Some(VisibleFace {
        id,
        surface: Surface::Plane { normal, offset_mm },
        corners_mm: corners.clone(),
        outline_mm: corners,
        area_mm2,
        flat: Chart::Plane { u, v },
    }))
}

/// The part of a convex polygon where a linear function is positive (Sutherland and Hodgman).
fn clip(corners: &[Vec3], inside: impl Fn(Vec3) -> f64) -> Vec<Vec3> {
    let mut kept = Vec::new();
    for (from, to) in edges(corners) {
        let (a, b) = (inside(from), inside(to));
        if a > 0.0 {
            kept.push(from);
        }
        if (a > 0.0) != (b > 0.0) {
            kept.push(from + (to - from) * (a / (a - b)));
        }
    }
    kept
}

/// The side of a right cylinder between two discs.
#[derive(Clone, Copy)]
struct Side {
    base_mm: Vec3,
    axis: Vec3,
    radius_mm: f64,
    low_mm: f64,
    high_mm: f64,
}

fn side_of(solid: &ConvexSolid) -> Option<Side> {
    let mut found = None;
    let mut ends = Vec::new();
    for surface in solid.faces() {
        match *surface {
            Surface::Cylinder {
                base_mm,
                axis,
                radius_mm,
            } => found = Some((base_mm, axis, radius_mm)),
            Surface::Plane { normal, offset_mm } => ends.push((normal, offset_mm)),
            Surface::Sphere { .. } | Surface::Cone { .. } => return None,
        }
    }
    let (base_mm, axis, radius_mm) = found?;
    let mut heights: Vec<f64> = ends
        .iter()
        .filter(|(normal, _)| normal.cross(axis).length() < 1e-9)
        .map(|(normal, offset_mm)| (offset_mm - normal.dot(base_mm)) * normal.dot(axis).signum())
        .collect();
    heights.sort_by(f64::total_cmp);
    match heights[..] {
        [low_mm, high_mm] if ends.len() == 2 => Some(Side {
            base_mm,
            axis,
            radius_mm,
            low_mm,
            high_mm,
        }),
        _ => None,
    }
}

impl Side {
    /// The direction across the axis that faces the viewers.
    fn facing(&self, viewers: Viewers) -> Vec3 {
        let towards = (viewers.laser_mm + viewers.sensor_mm) / 2.0 - self.base_mm;
        let flat = Vec3::new(0.0, towards.y, towards.z);
        (flat - self.axis * self.axis.dot(flat)).normalize_or_zero()
    }

    fn normal(&self, facing: Vec3, angle: f64) -> Vec3 {
        let (sin, cos) = libm::sincos(angle);
        facing * cos + self.axis.cross(facing) * sin
    }

    fn point(&self, facing: Vec3, angle: f64, height_mm: f64) -> Vec3 {
        self.base_mm + self.axis * height_mm + self.normal(facing, angle) * self.radius_mm
    }

    /// The angle to one side of `facing` up to which both viewers see the side at a height.
    fn limit(&self, facing: Vec3, viewers: Viewers, height_mm: f64, sign: f64) -> f64 {
        let seen = |angle: f64| {
            let normal = self.normal(facing, angle);
            let point = self.point(facing, angle, height_mm);
            viewers.see(normal, point)
        };
        let (mut inside, mut outside) = (0.0, sign * PI);
        for _ in 0..60 {
            let middle = (inside + outside) / 2.0;
            if seen(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }

    fn visible(&self, viewers: Viewers, id: FaceId) -> Option<VisibleFace> {
        const STEPS: usize = 256;
        let facing = self.facing(viewers);
        let normal = self.normal(facing, 0.0);
        let middle = self.point(facing, 0.0, (self.low_mm + self.high_mm) / 2.0);
        if !viewers.see(normal, middle) {
            return None;
        }
        let height =
            |i: usize| self.low_mm + (self.high_mm - self.low_mm) * i as f64 / STEPS as f64;
        let limits: Vec<(f64, f64)> = (0..=STEPS)
            .map(|i| {
                let limit = |sign| self.limit(facing, viewers, height(i), sign);
                (limit(-1.0), limit(1.0))
            })
            .collect();
        let arc = |height_mm: f64, from: f64, to: f64| {
            let chords = ((to - from).abs() / TAU * CHORDS as f64).ceil().max(1.0) as usize;
            (0..chords).map(move |i| {
                let angle = from + (to - from) * i as f64 / chords as f64;
                self.point(facing, angle, height_mm)
            })
        };
        let (first, last) = (limits[0], limits[STEPS]);
        let mut outline_mm: Vec<Vec3> = arc(self.low_mm, first.0, first.1).collect();
        outline_mm.extend((0..STEPS).map(|i| self.point(facing, limits[i].1, height(i))));
        outline_mm.extend(arc(self.high_mm, last.1, last.0));
        outline_mm.extend(
            (1..=STEPS)
                .rev()
                .map(|i| self.point(facing, limits[i].0, height(i))),
        );
        // Simpson's rule over the height.
        let weights = limits.iter().enumerate().map(|(i, (low, high))| {
            let weight = match i {
                0 | STEPS => 1.0,
                _ if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * (high - low)
        });
        let step_mm = (self.high_mm - self.low_mm) / STEPS as f64;
        Some(VisibleFace {
            id,
            surface: Surface::Cylinder {
                base_mm: self.base_mm,
                axis: self.axis,
                radius_mm: self.radius_mm,
            },
            outline_mm,
            corners_mm: vec![
                self.point(facing, first.0, self.low_mm),
                self.point(facing, first.1, self.low_mm),
                self.point(facing, last.1, self.high_mm),
                self.point(facing, last.0, self.high_mm),
            ],
            area_mm2: weights.sum::<f64>() * step_mm / 3.0 * self.radius_mm,
            flat: Chart::Cylinder {
                base_mm: self.base_mm,
                axis: self.axis,
                facing,
                radius_mm: self.radius_mm,
            },
        })
    }
}

fn disc(
    side: Side,
    index: usize,
    normal: Vec3,
    offset_mm: f64,
    viewers: Viewers,
    id: FaceId,
) -> Result<Option<VisibleFace>, TruthError> {
    let turn = normal.dot(side.axis);
    if (turn.abs() - 1.0).abs() > 1e-9 {
        return Err(TruthError::Surface(index));
    }
    let height_mm = (offset_mm - normal.dot(side.base_mm)) * turn.signum();
    let facing = side.facing(viewers);
    let rim = |i: usize| side.point(facing, TAU * i as f64 / CHORDS as f64, height_mm);
    let circle: Vec<Vec3> = (0..CHORDS).map(rim).collect();
    let mut outline_mm = circle.clone();
    for viewer in [viewers.laser_mm, viewers.sensor_mm] {
        outline_mm = clip(&outline_mm, |p| above(viewer, normal, p));
    }
    if outline_mm.len() < 3 || !viewers.light(index, normal, &outline_mm)? {
        return Ok(None);
    }
    let (u, v) = basis(normal);
    let chords_mm2 = edges(&outline_mm)
        .map(|(a, b)| a.cross(b).dot(side.axis))
        .sum::<f64>()
        .abs()
        / 2.0;
    let whole = outline_mm == circle;
    let corners_mm = [-1.0, 1.0]
        .into_iter()
        .map(|sign| side.limit(facing, viewers, height_mm, sign))
        .map(|angle| side.point(facing, angle, height_mm))
        .collect();
    Ok(Some(VisibleFace {
        id,
        surface: Surface::Plane { normal, offset_mm },
        outline_mm,
        corners_mm,
        area_mm2: if whole {
            PI * side.radius_mm * side.radius_mm
        } else {
            chords_mm2
        },
        flat: Chart::Plane { u, v },
    }))
}
