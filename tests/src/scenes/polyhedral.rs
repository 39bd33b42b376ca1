//! Polyhedra about 100 mm wide: gems, heaps of blocks, terraces, folded plates, frusta.

use glam::DVec3;
use sim_scanner::scene::Body;

use super::dice::Dice;
use super::shapes::{Half, Pose, block, frustum, half, polyhedron, roof};

/// The kind of scene and its bodies.
pub(super) fn draw(dice: &mut Dice) -> (&'static str, Vec<Body>) {
    match dice.count(0, 4) {
        0 => ("gem", gem(dice)),
        1 => ("blocks", blocks(dice)),
        2 => ("terraces", terraces(dice)),
        3 => ("folds", folds(dice)),
        _ => ("frusta", frusta(dice)),
    }
}

fn lean(dice: &mut Dice, most_degrees: f64) -> Pose {
    let up = dice.direction(most_degrees.to_radians());
    Pose::leaning(dice.turn(), up, DVec3::ZERO)
}

/// One convex solid with facets all around.
fn gem(dice: &mut Dice) -> Vec<Body> {
    let mut halves: Vec<Half> = (0..dice.count(5, 13))
        .map(|_| half(dice.direction(1.3), dice.between(30.0, 45.0)))
        .collect();
    halves.extend(block(50.0, 50.0, 60.0).into_iter().take(4));
    halves.push(half(DVec3::NEG_Z, 20.0));
    let pose = lean(dice, 30.0);
    polyhedron(&halves, &pose).into_iter().collect()
}

/// Boxes that cut into each other.
fn blocks(dice: &mut Dice) -> Vec<Body> {
    (0..dice.count(2, 4))
        .filter_map(|_| {
            let halves = block(
                dice.between(14.0, 40.0),
                dice.between(14.0, 40.0),
                dice.between(14.0, 60.0),
            );
            let shift = DVec3::new(
                dice.between(-25.0, 25.0),
                dice.between(-25.0, 25.0),
                dice.between(-15.0, 15.0),
            );
            let pose = Pose::leaning(dice.turn(), dice.direction(0.9), shift);
            polyhedron(&halves, &pose)
        })
        .collect()
}

/// Slabs on a slab, from 1 mm thick, some with a bevel.
fn terraces(dice: &mut Dice) -> Vec<Body> {
    let pose = lean(dice, 30.0);
    let base = block(50.0, 45.0, 15.0);
    let mut bodies: Vec<Body> = polyhedron(&base, &pose).into_iter().collect();
    for _ in 0..dice.count(2, 4) {
        let (x, y) = (dice.between(10.0, 32.0), dice.between(10.0, 32.0));
        let height = 15.0
            + if dice.chance(0.6) {
                dice.between(1.0, 4.0)
            } else {
                dice.between(4.0, 25.0)
            };
        let mut halves = block(x, y, height);
        if dice.chance(0.4) {
            let slope = dice.degrees(12.0, 60.0);
            let (sin, cos) = libm::sincos(slope);
            let start = dice.between(-0.2, 0.8) * x;
            halves.push(half(DVec3::new(sin, 0.0, cos), start * sin + height * cos));
        }
        let shift = DVec3::new(dice.between(-30.0, 30.0), dice.between(-25.0, 25.0), 0.0);
        let place = Pose::upright(dice.turn(), shift);
        bodies.extend(polyhedron(&halves, &pose.after(&place)));
    }
    bodies
}

/// Strips side by side with slopes 10 to 60 degrees apart, some a step higher or lower.
fn folds(dice: &mut Dice) -> Vec<Body> {
    let pose = lean(dice, 25.0);
    let strips = dice.count(3, 8);
    let width = 100.0 / strips as f64;
    let ground = -25.0;
    let (mut height, mut slope) = (0.0, dice.degrees(-25.0, 25.0));
    let mut bodies = Vec::new();
    for k in 0..strips {
        let low = -50.0 + width * k as f64;
        let normal = DVec3::new(-libm::sin(slope), 0.0, libm::cos(slope));
        let halves = [
            half(normal, normal.dot(DVec3::new(low, 0.0, height))),
            half(DVec3::NEG_X, -low),
            half(DVec3::X, low + width),
            half(DVec3::Y, 42.0),
            half(DVec3::NEG_Y, 42.0),
            half(DVec3::NEG_Z, -ground),
        ];
        bodies.extend(polyhedron(&halves, &pose));
        height += width * libm::tan(slope);
        if dice.chance(0.3) {
            let step = dice.between(1.0, 6.0);
            height += if dice.chance(0.5) { step } else { -step };
        }
        // Back towards the level the further the strips have gone from it.
        let turn = dice.degrees(10.0, 60.0);
        let downwards = if height.abs() > 12.0 {
            height > 0.0
        } else {
            dice.chance(0.5)
        };
        slope = (slope + if downwards { -turn } else { turn }).clamp(-0.8, 0.8);
    }
    bodies
}

/// Pyramids with their tops cut off, and roofs, on a slab.
fn frusta(dice: &mut Dice) -> Vec<Body> {
    let pose = lean(dice, 30.0);
    let mut bodies: Vec<Body> = polyhedron(&block(50.0, 45.0, 10.0), &pose)
        .into_iter()
        .collect();
    for _ in 0..dice.count(1, 3) {
        let halves = if dice.chance(0.3) {
            roof(
                dice.between(10.0, 22.0),
                dice.between(12.0, 30.0),
                dice.between(8.0, 20.0),
                dice.degrees(10.0, 50.0),
            )
        } else {
            frustum(
                dice.count(3, 6),
                dice.between(14.0, 30.0),
                dice.degrees(12.0, 70.0),
                dice.between(12.0, 40.0),
            )
        };
        let shift = DVec3::new(dice.between(-25.0, 25.0), dice.between(-25.0, 25.0), 5.0);
        let place = Pose::upright(dice.turn(), shift);
        bodies.extend(polyhedron(&halves, &pose.after(&place)));
    }
    bodies
}
