//! The project's chores. `cargo xtask --help` lists them.

mod judge;
mod reproduce;
mod rules;
mod shell;
mod study;
mod vm;

use clap::{Parser, Subcommand};

/// The project's chores: checks, studies and their tables.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Debug, Subcommand)]
enum Chore {
    /// Check who depends on whom, how long files are, and that sources are ASCII.
    Rules,
    /// Scan the simulated objects and let OpenCASCADE judge the IGES files.
    ///
    /// Needs Python 3; installs the judge's packages into `target/judges`.
    Judge(judge::Options),
    /// Repeat the experiments of Shim & Lee 1995 and write `docs/reproduction.md`.
    ///
    /// For the figures' pictures it needs Python 3, as `judge` does; `--check` and `--print`
    /// do without.
    Reproduce(reproduce::Options),
    /// Measure one part of the product at length.
    #[command(subcommand)]
    Study(study::Study),
    /// Check in a virtual machine what needs a kernel of its own.
    #[command(subcommand)]
    Vm(vm::Vm),
    /// Everything: tests, lints, rules, studies, judges with all seeds, FreeCAD, the virtual
    /// machine.
    Full,
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().chore {
        Chore::Rules => rules::check(),
        Chore::Judge(options) => judge::run(&options),
        Chore::Reproduce(options) => reproduce::run(&options),
        Chore::Study(study) => study::run(&study),
        Chore::Vm(vm) => vm::run(&vm),
        Chore::Full => full(),
    }
}

fn full() -> anyhow::Result<()> {
    shell::run("cargo", &["fmt", "--all", "--check"])?;
    shell::run(
        "cargo",
        &[
            "clippy",
            "--workspace",
            "--all-targets",
            "--",
            "--deny",
            "warnings",
        ],
    )?;
    rules::check()?;
    shell::run("cargo", &["test", "--workspace"])?;
    judge::run(&judge::Options {
        seeds: 10,
        freecad: true,
        out: None,
    })?;
    vm::run(&vm::Vm::Usb(vm::Options::default()))?;
    study::run(&study::Study::Mutations {
        options: Vec::new(),
    })?;
    study::run(&study::Study::Segmentation {
        options: ["--set", "judge", "--full", "--peers", "--check"]
            .map(Into::into)
            .to_vec(),
    })
}
