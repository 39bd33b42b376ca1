//! Tracing of borders between the nodes.
//!
//! Borders run half-way between nodes of different labels, which undoes the bias of the
//! erosion residue (half a pitch towards the higher label) at its source. The lattice of
//! corners, each amid four nodes, carries them: a crack joins two neighbouring corners
//! and has one label on its left and another on its right.

use std::collections::BTreeMap;

use crate::pieces::{Diagonal, PieceMap, joined_diagonal};

/// A run of cracks with the same labels on either side throughout.
///
/// Places are in pitches, with node `(column, row)` at `(column, row)`.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    /// Piece on the left.
    pub(crate) left: u32,
    /// Piece on the right.
    pub(crate) right: u32,
    /// Middle of each crack, in order of travel. The polyline through them separates the
    /// nodes and touches no other chain's.
    pub(crate) middles: Vec<[f64; 2]>,
    /// Junctions where it begins and ends; `None` for a closed chain.
    pub(crate) ends: Option<(usize, usize)>,
}

/// A use of a chain: its index, and whether it is run from its end to its start.
pub(crate) type Use = (usize, bool);

/// All borders of a piece map.
#[derive(Debug, Clone, Default)]
pub(crate) struct CrackMap {
    pub(crate) chains: Vec<Chain>,
    /// Corners where three or four pieces meet (first stage of section IV).
    pub(crate) junctions: Vec<[f64; 2]>,
    /// Loops of each piece with the piece on their left; entry `k` is piece `k + 1`.
    pub(crate) loops: Vec<Vec<Vec<Use>>>,
}

/// Corner `(column, row)` is the lower left one of the node of that address.
type Corner = (i64, i64);

/// Cracks of the longest chain that is contracted to a point.
const CONTRACTED: usize = 2;

/// East, north, west, south.
const STEPS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

struct Tracer<'a> {
    pieces: &'a PieceMap,
    /// Two entries for each corner: the crack to the east and the one to the north.
    visited: Vec<bool>,
    junction_at: BTreeMap<Corner, usize>,
}

/// Traces every border.
pub(crate) fn trace(pieces: &PieceMap) -> CrackMap {
    let (columns, rows) = (pieces.columns() as i64, pieces.rows() as i64);
    let corners = ((columns + 1) * (rows + 1)) as usize;
    let mut tracer = Tracer {
        pieces,
        visited: vec![false; 2 * corners],
        junction_at: BTreeMap::new(),
    };
    let mut map = CrackMap::default();
    let all = || (0..=columns).flat_map(move |i| (0..=rows).map(move |j| (i, j)));
    for corner in all() {
        if tracer.is_junction(corner) {
            tracer.junction_at.insert(corner, map.junctions.len());
            map.junctions.push(place(corner));
        }
    }
    let junctions: Vec<Corner> = tracer.junction_at.keys().copied().collect();
    for corner in junctions {
        for direction in 0..4 {
            map.chains.extend(tracer.chain(corner, direction));
        }
    }
    for corner in all() {
        for direction in 0..2 {
            map.chains.extend(tracer.chain(corner, direction));
        }
    }
    contract(&mut map);
    map.loops = loops(&map.chains, pieces.regions.len());
    map
}

