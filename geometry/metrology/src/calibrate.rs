//! The deviations of a scanner by least squares over the samples of references.
//!
//! A bundle adjustment: the deviations and the places of the references are solved for together,
//! by Gauss-Newton steps on the orthogonal distances of all samples, in which the references'
//! places are eliminated (the Schur complement; Triggs et al., Bundle Adjustment, a Modern
//! Synthesis, 2000, section 6.1). Samples that stray weigh nothing (Tukey). Uncertainties are those
//! of an M-estimate (Huber 1981, section 7.6): of the samples' scatter, and not of the reference's
//! own diameter, by whose share of error all scales are off together.

use nalgebra::Vector3;
use range_image::Calibration;

use crate::deviations::{Deviation, Deviations, UNKNOWNS};
use crate::find;
use crate::linear::{Chosen, choose, covariance, singular_values, step};
use crate::measured::{Normal, Reference, normal};
use crate::scan::{Placed, Ray, Scan};
use crate::sphere::{self, Sighted, cap};
use crate::steps::{self, Steps};

/// Gauss-Newton steps, at most.
const STEPS: usize = 60;
/// It is solved once no unknown moves by more, as a share of what is usual, and no reference by
/// more millimetres.
const STILL: f64 = 1e-6;
/// Fewest places at which spheres must have been seen.
pub const FEWEST_PLACES: usize = 3;
/// Spheres whose centres are nearer than this share of the diameter are at one place.
const ONE_PLACE: f64 = 0.5;
/// A sphere is taken for that at a known place if it is no farther off, millimetres.
const PLACE_REACH_MM: f64 = 30.0;
/// Two unknowns with a greater coefficient of correlation are told.
const CORRELATED: f64 = 0.9;

/// What the scans show.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct References {
    /// Diameter of the spheres, millimetres.
    pub sphere_diameter_mm: Option<f64>,
    /// Known centres of spheres in the part frame; empty where nobody knows them.
    pub places: Vec<Place>,
    /// Heights of a step gauge's faces, towards the camera, millimetres.
    pub step_heights_mm: Option<Vec<f64>>,
}

/// A known place of a sphere's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The centre in the part frame, millimetres.
    pub at_mm: [f64; 3],
    /// Standard uncertainty of each coordinate, millimetres.
    pub uncertainty_mm: f64,
}

/// Scans cannot be calibrated with. Scans are named by their place in the list.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// Nothing to look for.
    #[error("neither a sphere's diameter nor the heights of a step gauge are given")]
    NothingGiven,
    /// A scan shows nothing of what is looked for.
    #[error("no reference is seen in scan {scan}")]
    NothingSeen {
        /// Which scan.
        scan: usize,
    },
    /// The sphere of a scan is seen in part.
    #[error("the sphere in scan {scan} is cut off")]
    CutOff {
        /// Which scan.
        scan: usize,
    },
    /// Scans of scanners that announce different things.
    #[error("scan {scan} was taken with another calibration than the first")]
    OtherCalibration {
        /// Which scan.
        scan: usize,
    },
    /// A sphere is at none of the known places, or may be at two.
    #[error("the sphere at ({0:.1}, {1:.1}, {2:.1}) mm in scan {scan} is near none, or several, of the known places", at_mm[0], at_mm[1], at_mm[2])]
    NoPlace {
        /// Which scan.
        scan: usize,
        /// Where it is seen.
        at_mm: [f64; 3],
    },
    /// Spheres at too few places.
    #[error("spheres are seen at {places} places; at least {FEWEST_PLACES} are needed")]
    TooFew {
        /// How many there are.
        places: usize,
    },
    /// The samples tell nothing, or contradict each other.
    #[error("the scans determine none of the deviations")]
    NothingDetermined,
}

/// A deviation that was determined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Determined {
    /// Which.
    pub deviation: Deviation,
    /// Its value, in its unit.
    pub value: f64,
    /// Its standard uncertainty.
    pub uncertainty: f64,
}

/// A deviation that stays at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Undetermined {
    /// Which.
    pub deviation: Deviation,
    /// The standard uncertainty that it would have; `None` where the scans say nothing of it.
    pub uncertainty: Option<f64>,
}

/// A reference that was used.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// In which of the scans.
    pub scan: usize,
    /// Samples on it.
    pub samples: usize,
    /// What it measures without and with the correction.
    pub size: Size,
}

/// What a reference measures, without and with the correction.
#[derive(Debug, Clone, PartialEq)]
pub enum Size {
    /// A sphere.
    Sphere {
        /// Its centre, corrected, millimetres.
        centre_mm: [f64; 3],
        /// Measured less true diameter, millimetres.
        error_mm: [f64; 2],
        /// Standard uncertainty of the latter, millimetres.
        uncertainty_mm: f64,
    },
    /// A step gauge.
    Steps {
        /// Heights seen.
        heights: usize,
        /// Greatest error of a height against the lowest, millimetres.
        error_mm: [f64; 2],
    },
}

