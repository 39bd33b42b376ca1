//! The package: installed, upgraded, removed, purged.

use std::fs;

use anyhow::{Result, ensure};

use crate::bench::{Bench, is_over, relief, scan};
use crate::system::{
    SERVICE, SOCKET, exists, id_of, is_active, number, owner, property, run, systemctl, try_run,
    wait,
};

const PACKAGE: &str = "/packages/relief.deb";
const LATER: &str = "/packages/later.deb";
const CONFIGURATION: &str = "/etc/relief/reliefd.toml";

pub(super) fn install(_: &mut Bench) -> Result<()> {
    run("dpkg", &["--install", PACKAGE])?;
    for unit in [SERVICE, SOCKET] {
        ensure!(is_active(unit)?, "{unit} is not active");
        ensure!(systemctl(&["is-enabled", unit])? == "enabled");
    }
    let (user, group) = (
        id_of("/etc/passwd", "relief")?,
        id_of("/etc/group", "relief")?,
    );
    for (path, mode, by) in [
        ("/run/relief/reliefd.sock", 0o660, user),
        ("/var/lib/relief", 0o750, user),
        ("/var/spool/relief", 0o750, user),
    ] {
        let found = owner(path)?;
        ensure!(
            found == (mode, by, group),
            "{path}: {found:?}, not {:?}",
            (mode, by, group)
        );
    }
    let groups = run("id", &["--groups", "--name", "relief"])?;
    ensure!(
        groups.split(' ').any(|group| group == "dialout"),
        "{groups}"
    );
    for path in [
        "/usr/share/man/man1/relief.1.gz",
        "/usr/share/man/man8/reliefd.8.gz",
        "/usr/share/man/man5/reliefd.toml.5.gz",
        "/usr/share/doc/relief/changelog.Debian.gz",
        "/usr/share/doc/relief/safety.md",
        "/usr/share/doc/relief/schema/commands.schema.json",
        "/usr/share/bash-completion/completions/relief",
        "/usr/share/zsh/vendor-completions/_relief",
        "/usr/share/fish/vendor_completions.d/relief.fish",
        "/usr/lib/udev/rules.d/60-relief-scanner.rules",
        "/usr/lib/udev/rules.d/90-relief-scanner.rules",
    ] {
        ensure!(exists(path), "there is no {path}");
    }
    // Every file as packed; what the units say, by this systemd.
    let differing = run("dpkg", &["--verify", "relief"])?;
    ensure!(differing.is_empty(), "{differing}");
    let (_, out, err) = try_run("systemd-analyze", &["verify", "--man=no", SERVICE, SOCKET])?;
    ensure!(out.is_empty() && err.is_empty(), "{out}{err}");
    // It tells systemd how it does.
    wait("a status text", || Ok(!property("StatusText")?.is_empty())).map(drop)
}

pub(super) fn upgrade(bench: &mut Bench) -> Result<()> {
    let before = fs::read_to_string(CONFIGURATION)?;
    let id = bench.amid_a_scan("upgraded")?;
    let pid = number("MainPID")?;
    run("dpkg", &["--install", LATER])?;
    let version = run(
        "dpkg-query",
        &["--show", "--showformat", "${Version}", "relief"],
    )?;
    ensure!(version.contains("+upgrade"), "{version}");
    ensure!(is_active(SERVICE)? && is_active(SOCKET)?, "it does not run");
    ensure!(number("MainPID")? != pid, "the old program still runs");
    ensure!(
        fs::read_to_string(CONFIGURATION)? == before,
        "configuration lost"
    );
    bench.first_is_kept()?;
    wait("the scan that was under way comes to an end", || {
        Ok(is_over(&scan(&id)?))
    })?;
    bench.laser_goes_off()?;
    ensure!(scan(&id)?["columns"].as_u64() > Some(0));
    Ok(())
}

pub(super) fn reinstall(bench: &mut Bench) -> Result<()> {
    run("dpkg", &["--remove", "relief"])?;
    for unit in [SERVICE, SOCKET] {
        ensure!(!is_active(unit)?, "{unit} is still there");
    }
    for path in ["/usr/bin/reliefd", "/run/relief/reliefd.sock"] {
        ensure!(!exists(path), "{path} is still there");
    }
    for path in [CONFIGURATION, "/var/lib/relief/reliefd.redb"] {
        ensure!(exists(path), "{path} is gone");
    }
    run("dpkg", &["--install", LATER])?;
    bench.first_is_kept()
}

pub(super) fn purge(bench: &mut Bench) -> Result<()> {
    let listed = relief(&["scans"])?;
    ensure!(
        listed["scans"]
            .as_array()
            .is_some_and(|scans| !scans.is_empty())
    );
    run("dpkg", &["--purge", "relief"])?;
    for unit in [SERVICE, SOCKET] {
        ensure!(!is_active(unit)?, "{unit} is still there");
        ensure!(
            property("LoadState")? == "not-found",
            "{unit} is still known"
        );
    }
    for path in [
        "/etc/relief",
        "/var/lib/relief",
        "/var/spool/relief",
        "/run/relief",
        "/usr/bin/relief",
        "/usr/bin/reliefd",
        "/usr/share/doc/relief",
        "/etc/systemd/system/multi-user.target.wants/reliefd.service",
        "/etc/systemd/system/sockets.target.wants/reliefd.socket",
    ] {
        ensure!(!exists(path), "{path} is still there");
    }
    // The user stays, so that nobody else gets its number, and nobody can be it.
    id_of("/etc/passwd", "relief")?;
    let account = run("getent", &["passwd", "relief"])?;
    ensure!(account.trim_end().ends_with("/nologin"), "{account}");
    let shadow = fs::read_to_string("/etc/shadow")?;
    let password = shadow
        .lines()
        .find_map(|line| line.strip_prefix("relief:"))
        .unwrap_or_default();
    ensure!(password.starts_with(['!', '*']), "it has a password");
    let (known, _, _) = try_run("dpkg-query", &["--status", "relief"])?;
    ensure!(!known, "dpkg still knows it");
    bench.first = None;
    Ok(())
}
