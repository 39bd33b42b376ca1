//! Scenes for the tests.
#![allow(dead_code)] // each test file uses its own part

use range_image::{Column, RangeImage, Sample, Unmonitored};
use regrid::{RegridSettings, regrid};

/// A small generator of its own, so that scenes share nothing with the code under test.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(2).wrapping_add(1))
    }

    /// Uniform in [0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (self.0 ^ (self.0 >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        (mixed >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Near enough to normal: the sum of twelve, less six.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Columns at `x_mm`, each with what `samples` gives as (y, z).
pub(crate) fn columns(
    x_mm: impl IntoIterator<Item = f64>,
    mut samples: impl FnMut(f64) -> Vec<(f64, f64)>,
) -> Vec<Column> {
    x_mm.into_iter()
        .map(|x| {
            let samples = samples(x).into_iter().map(|(y_mm, z_mm)| Sample {
                y_mm,
                z_mm,
                intensity: 200,
            });
            Column::new(x, samples.collect())
        })
        .collect()
}

/// `start, start + step, ...`, `number` of them.
pub(crate) fn steps(start: f64, step: f64, number: i32) -> impl Iterator<Item = f64> + Clone {
    (0..number).map(move |k| start + step * f64::from(k))
}

/// A square of this side in mm, scanned with columns `dx` and samples `dy` apart, phases
/// given, z by the function.
pub(crate) fn scan(
    side: f64,
    (dx, dy): (f64, f64),
    phase: (f64, f64),
    mut z: impl FnMut(f64, f64) -> Option<f64>,
) -> Vec<Column> {
    let number = |step: f64| (side / step) as i32 + 1;
    columns(steps(phase.0 * dx, dx, number(dx)), |x| {
        steps(phase.1 * dy, dy, number(dy))
            .filter_map(|y| Some((y, z(x, y)?)))
            .collect()
    })
}

pub(crate) fn image(columns: &[Column], settings: &RegridSettings) -> RangeImage {
    regrid(columns.to_vec(), settings, &Unmonitored).expect("a sound scan")
}

/// Every node with a value as (x, y, z).
pub(crate) fn nodes(image: &RangeImage) -> Vec<(f64, f64, f64)> {
    let mut nodes = Vec::new();
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            if let Some(z) = image.z_mm(column, row) {
                nodes.push((image.x_mm(column), image.y_mm(row), z));
            }
        }
    }
    nodes
}

pub(crate) fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, number) = values.fold((0.0, 0.0), |(sum, number), v| (sum + v * v, number + 1.0));
    (sum / number).sqrt()
}
