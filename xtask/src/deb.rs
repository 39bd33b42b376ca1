//! The Debian package.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::{apt, shell};

/// The tool that makes it; installed below cargo's target folder where it is missing.
const TOOL: &str = "cargo-deb";
const TOOL_VERSION: &str = "3.8.0";

/// Who answers for a package that nobody is known to have made; as in the package's own
/// description.
const NOBODY: &str = "The Relief developers <relief@localhost>";

#[derive(Debug, Default, clap::Args)]
pub(crate) struct Options {
    /// Debian's version of the package, in place of the product's
    #[arg(long, value_name = "VERSION")]
    deb_version: Option<String>,
}

/// Builds programs, manual pages and package, and says where the package is.
pub(crate) fn run(options: &Options) -> Result<()> {
    build_programs()?;
    let package = pack(options.deb_version.as_deref())?;
    println!("{}", package.display());
    Ok(())
}

/// Builds what the package holds.
pub(crate) fn build_programs() -> Result<()> {
    let words = ["build", "--release", "-p", "relief", "-p", "reliefd"];
    shell::run("cargo", &words)?;
    let release = shell::target().join("release");
    let manual = release.join("manual");
    if manual.exists() {
        fs::remove_dir_all(&manual)?;
    }
    let relief = release.join("relief").display().to_string();
    shell::quiet(&relief, &["manual", &manual.display().to_string()])?;
    changelogs(&manual)?;
    // As Debian wants them: compressed, and without a time of day.
    for folder in [manual.clone(), manual.join("man")] {
        for entry in fs::read_dir(&folder)?.flatten() {
            if entry.file_type()?.is_file() {
                shell::quiet("gzip", &["-9n", &entry.path().display().to_string()])?;
            }
        }
    }
    Ok(())
}

/// Who makes the package, and answers for it: as Debian's tools find it out, else as git knows it.
fn maintainer() -> String {
    let from_environment = |name: &str| std::env::var(name).ok().filter(|text| !text.is_empty());
    let from_git = |key: &str| {
        let said = shell::output("git", &["config", "--get", key]).ok()?;
        Some(said.trim().to_owned()).filter(|text| !text.is_empty())
    };
    let address = from_environment("DEBEMAIL")
        .or_else(|| from_environment("EMAIL"))
        .or_else(|| from_git("user.email"));
    let Some(address) = address else {
        eprintln!("deb: nobody answers for this package: set DEBFULLNAME and DEBEMAIL");
        return NOBODY.to_owned();
    };
    let name = from_environment("DEBFULLNAME")
        .or_else(|| from_git("user.name"))
        .unwrap_or_else(|| "The Relief developers".to_owned());
    format!("{name} <{address}>")
}

/// The product's changelog, and one of the package in Debian's form.
fn changelogs(folder: &Path) -> Result<()> {
    fs::copy(shell::root().join("CHANGELOG.md"), folder.join("changelog"))?;
    let date = shell::output("git", &["log", "-1", "--format=%aD"])?;
    let text = format!(
        "relief ({}-1) unstable; urgency=medium\n\n  * As upstream; see changelog.gz.\n\n -- {}  {}\n",
        env!("CARGO_PKG_VERSION"),
        maintainer(),
        date.trim()
    );
    fs::write(folder.join("changelog.Debian"), text)?;
    Ok(())
}

/// Packs what is built, in this version or the product's; gives the package's place.
pub(crate) fn pack(version: Option<&str>) -> Result<PathBuf> {
    // Which libraries the programs need is found out by Debian's own tools.
    apt::need(&[("dpkg-shlibdeps", "dpkg-dev"), ("strip", "binutils")])?;
    let tool = tool()?.display().to_string();
    let folder = shell::target()
        .join("debian")
        .join(version.unwrap_or("own"));
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let out = format!("{}/", folder.display());
    let mut words = vec!["--package", "relief", "--no-build", "--strip"];
    words.extend(["--output", &out]);
    let maintainer = maintainer();
    words.extend(["--maintainer", &maintainer]);
    words.extend(
        version
            .iter()
            .flat_map(|version| ["--deb-version", version]),
    );
    shell::run(&tool, &words)?;
    fs::read_dir(&folder)?
        .flatten()
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|ending| ending == "deb"))
        .with_context(|| format!("no package in {}", folder.display()))
}

fn tool() -> Result<PathBuf> {
    if apt::is_installed(TOOL) {
        return Ok(TOOL.into());
    }
    let home = shell::target().join("tools");
    let tool = home.join("bin").join(TOOL);
    if !Path::new(&tool).exists() {
        let root = home.display().to_string();
        let words = ["install", TOOL, "--version", TOOL_VERSION, "--locked"];
        shell::run("cargo", &[&words[..], &["--root", &root]].concat())?;
    }
    Ok(tool)
}
