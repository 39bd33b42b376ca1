//! All that is measured of one part.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Result;
use pipeline::{Outcome, RegionKind, Settings};
use relief_tests::score::{MachineClass, Overlaps, TruthClass, classify};
use shapes::Verdict;

use crate::edges::{self, Edges};
use crate::grid::{self, Deviation, Matched, OnGrid};
use crate::numbers::{Number, numbers};
use crate::part::{Kind, Part};
use crate::scan::{Scan, scan};
use crate::surface::TrueSurface;
use crate::trims::Trims;
use crate::truth_grid::{Mask, TruthGrid};

/// Share of its nodes that a true face and a region have in common, of either, to be the same:
/// the tolerance of Hoover et al., too.
pub(crate) const SAME: f64 = 0.8;
/// Faces of fewer nodes do not count.
pub(crate) const LEAST_NODES: usize = 100;

/// What was measured of a part.
pub(crate) struct Measured {
    pub(crate) seed: u64,
    pub(crate) name: String,
    /// Of the true faces, the parts that are seen, of enough nodes.
    pub(crate) faces: Vec<Face>,
    /// Regions of enough nodes that stand for nothing.
    pub(crate) noise: usize,
    /// Of each true face.
    pub(crate) kinds: Vec<Kind>,
    pub(crate) on_grid: OnGrid,
    pub(crate) sharp_edges: Edges,
    pub(crate) smooth_edges: Edges,
    pub(crate) mask: Mask,
    pub(crate) scan_s: f64,
    pub(crate) process_s: f64,
    pub(crate) outcome: Outcome,
    /// Of each true face, where it is of one of the families.
    pub(crate) true_of_face: Vec<Option<TrueSurface>>,
    /// Of each region, the true face that it stands for, where that is of one of the families.
    pub(crate) true_of_region: BTreeMap<u16, TrueSurface>,
}

impl Measured {
    /// Whether a true face has a region of its own, of the right kind.
    pub(crate) fn is_found(&self, face: usize) -> bool {
        let mut own = self.faces.iter().filter(|own| own.face == face).peekable();
        own.peek().is_some() && own.all(|own| own.class == TruthClass::Correct && own.is_right())
    }

    /// Of all true faces.
    pub(crate) fn deviation(&self) -> Deviation {
        let mut all = Deviation::default();
        for deviation in self.on_grid.deviations.values() {
            all.join(deviation);
        }
        all
    }

    /// How much is not as it should be: faces first, and then nodes.
    pub(crate) fn badness(&self) -> f64 {
        let is_off = |face: &&Face| face.class != TruthClass::Correct || !face.is_right();
        let faces = self.faces.iter().filter(is_off).count();
        faces as f64 + self.on_grid.wrong() as f64 / self.on_grid.nodes.max(1) as f64
    }
}

/// A true face, and what was found there.
pub(crate) struct Face {
    pub(crate) face: usize,
    pub(crate) kind: Kind,
    pub(crate) nodes: usize,
    pub(crate) class: TruthClass,
    /// It joins another face that counts smoothly.
    pub(crate) is_joined: bool,
    /// Nodes that regions share with it, by region.
    pub(crate) shares: Vec<(u16, usize)>,
    /// `None` where no region shares a node with it.
    pub(crate) found: Option<Found>,
}

/// The region that shares the most nodes with a face.
pub(crate) struct Found {
    /// `None` where the samples were too few to tell.
    pub(crate) kind: Option<Kind>,
    /// Where face and region are the same, and the kind is right.
    pub(crate) numbers: Vec<Number>,
}

impl Face {
    pub(crate) fn is_right(&self) -> bool {
        let found = self.found.as_ref().and_then(|found| found.kind);
        found == Some(self.kind)
    }
}

