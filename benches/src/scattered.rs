//! A million samples and what the regridder makes of them, for peers to be timed on the same.

use std::fs;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use range_image::{Column, Sample};
use regrid::Estimator;
use serde::Serialize;

use crate::scan::Uniform;
use crate::stages::regridded;

const COLUMNS: usize = 500;
const SAMPLES: usize = 2000;
/// Nodes along either side.
const SIDE: usize = 500;
const PITCH_MM: f64 = 0.4;
const NOISE_MM: f64 = 0.05;
/// Outliers lie anywhere so far to either side of the surface.
const OUTLIERS_MM: f64 = 60.0;
const STEP_MM: f64 = 5.0;
/// Turns of which the fastest counts.
const TURNS: usize = 3;

const ESTIMATORS: [(&str, Estimator); 2] = [
    ("least-median", Estimator::LeastMedian),
    ("consensus", Estimator::Consensus),
];

/// Two planes, tilted alike, with a step along a line that runs askew to the grid.
fn surface_mm(x: f64, y: f64) -> f64 {
    let step = if from_step_mm(x, y) > 0.0 {
        STEP_MM
    } else {
        0.0
    };
    0.12 * x - 0.07 * y + step
}

/// Distance from the step's line, with its sign.
fn from_step_mm(x: f64, y: f64) -> f64 {
    let middle = 0.5 * SIDE as f64 * PITCH_MM;
    0.8 * (x - middle) + 0.6 * (y - middle)
}

/// What was made, for those who read the files beside it.
#[derive(Serialize)]
struct Told {
    side: usize,
    pitch_mm: f64,
    noise_mm: f64,
    outliers: f64,
    seconds: Vec<(&'static str, f64)>,
}

/// Regrids a million samples, of which `outliers` is the share of outliers, and writes into this
/// folder, as little-endian doubles:
///
/// - `samples`: x, y, z of each sample
/// - `truth`: z of each node, y fastest
/// - `from-step`: each node's distance from the step, with its sign
/// - a file of each estimator's name: the z that it found, NaN for none
///
/// and `told.json`: sizes, and the seconds of each estimator on one thread.
pub(crate) fn write(folder: &Path, outliers: f64) -> Result<()> {
    let columns = columns(outliers);
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let samples = columns.iter().flat_map(|column| {
        let x_mm = column.x_mm();
        let triple = move |s: &Sample| [x_mm, s.y_mm, s.z_mm];
        column.samples().iter().flat_map(triple)
    });
    put(folder, "samples", samples)?;
    put(folder, "truth", nodes().map(|(x, y)| surface_mm(x, y)))?;
    put(
        folder,
        "from-step",
        nodes().map(|(x, y)| from_step_mm(x, y)),
    )?;
    let mut seconds = Vec::new();
    for (name, estimator) in ESTIMATORS {
        let (mut found, mut fastest_s) = (Vec::new(), f64::INFINITY);
        for _ in 0..TURNS {
            let begun = Instant::now();
            let image = regridded(&columns, PITCH_MM, estimator)?;
            fastest_s = fastest_s.min(begun.elapsed().as_secs_f64());
            let (i, j) = image.origin();
            let at = |c: usize, r: usize| {
                let column = usize::try_from(c as i64 - i).ok()?;
                let row = usize::try_from(r as i64 - j).ok()?;
                let is_inside = column < image.columns() && row < image.rows();
                is_inside.then(|| image.z_mm(column, row)).flatten()
            };
            found = (0..SIDE)
                .flat_map(|c| (0..SIDE).map(move |r| at(c, r).unwrap_or(f64::NAN)))
                .collect();
        }
        put(folder, name, found.into_iter())?;
        seconds.push((name, fastest_s));
    }
    let told = Told {
        side: SIDE,
        pitch_mm: PITCH_MM,
        noise_mm: NOISE_MM,
        outliers,
        seconds,
    };
    fs::write(folder.join("told.json"), serde_json::to_vec_pretty(&told)?)?;
    Ok(())
}

/// Places of the nodes, y fastest.
fn nodes() -> impl Iterator<Item = (f64, f64)> {
    (0..SIDE).flat_map(|c| (0..SIDE).map(move |r| (c as f64 * PITCH_MM, r as f64 * PITCH_MM)))
}

/// Columns that scatter about their places, of samples anywhere along them.
fn columns(outliers: f64) -> Vec<Column> {
    let mut random = Uniform::new(7);
    let length_mm = SIDE as f64 * PITCH_MM;
    let column = |c: usize| {
        let x = PITCH_MM * (c as f64 + 0.1 * (random.draw() - 0.5));
        let mut along: Vec<f64> = (0..SAMPLES).map(|_| length_mm * random.draw()).collect();
        along.sort_by(f64::total_cmp);
        let sample = |y: f64| {
            let z = surface_mm(x, y) + NOISE_MM * random.normal();
            let off = OUTLIERS_MM * (2.0 * random.draw() - 1.0);
            let z = if random.draw() < outliers { z + off } else { z };
            Sample {
                y_mm: y,
                z_mm: z,
                intensity: 200,
            }
        };
        let samples = along.into_iter().map(sample).collect();
        Column::new(x, samples)
    };
    (0..COLUMNS).map(column).collect()
}

fn put(folder: &Path, name: &str, values: impl Iterator<Item = f64>) -> Result<()> {
    let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    let path = folder.join(name);
    fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))
}
