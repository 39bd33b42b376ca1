//! `relief skin` on sections of every kind, and on bad ones.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Output;

use cad_exchange::iges::read_surfaces;
use common::schema::check;
use common::{relief, roof, text};
use serde_json::Value;

/// A barrel of so many rings as text; some may be left out or changed by `each`.
fn barrel(rings: usize, each: impl Fn(usize, &mut Vec<[f64; 3]>)) -> String {
    let mut file = String::from("# a barrel\n");
    for k in 0..rings {
        let z = 40.0 * k as f64;
        let radius = 120.0 - 0.002 * (z - 100.0) * (z - 100.0);
        let angle = |j: usize| core::f64::consts::TAU * j as f64 / 72.0;
        let place = |j: usize| {
            [
                radius * libm::cos(angle(j)),
                0.7 * radius * libm::sin(angle(j)),
                z,
            ]
        };
        let mut points: Vec<[f64; 3]> = (0..72).map(place).collect();
        each(k, &mut points);
        writeln!(file, "section ring{}", k + 1).unwrap();
        for [x, y, z] in points {
            writeln!(file, "{x:.5} {y:.5} {z:.5}").unwrap();
        }
    }
    file
}

fn skin(folder: &Path, file: &str, more: &[&str]) -> Output {
    fs::write(folder.join("a.txt"), file).unwrap();
    let arguments = [&["skin", "a.txt", "--tolerance-mm", "0.2"], more].concat();
    relief(folder, &arguments)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_barrel_becomes_a_surface_that_holds_its_points() {
    let folder = tempfile::tempdir().unwrap();
    for method in ["relief", "jo"] {
        let file = barrel(6, |_, _| ());
        let more = [
            "--json",
            "--method",
            method,
            "--report",
            "r.json",
            "--pictures",
            "drawn",
            "-o",
            "b.igs",
        ];
        let output = skin(folder.path(), &file, &more);
        assert!(output.status.success(), "{}", stderr(&output));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        check("commands.schema.json#/$defs/skin", &told);
        assert!(told["deviation"]["max_mm"].as_f64().unwrap() <= 0.2);
        assert_eq!(told["deviation"]["within_tolerance_share"], 1.0);
        assert_eq!(told["sections"].as_array().unwrap().len(), 6);
        let report = fs::read(folder.path().join("r.json")).unwrap();
        let report: Value = serde_json::from_slice(&report).unwrap();
        let points = report["data_points"].as_array().unwrap();
        assert_eq!((points.len(), &report["counts"]), (6 * 72, &told["counts"]));
        for (index, name) in ["sections.png", "deviations.png"].into_iter().enumerate() {
            let path = Path::new("drawn").join(name);
            assert_eq!(told["pictures"][index], path.to_str().unwrap());
            let png = fs::read(folder.path().join(path)).unwrap();
            assert!(png.starts_with(b"\x89PNG") && png.len() > 2000, "{name}");
        }
        assert_eq!(points[0]["before_mm"].is_null(), method == "relief");
        // The file has that surface, and it holds the points by itself.
        let bytes = fs::read(folder.path().join("b.igs")).unwrap();
        let surfaces = read_surfaces(bytes.as_slice()).unwrap();
        assert_eq!(surfaces.len(), 1);
        let counts = told["counts"]["points"].as_u64().unwrap() as usize;
        assert_eq!(surfaces[0].surface.points().len(), counts);
        for point in points.iter().step_by(5) {
            let place = [0, 1, 2].map(|d| point["place_mm"][d].as_f64().unwrap());
            assert!(surfaces[0].surface.closest(place).distance <= 0.2);
        }
    }
}

#[test]
fn the_same_sections_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let file = barrel(5, |_, _| ());
    let time = ["--timestamp", "2026-11-21T09:30:00Z"];
    let bytes = |threads: &str| {
        let output = skin(
            folder.path(),
            &file,
            &[&time[..], &["--threads", threads]].concat(),
        );
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read(folder.path().join("a.igs")).unwrap()
    };
    assert_eq!(bytes("1"), bytes("2"));
}

