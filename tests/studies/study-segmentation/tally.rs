//! From the labels of one scene to the figures of a set.

use range_image::RangeImage;
use relief_tests::scenes::{LEAST_NODES, View};
use relief_tests::score::{MachineClass, Overlaps, TruthClass, classify};

use crate::material::Subject;
use crate::methods::{Labelled, Method};

/// Tolerances of the tables.
pub(crate) const TOLERANCES: [f64; 6] = [0.51, 0.6, 0.7, 0.8, 0.9, 0.95];
/// The tolerance of the bars, and of the list of failures.
pub(crate) const BAR: f64 = 0.8;

/// What one method made of one scene.
#[derive(Debug)]
pub(crate) struct Finding {
    pub(crate) method: Method,
    pub(crate) seed: u64,
    pub(crate) kind: String,
    pub(crate) seconds: f64,
    /// Truth nodes, and those with a value in the range image.
    pub(crate) nodes: (usize, usize),
    pub(crate) at: Vec<Counts>,
    /// What failed at [`BAR`].
    pub(crate) failures: Vec<Failure>,
    /// Truth regions too small to count.
    pub(crate) small: usize,
    /// Regions that count, and the correct ones among them at [`BAR`], by [`DEPTHS`].
    pub(crate) by_depth: [(usize, usize); 4],
}

/// Least depths of the classes of slivers: nodes from the border to the innermost one.
pub(crate) const DEPTHS: [usize; 4] = [1, 2, 3, 6];

/// Regions that count, by their class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) correct: usize,
    pub(crate) over: usize,
    pub(crate) under: usize,
    pub(crate) missed: usize,
    pub(crate) noise: usize,
}

impl Counts {
    pub(crate) fn regions(self) -> usize {
        self.correct + self.over + self.under + self.missed
    }

    pub(crate) fn correct_share(self) -> f64 {
        self.correct as f64 / self.regions().max(1) as f64
    }

    fn add(&mut self, other: Self) {
        self.correct += other.correct;
        self.over += other.over;
        self.under += other.under;
        self.missed += other.missed;
        self.noise += other.noise;
    }
}

/// A region that is not as it should be.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) what: &'static str,
    pub(crate) label: u16,
    /// Nodes that the scanner sees (truth), or that the method gave the label.
    pub(crate) nodes: usize,
    /// Nodes from the border to the innermost: slivers have few.
    pub(crate) depth: usize,
    /// Share of nodes with a value.
    pub(crate) valued: f64,
    /// Column and row of a node of it, in the picture of truth and labels.
    pub(crate) at: (usize, usize),
    /// Labels on the other side that share nodes with it, and how many.
    pub(crate) shares: Vec<(u16, usize)>,
}

/// Compares the labels with the truth.
///
/// Nodes that the regridder left without a value belong to no region, in the truth neither:
/// the methods are judged by what they were given. Whether a region counts goes by all that
/// the scanner sees of it.
pub(crate) fn judge(
    subject: &Subject,
    image: &RangeImage,
    view: View,
    labelled: &Labelled,
) -> Finding {
    let truth = &subject.truth;
    let z_mm = truth.gather(image, image.raw_z_mm(), view.factor(), f64::NAN);
    let machine = truth.gather(image, &labelled.labels, view.factor(), 0);
    let given: Vec<u16> = truth
        .labels
        .iter()
        .zip(&z_mm)
        .map(|(label, z)| if z.is_nan() { 0 } else { *label })
        .collect();
    let overlaps = Overlaps::new(&given, &machine);
    let mut at = Vec::new();
    let mut failures = Vec::new();
    let mut by_depth = [(0, 0); 4];
    for tolerance in TOLERANCES {
        let classes = classify(&overlaps, tolerance, |t| truth.counts(t), LEAST_NODES);
        let mut counts = Counts::default();
        for region in truth.regions.iter().filter(|region| region.counts()) {
            // A region without any node left is not in the overlaps.
            let class = classes.truth.get(&region.label);
            let class = class.copied().unwrap_or(TruthClass::Missed);
            let (depth, place) = if tolerance == BAR {
                innermost(&truth.labels, truth.rows, region.label)
            } else {
                (0, (0, 0))
            };
            let deep = DEPTHS.iter().rposition(|least| depth >= *least);
            if let Some(slot) = deep.and_then(|k| by_depth.get_mut(k)) {
                slot.0 += 1;
                slot.1 += usize::from(class == TruthClass::Correct);
            }
            let what = match class {
                TruthClass::Correct => {
                    counts.correct += 1;
                    continue;
                }
                TruthClass::Over => {
                    counts.over += 1;
                    "over"
                }
                TruthClass::Under => {
                    counts.under += 1;
                    "under"
                }
                TruthClass::Missed => {
                    counts.missed += 1;
                    "missed"
                }
            };
            if tolerance == BAR {
                failures.push(Failure {
                    what,
                    label: region.label,
                    nodes: region.nodes,
                    depth,
                    valued: overlaps.truth_nodes(region.label) as f64 / region.nodes as f64,
                    at: place,
                    shares: overlaps
                        .pairs()
                        .filter(|pair| pair.0 == region.label)
                        .map(|(_, m, nodes)| (m, nodes))
                        .collect(),
                });
            }
        }
        for (label, class) in &classes.machine {
            let nodes = overlaps.machine_nodes(*label);
            if *class != MachineClass::Noise || nodes < LEAST_NODES {
                continue;
            }
            counts.noise += 1;
            if tolerance == BAR {
                let (depth, at) = innermost(&machine, truth.rows, *label);
                failures.push(Failure {
                    what: "noise",
                    label: *label,
                    nodes,
                    depth,
                    valued: 1.0,
                    at,
                    shares: overlaps
                        .pairs()
                        .filter(|pair| pair.1 == *label)
                        .map(|(t, _, nodes)| (t, nodes))
                        .collect(),
                });
            }
        }
        at.push(counts);
    }
    Finding {
        method: labelled.method,
        seed: subject.seed,
        kind: subject.kind.clone(),
        seconds: labelled.seconds,
        nodes: (
            truth.labels.iter().filter(|l| **l != 0).count(),
            given.iter().filter(|l| **l != 0).count(),
        ),
        at,
        failures,
        small: truth.regions.iter().filter(|r| !r.counts()).count(),
        by_depth,
    }
}

