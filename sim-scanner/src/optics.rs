//! The laser's spot on the scene, and what of it the sensor sees.
//!
//! A beam leaves the laser in the plane x = const at an angle from the -z axis towards +y. The
//! sensor stands beside the laser, a baseline away, and triangulates the centre of the light
//! it sees. Three things follow, none of them drawn at random:
//!
//! * a point counts only when both laser and sensor see it (shadow);
//! * a spot that lies on two surfaces sends back light from both (mixed samples);
//! * a spot of which a part is lost has its centre off the beam's axis, and triangulation
//!   turns that into a range error: the curl at the ends of a run (Curless and Levoy 1995).

use glam::DMat3;

use crate::Vec3;
use crate::scene::{Hit, Scene};

/// Where the beam starts and how it is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// y of the laser's pivot in the part frame, millimetres.
    pub camera_y_mm: f64,
    /// z of the laser's pivot in the part frame, millimetres.
    pub camera_z_mm: f64,
    /// The sensor's place beside the laser along x and y, millimetres. The two never coincide.
    pub baseline_mm: (f64, f64),
    /// Radius of the spot, millimetres; 0 for a beam without width.
    pub spot_radius_mm: f64,
}

/// How the head is turned about the laser's pivot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// Not at all.
    None,
    /// By this rotation.
    By(DMat3),
}

impl Turn {
    /// A direction of the head in the part frame.
    #[must_use]
    pub fn apply(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::None => direction,
            Self::By(rotation) => *rotation * direction,
        }
    }
}

/// The light of one spot that reaches the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// The surface point that stands for the spot: on the beam's axis where that is seen.
    pub hit: Hit,
    /// Distance along the beam to the surface of `hit`, at the beam's axis, millimetres.
    pub range_mm: f64,
    /// Cosine of the angle between the beam and the surface's normal.
    pub incidence_cos: f64,
    /// Share of the spot's light that comes back, 0 to 1, before the material takes its part.
    pub lit: f64,
    /// Whether the beam's axis itself is seen; otherwise only the rim of the spot is.
    pub axis_seen: bool,
    /// Set where the spot lies on a step edge or a silhouette.
    pub step: Option<Step>,
    /// Angle between the beam as a mirror would send it on and the way to the sensor, radians.
    pub mirror_off_rad: f64,
    /// Probability that a stain on the surface swallows the light.
    pub stained: f64,
}

/// What a step edge does to the range that a sensor reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Range error from the displaced centre of the light, millimetres.
    pub curl_mm: f64,
    /// The other surface in the spot: its mean distance in millimetres, and its share of the
    /// light that comes back.
    pub other: Option<(f64, f64)>,
}

/// Beams that stand for the spot: offsets in radii, and their shares of the light.
const BEAMS: [(f64, f64, f64); 5] = [
    (0.0, 0.0, 0.4),
    (0.0, 0.75, 0.15),
    (0.0, -0.75, 0.15),
    (0.75, 0.0, 0.15),
    (-0.75, 0.0, 0.15),
];

impl Optics {
    /// Unit direction of the beam at an angle from -z towards +y, radians.
    #[must_use]
    pub fn direction(angle_rad: f64) -> Vec3 {
        let (sin, cos) = libm::sincos(angle_rad);
        Vec3::new(0.0, sin, -cos)
    }

    /// The laser's pivot while the table is at this x.
    #[must_use]
    pub fn laser_mm(&self, x_mm: f64) -> Vec3 {
        Vec3::new(x_mm, self.camera_y_mm, self.camera_z_mm)
    }

    /// The sensor's centre while the table is at this x.
    #[must_use]
    pub fn sensor_mm(&self, x_mm: f64) -> Vec3 {
        let (x, y) = self.baseline_mm;
        self.laser_mm(x_mm) + Vec3::new(x, y, 0.0)
    }

    /// What the sensor sees of the spot at this table position and angle; `None` for nothing.
    #[must_use]
    pub fn look(&self, scene: &Scene, x_mm: f64, angle_rad: f64) -> Option<Spot> {
        self.look_from(scene, self.laser_mm(x_mm), &Turn::None, angle_rad)
    }