/// Makes one junction of two that a very short chain joins: four faces that meet in a
/// point hardly ever do so on the lattice.
fn contract(map: &mut CrackMap) {
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); map.junctions.len()];
    for chain in &map.chains {
        if let Some((a, b)) = chain.ends {
            around[a].extend([chain.left, chain.right]);
            around[b].extend([chain.left, chain.right]);
        }
    }
    let mut merged = vec![false; map.junctions.len()];
    let mut target: Vec<usize> = (0..map.junctions.len()).collect();
    let mut kept = vec![true; map.chains.len()];
    for (k, chain) in map.chains.iter().enumerate() {
        let Some((a, b)) = chain.ends else { continue };
        let beyond = |j: usize| {
            around[j]
                .iter()
                .find(|&&p| p != chain.left && p != chain.right)
        };
        let (Some(&before), Some(&after)) = (beyond(a), beyond(b)) else {
            continue;
        };
        // Three chains at each end, so that each of the four pieces is met once.
        let plain = around[a].len() == 6 && around[b].len() == 6;
        let short = a != b && chain.middles.len() <= CONTRACTED;
        if !short || !plain || before * after == 0 || before == after || merged[a] || merged[b] {
            continue;
        }
        (merged[a], merged[b], kept[k]) = (true, true, false);
        let (p, q) = (map.junctions[a], map.junctions[b]);
        map.junctions[a] = match chain.middles[..] {
            [_, m] => [2.0 * m[0] - q[0], 2.0 * m[1] - q[1]],
            _ => [(p[0] + q[0]) / 2.0, (p[1] + q[1]) / 2.0],
        };
        target[b] = a;
    }
    let mut number = vec![0; target.len()];
    let mut junctions = Vec::new();
    for (j, &t) in target.iter().enumerate() {
        if t == j {
            number[j] = junctions.len();
            junctions.push(map.junctions[j]);
        }
    }
    map.junctions = junctions;
    let mut kept = kept.into_iter();
    map.chains.retain(|_| kept.next().unwrap_or(true));
    for chain in &mut map.chains {
        chain.ends = chain
            .ends
            .map(|(a, b)| (number[target[a]], number[target[b]]));
    }
}

fn place((i, j): Corner) -> [f64; 2] {
    [i as f64 - 0.5, j as f64 - 0.5]
}

impl Tracer<'_> {
    /// Labels left and right of the crack that leaves a corner in a direction.
    fn sides(&self, (i, j): Corner, direction: usize) -> (u32, u32) {
        let at = |c, r| self.pieces.at(c, r);
        match direction {
            0 => (at(i, j), at(i, j - 1)),
            1 => (at(i - 1, j), at(i, j)),
            2 => (at(i - 1, j - 1), at(i - 1, j)),
            _ => (at(i, j - 1), at(i - 1, j - 1)),
        }
    }

    fn diagonal(&self, (i, j): Corner) -> Option<Diagonal> {
        let at = |c, r| self.pieces.at(c, r);
        joined_diagonal(at(i - 1, j - 1), at(i, j - 1), at(i - 1, j), at(i, j))
    }

    fn is_junction(&self, corner: Corner) -> bool {
        let cracks = (0..4).filter(|&d| {
            let (left, right) = self.sides(corner, d);
            left != right
        });
        cracks.count() >= 3 && self.diagonal(corner).is_none()
    }

    fn visit(&mut self, (i, j): Corner, direction: usize) -> bool {
        let (base, north) = match direction {
            0 => ((i, j), false),
            1 => ((i, j), true),
            2 => ((i - 1, j), false),
            _ => ((i, j - 1), true),
        };
        let rows = self.pieces.rows() as i64;
        let index = 2 * (base.0 * (rows + 1) + base.1) as usize + usize::from(north);
        core::mem::replace(&mut self.visited[index], true)
    }

    /// The chain that leaves a corner in a direction, unless there is none or it has
    /// been traced.
    fn chain(&mut self, start: Corner, first: usize) -> Option<Chain> {
        let (left, right) = self.sides(start, first);
        if left == right || self.visit(start, first) {
            return None;
        }
        let (mut corner, mut direction) = (start, first);
        let mut middles = Vec::new();
        loop {
            let (dx, dy) = STEPS[direction];
            let [x, y] = place(corner);
            middles.push([x + 0.5 * dx as f64, y + 0.5 * dy as f64]);
            corner = (corner.0 + dx, corner.1 + dy);
            if let Some(&end) = self.junction_at.get(&corner) {
                let begin = self.junction_at.get(&start).copied().unwrap_or(end);
                return Some(Chain {
                    left,
                    right,
                    middles,
                    ends: Some((begin, end)),
                });
            }
            direction = self.onward(corner, direction, left);
            if self.visit(corner, direction) {
                return Some(Chain {
                    left,
                    right,
                    middles,
                    ends: None,
                });
            }
        }
    }

    /// Direction in which a border goes on at a corner that is no junction.
    fn onward(&self, corner: Corner, direction: usize, left: u32) -> usize {
        let (turn_left, turn_right) = ((direction + 1) % 4, (direction + 3) % 4);
        if let Some(joined) = self.diagonal(corner) {
            // The left node lies on the rising diagonal when coming along a column. Where
            // it is joined to its opposite, the border turns away from both.
            let left_is_joined = (joined == Diagonal::Rising) == (direction % 2 == 1);
            return if left_is_joined {
                turn_right
            } else {
                turn_left
            };
        }
        match self.sides(corner, direction) {
            (a, b) if a != b => direction,
            (a, _) if a == left => turn_right,
            _ => turn_left,
        }
    }
}