/// Scans a part and holds what comes out against it.
pub(crate) fn measure(part: &Part, change: impl Fn(&mut Settings)) -> Result<Measured> {
    let begun = Instant::now();
    let scan = scan(part)?;
    let scan_s = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    let (image, outcome) = scan.process(change)?;
    let process_s = begun.elapsed().as_secs_f64();

    let truth = &scan.truth;
    let labels = truth.gather(&image, outcome.regions.raw_labels(), (1, 1), 0);
    let overlaps = Overlaps::new(&truth.labels, &labels);
    let classes = classify(&overlaps, SAME, |label| truth.counts(label), LEAST_NODES);
    let counted = truth
        .regions
        .iter()
        .filter(|region| region.nodes >= LEAST_NODES);
    let counting: Vec<usize> = counted.clone().map(|region| region.face.face).collect();
    let faces: Vec<Face> = counted
        .map(|region| {
            let class = classes.truth.get(&region.label);
            Face {
                face: region.face.face,
                kind: part.kind(region.face.face),
                nodes: region.nodes,
                class: class.copied().unwrap_or(TruthClass::Missed),
                shares: overlaps
                    .pairs()
                    .filter(|(own, _, _)| *own == region.label)
                    .map(|(_, other, nodes)| (other, nodes))
                    .collect(),
                is_joined: part.joins(region.face.face, &counting),
                found: found(
                    part,
                    &scan,
                    &outcome,
                    &overlaps,
                    region.label,
                    region.face.face,
                ),
            }
        })
        .collect();

    let matched = matched(&scan, &overlaps, &faces);
    let model = &outcome.reconstruction.model;
    let on_grid_truth = TruthGrid::new(part, &scan.scanner);
    let on_grid = grid::compare(part, &on_grid_truth, &Trims::new(model), &matched);
    let known = scan.known_faces(&part.faces);
    let (sharp_edges, smooth_edges) =
        edges::compare(&part.edges, model, &on_grid_truth, &matched, &known)?;
    let noise = classes.machine.iter().filter(|(label, class)| {
        **class == MachineClass::Noise && overlaps.machine_nodes(**label) >= LEAST_NODES
    });
    let faces_of = matched.face_of_region.iter();
    let true_of_region = faces_of
        .filter_map(|(region, face)| Some((*region, part.faces.get(*face).copied().flatten()?)))
        .collect();
    Ok(Measured {
        seed: part.seed,
        name: part.name.clone(),
        noise: noise.count(),
        kinds: (0..part.faces.len()).map(|face| part.kind(face)).collect(),
        faces,
        on_grid,
        sharp_edges,
        smooth_edges,
        mask: on_grid_truth.mask(&part.edges),
        scan_s,
        process_s,
        outcome,
        true_of_face: part.faces.clone(),
        true_of_region,
    })
}

fn found(
    part: &Part,
    scan: &Scan,
    outcome: &Outcome,
    overlaps: &Overlaps,
    label: u16,
    face: usize,
) -> Option<Found> {
    let pairs = overlaps.pairs().filter(|&(own, _, _)| own == label);
    let (_, region, common) = pairs.max_by_key(|&(_, other, common)| (common, u16::MAX - other))?;
    let is_most = |whole: usize| common as f64 >= SAME * whole as f64;
    let is_same = is_most(overlaps.truth_nodes(label)) && is_most(overlaps.machine_nodes(region));
    let mut kinds = outcome.kinds.iter();
    let own = kinds.find(|kind| kind.label.get() == region);
    let verdict = own.map(|kind| &kind.evidence.verdict);
    let kind = match verdict {
        Some(Verdict::Shape(fit)) => Some(Kind::Of(fit.shape.family())),
        Some(Verdict::Swept(_)) => Some(Kind::Swept),
        Some(Verdict::FreeForm) => Some(Kind::FreeForm),
        Some(Verdict::Unknown) | None => None,
    };
    let real = part.faces.get(face).copied().flatten();
    let told = match (own.and_then(RegionKind::told), real) {
        (Some((shape, told)), Some(real)) if is_same => {
            let (readings, inner) = scan.readings_of(label, face);
            numbers(&shape, &told, &real, &readings, &inner)
        }
        _ => None,
    };
    Some(Found {
        kind,
        numbers: told.unwrap_or_default(),
    })
}

/// A region stands for the true face that it shares the most nodes with.
fn matched(scan: &Scan, overlaps: &Overlaps, faces: &[Face]) -> Matched {
    let face_of: BTreeMap<u16, usize> = scan
        .truth
        .regions
        .iter()
        .map(|region| (region.label, region.face.face))
        .collect();
    let mut most: BTreeMap<u16, (usize, usize)> = BTreeMap::new();
    let mut shared: BTreeMap<(u16, usize), usize> = BTreeMap::new();
    for (own, region, common) in overlaps.pairs() {
        if let Some(face) = face_of.get(&own) {
            *shared.entry((region, *face)).or_default() += common;
        }
    }
    for ((region, face), common) in shared {
        let best = most.entry(region).or_insert((face, common));
        if common > best.1 {
            *best = (face, common);
        }
    }
    let is_found = |face: &&Face| face.class == TruthClass::Correct;
    Matched {
        face_of_region: most
            .into_iter()
            .map(|(region, (face, _))| (region, face))
            .collect(),
        found_faces: faces
            .iter()
            .filter(is_found)
            .map(|face| face.face)
            .collect(),
    }
}
