//! The objects that come with the simulator, all about 10 cm each way around the origin.

use core::f64::consts::PI;

use super::{Body, ConvexSolid, Surface};
use crate::Vec3;

/// Greatest extent of the built-in objects along any axis, millimetres.
pub const EXTENT_MM: f64 = 100.0;

/// How an object that stands upright is turned towards the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Turn about the object's own upright axis, radians.
    pub yaw_rad: f64,
    /// Lean of the top towards the camera, radians.
    pub pitch_rad: f64,
    /// Turn about the camera's axis, radians.
    pub roll_rad: f64,
}

impl Pose {
    pub(super) fn apply(&self, v: Vec3) -> Vec3 {
        let (sin, cos) = libm::sincos(self.yaw_rad);
        let v = Vec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x);
        let (sin, cos) = libm::sincos(self.pitch_rad);
        let v = Vec3::new(v.x, cos * v.y - sin * v.z, sin * v.y + cos * v.z);
        let (sin, cos) = libm::sincos(self.roll_rad);
        Vec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
    }
}

const fn degrees(angle: f64) -> f64 {
    angle * PI / 180.0
}

/// The pose of [`house`]: a gable end, a side and both slopes of the roof are seen.
pub const HOUSE_POSE: Pose = Pose {
    yaw_rad: degrees(33.0),
    pitch_rad: degrees(43.0),
    roll_rad: degrees(9.0),
};

/// The pose of [`cylinder`]: the top and the side are seen.
pub const CYLINDER_POSE: Pose = Pose {
    yaw_rad: 0.0,
    pitch_rad: degrees(42.0),
    roll_rad: degrees(5.0),
};

/// A box with a gable roof, seen obliquely from above, so that four faces show.
///
/// Faces, in order: floor, the two gable ends, the two sides, the two slopes of the roof.
#[must_use]
pub fn house() -> Body {
    house_in(HOUSE_POSE)
}

/// [`house`] in another pose.
#[must_use]
pub fn house_in(pose: Pose) -> Body {
    // Half width across the gable, half length along the ridge, eaves and ridge heights.
    const WIDTH: f64 = 33.0;
    const LENGTH: f64 = 40.0;
    const EAVES: f64 = 38.0;
    const RIDGE: f64 = 60.0;
    let corners: Vec<Vec3> = [-LENGTH, LENGTH]
        .into_iter()
        .flat_map(|z| {
            [
                Vec3::new(-WIDTH, 0.0, z),
                Vec3::new(WIDTH, 0.0, z),
                Vec3::new(-WIDTH, EAVES, z),
                Vec3::new(WIDTH, EAVES, z),
                Vec3::new(0.0, RIDGE, z),
            ]
        })
        .map(|corner| pose.apply(corner))
        .collect();
    let (low, high) = extent(&corners);
    let (scale, centre) = fit(low, high);
    let slope = Vec3::new(RIDGE - EAVES, WIDTH, 0.0).normalize();
    let planes = [
        (Vec3::NEG_Y, 0.0),
        (Vec3::Z, LENGTH),
        (Vec3::NEG_Z, LENGTH),
        (Vec3::X, WIDTH),
        (Vec3::NEG_X, WIDTH),
        (slope, slope.y * RIDGE),
        (Vec3::new(-slope.x, slope.y, 0.0), slope.y * RIDGE),
    ];
    let faces = planes
        .into_iter()
        .map(|(normal, offset)| {
            let normal = pose.apply(normal).normalize();
            Surface::Plane {
                normal,
                offset_mm: (offset - normal.dot(centre)) * scale,
            }
        })
        .collect();
    let solid =
        ConvexSolid::new(faces).with_extent_mm((low - centre) * scale, (high - centre) * scale);
    Body::Solid(solid)
}

/// An upright cylinder seen obliquely from above, so that its top and its side show.
///
/// Faces, in order: side, top, bottom.
#[must_use]
pub fn cylinder() -> Body {
    cylinder_in(CYLINDER_POSE)
}

/// [`cylinder`] in another pose.
#[must_use]
pub fn cylinder_in(pose: Pose) -> Body {
    const RADIUS: f64 = 39.0;
    const HEIGHT: f64 = 72.0;
    let axis = pose.apply(Vec3::Y).normalize();
    // A disc reaches as far along an axis as its normal leans away from that axis.
    let reach = Vec3::new(
        libm::sqrt(1.0 - axis.x * axis.x),
        libm::sqrt(1.0 - axis.y * axis.y),
        libm::sqrt(1.0 - axis.z * axis.z),
    ) * RADIUS
        + axis.abs() * (HEIGHT / 2.0);
    let scale = EXTENT_MM / (2.0 * reach.max_element());
    let half_mm = HEIGHT / 2.0 * scale;
    let faces = vec![
        Surface::Cylinder {
            base_mm: axis * -half_mm,
            axis,
            radius_mm: RADIUS * scale,
        },
        Surface::Plane {
            normal: axis,
            offset_mm: half_mm,
        },
        Surface::Plane {
            normal: -axis,
            offset_mm: half_mm,
        },
    ];
    Body::Solid(ConvexSolid::new(faces).with_extent_mm(-reach * scale, reach * scale))
}

