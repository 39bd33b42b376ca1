//! Regularities among the shapes of regions, as their samples allow of them.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use regularize::{Adjusted, Fitted, Reason, Refused, Regularity, survival};
use shapes::{Fit, Verdict};

use crate::kinds::bearing::Bearing;
use crate::kinds::{Basis, Decided, RegionKind};
use crate::settings::Regularize;
use crate::{Settings, SettingsError};

/// Most shapes among which regularities are looked for: those of the most samples.
const MOST: usize = 100;
/// Samples that are farther off the fit than so many deviations say nothing of it.
const HELD: f64 = 4.0;

/// The regularities that shapes were given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Regularities {
    /// Those that hold.
    pub accepted: Vec<Regularity>,
    /// What is nearly one, and why it is none.
    pub refused: Vec<Refused>,
    /// What the user should know, in plain sentences.
    pub notes: Vec<String>,
}

/// Looks for regularities if asked to, and gives them to the shapes. `has_kinds` tells whether faces
/// will be of the shapes.
pub(crate) fn regularize(
    decided: Decided,
    has_kinds: bool,
    settings: &Settings,
) -> Result<(Vec<RegionKind>, Option<Regularities>), SettingsError> {
    let Decided {
        mut kinds,
        bearings,
    } = decided;
    let Regularize::On(settings) = &settings.regularize else {
        return Ok((kinds, None));
    };
    let mut found = Regularities::default();
    let mut note = |why: &str| {
        found
            .notes
            .push(format!("no regularities were looked for: {why}"))
    };
    if !has_kinds {
        note("faces are free forms with these settings (method and kinds)");
        return Ok((kinds, Some(found)));
    }
    if kinds.iter().any(|kind| kind.basis == Basis::Nodes) {
        note("the samples are not at hand, without which it is not known how sure the shapes are");
        return Ok((kinds, Some(found)));
    }
    let mut fitted: Vec<(usize, Fitted)> = Vec::new();
    for kind in &kinds {
        if let Verdict::Shape(fit) = &kind.evidence.verdict {
            let own = Fitted {
                label: kind.label.get(),
                shape: fit.shape,
                joint: *fit.joint(),
            };
            fitted.push((fit.held, own));
        }
    }
    if fitted.len() > MOST {
        found.notes.push(format!(
            "regularities were looked for among the {MOST} shapes of the most samples only, of {}",
            fitted.len()
        ));
        // Stable, so that of equals the first stay.
        fitted.sort_by_key(|(held, _)| core::cmp::Reverse(*held));
        fitted.truncate(MOST);
        fitted.sort_by_key(|(_, own)| own.label);
    }
    let mut fitted: Vec<Fitted> = fitted.into_iter().map(|(_, own)| own).collect();
    let size_mm = size_mm(&bearings);
    let adjusted = loop {
        let all =
            regularize::regularize(&fitted, size_mm, settings).map_err(|error| SettingsError {
                stage: "reconstruct",
                message: error.to_string(),
            })?;
        // Each of the tests has its part in the chance that one of them errs.
        let least = survival(settings.bound.powi(2), 1) / all.adjusted.len().max(1) as f64;
        let refusing: BTreeSet<u16> = all
            .adjusted
            .iter()
            .filter(|adjusted| !is_borne(&kinds, &bearings, adjusted, least))
            .map(|adjusted| adjusted.label)
            .collect();
        if refusing.is_empty() {
            found.accepted = all.accepted;
            found.refused.extend(all.refused);
            break all.adjusted;
        }
        let ties = all.accepted.iter();
        let ties = ties.filter(|own| own.labels.iter().any(|label| refusing.contains(label)));
        found
            .refused
            .extend(ties.map(|own| Refused::of(own, Reason::Samples)));
        fitted.retain(|own| !refusing.contains(&own.label));
    };
    for adjusted in adjusted {
        let own = kinds
            .iter_mut()
            .find(|kind| kind.label.get() == adjusted.label);
        if let Some(own) = own {
            own.adjusted = Some(Box::new(adjusted));
        }
    }
    Ok((kinds, Some(found)))
}

/// Whether a region's samples allow of its adjusted shape: it costs no more than noise makes
/// likely with this probability.
fn is_borne(kinds: &[RegionKind], bearings: &[Bearing], adjusted: &Adjusted, least: f64) -> bool {
    let index = kinds
        .iter()
        .position(|kind| kind.label.get() == adjusted.label);
    let own = index.and_then(|index| Some((&kinds.get(index)?.evidence, bearings.get(index)?)));
    let Some((evidence, bearing)) = own else {
        return false;
    };
    let Verdict::Shape(fit) = &evidence.verdict else {
        return false;
    };
    let more = more_squares(fit, bearing, adjusted);
    survival(more.max(0.0), fit.shape.family().freedom()) >= least
}

/// By how much the squares of the samples' distances are more than those from the fit.
fn more_squares(fit: &Fit, bearing: &Bearing, adjusted: &Adjusted) -> f64 {
    let deviation = fit.deviation();
    let mut more = 0.0;
    for sample in &bearing.samples {
        let before = sample.off(&fit.shape) / deviation;
        if before.abs() <= HELD {
            let now = sample.off(&adjusted.shape) / deviation;
            more += now * now - before * before;
        }
    }
    more / bearing.area.max(1.0)
}

/// The diagonal of what all samples lie in.
fn size_mm(bearings: &[Bearing]) -> f64 {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for sample in bearings.iter().flat_map(|bearing| &bearing.samples) {
        low = low.inf(&sample.point_mm);
        high = high.sup(&sample.point_mm);
    }
    (high - low).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::num::NonZeroU16;
    use shapes::{Family, Sample, Shape, decide, fit};

    #[test]
    fn samples_refuse_a_shape_that_they_are_off() {
        let chance = |k: f64| {
            let chance = libm::sin(k * 12.9898) * 43758.5453;
            (chance - chance.floor() - 0.5) * 12.0_f64.sqrt()
        };
        let samples: Vec<Sample> = (0..900)
            .map(|k| Sample {
                point_mm: Vector3::new(
                    f64::from(k % 30),
                    f64::from(k / 30),
                    0.02 * chance(f64::from(k)),
                ),
                ray: Vector3::z(),
                sigma_mm: 0.02,
            })
            .collect();
        let found = fit(Family::Plane, &samples, 1.0).unwrap();
        let kinds = [RegionKind {
            label: NonZeroU16::MIN,
            evidence: decide(&samples, 1.0),
            basis: Basis::Samples,
            adjusted: None,
        }];
        let bearings = [Bearing {
            samples,
            area: 1.0,
            ..Bearing::default()
        }];
        let is_borne = |deviations: f64| {
            let Shape::Plane(mut plane) = found.shape else {
                panic!("{:?}", found.shape);
            };
            plane.point_mm.z += deviations * found.numbers.place_mm.most();
            let adjusted = Adjusted {
                label: 1,
                shape: Shape::Plane(plane),
                numbers: found.numbers,
                joint: *found.joint(),
                turned_rad: 0.0,
                moved_mm: 0.0,
            };
            is_borne(&kinds, &bearings, &adjusted, survival(9.0, 1))
        };
        assert!(is_borne(0.0) && is_borne(2.5));
        assert!(!is_borne(4.5) && !is_borne(-4.5));
        assert_eq!(size_mm(&bearings).round(), 41.0);
    }
}
