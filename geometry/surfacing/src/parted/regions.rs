//! Which nodes a piece is made of: regions of the segmentation, joined as long as that costs no
//! control points.

use std::collections::{BTreeMap, BTreeSet};

use range_image::{Cancelled, Monitor, RangeImage, RegionMap};
use segment::{SegmentError, SegmentSettings};

use crate::error::SurfaceError;
use crate::grid::HeightGrid;
use crate::optimal;
use crate::parted::block::Block;
use crate::parted::settle::settle;

/// Regions begin where the direction changes by this, radians, and z jumps by this many pitches, or by
/// this many tolerances where that is less: lower than what parts a surface in the end, so that lines
/// that run out do so between regions.
const CREASE_RAD: f64 = 0.1;
const STEP_PITCHES: f64 = 1.0;
const STEP_TOLERANCES: f64 = 2.0;
/// Noise that there is to be for the segmentation, one standard deviation, in pitches, and as a share
/// of the tolerance.
const ROUGH_PITCHES: f64 = 0.01;
const ROUGHNESS: f64 = 0.5;
/// Fewest nodes of a region, and of a piece of one.
const FEWEST_NODES: usize = 12;
/// More regions than this are no free form, and would take hours to be held against each other.
const MOST_REGIONS: usize = 400;
/// Most nodes apart from all others: each becomes a face of its own.
const MOST_LONE: usize = 50;
/// A line is where z, carried on straight from both sides, jumps by the tolerance, or the slope over
/// one pitch by as much, and both by so much of the noise; a change of slope has to be this, too,
/// mm/mm.
const NOISES: f64 = 8.0;
const LEAST_TURN: f64 = 0.1;
/// Nodes beyond a smooth border that the pieces on both sides pass.
const BAND_NODES: usize = 2;
/// Nodes along a border for which a crease counts: amid noise the slope does not jump over each.
const CREASED_NODES: usize = 4;
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

