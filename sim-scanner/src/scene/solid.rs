//! Convex solids bounded by planes, cylinders, spheres and cones, met in closed form.

use crate::Vec3;

/// A bounding surface of a convex solid; the solid lies on its inner side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surface {
    /// The points p with `normal . p <= offset_mm`.
    Plane {
        /// Unit normal, out of the solid.
        normal: Vec3,
        /// Distance of the plane from the origin along the normal, millimetres.
        offset_mm: f64,
    },
    /// The points within a distance of an axis.
    Cylinder {
        /// A point of the axis, millimetres.
        base_mm: Vec3,
        /// Unit direction of the axis.
        axis: Vec3,
        /// Radius, millimetres.
        radius_mm: f64,
    },
    /// The points within a distance of a centre.
    Sphere {
        /// The centre, millimetres.
        centre_mm: Vec3,
        /// Radius, millimetres.
        radius_mm: f64,
    },
    /// The points that an apex sees within an angle of an axis.
    Cone {
        /// The apex, millimetres.
        apex_mm: Vec3,
        /// Unit direction of the axis, from the apex into the solid.
        axis: Vec3,
        /// Angle between axis and side, radians, below a right angle.
        half_angle_rad: f64,
    },
}

impl Surface {
    /// Where a ray is inside: from one distance to another; `None` where it never is.
    fn span(&self, origin: Vec3, direction: Vec3) -> Option<(f64, f64)> {
        match *self {
            Self::Plane { normal, offset_mm } => {
                let closing = normal.dot(direction);
                let above = normal.dot(origin) - offset_mm;
                if closing == 0.0 {
                    return (above <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
                }
                let at = -above / closing;
                Some(if closing < 0.0 {
                    (at, f64::INFINITY)
                } else {
                    (f64::NEG_INFINITY, at)
                })
            }
            Self::Cylinder {
                base_mm,
                axis,
                radius_mm,
            } => {
                let offset = origin - base_mm;
                let across = direction - axis * axis.dot(direction);
                quadratic_span(across, offset - axis * axis.dot(offset), radius_mm)
            }
            Self::Sphere {
                centre_mm,
                radius_mm,
            } => quadratic_span(direction, origin - centre_mm, radius_mm),
            Self::Cone {
                apex_mm,
                axis,
                half_angle_rad,
            } => cone_span(direction, origin - apex_mm, axis, half_angle_rad),
        }
    }

    /// Signed distance of a point from the surface, millimetres, positive outside.
    #[must_use]
    pub fn signed_distance_mm(&self, point_mm: Vec3) -> f64 {
        match *self {
            Self::Plane { normal, offset_mm } => normal.dot(point_mm) - offset_mm,
            Self::Cylinder {
                base_mm,
                axis,
                radius_mm,
            } => (point_mm - base_mm).cross(axis).length() - radius_mm,
            Self::Sphere {
                centre_mm,
                radius_mm,
            } => point_mm.distance(centre_mm) - radius_mm,
            Self::Cone {
                apex_mm,
                axis,
                half_angle_rad,
            } => {
                let offset = point_mm - apex_mm;
                let (sin, cos) = libm::sincos(half_angle_rad);
                let (along, across) = (axis.dot(offset), axis.cross(offset).length());
                // Behind the apex the apex itself is nearest.
                if along * cos + across * sin < 0.0 {
                    offset.length()
                } else {
                    across * cos - along * sin
                }
            }
        }
    }

    /// Unit normal at a point of the surface, out of the solid.
    #[must_use]
    pub fn normal_at(&self, point_mm: Vec3) -> Vec3 {
        match *self {
            Self::Plane { normal, .. } => normal,
            Self::Cylinder { base_mm, axis, .. } => {
                let offset = point_mm - base_mm;
                (offset - axis * axis.dot(offset)).normalize_or_zero()
            }
            Self::Sphere { centre_mm, .. } => (point_mm - centre_mm).normalize_or_zero(),
            Self::Cone {
                apex_mm,
                axis,
                half_angle_rad,
            } => {
                let offset = point_mm - apex_mm;
                let across = (offset - axis * axis.dot(offset)).normalize_or_zero();
                let (sin, cos) = libm::sincos(half_angle_rad);
                (across * cos - axis * sin).normalize_or_zero()
            }
        }
    }
}

/// Where `|offset + t across| <= radius`.
fn quadratic_span(across: Vec3, offset: Vec3, radius: f64) -> Option<(f64, f64)> {
    let a = across.length_squared();
    if a < 1e-24 {
        return (offset.length_squared() <= radius * radius)
            .then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    // The foot of the perpendicular first: far origins would cost digits otherwise.
    let foot_at = -across.dot(offset) / a;
    let foot = offset + across * foot_at;
    let reach = (radius * radius - foot.length_squared()) / a;
    if reach < 0.0 {
        return None;
    }
    let half = libm::sqrt(reach);
    Some((foot_at - half, foot_at + half))
}

/// Where `offset + t direction`, seen from the apex, is within the angle of the axis.
fn cone_span(direction: Vec3, offset: Vec3, axis: Vec3, half_angle_rad: f64) -> Option<(f64, f64)> {
    let cos2 = libm::cos(half_angle_rad) * libm::cos(half_angle_rad);
    // (axis . p)^2 - cos^2 p^2 is above 0 inside of the cone and of its mirror image. Counted
    // from the ray's nearest point to the apex, since far origins would cost digits.
    let foot_at = -direction.dot(offset);
    let foot = offset + direction * foot_at;
    let (ahead, height) = (axis.dot(direction), axis.dot(foot));
    let a = ahead * ahead - cos2;
    let b = ahead * height;
    let c = height * height - cos2 * foot.length_squared();
    let forwards = |t: f64| height + ahead * t >= 0.0;
    if a == 0.0 {
        // Along the side: in at one end, or never.
        let root = -c / (2.0 * b);
        return match () {
            () if b > 0.0 && ahead > 0.0 => Some((foot_at + root, f64::INFINITY)),
            () if b < 0.0 && ahead < 0.0 => Some((f64::NEG_INFINITY, foot_at + root)),
            () => None,
        };
    }
    let square = b * b - a * c;
    if a < 0.0 {
        if square < 0.0 {
            return None;
        }
        let root = libm::sqrt(square);
        let (low, high) = ((-b + root) / a, (-b - root) / a);
        return forwards((low + high) / 2.0).then_some((foot_at + low, foot_at + high));
    }
    // Steeper than the side: every such ray is inside at one end.
    let root = libm::sqrt(square.max(0.0));
    let (low, high) = ((-b - root) / a, (-b + root) / a);
    Some(if ahead > 0.0 {
        (foot_at + high, f64::INFINITY)
    } else {
        (f64::NEG_INFINITY, foot_at + low)
    })
}

/// The common inside of its bounding surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexSolid {
    faces: Vec<Surface>,
    extent_mm: Option<(Vec3, Vec3)>,
}

impl ConvexSolid {
    /// A solid bounded by these surfaces.
    #[must_use]
    pub fn new(faces: Vec<Surface>) -> Self {
        Self {
            faces,
            extent_mm: None,
        }
    }

