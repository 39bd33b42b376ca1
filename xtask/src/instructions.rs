//! Instructions and blocks of memory that each stage takes, which no other program on the machine
//! changes.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::{apt, judge, shell};

#[derive(Debug, Default, Args)]
pub(crate) struct Options {
    /// Count in the build of the first tier's tests, with the checks that its environment switches on, not
    /// in one of its own as it is delivered.
    #[arg(long)]
    as_tested: bool,
    /// Write the counts down, for later ones to be held against.
    #[arg(long)]
    record: bool,
}

/// Counts on record, from the workspace's root.
const RECORD: &str = "benches/instructions.json";
/// Counts may grow to this many times those on record, and by this much where these are next to
/// nothing.
const MOST: f64 = 1.1;
const LEAST: f64 = 0.01;
/// Windows of each size that NumPy is asked for.
const WINDOWS: &str = "25";

/// What is counted, as the bench calls it, and how many times more it is done in the run that is held
/// against one in which it is done once: more often where it is little beside what comes before it, whose
/// count is not the same in each run.
const WORK: [(&str, u64); 8] = [
    ("mlms-32", 3),
    ("mlms-128", 3),
    ("regrid-mlms", 1),
    ("regrid-consensus", 1),
    ("segment", 3),
    ("reconstruct", 3),
    ("model", 1),
    ("iges", 3),
];

/// What is counted for each node of a work.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Counts {
    instructions: BTreeMap<String, f64>,
    /// Blocks of memory asked for.
    allocations: BTreeMap<String, f64>,
}

/// The counts on record of each build.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    as_delivered: Counts,
    as_tested: Counts,
}

/// What one run of the program comes to.
struct Run {
    instructions: u64,
    allocations: u64,
    nodes: u64,
}

/// Counts what a node takes, and fails if it has grown.
pub(crate) fn run(options: &Options) -> Result<()> {
    if !has_lanes_on_record() {
        ensure!(
            !options.record,
            "counts are kept of processors with AVX2, and this one has none"
        );
        println!("not counted: the counts on record are of a processor with AVX2");
        return Ok(());
    }
    apt::need(&[("valgrind", "valgrind")])?;
    let program = if options.as_tested {
        let is_on = |name: &&str| env::var(name).is_ok_and(|value| value == "true");
        ensure!(
            CHECKS.iter().all(is_on),
            "`--as-tested` counts in the build of the tests: set {} as `.ci/run` does",
            CHECKS.map(|name| format!("{name}=true")).join(" and ")
        );
        build_beside_tests()?
    } else {
        build()?
    };
    let mut counts = Counts::default();
    for (work, more) in WORK {
        let (once, often) = (count(&program, work, 1)?, count(&program, work, 1 + more)?);
        ensure!(once.nodes > 0, "{work} has no nodes");
        let each = |of: fn(&Run) -> u64| {
            of(&often).saturating_sub(of(&once)) as f64 / (more * once.nodes) as f64
        };
        let (instructions, allocations) =
            (each(|run| run.instructions), each(|run| run.allocations));
        let kept = |count: f64, digits: f64| (count * digits).round() / digits;
        counts
            .instructions
            .insert(work.to_owned(), kept(instructions, 1.0));
        counts
            .allocations
            .insert(work.to_owned(), kept(allocations, 1e3));
    }
    let place = shell::root().join(RECORD);
    let text = fs::read_to_string(&place).with_context(|| format!("cannot read {RECORD}"))?;
    let mut record: Record =
        serde_json::from_str(&text).with_context(|| format!("{RECORD} is no record"))?;
    let recorded = if options.as_tested {
        &mut record.as_tested
    } else {
        &mut record.as_delivered
    };
    if options.record {
        *recorded = counts;
        let text = format!("{}\n", serde_json::to_string_pretty(&record)?);
        return fs::write(&place, text).with_context(|| format!("cannot write {RECORD}"));
    }
    compare(&counts, recorded)
}

/// Lanes of other widths take other numbers of instructions.
fn has_lanes_on_record() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

/// Holds the textbook that the bench measures our kernel against to what NumPy answers.
pub(crate) fn judge_textbook() -> Result<()> {
    let program = build_beside_tests()?;
    let python = judge::python(&shell::root().join("target/judges"), &[])?;
    let answers = shell::output(&program, &["--answers", WINDOWS])?;
    let place = shell::target().join("answers.jsonl");
    fs::write(&place, answers)?;
    let told = place.display().to_string();
    let script = "tests/judges/regrid/least_median.py";
    shell::run(&python, &["-B", script, &told])
}

