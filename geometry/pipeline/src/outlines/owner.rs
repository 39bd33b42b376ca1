//! To which region a sample belongs.

use range_image::{RangeImage, RegionMap};

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

/// What tells to which region samples belong.
pub(super) struct Owners<'a> {
    image: &'a RangeImage,
    regions: &'a RegionMap,
    removed: Option<Removed<'a>>,
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
        let around = |d: usize, reach: usize| {
            let middle = place[d].round();
            let low = (middle - reach as f64).max(0.0) as usize;
            let high = (middle + reach as f64 + 1.0).clamp(0.0, nodes[d] as f64) as usize;
            low..high
        };
        let mut best = (f64::INFINITY, [0, 0], [0.0, 0.0]);
        let mut first = None;
        // The grid may end where the part does.
        let mut is_edge = [0, 1]
            .into_iter()
            .any(|d| around(d, REACH).len() <= 2 * REACH);
        for column in around(0, REACH) {
            for row in around(1, REACH) {
                let region = regions.label(column, row);
                is_edge |= *first.get_or_insert(region) != region;
                if region == 0 {
                    continue;
                }
                let off = [place[0] - column as f64, place[1] - row as f64];
                let distance2 = off[0] * off[0] + off[1] * off[1];
                if distance2 >= best.0 || depth(regions, column, row) < INNER {
                    continue;
                }
                let Some(node_mm) = image.z_mm(column, row) else {
                    continue;
                };
                let [along, up] = rise(image, regions, column, row);
                let there_mm = node_mm + (along * off[0] + up * off[1]) * pitch_mm;
                let steepness = (1.0 + along * along + up * up).sqrt().min(STEEPEST);
                let allowed_mm = (NEAR + BEND * distance2) * steepness * pitch_mm;
                if (z_mm - there_mm).abs() <= allowed_mm {
                    best = (distance2, [column, row], [along, up]);
                }
            }
        }
        let (distance2, node, slope) = best;
        if distance2.is_infinite() {
            return Owner {
                region: 0,
                is_edge,
                is_foot: false,
            };
        }
        let mut near = around(0, REACH).flat_map(|c| around(1, REACH).map(move |r| [c, r]));
        Owner {
            region: regions.label(node[0], node[1]),
            is_edge,
            is_foot: is_edge && near.any(|other| self.meets(node, slope, other)),
        }
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
