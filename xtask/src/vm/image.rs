//! A disk with a minimal Debian of this machine's release, systemd included.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::packages::release;
use crate::{apt, shell};

/// What is installed besides Debian's least.
const INCLUDED: &str = "systemd,systemd-sysv,udev,kmod,nats-server";

/// Sparse: only what is written takes room.
const SIZE: &str = "700M";

/// The disk; made where it is missing, or of another release.
pub(super) fn ready(home: &Path) -> Result<PathBuf> {
    let release = release()?;
    let image = home.join(format!("{release}-{}.img", INCLUDED.replace(',', "-")));
    if image.exists() {
        return Ok(image);
    }
    if !apt::is_root()? {
        bail!("the disk of the virtual machine can only be made by root");
    }
    apt::need(&[("mmdebstrap", "mmdebstrap"), ("mke2fs", "e2fsprogs")])?;
    let root = home.join("root");
    remove(&root)?;
    let root_text = root.display().to_string();
    shell::quiet(
        "mmdebstrap",
        &[
            "--variant=minbase",
            &format!("--include={INCLUDED}"),
            &release,
            &root_text,
        ],
    )
    .context("cannot make a small Debian: is there a network?")?;
    // Named last, so that an image that is there is whole.
    let unfinished = home.join("unfinished.img");
    remove(&unfinished)?;
    let unfinished_text = unfinished.display().to_string();
    shell::quiet("truncate", &["--size", SIZE, &unfinished_text])?;
    // The disk is never written for good, so that a journal would only cost time.
    let words = ["-q", "-F", "-t", "ext4", "-O", "^has_journal", "-d"];
    shell::quiet(
        "mke2fs",
        &[&words[..], &[&root_text, &unfinished_text]].concat(),
    )?;
    fs::rename(&unfinished, &image)?;
    remove(&root)?;
    Ok(image)
}

fn remove(path: &Path) -> Result<()> {
    let removed = if path.is_dir() {
        fs::remove_dir_all(path)
    } else if path.exists() {
        fs::remove_file(path)
    } else {
        Ok(())
    };
    removed.with_context(|| format!("cannot remove {}", path.display()))
}
