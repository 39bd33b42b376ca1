//! Surfaces that are parts of others.

use crate::known;

use nalgebra::Vector3;
use shapes::{Family, Fit, Sample, decide, fit, is_part_of_free_form};

use known::{NOISE_MM, Random};

const PITCH_MM: f64 = 0.4;

/// A wavy sheet around the origin, with noise, where it is so far from there.
fn sheet(seed: u64, from_mm: core::ops::Range<f64>, raised_mm: f64) -> Vec<Sample> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(7));
    let at = |k: i32| PITCH_MM * f64::from(k);
    let places = (-40..=40).flat_map(|i| (-40..=40).map(move |j| (at(i), at(j))));
    places
        .filter(|(x, y)| from_mm.contains(&(x * x + y * y).sqrt()))
        .map(|(x, y)| {
            let z = 2.0 * libm::sin(0.06 * x + 0.5) * libm::cos(0.05 * y) + 0.2 * y + raised_mm;
            Sample {
                point_mm: Vector3::new(x, y, z + NOISE_MM * random.normal()),
                ray: Vector3::z(),
                sigma_mm: NOISE_MM,
            }
        })
        .collect()
}

fn told(samples: &[Sample]) -> Fit {
    decide(samples, 1.0)
        .into_fit()
        .or_else(|| fit(Family::Plane, samples, 1.0))
        .expect("enough samples")
}

#[test]
fn what_a_ring_stands_around_is_of_the_sheet_beyond() {
    for seed in 0..10 {
        let around = sheet(seed, 10.0..15.0, 0.0);
        let within = sheet(seed + 100, 0.0..4.0, 0.0);
        assert!(
            is_part_of_free_form((&told(&within), &within), &around),
            "{seed}"
        );
    }
}

#[test]
fn what_stands_higher_or_is_flat_is_no_part_of_it() {
    for seed in 0..10 {
        let around = sheet(seed, 6.0..12.0, 0.0);
        let boss = sheet(seed + 100, 0.0..4.0, 0.4);
        assert!(
            !is_part_of_free_form((&told(&boss), &boss), &around),
            "{seed}"
        );
        let mut level = sheet(seed + 200, 0.0..4.0, 0.0);
        let mut random = Random(seed + 5);
        for sample in &mut level {
            sample.point_mm.z = 1.0 + NOISE_MM * random.normal();
        }
        assert!(
            !is_part_of_free_form((&told(&level), &level), &around),
            "{seed}"
        );
    }
}

#[test]
fn where_too_few_samples_are_around_nothing_is_told() {
    let own = sheet(1, 0.0..4.0, 0.0);
    assert!(!is_part_of_free_form((&told(&own), &own), &own[..5]));
}