    /// States the box around the solid, which the faces alone do not tell cheaply.
    #[must_use]
    pub fn with_extent_mm(mut self, low: Vec3, high: Vec3) -> Self {
        self.extent_mm = Some((low, high));
        self
    }

    /// The bounding surfaces; a face's index is its place here.
    #[must_use]
    pub fn faces(&self) -> &[Surface] {
        &self.faces
    }

    /// Where a ray comes in: distance, unit normal out of the solid, and the face's index.
    pub(crate) fn enter(&self, origin: Vec3, direction: Vec3) -> Option<(f64, Vec3, usize)> {
        let mut entry = (f64::NEG_INFINITY, 0);
        let mut exit = f64::INFINITY;
        for (index, face) in self.faces.iter().enumerate() {
            let (inwards, outwards) = face.span(origin, direction)?;
            if inwards > entry.0 {
                entry = (inwards, index);
            }
            exit = exit.min(outwards);
        }
        let (distance_mm, index) = entry;
        if distance_mm >= exit || distance_mm < 0.0 {
            return None;
        }
        let normal = self
            .faces
            .get(index)?
            .normal_at(origin + direction * distance_mm);
        Some((distance_mm, normal, index))
    }

    /// Whether a point lies inside, give or take a tolerance.
    #[must_use]
    pub fn contains(&self, point_mm: Vec3, tolerance_mm: f64) -> bool {
        self.faces
            .iter()
            .all(|face| face.signed_distance_mm(point_mm) <= tolerance_mm)
    }

