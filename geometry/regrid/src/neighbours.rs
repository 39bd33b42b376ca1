//! The M samples nearest to a node.

mod order;

use core::cmp::Ordering;

use crate::strip::Strip;
use crate::window::Window;
use order::Sorter;

/// A sample as seen from a node.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Neighbour {
    /// Squared distance in x, as the window stretches it, and y.
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

/// Squares of distances searched, as a multiple of what sufficed for the node before: more spares
/// searches that find too few, less spares samples that are not needed.
const ROOM: f64 = 1.2;
/// The same after a search that found too few.
const MORE: f64 = 1.35;
/// All samples whose squared distance is below this share of the radius' square have been found,
/// whatever rounding did.
const SURE: f64 = 1.0 - 1e-9;

/// A strip as seen from the nodes of a grid column.
#[derive(Debug)]
struct Seen {
    /// Offset from the nodes in x.
    dx: f64,
    /// Its square, stretched as the window is.
    dx2: f64,
    /// How far in y its samples count.
    reach_mm: f64,
    /// The first sample at or above the last node that looked.
    above: usize,
}

impl Seen {
    /// Moves to a node at this y, which must not be below the one before.
    #[inline(always)]
    fn advance(&mut self, strip: &Strip, y_mm: f64) {
        while strip.samples.get(self.above).is_some_and(|s| s.0 < y_mm) {
            self.above += 1;
        }
    }

    /// y of the last sample below the node, and of the first at or above it.
    fn beside(&self, strip: &Strip) -> [Option<f64>; 2] {
        let y = |index: usize| strip.samples.get(index).map(|s| s.0);
        [self.above.checked_sub(1).and_then(y), y(self.above)]
    }
}

/// What samples there are near a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Near {
    /// Some.
    Some,
    /// None; the next one above is at this y.
    Above(f64),
    /// None, and none above.
    Nothing,
}

/// Finds the nearest samples of one node after the other, upwards along a grid column.
#[derive(Debug, Default)]
pub(crate) struct Search {
    /// The strips of the window.
    seen: Vec<Seen>,
    found: Vec<Neighbour>,
    sorter: Sorter,
    /// Square of the radius to begin with. Only speed depends on it.
    radius2: f64,
    /// Samples that it is for.
    number: usize,
}

impl Search {
    /// Begins a new grid column.
    pub(crate) fn begin(&mut self, window: &Window<'_>, x_mm: f64) {
        let reach_x_mm = window
            .strips
            .iter()
            .map(|s| (s.x_mm - x_mm).abs())
            .fold(0.0, f64::max)
            * window.stretch;
        let reach_mm = (reach_x_mm * reach_x_mm + window.reach_y_mm * window.reach_y_mm).sqrt();
        self.seen.clear();
        self.seen.extend(window.strips.iter().map(|strip| {
            let dx = strip.x_mm - x_mm;
            let stretched = dx * window.stretch;
            let dx2 = stretched * stretched;
            Seen {
                dx,
                dx2,
                reach_mm: height(reach_mm * reach_mm, dx2).min(window.reach_y_mm),
                above: 0,
            }
        }));
        self.radius2 = 4.0 * window.column_spacing_mm * window.column_spacing_mm;
    }

    /// y of the lowest sample in any strip as near in x.
    pub(crate) fn lowest(&self, window: &Window<'_>, within_mm: f64) -> Option<f64> {
        self.seen
            .iter()
            .zip(window.strips)
            .filter(|(seen, _)| seen.dx.abs() <= within_mm)
            .filter_map(|(_, strip)| strip.samples.first().map(|s| s.0))
            .min_by(f64::total_cmp)
    }

    /// Whether there are samples as near to a node in x and in y. Its y must not be below that of
    /// the one before.
    pub(crate) fn near(
        &mut self,
        window: &Window<'_>,
        y_mm: f64,
        [within_x_mm, within_y_mm]: [f64; 2],
    ) -> Near {
        let mut next: Option<f64> = None;
        for (seen, strip) in self.seen.iter_mut().zip(window.strips) {
            if seen.dx.abs() > within_x_mm {
                continue;
            }
            seen.advance(strip, y_mm);
            let [below, above] = seen.beside(strip);
            if below.is_some_and(|y| y_mm - y <= within_y_mm)
                || above.is_some_and(|y| y - y_mm <= within_y_mm)
            {
                return Near::Some;
            }
            next = match (next, above) {
                (Some(next), Some(above)) => Some(next.min(above)),
                (next, above) => next.or(above),
            };
        }
        next.map_or(Near::Nothing, Near::Above)
    }

