//! What each region's samples say of its surface.

use range_image::Column;
use rayon::prelude::*;

use super::{NONE, OUTSIDE};
use crate::field::Field;
use crate::plane::{Plane, plane};

/// The surface of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Its nodes.
    pub nodes: usize,
    /// The plane through its samples, that of the nodes where samples are too few.
    pub plane: Plane,
    /// Whether the samples stray from the plane as the noise lets them, and not more.
    pub is_plane: bool,
    /// Median slope of the nodes against the image plane, radians.
    pub slope_rad: f64,
}

impl Surface {
    /// Whether the samples that agree with the plane stray as the noise lets them.
    pub(super) fn lies_flat(&self, noise_mm: f64) -> bool {
        self.plane.rms_mm <= NOISES * noise_mm + 1e-6
    }
}

/// Samples within so many nodes of another region are not asked.
const MARGIN: usize = 2;
/// A region is a plane where its samples stray by no more than this times the noise ...
const NOISES: f64 = 1.25;
/// ... and so many of them agree with it.
const SHARE: f64 = 0.8;
/// Fewest samples that speak for themselves.
const FEWEST: usize = 12;

/// The surfaces of the regions 1 to `count`, and the table's plane.
pub(super) fn surfaces(
    field: &Field,
    columns: &[Column],
    labels: &[u16],
    count: usize,
) -> (Vec<Surface>, Option<Plane>) {
    let image = &field.image;
    let rows = image.rows();
    let (i_first, j_first) = image.origin();
    let pitch = image.pitch_mm();
    let mut inner: Vec<Vec<[f64; 3]>> = vec![Vec::new(); count + 1];
    let is_inner: Vec<bool> = (0..labels.len())
        .into_par_iter()
        .map(|node| is_inside(labels, rows, node))
        .collect();
    for (column, kept) in columns.iter().zip(&field.supported) {
        let i = (column.x_mm() / pitch).round() as i64 - i_first;
        let Ok(i) = usize::try_from(i) else { continue };
        if i >= image.columns() {
            continue;
        }
        for (sample, _) in column.samples().iter().zip(kept).filter(|(_, k)| **k) {
            let j = (sample.y_mm / pitch).round() as i64 - j_first;
            let Ok(j) = usize::try_from(j) else { continue };
            if j < rows && is_inner[i * rows + j] {
                let label = usize::from(labels[i * rows + j]);
                inner[label].push([column.x_mm(), sample.y_mm, sample.z_mm]);
            }
        }
    }
    let mut nodes: Vec<Vec<[f64; 3]>> = vec![Vec::new(); count + 1];
    let mut slopes: Vec<Vec<f64>> = vec![Vec::new(); count + 1];
    let z = image.raw_z_mm();
    for (node, &label) in labels.iter().enumerate() {
        if label == NONE || z[node].is_nan() {
            continue;
        }
        let label = usize::from(label);
        let (column, row) = (node / rows, node % rows);
        nodes[label].push([image.x_mm(column), image.y_mm(row), z[node]]);
        let along = |step: usize, fits: bool| {
            let same = fits && labels[node + step] == labels[node] && !z[node + step].is_nan();
            same.then(|| (z[node + step] - z[node]) / (step_count(step, rows) * pitch))
        };
        let across = along(2 * rows, column + 2 < image.columns());
        if let (Some(a), Some(b)) = (across, along(2, row + 2 < rows)) {
            slopes[label].push(libm::atan((a * a + b * b).sqrt()));
        }
    }
    let of = |label: usize| {
        let own = if inner[label].len() >= FEWEST {
            &inner[label]
        } else {
            &nodes[label]
        };
        plane(own, field.noise_mm)
    };
    let surfaces = (1..=count)
        .map(|label| {
            let fitted = of(label).unwrap_or_else(|| level(&nodes[label], field.noise_mm));
            Surface {
                nodes: nodes[label].len(),
                is_plane: fitted.rms_mm <= NOISES * field.noise_mm + 1e-6 && fitted.share >= SHARE,
                plane: fitted,
                slope_rad: crate::field::median(&mut slopes[label]).unwrap_or(0.0),
            }
        })
        .collect();
    (surfaces, of(usize::from(OUTSIDE)))
}

fn step_count(step: usize, rows: usize) -> f64 {
    if step >= rows && step.is_multiple_of(rows) {
        (step / rows) as f64
    } else {
        step as f64
    }
}

/// A level plane at the nodes' median, of regions too small for more.
fn level(nodes: &[[f64; 3]], noise_mm: f64) -> Plane {
    let mut heights: Vec<f64> = nodes.iter().map(|n| n[2]).collect();
    let z_mm = crate::field::median(&mut heights).unwrap_or(0.0);
    let count = nodes.len().max(1) as f64;
    let middle_mm = [0, 1].map(|axis| nodes.iter().map(|n| n[axis]).sum::<f64>() / count);
    let mut covariance = nalgebra::Matrix3::zeros();
    covariance[(0, 0)] = noise_mm * noise_mm;
    Plane {
        middle_mm,
        values: nalgebra::Vector3::new(z_mm, 0.0, 0.0),
        covariance,
        rms_mm: noise_mm,
        samples: nodes.len(),
        share: 1.0,
    }
}

/// Whether all nodes within the margin along columns and rows have the same label.
fn is_inside(labels: &[u16], rows: usize, node: usize) -> bool {
    let own = labels[node];
    if own == NONE {
        return false;
    }
    let (column, row) = (node / rows, node % rows);
    let columns = labels.len() / rows;
    (1..=MARGIN).all(|k| {
        (column < k || labels[node - k * rows] == own)
            && (column + k >= columns || labels[node + k * rows] == own)
            && (row < k || labels[node - k] == own)
            && (row + k >= rows || labels[node + k] == own)
    })
}