    /// Lower and upper corner of the box around the solid; unbounded unless stated.
    #[must_use]
    pub fn extent_mm(&self) -> (Vec3, Vec3) {
        self.extent_mm
            .unwrap_or((Vec3::NEG_INFINITY, Vec3::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_entered_at_its_near_side() {
        let ball = ConvexSolid::new(vec![Surface::Sphere {
            centre_mm: Vec3::new(1.0, 2.0, 3.0),
            radius_mm: 4.0,
        }]);
        let (distance, normal, face) = ball
            .enter(Vec3::new(1.0, 2.0, 753.0), Vec3::NEG_Z)
            .expect("the ray goes through the centre");
        assert!((distance - 746.0).abs() < 1e-12);
        assert!(normal.distance(Vec3::Z) < 1e-12);
        assert_eq!(face, 0);
        assert!(
            ball.enter(Vec3::new(5.1, 2.0, 753.0), Vec3::NEG_Z)
                .is_none()
        );
        assert!(ball.enter(Vec3::new(1.0, 2.0, 753.0), Vec3::Z).is_none());
    }

    #[test]
    fn a_cone_is_entered_on_its_side_and_on_its_side_only() {
        let (axis, half_angle_rad) = (Vec3::new(0.2, -0.3, -0.9).normalize(), 0.5);
        let apex_mm = Vec3::new(4.0, -2.0, 12.0);
        let cone = Surface::Cone {
            apex_mm,
            axis,
            half_angle_rad,
        };
        let hat = ConvexSolid::new(vec![
            cone,
            Surface::Plane {
                normal: axis,
                offset_mm: axis.dot(apex_mm) + 30.0,
            },
        ]);
        let mut met = [0; 2];
        for k in 0..2000 {
            let turn = f64::from(k);
            let side = if k % 3 == 0 { -600.0 } else { 400.0 };
            let origin = Vec3::new(500.0 * libm::sin(turn), 400.0 * libm::cos(turn * 1.3), side);
            let aim = apex_mm + axis * (f64::from(k % 40) - 5.0) + Vec3::X * f64::from(k % 23);
            let direction = (aim - origin).normalize();
            let Some((distance, normal, face)) = hat.enter(origin, direction) else {
                // Then no place along the ray is inside.
                for step in 0..4000 {
                    let point = origin + direction * (f64::from(step) * 0.3);
                    assert!(!hat.contains(point, -0.2), "{k} {step}");
                }
                continue;
            };
            met[face] += 1;
            let point = origin + direction * distance;
            assert!(hat.contains(point, 1e-7), "{k}");
            assert!(!hat.contains(point - direction * 0.01, 0.0), "{k}");
            assert!(hat.faces()[face].signed_distance_mm(point).abs() < 1e-7);
            assert!(normal.dot(direction) <= 0.0 && (normal.length() - 1.0).abs() < 1e-12);
        }
        assert!(met.iter().all(|count| *count > 50), "{met:?}");
    }

    #[test]
    fn the_face_met_is_the_last_one_entered() {
        let drum = ConvexSolid::new(vec![
            Surface::Cylinder {
                base_mm: Vec3::ZERO,
                axis: Vec3::Z,
                radius_mm: 10.0,
            },
            Surface::Plane {
                normal: Vec3::Z,
                offset_mm: 5.0,
            },
            Surface::Plane {
                normal: Vec3::NEG_Z,
                offset_mm: 5.0,
            },
        ]);
        let top = drum.enter(Vec3::new(3.0, 0.0, 20.0), Vec3::NEG_Z);
        assert_eq!(top.map(|(d, _, face)| (d, face)), Some((15.0, 1)));
        let side = drum.enter(Vec3::new(20.0, 0.0, 0.0), Vec3::NEG_X);
        assert_eq!(side, Some((10.0, Vec3::X, 0)));
    }
}