/// A scanner's deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// All of them; zero where not determined.
    pub deviations: Deviations,
    /// Those that were determined.
    pub determined: Vec<Determined>,
    /// Those that were not.
    pub undetermined: Vec<Undetermined>,
    /// Pairs that can hardly be told apart, with their coefficient of correlation.
    pub correlated: Vec<(Deviation, Deviation, f64)>,
    /// Singular values of the residuals' derivatives, in units of what is usual for each
    /// deviation, descending; those of no size belong to what no scan here can tell.
    pub singular_values: Vec<f64>,
    /// Largest by smallest singular value of what was determined.
    pub condition: f64,
    /// Root mean square of the samples' distances from the references, without and with the
    /// correction, millimetres; strays left out.
    pub rms_mm: [f64; 2],
    /// Samples that were looked at.
    pub samples: usize,
    /// The references.
    pub seen: Vec<Seen>,
    /// Spheres that were not used since the scan ends on them, by scan.
    pub cut_off: Vec<usize>,
}

/// A reference before it is measured: in which scan, and what it is.
struct Sighting {
    scan: usize,
    reference: Reference,
}

/// The deviations of the scanner that took these scans, as far as they tell.
///
/// # Errors
/// Any [`CalibrateError`].
pub fn calibrate(scans: &[Scan], references: &References) -> Result<Calibrated, CalibrateError> {
    if references.sphere_diameter_mm.is_none() && references.step_heights_mm.is_none() {
        return Err(CalibrateError::NothingGiven);
    }
    let announced = match scans.first() {
        Some(scan) => scan.calibration.as_announced(),
        None => return Err(CalibrateError::NothingDetermined),
    };
    let (mut sightings, cut_off) = sighted(scans, references, &announced)?;
    let places = places(&sightings);
    let has_steps = sightings
        .iter()
        .any(|own| matches!(own.reference, Reference::Steps { .. }));
    if places < FEWEST_PLACES && !has_steps {
        return Err(CalibrateError::TooFew { places });
    }
    // Without the known places at first: until the camera is known to be elsewhere, they would draw
    // the spheres away from their samples.
    let mut references: Vec<Reference> = sightings
        .iter()
        .map(|sighting| sighting.reference.clone().anywhere())
        .collect();
    let mut uncorrected = solve(&announced, &mut references, &[false; UNKNOWNS], None)
        .ok_or(CalibrateError::NothingDetermined)?;
    let rms_before_mm = uncorrected.normal.rms_mm();
    let before = measured(&announced, &references);
    for (reference, sighting) in references.iter_mut().zip(&sightings) {
        reference.tie_as(&sighting.reference);
    }
    uncorrected.normal.matrix = normal(&announced, &uncorrected.deviations, &references)
        .ok_or(CalibrateError::NothingDetermined)?
        .matrix;
    let first = settled(&announced, &mut references, &uncorrected)?;
    // Once more with the samples that then lie on the caps.
    recapped(
        scans,
        &announced,
        &first.deviations,
        &mut sightings,
        &references,
    );
    references = sightings.iter().map(|s| s.reference.clone()).collect();
    let solved = settled(&announced, &mut references, &first)?;
    let corrected = Calibration {
        correction: Some(solved.deviations.correction()),
        ..announced
    };
    let after = measured(&corrected, &references);
    let seen = sightings
        .iter()
        .zip(&references)
        .zip(before.iter().zip(after))
        .map(|((sighting, reference), (before, after))| Seen {
            scan: sighting.scan,
            samples: samples(reference),
            size: both(before, after),
        })
        .collect();
    told(&solved, rms_before_mm, seen, cut_off)
}

/// A solution, and the normal equations there.
struct Solved {
    deviations: Deviations,
    chosen: Chosen,
    normal: Normal,
}

impl Solved {
    fn factor(&self) -> f64 {
        self.normal
            .spread
            .factor(self.chosen.iter().filter(|c| **c).count())
    }
}

