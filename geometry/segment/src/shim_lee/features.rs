//! Six features of a node, scaled to like variance.

use super::cluster::Pattern;
use crate::normals::Normals;
use crate::scene::Scene;

/// The patterns of these nodes, all of which have a normal.
///
/// A feature that hardly varies must not be blown up until its noise looks like structure:
/// positions count in no less than pitches, normals in no less than half a crease.
pub(crate) fn patterns(scene: &Scene<'_>, normals: &Normals, nodes: &[usize]) -> Vec<Pattern> {
    let grid = &scene.grid;
    let mut patterns: Vec<Pattern> = nodes
        .iter()
        .map(|&node| {
            let (column, row) = grid.column_row(node);
            let [a, b, c] = normals.raw[node];
            let (x, y) = (column as f64 * grid.pitch_mm, row as f64 * grid.pitch_mm);
            [x, y, grid.z_mm[node], a, b, c]
        })
        .collect();
    for k in 0..6 {
        let (mean, deviation) = spread(&patterns, k);
        let scale = if k < 3 {
            deviation.max(grid.pitch_mm)
        } else {
            deviation.max(0.5 * scene.crease_rad)
        };
        for pattern in &mut patterns {
            pattern[k] = (pattern[k] - mean) / scale;
        }
    }
    patterns
}

/// Mean and standard deviation of a feature.
fn spread(patterns: &[Pattern], k: usize) -> (f64, f64) {
    let count = patterns.len().max(1) as f64;
    let mean = patterns.iter().map(|p| p[k]).sum::<f64>() / count;
    let squares: f64 = patterns.iter().map(|p| (p[k] - mean) * (p[k] - mean)).sum();
    (mean, libm::sqrt(squares / count))
}
