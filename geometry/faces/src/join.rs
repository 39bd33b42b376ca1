//! Regions of one surface made one.

use std::collections::{BTreeMap, BTreeSet};

use range_image::{Cancelled, Monitor, RangeImage};
use shapes::{Evidence, Sample, Shape, decide};

use crate::observations::Observations;
use crate::profile::Kept;

/// Pairs of nodes beside each other that make regions neighbours.
const LEAST_CONTACT: usize = 4;
/// Samples that are looked at of each region.
const SAMPLES: usize = 1500;
/// How far one region's samples may lie off the other's shape by their median for both to be
/// looked at together, in their deviations: what is a part of a surface tells less of the rest.
const FAR: f64 = 10.0;

/// Joins neighbours whose samples together are of one shape as well as they are of two, but for
/// those with borders that are kept. `labels` are of the nodes, column by column; 0 is no region.
pub(crate) fn join(
    image: &RangeImage,
    labels: &mut [u16],
    kept: &mut Kept,
    observations: &Observations,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let mut regions = Regions {
        observations,
        nodes: BTreeMap::new(),
        told: BTreeMap::new(),
        apart: BTreeSet::new(),
    };
    for (node, label) in labels.iter().enumerate().filter(|(_, label)| **label != 0) {
        regions.nodes.entry(*label).or_default().push(node);
    }
    loop {
        let mut pairs = neighbours(image, labels);
        pairs.retain(|(a, b)| !kept.are_apart(*a, *b));
        let Some((a, b)) = regions.next(&pairs, monitor)? else {
            return Ok(());
        };
        kept.unite(a, b);
        let moved = regions.nodes.remove(&b).unwrap_or_default();
        moved.iter().for_each(|node| labels[*node] = a);
        let nodes = regions.nodes.entry(a).or_default();
        nodes.extend(moved);
        nodes.sort_unstable();
        for label in [a, b] {
            regions.told.remove(&label);
            regions
                .apart
                .retain(|pair| pair.0 != label && pair.1 != label);
        }
    }
}

/// Pairs of regions with enough nodes beside each other, the lower label first.
fn neighbours(image: &RangeImage, labels: &[u16]) -> Vec<(u16, u16)> {
    let rows = image.rows();
    let mut contacts: BTreeMap<(u16, u16), usize> = BTreeMap::new();
    for node in 0..labels.len() {
        let up = (node % rows.max(1) + 1 < rows).then_some(node + 1);
        for other in [up, Some(node + rows)].into_iter().flatten() {
            let Some(&other) = labels.get(other) else {
                continue;
            };
            let own = labels[node];
            if own != 0 && other != 0 && own != other {
                *contacts
                    .entry((own.min(other), own.max(other)))
                    .or_default() += 1;
            }
        }
    }
    let enough = contacts
        .into_iter()
        .filter(|(_, count)| *count >= LEAST_CONTACT);
    enough.map(|(pair, _)| pair).collect()
}

struct Regions<'a> {
    observations: &'a Observations,
    nodes: BTreeMap<u16, Vec<usize>>,
    /// What regions are by themselves.
    told: BTreeMap<u16, (Vec<Sample>, Evidence)>,
    /// Pairs that are not one.
    apart: BTreeSet<(u16, u16)>,
}

impl Regions<'_> {
    /// The first pair that is one surface.
    fn next(
        &mut self,
        pairs: &[(u16, u16)],
        monitor: &dyn Monitor,
    ) -> Result<Option<(u16, u16)>, Cancelled> {
        for &(a, b) in pairs {
            if self.apart.contains(&(a, b)) {
                continue;
            }
            monitor.check()?;
            for label in [a, b] {
                let (observations, nodes) = (self.observations, &self.nodes[&label]);
                self.told.entry(label).or_insert_with(|| {
                    let samples = observations.of(nodes, SAMPLES);
                    let evidence = decide(&samples, observations.area());
                    (samples, evidence)
                });
            }
            if are_one(&self.told[&a], &self.told[&b], self.observations.area()) {
                return Ok(Some((a, b)));
            }
            self.apart.insert((a, b));
        }
        Ok(None)
    }
}

/// Whether one shape costs no more than two surfaces do.
pub(crate) fn are_one(a: &(Vec<Sample>, Evidence), b: &(Vec<Sample>, Evidence), area: f64) -> bool {
    let (Some(fit_a), Some(fit_b)) = (a.1.fit(), b.1.fit()) else {
        return false;
    };
    if off(&fit_a.shape, &b.0).min(off(&fit_b.shape, &a.0)) > FAR {
        return false;
    }
    let samples: Vec<Sample> = a.0.iter().chain(&b.0).copied().collect();
    let both = decide(&samples, area);
    let scores = [&a.1, &b.1, &both].map(|evidence| {
        let is_shape = |c: &&shapes::Candidate| c.family.is_some();
        let best = evidence.candidates.iter().find(is_shape);
        best.map_or(f64::INFINITY, |candidate| candidate.score)
    });
    both.fit().is_some() && scores[2] <= scores[0] + scores[1]
}

/// The median distance of samples off a shape, in their deviations.
fn off(shape: &Shape, samples: &[Sample]) -> f64 {
    let off = |sample: &Sample| shape.distance_mm(&sample.point_mm).abs() / sample.sigma_mm;
    let mut off: Vec<f64> = samples.iter().map(off).collect();
    let middle = off.len() / 2;
    if off.is_empty() {
        return f64::INFINITY;
    }
    *off.select_nth_unstable_by(middle, f64::total_cmp).1
}
