//! A scan of three surfaces, for tests of what is made of it.

use pipeline::{Observer, Stage};
use range_image::{Column, Monitor, Sample};

pub(crate) struct Nobody;

impl Monitor for Nobody {
    fn is_cancelled(&self) -> bool {
        false
    }

    fn progress(&self, _: f64) {}
}

impl Observer for Nobody {
    fn stage(&self, _: Stage) {}
}

/// Noise from SplitMix64, about normal.
fn noise(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = *state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// A plane beside a bar of radius 12 mm and a sheet that bends both ways; noise of 0.02 mm.
pub(crate) fn columns() -> Vec<Column> {
    let mut state = 11;
    let z_mm = |x: f64, y: f64| {
        if x < 0.0 {
            0.3 * y - 0.2 * x
        } else if x < 20.0 {
            30.0 + (144.0 - (x - 10.0) * (x - 10.0)).sqrt()
        } else {
            60.0 + libm::sin(x / 6.0) * libm::cos(y / 7.0)
        }
    };
    (-40..=80)
        .map(|i| {
            let x_mm = f64::from(i) * 0.5;
            let samples = (-30..=30).map(|j| {
                let y_mm = f64::from(j) * 0.5;
                Sample {
                    y_mm,
                    z_mm: z_mm(x_mm, y_mm) + 0.02 * noise(&mut state),
                    intensity: 255,
                }
            });
            Column::new(x_mm, samples.collect())
        })
        .collect()
}
