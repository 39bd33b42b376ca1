//! The program as its users meet it: arguments in, files, text and exit code out.

mod demo;
mod doctor;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn relief(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relief"))
        .current_dir(directory)
        .env_remove("SOURCE_DATE_EPOCH")
        .env_remove("RELIEF_SOCKET")
        .args(arguments)
        .output()
        .expect("the program starts")
}

/// A roof of two planes, 24 mm square, as lines of x y z; a blank line is no harm.
fn roof() -> String {
    let mut text = String::from("# x y z\n\n");
    for i in -24..=24 {
        for j in -24..=24 {
            let (x, y) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
            writeln!(text, "{x} {y} {}", 20.0 - 0.6 * x.abs() + 0.1 * y).expect("text takes it");
        }
    }
    text
}

/// Fails with this code and tells why in one line on standard error, nothing elsewhere.
fn refused(output: &Output, code: i32, because: &str) {
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(
        told.starts_with("relief: ") && told.contains(because),
        "{told}"
    );
    assert!(output.stdout.is_empty());
}

#[test]
fn a_scan_file_becomes_a_cad_file_a_report_and_pictures() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("roof.xyz"), roof()).unwrap();
    let output = relief(
        directory.path(),
        &[
            "convert",
            "roof.xyz",
            "--json",
            "--report",
            "r.json",
            "--pictures",
            "pics",
            "--timestamp",
            "2026-11-21T09:30:00Z",
        ],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let iges = fs::read(directory.path().join("roof.igs")).unwrap();
    assert_eq!(told["output"], "roof.igs");
    assert_eq!(told["file"]["bytes"], iges.len());
    assert!(
        iges.chunks(81)
            .all(|line| line.len() == 81 && line[80] == b'\n')
    );
    assert!(iges.windows(15).any(|w| w == b"20261121.093000"));

    let report: Value =
        serde_json::from_slice(&fs::read(directory.path().join("r.json")).unwrap()).unwrap();
    assert_eq!(report, told["report"]);
    assert_eq!(report["regions"]["count"], 2);
    assert_eq!(report["regions"]["list"].as_array().map(Vec::len), Some(2));
    assert_eq!(report["model"]["faces"], 2);
    assert_eq!(report["model"]["edges_shared"], 1);
    assert_eq!(report["scan"]["samples"], 49 * 49);
    assert_eq!(report["settings"]["method"], "relief");
    for key in [
        "snr_db",
        "lost_nodes",
        "invented_nodes",
        "warnings",
        "versions",
    ] {
        assert!(!report[key].is_null(), "{key}");
    }
    for stage in ["regrid", "segment", "reconstruct", "export", "pictures"] {
        assert!(report["timings_s"][stage].is_f64(), "{stage}");
    }
    for picture in ["range.png", "regions.png", "residuals.png", "inliers.png"] {
        let bytes = fs::read(directory.path().join("pics").join(picture)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{picture}");
    }
}

#[test]
fn the_same_samples_give_the_same_bytes_whatever_the_threads() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("roof.xyz"), roof()).unwrap();
    let converted = |out: &str, threads: &str| {
        let output = relief(
            directory.path(),
            &[
                "convert",
                "roof.xyz",
                "-o",
                out,
                "--threads",
                threads,
                "--entities",
                "128",
            ],
        );
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        fs::read(directory.path().join(out)).unwrap()
    };
    let one = converted("one.igs", "1");
    assert_eq!(one, converted("two.iges", "2"));
    // Only the two formats of before stand there, no temporary file.
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 3);
}

#[test]
fn the_ending_of_the_output_picks_the_format() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("roof.xyz"), roof()).unwrap();
    let converted = |out: &str, more: &[&str]| {
        let arguments = [&["convert", "roof.xyz", "--json", "-o", out][..], more].concat();
        let output = relief(at, &arguments);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let settings = &told["report"]["settings"];
        let settings = [&settings["step"], &settings["step_units"]].map(Value::to_string);
        (fs::read_to_string(at.join(out)).unwrap(), settings)
    };
    let (iges, settings) = converted("roof.igs", &[]);
    assert!(iges.lines().all(|line| line.len() == 80));
    assert_eq!(settings, ["\"off\"", "\"mm\""]);
    let (step, settings) = converted("roof.step", &[]);
    assert!(step.starts_with("ISO-10303-21;") && step.contains("FILE_SCHEMA(('AP242_MANAGED_"));
    assert_eq!(settings, ["\"ap242\"", "\"mm\""]);
    assert_eq!(step.matches("=ADVANCED_FACE(").count(), 2);
    let (same, _) = converted("same.STP", &[]);
    assert_eq!(same.replace("same", "roof"), step);
    let options = ["--step-schema", "ap214", "--step-units", "inch"];
    let (other, settings) = converted("inch.stp", &options);
    assert!(other.contains("AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }"));
    assert!(other.contains("CONVERSION_BASED_UNIT('INCH'"));
    assert_eq!(settings, ["\"ap214\"", "\"inch\""]);
}

