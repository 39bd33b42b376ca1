//! What users know better, and what follows from it.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;

use std::sync::OnceLock;

use common::{Bench, recognised};
use features::edit::{Edit, EditError, edit};
use features::feature::Feature;
use features::network::Classifier;
use features::rebuild::rebuilt;
use features::recognise::Recognition;

const TABLE_MM: f64 = -12.0;

/// A block with a pocket and two holes in that, one of them through, a countersunk hole, a boss with a
/// chamfer, and a slot that is wider than it is long.
fn part(x: f64, y: f64) -> f64 {
    let (sin, cos) = libm::sincos(7f64.to_radians());
    let (u, v) = (cos * x + sin * y, cos * y - sin * x);
    let off = |a: f64, b: f64| ((u - a) * (u - a) + (v - b) * (v - b)).sqrt();
    if u.abs() > 40.0 || v.abs() > 25.0 {
        return TABLE_MM;
    }
    if off(-15.0, 0.0) < 4.0 {
        return -7.0;
    }
    if off(-21.0, 6.0) < 2.5 {
        return TABLE_MM;
    }
    if u.abs() < 8.0 && v > 17.0 {
        return -2.0;
    }
    if (u + 15.0).abs() < 15.0 && v.abs() < 10.0 {
        return -3.0;
    }
    let from_sunk = off(22.0, 11.0);
    if from_sunk < 7.0 {
        return if from_sunk < 4.0 {
            -8.0
        } else {
            from_sunk - 7.0
        };
    }
    let in_boss = 7.0 - off(20.0, -12.0);
    if in_boss > 0.0 {
        return 5.0 - (2.0 - in_boss).max(0.0);
    }
    0.0
}

fn found() -> Recognition {
    static FOUND: OnceLock<Recognition> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        let bench = Bench {
            pitch_mm: 0.35,
            noise_mm: 0.02,
            // Rays run nearly along the holes.
            camera_mm: [0.0, 900.0],
            y_mm: (-35.0, 35.0),
            x_mm: (-50.0, 50.0),
            ..Bench::default()
        };
        recognised(&bench, &part)
    });
    found.clone()
}

/// The only feature of a class that does not go through; with a parent of a class, where that is asked for.
fn id(found: &Recognition, class: &str, on: &str) -> u32 {
    let is_on = |feature: &&Feature| {
        let parent = found.features.iter().find(|f| Some(f.id) == feature.parent);
        on.is_empty() || parent.is_some_and(|p| p.class == on)
    };
    let blind = found.features.iter().filter(|f| !f.through);
    let mut own = blind.filter(|f| f.class == class).filter(is_on);
    let id = own.next().unwrap().id;
    assert_eq!(own.count(), 0, "{class} on {on}");
    id
}

fn of(found: &Recognition, id: u32) -> &Feature {
    found.features.iter().find(|f| f.id == id).unwrap()
}

fn size(found: &Recognition, id: u32, name: &str) -> f64 {
    of(found, id).dimension(name).unwrap().value_mm
}

fn volume_mm3(found: &Recognition) -> f64 {
    let built = rebuilt(found).unwrap().part.build().unwrap();
    built.solid.check().unwrap();
    built.solid.volume_mm3
}

fn sizes<const N: usize>(id: u32, sizes: [(&str, f64); N]) -> Edit {
    Edit {
        id,
        dimensions_mm: sizes.map(|(name, mm)| (name.to_owned(), mm)).into(),
        ..Edit::default()
    }
}

fn named(id: u32, class: &str) -> Edit {
    Edit {
        id,
        class: Some(class.to_owned()),
        ..Edit::default()
    }
}

fn directed(id: u32, direction: [f64; 3]) -> Edit {
    Edit {
        id,
        direction: Some(direction),
        ..Edit::default()
    }
}

fn edited(found: &mut Recognition, edits: &[Edit]) -> Result<(), EditError> {
    edit(found, edits, Classifier::shipped().classes())
}

/// The text of why changes cannot be made; that nothing is changed then.
fn refused(edits: &[Edit]) -> String {
    let mut own = found();
    let before = own.features.clone();
    let error = edited(&mut own, edits).unwrap_err();
    assert_eq!(own.features, before);
    error.to_string()
}

const PI: f64 = core::f64::consts::PI;

#[test]
fn outlines_and_depths_move_and_the_solid_with_them() {
    let mut own = found();
    let hole = id(&own, "hole", "pocket");
    let (before, depth) = (volume_mm3(&own), size(&own, hole, "depth"));
    edited(
        &mut own,
        &[sizes(hole, [("diameter", 10.0), ("depth", 6.0)])],
    )
    .unwrap();
    assert_eq!(
        (size(&own, hole, "diameter"), size(&own, hole, "depth")),
        (10.0, 6.0)
    );
    assert_eq!(of(&own, hole).dimension("diameter").unwrap().sigma_mm, 0.0);
    assert!(of(&own, hole).is_edited);
    let expected = PI * (25.0 * 6.0 - 16.0 * depth);
    let gone = before - volume_mm3(&own);
    assert!(
        (gone - expected).abs() < 0.02 * expected,
        "{gone} {expected}"
    );
}

