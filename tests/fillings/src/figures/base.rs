//! One base surface for all holes of an open sheet (Yoo, sections 3.1 and 3.2).

use std::collections::HashSet;

use anyhow::{Context, Result};
use fill::{FitSettings, Implicit, Kernel, Sample, Solver, TriangleMesh};
use glam::DVec3;

use crate::common::grid;

/// Off the surface is a point at each how many-th vertex. The paper has one of them in all, which leaves
/// a sheet's other side to chance.
const EVERY: usize = 3;

/// The base surface, and what it was put through.
pub(crate) struct Base {
    /// Points where the function is zero, all vertices, and points where it is not.
    pub(crate) zeros: usize,
    pub(crate) others: usize,
    /// Farthest that a vertex lies off, millimetres.
    pub(crate) off_mm: f64,
    /// Largest angle at a vertex between the surface's normal and the triangles' mean.
    pub(crate) turned_deg: f64,
    /// Points on it, thrown along the mean normal onto it.
    pub(crate) drawn: TriangleMesh,
}

/// Puts the paper's function through all vertices at once, by elimination with pivots; what is drawn is
/// of this size around the middle.
pub(crate) fn base(
    mesh: &TriangleMesh,
    middle_mm: DVec3,
    size_mm: [f64; 2],
    cells: [u32; 2],
) -> Result<Base> {
    let at = |v: u32| DVec3::from_array(mesh.vertices_mm[v as usize]);
    let mut normals = vec![DVec3::ZERO; mesh.vertices_mm.len()];
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(at);
        for v in triangle {
            normals[v as usize] += (b - a).cross(c - a);
        }
    }
    let samples: Vec<Sample> = mesh
        .vertices_mm
        .iter()
        .zip(&normals)
        .map(|(place, normal)| Sample {
            place_mm: DVec3::from_array(*place),
            normal: normal.normalize_or_zero(),
            reach_mm: 0.0,
        })
        .collect();
    let settings = FitSettings {
        kernel: Kernel::ThinPlate,
        solver: Solver::Elimination,
        every: EVERY,
        ..FitSettings::default()
    };
    let implicit = Implicit::fit(&samples, size_mm[0], &settings)?;
    let (mut off_mm, mut turned) = (0.0_f64, 1.0_f64);
    for sample in &samples {
        let (value, slope) = implicit.at(sample.place_mm);
        off_mm = off_mm.max((value / slope.length()).abs());
        turned = turned.min(slope.normalize_or_zero().dot(sample.normal));
    }
    let normal: DVec3 = samples.iter().map(|own| own.normal).sum();
    let normal = normal.normalize_or_zero();
    let right = (DVec3::X - DVec3::X.dot(normal) * normal).normalize_or_zero();
    let up = normal.cross(right);
    let mut missed = HashSet::new();
    let mut drawn = grid(cells[0], cells[1], [false, false], |u, v| {
        let [x, y] = [(0, u), (1, v)].map(|(k, t)| size_mm[k] * (t - 0.5));
        let flat = middle_mm + x * right + y * up;
        // From the height of the nearest vertex, which is near the surface's.
        let apart = |own: &&Sample| {
            let arm = own.place_mm - flat;
            arm.length_squared() - arm.dot(normal) * arm.dot(normal)
        };
        let near = samples.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let height = near.map_or(0.0, |own| normal.dot(own.place_mm - flat));
        let found = implicit.along(flat + height * normal, normal, size_mm[0]);
        found.unwrap_or(DVec3::NAN)
    });
    for (k, place) in drawn.vertices_mm.iter().enumerate() {
        if place[0].is_nan() {
            missed.insert(k as u32);
        }
    }
    drawn
        .triangles
        .retain(|own| !own.iter().any(|v| missed.contains(v)));
    let others = implicit
        .centres()
        .checked_sub(samples.len())
        .context("points were left out")?;
    Ok(Base {
        zeros: samples.len(),
        others,
        off_mm,
        turned_deg: libm::acos(turned.clamp(-1.0, 1.0)).to_degrees(),
        drawn,
    })
}