/// How deep a region is: the node farthest from any other label by columns and rows, and that
/// distance.
fn innermost(labels: &[u16], rows: usize, label: u16) -> (usize, (usize, usize)) {
    let columns = labels.len() / rows.max(1);
    let inside = |c: i64, r: i64| {
        let (Ok(c), Ok(r)) = (usize::try_from(c), usize::try_from(r)) else {
            return false;
        };
        c < columns && r < rows && labels[c * rows + r] == label
    };
    let mut best = (0, (0, 0));
    for (node, _) in labels.iter().enumerate().filter(|(_, l)| **l == label) {
        let (column, row) = ((node / rows) as i64, (node % rows) as i64);
        // Only look for a deeper square than the best so far.
        let mut depth = best.0 as i64;
        let square = |depth: i64| {
            (-depth..=depth).all(|d| {
                inside(column + d, row - depth)
                    && inside(column + d, row + depth)
                    && inside(column - depth, row + d)
                    && inside(column + depth, row + d)
            })
        };
        if !(0..=depth).all(square) {
            continue;
        }
        while square(depth + 1) {
            depth += 1;
        }
        best = (depth as usize + 1, (node / rows, node % rows));
    }
    best
}

/// The figures of a method on a set.
#[derive(Debug)]
pub(crate) struct Tally {
    pub(crate) method: Method,
    pub(crate) scenes: usize,
    pub(crate) small: usize,
    pub(crate) nodes: (usize, usize),
    pub(crate) seconds: f64,
    pub(crate) at: Vec<Counts>,
    pub(crate) by_depth: [(usize, usize); 4],
}

impl Tally {
    /// Adds up the findings of a method.
    pub(crate) fn of<'a>(method: Method, findings: impl Iterator<Item = &'a Finding>) -> Self {
        let mut tally = Self {
            method,
            scenes: 0,
            small: 0,
            nodes: (0, 0),
            seconds: 0.0,
            at: vec![Counts::default(); TOLERANCES.len()],
            by_depth: [(0, 0); 4],
        };
        for finding in findings.filter(|finding| finding.method == method) {
            tally.scenes += 1;
            tally.small += finding.small;
            tally.nodes.0 += finding.nodes.0;
            tally.nodes.1 += finding.nodes.1;
            tally.seconds += finding.seconds;
            for (sum, counts) in tally.at.iter_mut().zip(&finding.at) {
                sum.add(*counts);
            }
            for (sum, found) in tally.by_depth.iter_mut().zip(finding.by_depth) {
                *sum = (sum.0 + found.0, sum.1 + found.1);
            }
        }
        tally
    }

    /// The counts at [`BAR`].
    pub(crate) fn bar(&self) -> Counts {
        let at = TOLERANCES.iter().position(|t| *t == BAR);
        at.and_then(|k| self.at.get(k)).copied().unwrap_or_default()
    }

    pub(crate) fn noise_per_scene(&self) -> f64 {
        self.bar().noise as f64 / self.scenes.max(1) as f64
    }
}
