//! To which region a sample belongs.

use core::ops::Range;

use range_image::{RangeImage, RegionMap};
use rayon::prelude::*;

use crate::NodeRole;
use crate::neighbourhood::{depth, rise};

/// How far a node may be from which it is told where its surface runs at a sample, nodes.
const REACH: usize = 3;
/// Depth in its region of such a node, nodes: its slope needs both neighbours.
const INNER: u8 = 1;
/// How far a sample may lie from the surface, in pitches along it and per square pitch of
/// distance from the node: surfaces bend.
const NEAR: f64 = 0.3;
const BEND: f64 = 0.15;
/// Steeper surfaces do not allow for more.
const STEEPEST: f64 = 4.0;

/// What a part stands on or before, and was left out.
#[derive(Clone, Copy)]
pub(crate) struct Removed<'a> {
    /// With its nodes.
    pub(crate) image: &'a RangeImage,
    /// What each node counts as.
    pub(crate) roles: &'a [NodeRole],
}

/// A sample whose nearest node lies so far beside it at most, of half a pitch, is nearer to it than
/// to any other for certain, whatever rounding does.
const NEAREST: f64 = 0.49;

/// What tells to which region samples belong.
pub(super) struct Owners<'a> {
    image: &'a RangeImage,
    regions: &'a RegionMap,
    removed: Option<Removed<'a>>,
    /// Of each node, whether regions meet within [`REACH`] of it.
    is_edge: Vec<bool>,
}

/// A sample as regions see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Owner {
    /// Its region; 0 for none.
    pub(super) region: u16,
    /// An outline may be near.
    pub(super) is_edge: bool,
    /// Its surface meets one near it that was left out: the samples go on there, and tell nothing
    /// of where the part ends.
    pub(super) is_foot: bool,
}

impl<'a> Owners<'a> {
    pub(super) fn new(
        image: &'a RangeImage,
        regions: &'a RegionMap,
        removed: Option<Removed<'a>>,
    ) -> Self {
        Self {
            is_edge: edges(regions),
            image,
            regions,
            removed,
        }
    }

    pub(super) fn pitch_mm(&self) -> f64 {
        self.image.pitch_mm()
    }

    /// The region of a point whose surface passes by it.
    pub(super) fn of(&self, x_mm: f64, y_mm: f64, z_mm: f64) -> Owner {
        let (image, regions) = (self.image, self.regions);
        let pitch_mm = image.pitch_mm();
        let place = [
            (x_mm - image.x_mm(0)) / pitch_mm,
            (y_mm - image.y_mm(0)) / pitch_mm,
        ];
        let nodes = [image.columns(), image.rows()];
        let around = |d: usize| {
            let middle = place[d].round();
            let low = (middle - REACH as f64).max(0.0) as usize;
            let high = (middle + REACH as f64 + 1.0).clamp(0.0, nodes[d] as f64) as usize;
            low..high
        };
        let window = [around(0), around(1)];
        let is_whole = window.iter().all(|range| range.len() == 2 * REACH + 1);
        let middle = [0, 1].map(|d| window[d].start + REACH);
        // The grid may end where the part does.
        let is_edge = !is_whole || self.is_edge[middle[0] * nodes[1] + middle[1]];
        let off = |[column, row]: [usize; 2]| [place[0] - column as f64, place[1] - row as f64];
        let none = Owner {
            region: 0,
            is_edge,
            is_foot: false,
        };
        if !is_edge && regions.label(middle[0], middle[1]) == 0 {
            return none;
        }
        let is_nearest = is_whole && off(middle).iter().all(|off| off.abs() <= NEAREST);
        let slope = |node: [usize; 2]| self.passes(node, off(node), z_mm);
        let best = match slope(middle).filter(|_| is_nearest) {
            Some(slope) => Some((middle, slope)),
            None => {
                let mut best = (f64::INFINITY, None);
                for node in all(&window) {
                    let [x, y] = off(node);
                    let distance2 = x * x + y * y;
                    if distance2 < best.0
                        && let Some(slope) = slope(node)
                    {
                        best = (distance2, Some((node, slope)));
                    }
                }
                best.1
            }
        };
        let Some((node, slope)) = best else {
            return none;
        };
        Owner {
            region: regions.label(node[0], node[1]),
            is_edge,
            is_foot: is_edge && all(&window).any(|other| self.meets(node, slope, other)),
        }
    }

