//! `relief surface` on scan files with and without a grid of their own, and on wrong usage.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;

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
fn entities_and_pieces_across_the_grid() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("hill.xyz"), text(&hill())).unwrap();
    // A plane with a terrace beyond an oblique line.
    let terrace: Vec<[f64; 3]> = (0..40 * 40)
        .map(|n| {
            let (x, y) = (f64::from(n / 40), f64::from(n % 40));
            [
                x,
                y,
                0.1 * x + if 0.8 * x + 0.6 * y > 25.3 { 6.0 } else { 0.0 },
            ]
        })
        .collect();
    fs::write(at.join("terrace.xyz"), text(&terrace)).unwrap();
    // Entities by number, from the directory's first lines.
    let counts = |path: &str, entity: usize| {
        let text = fs::read_to_string(at.join(path)).unwrap();
        let of_directory = text.lines().filter(|line| line.get(72..73) == Some("D"));
        let first = of_directory.step_by(2);
        first
            .filter(|line| line[..8].trim() == entity.to_string())
            .count()
    };
    for (entities, other) in [(114, 128), (128, 114)] {
        let words = [
            "--tolerance-mm",
            "0.05",
            "--entities",
            &entities.to_string(),
            "-o",
        ];
        let whole = run(at, &[&["hill.xyz"], &words[..], &["hill.igs"]].concat());
        // Two pieces on either side of the ridge.
        assert_eq!(counts("hill.igs", entities), 2);
        assert_eq!((counts("hill.igs", other), counts("hill.igs", 144)), (0, 0));
        assert!(whole["trimmed"].is_null());
        let parted = run(
            at,
            &[&["terrace.xyz"], &words[..], &["terrace.igs"]].concat(),
        );
        assert_eq!(
            (counts("terrace.igs", entities), counts("terrace.igs", 144)),
            (2, 2)
        );
        assert_eq!(parted["trimmed"]["faces"], 2);
        assert_eq!(parted["surface"]["control_points"], 32);
        assert_eq!(parted["trimmed"]["nodes_across"], 0);
    }
    let words = ["terrace.xyz", "--tolerance-mm", "0.05", "--untrimmed"];
    assert!(run(at, &words)["trimmed"].is_null());
    let words = [
        "surface",
        "hill.xyz",
        "--tolerance-mm",
        "1",
        "--entities",
        "114",
        "-o",
        "a.step",
    ];
    let output = relief(at, &words);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).1.contains("--entities is about IGES files"));
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
