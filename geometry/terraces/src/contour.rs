//! Where two surfaces are as high, as a chain of lines and arcs.
//!
//! Marching squares finds the course of it; between points that are on it exactly, arcs through a
//! third one follow it within a tolerance, each as long as it can be.

use std::collections::BTreeMap;

use crate::height::Height;
use crate::plan::{P2, Piece, add, cross, distance, dot, left, norm, scale, sub};

/// Farthest that both heights may be apart along the chain, millimetres.
const APART_MM: f64 = 4e-6;
/// Squares along the longer side of the rectangle.
const SQUARES: usize = 96;
/// Most pieces of a crossing that is worth being followed.
const MOST: usize = 1500;

/// A side of a square, by its first node and whether it runs along x.
type Side = (usize, usize, bool);

/// The chains within a rectangle; `None` where they are too many or cannot be followed.
pub(crate) fn contour(a: &Height, b: &Height, [low, high]: [P2; 2]) -> Option<Vec<Piece>> {
    let by = |q: P2| a.at(q) - b.at(q);
    let step = (high[0] - low[0]).max(high[1] - low[1]) / SQUARES as f64;
    if !(step > 0.0 && step.is_finite()) {
        return Some(Vec::new());
    }
    // Off the even numbers that parts are made of, so that no node is on the crossing.
    let start = sub(low, [0.618 * step, 0.382 * step]);
    let count = [0, 1].map(|k| ((high[k] - start[k]) / step).ceil() as usize + 1);
    let node = |i: usize, j: usize| add(start, scale([i as f64, j as f64], step));
    let values: Vec<f64> = (0..=count[0])
        .flat_map(|i| (0..=count[1]).map(move |j| (i, j)))
        .map(|(i, j)| by(node(i, j)))
        .collect();
    let value = |i: usize, j: usize| values[i * (count[1] + 1) + j];
    let mut links: BTreeMap<Side, Vec<Side>> = BTreeMap::new();
    for i in 0..count[0] {
        for j in 0..count[1] {
            let sides = [
                (i, j, true),
                (i + 1, j, false),
                (i, j + 1, true),
                (i, j, false),
            ];
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let up = corners.map(|(i, j)| value(i, j) >= 0.0);
            let met: Vec<usize> = (0..4).filter(|&k| up[k] != up[(k + 1) % 4]).collect();
            let pairs = match met[..] {
                [a, b] => vec![(a, b)],
                // A saddle: the corner that its middle does not go with is cut off.
                [_, _, _, _] => {
                    let middle = by(add(node(i, j), [0.5 * step, 0.5 * step])) >= 0.0;
                    if middle == up[0] {
                        vec![(0, 1), (2, 3)]
                    } else {
                        vec![(3, 0), (1, 2)]
                    }
                }
                _ => Vec::new(),
            };
            for (a, b) in pairs {
                links.entry(sides[a]).or_default().push(sides[b]);
                links.entry(sides[b]).or_default().push(sides[a]);
            }
        }
    }
    let point = |(i, j, along_x): Side| {
        let far = if along_x {
            node(i + 1, j)
        } else {
            node(i, j + 1)
        };
        zero(&by, node(i, j), far)
    };
    let mut pieces = Vec::new();
    // Open chains from their ends first, then closed ones from anywhere.
    let ends = links.iter().filter(|(_, to)| to.len() == 1);
    let mut starts: Vec<_> = ends.map(|(&side, _)| side).collect();
    starts.extend(links.keys().copied());
    for first in starts {
        let mut chain = vec![first];
        let mut at = first;
        while let Some(next) = links.get_mut(&at).and_then(Vec::pop) {
            let back = links.get_mut(&next)?;
            back.retain(|&side| side != at);
            chain.push(next);
            at = next;
        }
        if chain.len() > 1 {
            let points: Vec<P2> = chain.into_iter().map(point).collect();
            follow(&by, &points, &mut pieces);
        }
        if pieces.len() > MOST {
            return None;
        }
    }
    Some(pieces)
}

/// Where a function is 0 between two places at which it has different signs.
fn zero(by: &impl Fn(P2) -> f64, mut a: P2, mut b: P2) -> P2 {
    let first = by(a) >= 0.0;
    for _ in 0..60 {
        let middle = scale(add(a, b), 0.5);
        if (by(middle) >= 0.0) == first {
            a = middle;
        } else {
            b = middle;
        }
    }
    scale(add(a, b), 0.5)
}

