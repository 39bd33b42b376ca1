//! Surfaces in closed form.

#![allow(clippy::unwrap_used, reason = "closed forms make sound grids")]

use libm::{cos, exp, fabs, sin};
use surfacing::HeightGrid;

/// A grid of `columns` x `rows` nodes over the unit square stretched to `pitch_mm` apart; `z`
/// is given x and y of the square.
pub(crate) fn grid(
    columns: usize,
    rows: usize,
    pitch_mm: f64,
    z: impl Fn(f64, f64) -> f64,
) -> HeightGrid {
    let share = |k: usize, count: usize| k as f64 / (count - 1) as f64;
    let z = (0..columns * rows)
        .map(|n| z(share(n / rows, columns), share(n % rows, rows)))
        .collect();
    HeightGrid::new(pitch_mm, [-3.0, 5.0], columns, rows, z).unwrap()
}

fn hill(x: f64, y: f64, at: [f64; 2], widths: [f64; 2]) -> f64 {
    let (a, b) = ((x - at[0]) / widths[0], (y - at[1]) / widths[1]);
    exp(-a * a - b * b)
}

/// Franke's function (1979), 20 mm high.
pub(crate) fn franke(x: f64, y: f64) -> f64 {
    let (x, y) = (9.0 * x, 9.0 * y);
    let slope = exp(-(x + 1.0) * (x + 1.0) / 49.0 - (y + 1.0) / 10.0);
    20.0 * (0.75 * hill(x, y, [2.0, 2.0], [2.0, 2.0])
        + 0.75 * slope
        + 0.5 * hill(x, y, [7.0, 3.0], [2.0, 2.0])
        - 0.2 * hill(x, y, [4.0, 7.0], [1.0, 1.0]))
}

/// The function `peaks` that numerical programs show.
pub(crate) fn peaks(x: f64, y: f64) -> f64 {
    let (x, y) = (6.0 * x - 3.0, 6.0 * y - 3.0);
    let (x3, y5) = (x * x * x, y * y * y * y * y);
    3.0 * (1.0 - x) * (1.0 - x) * exp(-x * x - (y + 1.0) * (y + 1.0))
        - 10.0 * (x / 5.0 - x3 - y5) * exp(-x * x - y * y)
        - exp(-(x + 1.0) * (x + 1.0) - y * y) / 3.0
}

/// A relief like a face, with a sharp ridge for its nose that runs out in brow and lip.
pub(crate) fn face(x: f64, y: f64) -> f64 {
    let (x, y) = (160.0 * (x - 0.5), 200.0 * (y - 0.5));
    let head = 1.0 - 0.54 * x * x / 6400.0 - 0.5 * y * y / 10_000.0;
    let nose = (1.0 - fabs(x) / 18.0).max(0.0) * hill(x, y, [0.0, 2.0], [1e9, 24.0]);
    let eyes = hill(x, y, [24.0, 22.0], [12.0, 8.0]) + hill(x, y, [-24.0, 22.0], [12.0, 8.0]);
    60.0 * head.max(0.0).sqrt() + 6.0 * hill(x, y, [0.0, 35.0], [45.0, 12.0]) + 22.0 * nose
        - 7.0 * eyes
        + 4.0 * hill(x, y, [0.0, -36.0], [24.0, 7.0])
        - 3.0 * hill(x, y, [0.0, -37.0], [28.0, 2.5])
}

/// Something smooth.
pub(crate) fn waves(x: f64, y: f64) -> f64 {
    3.0 * sin(4.0 * x) * cos(3.0 * y) + 2.0 * x * y
}

/// Normal draws of one standard deviation, from a fixed seed.
pub(crate) fn draws(count: usize) -> Vec<f64> {
    let mut draw = draws_from(0x2545_f491_4f6c_dd1d);
    (0..count).map(|_| draw()).collect()
}

/// The same from any seed.
pub(crate) fn draws_from(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}