    /// As [`Optics::look`], with the laser's pivot there and the head turned about it.
    #[must_use]
    pub fn look_from(
        &self,
        scene: &Scene,
        laser: Vec3,
        turn: &Turn,
        angle_rad: f64,
    ) -> Option<Spot> {
        let (beside_x, beside_y) = self.baseline_mm;
        let sensor = laser + turn.apply(Vec3::new(beside_x, beside_y, 0.0));
        let straight = Self::direction(angle_rad);
        let direction = turn.apply(straight);
        let upwards = turn.apply(Vec3::new(0.0, -straight.z, straight.y));
        let sideways = turn.apply(Vec3::X);
        let seen = |x: f64, y: f64| {
            let offset = (sideways * x + upwards * y) * self.spot_radius_mm;
            scene
                .cast(laser + offset, direction)
                .filter(|hit| scene.sees(hit.point_mm, hit.normal, sensor))
        };
        let beams = if self.spot_radius_mm > 0.0 {
            &BEAMS[..]
        } else {
            &BEAMS[..1]
        };
        let mut returns = [None; BEAMS.len()];
        for (slot, (x, y, _)) in returns.iter_mut().zip(beams) {
            *slot = seen(*x, *y);
        }
        let axis_seen = returns[0].is_some();
        let hit = returns[0].or_else(|| nearest(&returns))?;
        let incidence_cos = -hit.normal.dot(direction);
        if incidence_cos <= 1e-6 {
            return None;
        }
        let along_axis = |point: Vec3| hit.normal.dot(point - laser) / -incidence_cos;
        let range_mm = if axis_seen {
            hit.distance_mm
        } else {
            along_axis(hit.point_mm)
        };
        let mut gathered = Gathered::default();
        for ((x, y, share), met) in beams.iter().zip(&returns) {
            let offset = (*x * self.spot_radius_mm, *y * self.spot_radius_mm);
            let expected = along_axis(hit.point_mm - sideways * offset.0 - upwards * offset.1);
            gathered.add(*share, offset, *met, expected, self.spot_radius_mm);
        }
        Some(Spot {
            hit,
            range_mm,
            incidence_cos,
            lit: gathered.here + gathered.other,
            axis_seen,
            step: gathered.step(self.baseline_mm, range_mm, beams.len() > 1),
            mirror_off_rad: mirror_off_rad(direction, &hit, sensor),
            stained: scene.stained(&hit),
        })
    }
}

/// Angle between the mirrored beam and the way from the hit to the sensor, radians.
fn mirror_off_rad(direction: Vec3, hit: &Hit, sensor_mm: Vec3) -> f64 {
    let mirrored = direction - hit.normal * (2.0 * hit.normal.dot(direction));
    let towards = sensor_mm - hit.point_mm;
    libm::atan2(mirrored.cross(towards).length(), mirrored.dot(towards))
}

fn nearest(returns: &[Option<Hit>]) -> Option<Hit> {
    returns
        .iter()
        .flatten()
        .copied()
        .min_by(|a, b| a.distance_mm.total_cmp(&b.distance_mm))
}

/// The light of the beams, by the surface it comes from.
#[derive(Default)]
struct Gathered {
    here: f64,
    centre: (f64, f64),
    other: f64,
    other_range: f64,
}

impl Gathered {
    /// Adds a beam. A beam off the reference's tangent plane by more than the spot's size is
    /// on another surface; the curvature of one surface stays far below that.
    fn add(
        &mut self,
        share: f64,
        offset: (f64, f64),
        met: Option<Hit>,
        expected_mm: f64,
        radius_mm: f64,
    ) {
        let Some(hit) = met else { return };
        if (hit.distance_mm - expected_mm).abs() <= STEP_RADII * radius_mm + STEP_LEAST_MM {
            self.here += share;
            self.centre.0 += share * offset.0;
            self.centre.1 += share * offset.1;
        } else {
            self.other += share;
            self.other_range += share * hit.distance_mm;
        }
    }

