//! Rules of the house that the compiler does not hold.

use std::collections::BTreeMap;
use std::fs;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::{shell, targets};

/// Longest source file we accept, in lines.
const LONGEST_FILE_LINES: usize = 600;

/// What a crate may depend on among ours, outside of its tests.
///
/// Dependencies point one way; a crate that is missing here is an error, so that a new
/// crate's place is a decision and not an accident.
const ALLOWED: &[(&str, &[&str])] = &[
    ("scanner-protocol", &[]),
    ("scanner-driver", &["scanner-protocol"]),
    ("scan-files", &[]),
    ("sim-scanner", &["scanner-protocol", "scan-files"]),
    ("range-image", &[]),
    ("nurbs", &[]),
    ("regrid", &["range-image"]),
    ("segment", &["range-image"]),
    ("shapes", &["nurbs"]),
    ("faces", &["range-image", "shapes"]),
    ("regularize", &["shapes"]),
    ("reconstruct", &["nurbs", "range-image", "shapes"]),
    ("solids", &["nurbs"]),
    (
        "cad-exchange",
        &["nurbs", "reconstruct", "shapes", "solids", "terraces"],
    ),
    (
        "tessellate",
        &["nurbs", "range-image", "reconstruct", "shapes"],
    ),
    ("compare", &["range-image"]),
    ("metrology", &["range-image"]),
    ("skin", &["nurbs", "range-image"]),
    (
        "surfacing",
        &["nurbs", "range-image", "reconstruct", "segment"],
    ),
    ("toolpath", &["range-image"]),
    ("terraces", &["nurbs"]),
    ("fill", &["nurbs", "range-image"]),
    ("gaps", &["fill", "range-image"]),
    (
        "features",
        &["nurbs", "range-image", "segment", "shapes", "terraces"],
    ),
    (
        "pipeline",
        &[
            "faces",
            "gaps",
            "range-image",
            "reconstruct",
            "regrid",
            "regularize",
            "segment",
            "shapes",
        ],
    ),
    ("storage", &[]),
    (
        "scan-record",
        &["range-image", "scanner-protocol", "storage"],
    ),
    ("mesh-files", &["tessellate"]),
    ("page", &[]),
    ("deliverables", &DELIVERABLES),
    ("relief-api", &[]),
    ("job-queue", &["relief-api"]),
    ("reliefd", &DAEMON),
    ("relief", &COMMAND_LINE),
    (
        "relief-faults",
        &[
            "range-image",
            "scan-record",
            "scanner-driver",
            "scanner-protocol",
            "sim-scanner",
        ],
    ),
    (
        "relief-throughput",
        &[
            "scan-files",
            "scanner-driver",
            "scanner-protocol",
            "sim-scanner",
        ],
    ),
    (
        "relief-fillings",
        &["fill", "range-image", "relief-surfaces"],
    ),
    ("relief-tests", &EVERYTHING),
    ("relief-studies", &STUDIES),
    ("relief-test-libraries", &["job-queue"]),
    ("nats-child", &[]),
    (
        "relief-benches",
        &[
            "cad-exchange",
            "pipeline",
            "range-image",
            "reconstruct",
            "regrid",
            "segment",
        ],
    ),
    (
        "relief-surfaces",
        &[
            "nurbs",
            "range-image",
            "reconstruct",
            "regrid",
            "scan-files",
            "skin",
            "surfacing",
        ],
    ),
    ("relief-vm-systemd", &["sim-scanner"]),
    (
        "relief-vm-usb",
        &[
            "relief-throughput",
            "scan-files",
            "scanner-driver",
            "scanner-protocol",
            "sim-scanner",
        ],
    ),
    ("xtask", &[]),
];

const DELIVERABLES: [&str; 18] = [
    "cad-exchange",
    "compare",
    "features",
    "mesh-files",
    "nurbs",
    "page",
    "pipeline",
    "range-image",
    "reconstruct",
    "regrid",
    "segment",
    "shapes",
    "skin",
    "storage",
    "surfacing",
    "terraces",
    "tessellate",
    "toolpath",
];

const DAEMON: [&str; 19] = [
    "cad-exchange",
    "deliverables",
    "job-queue",
    "nurbs",
    "pipeline",
    "range-image",
    "reconstruct",
    "regrid",
    "relief-api",
    "scan-files",
    "scan-record",
    "scanner-driver",
    "scanner-protocol",
    "segment",
    "shapes",
    "skin",
    "storage",
    "surfacing",
    "toolpath",
];

