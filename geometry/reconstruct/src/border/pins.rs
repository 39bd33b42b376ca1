//! Outlines that pass every node on its own side.
//!
//! A drawn outline is a mean over many cracks, so it passes some nodes closely on the wrong
//! side: each is then lost or invented, and counts with its full value in a comparison of
//! images. The least bending that brings them to their side is a fraction of a pitch over
//! many, far below what the samples tell of the outline.

use nurbs::PiecewiseCubic;

use super::beam::{Beam, Ends, Pin};
use super::course::Course;
use super::cracks::Chain;
use super::deflect::{Drawn, Rule, deflect};
use crate::polygon::minus;

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

/// Places nearer than this to an end of the path are left to the next path, pitches.
const END: f64 = 0.05;

/// Pins that may be given up, those that push hardest first, before a path is left as it is.
const GIVEN_UP: usize = 16;

/// Deflects outlines until nodes lie on their sides, and moves `junctions` with them; but for
/// paths that are `settled`, since samples know better than nodes.
pub(crate) fn part(borders: &mut [Drawn<'_>], junctions: &mut [[f64; 2]], settled: &[Vec<bool>]) {
    let rule = Rule {
        farthest: CORNER_FARTHEST,
        blunt: false,
        deflection: |[border, path]: [usize; 2], curve: &_, chain: &Chain, ends| {
            let is_outline = chain.left == 0 || chain.right == 0;
            if settled[border][path] || !is_outline {
                return None;
            }
            deflection(curve, &chain.middles, ends)
        },
    };
    deflect(borders, junctions, &rule);
}

/// The deflection with which both nodes at each crack lie on their sides; `None` where none
/// is needed, or a small one does not do it. `middles` are those of the cracks that the path
/// goes along, in its direction, and more beyond its ends.
pub(crate) fn deflection(
    path: &PiecewiseCubic<2>,
    middles: &[[f64; 2]],
    ends: Ends,
) -> Option<Beam> {
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
        let Some((at, place)) = course.place(path, node, NEAR) else {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::border::deflect::bent;

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
}
