//! Which nodes a piece is made of: regions of the segmentation, joined as long as that costs no
//! control points.

use std::collections::{BTreeMap, BTreeSet};

use range_image::{Cancelled, Monitor, RangeImage, RegionMap};
use segment::{SegmentError, SegmentSettings};

use crate::error::SurfaceError;
use crate::grid::HeightGrid;
use crate::optimal;
use crate::parted::block::Block;

/// Regions begin where the direction changes by this, radians, and z jumps by this many pitches:
/// lower than what parts a surface in the end, so that lines that run out do so between regions.
const CREASE_RAD: f64 = 0.1;
const STEP_PITCHES: f64 = 1.0;
/// Noise that there is to be for the segmentation, one standard deviation, in pitches, and as a share
/// of the tolerance.
const ROUGH_PITCHES: f64 = 0.01;
const ROUGHNESS: f64 = 0.5;
/// Fewest nodes of a region, and of a piece of one.
const FEWEST_NODES: usize = 12;
/// More regions than this are no free form, and would take hours to be held against each other.
const MOST_REGIONS: usize = 400;
/// A line is where z, carried on straight from both sides, jumps by the tolerance, or the slope over
/// one pitch by as much, and both by so much of the noise; a change of slope has to be this, too,
/// mm/mm.
const NOISES: f64 = 8.0;
const LEAST_TURN: f64 = 0.1;
/// Fewest pairs of nodes over which z or the slope jumps for there to be a line.
const FEWEST_SHARP: usize = 8;
/// Regions are joined where one surface over both takes no more than this many times the control
/// points of two: along a border that is a character line, and along one that is none at all.
const SHARP_PRICE: f64 = 0.75;
const SMOOTH_PRICE: f64 = 1.25;

/// What two regions have in common.
#[derive(Debug, Clone, Copy, Default)]
struct Border {
    /// Pairs of neighbouring nodes across it, and those over which z or the slope jumps.
    links: usize,
    sharp: usize,
}

impl Border {
    fn smooth_share(self) -> f64 {
        1.0 - self.sharp as f64 / self.links.max(1) as f64
    }
}

/// The regions that pieces are made of; one where nothing is gained by more.
///
/// # Errors
/// [`SurfaceError::Cancelled`] at the monitor's wish.
pub(super) fn regions(
    grid: &HeightGrid,
    image: &RangeImage,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<RegionMap>, SurfaceError> {
    let settings = SegmentSettings {
        crease_angle_rad: CREASE_RAD,
        step_factor: STEP_PITCHES,
        minimum_nodes: FEWEST_NODES,
        ..SegmentSettings::default()
    };
    let wanted_mm = (ROUGHNESS * tolerance_mm).min(ROUGH_PITCHES * grid.pitch_mm());
    let rough_mm = (wanted_mm * wanted_mm - grid.noise_mm() * grid.noise_mm()).max(0.0);
    let image = &roughened(image, rough_mm.sqrt());
    let map = match segment::segment(image, &settings, monitor) {
        Ok(map) => map,
        Err(SegmentError::Cancelled(cancelled)) => return Err(cancelled.into()),
        // Out of the segmentation's reach: one piece, as ever.
        Err(_) => return Ok(None),
    };
    let count = usize::from(map.regions());
    if !(2..=MOST_REGIONS).contains(&count) {
        return Ok(None);
    }
    let mut labels = map.raw_labels().to_vec();
    take_in(grid, &mut labels);
    let mut merging = Merging::new(grid, labels, tolerance_mm, monitor);
    if merging.borders.values().map(|b| b.sharp).sum::<usize>() < FEWEST_SHARP {
        return Ok(None);
    }
    merging.run()?;
    let map = RegionMap::new(image, merging.finished());
    Ok((map.regions() > 1).then_some(map))
}

/// The image with noise of a known size: the segmentation measures noise, and takes for shape what
/// stands out of it, down to what no tolerance asks for where there is none.
fn roughened(image: &RangeImage, deviation_mm: f64) -> RangeImage {
    let (mut rough, rows) = (image.clone(), image.rows());
    let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for n in 0..image.raw_z_mm().len() {
        // Of three uniform draws the sum has a variance of a quarter.
        let draw = 2.0 * (uniform() + uniform() + uniform() - 1.5);
        if let Some(z_mm) = image.z_mm(n / rows, n % rows) {
            rough.set_z_mm(n / rows, n % rows, Some(z_mm + deviation_mm * draw));
        }
    }
    rough
}

/// The four neighbours of a node.
fn around(n: usize, columns: usize, rows: usize) -> impl Iterator<Item = usize> {
    let (i, j) = (n / rows, n % rows);
    let beside = [
        (i > 0).then(|| n - rows),
        (i + 1 < columns).then(|| n + rows),
        (j > 0).then(|| n - 1),
        (j + 1 < rows).then(|| n + 1),
    ];
    beside.into_iter().flatten()
}

/// Gives nodes without a region to the neighbour whose surface, carried on straight, comes
/// nearest to them; from the regions outwards.
fn take_in(grid: &HeightGrid, labels: &mut [u16]) {
    let (columns, rows, z) = (grid.columns(), grid.rows(), grid.raw_z_mm());
    loop {
        let mut taken = Vec::new();
        for n in 0..z.len() {
            if labels[n] != 0 || z[n].is_nan() {
                continue;
            }
            let mut best: Option<(f64, u16)> = None;
            for beside in around(n, columns, rows).filter(|b| labels[*b] != 0) {
                let label = labels[beside];
                let further = (2 * beside).checked_sub(n).filter(|further| {
                    let is_in_line = around(beside, columns, rows).any(|b| b == *further);
                    is_in_line && labels.get(*further) == Some(&label)
                });
                let carried = further.map_or(z[beside], |further| 2.0 * z[beside] - z[further]);
                let off = (z[n] - carried).abs();
                if best.is_none_or(|best| (off, label) < best) {
                    best = Some((off, label));
                }
            }
            if let Some((_, label)) = best {
                taken.push((n, label));
            }
        }
        if taken.is_empty() {
            return;
        }
        for (n, label) in taken {
            labels[n] = label;
        }
    }
}

/// Regions that are joined where that costs nothing.
struct Merging<'a> {
    grid: &'a HeightGrid,
    labels: Vec<u16>,
    tolerance_mm: f64,
    monitor: &'a dyn Monitor,
    costs: BTreeMap<u16, usize>,
    borders: BTreeMap<(u16, u16), Border>,
    /// Costs of two as one.
    joint: BTreeMap<(u16, u16), usize>,
}