#[test]
fn a_scan_is_cut_into_rows() {
    let folder = tempfile::tempdir().unwrap();
    let output = skin(
        folder.path(),
        &text(&roof()),
        &["--json", "--every-mm", "3"],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["closed"], false);
    let sections = told["sections"].as_array().unwrap();
    assert!(
        sections.len() >= 7
            && sections[0]["name"]
                .as_str()
                .unwrap()
                .starts_with("the row at")
    );
}

#[test]
fn bad_sections_are_refused_in_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |file: &str, more: &[&str], words: &[&str], code: i32| {
        let output = skin(folder.path(), file, more);
        let told = stderr(&output);
        let lines: Vec<&str> = told
            .lines()
            .filter(|line| line.starts_with("relief: "))
            .collect();
        assert_eq!(
            (output.status.code(), lines.len()),
            (Some(code), 1),
            "{told}"
        );
        for word in words {
            assert!(lines[0].contains(word), "{word}: {told}");
        }
        assert!(!folder.path().join("a.igs").exists());
    };
    let plain = || barrel(5, |_, _| ());
    let truncated = barrel(5, |k, points| {
        if k == 2 {
            points.truncate(2)
        }
    });
    refused(
        &truncated,
        &[],
        &["section 3 (ring3", "2 distinct points"],
        1,
    );
    let open = barrel(5, |k, points| {
        if k == 1 {
            points.truncate(40)
        }
    });
    refused(&open, &[], &["section 2 (ring2", "is open"], 1);
    let twice = barrel(5, |k, points| {
        if k == 4 {
            points
                .iter_mut()
                .for_each(|[x, _, z]| (*x, *z) = (*x + 300.0, 120.0));
        }
    });
    refused(
        &twice,
        &[],
        &["section 4 (ring4", "section 5 (ring5", "same height"],
        1,
    );
    let turned = barrel(5, |k, points| {
        if k == 3 {
            points.reverse()
        }
    });
    refused(
        &turned,
        &["--keep-senses"],
        &["section 4 (ring4", "sense"],
        1,
    );
    let letters = plain().replace("# a barrel", "1 2 x");
    refused(&letters, &[], &["a.txt"], 1);
    refused(&plain(), &["-o", "a.stl"], &[".igs"], 2);
    refused(&plain(), &["--degree", "9"], &["degree", "1 to 5"], 2);
    refused("", &[], &["a.txt"], 1);
    let output = relief(folder.path(), &["skin", "a.txt", "--tolerance-mm", "0"]);
    assert_eq!(output.status.code(), Some(2));
    fs::write(folder.path().join("b.igs"), plain()).unwrap();
    let onto = ["skin", "b.igs", "--tolerance-mm", "1"];
    assert_eq!(relief(folder.path(), &onto).status.code(), Some(2));
    assert_eq!(
        fs::read_to_string(folder.path().join("b.igs")).unwrap(),
        plain()
    );
    let output = relief(folder.path(), &["skin", "none.txt", "--tolerance-mm", "1"]);
    assert!(stderr(&output).contains("none.txt"));
}

#[test]
fn blocks_are_told_from_scans_by_their_points() {
    let folder = tempfile::tempdir().unwrap();
    // A header, then a blank line, then one cloud: a scan.
    let cloud = format!("x y z\n\n{}", text(&roof()));
    let output = skin(folder.path(), &cloud, &["--json", "--every-mm", "6"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["closed"], false);
    // Blank lines between points: blocks.
    let blocks = barrel(4, |_, _| ());
    let lines = blocks.lines().map(|line| {
        if line.starts_with("section") {
            ""
        } else {
            line
        }
    });
    let blocks: Vec<&str> = lines.collect();
    let output = skin(folder.path(), &blocks.join("\n"), &["--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (
            told["closed"].clone(),
            told["sections"].as_array().unwrap().len()
        ),
        (true.into(), 4)
    );
}

#[test]
fn sections_that_were_turned_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let file = barrel(5, |k, points| {
        if k == 3 {
            points.reverse()
        }
    });
    let output = skin(folder.path(), &file, &[]);
    assert!(output.status.success());
    assert!(stderr(&output).contains("note: turned") && stderr(&output).contains("ring4"));
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        table.contains("control points") && table.contains("written to"),
        "{table}"
    );
}
