//! Programs that a chore needs, from Debian's packages.

use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::shell;

/// Whether a program can be started.
pub(crate) fn is_installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// Asks nothing, as there may be nobody to answer.
pub(crate) fn apt_get(words: &[&str]) -> Result<()> {
    let silent = [("DEBIAN_FRONTEND", "noninteractive".to_owned())];
    shell::run_with("apt-get", words, &silent)
}

/// Whether packages may be installed.
pub(crate) fn is_root() -> Result<bool> {
    Ok(shell::output("id", &["-u"])?.trim() == "0")
}

/// Installs the packages of those programs that are missing; says how, where it may not.
pub(crate) fn need(programs: &[(&str, &str)]) -> Result<()> {
    let mut packages: Vec<&str> = programs
        .iter()
        .filter(|(program, _)| !is_installed(program))
        .map(|(_, package)| *package)
        .collect();
    packages.dedup();
    if packages.is_empty() {
        return Ok(());
    }
    let told = format!("missing: `sudo apt-get install {}`", packages.join(" "));
    if !is_root()? {
        bail!(told);
    }
    let mut words = vec!["install", "--yes", "--no-install-recommends"];
    words.extend(packages);
    apt_get(&["update"]).context(told.clone())?;
    apt_get(&words).context(told)
}