/// Pieces along points of a chain, each as long as it can be.
fn follow(by: &impl Fn(P2) -> f64, points: &[P2], pieces: &mut Vec<Piece>) {
    let mut from = 0;
    while from + 1 < points.len() {
        let spans = [16, 8, 4, 2].map(|span| from + span);
        let longer = spans.into_iter().filter(|&to| to < points.len());
        let mut fitting =
            longer.filter_map(|to| piece(by, points[from], points[to]).map(|piece| (to, piece)));
        if let Some((to, piece)) = fitting.next() {
            pieces.push(piece);
            from = to;
            continue;
        }
        divide(by, points[from], points[from + 1], 8, pieces);
        from += 1;
    }
}

fn divide(by: &impl Fn(P2) -> f64, a: P2, b: P2, depth: usize, pieces: &mut Vec<Piece>) {
    if distance(a, b) < 1e-5 {
        return;
    }
    if let Some(piece) = piece(by, a, b) {
        pieces.push(piece);
    } else if let (Some(middle), true) = (between(by, a, b), depth > 0) {
        divide(by, a, middle, depth - 1, pieces);
        divide(by, middle, b, depth - 1, pieces);
    }
}

/// The place of the crossing that is square to the middle of a chord.
fn between(by: &impl Fn(P2) -> f64, a: P2, b: P2) -> Option<P2> {
    let middle = scale(add(a, b), 0.5);
    let n = left(sub(b, a));
    for reach in [0.01, 0.05, 0.2, 0.45] {
        let (p, q) = (add(middle, scale(n, reach)), sub(middle, scale(n, reach)));
        if (by(p) >= 0.0) != (by(q) >= 0.0) {
            return Some(zero(by, p, q));
        }
    }
    None
}

/// A line or an arc between two places of the crossing that keeps to it.
fn piece(by: &impl Fn(P2) -> f64, a: P2, b: P2) -> Option<Piece> {
    let middle = between(by, a, b)?;
    let chord = sub(b, a);
    let bow = cross(chord, sub(middle, a)) / norm(chord);
    let piece = if bow.abs() < 1e-7 {
        Piece::Line { from: a, to: b }
    } else {
        // On the chord's middle normal, as far from the ends as from the middle.
        let half = 0.5 * norm(chord);
        let off = scale(left(chord), 1.0 / norm(chord));
        let foot = scale(add(a, b), 0.5);
        let bow = dot(sub(middle, foot), off);
        let center = add(foot, scale(off, (bow * bow - half * half) / (2.0 * bow)));
        Piece::Arc {
            from: a,
            to: b,
            center,
            ccw: bow < 0.0,
        }
    };
    let keeps = (1..12).all(|k| by(piece.at(f64::from(k) / 12.0)).abs() < APART_MM);
    (keeps && piece.sweep().abs() < 1.5).then_some(piece)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_and_a_slope_cross_along_an_ellipse() {
        let cone = Height::Cone {
            c: [1.0, 2.0],
            z: 0.0,
            slope: 1.0,
        };
        let slope = Height::Plane {
            z: 5.0,
            slope: [0.3, 0.2],
        };
        let pieces = contour(&cone, &slope, [[-20.0; 2], [20.0; 2]]).unwrap();
        // A closed chain, every piece of which keeps to both.
        let area = crate::plan::area(&pieces);
        let (g, z) = (libm::hypot(0.3, 0.2), 5.0 + 0.3 + 0.4);
        // rho = z + g rho cos: half axes z / (1 - g^2) and z / sqrt(1 - g^2).
        let expected = std::f64::consts::PI * z * z / (1.0 - g * g).powi(3).sqrt();
        assert!(
            (area.abs() / expected - 1.0).abs() < 1e-5,
            "{area} {expected}"
        );
        for (k, piece) in pieces.iter().enumerate() {
            let next = pieces[(k + 1) % pieces.len()];
            assert!(distance(piece.to(), next.from()) < 1e-6);
            let at = piece.at(0.3);
            assert!((cone.at(at) - slope.at(at)).abs() < 1e-5);
        }
        assert!(pieces.len() < 200, "{}", pieces.len());
    }
}
