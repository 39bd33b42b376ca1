//! The M samples nearest to a node.

use core::cmp::Ordering;

use crate::strip::Strip;
use crate::window::Window;

/// A sample as seen from a node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbour {
    /// Squared distance in x and y.
    pub(crate) distance2: f64,
    /// Offset from the node in x.
    pub(crate) dx: f64,
    /// Offset from the node in y.
    pub(crate) dy: f64,
    pub(crate) z: f64,
    /// Index of its strip in the window.
    pub(crate) strip: usize,
    /// Index in its strip.
    pub(crate) index: usize,
}

impl Neighbour {
    /// A sample with this offset from the node.
    #[cfg(test)]
    pub(crate) fn at(dx: f64, dy: f64, z: f64) -> Self {
        Self {
            distance2: dx * dx + dy * dy,
            dx,
            dy,
            z,
            strip: 0,
            index: 0,
        }
    }

    /// The order in which samples are numbered for the draws: by distance, ties by
    /// position. No trace of the order of arrival is left.
    pub(crate) fn order(&self, other: &Self) -> Ordering {
        self.distance2
            .total_cmp(&other.distance2)
            .then(self.dy.total_cmp(&other.dy))
            .then(self.z.total_cmp(&other.z))
            .then(self.dx.total_cmp(&other.dx))
    }
}

/// Puts samples in their order. Whole samples are moved once only: keys are sorted, of a distance but for
/// its last bits, and of where its sample is in their place.
#[derive(Debug, Default)]
struct Sorter {
    keys: Vec<u64>,
    sorted: Vec<Neighbour>,
}

/// Last bits of a key, which say where its sample is. Those above them are in the order of the
/// distances, since none is negative.
const PLACE: u64 = 0x3ff;

impl Sorter {
    /// Leaves the so many nearest, in their order.
    fn nearest(&mut self, found: &mut Vec<Neighbour>, number: usize) {
        if found.len() > PLACE as usize {
            found.sort_unstable_by(Neighbour::order);
        } else {
            let Self { keys, sorted } = self;
            keys.clear();
            let places = (0_u64..).zip(&*found);
            keys.extend(places.map(|(place, own)| own.distance2.to_bits() & !PLACE | place));
            keys.sort_unstable();
            sorted.clear();
            let place = |key: &u64| (key & PLACE) as usize;
            sorted.extend(keys.iter().filter_map(|key| found.get(place(key))));
            core::mem::swap(found, sorted);
            // Those that differ by less than keys tell, or by their places only, follow one another.
            for last in 1..found.len() {
                for k in (1..=last).rev() {
                    if found[k].order(&found[k - 1]) != Ordering::Less {
                        break;
                    }
                    found.swap(k, k - 1);
                }
            }
        }
        found.truncate(number);
    }
}

/// Finds the nearest samples of one node after the other, upwards along a grid column.
#[derive(Debug, Default)]
pub(crate) struct Search {
    /// In each strip of the window the first sample at or above the current node.
    above: Vec<usize>,
    found: Vec<Neighbour>,
    sorter: Sorter,
    /// Radius to begin with: what sufficed for the node before. Only speed depends on it.
    radius_mm: f64,
}

impl Search {
    /// Begins a new grid column.
    pub(crate) fn begin(&mut self, window: &Window<'_>) {
        self.above.clear();
        self.above.resize(window.strips.len(), 0);
        self.radius_mm = 2.0 * window.column_spacing_mm;
    }

    /// Moves to a node at this y, which must not be below the one before.
    pub(crate) fn advance(&mut self, window: &Window<'_>, y_mm: f64) {
        for (above, strip) in self.above.iter_mut().zip(&window.strips) {
            while strip.samples.get(*above).is_some_and(|s| s.0 < y_mm) {
                *above += 1;
            }
        }
    }

    /// y of the first sample at or above the current node in any strip as near in x.
    pub(crate) fn next_above(&self, window: &Window<'_>, x_mm: f64, within_mm: f64) -> Option<f64> {
        self.near(window, x_mm, within_mm)
            .filter_map(|(strip, above)| strip.samples.get(above))
            .map(|s| s.0)
            .min_by(f64::total_cmp)
    }

    /// y of the last sample below the current node in any strip as near in x.
    pub(crate) fn next_below(&self, window: &Window<'_>, x_mm: f64, within_mm: f64) -> Option<f64> {
        self.near(window, x_mm, within_mm)
            .filter_map(|(strip, above)| strip.samples.get(above.checked_sub(1)?))
            .map(|s| s.0)
            .max_by(f64::total_cmp)
    }