fn loops(chains: &[Chain], pieces: usize) -> Vec<Vec<Vec<Use>>> {
    let mut loops: Vec<Vec<Vec<Use>>> = vec![Vec::new(); pieces];
    // A piece occupies one sector at most around a junction, so the piece on the left
    // tells how to go on.
    let mut leaving: BTreeMap<(usize, u32), Use> = BTreeMap::new();
    for (k, chain) in chains.iter().enumerate() {
        if let Some((start, end)) = chain.ends {
            leaving.insert((start, chain.left), (k, false));
            leaving.insert((end, chain.right), (k, true));
        }
    }
    let mut used = vec![[false; 2]; chains.len()];
    for k in 0..chains.len() {
        for reversed in [false, true] {
            let piece = if reversed {
                chains[k].right
            } else {
                chains[k].left
            };
            if piece == 0 || used[k][usize::from(reversed)] {
                continue;
            }
            let mut uses = Vec::new();
            let mut current = (k, reversed);
            loop {
                let (chain, backwards) = current;
                if core::mem::replace(&mut used[chain][usize::from(backwards)], true) {
                    break;
                }
                uses.push(current);
                let Some((start, end)) = chains[chain].ends else {
                    break;
                };
                let arrival = if backwards { start } else { end };
                let Some(&next) = leaving.get(&(arrival, piece)) else {
                    break;
                };
                current = next;
            }
            loops[piece as usize - 1].push(uses);
        }
    }
    loops
}

/// The corner of the lattice at which two cracks that follow on each other meet.
fn corner(before: [f64; 2], after: [f64; 2]) -> [f64; 2] {
    let is_between = |v: f64| (v - v.floor() - 0.5).abs() < 0.25;
    [0, 1].map(|d| match (before[d], after[d]) {
        (a, _) if is_between(a) => a,
        (_, b) if is_between(b) => b,
        (a, b) => (a + b) / 2.0,
    })
}

impl CrackMap {
    /// Cuts each chain before the cracks of these indices, ascending: new junctions are between them
    /// and the cracks before. A closed chain that is cut is open.
    pub(crate) fn cut(&mut self, cuts: &[Vec<usize>]) {
        for (k, cuts) in cuts.iter().enumerate() {
            let chain = &mut self.chains[k];
            let Some(&first) = cuts.first() else { continue };
            let mut cuts = cuts.clone();
            if chain.ends.is_none() {
                let (last, next) = (chain.middles.len() - 1, first % chain.middles.len());
                let before = if next == 0 { last } else { next - 1 };
                let junction = corner(chain.middles[before], chain.middles[next]);
                chain.middles.rotate_left(first);
                chain.ends = Some((self.junctions.len(), self.junctions.len()));
                self.junctions.push(junction);
                cuts.remove(0);
                cuts.iter_mut().for_each(|cut| *cut -= first);
            }
            let Some((mut start, end)) = chain.ends else {
                continue;
            };
            let (left, right) = (chain.left, chain.right);
            let middles = core::mem::take(&mut chain.middles);
            let mut parts = Vec::new();
            let mut from = 0;
            for cut in cuts {
                let junction = self.junctions.len();
                self.junctions.push(corner(middles[cut - 1], middles[cut]));
                parts.push((middles[from..cut].to_vec(), (start, junction)));
                (from, start) = (cut, junction);
            }
            parts.push((middles[from..].to_vec(), (start, end)));
            for (n, (middles, ends)) in parts.into_iter().enumerate() {
                let part = Chain {
                    left,
                    right,
                    middles,
                    ends: Some(ends),
                };
                if n == 0 {
                    self.chains[k] = part;
                } else {
                    self.chains.push(part);
                }
            }
        }
        self.loops = loops(&self.chains, self.loops.len());
    }

