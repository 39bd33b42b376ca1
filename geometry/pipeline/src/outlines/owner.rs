//! To which region a sample belongs.

use range_image::{RangeImage, RegionMap};

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

/// What tells to which region samples belong.
pub(super) struct Owners<'a> {
    image: &'a RangeImage,
    regions: &'a RegionMap,
}

/// A sample as regions see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Owner {
    /// Its region; 0 for none.
    pub(super) region: u16,
    /// An outline may be near.
    pub(super) is_edge: bool,
}

impl<'a> Owners<'a> {
    pub(super) fn new(image: &'a RangeImage, regions: &'a RegionMap) -> Self {
        Self { image, regions }
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
        let mut best = (f64::INFINITY, 0);
        let mut first = None;
        let mut is_edge = false;
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
                    best = (distance2, region);
                }
            }
        }
        Owner {
            region: best.1,
            is_edge,
        }
    }
}
