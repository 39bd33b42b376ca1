//! Figures of how well a scanner measures, in the manner of VDI/VDE 2634.
//!
//! Part 2 of the guideline (Optical 3-D measuring systems, systems with area scanning, 2012; part 3
//! has the same for several views) has four: probing error of form PF and of size PS on a sphere,
//! sphere-spacing error SD on two, flatness measurement error F on a plate. It takes the best
//! sphere or plane by least squares, and lets 3 of 1000 samples be left out. So it is done here:
//! the samples are those of all rays that meet the cap ([`cap`]), strays and all; the 3 of 1000
//! that lie farthest off a fit that strays have no part in are left out, and the least-squares fit
//! of the rest is what is told. A scan with more strays than that has the figures that it deserves.
//!
//! The guideline asks for certain artefacts, at ten places in the measuring volume for PF and PS,
//! seven for SD and six for F, and for stated conditions. What scans do not show is not judged.

use nalgebra::Vector3;

use crate::scan::Placed;
use crate::sphere::{self, SphereFit, cap};
use crate::steps::{self, Steps};

/// Share of the samples that may be left out.
pub const LEFT_OUT_MOST: f64 = 0.003;
/// Columns and samples at the rim of a plate that are not judged.
const RIM: usize = 3;
/// Plain least-squares rounds.
const ROUNDS: usize = 20;

/// Figures of a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereFigures {
    /// Its centre, millimetres.
    pub centre_mm: [f64; 3],
    /// Its diameter by least squares, millimetres.
    pub diameter_mm: f64,
    /// Standard uncertainty of the diameter from the samples' scatter, millimetres.
    pub diameter_uncertainty_mm: f64,
    /// Range of the samples' distances from it: the probing error of form PF, millimetres.
    pub form_mm: f64,
    /// Their standard deviation, strays left out, millimetres.
    pub deviation_mm: f64,
    /// Samples on its cap.
    pub samples: usize,
    /// Samples left out.
    pub left_out: usize,
}

/// Figures of a plate.
#[derive(Debug, Clone, PartialEq)]
pub struct PlateFigures {
    /// Its unit normal, towards the camera.
    pub normal: [f64; 3],
    /// Range of the samples' distances from the best plane: the flatness error F, millimetres.
    pub flatness_mm: f64,
    /// Their standard deviation, strays left out, millimetres.
    pub deviation_mm: f64,
    /// Samples judged.
    pub samples: usize,
    /// Samples left out.
    pub left_out: usize,
}

/// Figures of a step gauge.
#[derive(Debug, Clone, PartialEq)]
pub struct StepFigures {
    /// Measured less known height against the first that is seen, for each height, millimetres.
    pub errors_mm: Vec<Option<f64>>,
    /// Standard deviation of the samples' distances, strays left out, millimetres.
    pub deviation_mm: f64,
    /// Samples judged.
    pub samples: usize,
}

/// The figures of a sphere found in a scan; `None` where its samples tell no sphere.
#[must_use]
pub fn sphere(placed: &Placed, found: &SphereFit) -> Option<SphereFigures> {
    let near_mm = Vector3::from(found.centre_mm);
    let cap = cap(placed, near_mm, found.diameter_mm);
    let all: Vec<Vector3<f64>> = cap.iter().map(|own| own.point_mm).collect();
    let robust = sphere::fit(&cap, near_mm, found.diameter_mm, false)?;
    let (kept, left_out) = without_strays(&all, |point| robust.distance_mm(*point));
    let plain = least_squares(&kept, &robust)?;
    let off = kept.iter().map(|point| plain.distance_mm(*point));
    Some(SphereFigures {
        centre_mm: plain.centre_mm,
        diameter_mm: plain.diameter_mm,
        diameter_uncertainty_mm: robust.diameter_uncertainty_mm(),
        form_mm: range(off),
        deviation_mm: robust.deviation_mm,
        samples: all.len(),
        left_out,
    })
}

/// The figures of a plate found in a scan with the one height 0.
///
/// Judged are the samples between its borders in each column, strays and all, without
/// three samples and columns at the rim.
#[must_use]
pub fn plate(placed: &Placed, found: &Steps) -> Option<PlateFigures> {
    let near_mm = 8.0 * found.deviation_mm;
    let off = |point: &Vector3<f64>| found.normal.dot(point) - found.offset_mm;
    let mut columns = Vec::new();
    for column in &placed.columns {
        let on = |(_, point): &(crate::RawSample, Vector3<f64>)| off(point).abs() < near_mm;
        let (Some(first), Some(last)) = (column.iter().position(on), column.iter().rposition(on))
        else {
            continue;
        };
        if let Some(own) = column.get(first + RIM..(last + 1).saturating_sub(RIM)) {
            columns.push(own);
        }
    }
    let inner = columns.get(RIM..columns.len().saturating_sub(RIM))?;
    let all: Vec<Vector3<f64>> = inner.iter().copied().flatten().map(|&(_, p)| p).collect();
    let (kept, left_out) = without_strays(&all, off);
    let plane = plain_plane(&kept)?;
    Some(PlateFigures {
        normal: plane.into(),
        flatness_mm: range(kept.iter().map(|point| plane.dot(point))),
        deviation_mm: found.deviation_mm,
        samples: all.len(),
        left_out,
    })
}

