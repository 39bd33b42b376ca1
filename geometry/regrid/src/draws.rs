//! Random triples, keyed by the scan's seed and the node.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Draws triples of distinct indices for one node.
pub(crate) struct Draws {
    generator: Xoshiro256PlusPlus,
}

impl Draws {
    /// The draws of node (i, j). Nodes mirrored in x draw alike, so that a mirrored scan
    /// gives the mirrored image.
    pub(crate) fn new(seed: u64, i: i64, j: i64) -> Self {
        let key = mix(mix(seed ^ mix(i.unsigned_abs())) ^ j.cast_unsigned());
        Self {
            generator: Xoshiro256PlusPlus::seed_from_u64(key),
        }
    }

    /// Three distinct indices below `number`, which must be from 3 to 2^21.
    pub(crate) fn triple(&mut self, number: usize) -> [usize; 3] {
        let random = self.generator.next_u64();
        let below = |shift: u32, limit: usize| {
            let part = (random >> shift) & ((1 << BITS) - 1);
            ((part * limit as u64) >> BITS) as usize
        };
        let first = below(0, number);
        let mut second = below(BITS, number - 1);
        if second >= first {
            second += 1;
        }
        let mut third = below(2 * BITS, number - 2);
        let (low, high) = (first.min(second), first.max(second));
        if third >= low {
            third += 1;
        }
        if third >= high {
            third += 1;
        }
        [first, second, third]
    }

    /// The next `number` triples below `limit`, which must be from 3 to 2^11: the indices of a
    /// triple in one lane of the three arrays, in lanes without a triple any below the limit.
    #[inline(always)]
    pub(crate) fn triples<const LANES: usize>(
        &mut self,
        number: usize,
        limit: u32,
    ) -> [[u32; LANES]; 3] {
        let mut randoms = [0; LANES];
        if number == LANES {
            // The number of turns is known when this is compiled, which makes it fast.
            for random in &mut randoms {
                *random = self.generator.next_u64();
            }
        } else {
            for random in randoms.iter_mut().take(number) {
                *random = self.generator.next_u64();
            }
        }
        let mut triples = [[0; LANES]; 3];
        for (lane, random) in randoms.into_iter().enumerate() {
            let below = |shift: u32, limit: u32| {
                let part = (random >> shift) as u32 & ((1 << BITS) - 1);
                (part * limit) >> BITS
            };
            let first = below(0, limit);
            let mut second = below(BITS, limit - 1);
            second += u32::from(second >= first);
            let mut third = below(2 * BITS, limit - 2);
            third += u32::from(third >= first.min(second));
            third += u32::from(third >= first.max(second));
            [triples[0][lane], triples[1][lane], triples[2][lane]] = [first, second, third];
        }
        triples
    }
}

/// Random bits for one index.
const BITS: u32 = 21;

/// The finaliser of SplitMix64: neighbouring keys to unrelated ones.
fn mix(key: u64) -> u64 {
    let key = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let key = (key ^ (key >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let key = (key ^ (key >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    key ^ (key >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_triples_of_distinct_indices_are_about_equally_likely() {
        let mut counts = [[[0_u32; 5]; 5]; 5];
        for node in 0..1000 {
            let mut draws = Draws::new(7, node, -3);
            for _ in 0..60 {
                let [a, b, c] = draws.triple(5);
                assert!(a != b && b != c && a != c);
                counts[a][b][c] += 1;
            }
        }
        let drawn: Vec<u32> = counts
            .into_iter()
            .flatten()
            .flatten()
            .filter(|c| *c > 0)
            .collect();
        assert_eq!(drawn.len(), 60);
        // 1000 expected of each; 5 sigma is 158.
        assert!(drawn.iter().all(|c| (840..1160).contains(c)), "{drawn:?}");
    }

    #[test]
    fn triples_in_lanes_are_those_one_by_one() {
        for limit in [3, 4, 32, 49, 1024, 2048] {
            let (mut one, mut many) = (Draws::new(3, 1, 2), Draws::new(3, 1, 2));
            for number in [8, 8, 5, 8] {
                let [p, q, r] = many.triples::<8>(number, limit);
                for k in 0..number {
                    let triple = [p[k], q[k], r[k]].map(|index| index as usize);
                    assert_eq!(triple, one.triple(limit as usize));
                }
            }
        }
    }

    #[test]
    fn draws_depend_on_seed_and_node_only() {
        let first = |seed, i, j| Draws::new(seed, i, j).triple(1 << 20);
        assert_eq!(first(1, 2, 3), first(1, 2, 3));
        assert_eq!(first(1, -2, 3), first(1, 2, 3));
        let others = [
            first(2, 2, 3),
            first(1, 3, 2),
            first(1, 2, -3),
            first(1, 3, 3),
        ];
        assert!(others.iter().all(|o| *o != first(1, 2, 3)));
    }
}
