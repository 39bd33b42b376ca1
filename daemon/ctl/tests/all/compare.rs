//! `relief compare` on simulated scans of a part with and without a dent, and on bad nominals.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::bench;
use crate::common;

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Output;

use bench::{Dent, Facets, block, moved, noise, scan};
use common::{relief, roof, text};
use compare::Pose;
use serde_json::Value;
use sim_scanner::preset::Overrides;

/// A binary STL file; normals are left to the reader, as many programs do.
fn stl((vertices, facets): &Facets) -> Vec<u8> {
    let mut file = vec![0; 80];
    file.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        file.extend([0; 12]);
        for &vertex in facet {
            for coordinate in vertices[vertex] {
                file.extend((coordinate as f32).to_le_bytes());
            }
        }
        file.extend([0; 2]);
    }
    file
}

/// Writes a simulated scan as text.
fn write_scan(path: &Path, part: &Facets, seed: u64) {
    write_scan_by(&noise(), path, part, seed);
}

fn write_scan_by(overrides: &Overrides, path: &Path, part: &Facets, seed: u64) {
    let mut lines = String::new();
    for column in scan(part, overrides, seed) {
        for sample in column.samples() {
            let (x, y, z) = (column.x_mm(), sample.y_mm, sample.z_mm);
            writeln!(lines, "{x:.4} {y:.4} {z:.4}").expect("text takes it");
        }
    }
    fs::write(path, lines).expect("there is room");
}

fn told(output: &Output) -> (String, String) {
    let of = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (of(&output.stdout), of(&output.stderr))
}

fn json(output: &Output) -> Value {
    let (_, stderr) = told(output);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {stderr}"))
}

#[test]
fn a_good_part_passes_and_a_dented_one_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let dent = Dent {
        at_mm: [12.0, -14.0],
        width_mm: 5.0,
        height_mm: -0.1,
        is_flat: true,
    };
    fs::write(at.join("part.stl"), stl(&block(&[]))).unwrap();
    write_scan(&at.join("good.xyz"), &block(&[]), 7);
    let good = relief(
        at,
        &["compare", "good.xyz", "part.stl", "--align", "as-placed"],
    );
    let (stdout, stderr) = told(&good);
    assert_eq!(good.status.code(), Some(0), "{stdout}{stderr}");
    assert!(stdout.contains("passed: nothing lies"), "{stdout}");
    let good = relief(
        at,
        &[
            "compare",
            "good.xyz",
            "part.stl",
            "--json",
            "--tolerance-mm",
            "0.05",
        ],
    );
    let good = json(&good);
    assert_eq!(good["passed"], true);
    assert_eq!(good["report"]["tolerance"]["lower_mm"], -0.05);
    assert!(
        good["report"]["coverage"]["covered_share"]
            .as_f64()
            .unwrap()
            > 0.98
    );

    // Elsewhere than the nominal, and turned.
    let pose = Pose::new([0.0, 0.01, -0.5], [20.0, 30.0, -5.0]);
    write_scan(
        &at.join("bad.xyz"),
        &moved(&block(&[dent]), &pose.inverse()),
        8,
    );
    let options = [
        "compare",
        "bad.xyz",
        "part.stl",
        "--report",
        "r.json",
        "--map",
        "m.png",
        "--page",
        "p.html",
        "--page",
        "p.pdf",
        "--lower-mm",
        "-0.03",
        "--upper-mm",
        "0.05",
    ];
    let bad = relief(at, &options);
    let (stdout, stderr) = told(&bad);
    assert_eq!(bad.status.code(), Some(1), "{stdout}{stderr}");
    let line = stderr.lines().last().unwrap();
    assert!(
        line.starts_with("relief: out of tolerance: 1 area beyond"),
        "{stderr}"
    );
    assert!(stdout.contains("verdict      out of tolerance"), "{stdout}");
    let report: Value = serde_json::from_slice(&fs::read(at.join("r.json")).unwrap()).unwrap();
    assert_eq!(report["passed"], false);
    let region = &report["regions"][0];
    let page = fs::read_to_string(at.join("p.html")).unwrap();
    assert!(page.contains("Out of tolerance: ") && page.contains("data:image/png;base64,"));
    for key in ["deviation_mm", "standard_error_mm", "area_mm2"] {
        let value = region[key].as_f64().unwrap();
        assert!(page.contains(&format!("<data value=\"{value}\">")), "{key}");
    }
    assert!(fs::read(at.join("p.pdf")).unwrap().starts_with(b"%PDF"));
    for (axis, place) in [(0, 12.0), (1, -14.0)] {
        let found = region["nominal_centre_mm"][axis].as_f64().unwrap();
        assert!((found - place).abs() < 2.0, "{region}");
    }
    assert!(
        (-0.14..-0.06).contains(&region["deviation_mm"].as_f64().unwrap()),
        "{region}"
    );
    let turned = report["alignment"]["rotation_vector_deg"][2]
        .as_f64()
        .unwrap();
    assert!((turned + 0.5_f64.to_degrees()).abs() < 0.02, "{turned}");
    assert!(fs::read(at.join("m.png")).unwrap().starts_with(b"\x89PNG"));

    let bad = relief(at, &[&options[..3], &["--json"]].concat());
    assert_eq!(bad.status.code(), Some(1));
    assert_eq!(json(&bad)["passed"], false);
    assert!(json(&bad)["report"]["tolerance"].is_null());
}

