//! How often regularities are found that are there, and that are not, with seeded noise.

#![allow(missing_docs, dead_code)]

use crate::common;

use common::{
    Chance, Known, SIZE_MM, WELL, after, cone, cylinder, direction, fitted, found, plane, sphere,
};
use nalgebra::Vector3;
use regularize::{Fitted, Kind, Reason, Regularized, Settings, Target, regularize};
use shapes::Shape;

/// A frame turned anyhow.
fn frame(chance: &mut Chance) -> [Vector3<f64>; 3] {
    let z = chance.direction();
    let x = z.cross(&chance.direction()).normalize();
    [x, z.cross(&x), z]
}

/// Three pairs of planes square to each other, and two bores of radius 8 on one axis, with sizes
/// in whole millimetres.
fn block(chance: &mut Chance) -> Vec<Shape> {
    let [x, y, z] = frame(chance);
    let middle = chance.place();
    let at = |a: f64, b: f64, c: f64| middle + x * a + y * b + z * c;
    vec![
        plane(x, at(20.0, 3.0, -2.0)),
        plane(-x, at(-20.0, -4.0, 5.0)),
        plane(y, at(1.0, 15.0, 0.0)),
        plane(-y, at(-2.0, -15.0, 3.0)),
        plane(z, at(5.0, 1.0, 10.0)),
        plane(-z, at(-3.0, 2.0, -10.0)),
        cylinder(z, at(7.0, 2.0, 8.0), 8.0),
        cylinder(z, at(7.0, 2.0, -8.0), 8.0),
    ]
}

fn measured(chance: &mut Chance, shapes: &[Shape]) -> Vec<Fitted> {
    let known = |chance: &mut Chance| Known {
        turn_rad: WELL.turn_rad * chance.between(0.5, 2.0),
        place_mm: WELL.place_mm * chance.between(0.5, 2.0),
        size: 0.6 * WELL.size * chance.between(0.5, 1.5),
    };
    let each = shapes.iter().zip(1..);
    each.map(|(shape, label)| {
        let known = known(chance);
        chance.measured(label, shape, known)
    })
    .collect()
}

fn radius(shape: &Shape) -> Option<f64> {
    match shape {
        Shape::Cylinder(c) => Some(c.radius_mm),
        Shape::Sphere(s) => Some(s.radius_mm),
        _ => None,
    }
}

#[test]
fn the_regularities_of_a_block_are_found_and_make_it_truer() {
    const BLOCKS: u64 = 200;
    let mut whole = 0;
    let (mut before, mut now) = ([0.0; 2], [0.0; 2]);
    let (mut covered, mut told) = (0_usize, 0_usize);
    let (mut coaxial, mut equal, mut round) = (0, 0, 0);
    for seed in 0..BLOCKS {
        let mut chance = Chance::new(seed);
        let truth = block(&mut chance);
        let shapes = measured(&mut chance, &truth);
        let found = found(&shapes);
        let adjusted = after(&shapes, &found);
        let count = |kind: Kind| found.accepted.iter().filter(|own| own.kind == kind).count();
        coaxial += count(Kind::Coaxial);
        equal += count(Kind::EqualRadii);
        let is_8 = |own: &&regularize::Regularity| {
            own.kind == Kind::RoundRadius && own.target == Some(Target::Millimetres(8.0))
        };
        round += found.accepted.iter().filter(is_8).count();
        // All directions are square or parallel to each other, whatever was accepted for it.
        let directions: Vec<_> = adjusted.iter().map(direction).collect();
        let is_whole = directions.iter().enumerate().all(|(k, a)| {
            directions[k + 1..].iter().all(|b| {
                let cos = a.dot(b).abs();
                !(1e-8..=1.0 - 1e-12).contains(&cos)
            })
        });
        whole += usize::from(is_whole);
        for ((real, fit), own) in truth.iter().zip(&shapes).zip(&adjusted) {
            let off = |shape: &Shape| direction(shape).cross(&direction(real)).norm_squared();
            before[0] += off(&fit.shape);
            now[0] += off(own);
            if let Some(real) = radius(real) {
                before[1] += (radius(&fit.shape).unwrap() - real).powi(2);
                now[1] += (radius(own).unwrap() - real).powi(2);
            }
        }
        // The uncertainties are those of the errors, of what is not told to be without any.
        for own in &found.adjusted {
            let real = direction(&truth[usize::from(own.label) - 1]);
            let off = direction(&own.shape) - real;
            let spread = own.numbers.direction_rad.unwrap();
            let way = Vector3::new(0.3, -0.5, 0.8).cross(&real).normalize();
            told += 1;
            covered += usize::from(off.dot(&way).abs() <= 1.96 * spread.along(&way));
        }
    }
    let ratio = |k: usize| (now[k] / before[k]).sqrt();
    let share = 100.0 * covered as f64 / told as f64;
    println!(
        "of {BLOCKS} blocks {whole} are square, {coaxial} coaxial, {equal} of equal radii, {round} \
         of radius 8; errors of directions {:.3}, of radii {:.3} times those before; {share:.1} % \
         of directions within the 95 % interval",
        ratio(0),
        ratio(1)
    );
    for count in [whole, coaxial, equal, round] {
        assert!(count as f64 >= 0.95 * BLOCKS as f64, "{count}");
    }
    assert!(ratio(0) < 0.6 && ratio(1) < 0.5);
    assert!((92.0..=98.0).contains(&share), "{share}");
}

