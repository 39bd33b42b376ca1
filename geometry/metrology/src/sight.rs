//! References found in scans, and which samples are theirs.

use nalgebra::Vector3;
use range_image::Calibration;

use crate::calibrate::{CalibrateError, Place, References};
use crate::deviations::Deviations;
use crate::find;
use crate::measured::Reference;
use crate::scan::{Placed, Scan};
use crate::sphere::cap;
use crate::steps::{self, Steps};

/// Spheres whose centres are nearer than this share of the diameter are at one place.
const ONE_PLACE: f64 = 0.5;
/// A sphere is taken for that at a known place if it is no farther off, millimetres.
const PLACE_REACH_MM: f64 = 30.0;

/// A reference before it is measured: in which scan, and what it is.
pub(crate) struct Sighting {
    pub(crate) scan: usize,
    pub(crate) reference: Reference,
}

/// The references in the scans, and the scans with spheres that are cut off.
pub(crate) fn sighted(
    scans: &[Scan],
    references: &References,
    announced: &Calibration,
) -> Result<(Vec<Sighting>, Vec<usize>), CalibrateError> {
    let mut sightings = Vec::new();
    let mut cut_off = Vec::new();
    for (scan, own) in scans.iter().enumerate() {
        if own.calibration.as_announced() != *announced {
            return Err(CalibrateError::OtherCalibration { scan });
        }
        let placed = announced_only(own).placed();
        let before = sightings.len();
        let mut is_cut_off = false;
        for found in references
            .sphere_diameter_mm
            .iter()
            .flat_map(|&diameter_mm| find::spheres(&placed, diameter_mm))
        {
            if !found.is_whole {
                is_cut_off = true;
                continue;
            }
            let centre_mm = Vector3::from(found.fit.centre_mm);
            sightings.push(Sighting {
                scan,
                reference: Reference::Sphere {
                    centre_mm,
                    radius_mm: found.fit.diameter_mm / 2.0,
                    place: known_place(scan, centre_mm, &references.places)?,
                    samples: found.cap.iter().map(|own| own.raw).collect(),
                },
            });
        }
        if is_cut_off {
            cut_off.push(scan);
        }
        if sightings.len() == before
            && let Some(heights_mm) = &references.step_heights_mm
            && let Some(steps) = steps::find(&placed, heights_mm)
        {
            sightings.push(Sighting {
                scan,
                reference: gauge(&steps, heights_mm),
            });
        }
        if sightings.len() == before {
            return Err(if is_cut_off {
                CalibrateError::CutOff { scan }
            } else {
                CalibrateError::NothingSeen { scan }
            });
        }
    }
    Ok((sightings, cut_off))
}

fn announced_only(scan: &Scan) -> Scan {
    Scan {
        calibration: scan.calibration.as_announced(),
        columns: scan.columns.clone(),
    }
}

fn gauge(steps: &Steps, heights_mm: &[f64]) -> Reference {
    let count = steps.samples.len().max(1) as f64;
    let middle_mm = steps
        .samples
        .iter()
        .map(|on| on.point_mm)
        .sum::<Vector3<f64>>()
        / count;
    Reference::Steps {
        normal: steps.normal,
        offset_mm: steps.offset_mm,
        middle_mm,
        samples: steps
            .samples
            .iter()
            .filter_map(|on| Some((on.raw, heights_mm.get(on.step).copied()?)))
            .collect(),
    }
}

/// The known place that a sphere is at: the nearest, if no other is nearly as near.
fn known_place(
    scan: usize,
    centre_mm: Vector3<f64>,
    places: &[Place],
) -> Result<Option<(Vector3<f64>, f64)>, CalibrateError> {
    if places.is_empty() {
        return Ok(None);
    }
    let mut by_distance: Vec<(f64, &Place)> = places
        .iter()
        .map(|place| ((Vector3::from(place.at_mm) - centre_mm).norm(), place))
        .collect();
    by_distance.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let unclear = CalibrateError::NoPlace {
        scan,
        at_mm: centre_mm.into(),
    };
    match by_distance.as_slice() {
        [(near, place), rest @ ..] if *near <= PLACE_REACH_MM => {
            if rest.first().is_some_and(|(next, _)| *next < 1.5 * near) {
                return Err(unclear);
            }
            Ok(Some((Vector3::from(place.at_mm), place.uncertainty_mm)))
        }
        _ => Err(unclear),
    }
}

/// At how many places spheres were seen.
pub(crate) fn places(sightings: &[Sighting]) -> usize {
    let mut apart: Vec<Vector3<f64>> = Vec::new();
    for sighting in sightings {
        if let Reference::Sphere {
            centre_mm,
            radius_mm,
            ..
        } = sighting.reference
            && apart
                .iter()
                .all(|other| (other - centre_mm).norm() > ONE_PLACE * 2.0 * radius_mm)
        {
            apart.push(centre_mm);
        }
    }
    apart.len()
}

/// Takes the samples that lie on the caps once corrected, and the places found so far.
pub(crate) fn recapped(
    scans: &[Scan],
    announced: &Calibration,
    deviations: &Deviations,
    sightings: &mut [Sighting],
    solved: &[Reference],
) {
    let calibration = Calibration {
        correction: Some(deviations.correction()),
        ..*announced
    };
    let mut placed: Option<(usize, Placed)> = None;
    for (sighting, solved) in sightings.iter_mut().zip(solved) {
        let Some(scan) = scans.get(sighting.scan) else {
            continue;
        };
        if placed
            .as_ref()
            .is_none_or(|(index, _)| *index != sighting.scan)
        {
            let corrected = Scan {
                calibration,
                columns: scan.columns.clone(),
            };
            placed = Some((sighting.scan, corrected.placed()));
        }
        sighting.reference = solved.clone();
        if let Some((_, placed)) = &placed
            && let Reference::Sphere {
                centre_mm,
                radius_mm,
                samples,
                ..
            } = &mut sighting.reference
        {
            *samples = cap(placed, *centre_mm, 2.0 * *radius_mm)
                .into_iter()
                .map(|own| own.raw)
                .collect();
        }
    }
}
