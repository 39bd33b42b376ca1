//! Outlines that pass every node on its own side.
//!
//! A drawn outline is a mean over many cracks, so it passes some nodes closely on the wrong
//! side: each is then lost or invented, and counts with its full value in a comparison of
//! images. The least bending that brings them to their side is a fraction of a pitch over
//! many, far below what the samples tell of the outline. Corners give way with the two
//! outlines that meet there, and take the borders between faces along.

use nurbs::PiecewiseCubic;

use super::beam::{Beam, Ends, Pin};
use super::cracks::Chain;
use crate::polygon::{cross, dot, minus, norm};

/// Distance that nodes keep from the outline, pitches.
const MARGIN: f64 = 0.02;

/// A node farther on the wrong side than this is a mistake of the labels, unless others near
/// it lie there, too: then the outline is drawn wrong, but not by more than the second
/// figure. Pitches.
const MISTAKEN: f64 = 0.25;
const MISDRAWN: f64 = 0.5;

/// How many others lie on the wrong side by so much, along so much of the path, where it is
/// the outline that is wrong; pitches.
const OTHERS: usize = 2;
const AS_WRONG: f64 = 0.1;
const ALONG: f64 = 4.0;

/// Farthest that an outline is deflected, and a corner moved, pitches.
const FARTHEST: f64 = 0.5;
const CORNER_FARTHEST: f64 = 0.3;

/// Nodes nearer to a path than this may come into its way, pitches.
const NEAR: f64 = 0.9;

/// Chords by which a piece is replaced to find the nearest place of it; each is at most so
/// long, pitches.
const CHORD: f64 = 0.5;

/// Places nearer than this to an end of the path are left to the next path, pitches.
const END: f64 = 0.05;

/// Pins that may be given up, those that push hardest first, before a path is left as it is.
const GIVEN_UP: usize = 16;

/// Sine of the least angle at which two outlines tell where their corner is.
const CROSSED: f64 = 0.3;

/// Length over which a path follows its end, pitches.
const FADE: f64 = 6.0;

/// A border as drawn: its paths between vertices.
pub(crate) struct Drawn<'a> {
    pub(crate) chain: &'a Chain,
    /// `None` where it may not be touched.
    pub(crate) paths: Option<&'a mut Vec<PiecewiseCubic<2>>>,
}

/// A place where paths end: a junction, or a corner of a border after this path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Vertex {
    Junction(usize),
    Corner(usize, usize),
}

/// An end of an outline at a vertex.
struct Arrival {
    vertex: Vertex,
    border: usize,
    path: usize,
    at_end: bool,
    /// To the left of the path.
    normal: [f64; 2],
}

