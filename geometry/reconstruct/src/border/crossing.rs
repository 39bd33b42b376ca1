//! Finds paths that cross, touch or fold back on themselves.

use std::collections::BTreeSet;

use nurbs::PiecewiseCubic;

use crate::polygon::{cross, distance_of_segments, dot, minus, norm};

/// Side of the cells in which segments are looked up.
const CELL: f64 = 2.0;

/// Chords by which a curved piece is replaced; it turns by less than a right angle.
const CHORDS: usize = 24;

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
    pub(crate) owner: usize,
    pub(crate) points: Vec<[f64; 2]>,
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
        for k in 0..path.pieces.len() {
            let width = path.breaks[k + 1] - path.breaks[k];
            let straight = path.pieces[k].iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
            let count = if straight { 1 } else { CHORDS };
            for p in 1..=count {
                points.push(path.piece_value(k, width * p as f64 / count as f64, 0));
            }
        }
        if let Some(last) = points.last_mut() {
            *last = end;
        }
        Self { owner, points }
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
    for (shared, away) in [(p, q), (q, p)] {
        for (other, beyond) in [(r, s), (s, r)] {
            if shared == other {
                let (u, v) = (minus(away, shared), minus(beyond, shared));
                return dot(u, v) > least * norm(u) * norm(v);
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
        Strand {
            owner,
            points: points.to_vec(),
        }
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