#[test]
fn a_plane_turned_by_five_deviations_is_not_squared_up() {
    const BLOCKS: u64 = 100;
    let mut wrong = 0;
    for seed in 0..BLOCKS {
        let mut chance = Chance::new(1000 + seed);
        let [x, y, z] = frame(&mut chance);
        let middle = chance.place();
        let both = 2.0_f64.sqrt() * WELL.turn_rad;
        let shapes: Vec<Fitted> = [
            plane(z, middle),
            plane(
                z + x * (5.0 * both),
                middle + x * 20.0 + y * 7.0 + z * 3.377,
            ),
        ]
        .iter()
        .zip(1..)
        .map(|(shape, label)| fitted(label, *shape, WELL))
        .collect();
        let found = found(&shapes);
        let is_parallel = |kind: Kind| kind == Kind::Parallel;
        wrong += found
            .accepted
            .iter()
            .filter(|own| is_parallel(own.kind))
            .count();
        let refused = found.refused.iter().find(|own| is_parallel(own.kind));
        let refused = refused.expect("it is told");
        assert_eq!(refused.reason, Reason::TooFar);
        assert!((refused.deviations - 5.0).abs() < 0.01);
        // With noise on top, it is off by two less at times, but not by more.
        let noisy: Vec<Fitted> = shapes
            .iter()
            .map(|own| chance.measured(own.label, &own.shape, WELL))
            .collect();
        wrong += usize::from(
            common::found(&noisy)
                .accepted
                .iter()
                .any(|own| is_parallel(own.kind)),
        );
    }
    println!("{wrong} of {BLOCKS} planes turned by 5 sigma are made parallel once noise is added");
    // A normal number beyond 2 and a half, the second number of the direction not helping.
    assert!(wrong <= 6, "{wrong}");
}

#[test]
fn radii_that_differ_by_six_deviations_stay_different() {
    let mut wrong = 0;
    for seed in 0..200 {
        let mut chance = Chance::new(2000 + seed);
        let radius_mm = chance.between(4.0, 20.0);
        let more = 6.0 * 2.0_f64.sqrt() * WELL.size;
        let (one, other) = (chance.place(), chance.place());
        let shapes = [
            chance.measured(1, &sphere(one, radius_mm), WELL),
            chance.measured(2, &sphere(other, radius_mm + more), WELL),
        ];
        let found = found(&shapes);
        let is_equal = |own: &regularize::Regularity| own.kind == Kind::EqualRadii;
        wrong += usize::from(found.accepted.iter().any(is_equal));
    }
    assert!(wrong <= 1, "{wrong}");
}

/// Shapes that nothing ties.
fn untied(chance: &mut Chance) -> Vec<Shape> {
    let mut shapes = Vec::new();
    for _ in 0..6 {
        shapes.push(plane(chance.direction(), chance.place()));
    }
    for _ in 0..4 {
        let radius = chance.between(3.0, 20.0);
        shapes.push(cylinder(chance.direction(), chance.place(), radius));
        let radius = chance.between(3.0, 20.0);
        shapes.push(sphere(chance.place(), radius));
    }
    for _ in 0..2 {
        let half = chance.between(10.0, 70.0);
        shapes.push(cone(chance.direction(), chance.place(), half));
    }
    shapes
}

/// How many parts without ties get one of these kinds, in percent.
fn false_alarms(of: impl Fn(&Regularized) -> bool, parts: u64) -> f64 {
    let mut alarms = 0;
    for seed in 0..parts {
        let mut chance = Chance::new(3000 + seed);
        let truth = untied(&mut chance);
        let shapes = measured(&mut chance, &truth);
        alarms += usize::from(of(&found(&shapes)));
    }
    100.0 * alarms as f64 / parts as f64
}

