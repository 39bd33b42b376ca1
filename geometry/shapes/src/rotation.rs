//! The axis about which a surface is one of revolution, from its normals.
//!
//! The normals of a surface of revolution all meet its axis. In Pluecker coordinates that is
//! one linear equation for each normal, so the axis is the vector that meets them best
//! (Pottmann and Randrup 1998, "Rotational and helical surface approximation for reverse
//! engineering").

use nalgebra::{SMatrix, SVector, SymmetricEigen, Vector3};

use crate::fit::Sample;
use crate::local::Local;
use crate::robust;
use crate::shape::Family;
use crate::start::Frame;

/// Cells on each side of the samples' extent, each of which gives a normal: as many as leave
/// so many samples to each.
const CELLS: [usize; 2] = [3, 8];
const PER_CELL: f64 = 20.0;
/// Fewest samples that give one.
const LEAST: usize = 6;
/// Length of the axis's part of the solution below which there is none.
const LEAST_AXIS: f64 = 1e-3;

/// A torus through the samples about the axis that their normals meet.
pub(crate) fn torus(samples: &[Sample], frame: &Frame) -> Option<Local> {
    let (origin, axis) = axis(samples, frame)?;
    // The circle through distances off the axis and heights along it, by algebraic least
    // squares.
    let circle = |sample: &Sample| {
        let (out, up) = about(&sample.point_mm, &origin, &axis);
        (Vector3::new(2.0 * out, 2.0 * up, 1.0), out * out + up * up)
    };
    let equations: Vec<_> = samples.iter().map(circle).collect();
    let (solved, _) = robust::solve(&equations)?;
    let (radius, height) = (solved[0], solved[1]);
    let tube = (solved[2] + radius * radius + height * height).sqrt();
    let distance2 = |s: &&Sample| (s.point_mm - frame.middle).norm_squared();
    let nearest = samples
        .iter()
        .min_by(|a, b| distance2(a).total_cmp(&distance2(b)))?;
    let foot = origin + axis * (nearest.point_mm - origin).dot(&axis);
    let out = (nearest.point_mm - foot).normalize();
    let centre = origin + axis * height + out * radius;
    let outwards = (nearest.point_mm - centre).normalize();
    let side = outwards.dot(&frame.normal).signum();
    let normal = outwards * side;
    let angle = libm::atan2(normal.dot(&axis), normal.dot(&out));
    let (sin, cos) = libm::sincos(angle);
    let local = Local {
        family: Family::Torus,
        place: centre + outwards * tube,
        normal,
        along: axis * cos - out * sin,
        numbers: [1.0 / radius, angle, side / tube],
    };
    let is_finite = local.numbers.iter().all(|n| n.is_finite()) && local.along.norm() > 0.5;
    is_finite.then(|| local.moved(&Default::default()))
}

/// How far off the axis a point is, and how far along it.
fn about(point: &Vector3<f64>, origin: &Vector3<f64>, axis: &Vector3<f64>) -> (f64, f64) {
    let from = point - origin;
    let up = from.dot(axis);
    ((from - axis * up).norm(), up)
}

/// A point of the axis, and its direction.
fn axis(samples: &[Sample], frame: &Frame) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mut matrix = SMatrix::<f64, 6, 6>::zeros();
    for (point, normal) in normals(samples, frame) {
        let point = (point - frame.middle) / frame.reach;
        let moment = point.cross(&normal);
        let row = SVector::<f64, 6>::from_fn(|k, _| if k < 3 { normal[k] } else { moment[k - 3] });
        matrix += row * row.transpose();
    }
    let eigen = SymmetricEigen::new(matrix);
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let (moment, direction) = (
        Vector3::new(least[0], least[1], least[2]),
        Vector3::new(least[3], least[4], least[5]),
    );
    let length2 = direction.norm_squared();
    if length2 < LEAST_AXIS * LEAST_AXIS {
        return None;
    }
    // What is left along the direction would be a screw's pitch.
    let foot = direction.cross(&moment) / length2;
    Some((
        frame.middle + foot * frame.reach,
        direction / length2.sqrt(),
    ))
}

/// Points and normals of the planes through the samples in each cell.
fn normals(samples: &[Sample], frame: &Frame) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let side = (samples.len() as f64 / PER_CELL).sqrt() as usize;
    let side = side.clamp(CELLS[0], CELLS[1]);
    let mut cells: Vec<Vec<(Vector3<f64>, f64)>> = vec![Vec::new(); side * side];
    let places: Vec<[f64; 3]> = samples
        .iter()
        .map(|s| frame.coordinates(&s.point_mm))
        .collect();
    let range = |k: usize| {
        let values = places.iter().map(|p| p[k]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        })
    };
    let (along, across) = (range(0), range(1));
    let cell = |value: f64, (low, high): (f64, f64)| {
        let share = (value - low) / (high - low).max(f64::MIN_POSITIVE);
        ((share * side as f64) as usize).min(side - 1)
    };
    for &[u, v, w] in &places {
        cells[cell(u, along) * side + cell(v, across)].push((Vector3::new(u, v, 1.0), w));
    }
    let enough = cells.iter().filter(|cell| cell.len() >= LEAST);
    enough
        .filter_map(|cell| {
            let (plane, _) = robust::solve(cell)?;
            let normal = frame.normal - frame.along * plane[0] - frame.across * plane[1];
            let middle = cell.iter().map(|(terms, _)| *terms).sum::<Vector3<f64>>();
            let middle = middle / cell.len() as f64;
            let on_plane = frame.middle
                + frame.along * middle.x
                + frame.across * middle.y
                + frame.normal * plane.dot(&middle);
            Some((on_plane, normal.normalize()))
        })
        .collect()
}
