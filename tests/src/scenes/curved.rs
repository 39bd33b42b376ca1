//! Curved faces beside flat ones: drums, lying cylinders, domes, cones, tori, capsules, on a
//! slab or on a free-form ground.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use sim_scanner::scene::{Body, Surface};

use super::dice::Dice;
use super::shapes::{Half, Pose, block, half, polyhedron, round, sheet};

/// The kind of scene and its bodies.
pub(super) fn draw(dice: &mut Dice) -> (&'static str, Vec<Body>) {
    let up = dice.direction(0.5);
    let pose = Pose::leaning(dice.turn(), up, DVec3::ZERO);
    let (kind, mut bodies) = match dice.count(0, 9) {
        0 | 1 => {
            let leaning = Pose::leaning(0.0, dice.direction(0.95), DVec3::ZERO);
            return ("shaft", shaft(dice, &leaning));
        }
        2..=4 => ("free-form ground", free_form(dice, &pose)),
        _ => {
            let slab = polyhedron(&block(50.0, 45.0, 10.0), &pose);
            ("slab", slab.into_iter().collect())
        }
    };
    for _ in 0..dice.count(1, 3) {
        let shift = DVec3::new(dice.between(-24.0, 24.0), dice.between(-22.0, 22.0), 10.0);
        let place = pose.after(&Pose::upright(dice.turn(), shift));
        match dice.count(0, 6) {
            0 => bodies.push(drum(dice, &place)),
            1 => bodies.push(lying(dice, &place)),
            2 => bodies.push(dome(dice, &place)),
            3 => bodies.push(cone(dice, &place)),
            4 => bodies.extend(torus(dice, &place)),
            5 => bodies.extend(capsule(dice, &place)),
            _ => bodies.extend(polyhedron(
                &block(
                    dice.between(8.0, 18.0),
                    dice.between(8.0, 18.0),
                    dice.between(8.0, 30.0),
                ),
                &place,
            )),
        }
    }
    (kind, bodies)
}

/// The side of a cylinder about the local z axis between two heights.
fn cylinder(radius_mm: f64, low: f64, high: f64, pose: &Pose) -> Body {
    let side = Surface::Cylinder {
        base_mm: DVec3::ZERO,
        axis: DVec3::Z,
        radius_mm,
    };
    let reach = DVec3::new(radius_mm, radius_mm, 0.0);
    let extent = (DVec3::Z * low - reach, DVec3::Z * high + reach);
    round(side, &ends(low, high), extent, pose)
}

fn ends(low: f64, high: f64) -> [Half; 2] {
    [half(DVec3::Z, high), half(DVec3::NEG_Z, -low)]
}

/// A stepped shaft: one drum on another.
fn shaft(dice: &mut Dice, pose: &Pose) -> Vec<Body> {
    let mut radius = dice.between(32.0, 45.0);
    let mut height = -30.0;
    let mut bodies = Vec::new();
    for _ in 0..dice.count(2, 3) {
        let top = height + dice.between(14.0, 30.0);
        bodies.push(cylinder(radius, height, top, pose));
        height = top;
        radius -= dice.between(3.0, 12.0);
    }
    bodies
}

fn drum(dice: &mut Dice, place: &Pose) -> Body {
    let (radius, height) = (dice.between(9.0, 24.0), dice.between(3.0, 35.0));
    cylinder(radius, -10.0, height, place)
}

/// A cylinder along the ground, sunk into it.
fn lying(dice: &mut Dice, place: &Pose) -> Body {
    let radius_mm = dice.between(8.0, 22.0);
    let depth = radius_mm * dice.between(-0.6, 0.7);
    let length = dice.between(15.0, 35.0);
    let side = Surface::Cylinder {
        base_mm: DVec3::new(0.0, 0.0, depth),
        axis: DVec3::X,
        radius_mm,
    };
    let caps = [half(DVec3::X, length), half(DVec3::NEG_X, length)];
    let extent = (
        DVec3::new(-length, -radius_mm, -5.0),
        DVec3::new(length, radius_mm, depth + radius_mm),
    );
    round(side, &caps, extent, place)
}

