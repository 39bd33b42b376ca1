//! Borders that run back on themselves when their ends are moved.

use nurbs::PiecewiseCubic;

use crate::border::map::MapEdge;
use crate::polygon::{dot, minus};

/// Steps of a border in which it is followed.
const STEPS: usize = 24;

/// Whether the ends of a border have passed each other.
pub(super) fn turns_round(edge: &MapEdge, drawn: &MapEdge) -> bool {
    let chord = |edge: &MapEdge| minus(edge.path.end(), edge.path.start());
    edge.start != edge.end && dot(chord(edge), chord(drawn)) <= 0.0
}

/// Whether a border that was bent runs back somewhere on its way: its ends have passed each other, or
/// come so near that it has become a hairpin.
pub(super) fn turns_back(path: &PiecewiseCubic<2>, drawn: &PiecewiseCubic<2>) -> bool {
    let mut pairs = steps(path).zip(steps(drawn));
    pairs.any(|(now, before)| dot(now, before) <= 0.0)
}

/// Chords of a path over equal shares of its parameter.
fn steps(path: &PiecewiseCubic<2>) -> impl Iterator<Item = [f64; 2]> {
    let (first, last) = path.domain();
    let place = move |k: usize| path.evaluate(first + (last - first) * k as f64 / STEPS as f64);
    (0..STEPS).map(move |k| minus(place(k + 1), place(k)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::border::beam::Beam;
    use crate::border::deflect::bent;
    use crate::border::path::polyline;

    fn edge(end: usize, places: &[[f64; 2]]) -> MapEdge {
        MapEdge {
            start: 0,
            end,
            sides: [1, 2],
            path: polyline(places).unwrap(),
            is_settled: true,
            is_kept: false,
        }
    }

    #[test]
    fn ends_that_have_passed_each_other_turn_a_border_round() {
        let drawn = edge(1, &[[10.0, 20.0], [11.0, 20.2]]);
        let is_turned = |places: &[[f64; 2]]| turns_round(&edge(1, places), &drawn);
        assert!(!is_turned(&[[10.6, 20.0], [11.0, 20.2]]));
        assert!(is_turned(&[[11.4, 20.3], [11.0, 20.2]]));
        // By way of a place beside it, which another way of tracing it may well take.
        assert!(!is_turned(&[[10.0, 20.0], [11.2, 20.6], [11.0, 20.2]]));
        // What is closed has no ends.
        let ring = [[10.0, 20.0], [14.0, 20.0], [12.0, 24.0], [10.0, 20.0]];
        assert!(!turns_round(&edge(0, &ring), &edge(0, &ring)));
    }

    #[test]
    fn a_border_that_is_bent_into_a_hairpin_turns_back() {
        let drawn = polyline(&[[10.0, 20.0], [11.0, 20.0]]).unwrap();
        let is_turned = |by: [f64; 2]| {
            let path = bent::<Beam>(&drawn, None, [by, [0.0; 2]]).unwrap();
            turns_back(&path, &drawn)
        };
        assert!(!is_turned([-0.8, 0.1]) && !is_turned([0.2, 0.1]));
        // Its ends are still in order.
        assert!(is_turned([0.95, 0.1]));
        assert!(is_turned([1.3, 0.1]));
    }
}
