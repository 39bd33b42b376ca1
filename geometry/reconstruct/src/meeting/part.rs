//! Borders between two pieces that are a crease on a part of their way only.
//!
//! A ring stands on a plate: from one side its foot is seen, on the other it hides it. Drawn as one
//! border, that is neither a crease nor a step. It is cut where the one goes over into the other.

use nurbs::PatchSurface;

use super::gap::{Gap, Line, Reach};
use super::line::{PLAIN_BEND, REACH, STEP, sides};
use crate::assemble::Placement;
use crate::border::cracks::Use;
use crate::border::map::{MapEdge, PlanarMap};

/// A part is no shorter than this, pitches: what is shorter is of the parts beside it.
const LEAST_LENGTH: f64 = 8.0;

/// Cuts borders where the surfaces beside them cease to meet. `surfaces[k]` belongs to piece `k + 1`.
pub(crate) fn part(map: &mut PlanarMap, surfaces: &[&PatchSurface], placement: Placement) {
    for index in 0..map.edges.len() {
        let edge = &map.edges[index];
        let Some(sides) = sides(edge, surfaces) else {
            continue;
        };
        let gap = Gap {
            sides,
            placement,
            line: Line::Intersection,
        };
        let cuts = cuts(edge, &gap);
        if !cuts.is_empty() {
            cut(map, index, &cuts);
        }
    }
}

/// Parameters of a path between stretches along which its surfaces meet, and others.
fn cuts(edge: &MapEdge, gap: &Gap<'_>) -> Vec<f64> {
    let (first, last) = edge.path.domain();
    let count = ((last - first) / STEP).ceil().max(1.0) as usize;
    let at = |k: usize| first + (last - first) * (k as f64 + 0.5) / count as f64;
    let reach = Reach {
        least_bend: PLAIN_BEND,
        ..REACH
    };
    let meets = |k: usize| gap.nearest(edge.path.evaluate(at(k)), reach).is_some();
    let mut meets: Vec<bool> = (0..count).map(meets).collect();
    without_short(&mut meets, (LEAST_LENGTH / STEP) as usize);
    let runs = runs(&meets);
    let starts = runs.iter().skip(1).map(|(from, _)| *from);
    starts
        .map(|from| first + (last - first) * from as f64 / count as f64)
        .collect()
}

/// Gives stretches shorter than this to those beside them, the shortest first, which the two beside it
/// take in.
pub(crate) fn without_short(meets: &mut [bool], least: usize) {
    loop {
        let runs = runs(meets);
        let short = runs.iter().filter(|(from, to)| to - from < least);
        let Some(&(from, to)) = short.min_by_key(|(from, to)| to - from) else {
            break;
        };
        if runs.len() == 1 {
            break;
        }
        let other = !meets[from];
        meets[from..to].fill(other);
    }
}

/// Stretches of one kind, each from its first place to the one after its last.
pub(crate) fn runs<T: PartialEq>(meets: &[T]) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (k, own) in meets.iter().enumerate() {
        match runs.last_mut() {
            Some((from, to)) if meets[*from] == *own => *to = k + 1,
            _ => runs.push((k, k + 1)),
        }
    }
    runs
}

