//! What kind of surface each region is.

mod nodes;
mod policy;
mod samples;

use core::num::NonZeroU16;

use range_image::{Monitor, RangeImage, RegionMap};
use rayon::prelude::*;
use shapes::{Evidence, Sample, Shape, Verdict, decide};

use crate::columns::Columns;
use crate::process::PipelineError;
pub use policy::{Kinds, UnknownKinds};

/// A region's kind of surface.
#[derive(Debug, Clone)]
pub struct RegionKind {
    /// The region.
    pub label: NonZeroU16,
    /// The verdict and what it rests on.
    pub evidence: Evidence,
    /// What it rests on.
    pub basis: Basis,
}

impl RegionKind {
    /// The shape, where it is one.
    #[must_use]
    pub fn shape(&self) -> Option<Shape> {
        match &self.evidence.verdict {
            Verdict::Shape(fit) => Some(fit.shape),
            Verdict::FreeForm | Verdict::Unknown => None,
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

/// What a region's surface is decided by.
struct Bearing {
    samples: Vec<Sample>,
    /// As [`shapes::fit`] has it.
    area: f64,
}

/// Decides for each region, in the order of their labels: by the samples where columns are
/// given, else by the nodes.
///
/// # Errors
/// Cancelled, or the columns cannot be read again.
pub(crate) fn kinds(
    image: &RangeImage,
    regions: &RegionMap,
    columns: Option<&dyn Columns>,
    monitor: &dyn Monitor,
) -> Result<Vec<RegionKind>, PipelineError> {
    let (bearings, basis) = match columns {
        Some(columns) => {
            let all = samples::of_regions(image, regions, columns, monitor)?;
            (all, Basis::Samples)
        }
        None => (nodes::of_regions(image, regions), Basis::Nodes),
    };
    let labels: Vec<NonZeroU16> = (1..=regions.regions())
        .filter_map(NonZeroU16::new)
        .collect();
    let decided = bearings.par_iter().zip(labels).map(|(bearing, label)| {
        monitor.check()?;
        let evidence = decide(&bearing.samples, bearing.area);
        Ok(RegionKind {
            label,
            evidence,
            basis,
        })
    });
    decided.collect()
}
