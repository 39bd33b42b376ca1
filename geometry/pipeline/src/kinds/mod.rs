//! What kind of surface each region is.

pub(crate) mod bearing;
mod nodes;
mod policy;
pub(crate) mod samples;

use core::num::NonZeroU16;

use range_image::{Cancelled, Monitor, RangeImage, RegionMap};
use rayon::prelude::*;
use regularize::Adjusted;
use shapes::{Evidence, Numbers, Shape, Verdict};

use bearing::Bearing;
pub use policy::{Kinds, SmoothJoins, UnknownKinds};
use samples::OnRegion;

/// A region's kind of surface.
#[derive(Debug, Clone)]
pub struct RegionKind {
    /// The region.
    pub label: NonZeroU16,
    /// The verdict and what it rests on.
    pub evidence: Evidence,
    /// What it rests on.
    pub basis: Basis,
    /// The shape with its regularities, where it has any; the evidence is that of the samples
    /// alone.
    pub adjusted: Option<Box<Adjusted>>,
}

impl RegionKind {
    /// The shape, where it is one: with its regularities, if any were looked for.
    #[must_use]
    pub fn shape(&self) -> Option<Shape> {
        self.told().map(|(shape, _)| shape)
    }

    /// The shape, as [`RegionKind::shape`] has it, and its numbers.
    #[must_use]
    pub fn told(&self) -> Option<(Shape, Numbers)> {
        match (&self.evidence.verdict, &self.adjusted) {
            (Verdict::Shape(_), Some(adjusted)) => Some((adjusted.shape, adjusted.numbers)),
            (Verdict::Shape(fit), None) => Some((fit.shape, fit.numbers)),
            (Verdict::FreeForm | Verdict::Unknown, _) => None,
        }
    }
}

/// What a verdict rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// The samples: the numbers are the surface's own, as sure as they say.
    Samples,
    /// The nodes of the range image. Each is the middle of a window, so that the numbers are
    /// those of a surface that windows have smoothed.
    Nodes,
}

/// The kinds of all regions, and what they rest on, in the order of their labels.
pub(crate) struct Decided {
    pub(crate) kinds: Vec<RegionKind>,
    pub(crate) bearings: Vec<Bearing>,
}

/// Decides for each region: by the samples where they are given, else by the nodes.
///
/// # Errors
/// Cancelled.
pub(crate) fn kinds(
    image: &RangeImage,
    regions: &RegionMap,
    samples: Option<&[OnRegion]>,
    smooth_joins: SmoothJoins,
    monitor: &dyn Monitor,
) -> Result<Decided, Cancelled> {
    let (bearings, basis) = match samples {
        Some(samples) => {
            let all = bearing::of_samples(image, regions, samples);
            (all, Basis::Samples)
        }
        None => (nodes::of_regions(image, regions), Basis::Nodes),
    };
    let labels: Vec<NonZeroU16> = (1..=regions.regions())
        .filter_map(NonZeroU16::new)
        .collect();
    let decided = bearings.par_iter().zip(labels).map(|(bearing, label)| {
        monitor.check()?;
        Ok(RegionKind {
            label,
            evidence: bearing.decide(),
            basis,
            adjusted: None,
        })
    });
    let decided: Vec<Result<RegionKind, Cancelled>> = decided.collect();
    let mut decided = decided.into_iter().collect::<Result<Vec<_>, _>>()?;
    if smooth_joins == SmoothJoins::Keep {
        // What lies beside a border may be of a surface that joins this one.
        return Ok(Decided {
            kinds: decided,
            bearings,
        });
    }
    let shapes: Vec<Option<Shape>> = decided.iter().map(RegionKind::shape).collect();
    decided
        .par_iter_mut()
        .zip(&bearings)
        .for_each(|(kind, bearing)| {
            if let Verdict::Shape(fit) = &mut kind.evidence.verdict
                && let Some(refined) = bearing.refine(fit, &shapes)
            {
                **fit = refined;
            }
        });
    Ok(Decided {
        kinds: decided,
        bearings,
    })
}