    /// The `number` nearest samples in their order, or as many as the window holds; at
    /// most half of `number` from one strip. y must not be below that of the node before.
    pub(crate) fn nearest(
        &mut self,
        window: &Window<'_>,
        y_mm: f64,
        number: usize,
    ) -> &[Neighbour] {
        let mut radius2 = self.radius2;
        self.number = number;
        loop {
            let is_whole = self.gather(window, y_mm, radius2, number.div_ceil(2));
            if is_whole || self.found.len() >= number {
                let nearest = self.sorter.nearest(&self.found, number);
                let farthest = nearest.get(number - 1).map(|n| n.distance2);
                let is_sure = farthest.is_some_and(|farthest2| farthest2 <= SURE * radius2);
                if is_whole || is_sure {
                    self.radius2 = farthest.map_or(radius2, |farthest2| ROOM * farthest2);
                    break;
                }
            }
            radius2 *= MORE;
        }
        self.sorter.sorted(number)
    }

    /// The same for a window that is wider than that of the nodes to come.
    pub(crate) fn wider(&mut self, window: &Window<'_>, y_mm: f64, number: usize) -> &[Neighbour] {
        let usual = (self.radius2, self.number);
        self.radius2 *= number as f64 / self.number.max(1) as f64;
        self.nearest(window, y_mm, number);
        (self.radius2, self.number) = usual;
        self.sorter.sorted(number)
    }

    /// Finds all samples within the radius and the window's reach, but of each strip no more than
    /// the `limit` nearest. Whether that is all of the window's.
    fn gather(&mut self, window: &Window<'_>, y_mm: f64, radius2: f64, limit: usize) -> bool {
        self.found.clear();
        let mut is_whole = true;
        for (index, (seen, strip)) in self.seen.iter_mut().zip(window.strips).enumerate() {
            let height_mm = height(radius2, seen.dx2);
            is_whole &= height_mm >= seen.reach_mm;
            if height_mm >= 0.0 {
                seen.advance(strip, y_mm);
                let around = Around {
                    seen,
                    strip,
                    index,
                    y_mm,
                    height_mm: height_mm.min(seen.reach_mm),
                };
                around.gather(limit, &mut self.found);
            }
        }
        is_whole
    }
}

/// Half of the length that a circle cuts from a line; less than nothing if it does not.
#[inline(always)]
fn height(radius2: f64, distance2: f64) -> f64 {
    let height2 = radius2 - distance2;
    if height2 < 0.0 { -1.0 } else { height2.sqrt() }
}

/// A strip around a node.
struct Around<'a> {
    seen: &'a Seen,
    strip: &'a Strip,
    /// Index of the strip.
    index: usize,
    y_mm: f64,
    height_mm: f64,
}

impl Around<'_> {
    /// Adds its samples within the height, those below the node downwards, then the others
    /// upwards, but no more than the `limit` nearest.
    #[inline(always)]
    fn gather(&self, limit: usize, found: &mut Vec<Neighbour>) {
        let samples = self.strip.samples.as_slice();
        let (below, above) = samples.split_at(self.seen.above);
        let start = found.len();
        let from = below.len().saturating_sub(limit);
        for (index, sample) in (from..below.len()).zip(&below[from..]).rev() {
            let own = self.neighbour(index, *sample);
            if -own.dy > self.height_mm {
                break;
            }
            found.push(own);
        }
        let middle = found.len();
        for (index, sample) in (self.seen.above..).zip(above).take(limit) {
            let own = self.neighbour(index, *sample);
            if own.dy > self.height_mm {
                break;
            }
            found.push(own);
        }
        if found.len() - start > limit {
            cut(found, start, middle, limit);
        }
    }

    #[inline(always)]
    fn neighbour(&self, index: usize, (y_mm, z): (f64, f64)) -> Neighbour {
        let dy = y_mm - self.y_mm;
        Neighbour {
            distance2: self.seen.dx2 + dy * dy,
            dx: self.seen.dx,
            dy,
            z,
            strip: self.index,
            index,
        }
    }
}

/// Leaves the `limit` nearest of a strip: of those below the node from `start` on, and of those
/// above it from `middle` on, in either case the nearest first. Of two as near the one above goes.
#[cold]
fn cut(found: &mut Vec<Neighbour>, start: usize, middle: usize, limit: usize) {
    let (mut below, mut above) = (middle - start, found.len() - middle);
    while below + above > limit {
        let up = above.checked_sub(1).and_then(|k| found.get(middle + k));
        let down = below.checked_sub(1).and_then(|k| found.get(start + k));
        match (down, up) {
            (Some(down), Some(up)) if up.dy < -down.dy => below -= 1,
            (Some(_), None) => below -= 1,
            _ => above -= 1,
        }
    }
    found.truncate(middle + above);
    found.drain(start + below..middle);
}

#[cfg(test)]
mod tests;
