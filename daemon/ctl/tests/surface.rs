//! `relief surface` on scan files with and without a grid of their own, and on wrong usage.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

mod common;

use std::fs;
use std::path::Path;
use std::process::Output;

use common::{relief, text};
use serde_json::Value;

/// A hill beside a ridge at x = 11.3 mm, on a grid of 0.5 mm.
fn hill() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for i in 0..60 {
        for j in 0..50 {
            let (x, y) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
            let (dx, dy) = (x - 20.0, y - 10.0);
            let hill = 4.0 * libm::exp(-(dx * dx + dy * dy) / 40.0);
            points.push([x, y, hill - 0.5 * (x - 11.3).abs()]);
        }
    }
    points
}

fn told(output: &Output) -> (String, String) {
    let of = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (of(&output.stdout), of(&output.stderr))
}

fn run(at: &Path, arguments: &[&str]) -> Value {
    let output = relief(at, &[&["surface"], arguments, &["--json"]].concat());
    let (stdout, stderr) = told(&output);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    serde_json::from_str(&stdout).unwrap()
}

#[test]
fn points_on_a_grid_become_a_surface_within_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("hill.xyz"), text(&hill())).unwrap();
    let surfaced = run(
        at,
        &[
            "hill.xyz",
            "--tolerance-mm",
            "0.05",
            "--fair-mm",
            "0.02",
            "--compare",
            "--pictures",
            "drawn",
        ],
    );
    assert_eq!(surfaced["as_measured"], true);
    assert_eq!(surfaced["surface"]["nodes"], 3000);
    assert!(surfaced["surface"]["max_mm"].as_f64().unwrap() <= 0.05);
    let line = &surfaced["character_lines"][0];
    assert_eq!(
        (&line["kind"], &line["at"]),
        (&"crease".into(), &"x".into())
    );
    assert!((line["at_mm"].as_f64().unwrap() - 11.3).abs() < 0.05);
    assert!(surfaced["fairing"]["greatest_move_mm"].as_f64().unwrap() <= 0.02);
    let placements = surfaced["placements"].as_array().unwrap();
    let count = |knots: &str| {
        let of = placements.iter().find(|p| p["knots"] == knots).unwrap();
        of["control_points"].as_u64().unwrap()
    };
    assert_eq!(placements.len(), 4);
    assert!(2 * count("optimal") <= count("uniform"));
    for name in [
        "deviations",
        "contours-before",
        "contours-after",
        "curvature-before",
        "curvature-after",
    ] {
        let picture = fs::read(at.join("drawn").join(format!("{name}.png"))).unwrap();
        assert!(picture.starts_with(b"\x89PNG"), "{name}");
    }
    // The two pieces that meet on the ridge, as rational B-spline surfaces.
    let iges = fs::read_to_string(at.join("hill.igs")).unwrap();
    let directory = iges.lines().filter(|line| line.get(72..73) == Some("D"));
    let surfaces = directory.filter(|line| line.starts_with("     128"));
    assert_eq!(surfaces.count(), 2 * 2);
    // The same again is the same file.
    run(
        at,
        &[
            "hill.xyz",
            "--tolerance-mm",
            "0.05",
            "--fair-mm",
            "0.02",
            "--threads",
            "1",
            "-o",
            "again.igs",
            "--name",
            "hill",
        ],
    );
    let again = fs::read_to_string(at.join("again.igs")).unwrap();
    assert_eq!(again, iges);
}

#[test]
fn a_grid_may_be_asked_for_and_step_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("hill.xyz"), text(&hill())).unwrap();
    let options = ["hill.xyz", "--tolerance-mm", "0.2", "-o", "hill.step"];
    let surfaced = run(at, &[&options[..], &["--pitch-mm", "0.75"]].concat());
    assert_eq!(surfaced["as_measured"], false);
    assert_eq!(surfaced["pitch_mm"], 0.75);
    let step = fs::read_to_string(at.join("hill.step")).unwrap();
    assert!(step.starts_with("ISO-10303-21;"));
    assert!(step.contains("B_SPLINE_SURFACE_WITH_KNOTS"));
}

#[test]
fn wrong_usage_is_told_in_one_line_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("hill.xyz"), text(&hill())).unwrap();
    let refused = |arguments: &[&str], code: i32, expected: &str| {
        let output = relief(at, &[&["surface", "hill.xyz"], arguments].concat());
        let (_, stderr) = told(&output);
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        let said: Vec<&str> = stderr
            .lines()
            .filter(|l| l.starts_with("relief: "))
            .collect();
        assert_eq!(said.len(), 1, "{stderr}");
        assert!(said[0].contains(expected), "{stderr}");
        assert!(!at.join("hill.igs").exists());
    };
    refused(&[], 2, "--tolerance-mm");
    refused(&["--tolerance-mm", "0"], 2, "must be above 0");
    refused(&["--tolerance-mm", "1", "--fair-mm", "0"], 2, "--fair-mm");
    refused(
        &["--tolerance-mm", "1", "--thresholds", "1,2"],
        2,
        "takes 4 numbers",
    );
    refused(
        &["--tolerance-mm", "1", "-o", "hill.stl"],
        2,
        ".igs, .iges, .step, .stp",
    );
    refused(&["--tolerance-mm", "1e-18"], 1, "cannot be reached");
}
