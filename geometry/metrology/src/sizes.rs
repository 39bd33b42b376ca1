//! What references measure with a calibration.

use range_image::Calibration;

use crate::calibrate::Size;
use crate::measured::Reference;
use crate::scan::Ray;
use crate::sphere::{self, Sighted};
use crate::steps;

/// How many samples are on a reference.
pub(crate) fn samples(reference: &Reference) -> usize {
    match reference {
        Reference::Sphere { samples, .. } => samples.len(),
        Reference::Steps { samples, .. } => samples.len(),
    }
}

/// What each reference measures with this calibration.
pub(crate) fn measured(calibration: &Calibration, references: &[Reference]) -> Vec<Size> {
    let at = |raw| crate::scan::position_mm(calibration, raw);
    references
        .iter()
        .map(|reference| match reference {
            Reference::Sphere {
                centre_mm,
                radius_mm,
                samples,
                ..
            } => {
                let sighted = |raw| Sighted {
                    raw,
                    point_mm: at(raw),
                    ray: Ray::of(calibration, raw),
                };
                let points: Vec<_> = samples.iter().map(|&raw| sighted(raw)).collect();
                let fit = sphere::fit(&points, *centre_mm, 2.0 * radius_mm, false);
                let (error_mm, uncertainty_mm) = fit.map_or((f64::NAN, f64::NAN), |fit| {
                    (
                        fit.diameter_mm - 2.0 * radius_mm,
                        fit.diameter_uncertainty_mm(),
                    )
                });
                Size::Sphere {
                    centre_mm: (*centre_mm).into(),
                    error_mm: [error_mm; 2],
                    uncertainty_mm,
                }
            }
            Reference::Steps {
                normal, samples, ..
            } => {
                let mut known: Vec<f64> = samples.iter().map(|&(_, height)| height).collect();
                known.sort_by(f64::total_cmp);
                known.dedup();
                let step = |height: f64| known.partition_point(|own| *own < height);
                let points: Vec<_> = samples.iter().map(|&(raw, h)| (at(raw), step(h))).collect();
                let levels = steps::parallel(&points, known.len(), *normal)
                    .map_or_else(Vec::new, |found| found.levels_mm);
                let errors = steps::errors_mm(&levels, &known);
                let heights = errors.iter().flatten().count();
                let error_mm = errors
                    .into_iter()
                    .flatten()
                    .max_by(|a, b| a.abs().total_cmp(&b.abs()))
                    .unwrap_or(f64::NAN);
                Size::Steps {
                    heights,
                    error_mm: [error_mm; 2],
                }
            }
        })
        .collect()
}

/// A size without the correction, and with it.
pub(crate) fn both(before: &Size, after: Size) -> Size {
    match (before, after) {
        (
            Size::Sphere {
                error_mm: [before, _],
                ..
            },
            Size::Sphere {
                centre_mm,
                error_mm: [_, after],
                uncertainty_mm,
            },
        ) => Size::Sphere {
            centre_mm,
            error_mm: [*before, after],
            uncertainty_mm,
        },
        (
            Size::Steps {
                error_mm: [before, _],
                ..
            },
            Size::Steps {
                heights,
                error_mm: [_, after],
            },
        ) => Size::Steps {
            heights,
            error_mm: [*before, after],
        },
        // Both lists are of the same references.
        (_, after) => after,
    }
}
