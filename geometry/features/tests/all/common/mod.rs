//! Parts by formula, and scans of them: rays from a camera that turns at even steps.

#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test uses a part of this, and one that cannot go on ends"
)]

use features::network::Classifier;
use features::recognise::{Recognition, Settings, Teller, recognise};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use range_image::{Column, Sample, Unmonitored};

/// How a part is scanned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bench {
    pub(crate) camera_mm: [f64; 2],
    pub(crate) x_mm: (f64, f64),
    pub(crate) y_mm: (f64, f64),
    pub(crate) pitch_mm: f64,
    pub(crate) noise_mm: f64,
    pub(crate) outliers: f64,
    pub(crate) dropouts: f64,
    pub(crate) seed: u64,
}

impl Default for Bench {
    fn default() -> Self {
        Self {
            camera_mm: [0.0, 300.0],
            x_mm: (-60.0, 60.0),
            y_mm: (-40.0, 40.0),
            pitch_mm: 0.4,
            noise_mm: 0.05,
            outliers: 0.01,
            dropouts: 0.02,
            seed: 1,
        }
    }
}

/// Columns of a scan of the heights.
pub(crate) fn scan(bench: &Bench, height_mm: &dyn Fn(f64, f64) -> f64) -> Vec<Column> {
    let mut dice = Xoshiro256PlusPlus::seed_from_u64(bench.seed);
    let mut even = move || (dice.next_u64() >> 11) as f64 / 9_007_199_254_740_992.0;
    let [cy, cz] = bench.camera_mm;
    let columns = ((bench.x_mm.1 - bench.x_mm.0) / bench.pitch_mm) as usize;
    let rays = ((bench.y_mm.1 - bench.y_mm.0) / bench.pitch_mm) as usize;
    let step = bench.pitch_mm / cz;
    (0..columns)
        .map(|k| {
            let x = bench.x_mm.0 + bench.pitch_mm * k as f64;
            let mut samples = Vec::new();
            for ray in 0..rays {
                let tangent = (bench.y_mm.0 - cy) / cz + step * ray as f64;
                let z = first_met(height_mm, x, cy, cz, tangent);
                let normal: f64 = (0..12).map(|_| even()).sum::<f64>() - 6.0;
                let (lost, wild, place) = (even(), even(), even());
                if lost < bench.dropouts {
                    continue;
                }
                let z = if wild < bench.outliers {
                    -40.0 + 60.0 * place
                } else {
                    z + bench.noise_mm * normal
                };
                samples.push(Sample {
                    y_mm: cy + tangent * (cz - z),
                    z_mm: z,
                    intensity: 255,
                });
            }
            Column::new(x, samples)
        })
        .collect()
}

/// Height at which a ray first meets what lies below it.
fn first_met(height_mm: &dyn Fn(f64, f64) -> f64, x: f64, cy: f64, cz: f64, tangent: f64) -> f64 {
    let mut z = 30.0;
    let under = |z: f64| height_mm(x, cy + tangent * (cz - z)) >= z;
    let mut step = 0.25;
    while z > -60.0 && !under(z) {
        z -= step;
    }
    while step > 1e-7 {
        step *= 0.5;
        if under(z + step) {
            z += step;
        }
    }
    z
}

/// What the shipped network recognises in a scan of the heights.
pub(crate) fn recognised(bench: &Bench, height_mm: &dyn Fn(f64, f64) -> f64) -> Recognition {
    let settings = Settings {
        teller: Teller::Network(Classifier::shipped()),
        seed: 1,
        least_pitches: Settings::USUAL_PITCHES,
    };
    let columns = scan(bench, height_mm);
    recognise(&columns, Some(bench.camera_mm), &settings, &Unmonitored).unwrap()
}
