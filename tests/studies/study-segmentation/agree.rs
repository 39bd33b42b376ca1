//! Whether the same scene, scanned otherwise, gets the same regions.

use anyhow::{Context, Result};
use rayon::prelude::*;
use relief_tests::scenes::{Set, View};
use relief_tests::score::{Agreement, adjusted_rand_index};

use crate::material::Store;
use crate::methods::{Method, ours};
use crate::tally::{BAR, Failure, Finding, judge};
use crate::{methods, tally};

/// The bar of the mean index.
pub(crate) const LEAST_INDEX: f64 = 0.97;

/// Agreement of a view with the plain one over the scenes of a set.
#[derive(Debug)]
pub(crate) struct Agreed {
    pub(crate) view: View,
    /// Seed and agreement of each scene.
    pub(crate) scenes: Vec<(u64, Agreement)>,
}

impl Agreed {
    pub(crate) fn mean(&self) -> f64 {
        let sum: f64 = self.scenes.iter().map(|(_, a)| a.index).sum();
        sum / self.scenes.len().max(1) as f64
    }

    pub(crate) fn least(&self) -> f64 {
        let indices = self.scenes.iter().map(|(_, a)| a.index);
        indices.fold(1.0, f64::min)
    }

    pub(crate) fn below(&self) -> Vec<u64> {
        let scenes = self.scenes.iter();
        let low = scenes.filter(|(_, a)| a.index < LEAST_INDEX);
        low.map(|(seed, _)| *seed).collect()
    }

    pub(crate) fn coverage(&self) -> f64 {
        let sum: f64 = self.scenes.iter().map(|(_, a)| a.coverage).sum();
        sum / self.scenes.len().max(1) as f64
    }
}

/// Compares the regions of `relief` in a view with those in the plain one, node by node of
/// the plain lattice.
pub(crate) fn views(store: &Store, set: Set, seeds: &[u64], view: View) -> Result<Agreed> {
    let scenes = seeds
        .par_iter()
        .map(|&seed| {
            let (subject, images) = store.get(set, seed, &[View::Plain, view])?;
            let (one, other) = images
                .split_first()
                .and_then(|(one, rest)| Some((one, rest.first()?)))
                .context("two images")?;
            let truth = &subject.truth;
            let plain = ours(Method::Relief, one)?;
            let plain = truth.gather(one, &plain, View::Plain.factor(), 0);
            let varied = ours(Method::Relief, other)?;
            let varied = truth.gather(other, &varied, view.factor(), 0);
            Ok((seed, adjusted_rand_index(&plain, &varied)))
        })
        .collect::<Result<_>>()?;
    Ok(Agreed { view, scenes })
}

/// The part's faces with a table and a plane behind, against those of the same sweep without.
#[derive(Debug, Default)]
pub(crate) struct Cluttered {
    /// Faces that are correct without.
    pub(crate) without: usize,
    /// Those of them that are correct with.
    pub(crate) with: usize,
    /// Regions that are none of the part's, without and with.
    pub(crate) noise_without: usize,
    pub(crate) noise: usize,
    pub(crate) scenes: usize,
    /// Scenes with a face lost or a region too many, and what is wrong with them.
    pub(crate) failed: Vec<Finding>,
}

pub(crate) fn clutter(store: &Store, set: Set, seeds: &[u64]) -> Result<Cluttered> {
    let scenes: Vec<(Finding, usize, usize, [usize; 2])> = seeds
        .par_iter()
        .map(|&seed| {
            let views = [View::Alone, View::Cluttered];
            let (subject, images) = store.get(set, seed, &views)?;
            let mut found = Vec::new();
            for (image, view) in images.iter().zip(views) {
                let labelled = methods::Labelled {
                    method: Method::Relief,
                    labels: methods::part(image, view)?,
                    seconds: 0.0,
                };
                found.push(judge(&subject, image, view, &labelled));
            }
            let (Some(mut with), Some(without)) = (found.pop(), found.pop()) else {
                anyhow::bail!("two views");
            };
            let wrong = |finding: &Finding, label: u16| {
                let mut failures = finding.failures.iter();
                failures.any(|f| f.what != "noise" && f.label == label)
            };
            let faces = subject.truth.regions.iter().filter(|r| r.counts());
            let good: Vec<u16> = faces
                .map(|r| r.label)
                .filter(|label| !wrong(&without, *label))
                .collect();
            let kept = good.iter().filter(|label| !wrong(&with, **label)).count();
            let at = tally::TOLERANCES.iter().position(|t| *t == BAR);
            let noise = [&without, &with].map(|finding| {
                let counts = at.and_then(|k| finding.at.get(k));
                counts.map_or(0, |counts| counts.noise)
            });
            let is_own = |f: &Failure| f.what == "noise" || good.contains(&f.label);
            with.failures.retain(is_own);
            Ok((with, good.len(), kept, noise))
        })
        .collect::<Result<_>>()?;
    let mut sum = Cluttered::default();
    for (finding, good, kept, noise) in scenes {
        sum.without += good;
        sum.with += kept;
        sum.noise_without += noise[0];
        sum.noise += noise[1];
        sum.scenes += 1;
        if kept < good || noise[1] > noise[0] {
            sum.failed.push(finding);
        }
    }
    Ok(sum)
}