    fn step(&self, baseline_mm: (f64, f64), range_mm: f64, has_width: bool) -> Option<Step> {
        if !has_width || self.here > FULL {
            return None;
        }
        let length = libm::hypot(baseline_mm.0, baseline_mm.1);
        let shift = if self.here > 0.0 && length > 0.0 {
            (self.centre.0 * baseline_mm.0 + self.centre.1 * baseline_mm.1) / (self.here * length)
        } else {
            0.0
        };
        let lit = self.here + self.other;
        Some(Step {
            // Light displaced towards the sensor is taken for light from farther away.
            curl_mm: shift * range_mm / length.max(1.0),
            other: (self.other > 0.0).then(|| (self.other_range / self.other, self.other / lit)),
        })
    }
}

/// A step is counted as one from this many spot radii on ...
const STEP_RADII: f64 = 2.0;
/// ... and never below this height, millimetres.
const STEP_LEAST_MM: f64 = 0.2;
/// A spot with this much of its light on one surface is whole.
const FULL: f64 = 0.999;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Body, ConvexSolid, FaceId, Material, Surface};

    fn optics(baseline_mm: (f64, f64), spot_radius_mm: f64) -> Optics {
        Optics {
            camera_y_mm: 4.0,
            camera_z_mm: 750.0,
            baseline_mm,
            spot_radius_mm,
        }
    }

    fn scene(surfaces: Vec<Surface>) -> Scene {
        Scene::new(
            vec![Body::Solid(ConvexSolid::new(surfaces))],
            Material::PLASTER,
        )
    }

    /// A floor at z = 0 and a block on it from y = 0 upwards, 20 mm high.
    fn step() -> Scene {
        let plane = |normal, offset_mm| Surface::Plane { normal, offset_mm };
        scene(vec![plane(Vec3::Z, 20.0), plane(Vec3::NEG_Y, 0.0)])
            .with_back_plane(0.0, Material::PLASTER)
    }

    fn angle_to(optics: &Optics, y_mm: f64, z_mm: f64) -> f64 {
        libm::atan2(y_mm - optics.camera_y_mm, optics.camera_z_mm - z_mm)
    }

    #[test]
    fn the_range_to_a_plane_is_the_closed_form() {
        let normal = Vec3::new(0.2, -0.3, 0.9).normalize();
        let offset_mm = 7.0;
        let scene = scene(vec![Surface::Plane { normal, offset_mm }]);
        let optics = optics((0.0, 150.0), 0.2);
        for (x, angle) in [(0.0, 0.0), (12.5, 0.03), (-40.0, -0.06), (31.0, 0.05)] {
            let spot = optics.look(&scene, x, angle).expect("an endless plane");
            let (sin, cos) = libm::sincos(angle);
            let expected = (offset_mm - normal.x * x - normal.y * 4.0 - normal.z * 750.0)
                / (normal.y * sin - normal.z * cos);
            assert!((spot.range_mm - expected).abs() < 1e-10, "{x} {angle}");
            assert_eq!(spot.step, None);
            assert!((spot.incidence_cos - (normal.z * cos - normal.y * sin)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_range_to_a_cylinder_is_the_closed_form() {
        // Axis along x at y = 10, z = -5: every column sees the same circle.
        let (y, z, radius_mm) = (10.0, -5.0, 30.0);
        let scene = scene(vec![Surface::Cylinder {
            base_mm: Vec3::new(3.0, y, z),
            axis: Vec3::X,
            radius_mm,
        }]);
        let optics = optics((150.0, 0.0), 0.1);
        for angle in [-0.02, 0.0, 0.01, 0.03] {
            let spot = optics.look(&scene, 8.0, angle).expect("on the cylinder");
            let (sin, cos) = libm::sincos(angle);
            // Distance to the foot of the perpendicular, then back by half the chord.
            let (to_y, to_z) = (y - 4.0, z - 750.0);
            let foot = to_y * sin - to_z * cos;
            let off = to_y * cos + to_z * sin;
            let expected = foot - libm::sqrt(radius_mm * radius_mm - off * off);
            assert!((spot.range_mm - expected).abs() < 1e-9, "{angle}");
            assert!((spot.lit - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_shadow_of_a_step_is_as_long_as_the_baseline_makes_it() {
        let scene = step();
        // The sensor above sees past the block's lower edge only from some way off.
        let watched = optics((0.0, 200.0), 0.0);
        let edge = Vec3::new(0.0, 0.0, 20.0);
        let sensor = watched.sensor_mm(0.0);
        let shadow_y = edge.y - (sensor.y - edge.y) * edge.z / (sensor.z - edge.z);
        assert!(shadow_y < -5.0);
        for (y, seen) in [
            (shadow_y - 0.01, true),
            (shadow_y + 0.01, false),
            (-0.3, false),
        ] {
            let spot = watched.look(&scene, 0.0, angle_to(&watched, y, 0.0));
            assert_eq!(spot.is_some(), seen, "y {y}");
        }
        // A sensor below sees it all.
        let below = optics((0.0, -200.0), 0.0);
        assert!(
            below
                .look(&scene, 0.0, angle_to(&below, -0.3, 0.0))
                .is_some()
        );
    }

    #[test]
    fn a_spot_on_a_step_mixes_both_surfaces() {
        let scene = step();
        let optics = optics((0.0, -200.0), 0.3);
        let spot = optics
            .look(&scene, 0.0, angle_to(&optics, 0.1, 20.0))
            .expect("on the block's rim");
        assert_eq!(spot.hit.face, FaceId { body: 0, face: 0 });
        let step = spot.step.expect("the rim is a step");
        let (other_mm, share) = step.other.expect("the floor is in the spot");
        assert!((other_mm - 750.0).abs() < 0.1, "{other_mm}");
        assert!((share - 0.15).abs() < 1e-9, "{share}");
        let inside = optics.look(&scene, 0.0, angle_to(&optics, 0.5, 20.0));
        assert_eq!(inside.and_then(|spot| spot.step), None);
    }

    #[test]
    fn a_mirror_halfway_between_laser_and_sensor_blinds() {
        // The laser straight above the place that is looked at, the sensor beside it.
        for ((x, y), turn) in [
            ((0.0, 150.0), 0.0),
            ((0.0, 150.0), 0.04),
            ((90.0, 0.0), 0.0),
        ] {
            let optics = optics((x, y), 0.1);
            let to_sensor = libm::atan2(libm::hypot(x, y), 750.0);
            // The normal halves the angle; turned by an angle, it turns the beam by twice that.
            let (sin, cos) = libm::sincos(to_sensor / 2.0 + turn);
            let aside = Vec3::new(x, y, 0.0).normalize();
            let normal = aside * sin + Vec3::Z * cos;
            let offset_mm = normal.dot(Vec3::new(0.0, 4.0, 0.0));
            let scene = scene(vec![Surface::Plane { normal, offset_mm }]);
            let spot = optics.look(&scene, 0.0, 0.0).expect("an endless plane");
            assert!((spot.mirror_off_rad - 2.0 * turn).abs() < 1e-9, "{spot:?}");
        }
    }

    #[test]
    fn light_lost_at_a_silhouette_bends_the_range() {
        let plane = |normal, offset_mm| Surface::Plane { normal, offset_mm };
        // The rim is above the laser, so that no beam meets the block's upper side.
        let scene = scene(vec![plane(Vec3::Z, 0.0), plane(Vec3::Y, 30.0)]);
        let radius = 0.3;
        // The upper part of the spot is lost: the centre of light moves down by
        // 0.15 * 0.75 / 0.85 radii; with the sensor above the surface seems nearer.
        let optics = optics((0.0, 150.0), radius);
        let spot = optics
            .look(&scene, 0.0, angle_to(&optics, 29.9, 0.0))
            .expect("inside the rim");
        let step = spot.step.expect("a silhouette");
        let shift = -0.15 * 0.75 / 0.85 * radius;
        assert!(
            (step.curl_mm - shift * 750.0 / 150.0).abs() < 1e-3,
            "{step:?}"
        );
        assert_eq!(step.other, None);
        // Beyond the rim only the spot's lower part comes back.
        let beyond = optics
            .look(&scene, 0.0, angle_to(&optics, 30.1, 0.0))
            .expect("the spot's rim is on the plane");
        assert!(!beyond.axis_seen);
        assert!((beyond.range_mm - 750.5).abs() < 0.1);
        assert!(
            optics
                .look(&scene, 0.0, angle_to(&optics, 30.4, 0.0))
                .is_none()
        );
    }
}
