//! Fuzzers for everything that comes from outside.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use crate::{apt, shell};

/// All of them, in the order of `fuzz/src/lib.rs`.
const TARGETS: [&str; 9] = [
    "config",
    "http",
    "iges",
    "journal",
    "ply",
    "protocol",
    "scan_file",
    "session",
    "step",
];
/// The longest input: enough for every format to show all it has, and for the limits of its
/// parts.
const LONGEST_BYTES: u32 = 65_536;
/// What the guide promises of files this small, and more than the fuzzer itself needs.
const MEMORY_MB: u32 = 1_024;
/// An input that takes longer is a finding.
const LONGEST_S: u32 = 20;
/// Has the compiler count branches and tell comparisons, as libFuzzer wants it: the flags of
/// cargo-fuzz. They are those of every release of Rust, so that no other tool is needed.
const WATCHED: [&str; 8] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Cllvm-args=-sanitizer-coverage-stack-depth",
    "-Cllvm-args=-simplifycfg-branch-fold-threshold=0",
    "--cfg=fuzzing",
];
/// Most bytes that are kept of a target's corpus: a repository grows by them at each change.
const KEPT_BYTES: u64 = 100_000;
/// What libFuzzer says at the end of a run, and what it is.
const STATISTICS: [(&str, &str); 4] = [
    ("stat::number_of_executed_units:", "inputs"),
    ("stat::new_units_added:", "new"),
    ("stat::slowest_unit_time_sec:", "s the slowest"),
    ("stat::peak_rss_mb:", "MB"),
];

/// What is wanted of the fuzzers.
#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Seconds for each target
    #[arg(long, value_name = "N", default_value_t = 30)]
    pub(crate) seconds: u32,
    /// Targets at work at the same time
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) jobs: usize,
    /// Afterwards leave a small choice of what has been found in fuzz/kept, for the repository
    #[arg(long)]
    pub(crate) keep: bool,
    /// Targets; all unless named
    #[arg(value_name = "TARGET", value_parser = TARGETS)]
    pub(crate) targets: Vec<String>,
}

/// Builds the fuzzers and runs one after the other, or some at a time; fails with the first
/// finding of each.
pub(crate) fn run(options: &Options) -> Result<()> {
    ensure!(options.jobs > 0, "no fuzzer runs with --jobs 0");
    if std::env::var_os("CXX").is_none() {
        // libFuzzer itself is C++.
        apt::need(&[("c++", "g++")])?;
    }
    let programs = build()?;
    let wanted: VecDeque<&str> = match options.targets.as_slice() {
        [] => TARGETS.into(),
        named => named.iter().map(String::as_str).collect(),
    };
    let (queue, failed) = (Mutex::new(wanted), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..options.jobs {
            scope.spawn(|| {
                while let Some(target) = take(&queue) {
                    let mut done = fuzz(&programs, target, options.seconds);
                    if options.keep {
                        done = done.and_then(|()| keep(&programs, target));
                    }
                    if let Err(error) = done {
                        eprintln!("{target}: {error:#}");
                        if let Ok(mut failed) = failed.lock() {
                            failed.push(target);
                        }
                    }
                }
            });
        }
    });
    let failed = failed.into_inner().unwrap_or_default();
    if failed.is_empty() {
        return Ok(());
    }
    bail!(
        "findings in {}: mend what is in fuzz/artifacts, and move it to fuzz/finds/TARGET, where \
         the tests replay it",
        failed.join(", ")
    );
}

fn take<'a>(queue: &Mutex<VecDeque<&'a str>>) -> Option<&'a str> {
    queue.lock().ok()?.pop_front()
}

/// Builds all fuzzers; the folder where they are.
fn build() -> Result<PathBuf> {
    let version = shell::output("rustc", &["--version", "--verbose"])?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.context("rustc does not say what it compiles for")?;
    let folder = shell::target().join("fuzz");
    // With a target named, cargo leaves what runs in the build itself alone.
    let arguments = [
        "build",
        "--release",
        "--locked",
        "--manifest-path",
        "fuzz/Cargo.toml",
        "--target",
        host,
        "--target-dir",
        folder.to_str().context("the target folder is not UTF-8")?,
    ];
    shell::run_with("cargo", &arguments, &[("RUSTFLAGS", WATCHED.join(" "))])?;
    Ok(folder.join(host).join("release"))
}

