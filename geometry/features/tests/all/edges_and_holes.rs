//! Treated edges, drilled and through holes, and rows of them.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;

use common::{Bench, recognised};
use features::edit::{Edit, edit};
use features::feature::{Bottom, Feature};
use features::network::Classifier;
use features::rebuild::rebuilt;
use features::recognise::Recognition;

const TABLE_MM: f64 = -12.0;

fn found(height_mm: &dyn Fn(f64, f64) -> f64) -> Recognition {
    found_amid(0.03, height_mm)
}

fn found_amid(noise_mm: f64, height_mm: &dyn Fn(f64, f64) -> f64) -> Recognition {
    let bench = Bench {
        pitch_mm: 0.35,
        noise_mm,
        // Rays run nearly along the holes.
        camera_mm: [0.0, 900.0],
        y_mm: (-35.0, 35.0),
        x_mm: (-50.0, 50.0),
        ..Bench::default()
    };
    recognised(&bench, height_mm)
}

fn turned(x: f64, y: f64) -> (f64, f64) {
    let (sin, cos) = libm::sincos(7f64.to_radians());
    (cos * x + sin * y, cos * y - sin * x)
}

fn off(u: f64, v: f64) -> f64 {
    (u * u + v * v).sqrt()
}

fn of<'a>(found: &'a Recognition, class: &str) -> Vec<&'a Feature> {
    found.features.iter().filter(|f| f.class == class).collect()
}

fn size(feature: &Feature, name: &str) -> f64 {
    feature.dimension(name).unwrap().value_mm
}

#[test]
fn holes_through_in_a_row_and_one_with_the_tip_of_a_drill() {
    let part = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if u.abs() > 40.0 || v.abs() > 25.0 {
            return TABLE_MM;
        }
        for k in [-1.0, 0.0, 1.0] {
            if off(u - 18.0 * k, v - 10.0) < 4.0 {
                return TABLE_MM;
            }
        }
        let from_drilled = off(u + 10.0, v + 10.0);
        if from_drilled < 6.0 {
            return -5.0 - 0.6 * (6.0 - from_drilled);
        }
        0.0
    };
    let found = found(&part);
    let holes = of(&found, "hole");
    assert_eq!(holes.len(), 4, "{:?}", found.features);
    assert_eq!(found.features.len(), 5);
    let (drilled, row): (Vec<&Feature>, Vec<&Feature>) =
        holes.iter().partition(|hole| size(hole, "diameter") > 10.0);
    for hole in &row {
        assert!(hole.through);
        assert!((size(hole, "diameter") - 8.0).abs() < 0.1);
        assert!((size(hole, "depth") + TABLE_MM).abs() < 0.05);
    }
    // The depth is that of the shoulder.
    assert!((size(drilled[0], "depth") - 5.0).abs() < 0.1);
    assert!(matches!(drilled[0].bottom, Bottom::Tip(slope) if (slope - 0.6).abs() < 0.05));
    let [pattern] = &found.patterns[..] else {
        panic!("{:?}", found.patterns);
    };
    assert_eq!(pattern.members.len(), 3);
    assert!((pattern.step_mm - 18.0).abs() < 0.05);
}

#[test]
fn of_a_drilled_hole_seen_from_the_side_a_part_of_the_tip_tells_the_shoulder() {
    let part = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if u.abs() > 40.0 || v.abs() > 25.0 {
            return -20.0;
        }
        let from_drilled = off(u + 10.0, v + 10.0);
        if from_drilled < 3.0 {
            return -12.0 - 0.6 * (3.0 - from_drilled);
        }
        0.0
    };
    let bench = Bench {
        pitch_mm: 0.35,
        noise_mm: 0.08,
        // The near wall hides more than half of the tip; what is left passes for a plane.
        camera_mm: [40.0, 150.0],
        x_mm: (-50.0, 50.0),
        ..Bench::default()
    };
    let found = recognised(&bench, &part);
    let holes = of(&found, "hole");
    assert_eq!(holes.len(), 1, "{:?}", found.features);
    let depth = holes[0].dimension("depth").unwrap();
    assert!(
        (depth.value_mm - 12.0).abs() < 3.0 * depth.sigma_mm + 0.05,
        "{depth:?}"
    );
    assert!(depth.sigma_mm < 0.3, "{depth:?}");
    assert!(matches!(holes[0].bottom, Bottom::Tip(slope) if (slope - 0.6).abs() < 0.1));
}

