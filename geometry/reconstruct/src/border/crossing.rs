//! Finds paths that cross, touch or fold back on themselves.

use std::collections::BTreeSet;

use nurbs::PiecewiseCubic;

use crate::polygon::{cross, distance_of_segments, dot, minus, norm};

/// Side of the cells in which segments are looked up.
const CELL: f64 = 2.0;

/// Chords by which a curved piece is replaced at least; it turns by less than a right angle.
const CHORDS: f64 = 24.0;

/// Length of a curved piece, pitches, whose arcs rise as far above as many chords as a quarter of
/// the clearance. Of longer ones the chords are more, by the square root.
const CHORDED: f64 = 14.0;

/// Strands that share no vertex keep at least this distance.
const CLEARANCE: f64 = 0.02;

/// Cosine of the least angle (3 degrees) between two strands that leave a vertex: closer ones
/// cross again before they part, within less than readers can tell.
const FOLD_COSINE: f64 = 0.998_6;

/// Cosine of the angle (60 degrees) that two chords of one strand keep at least: strands are
/// smooth, and only a piece drawn backwards turns them more.
const BACK_COSINE: f64 = 0.5;

/// A path as a fine polyline. Lengths are in pitches.
#[derive(Debug, Clone)]
pub(crate) struct Strand {
    /// Border it belongs to.
    owner: usize,
    pub(crate) points: Vec<[f64; 2]>,
    /// In which directions, of any length, each of its chords is left for the other end.
    inward: Vec<[[f64; 2]; 2]>,
}

impl Strand {
    /// Samples a path in pitches; its ends are set to the vertices, so that strands meet
    /// exactly.
    pub(crate) fn new(
        owner: usize,
        path: &PiecewiseCubic<2>,
        start: [f64; 2],
        end: [f64; 2],
    ) -> Self {
        let mut points = vec![start];
        // First chord of each piece, and the first beyond.
        let mut chords = vec![0];
        for (k, piece) in path.pieces.iter().enumerate() {
            let width = path.breaks[k + 1] - path.breaks[k];
            let straight = piece.iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
            let count = if straight {
                1.0
            } else {
                (CHORDS * (width / CHORDED).sqrt().max(1.0)).ceil()
            };
            let shares = (1..=count as usize).map(|p| p as f64 / count);
            points.extend(shares.map(|share| path.piece_value(k, width * share, 0)));
            chords.push(points.len() - 1);
        }
        if let Some(last) = points.last_mut() {
            *last = end;
        }
        let mut strand = Self::polyline(owner, points);
        // Chords of a piece tell of its directions by as much as it bends along them; where two
        // pieces or paths meet that may be more than they part.
        for (k, chord) in chords.windows(2).enumerate() {
            let width = path.breaks[k + 1] - path.breaks[k];
            let first = path.piece_value(k, 0.0, 1);
            let last = path.piece_value(k, width, 1).map(|c| -c);
            for (chord, end, along) in [(chord[0], 0, first), (chord[1] - 1, 1, last)] {
                if norm(along) > 0.0 {
                    strand.inward[chord][end] = along;
                }
            }
        }
        strand
    }

    fn polyline(owner: usize, points: Vec<[f64; 2]>) -> Self {
        let chords = points.windows(2);
        let inward = chords.map(|pair| [minus(pair[1], pair[0]), minus(pair[0], pair[1])]);
        Self {
            owner,
            inward: inward.collect(),
            points,
        }
    }

    /// Samples a path in another unit, `scale` of which make one here.
    pub(crate) fn scaled(
        owner: usize,
        path: &PiecewiseCubic<2>,
        start: [f64; 2],
        end: [f64; 2],
        scale: f64,
    ) -> Self {
        let path = PiecewiseCubic {
            breaks: path.breaks.iter().map(|b| b / scale).collect(),
            pieces: path
                .pieces
                .iter()
                .map(|p| p.map(|c| [c[0] / scale, c[1], c[2] * scale, c[3] * scale * scale]))
                .collect(),
        };
        Self::new(
            owner,
            &path,
            start.map(|v| v / scale),
            end.map(|v| v / scale),
        )
    }

