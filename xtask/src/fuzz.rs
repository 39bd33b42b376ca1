//! Fuzzers for everything that comes from outside.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::shell;

/// All of them, in the order of `fuzz/src/lib.rs`.
const TARGETS: [&str; 8] = [
    "config",
    "http",
    "iges",
    "journal",
    "ply",
    "protocol",
    "scan_file",
    "session",
];
/// The longest input: enough for every format to show all it has.
const LONGEST_BYTES: u32 = 16_384;
/// What the guide promises of files this small, and more than the fuzzer itself needs.
const MEMORY_MB: u32 = 1_024;
/// An input that takes longer is a finding.
const LONGEST_S: u32 = 20;

/// What is wanted of the fuzzers.
#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Seconds for each target
    #[arg(long, value_name = "N", default_value_t = 30)]
    pub(crate) seconds: u32,
    /// Targets; all unless named
    #[arg(value_name = "TARGET", value_parser = TARGETS)]
    pub(crate) targets: Vec<String>,
}

/// Builds the fuzzers and runs one after the other; fails with the first finding of each.
pub(crate) fn run(options: &Options) -> Result<()> {
    let path = search_path()?;
    let environment = [("PATH", path)];
    let fuzz = ["fuzz"];
    let common = ["--sanitizer", "none", "--fuzz-dir", "fuzz"];
    shell::run_with(
        "cargo",
        &[&fuzz[..], &["build"], &common].concat(),
        &environment,
    )?;
    let wanted: Vec<&str> = match options.targets.as_slice() {
        [] => TARGETS.to_vec(),
        named => named.iter().map(String::as_str).collect(),
    };
    let mut failed = Vec::new();
    for target in wanted {
        let folders = ["corpus", "seeds", "finds"].map(|kind| format!("fuzz/{kind}/{target}"));
        for folder in &folders {
            std::fs::create_dir_all(shell::root().join(folder))
                .with_context(|| format!("cannot make {folder}"))?;
        }
        let limits = [
            format!("-max_total_time={}", options.seconds),
            format!("-max_len={LONGEST_BYTES}"),
            format!("-rss_limit_mb={MEMORY_MB}"),
            format!("-timeout={LONGEST_S}"),
            "-print_final_stats=1".to_owned(),
        ];
        let mut arguments = [&fuzz[..], &["run"], &common, &[target]].concat();
        arguments.extend(folders.iter().map(String::as_str));
        arguments.push("--");
        arguments.extend(limits.iter().map(String::as_str));
        if let Err(error) = shell::run_with("cargo", &arguments, &environment) {
            eprintln!("{error:#}");
            failed.push(target);
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    bail!(
        "findings in {}: mend what is in fuzz/artifacts, and move it to fuzz/finds/TARGET, where \
         the tests replay it",
        failed.join(", ")
    );
}

/// Where `cargo fuzz` is found; it is installed if it is not there yet.
fn search_path() -> Result<String> {
    let tools = shell::root().join("target/tools");
    let own = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::iter::once(tools.join("bin")).chain(std::env::split_paths(&own));
    let path = std::env::join_paths(folders.collect::<Vec<PathBuf>>())?;
    let path = path.into_string().ok().context("PATH is not UTF-8")?;
    let found = Command::new("cargo")
        .args(["fuzz", "--version"])
        .env("PATH", &path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !found {
        let root = tools.display().to_string();
        shell::run(
            "cargo",
            &["install", "--locked", "--root", &root, "cargo-fuzz@0.13.2"],
        )?;
    }
    Ok(path)
}
