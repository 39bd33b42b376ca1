//! Surfaces for tests.

use nurbs::PatchSurface;

use crate::assemble::Placement;
use crate::border::map::{MapEdge, PlanarMap};
use crate::border::path::polyline;

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

/// A crease in row 20, which is y = 0, drawn a quarter of a row off it from column 0 to 40, with an
/// outline that goes on from its end.
pub(crate) fn crease_and_outline() -> PlanarMap {
    let vertices = vec![[0.0, 20.25], [40.0, 20.25], [50.0, 20.25]];
    let edge = |start: usize, sides: [u32; 2]| MapEdge {
        start,
        end: start + 1,
        sides,
        path: polyline(&[vertices[start], vertices[start + 1]]).unwrap(),
        is_settled: false,
        is_kept: false,
    };
    PlanarMap {
        edges: vec![edge(0, [1, 2]), edge(1, [1, 0])],
        vertices,
        ..PlanarMap::default()
    }
}

/// A face that meets z = 0 in that crease up to x = 8, which is column 36, and falls away from there.
pub(crate) fn running_out() -> PatchSurface {
    graph(0.5, |x, y| 0.5 * y - 8.0 * (x - 8.0).max(0.0))
}