/// Solves for what can be determined, until that stays the same.
fn settled(
    announced: &Calibration,
    references: &mut [Reference],
    start: &Solved,
) -> Result<Solved, CalibrateError> {
    const ROUNDS: usize = 4;
    let mut chosen = choose(&start.normal.matrix, start.factor());
    let mut from = start.deviations;
    for _ in 0..ROUNDS {
        if chosen.iter().all(|is_chosen| !is_chosen) {
            return Err(CalibrateError::NothingDetermined);
        }
        for (value, is_chosen) in from.0.iter_mut().zip(&chosen) {
            if !is_chosen {
                *value = 0.0;
            }
        }
        let solved = solve(announced, references, &chosen, Some(from))
            .ok_or(CalibrateError::NothingDetermined)?;
        let again = choose(&solved.normal.matrix, solved.factor());
        if again == chosen {
            return Ok(solved);
        }
        // What is on the verge is left out for good, so that this comes to an end.
        from = solved.deviations;
        for (keep, again) in chosen.iter_mut().zip(again) {
            *keep &= again;
        }
    }
    Err(CalibrateError::NothingDetermined)
}

fn solve(
    announced: &Calibration,
    references: &mut [Reference],
    chosen: &Chosen,
    from: Option<Deviations>,
) -> Option<Solved> {
    let mut deviations = from.unwrap_or_default();
    for _ in 0..STEPS {
        let normal = normal(announced, &deviations, references)?;
        let step = step(&normal.matrix, &normal.right, chosen)?;
        let moved_mm = normal.follow(references, &step);
        let mut longest: f64 = moved_mm;
        for ((value, step), deviation) in
            deviations.0.iter_mut().zip(step.iter()).zip(Deviation::ALL)
        {
            *value += step;
            longest = longest.max(step.abs() / deviation.usual());
        }
        if !longest.is_finite() || deviations.correction().implausible().is_some() {
            return None;
        }
        if longest < STILL {
            break;
        }
    }
    let normal = normal(announced, &deviations, references)?;
    Some(Solved {
        deviations,
        chosen: *chosen,
        normal,
    })
}

fn told(
    solved: &Solved,
    rms_before_mm: f64,
    seen: Vec<Seen>,
    cut_off: Vec<usize>,
) -> Result<Calibrated, CalibrateError> {
    let matrix = &solved.normal.matrix;
    let factor = solved.factor();
    let covariance =
        covariance(matrix, &solved.chosen).ok_or(CalibrateError::NothingDetermined)? * factor;
    let deviation_of = |index: usize| libm::sqrt(covariance[(index, index)].max(0.0));
    let (mut determined, mut undetermined, mut correlated) = (Vec::new(), Vec::new(), Vec::new());
    for deviation in Deviation::ALL {
        let index = deviation.index();
        if solved.chosen[index] {
            determined.push(Determined {
                deviation,
                value: solved.deviations.get(deviation),
                uncertainty: deviation_of(index),
            });
            for other in Deviation::ALL.into_iter().take(index) {
                let (a, b) = (deviation_of(index), deviation_of(other.index()));
                let coefficient = covariance[(index, other.index())] / (a * b);
                if coefficient.abs() > CORRELATED {
                    correlated.push((other, deviation, coefficient));
                }
            }
        } else {
            undetermined.push(Undetermined {
                deviation,
                uncertainty: alone(matrix, &solved.chosen, deviation, factor),
            });
        }
    }
    let of_chosen = singular_values(matrix, Some(&solved.chosen));
    let condition = match (of_chosen.first(), of_chosen.last()) {
        (Some(largest), Some(smallest)) => largest / smallest,
        _ => f64::INFINITY,
    };
    Ok(Calibrated {
        deviations: solved.deviations,
        determined,
        undetermined,
        correlated,
        singular_values: singular_values(matrix, None),
        condition,
        rms_mm: [rms_before_mm, solved.normal.rms_mm()],
        samples: solved.normal.spread.samples() as usize,
        seen,
        cut_off,
    })
}

/// The standard uncertainty that one more deviation would have; `None` if it cannot be told from
/// the others.
fn alone(
    matrix: &crate::linear::Matrix,
    chosen: &Chosen,
    deviation: Deviation,
    factor: f64,
) -> Option<f64> {
    /// More than so many times what is usual says nothing.
    const NOTHING: f64 = 10.0;
    let mut with = *chosen;
    with[deviation.index()] = true;
    let variance = covariance(matrix, &with)?[(deviation.index(), deviation.index())] * factor;
    let uncertainty = libm::sqrt(variance.max(0.0));
    (uncertainty < NOTHING * deviation.usual()).then_some(uncertainty)
}

/// The references in the scans, and the scans with spheres that are cut off.
fn sighted(
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
fn places(sightings: &[Sighting]) -> usize {
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
fn recapped(
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

fn samples(reference: &Reference) -> usize {
    match reference {
        Reference::Sphere { samples, .. } => samples.len(),
        Reference::Steps { samples, .. } => samples.len(),
    }
}

/// What each reference measures with this calibration.
fn measured(calibration: &Calibration, references: &[Reference]) -> Vec<Size> {
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
fn both(before: &Size, after: Size) -> Size {
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
