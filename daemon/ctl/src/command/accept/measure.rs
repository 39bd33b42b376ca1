//! What each scan shows.

use deliverables::acceptance::{AcceptedScan, SphereReport};
use metrology::{Scan, figures, find, steps};

use super::reference::Reference;
use crate::failure::Failure;
use crate::raw_scan::RawScan;

/// The references in a scan; `scan` is it with the correction that is judged.
pub(super) fn measured(
    own: &RawScan,
    scan: &Scan,
    reference: &Reference,
    warnings: &mut Vec<String>,
) -> Result<AcceptedScan, Failure> {
    let placed = scan.placed();
    let mut told = AcceptedScan {
        scan: own.name.clone(),
        started_at: own.started_at.map(|time| time.to_string()),
        spheres: Vec::new(),
        sphere_spacing_error_mm: None,
        flatness_mm: None,
        step_errors_mm: Vec::new(),
    };
    if let Some(diameter_mm) = reference.sphere_diameter_mm {
        for found in find::spheres(&placed, diameter_mm) {
            if !found.is_whole {
                warnings.push(format!(
                    "{}: a sphere is not seen on all sides and was left out",
                    own.name
                ));
                continue;
            }
            let Some(figures) = figures::sphere(&placed, &found.fit) else {
                continue;
            };
            told.spheres.push(SphereReport {
                centre_mm: figures.centre_mm,
                size_error_mm: figures.diameter_mm - diameter_mm,
                size_uncertainty_mm: figures.diameter_uncertainty_mm,
                form_mm: figures.form_mm,
                deviation_mm: figures.deviation_mm,
                samples: figures.samples,
                left_out: figures.left_out,
            });
        }
        if let Some(spacing_mm) = reference.sphere_spacing_mm {
            match told.spheres.as_slice() {
                [a, b] => {
                    told.sphere_spacing_error_mm =
                        Some(distance_mm(a.centre_mm, b.centre_mm) - spacing_mm);
                }
                [] => {}
                others => warnings.push(format!(
                    "{}: {} spheres are seen, so that no distance of two was judged",
                    own.name,
                    others.len()
                )),
            }
        }
    }
    if told.spheres.is_empty()
        && let Some(heights_mm) = &reference.step_heights_mm
        && let Some(found) = steps::find(&placed, heights_mm)
        && let Some(figures) = figures::step_gauge(&found, heights_mm)
    {
        told.step_errors_mm = figures.errors_mm;
    }
    if told.spheres.is_empty()
        && told.step_errors_mm.is_empty()
        && reference.plate
        && let Some(found) = steps::find(&placed, &[0.0])
        && let Some(figures) = figures::plate(&placed, &found)
    {
        told.flatness_mm = Some(figures.flatness_mm);
    }
    if told.spheres.is_empty() && told.step_errors_mm.is_empty() && told.flatness_mm.is_none() {
        return Err(Failure::Failed(format!(
            "{}: nothing of the reference is seen; check the sizes in its file, and that the scan \
             shows the whole of it, in front of all else",
            own.name
        )));
    }
    Ok(told)
}

pub(super) fn distance_mm(a: [f64; 3], b: [f64; 3]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    squares.sqrt()
}