/// What comparing the roof of the other tests with a nominal says, and its exit code.
fn refused(content: &[u8], options: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("roof.xyz"), text(&roof())).unwrap();
    let mut file = fs::File::create(at.join("part.stl")).unwrap();
    file.write_all(content).unwrap();
    let output = relief(
        at,
        &[&["compare", "roof.xyz", "part.stl"], options].concat(),
    );
    let (stdout, stderr) = told(&output);
    assert_eq!(stdout, "", "{stderr}");
    assert_eq!(
        fs::read_dir(at).unwrap().count(),
        2,
        "nothing is left behind"
    );
    (
        output.status.code(),
        stderr.lines().last().unwrap().to_owned(),
    )
}

#[test]
fn what_is_wrong_is_told_in_one_line() {
    let part = stl(&block(&[]));
    let (code, line) = refused(&part[..200], &[]);
    assert_eq!(code, Some(1));
    assert!(
        line.starts_with("relief: part.stl: is cut off, or no STL file"),
        "{line}"
    );
    let (_, line) = refused(b"ISO-10303-21;\nHEADER;\n", &[]);
    assert!(line.contains("part.stl: line 3, column 1: "), "{line}");
    assert!(line.contains("it was cut off"), "{line}");
    let (_, line) = refused(b"ply\nformat ascii 1.0\n", &[]);
    assert!(
        line.contains("part.stl: is a PLY file, which is not read as a nominal"),
        "{line}"
    );
    let step = include_bytes!("../../../../geometry/cad-exchange/tests/solids/bracket.step");
    let (_, line) = refused(step, &["--nominal-units", "inch"]);
    assert!(line.contains("leave out --nominal-units"), "{line}");
    let (_, line) = refused(&part, &["--nominal-units", "m"]);
    assert!(line.contains("probably not in millimetres"), "{line}");
    let (vertices, facets) = block(&[]);
    let away = (
        vertices
            .iter()
            .map(|[x, y, z]| [x + 300.0, *y, *z])
            .collect(),
        facets,
    );
    let (code, line) = refused(&stl(&away), &["--align", "as-placed"]);
    assert_eq!(code, Some(1));
    assert!(
        line.contains("no point of the scan lies within 2 mm"),
        "{line}"
    );
    for wrong in [
        &["--tolerance-mm", "-1"][..],
        &["--upper-mm", "1"],
        &["--upper-mm", "0.1", "--lower-mm", "0.2"],
        &["--false-alarm", "0.9"],
        &["--report", "none/r.json"],
        &["--align", "somehow"],
    ] {
        let (code, line) = refused(&part, wrong);
        assert_eq!(code, Some(2), "{wrong:?}: {line}");
    }
    let folder = tempfile::tempdir().unwrap();
    let missing = relief(folder.path(), &["compare", "a.xyz", "none.stl"]);
    assert!(told(&missing).1.contains("cannot read none.stl"));
}

#[test]
fn a_step_file_serves_as_nominal() {
    let step = include_bytes!("../../../../geometry/cad-exchange/tests/solids/bracket-inch.step");
    let body = cad_exchange::step::read_body(&step[..]).unwrap();
    let settings = solids::FacetSettings {
        tolerance_mm: 0.01,
        most: 1_000_000,
    };
    let facets = solids::facets(&body, &settings).unwrap();
    let points = facets.points_mm.iter().map(|p| [p.x, p.y, p.z]);
    let part = (points.collect(), facets.triangles);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bracket.step"), step).unwrap();
    let lifted = moved(&part, &Pose::new([0.0; 3], [0.0, 0.0, 0.2]));
    let coarse = Overrides {
        columns: Some(120),
        samples: Some(128),
        ..noise()
    };
    write_scan_by(&coarse, &folder.path().join("good.xyz"), &part, 5);
    write_scan_by(&coarse, &folder.path().join("lifted.xyz"), &lifted, 5);
    let held = |scan: &str| {
        let options = ["--align", "as-placed", "--tolerance-mm", "0.1", "--json"];
        let words = [&["compare", scan, "bracket.step"], &options[..]].concat();
        relief(folder.path(), &words)
    };
    let good = held("good.xyz");
    assert_eq!(good.status.code(), Some(0), "{:?}", told(&good));
    assert_eq!(json(&good)["passed"], true);
    let lifted = held("lifted.xyz");
    assert_eq!(lifted.status.code(), Some(1), "{:?}", told(&lifted));
    assert_eq!(json(&lifted)["passed"], false);
}