/// A seated animal of balls and rods: slopes of every steepness, overhangs and shadows, for
/// judging a preset against scans of sculpture.
#[must_use]
pub fn figure() -> Vec<Body> {
    let ball = |centre_mm: Vec3, radius_mm: f64| {
        let reach = Vec3::splat(radius_mm);
        Body::Solid(
            ConvexSolid::new(vec![Surface::Sphere {
                centre_mm,
                radius_mm,
            }])
            .with_extent_mm(centre_mm - reach, centre_mm + reach),
        )
    };
    let rod = |from_mm: Vec3, to_mm: Vec3, radius_mm: f64| {
        let axis = (to_mm - from_mm).normalize();
        let reach = Vec3::splat(radius_mm);
        Body::Solid(
            ConvexSolid::new(vec![
                Surface::Cylinder {
                    base_mm: from_mm,
                    axis,
                    radius_mm,
                },
                Surface::Plane {
                    normal: axis,
                    offset_mm: axis.dot(to_mm),
                },
                Surface::Plane {
                    normal: -axis,
                    offset_mm: -axis.dot(from_mm),
                },
            ])
            .with_extent_mm(from_mm.min(to_mm) - reach, from_mm.max(to_mm) + reach),
        )
    };
    vec![
        ball(Vec3::new(8.0, -28.0, 0.0), 42.0),
        ball(Vec3::new(-20.0, -44.0, 18.0), 26.0),
        ball(Vec3::new(-18.0, 20.0, 14.0), 25.0),
        ball(Vec3::new(-32.0, 14.0, 30.0), 11.0),
        rod(
            Vec3::new(-14.0, 30.0, 10.0),
            Vec3::new(-8.0, 76.0, 0.0),
            7.5,
        ),
        rod(
            Vec3::new(-24.0, 30.0, 6.0),
            Vec3::new(-32.0, 74.0, -6.0),
            7.5,
        ),
        ball(Vec3::new(-18.0, -66.0, 34.0), 10.0),
        ball(Vec3::new(47.0, -52.0, -4.0), 12.0),
        // A hump, and the tip of a drooping ear before it: seen from below, y runs backwards.
        ball(Vec3::new(6.0, 44.0, -34.0), 24.0),
        ball(Vec3::new(6.0, 57.0, 12.0), 6.0),
    ]
}

/// A straight groove with sloping flanks, such as profile sensors are tried on.
///
/// 76 mm across (along y), 20 mm deep, 100 mm long.
#[must_use]
pub fn groove() -> Vec<Body> {
    const LENGTH_MM: f64 = 50.0;
    // Convex pieces side by side: shoulder, flank, bottom, flank, shoulder. Each is the part
    // of a strip in y that lies under a line z = height + slope y.
    let strips: [(f64, f64, f64, f64); 5] = [
        (-38.0, -20.0, 10.0, 0.0),
        (-20.0, -8.0, 10.0, -18.0 / 12.0),
        (-8.0, 8.0, -8.0, 0.0),
        (8.0, 20.0, -8.0, 18.0 / 12.0),
        (20.0, 38.0, 10.0, -0.1),
    ];
    strips
        .into_iter()
        .map(|(low_mm, high_mm, height_mm, slope)| {
            let normal = Vec3::new(0.0, -slope, 1.0).normalize();
            let faces = vec![
                Surface::Plane {
                    normal,
                    offset_mm: normal.dot(Vec3::new(0.0, low_mm, height_mm)),
                },
                Surface::Plane {
                    normal: Vec3::NEG_Y,
                    offset_mm: -low_mm,
                },
                Surface::Plane {
                    normal: Vec3::Y,
                    offset_mm: high_mm,
                },
                Surface::Plane {
                    normal: Vec3::X,
                    offset_mm: LENGTH_MM,
                },
                Surface::Plane {
                    normal: Vec3::NEG_X,
                    offset_mm: LENGTH_MM,
                },
                Surface::Plane {
                    normal: Vec3::NEG_Z,
                    offset_mm: 10.0,
                },
            ];
            let top = height_mm.max(height_mm + slope * (high_mm - low_mm));
            Body::Solid(ConvexSolid::new(faces).with_extent_mm(
                Vec3::new(-LENGTH_MM, low_mm, -10.0),
                Vec3::new(LENGTH_MM, high_mm, top),
            ))
        })
        .collect()
}

fn extent(points: &[Vec3]) -> (Vec3, Vec3) {
    points
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
            (low.min(*p), high.max(*p))
        })
}

/// Scale and centre that bring a box to [`EXTENT_MM`] around the origin.
fn fit(low: Vec3, high: Vec3) -> (f64, Vec3) {
    (EXTENT_MM / (high - low).max_element(), (low + high) / 2.0)
}
