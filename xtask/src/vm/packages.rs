//! What the machine is made of, from Debian's packages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::apt::{apt_get, is_installed, is_root};
use crate::shell;

/// The emulator, which must be installed: it loads dozens of libraries.
const EMULATOR: &str = "qemu-system-x86_64";
const EMULATOR_PACKAGE: &str = "qemu-system-x86";

/// The package whose dependency is the newest kernel.
const KERNEL: &str = "linux-image-amd64";

/// Packages that are unpacked beside the machine, and not installed.
const UNPACKED: [&str; 6] = [
    "busybox-static",
    "usbip",
    "udev",
    "libkmod2",
    "libssl3",
    "libudev1",
];

/// Holds the names of the packages, once all are unpacked.
const COMPLETE: &str = "complete";

/// The unpacked packages.
pub(super) struct Packages {
    root: PathBuf,
    kernel: PathBuf,
    modules: PathBuf,
}

impl Packages {
    /// Gets what is missing.
    pub(super) fn ready(home: &Path) -> Result<Self> {
        let root = home.join("packages");
        if !is_installed(EMULATOR) {
            install_emulator(home)?;
        }
        if let Ok(packages) = Self::found(&root) {
            return Ok(packages);
        }
        unpack(home, &root)?;
        Self::found(&root)
    }

    fn found(root: &Path) -> Result<Self> {
        let had = fs::read_to_string(root.join(COMPLETE)).unwrap_or_default();
        if had != UNPACKED.join("\n") {
            bail!("other packages are unpacked, or none");
        }
        let only = |folder: &str, prefix: &str| {
            let place = root.join(folder);
            let entries =
                fs::read_dir(&place).with_context(|| format!("no {}", place.display()))?;
            entries
                .flatten()
                .map(|entry| entry.path())
                .filter(|path| {
                    path.file_name()
                        .is_some_and(|name| name.to_string_lossy().starts_with(prefix))
                })
                .max()
                .with_context(|| format!("no {prefix} in {}", place.display()))
        };
        Ok(Self {
            kernel: only("boot", "vmlinuz-")?,
            modules: only("lib/modules", "")?.join("kernel"),
            root: root.to_owned(),
        })
    }

    pub(super) fn kernel(&self) -> &Path {
        &self.kernel
    }

    pub(super) fn modules(&self) -> &Path {
        &self.modules
    }

    /// A file of the unpacked packages.
    pub(super) fn file(&self, place: &str) -> Result<PathBuf> {
        // Debian moves what was outside of `usr` into it, package by package.
        [self.root.join(place), self.root.join("usr").join(place)]
            .into_iter()
            .find(|path| path.exists())
            .with_context(|| {
                let root = self.root.display();
                format!("there is no {place} in {root}: remove that folder to unpack anew")
            })
    }

    /// Where the loader finds libraries of the unpacked packages.
    pub(super) fn libraries(&self) -> PathBuf {
        self.root.join("usr/lib/x86_64-linux-gnu")
    }
}

/// Installs the emulator, where that is possible.
fn install_emulator(home: &Path) -> Result<()> {
    let told = format!("{EMULATOR} is missing: `sudo apt-get install {EMULATOR_PACKAGE}`");
    if !is_root()? {
        bail!(told);
    }
    let install = ["install", "--yes", "--no-install-recommends"];
    apt_get(&["update"]).context(told.clone())?;
    let mut words = install.to_vec();
    words.push(EMULATOR_PACKAGE);
    if apt_get(&words).is_ok() {
        return Ok(());
    }
    // Where another part of the emulator comes from the backports, so must this one. Their
    // list is kept apart, so that nothing else is ever taken from it.
    let lists = home.join("apt");
    fs::create_dir_all(lists.join("lists/partial"))?;
    let source = lists.join("backports.list");
    let release = release()?;
    fs::write(&source, with_backports(&release)?)?;
    let options = [
        format!("Dir::Etc::SourceList={}", source.display()),
        "Dir::Etc::SourceParts=/dev/null".to_owned(),
        format!("Dir::State::Lists={}", lists.join("lists").display()),
        format!("APT::Default-Release={release}-backports"),
    ];
    let with = |words: &[&str]| {
        let mut all: Vec<&str> = options.iter().flat_map(|o| ["-o", o]).collect();
        all.extend(words);
        apt_get(&all)
    };
    with(&["update"]).context(told.clone())?;
    with(&words).context(told)
}

/// The name of this Debian's release, such as `bookworm`.
pub(super) fn release() -> Result<String> {
    let release = fs::read_to_string("/etc/os-release").context("which system is this?")?;
    release
        .lines()
        .find_map(|line| line.strip_prefix("VERSION_CODENAME="))
        .map(str::to_owned)
        .context("this is no Debian: install the emulator by hand")
}

/// A list of packages with the backports, from where this machine has its own, and signed as
/// those are.
fn with_backports(release: &str) -> Result<String> {
    const FORMAT: &str = "$(CODENAME) $(REPO_URI)";
    let sources = shell::output(
        "apt-get",
        &["indextargets", "--format", FORMAT, "Created-By: Packages"],
    )?;
    let place = sources
        .lines()
        .filter_map(|line| line.split_once(' '))
        .find(|(name, _)| *name == release)
        .map(|(_, place)| place)
        .with_context(|| format!("this machine has no source of packages for {release}"))?;
    Ok(["", "-updates", "-backports"]
        .map(|suite| {
            format!(
                "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] \
                 {place} {release}{suite} main\n"
            )
        })
        .concat())
}

fn unpack(home: &Path, root: &Path) -> Result<()> {
    let downloads = home.join("downloads");
    for folder in [&downloads, root] {
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    if download(&downloads).is_err() {
        // The list of packages is missing, as in a fresh container, or older than they are.
        apt_get(&["update"])?;
        download(&downloads)?;
    }
    for file in fs::read_dir(&downloads)? {
        let file = file?.path().display().to_string();
        shell::run("dpkg", &["-x", &file, &root.display().to_string()])?;
    }
    fs::remove_dir_all(&downloads)?;
    fs::write(root.join(COMPLETE), UNPACKED.join("\n"))?;
    Ok(())
}

fn download(to: &Path) -> Result<()> {
    let kernel = newest_kernel()?;
    let packages = UNPACKED.into_iter().chain([kernel.as_str()]);
    let words: Vec<&str> = ["download", "--quiet"]
        .into_iter()
        .chain(packages)
        .collect();
    eprintln!("$ apt-get {}", words.join(" "));
    let status = Command::new("apt-get")
        .args(&words)
        .current_dir(to)
        .status()
        .context("cannot start apt-get: this needs Debian, or a relative")?;
    if !status.success() {
        bail!("the packages cannot be downloaded: is there a network?");
    }
    Ok(())
}

fn newest_kernel() -> Result<String> {
    shell::output("apt-cache", &["depends", KERNEL])?
        .split_whitespace()
        .find(|word| word.starts_with("linux-image-") && *word != KERNEL)
        .map(str::to_owned)
        .with_context(|| format!("Debian's {KERNEL} is not in the list of packages"))
}
