//! Outlines moved a little sideways.
//!
//! Corners give way with the two outlines that meet there, and take the borders between faces
//! along.

use nurbs::PiecewiseCubic;

use super::beam::Ends;
use super::cracks::Chain;
use crate::polygon::{cross, norm};

/// Sine of the least angle at which two outlines tell where their corner is.
const CROSSED: f64 = 0.3;

/// Length over which a path follows its end, pitches.
const FADE: f64 = 6.0;

/// Least length of a piece, and least move that is one; pitches.
const SHORTEST: f64 = 0.05;
const NOTHING: f64 = 1e-9;

/// A border as drawn: its paths between vertices.
pub(crate) struct Drawn<'a> {
    pub(crate) chain: &'a Chain,
    /// `None` where it may not be touched.
    pub(crate) paths: Option<&'a mut Vec<PiecewiseCubic<2>>>,
    /// Samples are not asked where it runs.
    pub(crate) as_drawn: bool,
    /// z jumps there from one surface to another.
    pub(crate) is_step: bool,
}

impl Drawn<'_> {
    fn is_outline(&self) -> bool {
        self.chain.left == 0 || self.chain.right == 0
    }
}

/// A place where paths end: a junction, or a corner of a border after this path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Vertex {
    Junction(usize),
    Corner(usize, usize),
}

/// How far a path is moved to its left.
pub(crate) trait Deflection {
    /// The amount at a place along the path, from its start, or its first derivative.
    fn at(&self, along: f64, order: usize) -> f64;
    /// How well the amount is known, as a variance.
    fn variance(&self, _along: f64) -> f64 {
        1.0
    }
    /// Where the path has to be broken, for cubics to follow.
    fn knots(&self) -> Vec<f64>;
}

/// What is to be done with outlines.
pub(crate) struct Rule<F> {
    /// Farthest that a corner is moved, pitches. One that would have to go farther stays.
    pub(crate) farthest: f64,
    /// Whether the place where two outlines go on into each other moves with them.
    pub(crate) blunt: bool,
    /// The deflection of a path of a border, by their numbers; `None` where there is none.
    pub(crate) deflection: F,
}

/// An end of an outline or a step at a vertex.
struct Arrival {
    vertex: Vertex,
    border: usize,
    path: usize,
    at_end: bool,
    /// To the left of the path.
    normal: [f64; 2],
}

