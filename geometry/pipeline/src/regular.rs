//! Regularities among the shapes of regions, as their samples allow of them.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use regularize::{
    Adjusted, Fitted, Kind, Reason, Refused, Regularity, Regularized, TANGENT_BOUND, survival,
};
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

/// The neighbours that were made to touch along a line, as a fillet does with the faces beside it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tangent {
    /// Those that touch.
    pub accepted: Vec<Regularity>,
    /// Those that seemed to, and why they do not.
    pub refused: Vec<Refused>,
}

/// Shapes by the samples of all.
#[derive(Debug)]
pub(crate) struct Tied {
    pub(crate) kinds: Vec<RegionKind>,
    pub(crate) tangent: Tangent,
    /// `None` where none were looked for.
    pub(crate) regularities: Option<Regularities>,
}

/// Makes neighbours touch that go over into each other smoothly, and looks for regularities if
/// asked to. `has_kinds` tells whether faces will be of the shapes.
pub(crate) fn tie(
    decided: Decided,
    has_kinds: bool,
    settings: &Settings,
) -> Result<Tied, SettingsError> {
    let mut tied = Tied {
        kinds: decided.kinds,
        tangent: Tangent::default(),
        regularities: None,
    };
    if let Regularize::On(_) = &settings.regularize {
        tied.regularities = Some(Regularities::default());
    }
    let by_nodes = tied.kinds.iter().any(|kind| kind.basis == Basis::Nodes);
    let why = if !has_kinds {
        Some("faces are free forms with these settings (method and kinds)")
    } else if by_nodes {
        Some("the samples are not at hand, without which it is not known how sure the shapes are")
    } else {
        None
    };
    if let Some(why) = why {
        if let Some(found) = &mut tied.regularities {
            let note = format!("no regularities were looked for: {why}");
            found.notes.push(note);
        }
        return Ok(tied);
    }
    let scene = Scene {
        size_mm: size_mm(&decided.bearings),
        bearings: &decided.bearings,
        touching: &decided.touching,
    };
    let groups = match (&settings.regularize, &mut tied.regularities) {
        (Regularize::On(_), Some(found)) => vec![largest(fitted(&tied.kinds), &mut found.notes)],
        _ => {
            let groups = connected(fitted(&tied.kinds), &decided.touching).into_iter();
            let none = &mut Vec::new();
            groups.map(|group| largest(group, none)).collect()
        }
    };
    for group in groups {
        let found = scene.adjust(group, &tied.kinds, &settings.regularize)?;
        for own in found.accepted {
            match &mut tied.regularities {
                Some(regularities) if own.kind != Kind::Tangent => regularities.accepted.push(own),
                _ => tied.tangent.accepted.push(own),
            }
        }
        for own in found.refused {
            match &mut tied.regularities {
                Some(regularities) if own.kind != Kind::Tangent => regularities.refused.push(own),
                _ => tied.tangent.refused.push(own),
            }
        }
        for adjusted in found.adjusted {
            let mut kinds = tied.kinds.iter_mut();
            let own = kinds.find(|kind| kind.label.get() == adjusted.label);
            if let Some(own) = own {
                own.adjusted = Some(Box::new(adjusted));
            }
        }
    }
    Ok(tied)
}

/// The shapes, each with how many samples it holds.
fn fitted(kinds: &[RegionKind]) -> Vec<(usize, Fitted)> {
    let mut fitted = Vec::new();
    for kind in kinds {
        if let Verdict::Shape(fit) = &kind.evidence.verdict {
            let own = Fitted {
                label: kind.label.get(),
                shape: fit.shape,
                joint: *fit.joint(),
            };
            fitted.push((fit.held, own));
        }
    }
    fitted
}

