//! Lets trimesh, libigl, CGAL and OpenCASCADE judge `relief fill`, side by side with MeshLab and MeshFix.

use anyhow::Result;
use clap::Args;

use crate::{judge, shell};

/// The judge's packages and its peers, pinned: other releases may judge or fill otherwise.
const PACKAGES: [&str; 7] = [
    "pymeshlab==2025.7.post1",
    "pymeshfix==0.18.1",
    "libigl==2.6.3",
    "trimesh==5.2.0",
    judge::OCP,
    "numpy==2.4.6",
    judge::SCIPY,
];
/// Where the tables go.
const PAGE: &str = "docs/studies/fill-judged.md";

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Fewer holes, smaller meshes.
    #[arg(long)]
    pub(crate) short: bool,
    /// Put the tables into `docs/studies/fill-judged.md`.
    #[arg(long, conflicts_with = "short")]
    pub(crate) write: bool,
}

/// Fills holes whose surfaces are known, and what else there is of holes, and has it judged.
pub(crate) fn run(options: &Options) -> Result<()> {
    let place = shell::root().join("target/judges/fill");
    let python = judge::environment(&place, &PACKAGES)?;
    shell::run("cargo", &["build", "--release", "--bin", "relief"])?;
    let program = shell::target().join("release/relief").display().to_string();
    let out = place.join("meshes").display().to_string();
    let data = shell::root().join("../shared/data").display().to_string();
    let check = "tests/judges/fill/judge.py";
    let mut words = vec!["-B", check, &program, "--out", &out, "--data", &data];
    words.extend(options.short.then_some("--short"));
    words.extend(if options.write {
        &["--write", PAGE][..]
    } else {
        &[]
    });
    shell::run(&python, &words)
}
