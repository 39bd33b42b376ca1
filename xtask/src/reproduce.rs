//! The experiments of Shim & Lee 1995, of Koo & Lee, of Jo, Kwon & Han and of Yoo, and the pages about them.

use std::ffi::OsString;

use anyhow::Result;
use clap::Args;

use crate::{judge, shell, study};

const PROGRAM: &str = "study-reproduction";
const PAGE: &str = "docs/reproduction.md";
/// Koo & Lee, Jo, Kwon & Han, and Yoo: programs that draw their pictures themselves, and their pages.
const DRAWN: [[&str; 2]; 3] = [
    ["study-surfaces", "docs/reproduction-koo-lee.md"],
    ["study-sections", "docs/reproduction-jo-kwon-han.md"],
    ["study-holes", "docs/reproduction-yoo.md"],
];
/// Jun & Park: the scans of their part, judged by OpenCASCADE's side, fill the page.
const JUN_PARK: &str = "docs/reproduction-jun-park.md";
const PICTURES: &str = "docs/pictures/reproduction";

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Compare the figures with those of the page instead, and fail where they differ.
    #[arg(long, conflicts_with_all = ["print", "no_pictures"])]
    check: bool,
    /// With `--check`: of Shim & Lee only the first seed's scans, and the figures that are of it.
    #[arg(long, requires = "check")]
    short: bool,
    /// Print the part of the page whose heading has these words, and write nothing.
    #[arg(long, value_name = "WORDS", conflicts_with = "no_pictures")]
    print: Option<String>,
    /// Table 3 of Jun & Park alone: machining features on 50 scans of their part.
    ///
    /// Needs Python 3, as `judge` does.
    #[arg(long, conflicts_with_all = ["check", "print", "no_pictures"])]
    features: bool,
    /// Leave the pictures as they are.
    #[arg(long)]
    no_pictures: bool,
}

impl Options {
    /// Every page's figures compared.
    pub(crate) const CHECK: Self = Self {
        check: true,
        short: false,
        print: None,
        features: false,
        no_pictures: false,
    };
}

pub(crate) fn run(options: &Options) -> Result<()> {
    if options.features {
        let page = ["--only-published", "--table", JUN_PARK].map(Into::into);
        return study::features(&page);
    }
    let words = |words: &[&str]| -> Vec<OsString> { words.iter().map(Into::into).collect() };
    let drawn = |option: &str| {
        let mut all = DRAWN.into_iter();
        all.try_for_each(|[program, page]| study::program(program, &words(&[option, page])))
    };
    if options.check {
        drawn("--check-paper")?;
        let short = options.short.then_some("--short");
        let all: Vec<&str> = ["--check", PAGE].into_iter().chain(short).collect();
        return study::program(PROGRAM, &words(&all));
    }
    if let Some(part) = &options.print {
        return study::program(PROGRAM, &words(&["--print", part]));
    }
    drawn("--write-paper")?;
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
