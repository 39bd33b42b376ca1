//! A torso by formula, limbs left out: sections as a body scanner would give them.
//!
//! Nothing here is measured of a person. Widths and depths at eight heights are those of a standing
//! adult to within a few centimetres; bust, shoulder blades, spine, navel and buttocks are bumps and
//! grooves.

use std::f64::consts::TAU;

use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use skin::Section;

/// Height, half width, half depth, exponent of the superellipse, forward shift; millimetres.
const STATIONS: [[f64; 5]; 8] = [
    [800.0, 175.0, 125.0, 2.3, 0.0],
    [880.0, 180.0, 130.0, 2.4, -5.0],
    [1000.0, 150.0, 105.0, 2.3, 5.0],
    [1100.0, 135.0, 95.0, 2.2, 10.0],
    [1220.0, 155.0, 110.0, 2.3, 8.0],
    [1320.0, 185.0, 110.0, 2.6, 0.0],
    [1430.0, 150.0, 75.0, 2.2, -10.0],
    [1500.0, 62.0, 62.0, 2.0, -15.0],
];

/// Height, its spread, angle in degrees (90 is the front), its spread, how far out; millimetres.
const FEATURES: [[f64; 5]; 8] = [
    [1290.0, 55.0, 62.0, 22.0, 28.0],
    [1290.0, 55.0, 118.0, 22.0, 28.0],
    [1330.0, 60.0, 240.0, 18.0, 12.0],
    [1330.0, 60.0, 300.0, 18.0, 12.0],
    [1150.0, 260.0, 270.0, 9.0, -14.0],
    [870.0, 70.0, 245.0, 20.0, 30.0],
    [870.0, 70.0, 295.0, 20.0, 30.0],
    [1030.0, 12.0, 90.0, 6.0, -6.0],
];

/// From the hip to the neck.
const HEIGHTS_MM: (f64, f64) = (810.0, 1490.0);
/// Points of a section.
pub(crate) const POINTS: usize = 120;
/// Angles are off even ones by up to this part of their distance.
const UNEVEN: f64 = 0.3;
pub(crate) const NOISE_MM: f64 = 0.5;

/// Half width, half depth, exponent and shift at a height, by cubic Hermite pieces.
fn at_height(z: f64) -> [f64; 4] {
    let last = STATIONS.len() - 1;
    let after = STATIONS
        .iter()
        .take_while(|station| station[0] <= z)
        .count();
    let k = after.saturating_sub(1).min(last - 1);
    let (a, b) = (&STATIONS[k], &STATIONS[k + 1]);
    let width = b[0] - a[0];
    let t = (z - a[0]) / width;
    let rate = |i: usize, d: usize| {
        let (low, high) = (&STATIONS[i], &STATIONS[i + 1]);
        (high[d] - low[d]) / (high[0] - low[0])
    };
    // At a station the mean of the rates beside it.
    let slope = |i: usize, d: usize| {
        let [before, own] = [i.saturating_sub(1), i.min(last - 1)];
        width * (rate(before, d) + rate(own, d)) / 2.0
    };
    let (t2, t3) = (t * t, t * t * t);
    std::array::from_fn(|d| {
        let d = d + 1;
        (2.0 * t3 - 3.0 * t2 + 1.0) * a[d]
            + (t3 - 2.0 * t2 + t) * slope(k, d)
            + (3.0 * t2 - 2.0 * t3) * b[d]
            + (t3 - t2) * slope(k + 1, d)
    })
}

/// A place on the skin, millimetres.
fn place(z: f64, angle: f64) -> [f64; 3] {
    let [width, depth, exponent, shift] = at_height(z);
    let bent = |half: f64, c: f64| (half * libm::pow(c.abs(), 2.0 / exponent)).copysign(c);
    let (x, y) = (bent(width, libm::cos(angle)), bent(depth, libm::sin(angle)));
    let out = |[height, spread, at, wide, by]: [f64; 5]| {
        let turn = (angle.to_degrees() - at + 180.0).rem_euclid(360.0) - 180.0;
        let (up, around) = ((z - height) / spread, turn / wide);
        by * libm::exp(-up * up - around * around)
    };
    let share = 1.0 + FEATURES.into_iter().map(out).sum::<f64>() / libm::hypot(x, y);
    [x * share, y * share + shift, z]
}

/// Sections at these heights, with noise, from seed `seed`.
pub(crate) fn sections(heights_mm: &[f64], seed: u64) -> Vec<Section> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let section = |(k, z): (usize, &f64)| {
        let point = |j: usize| {
            let [turn, x, y] = [0, 1, 2].map(|_| normal(&mut random));
            let uneven = UNEVEN * turn.clamp(-1.0, 1.0);
            let [px, py, pz] = place(*z, TAU * (j as f64 + uneven) / POINTS as f64);
            [px + NOISE_MM * x, py + NOISE_MM * y, pz]
        };
        Section {
            name: format!("section {}", k + 1),
            points: (0..POINTS).map(point).collect(),
            is_closed: true,
            is_directed: false,
        }
    };
    heights_mm.iter().enumerate().map(section).collect()
}

/// A draw of one standard deviation: twelve even ones added up.
fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
    let mut even = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (0..12).map(|_| even()).sum::<f64>() - 6.0
}

/// So many heights from the hip to the neck, millimetres.
pub(crate) fn heights(count: usize) -> Vec<f64> {
    let (low, high) = HEIGHTS_MM;
    let height = |k: usize| low + (high - low) * k as f64 / (count - 1) as f64;
    (0..count).map(height).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torso_is_as_wide_and_deep_as_its_stations_where_nothing_bulges() {
        // To the left and right, at the waist.
        let [x, y, _] = place(1100.0, 0.0);
        assert!((x - 135.0).abs() < 0.5 && (y - 10.0).abs() < 0.5, "{x} {y}");
        for section in sections(&heights(9), 1) {
            assert_eq!(section.points.len(), POINTS);
            let widest = section.points.iter().map(|p| p[0]).fold(0.0, f64::max);
            assert!((60.0..230.0).contains(&widest), "{widest}");
        }
        assert_ne!(sections(&heights(9), 1), sections(&heights(9), 2));
    }
}
