//! Lets a browser and other clients that are not ours judge the web page and the API.

use anyhow::{Context, Result};
use clap::Args;

use crate::{apt, judge, shell, study};

/// The judges' packages, pinned: another version may judge otherwise.
const PACKAGES: [&str; 3] = [
    "axe-playwright-python==0.1.8",
    "playwright==1.65.2",
    "schemathesis==4.32.5",
];

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// For how long schemathesis asks, in seconds.
    #[arg(long, default_value_t = 300)]
    pub(crate) seconds: u32,
    /// What schemathesis asks follows from it.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u32,
    /// Put the operator's guide's pictures of the page anew.
    #[arg(long)]
    pub(crate) pictures: bool,
}

/// Pictures of the page in the operator's guide.
const IN_THE_GUIDE: [&str; 3] = ["machine-scanning.png", "result.png", "preview.png"];

/// The page's own modules, the integrator's examples, the API by its description, and the whole
/// story of a scan in a browser.
pub(crate) fn run(options: &Options) -> Result<()> {
    apt::need(&[
        ("chromium", "chromium"),
        ("node", "nodejs"),
        ("promtool", "prometheus"),
    ])?;
    let place = shell::root().join("target/judges/web");
    let python = judge::environment(&place, &PACKAGES)?;
    study::build()?;
    let words = ["build", "--release", "--bin", "sim-scanner"];
    shell::run("cargo", &words)?;
    let programs = shell::target().join("release").display().to_string();
    let judge = |name: &str, words: &[&str]| {
        let script = format!("tests/judges/web/{name}.py");
        shell::run(&python, &[&[script.as_str(), &programs], words].concat())
    };
    shell::run("node", &["--test", "daemon/web/tests/"])?;
    judge("examples", &[])?;
    let (seconds, seed) = (options.seconds.to_string(), options.seed.to_string());
    judge("api", &["--seconds", &seconds, "--seed", &seed])?;
    judge("watchers", &["--rounds", "1"])?;
    let pictures = place.join("pictures");
    judge("story", &[&pictures.display().to_string()])?;
    if options.pictures {
        for name in IN_THE_GUIDE {
            let guide = shell::root().join("docs/pictures/page").join(name);
            std::fs::copy(pictures.join(name), &guide)
                .with_context(|| format!("cannot write {}", guide.display()))?;
        }
    }
    Ok(())
}
