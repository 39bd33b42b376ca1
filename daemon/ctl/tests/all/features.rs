//! `relief features` on a scan by formula.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A block of 60 x 40 mm, 15 mm high, with a hole of 12 mm in it, 6 mm deep, on a table.
fn scan() -> String {
    let mut text = String::new();
    for i in 0..200 {
        let x = -50.0 + 0.5 * f64::from(i);
        for j in 0..160 {
            let y = -40.0 + 0.5 * f64::from(j) + 0.01 * f64::from(i % 7);
            // The part lies askew, so that its walls are told by many columns.
            let (u, v) = (0.995 * x + 0.0998 * y, 0.995 * y - 0.0998 * x);
            let z = if u.abs() > 30.0 || v.abs() > 20.0 {
                -15.0
            } else if (u - 10.0) * (u - 10.0) + v * v < 36.0 {
                -6.0
            } else {
                0.0
            };
            let wave = 0.02 * f64::from((i * 37 + j * 91) % 11 - 5) / 5.0;
            let _ = writeln!(text, "{x:.3} {y:.3} {:.4}", z + wave);
        }
    }
    text
}

fn relief(at: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relief"))
        .current_dir(at)
        .args(arguments)
        .output()
        .unwrap()
}

fn errors(output: &Output) -> String {
    assert!(!output.status.success());
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn a_block_with_a_hole_is_told_drawn_rebuilt_and_edited() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("part.xyz"), scan()).unwrap();
    let output = relief(
        at,
        &[
            "features",
            "part.xyz",
            "--json",
            "--step",
            "part.step",
            "--picture",
            "part.png",
            "--reduced",
            "fewer.xyz",
        ],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let schema: Value =
        serde_json::from_str(include_str!("../../../../docs/schema/commands.schema.json")).unwrap();
    let schema = jsonschema::validator_for(&schema["$defs"]["features"]).unwrap();
    let wrong: Vec<String> = schema.iter_errors(&told).map(|e| e.to_string()).collect();
    assert_eq!(wrong, Vec::<String>::new());
    let features = told["features"].as_array().unwrap();
    let classes: Vec<&str> = features
        .iter()
        .map(|f| f["type"].as_str().unwrap())
        .collect();
    assert_eq!(classes, ["block", "hole"]);
    let hole = &features[1];
    assert_eq!(hole["parent"], 0);
    let size = |name: &str| hole["dimensions_mm"][name].as_f64().unwrap();
    assert!(
        (size("diameter") - 12.0).abs() < 0.1,
        "{}",
        size("diameter")
    );
    assert!((size("depth") - 6.0).abs() < 0.02, "{}", size("depth"));
    // 12 mm is what is drilled for M14.
    assert_eq!(hole["thread_guess"], "M14");
    let fewer = fs::read_to_string(at.join("fewer.xyz")).unwrap();
    let left = told["reduced"]["left"].as_u64().unwrap();
    assert_eq!(fewer.lines().count() as u64, left);
    // Of what is level some go, and then every second.
    let points = told["reduced"]["points"].as_u64().unwrap();
    assert_eq!(points, 200 * 160);
    let after_vectors = told["reduced"]["after_vector_sampling"].as_u64().unwrap();
    assert!(left < after_vectors && after_vectors < points, "{told}");
    let edges = told["reduced"]["sharp_edge_points"].as_u64().unwrap();
    assert!(edges > 500, "{edges}");
    let file: Value =
        serde_json::from_slice(&fs::read(at.join("part.features.json")).unwrap()).unwrap();
    assert_eq!(file["features"], told["features"]);
    let step = fs::read_to_string(at.join("part.step")).unwrap();
    assert!(step.contains("MANIFOLD_SOLID_BREP"));
    assert!(
        fs::read(at.join("part.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );

    fs::write(at.join("edits.toml"), "[[edit]]\nid = 1\ndiameter = 10.3\n").unwrap();
    let edited = relief(
        at,
        &["features", "part.xyz", "--json", "--edit", "edits.toml"],
    );
    let told: Value = serde_json::from_slice(&edited.stdout).unwrap();
    assert_eq!(told["features"][1]["dimensions_mm"]["diameter"], 10.3);
    assert_eq!(told["features"][1]["thread_guess"], "M12");
    assert_eq!(told["features"][1]["sigma_mm"]["diameter"], 0.0);
}

#[test]
fn what_cannot_be_is_said() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("part.xyz"), scan()).unwrap();
    fs::write(at.join("few.xyz"), "0 0 0\n1 0 0\n0 1 0\n1 1 0\n").unwrap();
    fs::write(at.join("none.toml"), "").unwrap();
    fs::write(at.join("ninth.toml"), "[[edit]]\nid = 9\ndepth = 1.0\n").unwrap();
    for (arguments, words) in [
        (&["features", "absent.xyz"][..], "absent.xyz"),
        (&["features", "few.xyz"], "too few"),
        (
            &["features", "part.xyz", "-o", "part.xyz"],
            "is the scan itself",
        ),
        (
            &["features", "part.xyz", "--network", "few.xyz"],
            "few.xyz is no network",
        ),
        (&["features", "part.xyz", "--reduce-rate", "3"], "--reduced"),
        (
            &["features", "part.xyz", "--edit", "none.toml"],
            "no [[edit]]",
        ),
        (
            &[
                "features",
                "part.xyz",
                "--edit",
                "ninth.toml",
                "-o",
                "ninth.toml",
            ],
            "is the file of edits itself",
        ),
        (
            &[
                "features",
                "part.xyz",
                "--network",
                "none.toml",
                "--step",
                "none.toml",
            ],
            "is the network itself",
        ),
        (
            &[
                "features",
                "part.xyz",
                "--step",
                "a.out",
                "--picture",
                "./a.out",
            ],
            "named twice",
        ),
        (
            &[
                "features",
                "part.xyz",
                "--reduced",
                "a.xyz",
                "--reduce-angle-deg",
                "999",
            ],
            "0 to 180",
        ),
        (
            &["features", "part.xyz", "--least-pitches", "nan"],
            "3 to 1000 sample distances",
        ),
        (
            &["features", "part.xyz", "--edit", "ninth.toml"],
            "there is no feature 9",
        ),
    ] {
        let told = errors(&relief(at, arguments));
        assert!(told.contains(words), "{arguments:?}: {told}");
        assert!(!at.join("part.features.json").exists());
    }
    let edits = fs::read_to_string(at.join("ninth.toml")).unwrap();
    assert!(edits.starts_with("[[edit]]"), "{edits}");
}