#[test]
fn what_goes_into_a_floor_moves_with_it() {
    let mut own = found();
    let (pocket, hole) = (id(&own, "pocket", ""), id(&own, "hole", "pocket"));
    let before = of(&own, hole).clone();
    let way = 5.0 - size(&own, pocket, "depth");
    edited(&mut own, &[sizes(pocket, [("depth", 5.0)])]).unwrap();
    let after = of(&own, hole);
    assert!((before.heights_mm.0 - way - after.heights_mm.0).abs() < 1e-9);
    assert!((before.heights_mm.1.unwrap() - way - after.heights_mm.1.unwrap()).abs() < 1e-9);
    assert!((before.centre_mm.z - way - after.centre_mm.z).abs() < 1e-3);
    assert_eq!(before.dimensions, after.dimensions);
    // The block has no room for both.
    let told = refused(&[sizes(pocket, [("depth", 9.0)])]);
    assert!(
        told.starts_with(&format!("hole {hole}: depth is ")),
        "{told}"
    );
    let told = refused(&[sizes(pocket, [("depth", 40.0)])]);
    assert!(
        told.contains("the block ends 12.0") || told.contains("the block ends 11.9"),
        "{told}"
    );
}

#[test]
fn holes_that_go_through_end_with_the_block() {
    let mut own = found();
    let pocket = id(&own, "pocket", "");
    let hole = own.features.iter().find(|f| f.through).unwrap().id;
    let (before, depth) = (volume_mm3(&own), size(&own, hole, "depth"));
    let way = 5.0 - size(&own, pocket, "depth");
    edited(&mut own, &[sizes(pocket, [("depth", 5.0)])]).unwrap();
    assert!(of(&own, hole).through);
    assert!((size(&own, hole, "depth") - (depth - way)).abs() < 0.02);
    assert!(volume_mm3(&own) < before);
    // With the block, and not below it.
    edited(&mut own, &[sizes(0, [("height", 14.0)])]).unwrap();
    assert!((size(&own, hole, "depth") - 9.0).abs() < 0.01);
    let told = refused(&[sizes(0, [("height", 6.0)])]);
    assert!(told.contains("the block ends"), "{told}");
}

#[test]
fn what_runs_out_keeps_its_length_along_its_walls() {
    let mut own = found();
    let slot = id(&own, "slot", "");
    let (length, width) = (size(&own, slot, "length"), size(&own, slot, "width"));
    assert!(length < width, "{length} {width}");
    let along = of(&own, slot).direction;
    edited(&mut own, &[sizes(slot, [("depth", 3.0)])]).unwrap();
    assert_eq!(
        (size(&own, slot, "length"), size(&own, slot, "width")),
        (length, width)
    );
    assert_eq!(of(&own, slot).direction, along);
}

#[test]
fn edges_follow_and_file_and_solid_agree() {
    let mut own = found();
    let (cone, hole) = (
        id(&own, "countersink", ""),
        of(&own, id(&own, "countersink", "")).parent,
    );
    let hole = hole.unwrap();
    let (wide, before) = (size(&own, cone, "diameter"), volume_mm3(&own));
    let (sink, depth) = (size(&own, cone, "depth"), size(&own, hole, "depth"));
    edited(&mut own, &[sizes(hole, [("diameter", 10.0)])]).unwrap();
    assert_eq!(size(&own, cone, "diameter"), wide);
    // Below the cone the hole is wider, and the cone is cut off where it is as wide.
    let frustum = |r: f64| PI * sink / 3.0 * (wide * wide / 4.0 + wide / 2.0 * r + r * r);
    let expected = PI * (25.0 - 16.0) * (depth - sink) + frustum(5.0) - frustum(4.0);
    let gone = before - volume_mm3(&own);
    assert!(
        (gone - expected).abs() < 0.03 * expected,
        "{gone} {expected}"
    );
    let told = refused(&[sizes(hole, [("diameter", 15.0)])]);
    assert!(
        told.contains("countersink") && told.contains("its hole is 15.000 mm wide"),
        "{told}"
    );
}