    fn near<'w>(
        &'w self,
        window: &'w Window<'_>,
        x_mm: f64,
        within_mm: f64,
    ) -> impl Iterator<Item = (&'w Strip, usize)> {
        window
            .strips
            .iter()
            .zip(&self.above)
            .filter(move |(strip, _)| (strip.x_mm - x_mm).abs() <= within_mm)
            .map(|(strip, above)| (*strip, *above))
    }

    /// The `number` nearest samples in their order, or as many as the window holds; at
    /// most half of `number` from one strip.
    pub(crate) fn nearest(
        &mut self,
        window: &Window<'_>,
        x_mm: f64,
        y_mm: f64,
        number: usize,
    ) -> &[Neighbour] {
        let reach_x_mm = window
            .strips
            .iter()
            .map(|s| (s.x_mm - x_mm).abs())
            .fold(0.0, f64::max);
        let reach_mm = (reach_x_mm * reach_x_mm + window.reach_y_mm * window.reach_y_mm).sqrt();
        let mut radius_mm = self.radius_mm.min(reach_mm);
        loop {
            self.gather(window, x_mm, y_mm, radius_mm, number.div_ceil(2));
            if self.found.len() >= number || radius_mm >= reach_mm {
                break;
            }
            radius_mm = (1.5 * radius_mm).min(reach_mm);
        }
        let is_full = self.found.len() > number;
        self.sorter.nearest(&mut self.found, number);
        if is_full {
            // A little more than sufficed here usually suffices for the next node.
            let farthest2 = self.found.last().map_or(0.0, |n| n.distance2);
            self.radius_mm = 1.1 * farthest2.sqrt();
        } else {
            self.radius_mm = radius_mm;
        }
        &self.found
    }

    /// The same for a window that is wider than that of the nodes to come.
    pub(crate) fn wider(
        &mut self,
        window: &Window<'_>,
        x_mm: f64,
        y_mm: f64,
        number: usize,
    ) -> &[Neighbour] {
        let radius_mm = self.radius_mm;
        self.radius_mm = 2.0 * radius_mm;
        self.nearest(window, x_mm, y_mm, number);
        self.radius_mm = radius_mm;
        &self.found
    }

    /// All samples within the radius and the window's reach in y, but of each strip no
    /// more than the `limit` nearest.
    fn gather(&mut self, window: &Window<'_>, x_mm: f64, y_mm: f64, radius_mm: f64, limit: usize) {
        self.found.clear();
        for (strip_index, (strip, &above)) in window.strips.iter().zip(&self.above).enumerate() {
            let dx = strip.x_mm - x_mm;
            let height2 = radius_mm * radius_mm - dx * dx;
            if height2 < 0.0 {
                continue;
            }
            let height = height2.sqrt().min(window.reach_y_mm);
            let offset = |index: usize| strip.samples.get(index).map(|s| s.0 - y_mm);
            let (mut low, mut high) = (above, above);
            for _ in 0..limit {
                let down = low
                    .checked_sub(1)
                    .and_then(offset)
                    .filter(|dy| -dy <= height);
                let up = offset(high).filter(|dy| *dy <= height);
                let (index, dy) = match (down, up) {
                    (Some(down), Some(up)) if up < -down => {
                        high += 1;
                        (high - 1, up)
                    }
                    (Some(down), _) => {
                        low -= 1;
                        (low, down)
                    }
                    (None, Some(up)) => {
                        high += 1;
                        (high - 1, up)
                    }
                    (None, None) => break,
                };
                self.found.push(Neighbour {
                    distance2: dx * dx + dy * dy,
                    dx,
                    dy,
                    z: strip.samples[index].1,
                    strip: strip_index,
                    index,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_are_those_of_the_whole_order_with_ties_at_the_end_and_within() {
        let mut sorter = Sorter::default();
        for spread in [3_i32, 7, 50] {
            // Distances on a grid, of which many are alike.
            let all: Vec<Neighbour> = (0..90)
                .map(|k| {
                    let [dx, dy] = [k * 37 % spread, k * 53 % (2 * spread)].map(f64::from);
                    Neighbour::at(dx - 1.0, dy - 2.0, f64::from(k * 29 % 11))
                })
                .collect();
            for number in [1, 5, 16, 60, 89, 90, 200] {
                let mut plain = all.clone();
                plain.sort_by(Neighbour::order);
                plain.truncate(number);
                let mut found = all.clone();
                sorter.nearest(&mut found, number);
                let told = |all: &[Neighbour]| -> Vec<[f64; 3]> {
                    all.iter().map(|n| [n.dx, n.dy, n.z]).collect()
                };
                assert_eq!(told(&found), told(&plain), "{spread} {number}");
            }
        }
    }
}