    fn ends(&self) -> [[f64; 2]; 2] {
        [self.points[0], self.points[self.points.len() - 1]]
    }
}

/// A conflict: the owners of the two strands.
pub(crate) type Conflict = (usize, usize);

/// All pairs of owners whose strands are in conflict.
pub(crate) fn conflicts(strands: &[Strand]) -> BTreeSet<Conflict> {
    search(strands, CLEARANCE)
}

/// Pairs of owners whose strands cross, touch or fold back.
pub(crate) fn crossings(strands: &[Strand]) -> BTreeSet<Conflict> {
    search(strands, 1e-9)
}

fn search(strands: &[Strand], clearance: f64) -> BTreeSet<Conflict> {
    let mut found = BTreeSet::new();
    let all = strands.iter().flat_map(|s| s.points.iter());
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in all {
        for d in 0..2 {
            low[d] = low[d].min(p[d]);
            high[d] = high[d].max(p[d]);
        }
    }
    if !(low[0].is_finite() && high[0].is_finite() && low[1].is_finite() && high[1].is_finite()) {
        return found;
    }
    let cell = |v: f64, d: usize| ((v - low[d] + CLEARANCE) / CELL) as usize;
    let rows = cell(high[1] + CLEARANCE, 1) + 1;
    let mut cells = vec![Vec::new(); (cell(high[0] + CLEARANCE, 0) + 1) * rows];
    for (s, strand) in strands.iter().enumerate() {
        for (k, pair) in strand.points.windows(2).enumerate() {
            let range = |d: usize| {
                let (a, b) = (pair[0][d].min(pair[1][d]), pair[0][d].max(pair[1][d]));
                cell(a - CLEARANCE, d)..=cell(b + CLEARANCE, d)
            };
            for column in range(0) {
                for row in range(1) {
                    cells[column * rows + row].push((s, k));
                }
            }
        }
    }
    for members in &cells {
        for (n, &a) in members.iter().enumerate() {
            for &b in &members[n + 1..] {
                let owners = (strands[a.0].owner, strands[b.0].owner);
                let owners = (owners.0.min(owners.1), owners.0.max(owners.1));
                if !found.contains(&owners) && in_conflict(strands, a, b, clearance) {
                    found.insert(owners);
                }
            }
        }
    }
    found
}

