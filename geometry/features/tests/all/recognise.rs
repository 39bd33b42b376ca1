//! Features of parts by formula, scanned with noise, outliers and dropouts.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;

use std::collections::BTreeMap;

use common::{Bench, scan};
use features::feature::Feature;
use features::network::Classifier;
use features::rebuild::rebuilt;
use features::recognise::{RecogniseError, Recognition, Settings, Teller, UNKNOWN, recognise};
use range_image::Unmonitored;

fn settings() -> Settings<'static> {
    Settings {
        teller: Teller::Network(Classifier::shipped()),
        seed: 7,
        least_pitches: Settings::USUAL_PITCHES,
    }
}

fn found(bench: &Bench, height_mm: &dyn Fn(f64, f64) -> f64) -> Recognition {
    let columns = scan(bench, height_mm);
    recognise(&columns, Some(bench.camera_mm), &settings(), &Unmonitored).unwrap()
}

/// A place on a part turned by 5 degrees.
fn turned(x: f64, y: f64) -> (f64, f64) {
    let (sin, cos) = libm::sincos(5f64.to_radians());
    (cos * x + sin * y, cos * y - sin * x)
}

fn within(u: f64, v: f64, size: [f64; 2]) -> bool {
    u.abs() <= size[0] / 2.0 && v.abs() <= size[1] / 2.0
}

fn disc(u: f64, v: f64, diameter: f64) -> bool {
    u * u + v * v <= diameter * diameter / 4.0
}

const TABLE_MM: f64 = -23.762;

/// After the part of Jun & Park, Fig. 6: block, pocket, on its floor a boss, a hole and a second
/// pocket with a free-form bottom, and a slot that runs in from the side.
fn published(x: f64, y: f64) -> f64 {
    let (u, v) = turned(x, y);
    if !within(u, v, [100.871, 50.16]) {
        return TABLE_MM;
    }
    if within(u, v + 16.0, [18.36, 20.211]) || (v < -16.0 && within(u, 0.0, [18.36, 1.0])) {
        return -14.436;
    }
    if disc(u + 30.1, v, 8.026) {
        return -2.0;
    }
    if disc(u - 29.55, v - 0.2, 8.019) {
        return -18.0;
    }
    if within(u + 10.0, v - 8.0, [30.0, 8.0]) {
        return -12.0 + 0.5 * libm::sin(u / 6.0);
    }
    if within(u, v, [79.811, 28.557]) {
        return -7.85;
    }
    0.0
}

fn of<'a>(found: &'a Recognition, class: &str) -> Vec<&'a Feature> {
    found.features.iter().filter(|f| f.class == class).collect()
}

fn size(feature: &Feature, name: &str) -> f64 {
    feature.dimension(name).unwrap().value_mm
}

#[test]
fn the_published_part_is_recognised_nested_and_measured() {
    let mut off: BTreeMap<&str, f64> = BTreeMap::new();
    for seed in [101, 102, 103] {
        let bench = Bench {
            seed,
            ..Bench::default()
        };
        let found = found(&bench, &published);
        let mut classes: Vec<&str> = found.features.iter().map(|f| f.class.as_str()).collect();
        classes.sort_unstable();
        assert_eq!(
            classes,
            ["block", "boss", "hole", "pocket", "pocket", "slot"],
            "seed {seed}"
        );
        let block = of(&found, "block")[0];
        let large = of(&found, "pocket")
            .into_iter()
            .find(|p| size(p, "length") > 50.0)
            .unwrap();
        let small = of(&found, "pocket")
            .into_iter()
            .find(|p| size(p, "length") < 50.0)
            .unwrap();
        let (boss, hole, slot) = (
            of(&found, "boss")[0],
            of(&found, "hole")[0],
            of(&found, "slot")[0],
        );
        assert_eq!((block.id, block.parent), (0, None));
        assert_eq!((large.parent, slot.parent), (Some(0), Some(0)));
        for nested in [small, boss, hole] {
            assert_eq!(nested.parent, Some(large.id), "{}", nested.class);
        }
        for (name, is, ought) in [
            ("block length", size(block, "length"), 100.871),
            ("block width", size(block, "width"), 50.16),
            ("block height", size(block, "height"), 23.762),
            ("pocket length", size(large, "length"), 79.811),
            ("pocket width", size(large, "width"), 28.557),
            ("pocket depth", size(large, "depth"), 7.85),
            ("boss diameter", size(boss, "diameter"), 8.026),
            ("boss height", size(boss, "height"), 5.85),
            ("hole diameter", size(hole, "diameter"), 8.019),
            ("hole depth", size(hole, "depth"), 10.15),
            ("slot width", size(slot, "width"), 18.36),
            ("slot depth", size(slot, "depth"), 14.436),
        ] {
            let entry = off.entry(name).or_default();
            *entry += (is - ought) * (is - ought) / 3.0;
        }
    }
    for (name, square) in off {
        // Root mean squares over the seeds; the published bars with room for three of them.
        let bar = if name.contains("diameter") {
            0.06
        } else {
            0.08
        };
        assert!(square.sqrt() < bar, "{name}: {} mm", square.sqrt());
    }
}