/// Shapes by the pairs that tie them, in the order of their labels; those that none ties are left
/// out.
fn connected(fitted: Vec<(usize, Fitted)>, pairs: &[[u16; 2]]) -> Vec<Vec<(usize, Fitted)>> {
    let mut group: BTreeMap<u16, u16> = pairs.iter().flatten().map(|own| (*own, *own)).collect();
    for pair in pairs {
        let [a, b] = pair.map(|own| group[&own]);
        let (into, from) = (a.min(b), a.max(b));
        for own in group.values_mut().filter(|own| **own == from) {
            *own = into;
        }
    }
    let mut groups: BTreeMap<u16, Vec<(usize, Fitted)>> = BTreeMap::new();
    for own in fitted {
        if let Some(group) = group.get(&own.1.label) {
            groups.entry(*group).or_default().push(own);
        }
    }
    groups.into_values().collect()
}

/// No more shapes than can be tied in a moment.
fn largest(mut fitted: Vec<(usize, Fitted)>, notes: &mut Vec<String>) -> Vec<Fitted> {
    if fitted.len() > MOST {
        notes.push(format!(
            "regularities were looked for among the {MOST} shapes of the most samples only, of {}",
            fitted.len()
        ));
        // Stable, so that of equals the first stay.
        fitted.sort_by_key(|(held, _)| core::cmp::Reverse(*held));
        fitted.truncate(MOST);
        fitted.sort_by_key(|(_, own)| own.label);
    }
    fitted.into_iter().map(|(_, own)| own).collect()
}

/// What shapes are tied by, and by what they are judged.
struct Scene<'a> {
    size_mm: f64,
    bearings: &'a [Bearing],
    touching: &'a [[u16; 2]],
}

impl Scene<'_> {
    /// What ties these shapes, as far as their samples allow of what it makes of them.
    fn adjust(
        &self,
        mut fitted: Vec<Fitted>,
        kinds: &[RegionKind],
        regularize: &Regularize,
    ) -> Result<Regularized, SettingsError> {
        let mut refused = Vec::new();
        let bound = regularize.bound().unwrap_or(TANGENT_BOUND);
        loop {
            let (touching, size_mm) = (self.touching, self.size_mm);
            let mut found = match regularize {
                Regularize::Off => regularize::join(&fitted, touching, size_mm),
                Regularize::On(settings) => {
                    let found = regularize::regularize(&fitted, touching, size_mm, settings);
                    found.map_err(|error| SettingsError {
                        stage: "reconstruct",
                        message: error.to_string(),
                    })?
                }
            };
            // Each of the tests has its part in the chance that one of them errs.
            let least = survival(bound.powi(2), 1) / found.adjusted.len().max(1) as f64;
            let refusing: BTreeSet<u16> = found
                .adjusted
                .iter()
                .filter(|adjusted| !is_borne(kinds, self.bearings, adjusted, least))
                .map(|adjusted| adjusted.label)
                .collect();
            if refusing.is_empty() {
                refused.append(&mut found.refused);
                found.refused = refused;
                return Ok(found);
            }
            let ties = found.accepted.iter();
            let ties = ties.filter(|own| own.labels.iter().any(|label| refusing.contains(label)));
            refused.extend(ties.map(|own| Refused::of(own, Reason::Samples)));
            fitted.retain(|own| !refusing.contains(&own.label));
        }
    }
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
    fn shapes_are_tied_in_groups_that_pairs_connect() {
        let shape = Shape::Sphere(shapes::Sphere {
            centre_mm: Vector3::zeros(),
            radius_mm: 1.0,
            is_hollow: false,
        });
        let own = |label: u16| Fitted {
            label,
            shape,
            joint: shapes::Joint::zeros(),
        };
        let all: Vec<(usize, Fitted)> = (1..=9).map(|label| (100, own(label))).collect();
        // The shape with label 12 is a free form.
        let pairs = [[7, 8], [2, 5], [12, 3], [5, 9], [8, 4], [9, 2]];
        let groups = connected(all, &pairs);
        let labels = |group: &Vec<(usize, Fitted)>| -> Vec<u16> {
            group.iter().map(|(_, own)| own.label).collect()
        };
        let groups: Vec<Vec<u16>> = groups.iter().map(labels).collect();
        assert_eq!(groups, [vec![2, 5, 9], vec![3], vec![4, 7, 8]]);
    }

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
