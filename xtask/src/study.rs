//! Studies: longer measurements, with their tables.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Subcommand;

use crate::{judge, nats, shell, vm};

#[derive(Debug, Subcommand)]
pub(crate) enum Study {
    /// Hold the CAD models of recorded scans against the samples.
    #[command(disable_help_flag = true)]
    RealScans {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Kill the service at random moments of scan and job, and see what it has kept.
    #[command(disable_help_flag = true)]
    Crashes {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Work on many jobs elsewhere while workers, NATS servers and links die.
    #[command(disable_help_flag = true)]
    Fleet {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Score the regridder on a plane pair with a step, among outliers.
    #[command(disable_help_flag = true)]
    Regrid {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Read damaged scan files of every format with every reader.
    #[command(disable_help_flag = true)]
    Mutations {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Measure how far the outlines of simulated scans lie from the true ones.
    #[command(disable_help_flag = true)]
    Outline {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Fill holes that were cut from known surfaces, and hold the fillings against these.
    #[command(disable_help_flag = true)]
    Fillings {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Scan under faults of every class, and under mixes of them, in simulated time.
    #[command(disable_help_flag = true)]
    Faults {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Measure how fast each way to the scanner is, who waits for whom, and what a slow disk does.
    #[command(disable_help_flag = true)]
    Throughput {
        /// Also in the virtual machine of `cargo xtask vm usb`, where there is USB
        #[arg(long)]
        usb: bool,
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Score the segmentation on scenes whose true faces are known.
    #[command(disable_help_flag = true)]
    Segmentation {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Hold the models of random parts, built by OpenCASCADE, against the parts.
    #[command(disable_help_flag = true)]
    Parts {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Hold recognised machining features against what parts, built by OpenCASCADE, really have.
    #[command(disable_help_flag = true)]
    Features {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Hold the shapes found on faces against what the faces are.
    #[command(disable_help_flag = true)]
    Shapes {
        /// Options of the study; `--help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Place the knots of B-spline surfaces in every way, and hold them against SciPy's.
    Surfaces {
        /// Small grids and one tolerance each, without the recorded scan and `bisplrep`
        #[arg(long)]
        short: bool,
        /// A recorded scan to be measured, too (PLY in metres)
        #[arg(long, value_name = "FILE")]
        scan: Option<PathBuf>,
        /// Write docs/studies/surfaces.md, too
        #[arg(long)]
        write: bool,
    },
}

pub(crate) fn run(study: &Study) -> Result<()> {
    match study {
        Study::Fleet { options } => {
            let server = nats::chosen()?;
            let programs = ["build", "--release", "--bin", "reliefd", "--bin", "relief"];
            shell::run("cargo", &programs)?;
            program_with("study-fleet", options, &[server])
        }
        Study::Crashes { options } => {
            service()?;
            program("study-crashes", options)
        }
        Study::Faults { options } => program("study-faults", options),
        Study::Features { options } => features(options),
        Study::Fillings { options } => program("study-fillings", options),
        Study::Mutations { options } => program("study-mutations", options),
        Study::Outline { options } => program("study-outline", options),
        Study::Parts { options } => {
            let place = shell::root().join("target/judges");
            let with_gmsh = options.iter().any(|word| word == "--gmsh");
            let python = judge::python(&place, judge::gmsh(with_gmsh))?;
            let mut words: Vec<OsString> = vec!["--python".into(), python.into()];
            words.extend(options.iter().cloned());
            program("study-parts", &words)
        }
        Study::RealScans { options } => program("study-real-scans", options),
        Study::Regrid { options } => program("study-regrid", options),
        Study::Segmentation { options } => program("study-segmentation", options),
        Study::Shapes { options } => program("study-shapes", options),
        Study::Surfaces { short, scan, write } => surfaces(*short, scan.as_deref(), *write),
        Study::Throughput { usb, options } => {
            let mut options = options.clone();
            if *usb {
                let table = shell::target().join("throughput-usb.md");
                fs::write(&table, vm::throughput()?)?;
                options.extend(["--usb-table".into(), table.into()]);
            }
            program("study-throughput", &options)
        }
    }
}

/// What is recognised on scans of known parts, by the command as it is delivered.
pub(crate) fn features(options: &[OsString]) -> Result<()> {
    let python = judge::python(&shell::root().join("target/judges"), &[])?;
    // The study looks for it beside itself.
    shell::run("cargo", &["build", "--release", "--bin", "relief"])?;
    let mut words: Vec<OsString> = vec!["judge".into(), "--python".into(), python.into()];
    words.extend(options.iter().cloned());
    program("study-features", &words)
}

/// Where the figures of B-spline surfaces are kept.
const SURFACES_PAGE: &str = "docs/studies/surfaces.md";

/// Our surfaces first, whose control points SciPy is then asked to match.
fn surfaces(short: bool, scan: Option<&Path>, write: bool) -> Result<()> {
    let place = shell::root().join("target");
    let data = place.join("studies/surfaces");
    if data.exists() {
        fs::remove_dir_all(&data)?;
    }
    let data = data.display().to_string();
    let mut words: Vec<OsString> = vec!["--data".into(), data.clone().into()];
    words.extend(short.then(|| "--short".into()));
    if let Some(scan) = scan {
        words.extend(["--scan".into(), scan.into()]);
    }
    words.extend(
        write
            .then(|| ["--write".into(), SURFACES_PAGE.into()])
            .into_iter()
            .flatten(),
    );
    program("study-surfaces", &words)?;
    let python = judge::python(&place.join("judges"), &[judge::SCIPY])?;
    let mut check = vec!["-B", "tests/judges/surfacing/check.py", &data];
    check.extend((!short).then_some("--bisplrep"));
    if write {
        check.extend(["--append", SURFACES_PAGE]);
    }
    shell::run(&python, &check)?;
    // Surfaces that are parted at lines across the grid, as files.
    shell::run("cargo", &["build", "--release", "--bin", "relief"])?;
    let relief = place.join("release/relief").display().to_string();
    let scans = place.join("studies/surfaces/lines").display().to_string();
    let seeds = if short { "1" } else { "3" };
    let lines = "tests/judges/surfacing/lines.py";
    let words = ["-B", lines, &relief, &scans, "--seeds", seeds];
    shell::run(&python, &words)
}

// Programs are named without their packages: so they are built with the features that all members of
// the workspace ask for together, as `cargo run --bin relief` is, and what it has built serves here.

/// Builds the service, which those programs look for beside themselves that run it.
pub(crate) fn service() -> Result<()> {
    shell::run("cargo", &["build", "--release", "--bin", "reliefd"])
}

/// Builds the product, and the studies and scenes of the first tier. Each other study is built when it is
/// asked for: linked and made fast, it would take as long there as several tests.
pub(crate) fn build() -> Result<()> {
    let programs = [
        "relief",
        "reliefd",
        "scan-scene",
        "study-crashes",
        "study-holes",
        "study-regrid",
        "study-reproduction",
        "study-sections",
        "study-segmentation",
        "study-surfaces",
    ];
    let named = programs.iter().flat_map(|name| ["--bin", name]);
    let words: Vec<&str> = ["build", "--release"].into_iter().chain(named).collect();
    shell::run("cargo", &words)
}

/// Runs a study, or another program of the workspace, built for speed.
pub(crate) fn program(name: &str, options: &[OsString]) -> Result<()> {
    program_with(name, options, &[])
}

fn program_with(name: &str, options: &[OsString], environment: &[(&str, String)]) -> Result<()> {
    let options: Vec<_> = options.iter().map(|o| o.to_string_lossy()).collect();
    let words = ["run", "--release", "--bin", name, "--"];
    let words: Vec<&str> = words
        .into_iter()
        .chain(options.iter().map(|o| &**o))
        .collect();
    shell::run_with("cargo", &words, environment)
}
