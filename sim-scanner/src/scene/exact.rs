//! What the triangles of a mesh's face stand for, where that is known in closed form.

use crate::Vec3;
use crate::scene::Surface;

/// The surface of a face of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaceSurface {
    /// One of those that solids are bounded by, seen from either side.
    Surface(Surface),
    /// A torus.
    Torus {
        /// Its centre, millimetres.
        centre_mm: Vec3,
        /// Unit direction of its axis.
        axis: Vec3,
        /// Radius of the circle in the middle of the tube, millimetres.
        radius_mm: f64,
        /// Radius of the tube, millimetres.
        tube_mm: f64,
    },
}

/// Triangles are nearer than this to the surface that they stand for, along any ray, millimetres.
const NEAR_MM: f64 = 0.1;
/// Rays that graze a surface more than this, the sine of the angle between them, meet triangles.
const GRAZING: f64 = 0.02;
/// Steps of Newton's method; each doubles the digits.
const STEPS: usize = 6;

impl FaceSurface {
    /// Signed distance of a point, millimetres, positive on the side that normals point to.
    #[must_use]
    pub fn signed_distance_mm(&self, point_mm: Vec3) -> f64 {
        match *self {
            Self::Surface(surface) => surface.signed_distance_mm(point_mm),
            Self::Torus { tube_mm, .. } => self.off_tube_middle(point_mm).length() - tube_mm,
        }
    }

    /// Unit normal beside a point: away from a centre, an axis or the middle of a tube.
    #[must_use]
    pub fn normal_at(&self, point_mm: Vec3) -> Vec3 {
        match *self {
            Self::Surface(surface) => surface.normal_at(point_mm),
            Self::Torus { .. } => self.off_tube_middle(point_mm).normalize_or_zero(),
        }
    }

    /// From the nearest point of the circle in the middle of a torus's tube to a point; zero of
    /// other surfaces.
    fn off_tube_middle(&self, point_mm: Vec3) -> Vec3 {
        let Self::Torus {
            centre_mm,
            axis,
            radius_mm,
            ..
        } = *self
        else {
            return Vec3::ZERO;
        };
        let offset = point_mm - centre_mm;
        let out = (offset - axis * axis.dot(offset)).normalize_or_zero();
        offset - out * radius_mm
    }

    /// Distance along a ray to the surface, and its normal there, from a distance nearby; `None`
    /// where the ray grazes it or it is not near.
    pub(super) fn met_near(
        &self,
        origin: Vec3,
        direction: Vec3,
        distance_mm: f64,
    ) -> Option<(f64, Vec3)> {
        let mut at_mm = distance_mm;
        for _ in 0..STEPS {
            let point_mm = origin + direction * at_mm;
            let closing = self.normal_at(point_mm).dot(direction);
            if closing.abs() < GRAZING {
                return None;
            }
            let step_mm = self.signed_distance_mm(point_mm) / closing;
            at_mm -= step_mm;
            if step_mm.abs() < 1e-9 {
                break;
            }
        }
        let is_near = (at_mm - distance_mm).abs() < NEAR_MM;
        is_near.then(|| (at_mm, self.normal_at(origin + direction * at_mm)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_the_gradient_of_the_distance() {
        let torus = FaceSurface::Torus {
            centre_mm: Vec3::new(1.0, -2.0, 3.0),
            axis: Vec3::new(0.1, 0.2, 1.0).normalize(),
            radius_mm: 20.0,
            tube_mm: 6.0,
        };
        for point in [Vec3::new(9.0, 5.0, 8.0), Vec3::new(-15.0, 3.0, 1.0)] {
            let step = 1e-5;
            let slope = |by: Vec3| {
                let at = |s: f64| torus.signed_distance_mm(point + by * s);
                (at(step) - at(-step)) / (2.0 * step)
            };
            let gradient = Vec3::new(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z));
            assert!(gradient.distance(torus.normal_at(point)) < 1e-8);
        }
    }

    #[test]
    fn a_ray_is_led_from_beside_a_surface_onto_it() {
        let ball = FaceSurface::Surface(Surface::Sphere {
            centre_mm: Vec3::ZERO,
            radius_mm: 10.0,
        });
        let (origin, down) = (Vec3::new(3.0, 4.0, 50.0), Vec3::NEG_Z);
        let exact = 50.0 - libm::sqrt(75.0);
        let (met, normal) = ball.met_near(origin, down, exact + 0.05).expect("near");
        assert!((met - exact).abs() < 1e-9);
        assert!(normal.distance(Vec3::new(0.3, 0.4, libm::sqrt(0.75))) < 1e-9);
        assert_eq!(ball.met_near(origin, down, exact - 0.3), None);
        // It passes the ball by.
        assert_eq!(ball.met_near(Vec3::new(9.999, 0.0, 50.0), down, 50.0), None);
    }
}