/// The figures of a step gauge found in a scan.
#[must_use]
pub fn step_gauge(found: &Steps, heights_mm: &[f64]) -> Option<StepFigures> {
    let points: Vec<_> = found
        .samples
        .iter()
        .map(|on| (on.point_mm, on.step))
        .collect();
    let planes = steps::parallel(&points, heights_mm.len(), found.normal)?;
    Some(StepFigures {
        errors_mm: steps::errors_mm(&planes.levels_mm, heights_mm),
        deviation_mm: planes.deviation_mm,
        samples: points.len(),
    })
}

/// The points without the 3 of 1000 that lie farthest off, and how many those are.
fn without_strays(
    all: &[Vector3<f64>],
    off: impl Fn(&Vector3<f64>) -> f64,
) -> (Vec<Vector3<f64>>, usize) {
    let mut by_size: Vec<(f64, Vector3<f64>)> = all.iter().map(|p| (off(p).abs(), *p)).collect();
    by_size.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let left_out = (LEFT_OUT_MOST * all.len() as f64) as usize;
    by_size.truncate(all.len() - left_out);
    (
        by_size.into_iter().map(|(_, point)| point).collect(),
        left_out,
    )
}

fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low <= high { high - low } else { f64::NAN }
}

/// The sphere by plain least squares of the orthogonal distances.
fn least_squares(points: &[Vector3<f64>], near: &SphereFit) -> Option<SphereFit> {
    let mut centre = Vector3::from(near.centre_mm);
    let mut radius = near.diameter_mm / 2.0;
    for _ in 0..ROUNDS {
        let mut matrix = nalgebra::Matrix4::zeros();
        let mut right = nalgebra::Vector4::zeros();
        for point in points {
            let from = point - centre;
            let length = from.norm().max(f64::MIN_POSITIVE);
            let slope = -(from / length).push(1.0);
            matrix += slope * slope.transpose();
            right -= slope * (length - radius);
        }
        let step = matrix.cholesky()?.solve(&right);
        centre += step.xyz();
        radius += step.w;
        if step.norm() < 1e-11 {
            break;
        }
    }
    (radius > 0.0 && radius.is_finite()).then(|| SphereFit {
        centre_mm: centre.into(),
        diameter_mm: 2.0 * radius,
        ..near.clone()
    })
}

/// Unit normal of the plane of least squares, towards the camera.
fn plain_plane(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    if points.len() < 3 {
        return None;
    }
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut spread = nalgebra::Matrix3::zeros();
    for point in points {
        let from = point - middle;
        spread += from * from.transpose();
    }
    let eigen = spread.symmetric_eigen();
    let (least, _) = eigen.eigenvalues.argmin();
    let normal = eigen.eigenvectors.column(least).into_owned();
    Some(if normal.z >= 0.0 { normal } else { -normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_of_a_thousand_are_left_out_and_no_more() {
        let points: Vec<_> = (0..1000)
            .map(|k| Vector3::new(f64::from(k), 0.0, if k % 250 == 0 { 9.0 } else { 0.1 }))
            .collect();
        let (kept, left_out) = without_strays(&points, |p| p.z);
        assert_eq!((kept.len(), left_out), (997, 3));
        assert!((range(kept.iter().map(|p| p.z)) - 8.9).abs() < 1e-12);
    }

    #[test]
    fn the_plane_of_least_squares_is_exact_for_exact_points() {
        let normal = Vector3::new(0.2, -0.1, 1.0).normalize();
        let points: Vec<_> = (0..100)
            .map(|k| {
                let (x, y) = (f64::from(k % 10), f64::from(k / 10));
                Vector3::new(x, y, (3.0 - normal.x * x - normal.y * y) / normal.z)
            })
            .collect();
        let plane = plain_plane(&points).unwrap();
        assert!((plane - normal).norm() < 1e-12);
        assert!(range(points.iter().map(|p| plane.dot(p))) < 1e-12);
    }
}
