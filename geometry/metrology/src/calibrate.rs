//! The deviations of a scanner by least squares over the samples of references.
//!
//! A bundle adjustment: the deviations and the places of the references are solved for together,
//! by Gauss-Newton steps on the orthogonal distances of all samples, in which the references'
//! places are eliminated (the Schur complement; Triggs et al., Bundle Adjustment, a Modern
//! Synthesis, 2000, section 6.1). Samples that stray weigh nothing (Tukey). Uncertainties are those
//! of an M-estimate (Huber 1981, section 7.6): of the samples' scatter, and not of the reference's
//! own diameter, by whose share of error all scales are off together.

use range_image::Calibration;

use crate::adjust::{Solved, settled, solve};
use crate::deviations::{Deviation, Deviations, UNKNOWNS};
use crate::linear::{Chosen, choose, covariance, singular_values};
use crate::measured::{Reference, normal};
use crate::scan::Scan;
use crate::sight::{places, recapped, sighted};
use crate::sizes::{both, measured, samples};

/// Fewest places at which spheres must have been seen.
pub const FEWEST_PLACES: usize = 3;
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
    /// Those that were determined and are not zero.
    pub determined: Vec<Determined>,
    /// Those that do not differ significantly from zero, and stay there; with the values and
    /// uncertainties that were found.
    pub insignificant: Vec<Determined>,
    /// Those that were not determined.
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
    let mut uncorrected = solve(
        &announced,
        &mut references,
        &[false; UNKNOWNS],
        &Deviations::default(),
    )
    .ok_or(CalibrateError::NothingDetermined)?;
    let rms_before_mm = uncorrected.normal.rms_mm();
    let before = measured(&announced, &references);
    for (reference, sighting) in references.iter_mut().zip(&sightings) {
        reference.tie_as(&sighting.reference);
    }
    uncorrected.normal.matrix = normal(&announced, &uncorrected.deviations, &references)
        .ok_or(CalibrateError::NothingDetermined)?
        .matrix;
    let chosen = choose(&uncorrected.normal.matrix, uncorrected.factor());
    let first = solve(
        &announced,
        &mut references,
        &chosen,
        &uncorrected.deviations,
    )
    .ok_or(CalibrateError::NothingDetermined)?;
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
        } else if !solved
            .insignificant
            .iter()
            .any(|own| own.deviation == deviation)
        {
            undetermined.push(Undetermined {
                deviation,
                uncertainty: alone(matrix, &solved.chosen, deviation, factor),
            });
        }
    }
    let of_chosen = singular_values(matrix, Some(&solved.chosen));
    let condition = match (of_chosen.first(), of_chosen.last()) {
        (Some(largest), Some(smallest)) => largest / smallest,
        // Nothing is known of what is not there.
        _ => 1.0,
    };
    Ok(Calibrated {
        deviations: solved.deviations,
        determined,
        insignificant: solved.insignificant.clone(),
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