#[test]
fn parts_without_ties_get_hardly_any() {
    const PARTS: u64 = 600;
    let has = |kinds: &'static [Kind]| {
        move |found: &Regularized| found.accepted.iter().any(|own| kinds.contains(&own.kind))
    };
    // The deviation of what is once in 20 times.
    let most = 5.0 + 2.0 * 100.0 * (0.05 * 0.95 / PARTS as f64).sqrt();
    let kinds: [(&str, &'static [Kind]); 5] = [
        ("round lengths", &[Kind::RoundRadius, Kind::RoundDistance]),
        ("round half angles", &[Kind::RoundHalfAngle]),
        ("directions", &[Kind::Parallel, Kind::Perpendicular]),
        ("equal radii", &[Kind::EqualRadii]),
        (
            "places",
            &[
                Kind::OnAxis,
                Kind::Concentric,
                Kind::Centred,
                Kind::Symmetric,
            ],
        ),
    ];
    for (name, kinds) in kinds {
        let share = false_alarms(has(kinds), PARTS);
        println!("{share:.1} % of parts without any get {name}");
        // Of directions and places there are two kinds, and three.
        let times = if kinds.len() > 2 {
            3.0
        } else {
            kinds.len() as f64
        };
        let times = if name == "round lengths" { 1.0 } else { times };
        assert!(share <= most * times, "{name}: {share}");
    }
}

#[test]
fn a_roof_and_its_bores_share_a_mirror() {
    const ROOFS: u64 = 100;
    let (mut whole, mut told) = (0, 0);
    for seed in 0..ROOFS {
        let mut chance = Chance::new(4000 + seed);
        let [x, y, z] = frame(&mut chance);
        let middle = chance.place();
        let at = |a: f64, b: f64, c: f64| middle + x * a + y * b + z * c;
        let truth = [
            plane(z * 2.0 + x, at(12.0, 3.0, 20.0)),
            plane(z * 2.0 - x, at(-12.0, -5.0, 20.0)),
            plane(z + x * 3.0, at(33.0, 1.0, 4.0)),
            plane(z - x * 3.0, at(-33.0, 6.0, 4.0)),
            // One in the middle, and two beside it.
            cylinder(y, at(0.0, 2.0, 9.0), 3.217),
            cylinder(y, at(14.371, 0.0, 7.0), 4.444),
            cylinder(y, at(-14.371, 1.0, 7.0), 4.444),
        ];
        let shapes: Vec<Fitted> = truth
            .iter()
            .zip(1..)
            .map(|(shape, label)| chance.measured(label, shape, WELL))
            .collect();
        let found = found(&shapes);
        let kind = |kind: Kind| usize::from(found.accepted.iter().any(|own| own.kind == kind));
        told += kind(Kind::Symmetric) * kind(Kind::Centred);
        let adjusted = after(&shapes, &found);
        let at = |k: usize, from: &Vector3<f64>| adjusted[k].distance_mm(from);
        // Where a mirror of two planes is: as far from the one as from the other.
        let normal = (direction(&adjusted[0]) - direction(&adjusted[1])).normalize();
        let other = (direction(&adjusted[2]) - direction(&adjusted[3])).normalize();
        let height = |from: &Vector3<f64>| {
            let slope = normal.dot(&direction(&adjusted[0]));
            (at(0, from) - at(1, from)) / (2.0 * slope)
        };
        let point = |k: usize| match &adjusted[k] {
            Shape::Cylinder(c) => c.point_mm,
            _ => Vector3::zeros(),
        };
        let on_mirror = point(4) - normal * height(&point(4));
        let offs = [
            (normal - other).norm(),
            at(2, &on_mirror) - at(3, &on_mirror),
            height(&point(4)),
            height(&(0.5 * (point(5) + point(6)))),
            normal.dot(&direction(&adjusted[4])),
        ];
        let off = offs.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
        whole += usize::from(off < 1e-6);
    }
    println!("{told} of {ROOFS} roofs are told to be symmetric, {whole} are throughout");
    assert!(told >= 95 && whole >= 90, "{told} {whole}");
}

#[test]
fn the_bound_is_the_users() {
    let mut chance = Chance::new(77);
    let truth = block(&mut chance);
    let shapes = measured(&mut chance, &truth);
    let count = |bound: f64| {
        let settings = Settings {
            bound,
            ..Settings::default()
        };
        regularize(&shapes, &[], SIZE_MM, &settings)
            .unwrap()
            .accepted
            .len()
    };
    assert!(count(1.0) < count(3.0), "{} {}", count(1.0), count(3.0));
}
