//! What is published about the JSON documents in `docs/schema` holds for real ones, and
//! leaves out nothing that they hold.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;
mod service;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::schema::{check, published, validator};
use common::{relief, roof, text};
use serde_json::{Value, json};

const FILES: [&str; 5] = [
    "acceptance.schema.json",
    "comparison.schema.json",
    "report.schema.json",
    "manifest.schema.json",
    "commands.schema.json",
];

fn document(output: &Output) -> Value {
    let told = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {told}"))
}

fn file(path: PathBuf) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_schemas_are_schemas() {
    for name in FILES {
        let schema = published(name);
        assert!(jsonschema::meta::is_valid(&schema), "{name}");
        assert_eq!(schema["$id"], name);
        assert!(schema["$schema"].as_str().unwrap().contains("2020-12"));
    }
    for command in [
        "accept",
        "calibrate",
        "compare",
        "convert",
        "skin",
        "surface",
        "demo",
        "scan",
        "abort",
        "pause",
        "resume",
        "status",
        "scans",
        "jobs",
        "retry",
        "cancel",
        "rerun",
        "watch",
        "fetch",
        "doctor",
        "token",
        "laser",
        "toolpath",
        "fill",
        "webhooks",
        "hooks",
        "uploads",
        "discover",
        "features",
        "features_train",
        "config_check",
    ] {
        let reference = format!("commands.schema.json#/$defs/{command}");
        assert!(
            !validator(&reference, false).is_valid(&json!(7)),
            "{command}"
        );
    }
}

#[test]
fn the_report_of_a_conversion() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("roof.xyz"), text(&roof())).unwrap();
    let options = ["convert", "roof.xyz", "--json", "--report", "r.json"];
    for more in [
        &[][..],
        &["--method", "shim-lee", "--entities", "128"],
        &[
            "--roi-z-mm=,19",
            "--keep-background",
            "--minimum-area-mm2",
            "5",
        ],
    ] {
        let told = document(&relief(at, &[&options[..], more].concat()));
        check("commands.schema.json#/$defs/convert", &told);
        check("report.schema.json", &file(at.join("r.json")));
        // Newer programs may say more, but not less.
        let mut newer = told["report"].clone();
        newer["news"] = json!({ "of": 1 });
        newer["scan"]["news"] = json!(true);
        let schema = validator("report.schema.json", false);
        assert!(schema.is_valid(&newer));
        for key in ["snr_db", "warnings", "regions"] {
            let mut less = newer.clone();
            less.as_object_mut().unwrap().remove(key);
            assert!(!schema.is_valid(&less), "{key}");
        }
        newer["regions"]["count"] = json!("two");
        assert!(!schema.is_valid(&newer));
    }
}

#[test]
fn the_report_of_a_comparison() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("roof.xyz"), text(&roof())).unwrap();
    // The roof's left side: a plane slides, and half of the scan has no nominal.
    let corners = [
        "-30 -20 0",
        "0 -20 18",
        "0 20 22",
        "-30 -20 0",
        "0 20 22",
        "-30 20 4",
    ];
    let facets = corners.chunks(3).map(|facet| {
        let vertices: String = facet.iter().map(|c| format!("vertex {c}\n")).collect();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    });
    let nominal = format!("solid\n{}endsolid\n", facets.collect::<String>());
    fs::write(at.join("part.stl"), nominal).unwrap();
    let options = [
        "compare", "roof.xyz", "part.stl", "--json", "--report", "r.json",
    ];
    for (more, freedoms) in [
        (&["--roi-x-mm=,-1"][..], 3),
        (
            &[
                "--align",
                "as-placed",
                "--tolerance-mm",
                "0.1",
                "--map",
                "m.png",
            ],
            0,
        ),
    ] {
        let told = document(&relief(at, &[&options[..], more].concat()));
        check("commands.schema.json#/$defs/compare", &told);
        check("comparison.schema.json", &file(at.join("r.json")));
        assert_eq!(told["passed"], true, "{told:#}");
        let free = told["report"]["alignment"]["free"].as_array().unwrap();
        assert_eq!(free.len(), freedoms, "{told:#}");
    }
}

#[test]
fn what_a_surface_tells() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("roof.xyz"), text(&roof())).unwrap();
    let options = ["surface", "roof.xyz", "--json", "--tolerance-mm", "0.1"];
    for more in [
        &[][..],
        &["--fair-mm", "0.05", "--compare", "--pictures", "drawn"],
        &["--knots", "derivative", "--pitch-mm", "1"],
    ] {
        let told = document(&relief(at, &[&options[..], more].concat()));
        check("commands.schema.json#/$defs/surface", &told);
    }
}

#[test]
fn what_the_demo_tells_with_a_table_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let told = document(&relief(
        at,
        &[
            "demo",
            "--json",
            "--object",
            "house-on-table",
            "--out",
            "there",
        ],
    ));
    check("commands.schema.json#/$defs/demo", &told);
    assert_ne!(told["report"]["background"]["count"], 0);
    check("report.schema.json", &file(at.join("there/report.json")));
    check(
        "manifest.schema.json",
        &file(at.join("there/manifest.json")),
    );
}

#[test]
fn what_a_check_of_the_configuration_tells() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let check_of = |name: &str, content: &str| {
        fs::write(at.join(name), content).unwrap();
        let told = relief(at, &["config", "check", name, "--json"]);
        let document = document(&told);
        check("commands.schema.json#/$defs/config_check", &document);
        (told.status.code(), document)
    };
    let two = "[scanners.left]\nport = \"/dev/a\"\n[scanners.right]\nport = \"/dev/b\"\n";
    let (code, told) = check_of("two.toml", two);
    assert_eq!((code, &told["sound"]), (Some(0), &json!(true)));
    assert_eq!(
        told["scanners"][1],
        json!({"name": "right", "place": "/dev/b"})
    );
    assert_eq!(told.get("error"), None);

    let (code, told) = check_of("wrong.toml", "[regrid]\n\nneighbors = 9\n");
    assert_eq!((code, &told["sound"]), (Some(1), &json!(false)));
    assert_eq!(told["error"]["line"], 3);
    let message = told["error"]["message"].as_str().unwrap();
    assert!(message.contains("neighbours"), "{message}");

    // Files that it names are looked at as the service would.
    let secret = "[[webhooks]]\nname = \"lab\"\nurl = \"http://127.0.0.1:1/\"\n\
                  secret_file = \"/nowhere/lab.secret\"\n";
    let (code, told) = check_of("secret.toml", secret);
    assert_eq!(code, Some(1));
    let message = told["error"]["message"].as_str().unwrap();
    assert!(message.contains("/nowhere/lab.secret"), "{message}");
}

#[test]
fn what_the_doctor_tells() {
    let directory = tempfile::tempdir().unwrap();
    let told = relief(
        directory.path(),
        &["doctor", "--json", "--socket", "none.sock"],
    );
    check("commands.schema.json#/$defs/doctor", &document(&told));
}
