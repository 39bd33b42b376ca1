//! Surfaces for tests.

use nurbs::PatchSurface;

use crate::assemble::Placement;

pub(crate) const PLACEMENT: Placement = Placement {
    origin_mm: [-10.0, -10.0],
    pitch_mm: 0.5,
};

/// z over -30..30 both ways, given at thirds of patches of so many millimetres.
pub(crate) fn graph(patch_mm: f64, z: impl Fn(f64, f64) -> f64) -> PatchSurface {
    let count = (60.0 / patch_mm).round() as usize;
    let breaks: Vec<f64> = (0..=count).map(|k| -30.0 + patch_mm * k as f64).collect();
    let at = |i: usize| -30.0 + patch_mm / 3.0 * i as f64;
    PatchSurface::through_thirds(breaks.clone(), breaks, |i, j| z(at(i), at(j))).unwrap()
}

/// `a + b x + c y`.
pub(crate) fn plane(a: f64, b: f64, c: f64) -> PatchSurface {
    graph(60.0, |x, y| a + b * x + c * y)
}
