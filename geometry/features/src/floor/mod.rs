//! Floors that are no planes.

mod curve;
mod free_form;

pub(crate) use curve::curve;
pub use curve::{Curve, CurveKind};
pub(crate) use free_form::free_form;

use crate::candidate::Candidate;
use crate::sight::Sight;

/// The samples of a candidate's floor in the plan, millimetres, but for those beside its border.
fn samples(sight: &Sight<'_>, candidate: &Candidate) -> Vec<[f64; 3]> {
    let floors: Vec<u16> = candidate
        .levels
        .iter()
        .flat_map(|level| sight.levels.levels[usize::from(*level)].floor())
        .copied()
        .collect();
    sight.samples(&|region| floors.contains(&region))
}
