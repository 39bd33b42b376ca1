//! Running other programs, loudly.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use anyhow::{Context, Result, bail};

/// The workspace's root folder.
pub(crate) fn root() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.parent().unwrap_or(own).to_owned()
}

/// The target folder that cargo uses.
pub(crate) fn target() -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    root().join(chosen.map_or_else(|| "target".into(), PathBuf::from))
}

/// What `cargo run` tells the program that it runs of its package, by the beginning of the name.
const TOLD_BY_CARGO: [&str; 4] = [
    "CARGO_PKG_",
    "CARGO_MANIFEST_",
    "CARGO_BIN_",
    "CARGO_CRATE_",
];

/// A program that finds the environment of this one as it was before `cargo run`: build scripts of
/// libraries ask for those variables, and would build anew whatever was built without.
fn command(program: &str) -> Command {
    let mut command = Command::new(program);
    for (name, _) in std::env::vars_os() {
        let is_told = |prefix: &str| name.to_string_lossy().starts_with(prefix);
        if TOLD_BY_CARGO.iter().any(|prefix| is_told(prefix)) {
            command.env_remove(&name);
        }
    }
    command
}

/// Runs a program in the workspace's root; its output goes where ours does.
pub(crate) fn run(program: &str, arguments: &[&str]) -> Result<()> {
    run_with(program, arguments, &[])
}

/// The same with variables added to the environment.
pub(crate) fn run_with(
    program: &str,
    arguments: &[&str],
    environment: &[(&str, String)],
) -> Result<()> {
    eprintln!("$ {program} {}", arguments.join(" "));
    let status = command(program)
        .args(arguments)
        .envs(environment.iter().map(|(name, value)| (name, value)))
        .current_dir(root())
        .status()
        .with_context(|| format!("cannot start {program}"))?;
    if !status.success() {
        bail!("{program} {} ended with {status}", arguments.join(" "));
    }
    Ok(())
}

/// The same for a program whose output is of interest only when it fails.
pub(crate) fn quiet(program: &str, arguments: &[&str]) -> Result<()> {
    captured(program, arguments, |output| &output.stdout)?;
    Ok(())
}

/// Runs a program in the workspace's root and returns what it prints.
pub(crate) fn output(program: &str, arguments: &[&str]) -> Result<String> {
    let output = captured(program, arguments, |output| &output.stderr)?;
    Ok(String::from_utf8(output.stdout)?)
}

/// Runs a program in the workspace's root; `told` is the part of its output that tells why
/// it failed.
fn captured(program: &str, arguments: &[&str], told: fn(&Output) -> &[u8]) -> Result<Output> {
    let output = command(program)
        .args(arguments)
        .current_dir(root())
        .output()
        .with_context(|| format!("cannot start {program}"))?;
    if !output.status.success() {
        let cause = String::from_utf8_lossy(told(&output));
        bail!(
            "{program} {} ended with {}: {cause}",
            arguments.join(" "),
            output.status
        );
    }
    Ok(output)
}
