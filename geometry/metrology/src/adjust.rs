//! Solving for the deviations and the references' places together.

use range_image::Calibration;

use crate::calibrate::{CalibrateError, Determined};
use crate::deviations::{Deviation, Deviations, UNKNOWNS};
use crate::linear::{Chosen, choose, covariance, step};
use crate::measured::{Normal, Reference, normal};

/// Gauss-Newton steps, at most.
const STEPS: usize = 60;
/// It is solved once no unknown moves by more, as a share of what is usual, and no reference by
/// more millimetres.
const STILL: f64 = 1e-6;
/// A deviation of fewer standard uncertainties is not corrected: what is recognised and significant
/// is (GUM, JCGM 100:2008, 3.2.4), and noise taken for a deviation makes every size worse.
const SIGNIFICANT: f64 = 2.0;

/// A solution, and the normal equations there.
pub(crate) struct Solved {
    pub(crate) deviations: Deviations,
    pub(crate) chosen: Chosen,
    pub(crate) normal: Normal,
    /// What could be determined, but does not differ from zero.
    pub(crate) insignificant: Vec<Determined>,
}

impl Solved {
    pub(crate) fn factor(&self) -> f64 {
        self.normal
            .spread
            .factor(self.chosen.iter().filter(|c| **c).count())
    }
}

/// Solves for what can be determined, until that stays the same, and leaves out what does not
/// differ from zero: the least significant first, since what is left may then become so.
pub(crate) fn settled(
    announced: &Calibration,
    references: &mut [Reference],
    start: &Solved,
) -> Result<Solved, CalibrateError> {
    let mut chosen = choose(&start.normal.matrix, start.factor());
    if chosen.iter().all(|is_chosen| !is_chosen) {
        return Err(CalibrateError::NothingDetermined);
    }
    let mut from = start.deviations;
    let mut insignificant = Vec::new();
    // Each round leaves at least one out for good.
    for _ in 0..=2 * UNKNOWNS {
        for (value, is_chosen) in from.0.iter_mut().zip(&chosen) {
            if !is_chosen {
                *value = 0.0;
            }
        }
        let solved = solve(announced, references, &chosen, &from)
            .ok_or(CalibrateError::NothingDetermined)?;
        from = solved.deviations;
        let told = choose(&solved.normal.matrix, solved.factor());
        let hardly_told = chosen
            .iter()
            .zip(told)
            .any(|(is_chosen, told)| *is_chosen && !told);
        if hardly_told {
            for (keep, told) in chosen.iter_mut().zip(told) {
                *keep &= told;
            }
            continue;
        }
        match least_significant(&solved) {
            Some(own) => {
                chosen[own.deviation.index()] = false;
                insignificant.push(own);
            }
            None => {
                return Ok(Solved {
                    insignificant,
                    ..solved
                });
            }
        }
    }
    Err(CalibrateError::NothingDetermined)
}

/// The deviation of the fewest standard uncertainties, if it is not significant.
fn least_significant(solved: &Solved) -> Option<Determined> {
    let covariance = covariance(&solved.normal.matrix, &solved.chosen)? * solved.factor();
    let significance = |own: &Determined| own.value.abs() / own.uncertainty;
    Deviation::ALL
        .into_iter()
        .filter(|deviation| solved.chosen[deviation.index()])
        .map(|deviation| Determined {
            deviation,
            value: solved.deviations.get(deviation),
            uncertainty: libm::sqrt(covariance[(deviation.index(), deviation.index())].max(0.0)),
        })
        .filter(|own| significance(own) < SIGNIFICANT)
        .min_by(|a, b| significance(a).total_cmp(&significance(b)))
}

pub(crate) fn solve(
    announced: &Calibration,
    references: &mut [Reference],
    chosen: &Chosen,
    from: &Deviations,
) -> Option<Solved> {
    let mut deviations = *from;
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
        insignificant: Vec::new(),
    })
}