/// Where the bench is built as it is delivered, whatever checks the tests' build has switched on.
fn home() -> PathBuf {
    shell::target().join("instructions")
}

/// Checks that tests are built with and what is delivered is not.
const CHECKS: [&str; 2] = [
    "CARGO_PROFILE_RELEASE_DEBUG_ASSERTIONS",
    "CARGO_PROFILE_RELEASE_OVERFLOW_CHECKS",
];

/// Builds the bench of the libraries that tests are built of, and tells where it is.
pub(crate) fn build_beside_tests() -> Result<String> {
    shell::run("cargo", &["build", "--release", "--bin", "bench"])?;
    Ok(shell::target().join("release/bench").display().to_string())
}

/// Builds it as it is delivered, and tells where it is.
pub(crate) fn build() -> Result<String> {
    let off = || "false".to_owned();
    let words = ["build", "--release", "--package", "relief-benches"];
    shell::run_with(
        "cargo",
        &words,
        &[
            ("CARGO_TARGET_DIR", home().display().to_string()),
            (CHECKS[0], off()),
            (CHECKS[1], off()),
        ],
    )?;
    Ok(home().join("release/bench").display().to_string())
}

fn compare(counts: &Counts, recorded: &Counts) -> Result<()> {
    let mut grown = Vec::new();
    println!("| work | instructions a node | on record | allocations a node | on record |");
    println!("|---|---:|---:|---:|---:|");
    for (work, instructions) in &counts.instructions {
        let on_record = |kept: &BTreeMap<String, f64>| {
            let found = kept.get(work).copied();
            found.with_context(|| format!("{work} is not in {RECORD}; `--record` writes it"))
        };
        let allocations = counts.allocations.get(work).copied().unwrap_or_default();
        let before = [
            on_record(&recorded.instructions)?,
            on_record(&recorded.allocations)?,
        ];
        println!(
            "| {work} | {instructions} | {} | {allocations} | {} |",
            before[0], before[1]
        );
        let kinds = [
            ("instructions", *instructions),
            ("allocations", allocations),
        ];
        for ((kind, count), before) in kinds.into_iter().zip(before) {
            if count > (MOST * before).max(before + LEAST) {
                grown.push(format!("{work}: {count} {kind}, {before} on record"));
            }
        }
    }
    if grown.is_empty() {
        return Ok(());
    }
    bail!(
        "what a node takes has grown by more than {:.0} %; where that has to be, \
         `cargo xtask instructions --record` writes the new counts down, and again with `--as-tested`:\n  {}",
        100.0 * (MOST - 1.0),
        grown.join("\n  ")
    )
}

/// What the whole program takes that does its work so many times.
fn count(program: &str, work: &str, times: u64) -> Result<Run> {
    let counts = shell::target().join("counts.out");
    let told = format!("--cachegrind-out-file={}", counts.display());
    let times = times.to_string();
    let words = [
        "--quiet",
        "--tool=cachegrind",
        "--cache-sim=no",
        &told,
        program,
        "--work",
        work,
        "--times",
        &times,
    ];
    let said = shell::output("valgrind", &words)?;
    let told: Vec<u64> = said
        .split_whitespace()
        .map(|word| word.parse().with_context(|| format!("{work}: {said}")))
        .collect::<Result<_>>()?;
    let &[nodes, allocations] = told.as_slice() else {
        bail!("{work}: {said}");
    };
    let counts = fs::read_to_string(&counts)?;
    let summary = counts
        .lines()
        .find_map(|line| line.strip_prefix("summary:"))
        .context("valgrind told no summary")?;
    Ok(Run {
        instructions: summary.trim().parse()?,
        allocations,
        nodes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_by_more_than_a_tenth_is_told() {
        let counts = |instructions: f64, allocations: f64| {
            let of = |count: f64| BTreeMap::from([("regrid".to_owned(), count)]);
            Counts {
                instructions: of(instructions),
                allocations: of(allocations),
            }
        };
        assert!(compare(&counts(109.0, 0.009), &counts(100.0, 0.0)).is_ok());
        let error = compare(&counts(111.0, 0.0), &counts(100.0, 0.0)).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("regrid: 111 instructions, 100 on record")
        );
        let error = compare(&counts(1.0, 0.02), &counts(1.0, 0.0)).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("regrid: 0.02 allocations, 0 on record")
        );
        assert!(compare(&counts(1.0, 0.0), &Counts::default()).is_err());
    }
}
