//! What is done with results, through the sandbox: a hook confines itself within it, and a copy
//! goes where the unit lets the service write.

use std::fs;

use anyhow::{Result, ensure};

use super::service::anew;
use crate::bench::{Bench, ready, relief};
use crate::system::try_run;

const CONFIGURATION: &str = "/etc/relief/reliefd.toml";
/// Below the service's own folder, where it makes it itself.
const ARCHIVE: &str = "/var/lib/relief/archive";

pub(super) fn confined(_: &mut Bench) -> Result<()> {
    let before = fs::read_to_string(CONFIGURATION)?;
    let sections = format!(
        "\n[[hooks]]\nname = \"check\"\n\
         command = [\"/bin/sh\", \"-c\", \"head -c 1 $RELIEF_MANIFEST; echo; id -un; mkdir -p here; \
         cat /etc/relief/reliefd.toml\"]\n\
         [[uploads]]\nname = \"archive\"\nto = \"folder\"\nfolder = \"{ARCHIVE}\"\n"
    );
    fs::write(CONFIGURATION, before.clone() + &sections)?;
    anew()?;
    // The last command fails, since a hook may not read the service's settings.
    let (well, said, error) = try_run("relief", &["hooks", "test", "check"])?;
    ensure!(!well, "{said}");
    ensure!(error.contains("exit code 1"), "{error}");
    // What it has printed, as one line: the manifest's first byte, and who it is.
    ensure!(error.contains("{ relief "), "{error}");
    ensure!(error.contains("ermission denied"), "{error}");

    let (well, said, error) = try_run("relief", &["uploads", "test", "archive"])?;
    ensure!(!well && error.contains("is it mounted?"), "{said}{error}");
    let made = try_run("install", &["-d", "-o", "relief", "-g", "relief", ARCHIVE])?;
    ensure!(made.0, "{made:?}");
    let copied = relief(&["uploads", "test", "archive"])?;
    ensure!(copied["state"] == "delivered", "{copied}");
    let copies = fs::read_dir(ARCHIVE)?.count();
    ensure!(copies == 1, "{copies} copies");

    fs::write(CONFIGURATION, before)?;
    fs::remove_dir_all(ARCHIVE)?;
    anew()?;
    ready().map(drop)
}