const COMMAND_LINE: [&str; 26] = [
    "cad-exchange",
    "compare",
    "deliverables",
    "features",
    "fill",
    "job-queue",
    "mesh-files",
    "metrology",
    "nurbs",
    "pipeline",
    "range-image",
    "reconstruct",
    "regrid",
    "relief-api",
    "reliefd",
    "scan-files",
    "scan-record",
    "scanner-driver",
    "segment",
    "shapes",
    "sim-scanner",
    "skin",
    "solids",
    "storage",
    "surfacing",
    "toolpath",
];

const EVERYTHING: [&str; 15] = [
    "cad-exchange",
    "deliverables",
    "pipeline",
    "range-image",
    "reconstruct",
    "regrid",
    "relief-api",
    "reliefd",
    "scan-files",
    "scan-record",
    "scanner-driver",
    "scanner-protocol",
    "shapes",
    "sim-scanner",
    "storage",
];

const STUDIES: [&str; 20] = [
    "cad-exchange",
    "deliverables",
    "job-queue",
    "nats-child",
    "nurbs",
    "pipeline",
    "range-image",
    "reconstruct",
    "regrid",
    "relief-api",
    "relief-tests",
    "relief-throughput",
    "reliefd",
    "scan-files",
    "scan-record",
    "scanner-driver",
    "segment",
    "shapes",
    "sim-scanner",
    "storage",
];

/// Libraries that computation must not link: clocks, files and runtimes come with them.
const KEPT_FROM_GEOMETRY: [&str; 6] = [
    "tokio",
    "tracing",
    "serde_json",
    "jiff",
    "rustix",
    "tempfile",
];

/// Checks every rule and reports all that are broken.
pub(crate) fn check() -> Result<()> {
    let mut broken = Vec::new();
    let metadata: Value = serde_json::from_str(&shell::output(
        "cargo",
        &["metadata", "--no-deps", "--format-version", "1"],
    )?)?;
    dependencies(&metadata, &mut broken)?;
    targets::check(&metadata, &mut broken)?;
    sources(&mut broken)?;
    crate::safety::check(&mut broken)?;
    if broken.is_empty() {
        println!("rules: all hold");
        return Ok(());
    }
    bail!(
        "{} rules are broken:\n  {}",
        broken.len(),
        broken.join("\n  ")
    );
}

fn dependencies(metadata: &Value, broken: &mut Vec<String>) -> Result<()> {
    let allowed: BTreeMap<_, _> = ALLOWED.iter().copied().collect();
    for package in metadata["packages"]
        .as_array()
        .context("cargo metadata lists no packages")?
    {
        let name = package["name"]
            .as_str()
            .context("a package without a name")?;
        let Some(may_use) = allowed.get(name) else {
            broken.push(format!(
                "{name}: has no place in xtask's table of dependencies"
            ));
            continue;
        };
        let in_geometry = package["manifest_path"]
            .as_str()
            .is_some_and(|path| path.contains("/geometry/"));
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let used = dependency["name"].as_str().unwrap_or_default();
            // Tests may compare with anything; only what is linked matters.
            if dependency["kind"].as_str() == Some("dev") {
                continue;
            }
            if allowed.contains_key(used) && !may_use.contains(&used) {
                broken.push(format!("{name}: must not depend on {used}"));
            }
            if in_geometry && KEPT_FROM_GEOMETRY.contains(&used) {
                broken.push(format!("{name}: computation must not link {used}"));
            }
        }
    }
    Ok(())
}

/// Sources that may be no longer than [`LONGEST_FILE_LINES`] and have no characters outside ASCII. The
/// page's words in other languages are not among them: they stand in `daemon/web/strings/*.json` alone.
const SOURCES: [&str; 5] = ["*.rs", "*.py", "*.js", "*.css", "*.html"];

fn sources(broken: &mut Vec<String>) -> Result<()> {
    let list = [&["ls-files"][..], &SOURCES].concat();
    for path in shell::output("git", &list)?.lines() {
        let text = fs::read_to_string(shell::root().join(path))
            .with_context(|| format!("cannot read {path}"))?;
        let lines = text.lines().count();
        if lines > LONGEST_FILE_LINES {
            broken.push(format!(
                "{path}: {lines} lines, more than {LONGEST_FILE_LINES}"
            ));
        }
        if let Some(line) = text.lines().position(|line| !line.is_ascii()) {
            broken.push(format!("{path}:{}: a character outside ASCII", line + 1));
        }
    }
    Ok(())
}