#[test]
fn wrong_usage_is_told_in_one_line_with_exit_code_2() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("roof.xyz"), roof()).unwrap();
    refused(&relief(at, &["convert", "roof.xyz", "--jsn"]), 2, "'--jsn'");
    refused(&relief(at, &["convert"]), 2, "INPUT");
    refused(&relief(at, &["retry", "seven"]), 2, "seven");
    refused(
        &relief(at, &["convert", "roof.xyz", "-o", "roof.dxf"]),
        2,
        ".igs, .iges, .step, .stp",
    );
    refused(
        &relief(at, &["convert", "roof.xyz", "--pitch-mm", "0"]),
        2,
        "pitch_mm",
    );
    refused(
        &relief(at, &["rerun", "x", "--set", "neighbours"]),
        2,
        "KEY=VALUE",
    );
    refused(
        &relief(at, &["rerun", "x", "--edit", "absent.toml"]),
        1,
        "absent.toml",
    );
    refused(
        &relief(at, &["status", "--url", "https://x:1"]),
        2,
        "http://127.0.0.1",
    );
    refused(
        &relief(at, &["demo", "--object", "castle"]),
        2,
        "house, cylinder",
    );
    refused(&relief(at, &["demo", "--noise-mm=-1"]), 2, "noise");
}

#[test]
fn failures_are_told_in_one_line_with_exit_code_1() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("bad.xyz"), "0 0 0\n1 2\n").unwrap();
    fs::write(at.join("empty.xyz"), "# nothing\n").unwrap();
    refused(&relief(at, &["convert", "none.xyz"]), 1, "none.xyz");
    refused(&relief(at, &["convert", "bad.xyz"]), 1, "line 2");
    refused(&relief(at, &["convert", "empty.xyz"]), 1, "no points");
    let socket = at.join("none.sock");
    let socket = socket.to_str().unwrap();
    for command in [
        &["status"][..],
        &["abort"],
        &["scans"],
        &["fetch", "x"],
        &["scan", "--wait"],
    ] {
        let arguments: Vec<&str> = command
            .iter()
            .copied()
            .chain(["--socket", socket])
            .collect();
        refused(&relief(at, &arguments), 1, "relief doctor");
    }
    assert!(!at.join("none.igs").exists() && !at.join("bad.igs").exists());
}

#[test]
fn what_cannot_become_a_part_is_told_before_the_work() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let write = |name: &str, text: &str| fs::write(at.join(name), text).unwrap();
    write("roof.xyz", &roof());
    let line = |point: fn(i32) -> String| (0..40).map(point).collect::<String>();
    write("column.xyz", &line(|i| format!("1 {i} {i}\n")));
    write("slanted.xyz", &line(|i| format!("{i} {} 5\n", 2 * i)));
    write("far.xyz", "1 2 3\n1 2 1e300\n");
    write(
        "holes.xyz",
        &line(|_| "nan nan nan\n1 2 3\nnan 1 2\n".into()),
    );
    let convert = |arguments: &[&str]| relief(at, &[&["convert"], arguments].concat());
    refused(&convert(&["column.xyz"]), 1, "at one x, a single column");
    refused(&convert(&["slanted.xyz"]), 1, "on one slanted line");
    refused(&convert(&["far.xyz"]), 1, "a coordinate of 1e300 mm");
    refused(&convert(&["holes.xyz"]), 1, "80 of 120 points");
    // 24 mm square over 2^24 nodes.
    refused(
        &convert(&["roof.xyz", "--pitch-mm", "0.001"]),
        2,
        "--pitch-mm 0.0059",
    );
    let name = "x".repeat(5000);
    refused(&convert(&["roof.xyz", "--name", &name]), 2, "at most 100");
    for places in [
        &["-o", "none/roof.igs"][..],
        &["--report", "none/r.json"],
        &["--pictures", "roof.xyz/pictures"],
    ] {
        let output = convert(&[&["roof.xyz"], places].concat());
        refused(&output, 2, "directory");
        assert!(!at.join("roof.igs").exists(), "{places:?}");
    }
}

#[test]
fn points_without_a_measurement_are_left_out_and_told() {
    let directory = tempfile::tempdir().unwrap();
    let text = roof() + "nan nan nan\n";
    fs::write(directory.path().join("roof.xyz"), text).unwrap();
    let output = relief(directory.path(), &["convert", "roof.xyz"]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}");
    let remarks = String::from_utf8_lossy(&output.stderr);
    assert!(
        remarks.contains("relief: note: roof.xyz: 1 point(s) without a measurement"),
        "{remarks}"
    );
    assert!(told.contains("1 edge shared"), "{told}");
}

#[test]
fn scattered_dots_are_no_part_and_the_user_learns_why() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let dots = (0..16).map(|k| format!("{} {} 0\n", k % 4, k / 4));
    fs::write(at.join("dots.xyz"), dots.collect::<String>()).unwrap();
    let output = relief(at, &["convert", "dots.xyz"]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    let last = told.lines().last().unwrap();
    assert!(
        last.starts_with("relief: dots.xyz: ") && last.contains("larger pitch"),
        "{told}"
    );
    assert!(!at.join("dots.igs").exists());
}