impl<'a> Merging<'a> {
    fn new(
        grid: &'a HeightGrid,
        labels: Vec<u16>,
        tolerance_mm: f64,
        monitor: &'a dyn Monitor,
    ) -> Self {
        Self {
            borders: borders(grid, &labels, tolerance_mm),
            grid,
            labels,
            tolerance_mm,
            monitor,
            costs: BTreeMap::new(),
            joint: BTreeMap::new(),
        }
    }

    /// About how many control points a surface over these regions takes.
    fn cost(&self, of: &[u16]) -> Result<usize, Cancelled> {
        self.monitor.check()?;
        let Some(block) = Block::of(self.grid, |n| of.contains(&self.labels[n])) else {
            return Ok(0);
        };
        optimal::estimate(&block.grid, self.tolerance_mm, self.monitor)
    }

    fn run(&mut self) -> Result<(), Cancelled> {
        let all: BTreeSet<u16> = self.labels.iter().copied().filter(|l| *l > 0).collect();
        for label in all {
            let cost = self.cost(&[label])?;
            self.costs.insert(label, cost);
        }
        loop {
            let mut best: Option<(f64, (u16, u16))> = None;
            let pairs: Vec<(u16, u16)> = self.borders.keys().copied().collect();
            for pair in pairs {
                let joint = match self.joint.get(&pair) {
                    Some(joint) => *joint,
                    None => {
                        let joint = self.cost(&[pair.0, pair.1])?;
                        self.joint.insert(pair, joint);
                        joint
                    }
                };
                let apart = self.costs[&pair.0] + self.costs[&pair.1];
                let smooth = self.borders[&pair].smooth_share();
                let price = SHARP_PRICE + (SMOOTH_PRICE - SHARP_PRICE) * smooth;
                let gain = apart as f64 * price - joint as f64;
                if gain >= 0.0 && best.is_none_or(|best| gain > best.0) {
                    best = Some((gain, pair));
                }
            }
            let Some((_, (kept, lost))) = best else {
                return Ok(());
            };
            self.join(kept, lost);
        }
    }

    fn join(&mut self, kept: u16, lost: u16) {
        for label in &mut self.labels {
            if *label == lost {
                *label = kept;
            }
        }
        if let Some(cost) = self.joint.get(&(kept, lost)) {
            self.costs.insert(kept, *cost);
        }
        self.costs.remove(&lost);
        self.joint
            .retain(|(a, b), _| ![*a, *b].iter().any(|l| *l == kept || *l == lost));
        let old: Vec<_> = core::mem::take(&mut self.borders).into_iter().collect();
        for ((a, b), border) in old {
            let renamed = |l: u16| if l == lost { kept } else { l };
            let (a, b) = (renamed(a), renamed(b));
            if a != b {
                let all = self.borders.entry((a.min(b), a.max(b))).or_default();
                all.links += border.links;
                all.sharp += border.sharp;
            }
        }
    }