/// Deflects outlines and steps, and moves `junctions` with them.
pub(crate) fn deflect<D, F>(borders: &mut [Drawn<'_>], junctions: &mut [[f64; 2]], rule: &Rule<F>)
where
    D: Deflection,
    F: Fn([usize; 2], &PiecewiseCubic<2>, &Chain, Ends) -> Option<D>,
{
    let mut arrivals = arrivals(borders);
    arrivals.sort_by_key(|a| a.vertex);
    let mut corners: Vec<(Vertex, [usize; 2])> = Vec::new();
    let mut first = 0;
    for group in arrivals.chunk_by(|a, b| a.vertex == b.vertex) {
        // Where a step ends at an outline it goes along with that.
        let of_outlines = |k: &usize| borders[arrivals[*k].border].is_outline();
        let range = first..first + group.len();
        let mut ends: Vec<usize> = range.clone().filter(of_outlines).collect();
        if ends.is_empty() {
            ends = range.collect();
        }
        if let [a, b] = ends[..]
            && (rule.blunt || cross(arrivals[a].normal, arrivals[b].normal).abs() > CROSSED)
            && !is_held(borders, arrivals[a].vertex)
        {
            corners.push((arrivals[a].vertex, [a, b]));
        }
        first += group.len();
    }
    // A corner that would have to go too far stays; its paths are then bent again.
    let (mut beams, mut moves);
    loop {
        beams = bend(borders, &arrivals, &corners, rule);
        moves = corners
            .iter()
            .map(|(_, ends)| shift(borders, &arrivals, &beams, *ends))
            .collect::<Vec<[f64; 2]>>();
        let before = corners.len();
        let mut lengths = moves.iter().map(|by| norm(*by));
        corners.retain(|_| lengths.next().is_some_and(|l| l <= rule.farthest));
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
            let beam = beams[k][n].as_ref();
            let (first, last) = path.domain();
            // A path that runs on into itself stays closed.
            let on = |at: f64| {
                let [x, y] = path.derivative(at, 1);
                let by = beam.map_or(0.0, |beam| beam.at(at - first, 0)) / norm([x, y]);
                [-y * by, x * by]
            };
            let [start, end] = vertices(ends, k, n, count);
            let by = [
                start.map_or_else(|| on(first), moved),
                end.map_or_else(|| on(last), moved),
            ];
            if (beams[k][n].is_some() || by != [[0.0; 2]; 2])
                && let Some(bent) = bent(path, beam, by)
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

/// All ends of outlines and steps.
fn arrivals(borders: &[Drawn<'_>]) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    for (border, drawn) in borders.iter().enumerate() {
        if !drawn.is_outline() && !drawn.is_step {
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
fn bend<D, F>(
    borders: &[Drawn<'_>],
    arrivals: &[Arrival],
    corners: &[(Vertex, [usize; 2])],
    rule: &Rule<F>,
) -> Vec<Vec<Option<D>>>
where
    F: Fn([usize; 2], &PiecewiseCubic<2>, &Chain, Ends) -> Option<D>,
{
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
        .enumerate()
        .map(|(k, (border, loose))| {
            let paths = border.paths.as_deref().into_iter().flatten();
            paths
                .zip(loose)
                .enumerate()
                .map(|(n, (path, &loose))| {
                    if !border.is_outline() && !border.is_step {
                        return None;
                    }
                    let ends = match border.chain.ends {
                        None if path.start() == path.end() => Ends::Clamped,
                        _ => Ends::Hinged { loose },
                    };
                    (rule.deflection)([k, n], path, border.chain, ends)
                })
                .collect()
        })
        .collect()
}

/// How far a corner moves with its two paths.
fn shift<D: Deflection>(
    borders: &[Drawn<'_>],
    arrivals: &[Arrival],
    beams: &[Vec<Option<D>>],
    ends: [usize; 2],
) -> [f64; 2] {
    let [(a, (by_a, of_a)), (b, (by_b, of_b))] = ends.map(|k| {
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
        let by = beam.map_or((0.0, 1.0), |beam| (beam.at(along, 0), beam.variance(along)));
        (arrival.normal, by)
    });
    let sine = cross(a, b);
    if sine.abs() <= CROSSED {
        // Each is believed the more the better it is known.
        let share = of_b / (of_a + of_b);
        return [0, 1].map(|d| share * by_a * a[d] + (1.0 - share) * by_b * b[d]);
    }
    [
        (by_a * b[1] - by_b * a[1]) / sine,
        (by_b * a[0] - by_a * b[0]) / sine,
    ]
}

/// The path moved to its left by the deflection, and its ends by `moves`.
pub(crate) fn bent<D: Deflection>(
    path: &PiecewiseCubic<2>,
    beam: Option<&D>,
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
    breaks.extend((norm(left[0]) > NOTHING).then_some(first + fade));
    breaks.extend((norm(left[1]) > NOTHING).then_some(last - fade));
    breaks.sort_unstable_by(f64::total_cmp);
    // A knot next to another break would make a piece of hardly any length.
    breaks.dedup_by(|b, a| *b - *a < SHORTEST);
    if breaks.len() < 2 {
        breaks.push(last);
    }
    *breaks.first_mut()? = first;
    *breaks.last_mut()? = last;
    // The same for the pieces on both sides, also where a break between two was left out.
    let place = |at: f64| {
        let (place, [x, y]) = (path.evaluate(at), path.derivative(at, 1));
        let across = by(at, 0) / norm([x, y]);
        let (from_first, _) = faded((at - first) / fade);
        let (from_last, _) = faded((last - at) / fade);
        let carried = |d: usize| from_first * left[0][d] + from_last * left[1][d];
        [
            place[0] - across * y + carried(0),
            place[1] + across * x + carried(1),
        ]
    };
    let pieces = breaks
        .windows(2)
        .map(|pair| {
            // Of the piece that holds the middle, so that both ends are of the same.
            let middle = (pair[0] + pair[1]) / 2.0;
            let after = path.breaks.partition_point(|b| *b <= middle);
            let piece = after.clamp(1, path.pieces.len()) - 1;
            let slope = |at: f64| {
                let (from, to) = (path.breaks[piece], path.breaks[piece + 1]);
                let s = at.clamp(from, to) - from;
                let [tangent, bend] = [1, 2].map(|order| path.piece_value(piece, s, order));
                let speed = norm(tangent);
                let normal = [-tangent[1] / speed, tangent[0] / speed];
                // The normal turns with the tangent.
                let turn = cross(tangent, bend) / (speed * speed);
                let (across, rise) = (by(at, 0), by(at, 1));
                let (_, first_slope) = faded((at - first) / fade);
                let (_, last_slope) = faded((last - at) / fade);
                let carried =
                    |d: usize| (first_slope * left[0][d] - last_slope * left[1][d]) / fade;
                [0, 1].map(|d| {
                    tangent[d] + rise * normal[d] - across * turn * tangent[d] / speed + carried(d)
                })
            };
            let [from, to] = [pair[0], pair[1]].map(place);
            super::path::hermite(from, slope(pair[0]), to, slope(pair[1]), pair[1] - pair[0])
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
    use crate::border::beam::Beam;
    use crate::polygon::minus;

    #[test]
    fn a_path_of_pieces_too_short_to_keep_stays_whole() {
        // A bend within less than the shortest piece, and one that is a path of its own.
        let breaks = vec![0.0, 2.0, 2.03, 4.0];
        let places = [[0.0, 0.0], [2.0, 0.0], [2.02, 0.02], [2.5, 1.9]];
        let pieces = breaks.windows(2).zip(places.windows(2)).map(|(at, ends)| {
            let slope = |d: usize| (ends[1][d] - ends[0][d]) / (at[1] - at[0]);
            [0, 1].map(|d| [ends[0][d], slope(d), 0.0, 0.0])
        });
        let bend = PiecewiseCubic::new(breaks.clone(), pieces.collect()).unwrap();
        let short = PiecewiseCubic::line([0.0, 0.0], [0.03, 0.0], 0.03).unwrap();
        for drawn in [bend, short] {
            let path = bent::<Beam>(&drawn, None, [[0.1, 0.2], [0.0, -0.1]]).unwrap();
            for k in 1..path.pieces.len() {
                let width = path.breaks[k] - path.breaks[k - 1];
                let before = path.piece_value(k - 1, width, 0);
                assert!(norm(minus(path.piece_value(k, 0.0, 0), before)) < 1e-12);
            }
            let ends = [drawn.start(), drawn.end()];
            let [start, end] = [[0.1, 0.2], [0.0, -0.1]];
            assert!(norm(minus(path.start(), [0, 1].map(|d| ends[0][d] + start[d]))) < 1e-12);
            assert!(norm(minus(path.end(), [0, 1].map(|d| ends[1][d] + end[d]))) < 1e-12);
        }
    }

    #[test]
    fn ends_are_carried_along() {
        let drawn = PiecewiseCubic::line([0.0, 0.0], [30.0, 0.0], 30.0).unwrap();
        let path = bent::<Beam>(&drawn, None, [[0.1, 0.2], [0.0, 0.0]]).unwrap();
        assert_eq!(path.start(), [0.1, 0.2]);
        assert_eq!(path.end(), [30.0, 0.0]);
        assert_eq!(path.evaluate(15.0), [15.0, 0.0]);
        let before = path.derivative(FADE - 1e-9, 1);
        assert!((before[0] - 1.0).abs() < 1e-6 && before[1].abs() < 1e-6);
    }
}
