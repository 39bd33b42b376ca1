//! A tilted plane pair with a step, and a scan of it with outliers.

use std::f64::consts::PI;

use range_image::{Column, Sample};

/// Columns of the scan, and samples of a column.
pub(crate) const COLUMNS: u32 = 240;
pub(crate) const SAMPLES: u32 = 256;
/// Distance of columns and, on average, of samples; also that of the grid's nodes.
pub(crate) const PITCH_MM: f64 = 0.4;
/// Standard deviation of z.
pub(crate) const NOISE_MM: f64 = 0.05;
/// Height of the step.
pub(crate) const STEP_MM: f64 = 5.0;
/// Outliers lie within a range of this length.
pub(crate) const OUTLIER_RANGE_MM: f64 = 60.0;

/// How outliers come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outliers {
    /// Each on its own, anywhere from 30 mm behind the surface to 30 mm before it.
    Uniform,
    /// Each on its own, up to 60 mm before the surface.
    OneSided,
    /// In runs of 3 to 8 along a column, off by the same amount but for the noise, up to
    /// 30 mm to either side.
    Clustered,
}

impl Outliers {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::OneSided => "one-sided",
            Self::Clustered => "clustered",
        }
    }
}

/// One scan of the plane pair.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene {
    pub(crate) seed: u64,
    pub(crate) outliers: Outliers,
    /// Share of the samples that are outliers.
    pub(crate) share: f64,
}

/// The truth: both planes and the line between them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Truth {
    slope: (f64, f64),
    /// Normal of the line, and its distance from the origin.
    normal: (f64, f64),
    distance_mm: f64,
}

impl Truth {
    /// z on the lower plane.
    pub(crate) fn lower_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        self.slope.0 * x_mm + self.slope.1 * y_mm
    }

    /// Distance from the line, positive on the upper plane's side.
    pub(crate) fn distance_to_step_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        self.normal.0 * x_mm + self.normal.1 * y_mm - self.distance_mm
    }

    /// z of the surface.
    pub(crate) fn z_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let upper = self.distance_to_step_mm(x_mm, y_mm) > 0.0;
        self.lower_mm(x_mm, y_mm) + if upper { STEP_MM } else { 0.0 }
    }
}

impl Scene {
    /// What is there. Both planes are tilted alike, so that the step has one height; the
    /// line passes near the middle in a direction that depends on the seed.
    pub(crate) fn truth(&self) -> Truth {
        let mut random = Random::new(self.seed);
        let angle = 2.0 * PI * random.uniform();
        let slope = (0.4 * random.uniform() - 0.2, 0.4 * random.uniform() - 0.2);
        let normal = (angle.cos(), angle.sin());
        let width_mm = PITCH_MM * f64::from(COLUMNS);
        let height_mm = PITCH_MM * f64::from(SAMPLES);
        let middle = 0.5 * (normal.0 * width_mm + normal.1 * height_mm);
        Truth {
            slope,
            normal,
            distance_mm: middle + 10.0 * (random.uniform() - 0.5),
        }
    }

    /// The scan. Columns scatter by a twentieth of their distance; samples start anywhere
    /// in a column and scatter by a fifth of their distance.
    pub(crate) fn columns(&self) -> Vec<Column> {
        let truth = self.truth();
        let mut random = Random::new(self.seed ^ 0x5eed);
        (0..COLUMNS)
            .map(|column| {
                let x_mm = PITCH_MM * (f64::from(column) + 0.05 * (random.uniform() - 0.5));
                let start = random.uniform();
                let mut run = Run::default();
                let samples = (0..SAMPLES).map(|sample| {
                    let scatter = 0.2 * (random.uniform() - 0.5);
                    let y_mm = PITCH_MM * (f64::from(sample) + start + scatter);
                    let z_mm = truth.z_mm(x_mm, y_mm)
                        + NOISE_MM * random.normal()
                        + self.error_mm(&mut run, &mut random);
                    Sample {
                        y_mm,
                        z_mm,
                        intensity: 255,
                    }
                });
                Column::new(x_mm, samples.collect())
            })
            .collect()
    }

    fn error_mm(&self, run: &mut Run, random: &mut Random) -> f64 {
        let (chance, place) = (random.uniform(), random.uniform());
        match self.outliers {
            Outliers::Uniform if chance < self.share => OUTLIER_RANGE_MM * (place - 0.5),
            Outliers::OneSided if chance < self.share => OUTLIER_RANGE_MM * place,
            Outliers::Uniform | Outliers::OneSided => 0.0,
            Outliers::Clustered => {
                // Runs of 5.5 on average start so often that they cover the share.
                if run.left == 0 && chance < self.share / (5.5 * (1.0 - self.share) + self.share) {
                    run.left = 3 + (6.0 * random.uniform()) as u32;
                    run.error_mm = OUTLIER_RANGE_MM * (place - 0.5);
                }
                let within = run.left > 0;
                run.left = run.left.saturating_sub(1);
                if within { run.error_mm } else { 0.0 }
            }
        }
    }
}

/// A run of outliers under way.
#[derive(Debug, Default)]
struct Run {
    left: u32,
    error_mm: f64,
}

/// SplitMix64: simple enough to say the same everywhere, and not what the regridder draws
/// with.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x2545_f491_4f6c_dd1d))
    }

    /// In [0, 1).
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^= mixed >> 31;
        (mixed >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal (Box & Muller).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * PI * self.uniform()).cos()
    }
}
