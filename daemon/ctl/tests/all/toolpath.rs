//! `relief toolpath` on a small relief, and on what cannot be milled.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;

use std::fs;
use std::path::Path;
use std::process::Output;

use common::relief;
use serde_json::Value;

const MACHINE: &str = include_str!("../../../../config/machine.toml");

/// A grid of heights as a text STL file.
fn write_stl(path: &Path, side_mm: f64, height: impl Fn(f64, f64) -> f64) {
    let mut text = String::from("solid part\n");
    let count = 24;
    let at = |i: i32, j: i32| {
        let [x, y] = [i, j].map(|k| side_mm * (f64::from(k) / f64::from(count) - 0.5));
        [x, y, height(x, y)]
    };
    for i in 0..count {
        for j in 0..count {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            for triangle in [[a, b, c], [a, c, d]] {
                text.push_str("facet normal 0 0 1\nouter loop\n");
                for [x, y, z] in triangle {
                    text.push_str(&format!("vertex {x} {y} {z}\n"));
                }
                text.push_str("endloop\nendfacet\n");
            }
        }
    }
    text.push_str("endsolid part\n");
    fs::write(path, text).unwrap();
}

fn hill(x: f64, y: f64) -> f64 {
    10.0 + 4.0 * libm::exp(-(x * x + y * y) / 60.0)
}

fn told(output: &Output) -> (String, String) {
    let of = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (of(&output.stdout), of(&output.stderr))
}