#[test]
fn help_is_there_for_every_command() {
    let directory = tempfile::tempdir().unwrap();
    let help = relief(directory.path(), &["--help"]);
    assert!(help.status.success());
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    for command in [
        "demo", "convert", "scan", "abort", "status", "scans", "jobs", "retry", "cancel", "rerun",
        "watch", "fetch", "doctor",
    ] {
        assert!(
            text.contains(&format!("\n  {command} ")),
            "{command} is not listed:\n{text}"
        );
        let own = relief(directory.path(), &[command, "--help"]);
        assert!(own.status.success());
        assert!(
            String::from_utf8_lossy(&own.stdout).contains("--json"),
            "{command}"
        );
    }
}

#[test]
fn coordinates_in_metres_are_suspected_where_the_grid_would_be_too_fine() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let mut text = String::new();
    for i in 0..50 {
        for j in 0..50 {
            writeln!(
                text,
                "{:.5} {:.5} 0.01",
                f64::from(i) * 2e-4,
                f64::from(j) * 2e-4
            )
            .expect("text takes it");
        }
    }
    fs::write(at.join("metres.xyz"), text).unwrap();
    refused(&relief(at, &["convert", "metres.xyz"]), 1, "--units");
    // Who asks for it on the command line is told that this is no pitch.
    let asked = ["convert", "metres.xyz", "--pitch-mm", "0.0002"];
    refused(&relief(at, &asked), 2, "pitch_mm = 0.0002");
    assert!(!at.join("metres.igs").exists());
    let output = relief(at, &["convert", "metres.xyz", "--units", "m"]);
    assert!(output.status.success() && at.join("metres.igs").exists());
}

/// A pyramid of four sides in the middle of a level table, 60 mm square.
fn pyramid_on_a_table() -> String {
    let mut text = String::new();
    for i in 0..=120 {
        for j in 0..=120 {
            let (x, y) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
            // Turned against the grid, so that no edge runs along it.
            let (u, v) = (x - 30.0, y - 30.0);
            let (u, v) = (0.95 * u + 0.3 * v, 0.95 * v - 0.3 * u);
            let z = (20.0 - 1.2 * u.abs().max(v.abs())).max(0.0);
            writeln!(text, "{x} {y} {z}").expect("text takes it");
        }
    }
    text
}

#[test]
fn a_table_is_left_out_told_and_kept_on_request() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("p.xyz"), pyramid_on_a_table()).unwrap();
    let report = |more: &[&str]| -> Value {
        let output = relief(
            directory.path(),
            &[&["convert", "p.xyz", "--json"], more].concat(),
        );
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{told}");
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        told["report"].clone()
    };
    let removed = report(&[]);
    assert_eq!(removed["model"]["faces"], 4, "{}", removed["background"]);
    assert_eq!(removed["settings"]["background"], "remove");
    let table = &removed["background"]["list"][0];
    assert_eq!(removed["background"]["count"], 1);
    assert_eq!(table["kind"], "table");
    assert!((table["normal"][2].as_f64().unwrap() - 1.0).abs() < 1e-6);
    assert!(table["offset_mm"].as_f64().unwrap().abs() < 1e-3);
    assert!(table["why"].as_str().unwrap().contains("stands on it"));
    assert!(removed["lost_nodes"].as_u64().unwrap() < 200);
    // Each side is a triangle of slope 1.2 over a quarter of a square.
    let square = (2.0 * 20.0 / 1.2_f64).powi(2) / (0.95_f64.powi(2) + 0.3_f64.powi(2));
    let side = square / 4.0 * (1.0 + 1.2_f64.powi(2) * (0.95_f64.powi(2) + 0.09)).sqrt();
    for region in removed["regions"]["list"].as_array().unwrap() {
        let area = region["area_mm2"].as_f64().unwrap();
        assert!((area / side - 1.0).abs() < 0.03, "{area} {side}");
    }
    let kept = report(&["--keep-background"]);
    assert_eq!(kept["model"]["faces"], 5);
    assert_eq!(kept["background"]["count"], 0);
    // Without the table's samples the same faces are left.
    let above = report(&["--roi-z-mm", "0.5,"]);
    assert_eq!(above["model"]["faces"], 4);
    assert_eq!(above["settings"]["roi_z_mm"][0], 0.5);
    assert!(above["settings"]["roi_z_mm"][1].is_null());
    let small = report(&["--minimum-area-mm2", "400"]);
    assert_eq!(small["settings"]["minimum_area_mm2"], 400.0);
    assert_eq!(small["model"]["faces"], 1, "the table is all that is left");
}

#[test]
fn a_region_of_interest_that_holds_nothing_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("roof.xyz"), roof()).unwrap();
    let output = relief(
        directory.path(),
        &["convert", "roof.xyz", "--roi-x-mm=90,100"],
    );
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("x 90 to 100 mm"), "{told}");
    assert!(told.contains("widen them"), "{told}");
    let output = relief(
        directory.path(),
        &["convert", "roof.xyz", "--roi-z-mm=5,-5"],
    );
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("the first limit must be below"), "{told}");
}