/// Deflects outlines, and moves `junctions` with them.
pub(crate) fn part(borders: &mut [Drawn<'_>], junctions: &mut [[f64; 2]]) {
    let mut arrivals = arrivals(borders);
    arrivals.sort_by_key(|a| a.vertex);
    let mut corners: Vec<(Vertex, [usize; 2])> = Vec::new();
    let mut first = 0;
    for group in arrivals.chunk_by(|a, b| a.vertex == b.vertex) {
        if let [a, b] = group
            && cross(a.normal, b.normal).abs() > CROSSED
            && !is_held(borders, a.vertex)
        {
            corners.push((a.vertex, [first, first + 1]));
        }
        first += group.len();
    }
    // A corner that would have to go too far stays; its paths are then bent again.
    let (mut beams, mut moves);
    loop {
        beams = bend(borders, &arrivals, &corners);
        moves = corners
            .iter()
            .map(|(_, ends)| shift(borders, &arrivals, &beams, *ends))
            .collect::<Vec<[f64; 2]>>();
        let before = corners.len();
        let mut lengths = moves.iter().map(|by| norm(*by));
        corners.retain(|_| lengths.next().is_some_and(|l| l <= CORNER_FARTHEST));
        if corners.len() == before {
            break;
        }
    }
    let moved = |vertex: Vertex| {
        let found = corners.iter().position(|(v, _)| *v == vertex);
        found.map_or([0.0; 2], |k| moves[k])
    };
    for (k, border) in borders.iter_mut().enumerate() {
        let ends = border.chain.ends;
        let Some(paths) = border.paths.as_deref_mut() else {
            continue;
        };
        let count = paths.len();
        for (n, path) in paths.iter_mut().enumerate() {
            let by = vertices(ends, k, n, count).map(|v| v.map_or([0.0; 2], moved));
            if (beams[k][n].is_some() || by != [[0.0; 2]; 2])
                && let Some(bent) = bent(path, beams[k][n].as_ref(), by)
            {
                *path = bent;
            }
        }
    }
    for (vertex, by) in corners.iter().map(|c| c.0).zip(&moves) {
        if let Vertex::Junction(k) = vertex {
            junctions[k] = [0, 1].map(|d| junctions[k][d] + by[d]);
        }
    }
}

/// The vertices at both ends of a path; `None` where a closed border runs on.
fn vertices(
    ends: Option<(usize, usize)>,
    border: usize,
    path: usize,
    count: usize,
) -> [Option<Vertex>; 2] {
    let corner = |after: usize| (count > 1).then_some(Vertex::Corner(border, after));
    let start = match ends {
        Some((start, _)) if path == 0 => Some(Vertex::Junction(start)),
        _ => corner((path + count - 1) % count),
    };
    let end = match ends {
        Some((_, end)) if path + 1 == count => Some(Vertex::Junction(end)),
        _ => corner(path),
    };
    [start, end]
}

/// Whether a border ends here that may not be touched.
fn is_held(borders: &[Drawn<'_>], vertex: Vertex) -> bool {
    let Vertex::Junction(junction) = vertex else {
        return false;
    };
    borders.iter().any(|border| {
        let ends = border.chain.ends;
        border.paths.is_none() && ends.is_some_and(|(a, b)| a == junction || b == junction)
    })
}

fn is_outline(chain: &Chain) -> bool {
    chain.left == 0 || chain.right == 0
}

/// All ends of outlines.
fn arrivals(borders: &[Drawn<'_>]) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    for (border, drawn) in borders.iter().enumerate() {
        if !is_outline(drawn.chain) {
            continue;
        }
        let Some(paths) = drawn.paths.as_deref() else {
            continue;
        };
        for (path, curve) in paths.iter().enumerate() {
            let of_path = vertices(drawn.chain.ends, border, path, paths.len());
            let (first, last) = curve.domain();
            for (vertex, at, at_end) in [(of_path[0], first, false), (of_path[1], last, true)] {
                let Some(vertex) = vertex else { continue };
                let tangent = curve.derivative(at, 1);
                let length = norm(tangent).max(1e-9);
                arrivals.push(Arrival {
                    vertex,
                    border,
                    path,
                    at_end,
                    normal: [-tangent[1] / length, tangent[0] / length],
                });
            }
        }
    }
    arrivals
}

/// The deflection of every path that needs one, with these corners loose.
fn bend(
    borders: &[Drawn<'_>],
    arrivals: &[Arrival],
    corners: &[(Vertex, [usize; 2])],
) -> Vec<Vec<Option<Beam>>> {
    let mut loose: Vec<Vec<[bool; 2]>> = borders
        .iter()
        .map(|b| vec![[false; 2]; b.paths.as_deref().map_or(0, Vec::len)])
        .collect();
    for arrival in corners
        .iter()
        .flat_map(|(_, ends)| ends)
        .map(|k| &arrivals[*k])
    {
        loose[arrival.border][arrival.path][usize::from(arrival.at_end)] = true;
    }
    borders
        .iter()
        .zip(&loose)
        .map(|(border, loose)| {
            let paths = border.paths.as_deref().into_iter().flatten();
            paths
                .zip(loose)
                .map(|(path, &loose)| {
                    if !is_outline(border.chain) {
                        return None;
                    }
                    let ends = match border.chain.ends {
                        None if path.start() == path.end() => Ends::Clamped,
                        _ => Ends::Hinged { loose },
                    };
                    deflection(path, &border.chain.middles, ends)
                })
                .collect()
        })
        .collect()
}

/// The deflection with which both nodes at each crack lie on their sides; `None` where none
/// is needed, or a small one does not do it. `middles` are those of the cracks that the path
/// goes along, in its direction, and more beyond its ends.
fn deflection(path: &PiecewiseCubic<2>, middles: &[[f64; 2]], ends: Ends) -> Option<Beam> {
    let mut pins = pins(path, middles);
    let (first, last) = path.domain();
    for _ in 0..=GIVEN_UP {
        if pins.iter().all(|pin| pin.side * pin.place >= MARGIN) {
            return None;
        }
        match Beam::among(last - first, ends, &pins, MARGIN, FARTHEST) {
            Ok(beam) => return Some(beam),
            Err(hardest) => {
                pins.remove(hardest);
            }
        }
    }
    None
}

/// The nodes at the cracks, as seen from the path.
fn pins(path: &PiecewiseCubic<2>, middles: &[[f64; 2]]) -> Vec<Pin> {
    let course = Course::of(path);
    let (first, last) = path.domain();
    let mut seen: Vec<([f64; 2], f64)> = Vec::new();
    for (k, &middle) in middles.iter().enumerate() {
        let before = middles[k.saturating_sub(1)];
        let after = middles[(k + 1).min(middles.len() - 1)];
        seen.extend(nodes(middle, minus(after, before)));
    }
    seen.sort_by(|(p, _), (q, _)| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    seen.dedup();
    let mut pins = Vec::new();
    for (node, side) in seen {
        let Some((at, place)) = course.place(path, node) else {
            continue;
        };
        if at - first > END && last - at > END && side * place > -MISDRAWN {
            pins.push(Pin {
                along: at - first,
                place,
                side,
            });
        }
    }
    pins.sort_by(|a, b| {
        a.along
            .total_cmp(&b.along)
            .then(a.place.total_cmp(&b.place))
    });
    let is_mistaken = |pin: &Pin| {
        let alike = |other: &&Pin| {
            (other.along - pin.along).abs() <= ALONG
                && other.side == pin.side
                && other.side * other.place < -AS_WRONG
        };
        // The pin itself is one of them.
        pin.side * pin.place <= -MISTAKEN && pins.iter().filter(alike).count() <= OTHERS
    };
    pins.iter()
        .filter(|pin| !is_mistaken(pin))
        .copied()
        .collect()
}

/// How far a corner moves with its two outlines.
fn shift(
    borders: &[Drawn<'_>],
    arrivals: &[Arrival],
    beams: &[Vec<Option<Beam>>],
    ends: [usize; 2],
) -> [f64; 2] {
    let [(a, by_a), (b, by_b)] = ends.map(|k| {
        let arrival = &arrivals[k];
        let length = borders[arrival.border]
            .paths
            .as_deref()
            .map_or(0.0, |paths| {
                let (first, last) = paths[arrival.path].domain();
                last - first
            });
        let along = if arrival.at_end { length } else { 0.0 };
        let beam = beams[arrival.border][arrival.path].as_ref();
        (arrival.normal, beam.map_or(0.0, |beam| beam.at(along, 0)))
    });
    let sine = cross(a, b);
    [
        (by_a * b[1] - by_b * a[1]) / sine,
        (by_b * a[0] - by_a * b[0]) / sine,
    ]
}

/// The nodes on the left and on the right of a crack, seen along its direction.
fn nodes(middle: [f64; 2], direction: [f64; 2]) -> [([f64; 2], f64); 2] {
    // A middle has a half coordinate along the axis that joins its nodes.
    let parts_columns = (middle[0] - middle[0].round()).abs() > 0.25;
    let to_left = if parts_columns {
        [-0.5_f64.copysign(direction[1]), 0.0]
    } else {
        [0.0, 0.5_f64.copysign(direction[0])]
    };
    let beside = |sign: f64| [0, 1].map(|d| middle[d] + sign * to_left[d]);
    [(beside(1.0), 1.0), (beside(-1.0), -1.0)]
}

/// A path as chords, with the parameters of their ends.
struct Course {
    chords: Vec<(f64, [f64; 2])>,
}

/// Chords that are looked at together, or not at all where all of them are too far away.
const BUNDLE: usize = 16;

impl Course {
    fn of(path: &PiecewiseCubic<2>) -> Self {
        let mut chords = vec![(path.domain().0, path.start())];
        for k in 0..path.pieces.len() {
            let width = path.breaks[k + 1] - path.breaks[k];
            let straight = path.pieces[k].iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
            let count = if straight {
                1
            } else {
                (width / CHORD).ceil().clamp(1.0, 1e5) as usize
            };
            for p in 1..=count {
                let at = width * p as f64 / count as f64;
                chords.push((path.breaks[k] + at, path.piece_value(k, at, 0)));
            }
        }
        Self { chords }
    }

    /// The parameter at which the path is nearest to a point, and how far to the left of it
    /// the point lies. `None` when it is far away.
    fn place(&self, path: &PiecewiseCubic<2>, point: [f64; 2]) -> Option<(f64, f64)> {
        let mut best = (NEAR, None);
        let mut bundle = 0;
        while bundle + 1 < self.chords.len() {
            let end = (bundle + BUNDLE).min(self.chords.len() - 1);
            let reach: f64 = self.chords[bundle..=end]
                .windows(2)
                .map(|pair| norm(minus(pair[1].1, pair[0].1)))
                .sum();
            if norm(minus(point, self.chords[bundle].1)) <= reach + NEAR {
                for pair in self.chords[bundle..=end].windows(2) {
                    let ((from, a), (to, b)) = (pair[0], pair[1]);
                    let along = minus(b, a);
                    let share = (dot(minus(point, a), along) / dot(along, along)).clamp(0.0, 1.0);
                    let off = norm(minus(point, [0, 1].map(|d| a[d] + share * along[d])));
                    if off < best.0 {
                        best = (off, Some(from + share * (to - from)));
                    }
                }
            }
            bundle = end;
        }
        let at = best.1?;
        let tangent = path.derivative(at, 1);
        let left = cross(tangent, minus(point, path.evaluate(at))) / norm(tangent);
        Some((at, left))
    }
}

/// The path moved to its left by the deflection, and its ends by `moves`.
fn bent(
    path: &PiecewiseCubic<2>,
    beam: Option<&Beam>,
    moves: [[f64; 2]; 2],
) -> Option<PiecewiseCubic<2>> {
    let (first, last) = path.domain();
    let by = |at: f64, order: usize| beam.map_or(0.0, |beam| beam.at(at - first, order));
    let fade = FADE.min((last - first) / 2.0);
    // What the deflection leaves of the ends' moves: along the path, or of another path.
    let left = [(first, moves[0]), (last, moves[1])].map(|(at, whole)| {
        let tangent = path.derivative(at, 1);
        let speed = norm(tangent);
        let done = by(at, 0) / speed;
        [whole[0] + tangent[1] * done, whole[1] - tangent[0] * done]
    });
    let mut breaks = path.breaks.clone();
    breaks.extend(
        beam.iter()
            .flat_map(|beam| beam.knots())
            .map(|knot| first + knot),
    );
    breaks.extend((left[0] != [0.0; 2]).then_some(first + fade));
    breaks.extend((left[1] != [0.0; 2]).then_some(last - fade));
    breaks.sort_unstable_by(f64::total_cmp);
    // A knot next to another break would make a piece of no length.
    breaks.dedup_by(|b, a| *b - *a < 1e-3);
    *breaks.first_mut()? = first;
    *breaks.last_mut()? = last;
    let pieces = breaks
        .windows(2)
        .map(|pair| {
            // Of the piece that holds the middle, so that both ends are of the same.
            let middle = (pair[0] + pair[1]) / 2.0;
            let after = path.breaks.partition_point(|b| *b <= middle);
            let piece = after.clamp(1, path.pieces.len()) - 1;
            let end = |at: f64| {
                let s = at - path.breaks[piece];
                let [place, tangent, bend] =
                    [0, 1, 2].map(|order| path.piece_value(piece, s, order));
                let speed = norm(tangent);
                let normal = [-tangent[1] / speed, tangent[0] / speed];
                // The normal turns with the tangent.
                let turn = cross(tangent, bend) / (speed * speed);
                let (across, slope) = (by(at, 0), by(at, 1));
                let (from_first, first_slope) = faded((at - first) / fade);
                let (from_last, last_slope) = faded((last - at) / fade);
                let carried = |d: usize| from_first * left[0][d] + from_last * left[1][d];
                let carried_slope =
                    |d: usize| (first_slope * left[0][d] - last_slope * left[1][d]) / fade;
                (
                    [0, 1].map(|d| place[d] + across * normal[d] + carried(d)),
                    [0, 1].map(|d| {
                        tangent[d] + slope * normal[d] - across * turn * tangent[d] / speed
                            + carried_slope(d)
                    }),
                )
            };
            let ((from, out), (to, into)) = (end(pair[0]), end(pair[1]));
            super::path::hermite(from, out, to, into, pair[1] - pair[0])
        })
        .collect();
    PiecewiseCubic::new(breaks, pieces).ok()
}

/// From 1 at 0 to 0 at 1 and beyond, and its derivative.
fn faded(share: f64) -> (f64, f64) {
    if share >= 1.0 {
        return (0.0, 0.0);
    }
    let rest = 1.0 - share;
    (rest * rest * (1.0 + 2.0 * share), -6.0 * share * rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Middles of the cracks along `y = offset + slope x`, travelled to the right.
    fn staircase(columns: i32, edge: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let mut middles: Vec<[f64; 2]> = Vec::new();
        let mut before: Option<f64> = None;
        for column in 0..columns {
            let x = f64::from(column);
            let y = edge(x).floor() + 0.5;
            if let Some(mut from) = before {
                while from < y {
                    middles.push([x - 0.5, from + 0.5]);
                    from += 1.0;
                }
                while from > y {
                    middles.push([x - 0.5, from - 0.5]);
                    from -= 1.0;
                }
            }
            middles.push([x, y]);
            before = Some(y);
        }
        middles
    }

    #[test]
    fn nodes_of_a_crack_are_left_and_right_of_it() {
        assert_eq!(
            nodes([3.0, 4.5], [1.0, 0.3]),
            [([3.0, 5.0], 1.0), ([3.0, 4.0], -1.0)]
        );
        assert_eq!(
            nodes([3.5, 4.0], [0.3, -1.0]),
            [([4.0, 4.0], 1.0), ([3.0, 4.0], -1.0)]
        );
    }

    #[test]
    fn a_line_is_bent_just_enough() {
        // The line that is drawn lies beside the one that was sampled.
        let truth = |x: f64| 0.31 * x + 0.07 + 0.06 * libm::sin(0.1 * x);
        let middles = staircase(120, truth);
        let length = libm::hypot(119.0, 0.31 * 119.0);
        let drawn = PiecewiseCubic::line([0.0, 0.1], [119.0, 0.31 * 119.0 + 0.1], length).unwrap();
        let wrong = |path: &PiecewiseCubic<2>| {
            let fine = path.sampled(4000);
            (1..119)
                .flat_map(|x| (0..60).map(move |y| [f64::from(x), f64::from(y)]))
                .filter(|n| {
                    let k = fine.partition_point(|p| p[0] < n[0]);
                    let above = n[1] > fine[k][1];
                    above != (n[1] > truth(n[0]))
                })
                .count()
        };
        assert!(wrong(&drawn) > 5);
        let ends = Ends::Hinged {
            loose: [false, false],
        };
        let beam = deflection(&drawn, &middles, ends).unwrap();
        let path = bent(&drawn, Some(&beam), [[0.0; 2]; 2]).unwrap();
        assert_eq!(wrong(&path), 0);
        assert_eq!((path.start(), path.end()), (drawn.start(), drawn.end()));
        let farthest = path
            .sampled(50)
            .iter()
            .map(|p| (p[1] - 0.31 * p[0] - 0.1).abs())
            .fold(0.0, f64::max);
        assert!(farthest < 0.2, "{farthest}");
        // Knots only where nodes are in the way.
        assert!(path.pieces.len() < 30, "{}", path.pieces.len());
    }

    #[test]
    fn a_path_with_all_nodes_on_their_sides_stays_as_it_is() {
        let middles = staircase(40, |x| 0.2 * x + 0.5);
        let drawn = PiecewiseCubic::line([0.0, 0.5], [39.0, 8.3], 40.0).unwrap();
        assert!(deflection(&drawn, &middles, Ends::Clamped).is_none());
    }

    #[test]
    fn ends_are_carried_along() {
        let drawn = PiecewiseCubic::line([0.0, 0.0], [30.0, 0.0], 30.0).unwrap();
        let path = bent(&drawn, None, [[0.1, 0.2], [0.0, 0.0]]).unwrap();
        assert_eq!(path.start(), [0.1, 0.2]);
        assert_eq!(path.end(), [30.0, 0.0]);
        assert_eq!(path.evaluate(15.0), [15.0, 0.0]);
        let before = path.derivative(FADE - 1e-9, 1);
        assert!((before[0] - 1.0).abs() < 1e-6 && before[1].abs() < 1e-6);
    }
}