#[test]
fn a_relief_becomes_a_program_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_stl(&at.join("hill.stl"), 24.0, hill);
    fs::write(at.join("m.toml"), MACHINE).unwrap();
    let options = [
        "toolpath",
        "hill.stl",
        "--machine",
        "m.toml",
        "--tool",
        "ball:6",
        "--rough",
        "flat:10",
        "--scallop-mm",
        "0.05",
        "--picture",
        "hill.png",
        "--timestamp",
        "2026-01-02T03:04:05Z",
        "--json",
    ];
    let done = relief(at, &options);
    let (stdout, stderr) = told(&done);
    assert_eq!(done.status.code(), Some(0), "{stderr}");
    let document: Value = serde_json::from_str(&stdout).unwrap();
    let published = include_str!("../../../../docs/schema/commands.schema.json");
    let published: Value = serde_json::from_str(published).unwrap();
    let schema = jsonschema::validator_for(&published["$defs"]["toolpath"]).unwrap();
    assert!(schema.is_valid(&document), "{stdout}");
    assert!(!schema.is_valid(&serde_json::json!({"output": "x"})));
    let simulation = &document["simulation"];
    assert!(simulation["gouge_mm"].as_f64().unwrap() < 1e-3, "{stdout}");
    assert!(
        simulation["leftover_mm"].as_f64().unwrap() > 0.03,
        "{stdout}"
    );
    assert!(
        simulation["leftover_95_mm"].as_f64().unwrap() < 0.05,
        "{stdout}"
    );
    assert_eq!(document["operations"][0]["name"], "roughing");
    assert_eq!(document["operations"][1]["cutter"], "ball:6");
    assert!(document["total_s"].as_f64().unwrap() > 60.0);
    let code = fs::read_to_string(at.join("hill.nc")).unwrap();
    assert!(
        code.starts_with("%\n(program 1)\n(model: hill.stl)\n"),
        "{}",
        &code[..80]
    );
    assert!(code.contains(" 2026-01-02T03:04:05Z)\n") && code.ends_with("M30\n%\n"));
    assert!(code.contains("T2 M6\nS7958 M3\n") && code.contains("G43 H1 Z30\n"));
    assert!(
        fs::read(at.join("hill.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );

    // The same again, by one thread and in the other dialect's head.
    let again = relief(
        at,
        &[&options[..], &["-o", "again.nc", "--threads", "1"]].concat(),
    );
    assert_eq!(again.status.code(), Some(0), "{}", told(&again).1);
    assert_eq!(fs::read_to_string(at.join("again.nc")).unwrap(), code);
}

#[test]
fn what_cannot_be_milled_is_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_stl(&at.join("hill.stl"), 24.0, hill);
    write_stl(&at.join("small.stl"), 4.0, |_, _| 10.0);
    write_stl(&at.join("far.stl"), 70.0, |x, _| 15.0 + 0.1 * x);
    fs::write(at.join("m.toml"), MACHINE).unwrap();
    let short = MACHINE.replace("x_mm = [0.0, 300.0]", "x_mm = [0.0, 160.0]");
    fs::write(at.join("short.toml"), short).unwrap();
    fs::write(at.join("bad.toml"), MACHINE.replace("safe_z_mm", "safe_mm")).unwrap();
    fs::write(at.join("cloud.ply"), "ply\nformat").unwrap();
    for (model, machine, tool, exit, expected) in [
        (
            "small.stl",
            "m.toml",
            "ball:6",
            1,
            "larger than the relief, which measures 4.000 mm along x",
        ),
        ("far.stl", "short.toml", "ball:6", 1, "travel along x by"),
        (
            "hill.stl",
            "m.toml",
            "ball:8",
            1,
            "the machine has no tool ball:8",
        ),
        (
            "hill.stl",
            "bad.toml",
            "ball:6",
            1,
            "unknown field `safe_mm`",
        ),
        (
            "hill.stl",
            "none.toml",
            "ball:6",
            1,
            "cannot read none.toml",
        ),
        (
            "cloud.ply",
            "m.toml",
            "ball:6",
            1,
            "which is not read as a model to be milled",
        ),
        ("none.stl", "m.toml", "ball:6", 1, "cannot read none.stl"),
        ("hill.stl", "m.toml", "cone:6", 2, "`cone:6` is no cutter"),
    ] {
        let words = ["toolpath", model, "--machine", machine, "--tool", tool];
        let (stdout, stderr) = told(&relief(at, &words));
        let output = relief(at, &words);
        assert_eq!(output.status.code(), Some(exit), "{stdout}{stderr}");
        let last = stderr.trim_end().lines().last().unwrap();
        assert!(
            last.starts_with("relief: ") && last.contains(expected),
            "{stderr}"
        );
        assert!(!at.join(model).with_extension("nc").exists(), "{model}");
    }
}

#[test]
fn a_surface_of_a_scan_is_milled_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut scan = String::new();
    for i in -24..=24 {
        for j in -24..=24 {
            let (x, y) = (0.5 * f64::from(i), 0.5 * f64::from(j));
            scan.push_str(&format!("{x} {y} {}\n", hill(x, y)));
        }
    }
    fs::write(at.join("hill.xyz"), scan).unwrap();
    fs::write(at.join("m.toml"), MACHINE).unwrap();
    let surface = [
        "surface",
        "hill.xyz",
        "--tolerance-mm",
        "0.01",
        "-o",
        "hill.igs",
    ];
    let made = relief(at, &surface);
    assert!(made.status.success(), "{}", told(&made).1);
    let options = [
        "toolpath",
        "hill.igs",
        "--machine",
        "m.toml",
        "--tool",
        "ball:6",
    ];
    let more = ["--scallop-mm", "0.05", "--json"];
    let output = relief(at, &[&options[..], &more].concat());
    assert!(output.status.success(), "{}", told(&output).1);
    let planned: Value = serde_json::from_slice(&output.stdout).unwrap();
    let simulation = &planned["simulation"];
    assert!(
        simulation["gouge_mm"].as_f64().unwrap() < 0.001,
        "{simulation}"
    );
    assert!(
        simulation["nodes"].as_u64().unwrap() > 10_000,
        "{simulation}"
    );
    assert!(at.join("hill.nc").exists());
    // An IGES file is known by its content.
    fs::rename(at.join("hill.igs"), at.join("hill.dat")).unwrap();
    let renamed: Vec<&str> = options
        .iter()
        .map(|o| if *o == "hill.igs" { "hill.dat" } else { o })
        .collect();
    let coarse = ["--scallop-mm", "0.5"];
    let output = relief(at, &[&renamed[..], &coarse].concat());
    assert!(output.status.success(), "{}", told(&output).1);
    // What is read is not written, and what sees nothing is refused.
    for (extra, word) in [
        (["-o", "hill.dat"], "is read"),
        (["--pitch-mm", "2"], "--pitch-mm 1.5"),
    ] {
        let output = relief(at, &[&renamed[..], &extra].concat());
        let (_, error) = told(&output);
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(word), "{error}");
    }
}