    /// The slope of a node's surface, if that passes by a point so many pitches off.
    fn passes(&self, [column, row]: [usize; 2], off: [f64; 2], z_mm: f64) -> Option<[f64; 2]> {
        let (image, regions) = (self.image, self.regions);
        if regions.label(column, row) == 0 || depth(regions, column, row) < INNER {
            return None;
        }
        let node_mm = image.z_mm(column, row)?;
        let [along, up] = rise(image, regions, column, row);
        let pitch_mm = image.pitch_mm();
        let there_mm = node_mm + (along * off[0] + up * off[1]) * pitch_mm;
        let distance2 = off[0] * off[0] + off[1] * off[1];
        let steepness = (1.0 + along * along + up * up).sqrt().min(STEEPEST);
        let allowed_mm = (NEAR + BEND * distance2) * steepness * pitch_mm;
        ((z_mm - there_mm).abs() <= allowed_mm).then_some([along, up])
    }

    /// Whether the surface of a node goes on to another that was left out.
    fn meets(&self, node: [usize; 2], slope: [f64; 2], other: [usize; 2]) -> bool {
        let Some(removed) = self.removed else {
            return false;
        };
        let at = |[column, row]: [usize; 2]| column * removed.image.rows() + row;
        if removed.roles.get(at(other)) != Some(&NodeRole::Background) {
            return false;
        }
        let heights = removed.image.z_mm(node[0], node[1]);
        let Some((from_mm, to_mm)) = heights.zip(removed.image.z_mm(other[0], other[1])) else {
            return false;
        };
        let off = [0, 1].map(|d| other[d] as f64 - node[d] as f64);
        let pitch_mm = removed.image.pitch_mm();
        let there_mm = from_mm + (slope[0] * off[0] + slope[1] * off[1]) * pitch_mm;
        let distance2 = off[0] * off[0] + off[1] * off[1];
        let steepness = (1.0 + slope[0] * slope[0] + slope[1] * slope[1])
            .sqrt()
            .min(STEEPEST);
        (there_mm - to_mm).abs() <= (NEAR + BEND * distance2) * steepness * pitch_mm
    }
}

/// The nodes of a window, column by column.
fn all([columns, rows]: &[Range<usize>; 2]) -> impl Iterator<Item = [usize; 2]> + use<> {
    let rows = rows.clone();
    columns
        .clone()
        .flat_map(move |column| rows.clone().map(move |row| [column, row]))
}

/// Of each node, whether not all within [`REACH`] of it are of its region, or the grid ends there.
fn edges(regions: &RegionMap) -> Vec<bool> {
    let (columns, rows) = (regions.columns(), regions.rows());
    let labels = regions.raw_labels();
    let is_alike = |node: usize| {
        let row = node % rows;
        let line = row.checked_sub(REACH).filter(|_| row + REACH < rows);
        line.is_some_and(|_| {
            let line = &labels[node - REACH..=node + REACH];
            line.iter().all(|label| *label == labels[node])
        })
    };
    let lines: Vec<bool> = (0..labels.len()).into_par_iter().map(is_alike).collect();
    let is_edge = |node: usize| {
        let column = node / rows;
        column < REACH
            || column + REACH >= columns
            || (column - REACH..=column + REACH).any(|c| {
                let beside = c * rows + node % rows;
                !lines[beside] || labels[beside] != labels[node]
            })
    };
    (0..labels.len()).into_par_iter().map(is_edge).collect()
}
