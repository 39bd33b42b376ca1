//! A scan by formula, as irregular as a scanner's: a house on a table.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use range_image::{Column, Sample};

/// Of the house and the table around it.
const SIDE_MM: f64 = 100.0;
const NOISE_MM: f64 = 0.05;
/// Share of readings anywhere within the range window.
const OUTLIERS: f64 = 0.02;
const DROPOUTS: f64 = 0.01;
/// Height of the camera above the table.
const CAMERA_MM: f64 = 500.0;

/// Uniform numbers from 0 to 1.
pub(crate) struct Uniform(Xoshiro256PlusPlus);

impl Uniform {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    pub(crate) fn draw(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normal, of unit deviation: the sum of four uniform numbers.
    pub(crate) fn normal(&mut self) -> f64 {
        let sum: f64 = (0..4).map(|_| self.draw()).sum();
        3_f64.sqrt() * (sum - 2.0)
    }
}

/// Height above the table: a gabled roof with a chimney, seen from above.
fn house_mm(x: f64, y: f64) -> f64 {
    if x.abs() > 35.0 || y.abs() > 30.0 {
        0.0
    } else if (x - 15.0).abs() < 5.0 && (y - 12.0).abs() < 5.0 {
        45.0
    } else {
        40.0 - 0.6 * y.abs()
    }
}

/// The columns of a scan, and a pitch that suits them. The laser's angle is stepped uniformly, so
/// that samples lie irregularly in y.
pub(crate) fn house(columns: u32, samples: u32) -> (Vec<Column>, f64) {
    let mut random = Uniform::new(1);
    let pitch_mm = SIDE_MM / f64::from(columns.min(samples));
    let column = |c: u32| {
        let x = SIDE_MM * (f64::from(c) / f64::from(columns) - 0.5);
        let samples = (0..samples).filter_map(|s| {
            let slope = SIDE_MM / CAMERA_MM * (f64::from(s) / f64::from(samples) - 0.5);
            // Where the ray meets the surface, within less than the noise.
            let mut z = 20.0;
            for _ in 0..8 {
                z = house_mm(x, slope * (CAMERA_MM - z));
            }
            z += NOISE_MM * random.normal();
            if random.draw() < OUTLIERS {
                z = 60.0 * random.draw() - 5.0;
            }
            let y_mm = slope * (CAMERA_MM - z);
            (random.draw() >= DROPOUTS).then_some(Sample {
                y_mm,
                z_mm: z,
                intensity: 200,
            })
        });
        Column::new(x, samples.collect())
    };
    ((0..columns).map(column).collect(), pitch_mm)
}
