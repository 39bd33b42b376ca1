//! Fillings held against their surfaces.

use std::collections::HashSet;
use std::time::Instant;

use anyhow::Result;
use fill::{Filled, Kernel, Method, Outcome, Settings, fill};
use glam::DVec3;
use range_image::Unmonitored;

use crate::common::{Shape, noisy, with_hole_by};

/// A hole to be cut and filled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case {
    pub(crate) shape: Shape,
    pub(crate) share: f64,
    pub(crate) seed: u64,
    pub(crate) noise_mm: f64,
}

/// What fillings come to.
#[derive(Debug, Default)]
pub(crate) struct Score {
    /// Of the hole's diameter.
    pub(crate) rms: f64,
    pub(crate) largest: f64,
    pub(crate) rms_mm: f64,
    /// Root mean square of the worst hole.
    pub(crate) worst_mm: f64,
    pub(crate) border_deg: f64,
    pub(crate) told_mm: f64,
    pub(crate) time_s: f64,
    pub(crate) open: usize,
}

/// Edges of meshes: a twentieth of the hole, within what these sizes of holes leave sensible.
fn edge_mm(case: &Case) -> f64 {
    (case.share * case.shape.size() / 20.0).clamp(0.5, 1.5)
}

pub(crate) fn score(cases: &[Case], method: Method, kernel: Option<Kernel>) -> Result<Score> {
    let mut score = Score::default();
    let (mut squares, mut shares, mut count) = (0.0, 0.0, 0.0_f64);
    for case in cases {
        let (mut mesh, across) = with_hole_by(case.shape, edge_mm(case), case.share, case.seed);
        if case.noise_mm > 0.0 {
            noisy(&mut mesh, case.shape, case.noise_mm, case.seed + 1000);
        }
        let settings = Settings {
            method,
            kernel,
            ..Settings::default()
        };
        let begun = Instant::now();
        let own = fill(mesh, &settings, &Unmonitored)?;
        score.time_s += begun.elapsed().as_secs_f64() / cases.len() as f64;
        score.open += own.open().len();
        for hole in &own.holes {
            if let Outcome::Filled { noise_mm, .. } = hole.outcome {
                score.told_mm += noise_mm / cases.len() as f64;
            }
        }
        let offs = offs(&own, case.shape);
        let own_squares: f64 = offs.iter().map(|o| o * o).sum();
        squares += own_squares;
        shares += own_squares / (across * across);
        count += offs.len() as f64;
        let largest = offs.iter().fold(0.0_f64, |m, o| m.max(o.abs()));
        score.largest = score.largest.max(largest / across);
        score.worst_mm = score
            .worst_mm
            .max((own_squares / offs.len().max(1) as f64).sqrt());
        score.border_deg = score.border_deg.max(border_deg(&own, case.shape));
    }
    score.rms = (shares / count.max(1.0)).sqrt();
    score.rms_mm = (squares / count.max(1.0)).sqrt();
    Ok(score)
}

fn old_vertices(own: &Filled) -> HashSet<u32> {
    let old = &own.mesh.triangles[..own.old_triangles];
    old.iter().flatten().copied().collect()
}

/// How far new vertices lie off.
fn offs(own: &Filled, shape: Shape) -> Vec<f64> {
    let old = old_vertices(own);
    let new = &own.mesh.triangles[own.old_triangles..];
    let mut vertices: Vec<u32> = new
        .iter()
        .flatten()
        .copied()
        .filter(|v| !old.contains(v))
        .collect();
    vertices.sort_unstable();
    vertices.dedup();
    let off = |v: u32| {
        shape
            .off(DVec3::from_array(own.mesh.vertices_mm[v as usize]))
            .0
    };
    vertices.into_iter().map(off).collect()
}

/// The largest angle of new triangles on the border to the surface.
fn border_deg(own: &Filled, shape: Shape) -> f64 {
    let old = old_vertices(own);
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| DVec3::from_array(own.mesh.vertices_mm[v as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let along = normal.dot(shape.off((a + b + c) / 3.0).1);
        libm::acos(along.clamp(-1.0, 1.0)).to_degrees()
    };
    own.mesh.triangles[own.old_triangles..]
        .iter()
        .filter(|t| t.iter().filter(|v| old.contains(v)).count() >= 2)
        .map(angle)
        .fold(0.0, f64::max)
}
