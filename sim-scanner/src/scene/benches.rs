//! Built-in objects as they stand in a laboratory: on a table, before a back plane.

use super::figures::{self, CYLINDER_POSE, HOUSE_POSE, Pose};
use super::{Body, ConvexSolid, Material, Scene, Surface};
use crate::Vec3;

/// Free table around the object that a proposed scan takes in, millimetres.
const AROUND_MM: f64 = 25.0;
/// How much deeper than table and object the corner between table and wall may lie,
/// millimetres.
const CORNER_MM: f64 = 30.0;
/// Gap between the object and the plane behind it, millimetres.
const GAP_MM: f64 = 12.0;

/// [`figures::house`] on a table, with a wall square to the table behind it.
#[must_use]
pub fn house_on_table(material: Material) -> Scene {
    const FLOOR: usize = 0;
    on_table(figures::house(), FLOOR, HOUSE_POSE, material)
}

/// [`figures::cylinder`] on a table, with a wall square to the table behind it.
#[must_use]
pub fn cylinder_on_table(material: Material) -> Scene {
    const BOTTOM: usize = 2;
    on_table(figures::cylinder(), BOTTOM, CYLINDER_POSE, material)
}

/// [`figures::house`], held in the air before a plane square to the camera's axis.
#[must_use]
pub fn house_before_plane(material: Material) -> Scene {
    let scene = Scene::new(vec![figures::house()], material);
    let (low, high) = scene.object_extent_mm();
    let around = Vec3::splat(AROUND_MM);
    scene
        .with_back_plane(low.z - GAP_MM, material)
        .with_view_mm(low - around, high + around)
}

/// The solid's face `floor` lies on the table; the wall stands square to it, where the
/// solid's own turn about the upright does not matter.
fn on_table(solid: Body, floor: usize, pose: Pose, material: Material) -> Scene {
    let mut scene = Scene::new(vec![solid], material);
    let (low, high) = scene.object_extent_mm();
    let table = match scene.bodies.first() {
        Some((Body::Solid(solid), _)) => solid.faces().get(floor).and_then(|face| match *face {
            Surface::Plane { normal, offset_mm } => Some(half_space(-normal, -offset_mm)),
            _ => None,
        }),
        _ => None,
    };
    let bench = Pose {
        yaw_rad: 0.0,
        ..pose
    };
    let wall = bench.apply(Vec3::Z).normalize();
    // No corner of the box around the object lies behind its farthest along the normal.
    let behind_mm = (low * wall).min(high * wall).element_sum();
    let back = half_space(wall, behind_mm - GAP_MM);
    for body in table.into_iter().chain([back]) {
        scene.bodies.push((body, material));
    }
    let around = Vec3::splat(AROUND_MM);
    // Where table and wall meet lies deeper than the object.
    let corner = Vec3::new(0.0, 0.0, CORNER_MM);
    scene.with_view_mm(low - around - corner, high + around)
}

fn half_space(normal: Vec3, offset_mm: f64) -> Body {
    Body::Solid(ConvexSolid::new(vec![Surface::Plane { normal, offset_mm }]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FaceId;

    #[test]
    fn the_house_stands_before_the_wall_and_hides_the_table() {
        let scene = house_on_table(Material::PLASTER);
        assert_eq!((scene.bodies.len(), scene.object_bodies), (3, 1));
        let (low, high) = scene.object_extent_mm();
        let (view_low, view_high) = scene.view_extent_mm();
        assert_eq!(view_low, low - Vec3::new(25.0, 25.0, 55.0));
        assert_eq!(view_high, high + 25.0);
        let seen = |x: f64, y: f64| {
            let hit = scene.cast(Vec3::new(x, y, 750.0), Vec3::NEG_Z);
            hit.map(|hit| hit.face.body)
        };
        assert_eq!(seen(0.0, 0.0), Some(0));
        assert_eq!(seen(0.0, view_low.y), Some(1), "the table in front");
        assert_eq!(seen(0.0, view_high.y), Some(2), "the wall above");
    }

    #[test]
    fn every_bench_has_planes_all_around_the_object() {
        for scene in [
            house_on_table(Material::PLASTER),
            cylinder_on_table(Material::PLASTER),
            house_before_plane(Material::PLASTER),
        ] {
            let (low, high) = scene.view_extent_mm();
            for k in 0..=20 {
                let share = f64::from(k) / 20.0;
                let (x, y) = (
                    low.x + share * (high.x - low.x),
                    low.y + share * (high.y - low.y),
                );
                for (x, y) in [(x, low.y), (x, high.y), (low.x, y), (high.x, y)] {
                    let hit = scene.cast(Vec3::new(x, y, 750.0), Vec3::NEG_Z);
                    let face = hit.map(|hit| hit.face);
                    assert!(
                        matches!(face, Some(FaceId { body, .. }) if body > 0),
                        "{x} {y}: {face:?}"
                    );
                }
            }
        }
    }
}