/// A ball, more or less sunk into the ground, some with a flat top.
fn dome(dice: &mut Dice, place: &Pose) -> Body {
    let radius_mm = dice.between(12.0, 30.0);
    let depth = radius_mm * dice.between(-0.7, 0.4);
    let side = Surface::Sphere {
        centre_mm: DVec3::new(0.0, 0.0, depth),
        radius_mm,
    };
    let share = if dice.chance(0.4) {
        dice.between(0.4, 0.9)
    } else {
        2.0
    };
    let top = depth + radius_mm * share;
    let extent = (
        DVec3::new(-radius_mm, -radius_mm, -5.0),
        DVec3::new(radius_mm, radius_mm, top.min(depth + radius_mm)),
    );
    round(side, &ends(-200.0, top), extent, place)
}

/// A cone, or a frustum of one.
fn cone(dice: &mut Dice, place: &Pose) -> Body {
    let half_angle_rad = dice.degrees(20.0, 65.0);
    let base = dice.between(14.0, 28.0);
    let apex = base / libm::tan(half_angle_rad);
    let top = if dice.chance(0.6) {
        apex * dice.between(0.4, 0.8)
    } else {
        apex + 1.0
    };
    let side = Surface::Cone {
        apex_mm: DVec3::Z * apex,
        axis: DVec3::NEG_Z,
        half_angle_rad,
    };
    let extent = (
        DVec3::new(-base, -base, 0.0),
        DVec3::new(base, base, top.min(apex)),
    );
    round(side, &ends(0.0, top), extent, place)
}

/// A ring sunk into the ground to about its middle.
fn torus(dice: &mut Dice, place: &Pose) -> Option<Body> {
    let (ring, tube) = (dice.between(15.0, 26.0), dice.between(6.0, 11.0));
    let depth = tube * dice.between(-0.5, 0.4);
    let point = |u: f64, v: f64| {
        let (sin_u, cos_u) = libm::sincos(u * TAU);
        let (sin_v, cos_v) = libm::sincos(v * TAU);
        let out = ring + tube * cos_v;
        DVec3::new(out * cos_u, out * sin_u, depth + tube * sin_v)
    };
    // Chords of this many steps stay within 6 um of the torus.
    sheet((240, 120), point, place)
}

/// A cylinder with round ends that join it smoothly: one face.
fn capsule(dice: &mut Dice, place: &Pose) -> Vec<Body> {
    let radius_mm = dice.between(9.0, 16.0);
    let length = dice.between(8.0, 24.0);
    let height = radius_mm * dice.between(-0.4, 0.6);
    let reach = DVec3::splat(radius_mm);
    let side = Surface::Cylinder {
        base_mm: DVec3::Z * height,
        axis: DVec3::X,
        radius_mm,
    };
    let end = DVec3::X * length;
    let caps = [half(DVec3::X, length), half(DVec3::NEG_X, length)];
    let up = DVec3::Z * height;
    let mut bodies = vec![round(
        side,
        &caps,
        (up - end - reach, up + end + reach),
        place,
    )];
    for centre_mm in [up - end, up + end] {
        let ball = Surface::Sphere {
            centre_mm,
            radius_mm,
        };
        bodies.push(round(
            ball,
            &[],
            (centre_mm - reach, centre_mm + reach),
            place,
        ));
    }
    bodies
}

/// Hills and hollows over a square: waves of 40 to 120 mm, too long for creases.
fn free_form(dice: &mut Dice, pose: &Pose) -> Vec<Body> {
    let waves: Vec<(f64, f64, f64, f64)> = (0..dice.count(3, 6))
        .map(|_| {
            let length = dice.between(40.0, 120.0);
            // Radius of curvature above 12 mm each, slopes below 0.4.
            let height = length / TAU * dice.between(0.1, 0.35);
            let (sin, cos) = libm::sincos(dice.turn());
            (
                height,
                TAU / length * cos,
                TAU / length * sin,
                dice.between(-PI, PI),
            )
        })
        .collect();
    let share = libm::sqrt(waves.len() as f64);
    let point = |u: f64, v: f64| {
        let (x, y) = ((u - 0.5) * 100.0, (v - 0.5) * 90.0);
        let waves = waves.iter();
        let z: f64 = waves
            .map(|(height, kx, ky, phase)| height * libm::sin(kx * x + ky * y + phase))
            .sum();
        DVec3::new(x, y, 10.0 + z / share)
    };
    sheet((200, 180), point, pose).into_iter().collect()
}
