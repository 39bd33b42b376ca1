//! Other programs on the same samples. `tests/peers/plane_windows.py` runs them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use range_image::{Column, Lattice};

use crate::figures::Figures;
use crate::scene::{NOISE_MM, PITCH_MM, Scene};
use crate::{Line, PEER_NEIGHBOURS, extent_mm};

const PACKAGES: [&str; 3] = ["numpy", "scipy", "scikit-learn"];
/// The slow peers are asked for one node in so many away from the step, and for all near.
const ONE_IN: i64 = 31;
/// How near, millimetres.
const NEAR_MM: f64 = 1.5;

/// A Python with the peers' packages.
#[derive(Debug)]
pub(crate) struct Python {
    program: PathBuf,
    folder: PathBuf,
    /// Names and versions of the packages.
    pub(crate) versions: String,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn said(program: &Path, arguments: &[&str]) -> Result<String> {
    let done = Command::new(program)
        .args(arguments)
        .output()
        .with_context(|| format!("cannot start {}", program.display()))?;
    let errors = String::from_utf8_lossy(&done.stderr);
    ensure!(
        done.status.success(),
        "{} {}: {errors}",
        program.display(),
        arguments.join(" ")
    );
    Ok(String::from_utf8_lossy(&done.stdout).into_owned())
}

impl Python {
    /// Installs what is not there.
    pub(crate) fn ready() -> Result<Self> {
        let target = std::env::var_os("CARGO_TARGET_DIR")
            .map_or_else(|| root().join("target"), PathBuf::from);
        let home = target.join("studies/planes");
        let program = home.join("bin/python");
        let ask = "import numpy, scipy, sklearn; print('NumPy', numpy.__version__ + ', SciPy', \
                   scipy.__version__ + ', scikit-learn', sklearn.__version__)";
        if said(&program, &["-c", ask]).is_err() {
            said(
                Path::new("python3"),
                &["-m", "venv", &home.display().to_string()],
            )?;
            let install = [&["-m", "pip", "install", "--quiet"][..], &PACKAGES].concat();
            said(&program, &install)?;
        }
        let versions = said(&program, &["-c", ask])?.trim().to_owned();
        Ok(Self {
            program,
            folder: home,
            versions,
        })
    }

    /// What every peer makes of a scan.
    pub(crate) fn lines(&self, scene: &Scene) -> Result<Vec<Line>> {
        let truth = scene.truth();
        let samples = self.folder.join("samples.f64");
        fs::write(&samples, bytes(scene.columns().iter().flat_map(triples)))?;
        let mut lines = Vec::new();
        for (name, told, all) in [
            ("binned medians", "binned-medians", true),
            (
                "scikit-learn RANSAC, told the noise",
                "sklearn-ransac",
                false,
            ),
        ] {
            let lattice = Lattice { pitch_mm: PITCH_MM };
            let (width_mm, height_mm) = extent_mm();
            let mut nodes = Vec::new();
            for i in 0..=lattice.last_at_or_below(width_mm) {
                for j in 0..=lattice.last_at_or_below(height_mm) {
                    let node = (lattice.line_mm(i), lattice.line_mm(j));
                    let near = truth.distance_to_step_mm(node.0, node.1).abs() < NEAR_MM;
                    if all || near || (i * 256 + j) % ONE_IN == 0 {
                        nodes.push(node);
                    }
                }
            }
            let (asked, answered) = (
                self.folder.join("nodes.f64"),
                self.folder.join("answers.f64"),
            );
            fs::write(&asked, bytes(nodes.iter().flat_map(|n| [n.0, n.1])))?;
            let script = root().join("tests/peers/plane_windows.py");
            let seconds = said(
                &self.program,
                &[
                    &script.display().to_string(),
                    told,
                    &samples.display().to_string(),
                    &asked.display().to_string(),
                    &answered.display().to_string(),
                    &PEER_NEIGHBOURS.to_string(),
                    &NOISE_MM.to_string(),
                    &PITCH_MM.to_string(),
                ],
            )?;
            let answers = numbers(&fs::read(&answered)?);
            ensure!(answers.len() == nodes.len(), "{told}: answers are missing");
            let mut figures = Figures::default();
            for (node, z_mm) in nodes.iter().zip(answers) {
                if z_mm.is_nan() {
                    figures.holes += 1;
                } else {
                    figures.node(z_mm, &truth, *node);
                }
            }
            lines.push(Line {
                name: name.to_owned(),
                outliers: scene.outliers,
                share: scene.share,
                figures,
                nodes_per_s: nodes.len() as f64 / seconds.trim().parse::<f64>()?,
            });
        }
        Ok(lines)
    }
}

fn triples(column: &Column) -> impl Iterator<Item = f64> {
    let x_mm = column.x_mm();
    let samples = column.samples().iter();
    samples.flat_map(move |s| [x_mm, s.y_mm, s.z_mm])
}

fn bytes(numbers: impl Iterator<Item = f64>) -> Vec<u8> {
    numbers.flat_map(f64::to_le_bytes).collect()
}

fn numbers(bytes: &[u8]) -> Vec<f64> {
    let words = bytes.chunks_exact(8);
    words
        .filter_map(|word| Some(f64::from_le_bytes(word.try_into().ok()?)))
        .collect()
}
