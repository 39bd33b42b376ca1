//! The border of a set of levels: pairs of neighbouring nodes, one inside and one beyond.

use range_image::RangeImage;

use crate::levels::{Levels, Sense};
use crate::regions::Regions;

/// One step over the border.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The node within.
    pub inner: usize,
    /// The node beyond.
    pub outer: usize,
    /// Level of the node beyond.
    pub beyond: u16,
    /// Whether z rises or falls from within to beyond.
    pub sense: Sense,
    /// Whether the node beyond can be reached from far away without entering the set; it lies in
    /// a hollow of it otherwise.
    pub outermost: bool,
}

/// A border, in the order of its inner nodes.
#[derive(Debug, Clone, Default)]
pub struct Border {
    /// Its pairs.
    pub pairs: Vec<Pair>,
    /// Inner nodes that lie at the frame of the image, where the scan ends.
    pub at_frame: usize,
    /// Nodes of the set.
    pub nodes: usize,
}

impl Border {
    /// How many of the outermost pairs go this way.
    #[must_use]
    pub fn outermost(&self, sense: Sense) -> usize {
        let outermost = self.pairs.iter().filter(|p| p.outermost);
        outermost.filter(|p| p.sense == sense).count()
    }
}

/// The border of the nodes whose level is one of these.
#[must_use]
pub fn border(
    image: &RangeImage,
    regions: &Regions,
    levels: &Levels,
    step_mm: f64,
    is_own: &dyn Fn(u16) -> bool,
) -> Border {
    let within: Vec<bool> = levels.labels.iter().map(|l| is_own(*l)).collect();
    let reached = reached(regions, &within);
    let mut found = Border::default();
    for node in 0..within.len() {
        if !within[node] {
            continue;
        }
        found.nodes += 1;
        if regions.at_frame(node) {
            found.at_frame += 1;
        }
        for other in regions.neighbours(node).filter(|o| !within[*o]) {
            found.pairs.push(Pair {
                inner: node,
                outer: other,
                beyond: levels.labels[other],
                sense: sense(image, regions, levels, (node, other), step_mm),
                outermost: reached[other],
            });
        }
    }
    found
}

/// Planes this many steps apart are so however softly the edge between them is seen.
const APART: f64 = 3.0;

/// Which way z goes over a border: by the nodes beside it, or else by the floors of both levels.
fn sense(
    image: &RangeImage,
    regions: &Regions,
    levels: &Levels,
    (node, other): (usize, usize),
    step_mm: f64,
) -> Sense {
    let near = crate::levels::sense(image, regions, (node, other), step_mm);
    let floor = |node: usize| {
        let level = levels.levels.get(usize::from(levels.labels[node]))?;
        let plane = level.plane.filter(|_| level.is_plane)?;
        let (column, row) = (node / regions.rows, node % regions.rows);
        Some(plane.z_mm(image.x_mm(column), image.y_mm(row)))
    };
    match (near, floor(node), floor(other)) {
        (Sense::Level, Some(here), Some(there)) if there - here > APART * step_mm => Sense::Rises,
        (Sense::Level, Some(here), Some(there)) if here - there > APART * step_mm => Sense::Falls,
        _ => near,
    }
}

/// Nodes that can be reached from the frame of what is within without entering it.
pub(crate) fn reached(regions: &Regions, within: &[bool]) -> Vec<bool> {
    let rows = regions.rows;
    let mut reached = vec![false; within.len()];
    let mut low = [usize::MAX; 2];
    let mut high = [0; 2];
    for (node, _) in within.iter().enumerate().filter(|(_, w)| **w) {
        let place = [node / rows, node % rows];
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    if low[0] == usize::MAX {
        return reached;
    }
    let columns = low[0].saturating_sub(1)..=(high[0] + 1).min(regions.columns - 1);
    let tall = low[1].saturating_sub(1)..=(high[1] + 1).min(rows - 1);
    let is_edge = |column: usize, row: usize| {
        column == *columns.start()
            || column == *columns.end()
            || row == *tall.start()
            || row == *tall.end()
    };
    let mut open = Vec::new();
    for column in columns.clone() {
        for row in tall.clone() {
            let node = column * rows + row;
            if is_edge(column, row) && !within[node] && !reached[node] {
                reached[node] = true;
                open.push(node);
            }
        }
    }
    while let Some(node) = open.pop() {
        for other in regions.neighbours(node) {
            let (column, row) = (other / rows, other % rows);
            let in_box = columns.contains(&column) && tall.contains(&row);
            if in_box && !within[other] && !reached[other] {
                reached[other] = true;
                open.push(other);
            }
        }
    }
    reached
}