    /// The signed area within a loop of crack middles, square pitches;
    /// counter-clockwise is positive.
    pub(crate) fn area(&self, uses: &[Use]) -> f64 {
        let mut points: Vec<[f64; 2]> = Vec::new();
        for &(chain, reversed) in uses {
            let chain = &self.chains[chain];
            let (start, forward) = match chain.ends {
                Some((a, b)) => (Some(if reversed { b } else { a }), !reversed),
                None => (None, !reversed),
            };
            points.extend(start.map(|j| self.junctions[j]));
            if forward {
                points.extend(chain.middles.iter());
            } else {
                points.extend(chain.middles.iter().rev());
            }
        }
        crate::polygon::signed_area(&points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pieces::PieceLimits;
    use crate::testing::region_map;

    fn traced(picture: &[&str]) -> (PieceMap, CrackMap) {
        let limits = PieceLimits {
            min_nodes: 1,
            min_hole_nodes: 1,
        };
        let pieces = PieceMap::new(&region_map(picture), limits);
        let map = trace(&pieces);
        (pieces, map)
    }

    #[test]
    fn a_square_has_one_closed_chain_counter_clockwise() {
        let (_, map) = traced(&["....", ".aa.", ".aa.", "...."]);
        assert_eq!((map.chains.len(), map.junctions.len()), (1, 0));
        assert_eq!(map.chains[0].middles.len(), 8);
        assert_eq!(map.loops.len(), 1);
        // The middles cut the four corners off the square of area 4.
        assert_eq!(map.area(&map.loops[0][0]), 3.5);
    }

    #[test]
    fn three_pieces_meet_in_junctions() {
        let (_, map) = traced(&["aabb", "aabb", "cccc", "cccc"]);
        assert_eq!(map.junctions.len(), 4);
        assert_eq!(map.chains.len(), 6);
        for loops in &map.loops {
            assert_eq!(loops.len(), 1);
            assert!(map.area(&loops[0]) > 0.0);
        }
    }

    #[test]
    fn a_ring_has_a_hole_and_its_island_none() {
        let (pieces, map) = traced(&["aaaaaa", "aaaaaa", "aabbaa", "aabbaa", "aaaaaa", "aaaaaa"]);
        assert_eq!(pieces.regions, [1, 2]);
        let areas: Vec<f64> = map.loops[0].iter().map(|l| map.area(l)).collect();
        assert_eq!(areas.len(), 2);
        assert!(areas.iter().any(|a| *a == -3.5) && areas.iter().any(|a| *a > 30.0));
        assert_eq!(map.loops[1].len(), 1);
    }

    #[test]
    fn every_piece_has_one_outer_loop_whatever_the_pattern() {
        let mut state = 7_u64;
        for _ in 0..200 {
            let picture: Vec<String> = (0..9)
                .map(|_| {
                    (0..9)
                        .map(|_| {
                            state = state
                                .wrapping_mul(6_364_136_223_846_793_005)
                                .wrapping_add(1);
                            ['.', 'a', 'b', 'c'][(state >> 60) as usize % 4]
                        })
                        .collect()
                })
                .collect();
            let rows: Vec<&str> = picture.iter().map(String::as_str).collect();
            let (pieces, map) = traced(&rows);
            assert_eq!(map.loops.len(), pieces.regions.len());
            for loops in &map.loops {
                let outer = loops.iter().filter(|l| map.area(l) > 0.0).count();
                assert_eq!(outer, 1, "{picture:#?}");
            }
        }
    }
}
