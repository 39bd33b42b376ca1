//! Areas that lie significantly beyond the limits.

use std::collections::BTreeSet;

use range_image::RangeImage;

use crate::patches::{DENSE, Decision, Mean, Patches};
use crate::pose::Pose;
use crate::seen::Seen;

/// Of a significant mean's patch those nodes belong to the region that deviate at least this
/// share as much.
const SHARE_OF_MEAN: f64 = 0.5;

/// A connected area that lies significantly beyond a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Where it is, as the mean of its nodes weighted by their deviation, in the scan's frame,
    /// millimetres.
    pub centre_mm: [f64; 3],
    /// The same in the nominal's frame.
    pub nominal_centre_mm: [f64; 3],
    /// Extent in x and y of the scan's frame, millimetres.
    pub size_mm: [f64; 2],
    /// Its area along the surface, square millimetres.
    pub area_mm2: f64,
    /// The greatest mean in it, over a patch of one of the two smallest sizes, with its sign,
    /// millimetres.
    pub deviation_mm: f64,
    /// Standard error of that deviation.
    pub standard_error_mm: f64,
    /// By how many standard errors a mean in it lies beyond the limit, at most.
    pub standard_errors: f64,
    /// Nodes in it.
    pub nodes: usize,
}

/// What a significant patch says of a node in it.
#[derive(Debug, Clone, Copy, Default)]
struct Mark {
    /// +1 above the upper limit, -1 below the lower, 0 without a mark.
    sign: f64,
    /// By how many standard errors the patch's mean lies beyond the limit.
    standard_errors: f64,
    /// The mean about the node itself, and its error.
    deviation_mm: f64,
    error_mm: f64,
}

/// What regions are made of.
pub(crate) struct Evidence<'a> {
    pub(crate) image: &'a RangeImage,
    pub(crate) patches: &'a [Patches],
    pub(crate) decision: &'a Decision,
    pub(crate) seen: &'a Seen,
    pub(crate) pose: &'a Pose,
}

/// The regions, that with the greatest deviation beyond its limit first, and for each node the
/// number of its region from 1, or 0.
pub(crate) fn regions(evidence: &Evidence<'_>) -> (Vec<Region>, Vec<u32>) {
    let dense: Vec<Vec<Option<Mean>>> = evidence
        .patches
        .iter()
        .take(DENSE)
        .map(|patches| evidence.by_node(patches))
        .collect();
    let mut marks = vec![Mark::default(); evidence.nodes()];
    evidence.for_each_significant(&dense, |node, mark| {
        if let Some(place) = marks.get_mut(node)
            && place.standard_errors < mark.standard_errors
        {
            *place = mark;
        }
    });
    let mut areas = Vec::new();
    let mut area_of = vec![usize::MAX; marks.len()];
    for start in 0..marks.len() {
        let sign = marks.get(start).map_or(0.0, |mark| mark.sign);
        if sign == 0.0 || area_of.get(start) != Some(&usize::MAX) {
            continue;
        }
        let nodes = evidence.connected(start, |node| {
            marks.get(node).is_some_and(|mark| mark.sign == sign)
        });
        for &node in &nodes {
            if let Some(place) = area_of.get_mut(node) {
                *place = areas.len();
            }
        }
        areas.push(nodes);
    }
    // A wide patch is significant by what lies somewhere in it; other nodes there that happen to
    // deviate the same way are no finding of their own.
    let mut votes = vec![false; areas.len()];
    let mut weights = vec![0.0; areas.len()];
    let mut voters: Vec<usize> = Vec::new();
    let mut vote = |weights: &mut Vec<f64>, voters: &mut Vec<usize>| {
        let best = voters
            .iter()
            .copied()
            .max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
        if let Some(best) = best {
            votes[best] = true;
        }
        voters.drain(..).for_each(|area| weights[area] = 0.0);
    };
    let mut patch = None;
    evidence.for_each_significant_of(&dense, |number, node, mark| {
        if patch != Some(number) {
            vote(&mut weights, &mut voters);
            patch = Some(number);
        }
        if let Some(&area) = area_of.get(node)
            && let Some(weight) = weights.get_mut(area)
        {
            if *weight == 0.0 {
                voters.push(area);
            }
            *weight += mark.deviation_mm.abs().max(1e-12);
        }
    });
    vote(&mut weights, &mut voters);

    let mut found: Vec<(Region, &Vec<usize>)> = areas
        .iter()
        .zip(&votes)
        .filter(|(_, is_voted)| **is_voted)
        .map(|(nodes, _)| (evidence.region(nodes, &marks), nodes))
        .collect();
    // The sort is stable: equals stay in the order of their nodes.
    found.sort_by(|a, b| {
        let beyond = |region: &Region| evidence.beyond(region.deviation_mm);
        beyond(&b.0).total_cmp(&beyond(&a.0))
    });
    let mut labels = vec![0; marks.len()];
    for (number, (_, nodes)) in (1..).zip(&found) {
        for &node in *nodes {
            if let Some(label) = labels.get_mut(node) {
                *label = number;
            }
        }
    }
    (
        found.into_iter().map(|(region, _)| region).collect(),
        labels,
    )
}