/// Runs a target for so long; what it says goes to a file beside what it finds.
fn fuzz(programs: &Path, target: &str, seconds: u32) -> Result<()> {
    let root = shell::root();
    let place = |kind: &str| root.join("fuzz").join(kind).join(target);
    let folders = ["corpus", "seeds", "kept", "finds", "artifacts"].map(place);
    for folder in &folders {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let [corpus, seeds, kept, finds, artifacts] = folders;
    let log = artifacts.with_extension("log");
    let words = File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
    eprintln!(
        "$ fuzz {target} for {seconds} s, its words in {}",
        log.display()
    );
    let status = Command::new(programs.join(target))
        .args([corpus, seeds, kept, finds])
        .arg(format!("-artifact_prefix={}/", artifacts.display()))
        .arg(format!("-max_total_time={seconds}"))
        .arg(format!("-max_len={LONGEST_BYTES}"))
        .arg(format!("-rss_limit_mb={MEMORY_MB}"))
        .arg(format!("-timeout={LONGEST_S}"))
        .arg("-print_final_stats=1")
        .current_dir(&root)
        .stdout(words.try_clone()?)
        .stderr(words)
        .status()
        .with_context(|| format!("cannot start the fuzzer of {target}"))?;
    let said = String::from_utf8_lossy(&fs::read(&log)?).into_owned();
    if !status.success() {
        bail!("{status}\n{}", last_lines(&said, 40));
    }
    println!("{target}: {}", told(&said)?);
    Ok(())
}

/// Leaves the fewest inputs that reach all that the corpus reaches, the shortest first, as far as
/// there is room for them.
fn keep(programs: &Path, target: &str) -> Result<()> {
    let place = |kind: &str| shell::root().join("fuzz").join(kind).join(target);
    let chosen = shell::target().join("fuzz-chosen").join(target);
    if chosen.exists() {
        fs::remove_dir_all(&chosen)?;
    }
    fs::create_dir_all(&chosen)?;
    let output = Command::new(programs.join(target))
        .arg("-set_cover_merge=1")
        .arg(format!("-max_len={LONGEST_BYTES}"))
        .arg(format!("-rss_limit_mb={MEMORY_MB}"))
        .arg(format!("-timeout={LONGEST_S}"))
        .arg(&chosen)
        .args(["seeds", "finds", "kept", "corpus"].map(place))
        .current_dir(&chosen)
        .output()
        .with_context(|| format!("cannot start the fuzzer of {target}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("{}\n{}", output.status, last_lines(&said, 40));
    }
    let known: Vec<Vec<u8>> = ["seeds", "finds"]
        .into_iter()
        .map(|kind| contents(&place(kind)))
        .collect::<Result<Vec<_>>>()?
        .concat()
        .into_iter()
        .map(|(_, bytes)| bytes)
        .collect();
    let mut inputs = contents(&chosen)?;
    inputs.retain(|(_, bytes)| !known.contains(bytes));
    let all = inputs.len();
    let inputs = that_fit(inputs, KEPT_BYTES);
    let kept = place("kept");
    fs::remove_dir_all(&kept)?;
    fs::create_dir_all(&kept)?;
    let mut bytes = 0;
    for (name, input) in &inputs {
        fs::write(kept.join(name), input)?;
        bytes += input.len();
    }
    println!(
        "{target}: {} of {all} inputs kept, {bytes} bytes",
        inputs.len()
    );
    Ok(())
}

/// Name and content of each file in a folder.
fn contents(folder: &Path) -> Result<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        files.push((name, fs::read(entry.path())?));
    }
    Ok(files)
}

/// The shortest inputs that together have at most so many bytes.
fn that_fit(mut inputs: Vec<(String, Vec<u8>)>, most_bytes: u64) -> Vec<(String, Vec<u8>)> {
    inputs.sort_by(|(a, x), (b, y)| (x.len(), a).cmp(&(y.len(), b)));
    let mut left = most_bytes;
    inputs
        .into_iter()
        .take_while(|(_, input)| match left.checked_sub(input.len() as u64) {
            Some(rest) => {
                left = rest;
                true
            }
            None => false,
        })
        .collect()
}

/// A line of figures from what a fuzzer said.
fn told(said: &str) -> Result<String> {
    let mut parts = Vec::new();
    for (name, unit) in STATISTICS {
        let value = said.lines().rev().find_map(|line| line.strip_prefix(name));
        let value = value.with_context(|| format!("it does not say {name}"))?;
        parts.push(format!("{} {unit}", value.trim()));
    }
    let done = said.lines().rev().find(|line| line.contains(" cov: "));
    let words: Vec<&str> = done.unwrap_or_default().split_whitespace().collect();
    for name in ["cov:", "ft:"] {
        let at = words.iter().position(|word| *word == name);
        let value = at.and_then(|at| words.get(at + 1));
        parts.push(format!("{name} {}", value.context("it reached nothing")?));
    }
    Ok(parts.join(", "))
}

fn last_lines(text: &str, count: usize) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(count)..].join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_inputs_that_fit_are_kept() {
        let input = |name: &str, bytes: usize| (name.to_owned(), vec![0; bytes]);
        let inputs = vec![
            input("long", 60),
            input("b", 20),
            input("a", 20),
            input("mid", 50),
        ];
        let names = |most| -> Vec<String> {
            let kept = that_fit(inputs.clone(), most);
            kept.into_iter().map(|(name, _)| name).collect()
        };
        assert_eq!(names(100), ["a", "b", "mid"]);
        assert_eq!(names(89), ["a", "b"]);
        assert!(names(19).is_empty());
    }

    #[test]
    fn figures_are_found_in_what_a_fuzzer_says() {
        let said = "#4096\tpulse  cov: 7 ft: 9 corp: 2/3b lim: 4 exec/s: 12 rss: 40Mb\n\
                    #9120\tDONE   cov: 1170 ft: 4012 corp: 210/9Kb lim: 99 exec/s: 304 rss: 51Mb\n\
                    Done 9120 runs in 30 second(s)\nstat::number_of_executed_units: 9120\n\
                    stat::average_exec_per_sec:     304\nstat::new_units_added:          210\n\
                    stat::slowest_unit_time_sec:    0\nstat::peak_rss_mb:              51\n";
        assert_eq!(
            told(said).unwrap(),
            "9120 inputs, 210 new, 0 s the slowest, 51 MB, cov: 1170, ft: 4012"
        );
        assert!(told("Done 9120 runs").is_err());
        assert_eq!(last_lines("a\nb\nc", 2), "b\nc");
    }
}