#[test]
fn a_narrow_step_with_a_wavy_floor_is_rebuilt() {
    // Along the plan's axes, in which floors are told.
    let part = |u: f64, v: f64| {
        if u.abs() > 40.0 || v.abs() > 25.0 {
            return TABLE_MM;
        }
        if u > 35.5 {
            return -4.0 + 0.8 * libm::sin(0.25 * v);
        }
        0.0
    };
    let mut found = found(&part);
    let steps = of(&found, "step");
    assert_eq!(steps.len(), 1, "{:?}", found.features);
    assert!(
        matches!(steps[0].bottom, Bottom::FreeForm(_)),
        "{:?}",
        steps[0].bottom
    );
    let id = steps[0].id;
    // What is cut goes on beyond where it ends, and the floor with it.
    let own = rebuilt(&found).unwrap();
    assert!(own.part.build().is_ok());
    assert!(
        !own.assumed.iter().any(|told| told.contains("level floor")),
        "{:?}",
        own.assumed
    );
    // Made wider than what was measured.
    let wider = Edit {
        id,
        class: None,
        dimensions_mm: [("width".to_owned(), 12.0)].into(),
        direction: None,
    };
    edit(&mut found, &[wider], Classifier::shipped().classes()).unwrap();
    let own = rebuilt(&found).unwrap();
    assert!(own.part.build().is_ok());
    assert!(
        own.assumed.iter().any(|told| told.contains("level floor")),
        "{:?}",
        own.assumed
    );
}

#[test]
fn a_countersunk_hole_a_chamfered_pocket_and_a_rounded_boss() {
    let part = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if u.abs() > 40.0 || v.abs() > 25.0 {
            return TABLE_MM;
        }
        let from_hole = off(u - 25.0, v - 8.0);
        if from_hole < 7.0 {
            return if from_hole < 4.0 {
                -8.0
            } else {
                from_hole - 7.0
            };
        }
        // 18 x 14, widened by a chamfer of 2.5.
        let (a, b) = ((u + 22.0).abs() - 9.0, v.abs() - 7.0);
        let from_pocket = a.max(b);
        if from_pocket < 2.5 {
            return if from_pocket < 0.0 {
                -6.0
            } else {
                from_pocket - 2.5
            };
        }
        let from_boss = 7.0 - off(u - 8.0, v + 10.0);
        if from_boss > 0.0 {
            let along = (2.5 - from_boss).max(0.0);
            return 6.0 - 2.5 + (2.5 * 2.5 - along * along).sqrt();
        }
        0.0
    };
    let found = found(&part);
    let classes: Vec<&str> = found.features.iter().map(|f| f.class.as_str()).collect();
    let one = |class: &str| {
        let own = of(&found, class);
        assert_eq!(own.len(), 1, "{class} among {classes:?}");
        own[0]
    };
    let (hole, pocket, boss) = (one("hole"), one("pocket"), one("boss"));
    assert!((size(hole, "diameter") - 8.0).abs() < 0.1);
    assert!((size(pocket, "length") - 18.0).abs() < 0.1);
    assert!((size(pocket, "width") - 14.0).abs() < 0.1);
    let (cone, chamfer, round) = (one("countersink"), one("chamfer"), one("round"));
    assert_eq!(cone.parent, Some(hole.id));
    assert_eq!(chamfer.parent, Some(pocket.id));
    assert_eq!(round.parent, Some(boss.id));
    assert!((size(cone, "diameter") - 14.0).abs() < 0.06, "{cone:?}");
    assert!((size(chamfer, "width") - 2.5).abs() < 0.06, "{chamfer:?}");
    assert!((size(round, "radius") - 2.5).abs() < 0.06, "{round:?}");
    assert!((size(boss, "diameter") - 14.0).abs() < 0.06, "{boss:?}");
}

