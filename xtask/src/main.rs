//! The project's chores. `cargo xtask --help` lists them.

mod apt;
mod cross;
mod deb;
mod fillings;
mod fuzz;
mod instructions;
mod judge;
mod nats;
mod notify;
mod peers;
mod reproduce;
mod rules;
mod safety;
mod shell;
mod solids;
mod study;
mod targets;
mod toolpath;
mod units;
mod vm;
mod web;

use std::ffi::OsString;

use clap::{Parser, Subcommand};

/// Most seconds from the last column of a scan of 240 x 256 nodes to its result in the spool.
const SLOWEST_S: f64 = 2.0;

/// The project's chores: checks, studies and their tables.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Debug, Subcommand)]
enum Chore {
    /// Check who depends on whom, how long files are, that sources are ASCII, that no manifest
    /// switches tests off which are there, and that every hazard in `docs/safety.md` has its tests.
    Rules,
    /// Scan the simulated objects and let OpenCASCADE judge the IGES files.
    ///
    /// Needs Python 3; installs the judge's packages into `target/judges`.
    Judge(judge::Options),
    /// Hold a command against what other programs make of the same task.
    #[command(subcommand)]
    Peers(peers::Peers),
    /// Let opencamlib judge our cutters and finishing paths, and be raced; a removal simulation in
    /// Python the NC code, and LinuxCNC's interpreter.
    ///
    /// Needs Python 3; installs the judge's packages into `target/judges/toolpath`.
    JudgeToolpath(toolpath::Options),
    /// Let trimesh, libigl and CGAL judge `relief fill`, side by side with MeshLab and MeshFix; or, with
    /// `--range`, OpenCASCADE the holes that `relief convert --fill` closes and keeps.
    ///
    /// Needs Python 3; installs the judge's packages into `target/judges`.
    JudgeFill(fillings::Options),
    /// Let NumPy judge the textbook of MLMS that `bench` measures ours against.
    ///
    /// Needs Python 3; installs the judge's packages into `target/judges`.
    JudgeTextbook,
    /// Let OpenCASCADE judge solids of random parts, rebuilt from their features.
    ///
    /// Needs Python 3; installs the judge's packages into `target/judges`.
    JudgeSolids(solids::Options),
    /// Install the NATS server that tests of jobs on other machines run with, on Debian as root.
    Nats(nats::Options),
    /// Let a broker that is not ours, mosquitto, judge what the service publishes.
    ///
    /// Needs mosquitto and its clients, which it installs on Debian as root.
    JudgeNotify,
    /// Let a browser run the story of a scan on the web page, schemathesis ask the API for everything
    /// that its description allows, and the integrator's examples run.
    ///
    /// Needs Python 3, Chromium, Node.js and Prometheus' promtool, which it installs on Debian as
    /// root; installs the judges' packages into `target/judges/web`.
    JudgeWeb(web::Options),
    /// Repeat the experiments of Shim & Lee 1995 and write `docs/reproduction.md`.
    ///
    /// For the figures' pictures it needs Python 3, as `judge` does; `--check` and `--print`
    /// do without.
    Reproduce(reproduce::Options),
    /// Run the fuzzers of everything that comes from outside.
    ///
    /// Needs a C++ compiler, for libFuzzer.
    Fuzz(fuzz::Options),
    /// Measure one part of the product at length.
    #[command(subcommand)]
    Study(study::Study),
    /// Print how fast each stage is, beside peers measured in the same run.
    #[command(disable_help_flag = true)]
    Bench {
        /// Options of the bench; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Count the instructions that each stage takes for a node; fails if they have grown by more
    /// than a tenth.
    ///
    /// Needs valgrind; installs it on Debian as root.
    Instructions(instructions::Options),
    /// Check that the geometry, or with `--whole` the product, compiles for 64-bit Arm.
    ///
    /// Needs rustup; with `--whole` a C compiler for it, which it installs on Debian as root.
    Cross(cross::Options),
    /// Keep the service at work, and watch its memory, descriptors and threads.
    #[command(disable_help_flag = true)]
    Soak {
        /// Options of the soak, such as `--minutes 60`; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Have systemd check the units: nothing to find fault with, and little exposed.
    ///
    /// Needs `systemd-analyze`, which it installs on Debian as root.
    Units,
    /// Build the studies, judges and other programs of the first tier's checks, all at once, and install
    /// what the judges need.
    Programs,
    /// Make the Debian package of service, command line, units, manual pages and completions.
    ///
    /// Needs Debian's tools; installs `cargo-deb` below the target folder.
    Deb(deb::Options),
    /// Check in a virtual machine what needs a kernel of its own.
    #[command(subcommand)]
    Vm(vm::Vm),
    /// Everything: tests, lints, rules, studies, judges with all seeds, FreeCAD, the virtual
    /// machines, fuzzers for ten minutes each.
    Full,
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().chore {
        Chore::Rules => rules::check(),
        Chore::Judge(options) => judge::run(&options),
        Chore::Peers(peers) => peers::run(&peers),
        Chore::JudgeToolpath(options) => toolpath::run(&options),
        Chore::JudgeFill(options) => fillings::run(&options),
        Chore::JudgeSolids(options) => solids::run(&options),
        Chore::Nats(options) => nats::install(&options),
        Chore::JudgeNotify => notify::judge(),
        Chore::JudgeWeb(options) => web::run(&options),
        Chore::Reproduce(options) => reproduce::run(&options),
        Chore::Fuzz(options) => fuzz::run(&options),
        Chore::Study(study) => study::run(&study),
        Chore::Bench { options } => study::program("bench", &options),
        Chore::JudgeTextbook => instructions::judge_textbook(),
        Chore::Instructions(options) => instructions::run(&options),
        Chore::Cross(options) => cross::check(&options),
        Chore::Soak { options } => {
            study::service()?;
            study::program("soak", &options)
        }
        Chore::Units => units::check(),
        Chore::Programs => {
            study::build()?;
            instructions::build_beside_tests()?;
            judge::prepare()
        }
        Chore::Deb(options) => deb::run(&options),
        Chore::Vm(vm) => vm::run(&vm),
        Chore::Full => full(),
    }
}

/// Packages with random tests, as `cargo` takes them.
const RANDOM_TESTS: &[&str] = &[
    "-pcompare",
    "-pfill",
    "-pscanner-driver",
    "-pscan-record",
    "-pscanner-protocol",
    "-pterraces",
    "-ptoolpath",
];

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
    units::check()?;
    // More of what the first tier shows with few, with Debian's NATS server.
    nats::install(&nats::Options::default())?;
    let needs_nats = ("RELIEF_NEEDS_NATS", "1".to_owned());
    shell::run_with(
        "cargo",
        &["test", "--workspace"],
        &[("RELIEF_SEEDS", "10".to_owned()), needs_nats.clone()],
    )?;
    let recent = [needs_nats, nats::chosen()?];
    shell::run_with("cargo", &["test", "--package", "job-queue"], &recent)?;
    // The first tier's random tests have one seed; here each run has another, and prints it.
    let seed = std::time::UNIX_EPOCH.elapsed()?.as_secs().to_string();
    eprintln!("PROPTEST_RNG_SEED={seed}");
    shell::run_with(
        "cargo",
        &[&["test"], RANDOM_TESTS].concat(),
        &[("PROPTEST_RNG_SEED", seed)],
    )?;
    judge::run(&judge::Options {
        seeds: 10,
        freecad: true,
        gmsh: true,
        within_s: Some(SLOWEST_S),
        no_recorded: false,
        no_cadmpeg: false,
        features: false,
        out: None,
    })?;
    instructions::run(&instructions::Options::default())?;
    reproduce::run(&reproduce::Options::CHECK)?;
    cross::check(&cross::Options { whole: true })?;
    peers::run(&peers::Peers::Skin(peers::Options { short: false }))?;
    toolpath::run(&toolpath::Options {
        surfaces: 20,
        linuxcnc: true,
    })?;
    for range in [false, true] {
        fillings::run(&fillings::Options {
            short: false,
            write: false,
            range,
            seeds: None,
        })?;
    }
    solids::run(&solids::Options { parts: 500 })?;
    notify::judge()?;
    web::run(&web::Options {
        seconds: 300,
        seed: 1,
        pictures: false,
    })?;
    vm::run(&vm::Vm::Usb(vm::Options::default()))?;
    fuzz::run(&fuzz::Options {
        seconds: 600,
        jobs: 2,
        keep: false,
        targets: Vec::new(),
    })?;
    vm::run(&vm::Vm::Systemd(vm::SystemdOptions::default()))?;
    study::run(&study::Study::Mutations {
        options: Vec::new(),
    })?;
    study::run(&study::Study::Fleet {
        options: Vec::new(),
    })?;
    study::run(&study::Study::Crashes {
        options: Vec::new(),
    })?;
    study::run(&study::Study::Faults {
        options: Vec::new(),
    })?;
    study::program("soak", &["--minutes".into(), "60".into()])?;
    study::run(&study::Study::Parts {
        options: ["--gmsh", "--check"].map(Into::into).to_vec(),
    })?;
    study::run(&study::Study::Features {
        options: vec!["--check".into()],
    })?;
    study::run(&study::Study::Surfaces {
        short: false,
        scan: None,
        write: false,
    })?;
    study::run(&study::Study::Segmentation {
        options: ["--set", "judge", "--full", "--peers", "--check"]
            .map(Into::into)
            .to_vec(),
    })
}