    /// The labels, with pieces that are too small or too thin for a face given to a neighbour.
    fn finished(self) -> Vec<u16> {
        let mut labels = self.labels;
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        loop {
            let pieces = components(&labels, columns, rows);
            let small: Vec<&Vec<usize>> = pieces
                .iter()
                .filter(|piece| piece.len() < FEWEST_NODES || !is_broad(&labels, piece, rows))
                .collect();
            let mut lone = vec![false; labels.len()];
            for n in small.into_iter().flatten() {
                lone[*n] = true;
            }
            let before = labels.clone();
            for (label, is_lone) in labels.iter_mut().zip(&lone) {
                if *is_lone {
                    *label = 0;
                }
            }
            take_in(self.grid, &mut labels);
            if labels == before {
                return labels;
            }
        }
    }
}

/// Connected nodes of one label.
fn components(labels: &[u16], columns: usize, rows: usize) -> Vec<Vec<usize>> {
    let mut is_seen: Vec<bool> = labels.iter().map(|label| *label == 0).collect();
    let mut pieces = Vec::new();
    for start in 0..labels.len() {
        if is_seen[start] {
            continue;
        }
        is_seen[start] = true;
        let (mut piece, mut next) = (vec![start], 0);
        while next < piece.len() {
            for beside in around(piece[next], columns, rows) {
                if !is_seen[beside] && labels[beside] == labels[start] {
                    is_seen[beside] = true;
                    piece.push(beside);
                }
            }
            next += 1;
        }
        pieces.push(piece);
    }
    pieces
}

/// Whether a piece is somewhere two nodes wide both ways.
fn is_broad(labels: &[u16], piece: &[usize], rows: usize) -> bool {
    piece.iter().any(|&n| {
        let label = Some(&labels[n]);
        (n % rows) + 1 < rows
            && [n + 1, n + rows, n + rows + 1]
                .iter()
                .all(|&other| labels.get(other) == label)
    })
}

/// What each two neighbouring regions have in common.
fn borders(grid: &HeightGrid, labels: &[u16], tolerance_mm: f64) -> BTreeMap<(u16, u16), Border> {
    let noise_mm = grid.noise_mm();
    let jump_mm = tolerance_mm.max(NOISES * noise_mm);
    let turn_mm = jump_mm.max(LEAST_TURN * grid.pitch_mm());
    let mut borders: BTreeMap<(u16, u16), Border> = BTreeMap::new();
    for link in links(grid, labels) {
        let [a, b] = link.labels;
        let border = borders.entry((a.min(b), a.max(b))).or_default();
        border.links += 1;
        let is_sharp = link.jump_mm > jump_mm || link.turn_mm > turn_mm.max(0.5 * link.jump_mm);
        border.sharp += usize::from(is_sharp);
    }
    borders
}

/// Two neighbouring nodes of different regions.
pub(super) struct Link {
    pub(super) nodes: [usize; 2],
    pub(super) labels: [u16; 2],
    /// How far z, carried on straight from both, is apart in their middle.
    pub(super) jump_mm: f64,
    /// Change of slope from one to the other, over one pitch.
    turn_mm: f64,
}

/// All of them.
pub(super) fn links(grid: &HeightGrid, labels: &[u16]) -> Vec<Link> {
    let (columns, rows, z) = (grid.columns(), grid.rows(), grid.raw_z_mm());
    let mut links = Vec::new();
    for n in 0..labels.len() {
        let (i, j) = (n / rows, n % rows);
        let ahead = [
            (i + 1 < columns, rows, i > 0, i + 2 < columns),
            (j + 1 < rows, 1, j > 0, j + 2 < rows),
        ];
        for (_, stride, has_before, has_after) in ahead.into_iter().filter(|a| a.0) {
            let (a, b) = (labels[n], labels[n + stride]);
            if a == 0 || b == 0 || a == b {
                continue;
            }
            let before = has_before && labels[n - stride] == a;
            let after = has_after && labels[n + 2 * stride] == b;
            let slope_a = before.then(|| z[n] - z[n - stride]);
            let slope_b = after.then(|| z[n + 2 * stride] - z[n + stride]);
            let (s, t) = match (slope_a, slope_b) {
                (Some(s), Some(t)) => (s, t),
                (Some(s), None) | (None, Some(s)) => (s, s),
                (None, None) => (0.0, 0.0),
            };
            links.push(Link {
                nodes: [n, n + stride],
                labels: [a, b],
                jump_mm: (z[n + stride] - z[n] - (s + t) / 2.0).abs(),
                turn_mm: (t - s).abs(),
            });
        }
    }
    links
}
