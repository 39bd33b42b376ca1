//! Scans that end in machining features and the solid rebuilt from them.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use relief_tests::rig::{Rig, small_house};
use serde_json::json;
use sim_scanner::config::{Object, SimConfig};
use sim_scanner::preset::Overrides;

use crate::named;

/// A plain block, 60 x 40 x 20 mm, in twelve triangles.
fn block() -> String {
    let corner = |k: usize| {
        let at = |bit: usize, size: f64| if k & bit == 0 { 0.0 } else { size };
        [at(1, 60.0), at(2, 40.0), at(4, 20.0)]
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let mut text = String::from("solid block\n");
    for [a, b, c, d] in quads {
        for triangle in [[a, b, c], [a, c, d]] {
            text.push_str("facet normal 0 0 0\nouter loop\n");
            for [x, y, z] in triangle.map(corner) {
                let _ = writeln!(text, "vertex {x} {y} {z}");
            }
            text.push_str("endloop\nendfacet\n");
        }
    }
    text + "endsolid block\n"
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_ends_in_features_where_they_are_asked_for() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("block.stl");
    std::fs::write(&file, block())?;
    let scanner = SimConfig {
        object: Object::Stl(file),
        overrides: Overrides {
            columns: Some(120),
            samples: Some(120),
            ..Overrides::default()
        },
        ..small_house()
    };
    let rig = Rig::start_with(&scanner, |config| config.deliverables.features = true).await?;
    let ended = rig.scan_to_result(&named("block")).await?;
    assert_eq!(ended.job.left_out, Vec::<String>::new());
    let result = rig.result(&ended.scan.id).await?;
    let told = result.json("features.json")?;
    let features = told["features"].as_array().context("features")?;
    assert_eq!(features.len(), 1, "{features:?}");
    assert_eq!(features[0]["type"], "block");
    for (name, ought) in [("length", 60.0), ("width", 40.0)] {
        let is = features[0]["dimensions_mm"][name].as_f64().context(name)?;
        assert!((is - ought).abs() < 1.5, "{name}: {is} mm");
    }
    let step = String::from_utf8(result.file("block.features.step")?.to_vec())?;
    assert_eq!(step.matches("MANIFOLD_SOLID_BREP").count(), 1);
    assert!(result.file("features.png")?.starts_with(b"\x89PNG"));

    // Another network is as sure in another degree.
    let other = [("deliverables.features_network", json!("published"))];
    let retold = rig.rerun_to_result(&ended.scan.id, &other).await?;
    let by_other = rig.result(&retold.result).await?.json("features.json")?;
    let score = |told: &serde_json::Value| told["features"][0]["score"].as_f64();
    assert!(score(&told).is_some() && score(&by_other).is_some());
    assert_ne!(score(&told), score(&by_other));

    let edit = [("deliverables.edit", json!([{ "id": 0, "length": 61.5 }]))];
    let edited = rig.rerun_to_result(&ended.scan.id, &edit).await?;
    let result = rig.result(&edited.result).await?;
    let told = result.json("features.json")?;
    assert_eq!(told["features"][0]["dimensions_mm"]["length"], 61.5);
    assert_eq!(told["features"][0]["sigma_mm"]["length"], 0.0);
    let rebuilt = String::from_utf8(result.file("block.features.step")?.to_vec())?;
    assert_ne!(rebuilt, step);

    let edit = [("deliverables.edit", json!([{ "id": 9, "length": 61.5 }]))];
    let of_none = rig.rerun_to_result(&ended.scan.id, &edit).await?;
    assert!(
        of_none
            .left_out
            .iter()
            .any(|told| told.contains("there is no feature 9")),
        "{:?}",
        of_none.left_out
    );

    let off = [("deliverables.features", json!(false))];
    let without = rig.rerun_to_result(&ended.scan.id, &off).await?;
    let result = rig.result(&without.result).await?;
    assert!(result.file("features.json").is_err());
    rig.end().await
}
