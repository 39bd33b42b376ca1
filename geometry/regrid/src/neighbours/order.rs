//! Samples in their order.

use core::cmp::Ordering;

use pulp::{Arch, Simd, WithSimd};

use super::Neighbour;

/// Every width of lanes divides so many numbers.
const SIDE_BY_SIDE: usize = 16;
/// More samples than this are sorted, since counting takes the square of their number.
const COUNTED: usize = 128;
/// Last bits of a key, which say where its sample is, so that no two are alike. Those above them
/// are in the order of the distances, since none is negative.
const COUNTED_PLACE: u32 = 0x7f;
/// The same of a key that is sorted.
const PLACE: u64 = 0x3ff;

/// Puts samples in their order. Whole samples are moved once only: keys are put in order, of a
/// distance but for its last bits, and of where its sample is.
#[derive(Debug, Default)]
pub(super) struct Sorter {
    keys: Vec<u64>,
    short_keys: Vec<f32>,
    ranks: Vec<u32>,
    sorted: Vec<Neighbour>,
}

impl Sorter {
    /// The so many nearest, in their order; those that are alike in the order found.
    pub(super) fn nearest(&mut self, found: &[Neighbour], number: usize) -> &[Neighbour] {
        if found.len() <= COUNTED {
            self.count(found);
        } else {
            self.sort(found);
        }
        settle(&mut self.sorted);
        self.sorted(number)
    }

    /// The so many nearest of those last put in order.
    pub(super) fn sorted(&self, number: usize) -> &[Neighbour] {
        self.sorted.get(..number).unwrap_or(&self.sorted)
    }

    /// By counting for each sample how many are nearer, which has no branches.
    fn count(&mut self, found: &[Neighbour]) {
        let Self {
            short_keys,
            ranks,
            sorted,
            ..
        } = self;
        short_keys.clear();
        short_keys.extend((0_u32..).zip(found).map(|(place, own)| {
            let distance2 = (own.distance2 as f32).to_bits();
            f32::from_bits(distance2 & !COUNTED_PLACE | place)
        }));
        short_keys.resize(found.len().next_multiple_of(SIDE_BY_SIDE), f32::INFINITY);
        ranks.resize(COUNTED, 0);
        Arch::new().dispatch(CountBelow {
            keys: short_keys,
            number: found.len(),
            ranks,
        });
        sorted.resize(found.len(), Neighbour::default());
        for (own, rank) in found.iter().zip(ranks) {
            if let Some(place) = sorted.get_mut(*rank as usize) {
                *place = *own;
            }
        }
    }

    fn sort(&mut self, found: &[Neighbour]) {
        let Self { keys, sorted, .. } = self;
        sorted.clear();
        if found.len() > PLACE as usize {
            sorted.extend_from_slice(found);
            sorted.sort_by(Neighbour::order);
            return;
        }
        keys.clear();
        let places = (0_u64..).zip(found);
        keys.extend(places.map(|(place, own)| own.distance2.to_bits() & !PLACE | place));
        keys.sort_unstable();
        let place = |key: &u64| (key & PLACE) as usize;
        sorted.extend(keys.iter().filter_map(|key| found.get(place(key))));
    }
}

/// Counts for each key how many of the first `number` are below it.
struct CountBelow<'a> {
    keys: &'a [f32],
    number: usize,
    ranks: &'a mut [u32],
}

impl WithSimd for CountBelow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, lanes: S) {
        let (keys, _) = S::as_simd_f32s(self.keys);
        let (ranks, _) = S::as_mut_simd_u32s(self.ranks);
        let others = self.keys.get(..self.number).unwrap_or_default();
        let [zero, one] = [0, 1].map(|number| lanes.splat_u32s(number));
        for (own, rank) in keys.iter().zip(ranks) {
            *rank = others.iter().fold(zero, |below, other| {
                let is_below = lanes.less_than_f32s(lanes.splat_f32s(*other), *own);
                lanes.add_u32s(below, lanes.select_u32s(is_below, one, zero))
            });
        }
    }
}

/// Puts in order what differs by less than keys tell, or by their places only, and so follows one
/// another.
fn settle(sorted: &mut [Neighbour]) {
    for last in 1..sorted.len() {
        if sorted[last].distance2 > sorted[last - 1].distance2 {
            continue;
        }
        for k in (1..=last).rev() {
            if sorted[k].order(&sorted[k - 1]) != Ordering::Less {
                break;
            }
            sorted.swap(k, k - 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_are_those_of_the_whole_order_with_ties_at_the_end_and_within() {
        let mut sorter = Sorter::default();
        for (spread, all) in [
            (3_i32, 90),
            (7, 90),
            (50, 90),
            (9, 128),
            (9, 129),
            (40, 1500),
        ] {
            // Distances on a grid, of which many are alike.
            let found: Vec<Neighbour> = (0..all)
                .map(|k| {
                    let [dx, dy] = [k * 37 % spread, k * 53 % (2 * spread)].map(f64::from);
                    Neighbour {
                        index: k as usize,
                        ..Neighbour::at(dx - 1.0, dy - 2.0, f64::from(k * 29 % 11))
                    }
                })
                .collect();
            let mut plain = found.clone();
            plain.sort_by(Neighbour::order);
            let told = |all: &[Neighbour]| -> Vec<usize> { all.iter().map(|n| n.index).collect() };
            for number in [1, 5, 16, 60, 89, 90, 200, 2000] {
                let number_found = number.min(found.len());
                assert_eq!(
                    told(sorter.nearest(&found, number)),
                    told(&plain[..number_found]),
                    "{spread} {number}"
                );
            }
        }
    }
}
