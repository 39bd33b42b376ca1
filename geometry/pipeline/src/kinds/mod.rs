//! What kind of surface each region is.

pub(crate) mod bearing;
mod islands;
mod joins;
mod nodes;
mod policy;
pub(crate) mod samples;

use core::num::NonZeroU16;

use range_image::{Cancelled, Monitor, RangeImage, RegionMap};
use rayon::prelude::*;
use reconstruct::Known;
use regularize::Adjusted;
use shapes::{Evidence, Fit, Numbers, Shape, SweptFit, Verdict};

use bearing::Bearing;
pub use policy::{Kinds, SmoothJoins, UnknownKinds};
use samples::OnRegion;

/// Rounds in which neighbours are fitted to what is theirs by each other's last shape.
const ROUNDS: usize = 3;

/// A region's kind of surface.
#[derive(Debug, Clone)]
pub struct RegionKind {
    /// The region.
    pub label: NonZeroU16,
    /// The verdict and what it rests on.
    pub evidence: Evidence,
    /// What it rests on.
    pub basis: Basis,
    /// The shape as its neighbours that it touches and its regularities have it, where it has any;
    /// the evidence is that of its own samples alone.
    pub adjusted: Option<Box<Adjusted>>,
}

impl RegionKind {
    /// The shape, where it is one: tied to others, if it is.
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
            (Verdict::Swept(_) | Verdict::FreeForm | Verdict::Unknown, _) => None,
        }
    }

    /// The surface that the samples speak for, if they do for one.
    #[must_use]
    pub fn known(&self) -> Option<Known> {
        if let Verdict::Swept(fit) = &self.evidence.verdict {
            return Some(Known {
                form: fit.swept.clone().into(),
                freedom: fit.freedom,
            });
        }
        self.shape().map(|shape| Known {
            form: shape.into(),
            freedom: shape.family().freedom(),
        })
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
    /// Labels of regions that go over into each other smoothly, as far as samples tell.
    pub(crate) touching: Vec<[u16; 2]>,
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
    for island in islands::islands(&decided, &bearings) {
        decided[island].evidence.verdict = Verdict::FreeForm;
    }
    let swept = decided.par_iter().zip(&bearings).map(|(kind, bearing)| {
        monitor.check()?;
        let is_free_form = matches!(kind.evidence.verdict, Verdict::FreeForm);
        Ok(is_free_form.then(|| bearing.swept()).flatten())
    });
    let swept: Vec<Result<Option<SweptFit>, Cancelled>> = swept.collect();
    for (kind, swept) in decided.iter_mut().zip(swept) {
        if let Some(fit) = swept? {
            kind.evidence.verdict = Verdict::Swept(Box::new(fit));
        }
    }
    if smooth_joins == SmoothJoins::Keep {
        // What lies beside a border may be of a surface that joins this one.
        return Ok(Decided {
            kinds: decided,
            bearings,
            touching: Vec::new(),
        });
    }
    for _ in 0..ROUNDS {
        let shapes: Vec<Option<Shape>> = decided.iter().map(RegionKind::shape).collect();
        let refined = decided.par_iter().zip(&bearings).map(|(kind, bearing)| {
            monitor.check()?;
            let fit = kind.evidence.fit();
            Ok(fit.and_then(|fit| refined(kind.label, fit, bearing, (&bearings, &shapes))))
        });
        let refined: Vec<Result<Option<Fit>, Cancelled>> = refined.collect();
        for (kind, refined) in decided.iter_mut().zip(refined) {
            if let (Some(refined), Verdict::Shape(fit)) = (refined?, &mut kind.evidence.verdict) {
                **fit = refined;
            }
        }
    }
    let shapes: Vec<Option<Shape>> = decided.iter().map(RegionKind::shape).collect();
    let touching = joins::touching(&bearings, &shapes);
    Ok(Decided {
        kinds: decided,
        bearings,
        touching,
    })
}

/// A region's shape by what is of it near its border, too.
fn refined(
    label: NonZeroU16,
    fit: &Fit,
    bearing: &Bearing,
    all: (&[Bearing], &[Option<Shape>]),
) -> Option<Fit> {
    let (besides, smooth) = bearing.besides(label.get(), fit, all);
    let joined = joins::refine(label.get(), fit, all, &smooth, &besides);
    if joined.is_some() || besides.is_empty() {
        return joined;
    }
    let samples: Vec<_> = bearing.samples.iter().chain(&besides).copied().collect();
    fit.again(&samples, bearing.area)
}
