//! What is judged.

use std::time::Instant;

use anyhow::{Context, Result};
use range_image::{RangeImage, Unmonitored};
use relief_tests::scenes::View;
use segment::SegmentSettings;

use crate::material::Subject;

/// A segmentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// The service's default.
    Relief,
    /// The baseline of the paper.
    ShimLee,
    /// Planar patches of Open3D.
    Open3d,
    /// Region growing of CGAL.
    Cgal,
}

impl Method {
    pub(crate) const OURS: [Self; 2] = [Self::Relief, Self::ShimLee];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Relief => "relief",
            Self::ShimLee => "shim-lee",
            Self::Open3d => "Open3D",
            Self::Cgal => "CGAL",
        }
    }
}

/// The labels that a method gave to the nodes of an image.
#[derive(Debug)]
pub(crate) struct Labelled {
    pub(crate) method: Method,
    pub(crate) labels: Vec<u16>,
    pub(crate) seconds: f64,
}

/// The labels by each of our methods.
pub(crate) fn all(subject: &Subject, image: &RangeImage, view: View) -> Result<Vec<Labelled>> {
    Method::OURS
        .into_iter()
        .map(|method| {
            let started = Instant::now();
            let labels = ours(method, image)
                .with_context(|| format!("{} {}", subject.set.name(), subject.seed))?;
            Ok(Labelled {
                method,
                labels,
                seconds: started.elapsed().as_secs_f64(),
            })
        })
        .collect::<Result<_>>()
        .with_context(|| format!("view {}", view.name()))
}

/// Runs the work on one thread, on which nothing else runs: a thread that the scenes share would
/// begin with another scene while it waits.
fn on_a_thread_of_its_own<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T> {
    let done = std::thread::scope(|scope| scope.spawn(|| regrid::with_threads(1, work)).join());
    Ok(done.map_err(|_| anyhow::anyhow!("a thread ended in a panic"))??)
}

/// The labels by one of our methods.
pub(crate) fn ours(method: Method, image: &RangeImage) -> Result<Vec<u16>> {
    let settings = SegmentSettings {
        method: match method {
            Method::ShimLee => segment::Method::ShimLee,
            _ => segment::Method::Relief,
        },
        ..pipeline::Settings::new(image.pitch_mm()).segment
    };
    let regions = on_a_thread_of_its_own(|| segment::segment(image, &settings, &Unmonitored))??;
    Ok(regions.raw_labels().to_vec())
}

/// The part's own faces by the default method. What stands around the part is taken off
/// where a view shows it.
pub(crate) fn part(image: &RangeImage, view: View) -> Result<Vec<u16>> {
    if view != View::Cluttered {
        return ours(Method::Relief, image);
    }
    let settings = pipeline::Settings::new(image.pitch_mm());
    let frame = segment::View::default();
    let part = pipeline::divide(image, &frame, &settings, &Unmonitored)?;
    Ok(part.regions.raw_labels().to_vec())
}
