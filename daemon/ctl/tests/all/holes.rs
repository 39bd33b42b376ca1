//! Holes of range images closed or kept by `relief convert`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use crate::common;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cad_exchange::iges::read_model;
use common::relief;
use common::schema::check;
use serde_json::Value;

/// A slope of 30 by 25 mm of which nothing comes back within 4 mm of (0, 0), and half of what there is
/// within 2 mm of (9, 6).
fn slope() -> String {
    let mut text = String::new();
    for i in -60..=60 {
        for j in -50..=50 {
            let (x, y) = (f64::from(i) * 0.25, f64::from(j) * 0.25);
            let is_lost = (i * 7 + j * 11) % 8 != 0 && (x - 9.0).hypot(y - 6.0) < 2.0;
            if x.hypot(y) >= 4.0 && !is_lost {
                writeln!(text, "{x} {y} {}", 20.0 + 0.1 * x).unwrap();
            }
        }
    }
    text
}

fn report(at: &Path) -> Value {
    serde_json::from_slice(&fs::read(at.join("r.json")).unwrap()).unwrap()
}

fn inner_loops(at: &Path) -> usize {
    let file = fs::File::open(at.join("slope.igs")).unwrap();
    let model = read_model(std::io::BufReader::new(file)).unwrap();
    model.faces.iter().map(|face| face.inner.len()).sum()
}

fn convert(at: &Path, more: &[&str]) -> Value {
    let options = [
        "convert",
        "slope.xyz",
        "--pitch-mm",
        "0.5",
        "--report",
        "r.json",
    ];
    let output = relief(at, &[&options[..], more].concat());
    assert!(output.status.success(), "{output:?}");
    report(at)
}

#[test]
fn an_opening_stays_and_a_dull_place_is_closed_unless_the_user_says_otherwise() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("slope.xyz"), slope()).unwrap();
    let plain = convert(at, &[]);
    assert!(plain.get("fill").is_none());
    let loops = inner_loops(at);
    assert!(loops >= 1);

    let told = convert(at, &["--fill", "auto", "--pictures", "pictures"]);
    check("report.schema.json", &told);
    let holes = told["fill"]["holes"].as_array().unwrap();
    let opening = holes
        .iter()
        .find(|hole| hole["why"] == "no-return")
        .unwrap();
    assert_eq!(opening["decision"], "kept");
    assert!(opening["evidence"]["log_odds"].as_f64().unwrap() > 0.0);
    let others = holes.iter().filter(|hole| hole["why"] != "no-return");
    for hole in others {
        assert_eq!(hole["decision"], "closed", "{hole}");
    }
    assert_eq!(inner_loops(at), 1);
    assert!(at.join("pictures/regions.png").exists());

    let kept = told["fill"]["filled_nodes"].as_u64().unwrap();
    let told = convert(at, &["--fill-close", "0.5,-0.5"]);
    assert_eq!(told["fill"]["mode"], "auto");
    let asked = opening["nodes"].as_u64().unwrap();
    assert_eq!(told["fill"]["filled_nodes"].as_u64(), Some(kept + asked));
    assert_eq!(inner_loops(at), 0);

    let told = convert(at, &["--fill", "all", "--fill-keep=0,0"]);
    assert_eq!(inner_loops(at), 1);
    let opening = told["fill"]["holes"].as_array().unwrap();
    let opening = opening
        .iter()
        .find(|hole| hole["why"] == "asked" && hole["decision"] == "kept");
    assert!(opening.is_some());

    let told = convert(at, &["--fill-max-mm", "3", "--fill-keep=40,40"]);
    let warnings = told["warnings"].to_string();
    assert!(
        warnings.contains("no hole in the range image near x 40, y 40"),
        "{warnings}"
    );
    let holes = told["fill"]["holes"].as_array().unwrap();
    assert!(holes.iter().any(|hole| hole["why"] == "size"), "{holes:?}");
}

#[test]
fn what_cannot_be_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("slope.xyz"), slope()).unwrap();
    for (options, because) in [
        (&["--fill", "some"][..], "some"),
        (&["--fill-max-mm", "0"], "max_size_mm must be above 0"),
        (&["--fill-keep", "4"], "expected X,Y"),
    ] {
        let output = relief(at, &[&["convert", "slope.xyz"], options].concat());
        assert_eq!(output.status.code(), Some(2));
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(told.contains(because), "{told}");
    }
}