/// What is steep of a round is hardly seen, and amid much noise nothing of it is segmented.
#[test]
fn rounded_edges_amid_noise_leave_the_sizes_as_they_are() {
    let radius = 2.2;
    let part = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        let within = (40.0 - u.abs()).min(25.0 - v.abs());
        if within < 0.0 {
            return TABLE_MM;
        }
        let from_boss = 7.0 - off(u - 8.0, v + 10.0);
        let (top, within) = if from_boss > 0.0 {
            (3.5, from_boss)
        } else {
            (0.0, within)
        };
        let along = (radius - within).max(0.0);
        top - radius + (radius * radius - along * along).sqrt()
    };
    let found = found_amid(0.15, &part);
    let rounds = of(&found, "round");
    assert_eq!(rounds.len(), 2, "{:?}", found.features);
    for round in rounds {
        assert!((size(round, "radius") - radius).abs() < 0.25, "{round:?}");
    }
    let block = of(&found, "block")[0];
    assert!((size(block, "length") - 80.0).abs() < 0.2, "{block:?}");
    assert!((size(block, "width") - 50.0).abs() < 0.2, "{block:?}");
    let boss = of(&found, "boss")[0];
    assert!((size(boss, "diameter") - 14.0).abs() < 0.25, "{boss:?}");
    // Noise at its corners keeps the block from none of its rounds.
    let made = rebuilt(&found).unwrap();
    assert_eq!(made.assumed, Vec::<String>::new());
    let solid = made.part.build().unwrap();
    assert!(solid.warnings.is_empty(), "{:?}", solid.warnings);
}

/// Where a fillet is wider than the corners of its pocket are round, these are made sharp.
#[test]
fn corners_that_are_too_narrow_for_an_edge_are_made_sharp() {
    let part = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if u.abs() > 40.0 || v.abs() > 25.0 {
            return TABLE_MM;
        }
        // 30 x 24, corners of 2.5 and a foot of 3.5.
        let corner = 2.5;
        let over = [u.abs() - 15.0 + corner, v.abs() - 12.0 + corner];
        let outer = over.map(|own| own.max(0.0));
        let beyond = off(outer[0], outer[1]) + over[0].max(over[1]).min(0.0) - corner;
        if beyond > 0.0 {
            return 0.0;
        }
        let along = (3.5 + beyond).max(0.0);
        -7.0 + 3.5 - (3.5 * 3.5 - along * along).sqrt()
    };
    let found = found(&part);
    let pocket = of(&found, "pocket")[0];
    let corner = size(pocket, "corner_radius");
    assert!((corner - 2.5).abs() < 0.3, "{pocket:?}");
    assert!((size(of(&found, "fillet")[0], "radius") - 3.5).abs() < 0.2);
    let made = rebuilt(&found).unwrap();
    let [told] = &made.assumed[..] else {
        panic!("{:?}", made.assumed);
    };
    assert!(told.contains("its corners are made sharp"), "{told}");
    let solid = made.part.build().unwrap();
    assert!(solid.warnings.is_empty(), "{:?}", solid.warnings);
}

/// The foot of a pocket, rounded; and one that is not.
#[test]
fn a_fillet_is_told_and_none_is_made_up() {
    let radius = 2.5;
    let part = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if u.abs() > 40.0 || v.abs() > 25.0 {
            return TABLE_MM;
        }
        let within = (10.0 - (u + 20.0).abs()).min(10.0 - v.abs());
        if within > 0.0 {
            let along = (radius - within).max(0.0);
            return -5.0 + radius - (radius * radius - along * along).sqrt();
        }
        if (u - 18.0).abs() < 10.0 && v.abs() < 8.0 {
            return -5.0;
        }
        0.0
    };
    let found = found(&part);
    assert_eq!(of(&found, "pocket").len(), 2, "{:?}", found.features);
    let fillets = of(&found, "fillet");
    assert_eq!(fillets.len(), 1, "{:?}", found.features);
    assert!((size(fillets[0], "radius") - radius).abs() < 0.1);
    assert_eq!(found.features.len(), 4);
}