/// Cuts an edge at these parameters, ascending.
pub(super) fn cut(map: &mut PlanarMap, index: usize, at: &[f64]) {
    let edge = map.edges[index].clone();
    let (first, last) = edge.path.domain();
    let ends: Vec<f64> = [first]
        .into_iter()
        .chain(at.iter().copied())
        .chain([last])
        .collect();
    let paths: Option<Vec<_>> = ends
        .windows(2)
        .map(|pair| edge.path.restricted(pair[0], pair[1]))
        .collect();
    let Some(paths) = paths else { return };
    let mut start = edge.start;
    let mut parts = Vec::new();
    let count = paths.len();
    for (k, path) in paths.into_iter().enumerate() {
        let end = if k + 1 == count {
            edge.end
        } else {
            map.vertices.push(path.end());
            map.vertices.len() - 1
        };
        let part = MapEdge {
            start,
            end,
            path,
            ..edge.clone()
        };
        if k == 0 {
            map.edges[index] = part;
            parts.push(index);
        } else {
            map.edges.push(part);
            parts.push(map.edges.len() - 1);
        }
        start = end;
    }
    for uses in map.loops.iter_mut().flatten() {
        // In the loop's sense of travel.
        let of = |&(edge, reversed): &Use| -> Vec<Use> {
            if edge != index {
                return vec![(edge, reversed)];
            }
            let own = parts.iter().map(|part| (*part, reversed));
            if reversed {
                own.rev().collect()
            } else {
                own.collect()
            }
        };
        *uses = uses.iter().flat_map(of).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meeting::testing::{PLACEMENT, graph, plane};
    use nurbs::PiecewiseCubic;

    /// Two pieces side by side, with a border along x = 20 pitches, which is x = 0.
    fn parted(left: &PatchSurface, right: &PatchSurface) -> PlanarMap {
        let line = |from: [f64; 2], to: [f64; 2]| {
            PiecewiseCubic::line(from, to, (to[0] - from[0]).abs() + (to[1] - from[1]).abs())
        };
        let edge = |start: usize, end: usize, sides: [u32; 2]| {
            let places = [[20.0, 0.0], [20.0, 80.0], [0.0, 0.0], [0.0, 80.0]];
            MapEdge {
                start,
                end,
                sides,
                path: line(places[start], places[end]).unwrap(),
                is_settled: false,
                is_kept: false,
            }
        };
        let mut map = PlanarMap {
            vertices: vec![[20.0, 0.0], [20.0, 80.0], [0.0, 0.0], [0.0, 80.0]],
            edges: vec![
                edge(0, 1, [1, 2]),
                edge(1, 3, [1, 0]),
                edge(3, 2, [1, 0]),
                edge(2, 0, [1, 0]),
            ],
            loops: vec![
                vec![vec![(0, false), (1, false), (2, false), (3, false)]],
                vec![vec![(0, true)]],
            ],
            ..PlanarMap::default()
        };
        part(&mut map, &[left, right], PLACEMENT);
        map
    }

    #[test]
    fn a_border_is_cut_where_a_crease_becomes_a_step() {
        // The right side falls away from y = 10 on: there is no crease any more.
        let left = plane(0.0, 0.0, 0.0);
        let right = graph(1.5, |x, y| 0.6 * x - 2.0 * (y - 10.0).max(0.0));
        let map = parted(&left, &right);
        assert_eq!(map.edges.len(), 5);
        // y = 10 mm is 40 pitches from the border's start.
        let cut = map.vertices[4];
        assert!(cut[0] == 20.0 && (cut[1] - 40.0).abs() < 4.0, "{cut:?}");
        assert_eq!(
            map.loops[0],
            [[(0, false), (4, false), (1, false), (2, false), (3, false)]]
        );
        assert_eq!(map.loops[1], [[(4, true), (0, true)]]);
        for (own, next) in [(0, 4), (4, 1)] {
            assert_eq!(map.edges[own].end, map.edges[next].start);
            assert_eq!(map.edges[own].path.end(), map.vertices[map.edges[own].end]);
        }
    }

    #[test]
    fn a_border_of_one_kind_is_not_cut() {
        let level = plane(0.0, 0.0, 0.0);
        assert_eq!(parted(&level, &plane(0.0, 0.6, 0.0)).edges.len(), 4);
        assert_eq!(parted(&level, &plane(-3.0, 0.0, 0.0)).edges.len(), 4);
        // Nor where the crease is lost for a moment.
        let notch = graph(1.5, |x, y| {
            0.6 * x - 2.0 * (1.0 - (y - 10.0).abs()).max(0.0)
        });
        assert_eq!(parted(&level, &notch).edges.len(), 4);
    }
}