/// What two regions cost as one: so much, or at least so much.
#[derive(Debug, Clone, Copy, Default)]
struct Joint {
    cost: usize,
    is_sure: bool,
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
) -> Result<Option<(RangeImage, RegionMap)>, SurfaceError> {
    let settings = SegmentSettings {
        crease_angle_rad: CREASE_RAD,
        step_factor: STEP_PITCHES.min(STEP_TOLERANCES * tolerance_mm / grid.pitch_mm()),
        minimum_nodes: FEWEST_NODES,
        bent_seeds: true,
        ..SegmentSettings::default()
    };
    let wanted_mm = (ROUGHNESS * tolerance_mm).min(ROUGH_PITCHES * grid.pitch_mm());
    let rough_mm = (wanted_mm * wanted_mm - grid.noise_mm() * grid.noise_mm()).max(0.0);
    let rough = roughened(image, rough_mm.sqrt());
    let map = match segment::segment(&rough, &settings, monitor) {
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
    settle(grid, &mut labels);
    let mut merging = Merging::new(grid, labels, tolerance_mm, monitor);
    if merging.borders.values().map(|b| b.sharp).sum::<usize>() < FEWEST_SHARP {
        return Ok(None);
    }
    merging.run()?;
    let mut labels = merging.finished();
    let Some(image) = with_lone(grid, image, &mut labels) else {
        return Ok(None);
    };
    let map = RegionMap::new(&image, labels);
    Ok((map.regions() > 1).then_some((image, map)))
}

/// Gives nodes apart from all others to the nearest region, and the masked nodes around them, too, so
/// that they are enough for a face; the image with those. `None` where they are too many.
fn with_lone(grid: &HeightGrid, image: &RangeImage, labels: &mut [u16]) -> Option<RangeImage> {
    let (columns, rows, z) = (grid.columns(), grid.rows(), grid.raw_z_mm());
    let lone: Vec<usize> = (0..z.len())
        .filter(|n| labels[*n] == 0 && !z[*n].is_nan())
        .collect();
    let mut whole = image.clone();
    if lone.len() > MOST_LONE {
        return None;
    }
    let place = |n: usize| [n / rows, n % rows];
    let before = labels.to_vec();
    for n in lone {
        let [i, j] = place(n);
        let off = |m: usize| {
            let [k, l] = place(m);
            k.abs_diff(i) * k.abs_diff(i) + l.abs_diff(j) * l.abs_diff(j)
        };
        let nearest = (0..before.len())
            .filter(|m| before[*m] != 0)
            .min_by_key(|m| off(*m))?;
        labels[n] = before[nearest];
        // Of the squares of four nodes around it that with the fewest neighbours of other regions.
        let corners = [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter();
        let squares = corners.filter_map(|[k, l]| {
            let (i, j) = (i.checked_sub(k)?, j.checked_sub(l)?);
            let is_within = i + 1 < columns && j + 1 < rows;
            is_within.then(|| {
                [[i, j], [i, j + 1], [i + 1, j], [i + 1, j + 1]].map(|[i, j]| i * rows + j)
            })
        });
        let is_other = |m: &usize| labels[*m] != 0 && labels[*m] != labels[n];
        let free = squares.filter(|nodes| !nodes.iter().any(&is_other));
        let touched = |nodes: &[usize; 4]| {
            let beside = nodes.iter().flat_map(|m| square(*m, 1, columns, rows));
            beside.filter(&is_other).count()
        };
        let nodes = free.min_by_key(touched)?;
        for m in nodes.into_iter().filter(|m| z[*m].is_nan()) {
            labels[m] = before[nearest];
            whole.set_z_mm(m / rows, m % rows, Some(z[n]));
        }
    }
    Some(whole)
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

/// All nodes so near to one.
pub(super) fn square(
    n: usize,
    reach: usize,
    columns: usize,
    rows: usize,
) -> impl Iterator<Item = usize> {
    let (i, j) = (n / rows, n % rows);
    let lines = i.saturating_sub(reach)..(i + reach + 1).min(columns);
    lines.flat_map(move |k| {
        (j.saturating_sub(reach)..(j + reach + 1).min(rows)).map(move |l| k * rows + l)
    })
}

/// The four neighbours of a node.
pub(super) fn around(n: usize, columns: usize, rows: usize) -> impl Iterator<Item = usize> {
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
    /// Of two as one, as far as it was looked for.
    joint: BTreeMap<(u16, u16), Joint>,
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

    /// Joins the pair that gains the most, one after the other. What two cost as one is only found
    /// out where that could be the most: it is no less than what either costs, or either with a part
    /// of the other did.
    fn run(&mut self) -> Result<(), Cancelled> {
        let all: BTreeSet<u16> = self.labels.iter().copied().filter(|l| *l > 0).collect();
        for label in all {
            let cost = self.cost(&[label])?;
            self.costs.insert(label, cost);
        }
        loop {
            let mut best: Option<(f64, (u16, u16))> = None;
            for (&pair, border) in &self.borders {
                let [a, b] = [pair.0, pair.1].map(|label| self.costs[&label]);
                let joint = self.joint.get(&pair).map_or(0, |joint| joint.cost);
                let price = SHARP_PRICE + (SMOOTH_PRICE - SHARP_PRICE) * border.smooth_share();
                let gain = (a + b) as f64 * price - joint.max(a).max(b) as f64;
                if gain >= 0.0 && best.is_none_or(|best| gain > best.0) {
                    best = Some((gain, pair));
                }
            }
            let Some((_, pair)) = best else {
                return Ok(());
            };
            match self.joint.get(&pair) {
                Some(joint) if joint.is_sure => self.join(pair.0, pair.1),
                _ => {
                    let cost = self.cost(&[pair.0, pair.1])?;
                    let is_sure = true;
                    self.joint.insert(pair, Joint { cost, is_sure });
                }
            }
        }
    }

    fn join(&mut self, kept: u16, lost: u16) {
        for label in &mut self.labels {
            if *label == lost {
                *label = kept;
            }
        }
        if let Some(joint) = self.joint.remove(&(kept, lost)) {
            self.costs.insert(kept, joint.cost);
        }
        self.costs.remove(&lost);
        let renamed = |l: u16| if l == lost { kept } else { l };
        let old: Vec<_> = core::mem::take(&mut self.joint).into_iter().collect();
        for ((a, b), joint) in old {
            let is_sure = joint.is_sure && ![a, b].iter().any(|l| *l == kept || *l == lost);
            let (a, b) = (renamed(a), renamed(b));
            let known = self.joint.entry((a.min(b), a.max(b))).or_default();
            let cost = joint.cost.max(known.cost);
            *known = Joint { cost, is_sure };
        }
        let old: Vec<_> = core::mem::take(&mut self.borders).into_iter().collect();
        for ((a, b), border) in old {
            let (a, b) = (renamed(a), renamed(b));
            if a != b {
                let all = self.borders.entry((a.min(b), a.max(b))).or_default();
                all.links += border.links;
                all.sharp += border.sharp;
            }
        }
    }

    /// The labels, with pieces that are too small or too thin for a face given to neighbours, or to
    /// none where there is none.
    fn finished(self) -> Vec<u16> {
        let mut labels = self.labels;
        settle(self.grid, &mut labels);
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        for piece in components(&labels, columns, rows) {
            if piece.len() < FEWEST_NODES || !is_broad(&labels, &piece, rows) {
                for n in piece {
                    labels[n] = 0;
                }
            }
        }
        take_in(self.grid, &mut labels);
        labels
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
    let turn_mm = sharp_turn_mm(grid, tolerance_mm);
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

/// The nodes beyond its own that a piece is to pass within the tolerance, too, by label less 1: those
/// of other pieces beside a border over which z goes on, so that both meet on it. Where the slope
/// jumps, pieces meet by themselves.
pub(super) fn bands(grid: &HeightGrid, map: &RegionMap, tolerance_mm: f64) -> Vec<BTreeSet<usize>> {
    let labels = map.raw_labels();
    let mut bands = vec![BTreeSet::new(); usize::from(map.regions())];
    let mut steps: BTreeSet<(u16, usize)> = BTreeSet::new();
    let mut creased: BTreeSet<(u16, u16, usize)> = BTreeSet::new();
    let all = links(grid, labels);
    let turn_mm = sharp_turn_mm(grid, tolerance_mm);
    let ends = |link: &Link| {
        let ([a, b], [n, m]) = (link.labels, link.nodes);
        [(a, m), (b, n)]
    };
    for link in &all {
        if link.jump_mm > tolerance_mm {
            steps.extend(ends(link));
        } else if link.turn_mm > turn_mm.max(0.5 * link.jump_mm) {
            let ([a, b], [n, _]) = (link.labels, link.nodes);
            let beside = square(n, CREASED_NODES, grid.columns(), grid.rows());
            creased.extend(beside.map(|n| (a.min(b), a.max(b), n)));
        }
    }
    for link in &all {
        let ([a, b], [n, _]) = (link.labels, link.nodes);
        if link.jump_mm > tolerance_mm || creased.contains(&(a.min(b), a.max(b), n)) {
            continue;
        }
        for (label, start) in ends(link) {
            let of = labels[start];
            let mut ring = vec![start];
            for _ in 0..BAND_NODES {
                ring.retain(|n| !steps.contains(&(label, *n)));
                if let Some(band) = bands.get_mut(usize::from(label) - 1) {
                    band.extend(ring.iter().copied());
                }
                let next = ring
                    .iter()
                    .flat_map(|n| around(*n, grid.columns(), grid.rows()));
                ring = next
                    .filter(|n| labels[*n] == of && !grid.raw_z_mm()[*n].is_nan())
                    .collect();
            }
        }
    }
    bands
}

/// The change of slope over one pitch at which there is a crease.
fn sharp_turn_mm(grid: &HeightGrid, tolerance_mm: f64) -> f64 {
    let jump_mm = tolerance_mm.max(NOISES * grid.noise_mm());
    jump_mm.max(LEAST_TURN * grid.pitch_mm())
}

/// Two neighbouring nodes of different regions.
pub(super) struct Link {
    pub(super) nodes: [usize; 2],
    pub(super) labels: [u16; 2],
    /// How far z, carried on straight from both, is apart in their middle.
    pub(super) jump_mm: f64,
    /// Change of slope from one to the other, over one pitch. At a crease between them, wherever it
    /// is, z so carried on jumps by half of it at most.
    pub(super) turn_mm: f64,
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
            if a == 0 || b == 0 || a == b || (z[n] + z[n + stride]).is_nan() {
                continue;
            }
            let before = has_before && labels[n - stride] == a && !z[n - stride].is_nan();
            let after = has_after && labels[n + 2 * stride] == b && !z[n + 2 * stride].is_nan();
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