#[test]
fn the_same_scan_gives_the_same_features() {
    let bench = Bench {
        pitch_mm: 0.6,
        ..Bench::default()
    };
    let (one, other) = (found(&bench, &published), found(&bench, &published));
    assert_eq!(one.features, other.features);
}

#[test]
fn a_blank_block_has_no_features_and_without_a_table_no_height() {
    let blank = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if within(u, v, [60.0, 40.0]) {
            0.0
        } else {
            TABLE_MM
        }
    };
    let with = found(&Bench::default(), &blank);
    assert_eq!(with.features.len(), 1);
    assert!((size(&with.features[0], "height") + TABLE_MM).abs() < 0.02);
    assert!(with.features[0].warnings.is_empty());

    let columns = scan(&Bench::default(), &blank);
    let alone: Vec<_> = columns
        .iter()
        .map(|column| {
            let samples = column.samples().iter().copied();
            let seen = samples.filter(|s| s.z_mm > -5.0).collect();
            range_image::Column::new(column.x_mm(), seen)
        })
        .collect();
    let camera_mm = Some(Bench::default().camera_mm);
    let without = recognise(&alone, camera_mm, &settings(), &Unmonitored).unwrap();
    let block = &without.features[0];
    assert_eq!(block.class, "block");
    assert!(block.dimension("height").is_none());
    assert!(block.warnings.iter().any(|w| w.contains("no table")));
    assert!((size(block, "length") - 60.0).abs() < 0.1);
}

/// A part along the columns on a table that sends nothing back fills the scan from side to side, as a
/// table does.
#[test]
fn the_top_of_a_part_without_a_table_is_no_table_of_its_boss() {
    let bench = Bench {
        outliers: 0.0,
        ..Bench::default()
    };
    let part = |x: f64, y: f64| match (within(x - 0.1, y, [60.0, 40.0]), disc(x - 5.0, y, 14.0)) {
        (false, _) => TABLE_MM,
        (true, true) => 2.8,
        (true, false) => 0.0,
    };
    let columns: Vec<_> = scan(&bench, &part)
        .iter()
        .map(|column| {
            let samples = column.samples().iter().copied();
            let seen = samples.filter(|s| s.z_mm > -5.0).collect();
            range_image::Column::new(column.x_mm(), seen)
        })
        .collect();
    let found = recognise(&columns, Some(bench.camera_mm), &settings(), &Unmonitored).unwrap();
    let classes: Vec<&str> = found.features.iter().map(|f| f.class.as_str()).collect();
    assert_eq!(classes, ["block", "boss"], "{:?}", found.features);
    // Along the columns walls lie between two of them.
    assert!(
        (size(&found.features[0], "length") - 60.0).abs() < bench.pitch_mm,
        "{:?}",
        found.features[0]
    );
    assert!((size(&found.features[1], "height") - 2.8).abs() < 0.05);
}

#[test]
fn what_the_scan_cuts_is_told_as_incomplete() {
    let cut = |x: f64, y: f64| {
        if !within(x - 50.0, y, [190.0, 50.0]) {
            TABLE_MM
        } else if within(x - 55.0, y, [30.0, 20.0]) {
            -6.0
        } else {
            0.0
        }
    };
    let found = found(&Bench::default(), &cut);
    for feature in &found.features {
        let is_told = feature.warnings.iter().any(|w| w.contains("incomplete"));
        assert!(is_told, "{} {:?}", feature.class, feature.warnings);
    }
    let classes: Vec<&str> = found.features.iter().map(|f| f.class.as_str()).collect();
    assert_eq!(classes.len(), 2, "{classes:?}");
}