fn in_conflict(strands: &[Strand], a: (usize, usize), b: (usize, usize), clearance: f64) -> bool {
    let (first, second) = (&strands[a.0], &strands[b.0]);
    let (p, q) = (first.points[a.1], first.points[a.1 + 1]);
    let (r, s) = (second.points[b.1], second.points[b.1 + 1]);
    let within = a.0 == b.0 && a.1.abs_diff(b.1) == 1;
    let least = if within { BACK_COSINE } else { FOLD_COSINE };
    let is_fold = |u: [f64; 2], v: [f64; 2]| dot(u, v) > least * norm(u) * norm(v);
    for (shared, away, u) in [(p, q, first.inward[a.1][0]), (q, p, first.inward[a.1][1])] {
        for (other, beyond, v) in [(r, s, second.inward[b.1][0]), (s, r, second.inward[b.1][1])] {
            if shared == other {
                return is_fold(u, v) || is_fold(minus(away, shared), minus(beyond, shared));
            }
        }
    }
    let neighbours = a.0 == b.0 || first.ends().iter().any(|e| second.ends().contains(e));
    if neighbours {
        let side = |p, q, r| cross(minus(q, p), minus(r, p));
        side(p, q, r) * side(p, q, s) <= 0.0
            && side(r, s, p) * side(r, s, q) <= 0.0
            && distance_of_segments(p, q, r, s) < 1e-9
    } else {
        distance_of_segments(p, q, r, s) < clearance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand(owner: usize, points: &[[f64; 2]]) -> Strand {
        Strand::polyline(owner, points.to_vec())
    }

    #[test]
    fn crossings_touches_and_folds_are_found() {
        let line = strand(0, &[[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]);
        let found = |other: Strand| !conflicts(&[line.clone(), other]).is_empty();
        assert!(found(strand(1, &[[1.0, -1.0], [1.0, 1.0]])));
        assert!(found(strand(1, &[[1.0, 1.0], [1.0, 0.01]])));
        assert!(!found(strand(1, &[[1.0, 1.0], [1.0, 0.1]])));
        assert!(
            found(strand(1, &[[4.0, 0.0], [2.5, 0.01]])),
            "folds back at a vertex"
        );
        let leaving = |degrees: f64| {
            let (sine, cosine) = libm::sincos(degrees.to_radians());
            strand(1, &[[4.0, 0.0], [4.0 - 1.5 * cosine, 1.5 * sine]])
        };
        assert!(found(leaving(2.0)), "hardly parts from it");
        assert!(!found(leaving(4.0)));
    }

    /// A path that leaves the origin along the first axis and bends away, most where it begins.
    fn bending() -> PiecewiseCubic<2> {
        PiecewiseCubic {
            breaks: vec![0.0, 20.0],
            pieces: vec![[[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.1, -1.0 / 300.0]]],
        }
    }

    #[test]
    fn paths_that_cross_before_their_first_chords_part_are_found() {
        let path = bending();
        let of = |slope: f64| {
            let end = [20.0, 20.0 * slope];
            let line = PiecewiseCubic::line([0.0; 2], end, 20.0).unwrap();
            let bent = Strand::new(0, &path, [0.0; 2], path.evaluate(20.0));
            !conflicts(&[bent, Strand::new(1, &line, [0.0; 2], end)]).is_empty()
        };
        assert!(of(0.01), "crosses a tenth of a pitch on");
        assert!(of(0.067), "crosses where the first chord ends");
        assert!(!of(-0.2), "leaves to the other side");
    }

    #[test]
    fn what_touches_a_long_arc_between_its_chords_is_found() {
        // An arc of 400 that rises by 50: of 24 chords the middle ones lie 0.09 below it.
        let arc = PiecewiseCubic {
            breaks: vec![0.0, 400.0],
            pieces: vec![[[0.0, 1.0, 0.0, 0.0], [0.0, 0.5, -0.5 / 400.0, 0.0]]],
        };
        let tip = |above: f64| {
            let x = 400.0 * 11.5 / 24.0;
            let y = arc.evaluate(x)[1] + above;
            let spike = strand(1, &[[x, y + 3.0], [x, y]]);
            let arc = Strand::new(0, &arc, [0.0; 2], arc.evaluate(400.0));
            !conflicts(&[arc, spike]).is_empty()
        };
        assert!(tip(-0.03));
        assert!(!tip(0.05));
    }

    #[test]
    fn a_strand_that_turns_back_is_found_and_one_that_turns_away_is_not() {
        let turning = |to: [f64; 2]| strand(2, &[[0.0, 0.0], [1.0, 0.0], to]);
        let found = |strand: Strand| !conflicts(&[strand]).is_empty();
        assert!(found(turning([0.1, 0.2])));
        assert!(!found(turning([1.0, 1.0])));
        assert!(!found(turning([0.9, 0.5])));
    }

    #[test]
    fn a_figure_of_eight_is_found_and_a_circle_is_not() {
        let eight = strand(
            3,
            &[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
        );
        assert_eq!(
            conflicts(&[eight]).into_iter().collect::<Vec<_>>(),
            [(3, 3)]
        );
        let square = strand(
            0,
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]],
        );
        assert!(conflicts(&[square]).is_empty());
    }
}