impl Evidence<'_> {
    fn rows(&self) -> usize {
        self.image.rows()
    }

    fn nodes(&self) -> usize {
        self.image.columns() * self.image.rows()
    }

    /// By how much a deviation lies beyond its limit; negative within.
    fn beyond(&self, deviation_mm: f64) -> f64 {
        (deviation_mm - self.decision.upper_mm).max(self.decision.lower_mm - deviation_mm)
    }

    fn sign(&self, deviation_mm: f64) -> f64 {
        if deviation_mm > self.decision.upper_mm {
            1.0
        } else if deviation_mm < self.decision.lower_mm {
            -1.0
        } else {
            0.0
        }
    }

    fn by_node(&self, patches: &Patches) -> Vec<Option<Mean>> {
        let mut means = vec![None; self.nodes()];
        for mean in &patches.means {
            if let Some(place) = means.get_mut(mean.column * self.rows() + mean.row) {
                *place = Some(*mean);
            }
        }
        means
    }

    fn for_each_significant(&self, dense: &[Vec<Option<Mean>>], mut tell: impl FnMut(usize, Mark)) {
        self.for_each_significant_of(dense, |_, node, mark| tell(node, mark));
    }

    /// Goes through the nodes in significant patches that deviate as these do. Patches are
    /// numbered in the order in which they come.
    fn for_each_significant_of(
        &self,
        dense: &[Vec<Option<Mean>>],
        mut tell: impl FnMut(usize, usize, Mark),
    ) {
        let mut number = 0;
        for (size, patches) in self.patches.iter().enumerate() {
            let Some(about) = dense.get(size).or(dense.last()) else {
                return;
            };
            let radius = patches.radius_mm / self.image.pitch_mm();
            let reach = radius.ceil() as usize;
            for mean in &patches.means {
                let standard_errors = self.beyond(mean.mean_mm) / mean.error_mm;
                if standard_errors.is_nan() || standard_errors < self.decision.standard_errors {
                    continue;
                }
                number += 1;
                let sign = self.sign(mean.mean_mm);
                let least_mm = SHARE_OF_MEAN * mean.mean_mm.abs();
                let last = (mean.column + reach + 1).min(self.image.columns());
                for column in mean.column.saturating_sub(reach)..last {
                    let top = (mean.row + reach + 1).min(self.rows());
                    for row in mean.row.saturating_sub(reach)..top {
                        let dx = column as f64 - mean.column as f64;
                        let dy = row as f64 - mean.row as f64;
                        let node = column * self.rows() + row;
                        let Some(Some(here)) = about.get(node) else {
                            continue;
                        };
                        let deviates =
                            here.mean_mm * sign >= least_mm && self.sign(here.mean_mm) == sign;
                        if deviates && dx * dx + dy * dy <= radius * radius {
                            let mark = Mark {
                                sign,
                                standard_errors,
                                deviation_mm: here.mean_mm,
                                error_mm: here.error_mm,
                            };
                            tell(number, node, mark);
                        }
                    }
                }
            }
        }
    }

    /// The nodes that are joined to one, side by side or across corners, and for which something
    /// holds.
    fn connected(&self, start: usize, holds: impl Fn(usize) -> bool) -> Vec<usize> {
        let rows = self.rows();
        let mut found = BTreeSet::from([start]);
        let mut open = vec![start];
        while let Some(node) = open.pop() {
            let (column, row) = (node / rows, node % rows);
            for c in column.saturating_sub(1)..(column + 2).min(self.image.columns()) {
                for r in row.saturating_sub(1)..(row + 2).min(rows) {
                    let next = c * rows + r;
                    if holds(next) && found.insert(next) {
                        open.push(next);
                    }
                }
            }
        }
        found.into_iter().collect()
    }

    fn region(&self, nodes: &[usize], marks: &[Mark]) -> Region {
        let (rows, pitch_mm) = (self.rows(), self.image.pitch_mm());
        let (i_first, j_first) = self.image.origin();
        let (mut sum, mut weight, mut area) = ([0.0; 3], 0.0, 0.0);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut worst = Mark::default();
        let mut standard_errors = 0.0_f64;
        for &node in nodes {
            let (column, row) = (node / rows, node % rows);
            let mark = marks.get(node).copied().unwrap_or_default();
            if worst.sign == 0.0 || self.beyond(mark.deviation_mm) > self.beyond(worst.deviation_mm)
            {
                worst = mark;
            }
            standard_errors = standard_errors.max(mark.standard_errors);
            let (x, y) = (self.image.x_mm(column), self.image.y_mm(row));
            let z = self.image.z_mm(column, row).unwrap_or(0.0);
            let share = mark.deviation_mm.abs().max(1e-12);
            for (sum, coordinate) in sum.iter_mut().zip([x, y, z]) {
                *sum += share * coordinate;
            }
            weight += share;
            let index = self
                .seen
                .index(i_first + column as i64, j_first + row as i64);
            let cosine = index
                .and_then(|index| self.seen.at(index))
                .map_or(1.0, |seen| seen.1);
            area += 1.0 / cosine.max(0.1);
            for (k, coordinate) in [x, y].into_iter().enumerate() {
                low[k] = low[k].min(coordinate - pitch_mm / 2.0);
                high[k] = high[k].max(coordinate + pitch_mm / 2.0);
            }
        }
        let centre_mm = sum.map(|sum| sum / weight.max(1e-300));
        Region {
            centre_mm,
            nominal_centre_mm: self.pose.apply(centre_mm),
            size_mm: [high[0] - low[0], high[1] - low[1]],
            area_mm2: area * pitch_mm * pitch_mm,
            deviation_mm: worst.deviation_mm,
            standard_error_mm: worst.error_mm,
            standard_errors,
            nodes: nodes.len(),
        }
    }
}
