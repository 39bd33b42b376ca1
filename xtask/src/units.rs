//! The systemd units, judged by systemd itself.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::{apt, shell};

const UNITS: [&str; 3] = ["reliefd.service", "reliefd.socket", "relief-worker.service"];

/// Drop-ins that users may install, and the units that they are for.
const DROP_INS: [(&str, &str); 3] = [
    ("discovery.conf", "reliefd.service"),
    ("loopback.conf", "reliefd.socket"),
    ("network.conf", "reliefd.service"),
];

/// Most exposed that the service may be as it comes, from 0 (safest) to 10.
const MOST_EXPOSED: f64 = 1.2;

/// The same of a worker, which speaks with a server somewhere on the network.
const MOST_EXPOSED_WORKER: f64 = 1.6;

/// Where the package puts the program; while it is not there, another stands in for it.
const PROGRAM: &str = "/usr/bin/reliefd";

/// Checks the units with `systemd-analyze`.
pub(crate) fn check() -> Result<()> {
    apt::need(&[("systemd-analyze", "systemd")])?;
    let home = shell::target().join("units");
    if home.exists() {
        fs::remove_dir_all(&home)?;
    }
    let variants = std::iter::once(None).chain(DROP_INS.map(Some));
    for variant in variants {
        let name = variant.map_or("as it comes", |(file, _)| file);
        let folder = stage(&home, variant)?;
        let said = verify(&folder)?;
        ensure!(
            said.is_empty(),
            "systemd-analyze finds fault ({name}):\n{said}"
        );
        let exposure = exposure(&folder, "reliefd.service")?;
        println!("reliefd.service, {name}: nothing to find fault with, exposure {exposure}");
        if variant.is_none() && exposure > MOST_EXPOSED {
            bail!("the service is more exposed than {MOST_EXPOSED}");
        }
    }
    let worker = exposure(&home.join("plain"), "relief-worker.service")?;
    println!("relief-worker.service: nothing to find fault with, exposure {worker}");
    ensure!(
        worker <= MOST_EXPOSED_WORKER,
        "a worker is more exposed than {MOST_EXPOSED_WORKER}"
    );
    notices_mistakes(&home)
}

/// The units with one drop-in, in a folder of their own.
fn stage(home: &Path, drop_in: Option<(&str, &str)>) -> Result<PathBuf> {
    let folder = home.join(drop_in.map_or("plain", |(file, _)| file));
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let program = home.join("reliefd");
    fs::write(&program, "")?;
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755))?;
    let ours = shell::root().join("systemd");
    for unit in UNITS {
        let text = fs::read_to_string(ours.join(unit))?;
        let text = text.replace(PROGRAM, &program.display().to_string());
        let text = text.replace("/usr/bin/relief ", &format!("{} ", program.display()));
        fs::write(folder.join(unit), text)?;
    }
    if let Some((file, unit)) = drop_in {
        let place = folder.join(format!("{unit}.d"));
        fs::create_dir_all(&place)?;
        fs::copy(ours.join(file), place.join(file))?;
    }
    Ok(folder)
}

/// What systemd has to say about the units. It ends well whatever it finds, so that only
/// silence is good.
fn verify(folder: &Path) -> Result<String> {
    let output = Command::new("systemd-analyze")
        // The pages that the units name are installed with them.
        .args(["verify", "--man=no"])
        .args(UNITS.map(|unit| folder.join(unit)))
        .output()?;
    let said = [output.stdout, output.stderr].concat();
    let mut said = String::from_utf8_lossy(&said).trim().to_owned();
    if said.is_empty() && !output.status.success() {
        said = output.status.to_string();
    }
    Ok(said)
}

fn exposure(folder: &Path, unit: &str) -> Result<f64> {
    let unit = folder.join(unit).display().to_string();
    let words = ["security", "--offline=true", "--no-pager", &unit];
    let table = shell::output("systemd-analyze", &words)?;
    table
        .lines()
        .find_map(|line| line.split_once("Overall exposure level for "))
        .and_then(|(_, rest)| rest.split_whitespace().nth(1)?.parse().ok())
        .with_context(|| format!("no exposure in {table}"))
}

/// A check that overlooks everything would pass.
fn notices_mistakes(home: &Path) -> Result<()> {
    let folder = stage(home, None)?;
    let unit = folder.join("reliefd.service");
    let text = fs::read_to_string(&unit)?;
    for (right, wrong) in [
        ("WatchdogSec=30s", "WatchdogSec=soon"),
        ("ProtectHome=yes", "ProtectHoem=yes"),
        (
            "SystemCallFilter=setpriority",
            "SystemCallFilter=setpriorities",
        ),
    ] {
        ensure!(text.contains(right), "the service has no {right}");
        fs::write(&unit, text.replace(right, wrong))?;
        ensure!(!verify(&folder)?.is_empty(), "{wrong} is not noticed");
    }
    Ok(())
}