#[test]
fn a_free_form_alone_is_no_feature() {
    let bench = Bench::default();
    let waves = |x: f64, y: f64| 3.0 * libm::sin(x / 12.0) * libm::cos(y / 15.0);
    let columns = scan(&bench, &waves);
    let found = recognise(&columns, Some(bench.camera_mm), &settings(), &Unmonitored);
    match found {
        Err(RecogniseError::NoTop) => {}
        Err(other) => panic!("{other}"),
        Ok(found) => {
            for feature in &found.features {
                let is_open = feature.class == UNKNOWN || !feature.warnings.is_empty();
                assert!(is_open, "{} {:?}", feature.class, feature.dimensions);
            }
        }
    }
}

#[test]
fn too_few_columns_are_refused() {
    let columns = scan(&Bench::default(), &published);
    let error = recognise(&columns[..3], None, &settings(), &Unmonitored).unwrap_err();
    assert!(error.to_string().contains("too few"), "{error}");
}

#[test]
fn the_network_decides() {
    let bench = Bench::default();
    let columns = scan(&bench, &published);
    let by_chance = Settings {
        teller: Teller::Chance(Classifier::shipped(), 3),
        ..settings()
    };
    let camera_mm = Some(bench.camera_mm);
    let drawn = recognise(&columns, camera_mm, &by_chance, &Unmonitored).unwrap();
    let told = recognise(&columns, camera_mm, &settings(), &Unmonitored).unwrap();
    let classes = |found: &Recognition| -> Vec<String> {
        found.features.iter().map(|f| f.class.clone()).collect()
    };
    assert_eq!(drawn.features.len(), told.features.len());
    assert_ne!(classes(&drawn), classes(&told));
}

#[test]
fn a_slot_that_runs_out_is_cut_to_the_side_of_the_solid_and_no_wider() {
    let slotted = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if !within(u, v, [60.0, 40.0]) {
            TABLE_MM
        } else if within(u - 20.0, v, [20.0, 10.0]) {
            -8.0
        } else {
            0.0
        }
    };
    let found = found(&Bench::default(), &slotted);
    let slot = of(&found, "slot")[0];
    assert!((size(slot, "length") - 20.0).abs() < 0.1);
    let solid = rebuilt(&found).unwrap().part.build().unwrap().solid;
    let ought = 60.0 * 40.0 * -TABLE_MM - 20.0 * 10.0 * 8.0;
    let off = solid.volume_mm3 / ought - 1.0;
    // A wall that is a millimetre off makes 80 mm3 or more, 0.0015 of it.
    assert!(off.abs() < 0.001, "{off}");
}

#[test]
fn what_lies_beyond_the_rim_is_another_feature_s() {
    // Between both is less land than a section takes in beyond the outline.
    let side_by_side = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if !within(u, v, [60.0, 40.0]) {
            TABLE_MM
        } else if within(u + 10.0, v, [12.0, 20.0]) {
            -4.0
        } else if within(u - 5.0, v, [14.0, 20.0]) {
            -12.0
        } else {
            0.0
        }
    };
    let found = found(&Bench::default(), &side_by_side);
    let pockets = of(&found, "pocket");
    assert_eq!(pockets.len(), 2, "{:?}", found.features);
    for pocket in pockets {
        assert_eq!(pocket.code, "4543212");
    }
}

#[test]
fn a_free_form_floor_with_a_fold_is_one_floor() {
    let folded = |x: f64, y: f64| {
        let (u, v) = turned(x, y);
        if !within(u, v, [60.0, 40.0]) {
            TABLE_MM
        } else if within(u, v, [30.0, 20.0]) {
            -12.0 + 0.02 * (u.abs() - 10.0).powi(2)
        } else {
            0.0
        }
    };
    let found = found(&Bench::default(), &folded);
    let pockets = of(&found, "pocket");
    assert_eq!(found.features.len(), 2, "{:?}", found.features);
    assert!((size(pockets[0], "length") - 30.0).abs() < 0.1);
    assert!(pockets[0].warnings[0].contains("no plane"));
}
