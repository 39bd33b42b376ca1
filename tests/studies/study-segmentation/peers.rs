//! Other programs on the same range images: Open3D and CGAL. `tests/peers` holds them.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use range_image::RangeImage;
use relief_tests::scenes::Set;

use crate::material::{Subject, root, target};
use crate::methods::{Labelled, Method};

/// The version asked of PyPI: another may find other patches.
const OPEN3D: &str = "open3d==0.19.0";

/// A peer that can be run.
#[derive(Debug)]
pub(crate) struct Peer {
    pub(crate) method: Method,
    pub(crate) version: String,
    program: Vec<OsString>,
}

/// Makes the peers ready; says of each that cannot be why.
pub(crate) fn ready() -> (Vec<Peer>, Vec<String>) {
    let mut peers = Vec::new();
    let mut missing = Vec::new();
    for (name, made) in [("Open3D", open3d()), ("CGAL", cgal())] {
        match made {
            Ok(peer) => peers.push(peer),
            Err(error) => missing.push(format!("{name} is left out: {error:#}")),
        }
    }
    (peers, missing)
}

fn open3d() -> Result<Peer> {
    let home = target().join("studies/python");
    let python = home.join("bin/python");
    let ask = || said(&python, &["-c", "import open3d; print(open3d.__version__)"]);
    if ask().is_err() {
        said(
            Path::new("python3"),
            &["-m", "venv", &home.display().to_string()],
        )?;
        let install = ["-m", "pip", "install", "--quiet", OPEN3D];
        said(&python, &install)?;
    }
    let version = ask()?.lines().last().unwrap_or_default().trim().to_owned();
    let script = root().join("tests/peers/open3d_planar_patches.py");
    Ok(Peer {
        method: Method::Open3d,
        version,
        program: vec![python.into(), script.into()],
    })
}

fn cgal() -> Result<Peer> {
    let header = Path::new("/usr/include/CGAL/version.h");
    if !header.exists() {
        let install = [
            "install",
            "--yes",
            "--no-install-recommends",
            "libcgal-dev",
            "libeigen3-dev",
        ];
        said(Path::new("apt-get"), &install)?;
    }
    let text = fs::read_to_string(header).context("no CGAL headers")?;
    let version = text
        .lines()
        .find_map(|line| line.strip_prefix("#define CGAL_VERSION "))
        .context("CGAL names no version")?;
    let source = root().join("tests/peers/cgal_region_growing.cpp");
    let folder = target().join("studies/peers");
    fs::create_dir_all(&folder)?;
    let program = folder.join("cgal_region_growing");
    let changed = |path: &Path| fs::metadata(path).and_then(|m| m.modified()).ok();
    if changed(&program).is_none_or(|built| changed(&source).is_none_or(|s| s > built)) {
        let (from, to) = (source.display().to_string(), program.display().to_string());
        let words = [
            "-O2",
            "-std=c++17",
            "-DCGAL_NDEBUG",
            "-DCGAL_EIGEN3_ENABLED",
            "-I/usr/include/eigen3",
            "-o",
            &to,
            &from,
        ];
        said(Path::new("g++"), &words)?;
    }
    Ok(Peer {
        method: Method::Cgal,
        version: version.trim().to_owned(),
        program: vec![program.into()],
    })
}

/// What a program prints.
fn said(program: &Path, words: &[&str]) -> Result<String> {
    let output = Command::new(program)
        .args(words)
        .output()
        .with_context(|| format!("cannot start {}", program.display()))?;
    let cause = String::from_utf8_lossy(&output.stderr);
    let last = cause.lines().last().unwrap_or("no message");
    ensure!(
        output.status.success(),
        "{} failed: {last}",
        program.display()
    );
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

impl Peer {
    /// Parameters chosen on the scenes for tuning, by set; `tests/peers/README.md` says which
    /// were tried.
    pub(crate) fn parameters(&self, set: Set) -> &'static str {
        match (self.method, set) {
            (Method::Open3d, Set::Polyhedral | Set::Curved) => "30 5 88 0.5",
            (Method::Open3d, Set::Abw) => "30 40 60 0.5",
            (_, Set::Polyhedral | Set::Curved) => "12 0.25 20 60",
            (_, Set::Abw) => "16 0.5 20 60",
        }
    }

    /// What the parameters mean.
    pub(crate) fn meaning(&self) -> &'static str {
        match self.method {
            Method::Open3d => {
                "neighbours, normal variance (degrees), coplanarity (degrees), nodes within (mm)"
            }
            _ => "neighbours, distance (mm), angle (degrees), least nodes",
        }
    }

    /// The labels of several scenes, in their order.
    pub(crate) fn label(
        &self,
        parameters: &str,
        scenes: &[(&Subject, &RangeImage)],
    ) -> Result<Vec<Labelled>> {
        let folder = tempfile::tempdir()?;
        let mut files: Vec<(PathBuf, PathBuf)> = Vec::new();
        for (k, (_, image)) in scenes.iter().enumerate() {
            let source = folder.path().join(format!("{k}.nodes"));
            fs::write(&source, nodes(image))?;
            files.push((source, folder.path().join(format!("{k}.labels"))));
        }
        let (program, leading) = self.program.split_first().context("no program")?;
        let output = Command::new(program)
            .args(leading)
            .args(parameters.split_whitespace())
            .args(files.iter().flat_map(|(source, labels)| [source, labels]))
            .output()?;
        let cause = String::from_utf8_lossy(&output.stderr);
        ensure!(
            output.status.success(),
            "{} failed: {cause}",
            self.method.name()
        );
        let printed = String::from_utf8_lossy(&output.stdout);
        let seconds: Vec<f64> = printed
            .lines()
            .filter_map(|line| line.rsplit_once(' ')?.1.parse().ok())
            .collect();
        ensure!(seconds.len() == files.len(), "not one time for each image");
        let mut done = Vec::new();
        for ((_, file), seconds) in files.iter().zip(seconds) {
            let bytes = fs::read(file)?;
            let labels = bytes.as_chunks().0.iter().map(|b| u16::from_le_bytes(*b));
            done.push(Labelled {
                method: self.method,
                labels: labels.collect(),
                seconds,
            });
        }
        Ok(done)
    }
}

fn nodes(image: &RangeImage) -> Vec<u8> {
    let size = [image.columns() as i64, image.rows() as i64];
    let mut out = size.map(i64::to_le_bytes).concat();
    for (node, z) in image.raw_z_mm().iter().enumerate() {
        let (column, row) = (node / image.rows(), node % image.rows());
        let point = [image.x_mm(column), image.y_mm(row), *z];
        out.extend(point.map(f64::to_le_bytes).concat());
    }
    out
}
