//! References to calibrate with and to be judged by: spheres, ball bars, step gauges, plates.
//!
//! They stand in a measuring volume whose middle is the origin, so that the scanner stays where it
//! is while they are moved about.

use super::{Body, ConvexSolid, Material, Scene, Surface};
use crate::Vec3;

/// How a reference is made and placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Artefact {
    /// Diameter of spheres, millimetres.
    pub diameter_mm: f64,
    /// Places of the spheres' centres, or of the middle of a gauge or plate, millimetres; none for
    /// the usual ones.
    pub at_mm: Vec<Vec3>,
    /// How a gauge or plate is turned about x, then about y, degrees.
    pub tilt_deg: (f64, f64),
}

impl Default for Artefact {
    fn default() -> Self {
        Self {
            diameter_mm: 25.4,
            at_mm: Vec::new(),
            tilt_deg: (0.0, 0.0),
        }
    }
}

/// Heights of the step gauge's treads, towards the camera, millimetres.
pub const STEP_HEIGHTS_MM: [f64; 5] = [0.0, 10.0, 20.0, 30.0, 40.0];
/// Length of a tread along y and width along x, millimetres.
const TREAD_MM: (f64, f64) = (18.0, 40.0);
/// Size of the plate along x and y, millimetres.
const PLATE_MM: (f64, f64) = (80.0, 80.0);
const THICK_MM: f64 = 10.0;
/// What a proposed scan takes in around a reference, millimetres: a head that is mounted askew
/// looks beside where it thinks.
const AROUND_MM: f64 = 15.0;
/// Diameter of a bar between two spheres, as a share of theirs.
const BAR: f64 = 0.3;

/// The reference of this name; `None` for other names.
///
/// # Errors
/// What is wrong with its size or places, in words.
pub fn scene(name: &str, artefact: &Artefact, material: Material) -> Option<Result<Scene, String>> {
    let or = |usual: &[Vec3]| {
        if artefact.at_mm.is_empty() {
            usual.to_vec()
        } else {
            artefact.at_mm.clone()
        }
    };
    let bodies = match name {
        "sphere" => balls(artefact.diameter_mm, &or(&[Vec3::ZERO])),
        "spheres" => balls(
            artefact.diameter_mm,
            &or(&[
                Vec3::new(0.0, 0.0, 0.0),
                Vec3::new(-40.0, -38.0, 20.0),
                Vec3::new(40.0, -38.0, -20.0),
                Vec3::new(-40.0, 38.0, -20.0),
                Vec3::new(40.0, 38.0, 20.0),
            ]),
        ),
        "ball-bar" => {
            let ends = or(&[Vec3::new(0.0, -40.0, 0.0), Vec3::new(0.0, 40.0, 0.0)]);
            bar(artefact.diameter_mm, &ends)
        }
        "step-gauge" => Ok(gauge(&tilted(artefact, or(&[Vec3::ZERO])))),
        "plate" => {
            let (wide, high) = PLATE_MM;
            let low = Vec3::new(-wide / 2.0, -high / 2.0, -THICK_MM);
            let high = Vec3::new(wide / 2.0, high / 2.0, 0.0);
            Ok(vec![block(low, high, &tilted(artefact, or(&[Vec3::ZERO])))])
        }
        _ => return None,
    };
    Some(bodies.map(|bodies| {
        let scene = Scene::new(bodies, material).with_middle_mm(Vec3::ZERO);
        let (low, high) = scene.object_extent_mm();
        let around = Vec3::splat(AROUND_MM);
        scene.with_view_mm(low - around, high + around)
    }))
}

fn balls(diameter_mm: f64, centres: &[Vec3]) -> Result<Vec<Body>, String> {
    if !(1.0..=200.0).contains(&diameter_mm) {
        return Err(format!(
            "a sphere's diameter must lie between 1 and 200 mm, not {diameter_mm}"
        ));
    }
    let radius_mm = diameter_mm / 2.0;
    let reach = Vec3::splat(radius_mm);
    Ok(centres
        .iter()
        .map(|&centre_mm| {
            let ball = Surface::Sphere {
                centre_mm,
                radius_mm,
            };
            let solid = ConvexSolid::new(vec![ball]);
            Body::Solid(solid.with_extent_mm(centre_mm - reach, centre_mm + reach))
        })
        .collect())
}

fn bar(diameter_mm: f64, ends: &[Vec3]) -> Result<Vec<Body>, String> {
    let &[from, to] = ends else {
        return Err(format!(
            "a ball bar has two spheres, not {}: give two places",
            ends.len()
        ));
    };
    let mut bodies = balls(diameter_mm, ends)?;
    let axis = (to - from).normalize_or_zero();
    if from.distance(to) <= diameter_mm {
        return Err("the two spheres of a ball bar must not touch".into());
    }
    let radius_mm = BAR * diameter_mm / 2.0;
    let reach = Vec3::splat(radius_mm);
    let rod = ConvexSolid::new(vec![
        Surface::Cylinder {
            base_mm: from,
            axis,
            radius_mm,
        },
        Surface::Plane {
            normal: axis,
            offset_mm: axis.dot(to),
        },
        Surface::Plane {
            normal: -axis,
            offset_mm: -axis.dot(from),
        },
    ]);
    bodies.push(Body::Solid(
        rod.with_extent_mm(from.min(to) - reach, from.max(to) + reach),
    ));
    Ok(bodies)
}

