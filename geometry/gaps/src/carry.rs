//! The surfaces around a gap at its nodes, and which of them a node is given to.

use std::collections::BTreeMap;

use crate::find::Place;
use crate::sight::Sight;
use crate::surface::Surface;

/// What a node is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Given {
    pub(crate) region: u16,
    pub(crate) z_mm: f64,
}

/// Heights of the surfaces around a gap at its nodes and at those beside it, by region.
#[derive(Debug, Clone, Default)]
pub(crate) struct Carried {
    heights_mm: BTreeMap<u16, BTreeMap<usize, f64>>,
}

/// Fewest nodes beside a gap for a region to be carried on into it.
const FEWEST: usize = 3;

/// Carries the regions around a gap on into it.
pub(crate) fn carried(sight: &Sight<'_>, labels: &[u16], place: &Place) -> Carried {
    let grid = sight.grid();
    let mut all = Carried::default();
    for (&region, beside) in &place.beside {
        let measured: Vec<usize> = beside
            .iter()
            .copied()
            .filter(|node| sight.point(*node).is_some())
            .collect();
        if measured.len() < FEWEST {
            continue;
        }
        let Some(surface) = Surface::new(sight, labels, place, region) else {
            continue;
        };
        let others = place.beside.values().flatten();
        let mut heights = BTreeMap::new();
        for &node in place.nodes.iter().chain(others) {
            let near = measured
                .iter()
                .map(|other| (grid.distance(node, *other), *other))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let height = near
                .and_then(|(_, other)| sight.point(other))
                .and_then(|mut from| {
                    let (column, row) = grid.place(node);
                    from.x = sight.image.x_mm(column);
                    from.y = sight.image.y_mm(row);
                    surface.height_mm(from)
                });
            if let Some(z_mm) = height {
                heights.insert(node, z_mm);
            }
        }
        all.heights_mm.insert(region, heights);
    }
    all
}

/// The lowest of the surfaces around a gap, with those that meet it there; the others stand on it.
#[derive(Debug, Clone)]
pub(crate) struct Ground {
    heights_mm: BTreeMap<u16, BTreeMap<usize, f64>>,
    /// Regions that stand higher and do not meet it, ascending.
    pub(crate) higher: Vec<u16>,
}

impl Carried {
    pub(crate) fn heights(self) -> BTreeMap<u16, BTreeMap<usize, f64>> {
        self.heights_mm
    }

    /// Divides the surfaces into ground and what stands on it: what is nowhere in the gap within
    /// `step_mm` of the lowest.
    pub(crate) fn ground(self, step_mm: f64) -> Ground {
        let mean = |heights: &BTreeMap<usize, f64>| {
            heights.values().sum::<f64>() / heights.len().max(1) as f64
        };
        let lowest = self
            .heights_mm
            .iter()
            .filter(|(_, heights)| !heights.is_empty())
            .min_by(|a, b| mean(a.1).total_cmp(&mean(b.1)))
            .map(|(_, heights)| heights.clone())
            .unwrap_or_default();
        let meets = |heights: &BTreeMap<usize, f64>| {
            let both = heights
                .iter()
                .filter_map(|(node, z)| Some((z, lowest.get(node)?)));
            let apart: Vec<f64> = both.map(|(z, low)| z - low).collect();
            let least = apart.iter().copied().fold(f64::INFINITY, f64::min);
            let most = apart.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            least <= step_mm && most >= -step_mm
        };
        let (ground, above): (BTreeMap<_, _>, BTreeMap<_, _>) = self
            .heights_mm
            .into_iter()
            .partition(|(_, heights)| meets(heights));
        Ground {
            heights_mm: ground,
            higher: above.into_keys().collect(),
        }
    }
}

impl Ground {
    pub(crate) fn regions(&self) -> impl Iterator<Item = u16> + '_ {
        self.heights_mm.keys().copied()
    }

    /// Gives each node of a gap to one of the regions of the ground. Two that meet in the gap meet
    /// where they cross; of more, each has the nodes nearest to it.
    pub(crate) fn given(&self, sight: &Sight<'_>, place: &Place) -> BTreeMap<usize, Given> {
        let grid = sight.grid();
        let regions: Vec<u16> = self.regions().collect();
        let crossing = match regions.as_slice() {
            [one, other] => self.crossing(place, *one, *other),
            _ => None,
        };
        let mut given = BTreeMap::new();
        for &node in &place.nodes {
            let crossed =
                crossing.and_then(|above| self.by_crossing(node, regions[0], regions[1], above));
            let region = crossed.or_else(|| {
                let each = regions.iter().filter_map(|region| {
                    let beside = place.beside.get(region)?.iter();
                    let far = beside.map(|other| grid.distance(node, *other));
                    Some((far.fold(f64::INFINITY, f64::min), *region))
                });
                let nearest = each.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                nearest.map(|(_, region)| region)
            });
            let own = region.and_then(|region| {
                let z_mm = *self.heights_mm.get(&region)?.get(&node)?;
                Some(Given { region, z_mm })
            });
            given.extend(own.map(|own| (node, own)));
        }
        given
    }

    /// Whether the first of two surfaces runs above the second where it is the one that is there; `None`
    /// where both borders do not agree about it.
    fn crossing(&self, place: &Place, one: u16, other: u16) -> Option<bool> {
        let votes = |region: u16| {
            let beside = place.beside.get(&region).into_iter().flatten();
            let above = beside.filter_map(|node| {
                let (a, b) = (self.height(one, *node)?, self.height(other, *node)?);
                Some(if a > b { 1_i64 } else { -1 })
            });
            above.sum::<i64>()
        };
        let (own, theirs) = (votes(one), votes(other));
        (own * theirs < 0).then_some(own > 0)
    }

    fn by_crossing(&self, node: usize, one: u16, other: u16, above: bool) -> Option<u16> {
        let (a, b) = (self.height(one, node)?, self.height(other, node)?);
        Some(if (a > b) == above { one } else { other })
    }

    fn height(&self, region: u16, node: usize) -> Option<f64> {
        self.heights_mm.get(&region)?.get(&node).copied()
    }
}