#[test]
fn types_are_those_that_lie_so() {
    let own = found();
    let (boss, pocket) = (id(&own, "boss", ""), id(&own, "pocket", ""));
    let told = refused(&[named(boss, "hole")]);
    assert!(told.contains("what stands on it is one of boss"), "{told}");
    for class in ["gear", "", "boss", "block", "stepped_hole"] {
        let told = refused(&[named(pocket, class)]);
        assert!(
            told.contains("what goes into the part is one of pocket, step, slot, hole"),
            "{told}"
        );
    }
    let told = refused(&[named(0, "pocket")]);
    assert!(told.contains("it is the block"), "{told}");
    let mut own = own;
    edited(&mut own, &[named(pocket, "slot"), named(0, "block")]).unwrap();
    assert_eq!(
        (of(&own, pocket).class.as_str(), of(&own, pocket).score),
        ("slot", 1.0)
    );
}

#[test]
fn a_chamfer_may_be_a_round() {
    let mut own = found();
    let (edge, before) = (id(&own, "chamfer", ""), volume_mm3(&own));
    let width = size(&own, edge, "width");
    assert!(refused(&[named(edge, "fillet")]).contains("one of chamfer, round"));
    assert!(refused(&[directed(edge, [1.0, 0.0, 0.0])]).contains("runs along an edge of"));
    let mut wider = own.clone();
    edited(&mut wider, &[sizes(edge, [("width", 1.5 * width)])]).unwrap();
    let rise = |found: &Recognition| {
        let (level, end) = of(found, edge).heights_mm;
        level - end.unwrap()
    };
    assert!((rise(&wider) - 1.5 * rise(&own)).abs() < 1e-9);
    edited(&mut own, &[named(edge, "round")]).unwrap();
    assert_eq!(size(&own, edge, "radius"), width);
    assert!(of(&own, edge).dimension("width").is_none());
    // A round takes less away.
    assert!(volume_mm3(&own) > before + 0.1 * PI * 7.0 * width * width);
}

#[test]
fn directions_and_the_longer_side() {
    let mut own = found();
    let (pocket, boss) = (id(&own, "pocket", ""), id(&own, "boss", ""));
    assert!(refused(&[directed(boss, [1.0, 0.0, 0.0])]).contains("is round and has no direction"));
    for along in [[0.0; 3], [0.0, 0.0, -1.0], [f64::NAN, 0.0, 0.0]] {
        assert!(refused(&[directed(pocket, along)]).contains("not along the axis"));
    }
    let before = volume_mm3(&own);
    edited(&mut own, &[directed(pocket, [0.0, 3.0, 0.0])]).unwrap();
    let along = of(&own, pocket).direction.unwrap();
    assert!(along.y > 0.999_999, "{along}");
    assert!((volume_mm3(&own) - before).abs() < 1e-3 * before);
    // Shorter, but still the longer side.
    let width = size(&own, pocket, "width");
    edited(&mut own, &[sizes(pocket, [("length", width + 1.0)])]).unwrap();
    assert!((before - volume_mm3(&own) + 9.0 * width * 3.0).abs() < 0.1 * 9.0 * width * 3.0);
    own = found();
    edited(&mut own, &[directed(pocket, [0.0, 3.0, 0.0])]).unwrap();
    // Made wider than it is long, its length is what was its width.
    let length = size(&own, pocket, "length");
    edited(&mut own, &[sizes(pocket, [("width", 36.0)])]).unwrap();
    assert_eq!(
        (size(&own, pocket, "length"), size(&own, pocket, "width")),
        (36.0, length)
    );
    assert!(of(&own, pocket).direction.unwrap().x.abs() > 0.999_999);
    let grown = before - volume_mm3(&own);
    assert!(
        (grown - 3.0 * length * 16.0).abs() < 0.05 * grown,
        "{grown}"
    );
}

#[test]
fn what_makes_no_sense_is_refused() {
    let own = found();
    let (pocket, hole) = (id(&own, "pocket", ""), id(&own, "hole", "pocket"));
    let last = own.features.len() - 1;
    assert_eq!(
        refused(&[named(99, "hole")]),
        format!("there is no feature 99; there are 0 to {last}")
    );
    let twice = [
        sizes(hole, [("depth", 3.0)]),
        sizes(hole, [("diameter", 9.0)]),
    ];
    assert!(refused(&twice).contains("is edited twice"));
    assert!(refused(&[sizes(hole, [])]).contains("changes nothing"));
    let told = refused(&[sizes(hole, [("length", 3.0)])]);
    assert!(told.contains("it has diameter, depth"), "{told}");
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(&[sizes(hole, [("depth", value)])]).contains("must be above 0"));
    }
    let told = refused(&[sizes(hole, [("diameter", 500.0)])]);
    assert!(told.contains("mm across"), "{told}");
    let told = refused(&[sizes(pocket, [("corner_radius", 30.0)])]);
    assert!(
        told.contains("no corner_radius") || told.contains("is the most"),
        "{told}"
    );
    // All or nothing.
    let mixed = [sizes(hole, [("depth", 3.0)]), named(99, "hole")];
    assert!(refused(&mixed).contains("no feature 99"));
}