/// A turn about x, then about y, and a shift.
struct Tilt {
    columns: [Vec3; 3],
    at_mm: Vec3,
}

impl Tilt {
    fn turn(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.columns;
        x * v.x + y * v.y + z * v.z
    }
}

fn tilted(artefact: &Artefact, at: Vec<Vec3>) -> Tilt {
    let (about_x, about_y) = artefact.tilt_deg;
    let (sin_x, cos_x) = libm::sincos(about_x.to_radians());
    let (sin_y, cos_y) = libm::sincos(about_y.to_radians());
    let about_y = |v: Vec3| Vec3::new(cos_y * v.x + sin_y * v.z, v.y, cos_y * v.z - sin_y * v.x);
    Tilt {
        columns: [
            about_y(Vec3::X),
            about_y(Vec3::new(0.0, cos_x, sin_x)),
            about_y(Vec3::new(0.0, -sin_x, cos_x)),
        ],
        at_mm: at.first().copied().unwrap_or(Vec3::ZERO),
    }
}

fn gauge(tilt: &Tilt) -> Vec<Body> {
    let (long, wide) = TREAD_MM;
    let count = STEP_HEIGHTS_MM.len() as f64;
    let middle_mm = STEP_HEIGHTS_MM.iter().sum::<f64>() / count;
    (0..)
        .zip(STEP_HEIGHTS_MM)
        .map(|(k, height): (i32, f64)| {
            let from = (f64::from(k) - count / 2.0) * long;
            let low = Vec3::new(-wide / 2.0, from, -middle_mm - THICK_MM);
            let high = Vec3::new(wide / 2.0, from + long, height - middle_mm);
            block(low, high, tilt)
        })
        .collect()
}

/// A cuboid, tilted about the origin and then shifted.
fn block(low: Vec3, high: Vec3, tilt: &Tilt) -> Body {
    let plane = |normal: Vec3, offset: f64| {
        let normal = tilt.turn(normal);
        Surface::Plane {
            normal,
            offset_mm: offset + normal.dot(tilt.at_mm),
        }
    };
    let faces = vec![
        plane(Vec3::Z, high.z),
        plane(Vec3::NEG_Z, -low.z),
        plane(Vec3::X, high.x),
        plane(Vec3::NEG_X, -low.x),
        plane(Vec3::Y, high.y),
        plane(Vec3::NEG_Y, -low.y),
    ];
    let corners = (0..8).map(|k| {
        let pick = |bit: u32, low: f64, high: f64| if k >> bit & 1 == 1 { high } else { low };
        let corner = Vec3::new(
            pick(0, low.x, high.x),
            pick(1, low.y, high.y),
            pick(2, low.z, high.z),
        );
        tilt.turn(corner) + tilt.at_mm
    });
    let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), c| {
        (low.min(c), high.max(c))
    });
    Body::Solid(ConvexSolid::new(faces).with_extent_mm(low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(name: &str, artefact: &Artefact) -> Scene {
        scene(name, artefact, Material::PLASTER)
            .expect("a reference")
            .expect("in range")
    }

    #[test]
    fn spheres_stand_where_they_are_put() {
        let artefact = Artefact {
            diameter_mm: 20.0,
            at_mm: vec![Vec3::new(5.0, 0.0, 3.0), Vec3::new(-30.0, 0.0, 0.0)],
            ..Artefact::default()
        };
        let scene = made("sphere", &artefact);
        assert_eq!(scene.middle_mm, Some(Vec3::ZERO));
        let hit = scene.cast(Vec3::new(5.0, 0.0, 700.0), Vec3::NEG_Z);
        assert!((hit.expect("on the ball").point_mm.z - 13.0).abs() < 1e-12);
    }

    #[test]
    fn the_treads_of_a_tilted_gauge_keep_their_distances() {
        let artefact = Artefact {
            tilt_deg: (7.0, -4.0),
            at_mm: vec![Vec3::new(3.0, 2.0, 1.0)],
            ..Artefact::default()
        };
        let scene = made("step-gauge", &artefact);
        let tilt = tilted(&artefact, artefact.at_mm.clone());
        let normal = tilt.turn(Vec3::Z);
        let heights: Vec<f64> = (0..5)
            .map(|k| {
                let middle = Vec3::new(0.0, (f64::from(k) - 2.0) * 18.0, 0.0);
                let above = tilt.turn(middle) + tilt.at_mm + normal * 300.0;
                let hit = scene.cast(above, -normal).expect("on a tread");
                assert!(hit.normal.distance(normal) < 1e-12);
                300.0 - hit.distance_mm
            })
            .collect();
        for (height, known) in heights.iter().zip(STEP_HEIGHTS_MM) {
            assert!((height - heights[0] - known).abs() < 1e-9, "{heights:?}");
        }
    }

    #[test]
    fn what_cannot_be_made_is_refused() {
        let one = Artefact {
            at_mm: vec![Vec3::ZERO],
            ..Artefact::default()
        };
        let bar = scene("ball-bar", &one, Material::PLASTER).expect("a reference");
        assert!(bar.expect_err("one end").contains("two spheres"));
        let odd = Artefact {
            diameter_mm: f64::NAN,
            ..Artefact::default()
        };
        let ball = scene("sphere", &odd, Material::PLASTER).expect("a reference");
        assert!(ball.is_err());
        assert!(scene("house", &odd, Material::PLASTER).is_none());
    }
}
