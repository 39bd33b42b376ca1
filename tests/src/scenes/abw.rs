//! After the ABW structured-light images: polyhedra on a floor, mostly before a wall.

use glam::{DMat3, DVec3};
use sim_scanner::scene::{Body, ConvexSolid, Surface};

use super::dice::Dice;
use super::shapes::{Half, Pose, block, frustum, half, polyhedron, roof};

/// Half the width of the stage that is seen, millimetres.
const REACH_MM: f64 = 85.0;

/// The kind of scene and its bodies.
///
/// The stage's frame has z upwards from the floor and the wall at y > 0; the camera looks
/// down on it at a slant.
pub(super) fn draw(dice: &mut Dice) -> (&'static str, Vec<Body>) {
    let tilt = dice.degrees(32.0, 52.0);
    let spin = dice.degrees(-12.0, 12.0);
    let pose = Pose {
        turn: DMat3::from_rotation_x(-tilt) * DMat3::from_rotation_z(spin),
        shift_mm: DVec3::ZERO,
    };
    let wall = dice.chance(0.8).then(|| dice.between(35.0, 55.0));
    let mut bodies = stage(&pose, wall);
    for _ in 0..dice.count(3, 5) {
        object(dice, &pose, &mut bodies);
    }
    (
        if wall.is_some() {
            "floor and wall"
        } else {
            "floor"
        },
        bodies,
    )
}

/// Planes without end; what is stated as their extent is what the scan covers of them.
fn stage(pose: &Pose, wall: Option<f64>) -> Vec<Body> {
    let mut halves = vec![half(DVec3::Z, 0.0)];
    halves.extend(wall.map(|y| half(DVec3::NEG_Y, -y)));
    let back = wall.unwrap_or(60.0);
    let rise = if wall.is_some() { 45.0 } else { 20.0 };
    let seen = [
        DVec3::new(-REACH_MM, -55.0, 0.0),
        DVec3::new(REACH_MM, -55.0, 0.0),
        DVec3::new(-REACH_MM, back, 0.0),
        DVec3::new(REACH_MM, back, 0.0),
        DVec3::new(0.0, back, rise),
    ]
    .map(|corner| pose.point(corner));
    let low = seen.iter().fold(DVec3::INFINITY, |l, p| l.min(*p));
    let high = seen.iter().fold(DVec3::NEG_INFINITY, |h, p| h.max(*p));
    let halves = halves.into_iter().map(|(normal, offset_mm)| {
        let normal = (pose.turn * normal).normalize();
        let plane = Surface::Plane {
            normal,
            offset_mm: offset_mm + normal.dot(pose.shift_mm),
        };
        Body::Solid(ConvexSolid::new(vec![plane]).with_extent_mm(low, high))
    });
    halves.collect()
}

/// A polyhedron on the floor, or two of them that stand together.
fn object(dice: &mut Dice, pose: &Pose, bodies: &mut Vec<Body>) {
    let shift = DVec3::new(dice.between(-60.0, 60.0), dice.between(-40.0, 25.0), 0.0);
    let place = pose.after(&Pose::upright(dice.turn(), shift));
    let (x, y, height) = (
        dice.between(9.0, 26.0),
        dice.between(9.0, 26.0),
        dice.between(12.0, 45.0),
    );
    match dice.count(0, 5) {
        0 => bodies.extend(polyhedron(&block(x, y, height), &place)),
        1 => bodies.extend(polyhedron(&wedge(dice, x, y, height), &place)),
        2 => {
            let prism = frustum(
                dice.count(3, 6),
                x.max(14.0),
                dice.degrees(0.0, 35.0),
                height,
            );
            bodies.extend(polyhedron(&prism, &place));
        }
        3 => bodies.extend(polyhedron(
            &roof(x, y, height * 0.6, dice.degrees(12.0, 50.0)),
            &place,
        )),
        4 => {
            // One block on another.
            bodies.extend(polyhedron(&block(x, y, height * 0.5), &place));
            let above = Pose::upright(dice.turn(), DVec3::Z * (height * 0.5 - 1.0));
            let upper = block(x * 0.6, y * 0.6, height * 0.4);
            bodies.extend(polyhedron(&upper, &place.after(&above)));
        }
        _ => {
            // An L of two blocks.
            bodies.extend(polyhedron(&block(x, 8.0, height), &place));
            let beside = Pose::upright(0.0, DVec3::new(8.0 - x, y, 0.0));
            let lower = block(8.0, y, height * dice.between(0.4, 0.8));
            bodies.extend(polyhedron(&lower, &place.after(&beside)));
        }
    }
}

/// A block with a slanting top.
fn wedge(dice: &mut Dice, x: f64, y: f64, height: f64) -> Vec<Half> {
    let mut halves = block(x, y, height);
    let (sin, cos) = libm::sincos(dice.degrees(12.0, 45.0));
    halves.push(half(DVec3::new(sin, 0.0, cos), height * 0.7 * cos));
    halves
}
