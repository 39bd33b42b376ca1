//! The experiments of Shim & Lee 1995 and of Koo & Lee, and the pages about them.

use std::ffi::OsString;

use anyhow::Result;
use clap::Args;

use crate::{judge, shell, study};

const PROGRAM: &str = "study-reproduction";
const PAGE: &str = "docs/reproduction.md";
/// Koo & Lee, by a program of its own, which draws its pictures itself.
const SURFACES: [&str; 2] = ["relief-surfaces", "study-surfaces"];
const SURFACES_PAGE: &str = "docs/reproduction-koo-lee.md";
const PICTURES: &str = "docs/pictures/reproduction";

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Compare the figures with those of the page instead, and fail where they differ.
    #[arg(long, conflicts_with_all = ["print", "no_pictures"])]
    check: bool,
    /// Print the part of the page whose heading has these words, and write nothing.
    #[arg(long, value_name = "WORDS", conflicts_with = "no_pictures")]
    print: Option<String>,
    /// Leave the pictures as they are.
    #[arg(long)]
    no_pictures: bool,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let words = |words: &[&str]| -> Vec<OsString> { words.iter().map(Into::into).collect() };
    let surfaces = |option: &str| {
        let words = words(&[option, SURFACES_PAGE]);
        study::program_of(SURFACES[0], SURFACES[1], &words)
    };
    if options.check {
        surfaces("--check-paper")?;
        return study::program(PROGRAM, &words(&["--check", PAGE]));
    }
    if let Some(part) = &options.print {
        return study::program(PROGRAM, &words(&["--print", part]));
    }
    surfaces("--write-paper")?;
    if options.no_pictures {
        return study::program(PROGRAM, &words(&["--write", PAGE]));
    }
    let target = shell::root().join("target");
    let data = target.join("studies/reproduction").display().to_string();
    study::program(PROGRAM, &words(&["--write", PAGE, "--data", &data]))?;
    let python = judge::python(&target.join("judges"), &[])?;
    let draw = ["-B", "docs/pictures/reproduction.py", &data, PICTURES];
    shell::run(&python, &draw)
}
