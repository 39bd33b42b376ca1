//! Simulated sheets, whose truth is known: what fitting takes from the noise, and what it
//! adds of its own.

use anyhow::Result;
use pipeline::Settings;
use range_image::{Column, RangeImage, RegionMap, Sample, Unmonitored};
use reconstruct::reconstruct;

/// Standard deviation of the samples, millimetres.
const NOISE_MM: f64 = 0.05;

/// Distance of columns, of samples and of nodes, millimetres.
const PITCH_MM: f64 = 0.5;

/// Columns, and samples in a column.
const SIZE: usize = 200;

/// A sheet: its name and z over the square of 100 mm.
type Sheet = (&'static str, fn(f64, f64) -> f64);

const SHEETS: [Sheet; 4] = [
    ("plane", |x, y| 0.3 * x - 0.2 * y),
    ("cylinder, radius 80 mm", |x, y| {
        let along = 0.8 * (x - 50.0) + 0.6 * (y - 50.0);
        libm::sqrt(80.0 * 80.0 - along * along)
    }),
    ("waves of 75 and 94 mm", |x, y| {
        6.0 * libm::sin(x / 12.0) * libm::cos(y / 15.0)
    }),
    ("waves and a knob 12 mm wide", |x, y| {
        let square = (x - 68.0) * (x - 68.0) + (y - 57.0) * (y - 57.0);
        6.0 * libm::sin(x / 12.0) * libm::cos(y / 15.0) + 1.5 * libm::exp(-square / 18.0)
    }),
];

/// A table of the sheets.
pub(crate) fn table(seeds: u64) -> Result<String> {
    let mut text = format!(
        "| sheet, noise {NOISE_MM} mm | seed | patches | rms of the nodes from the truth, mm \
         | rms of the fit from the truth, mm | greatest, mm |\n\
         | --- | ---: | ---: | ---: | ---: | ---: |\n"
    );
    for (name, z) in SHEETS {
        for seed in 1..=seeds {
            let columns = scan(z, seed);
            let settings = Settings::new(PITCH_MM).with_seed(seed);
            let image = regrid::regrid(columns, &settings.regrid, &Unmonitored)?;
            let labels = image.raw_z_mm().iter().map(|z| u16::from(z.is_finite()));
            let map = RegionMap::new(&image, labels.collect());
            let made = reconstruct(&image, &map, &settings.reconstruct, &Unmonitored)?;
            let (nodes, _) = off_mm(&image, z);
            let (fit, greatest) = off_mm(&made.restored, z);
            let patches: usize = made.regions.iter().map(|r| r.patches).sum();
            text += &format!(
                "| {name} | {seed} | {patches} | {nodes:.4} | {fit:.4} | {greatest:.3} |\n"
            );
        }
    }
    Ok(text)
}

fn scan(z: fn(f64, f64) -> f64, seed: u64) -> Vec<Column> {
    let mut draws = Draws(seed);
    (0..SIZE)
        .map(|i| {
            let x_mm = PITCH_MM * i as f64;
            let sample = |j: usize| {
                let y_mm = PITCH_MM * (j as f64 + 0.4 * (draws.uniform() - 0.5));
                Sample {
                    y_mm,
                    z_mm: z(x_mm, y_mm) + NOISE_MM * draws.normal(),
                    intensity: 255,
                }
            };
            Column::new(x_mm, (0..SIZE).map(sample).collect())
        })
        .collect()
}

/// Root mean square and greatest distance of an image's nodes from the truth.
fn off_mm(image: &RangeImage, z: fn(f64, f64) -> f64) -> (f64, f64) {
    let (mut squares, mut count, mut greatest) = (0.0, 0.0, 0.0_f64);
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            if let Some(z_mm) = image.z_mm(column, row) {
                let off = z_mm - z(image.x_mm(column), image.y_mm(row));
                squares += off * off;
                count += 1.0;
                greatest = greatest.max(off.abs());
            }
        }
    }
    (f64::sqrt(squares / count), greatest)
}

/// Random numbers by SplitMix64.
struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^= bits >> 31;
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        radius * libm::cos(core::f64::consts::TAU * self.uniform())
    }
}
