//! Which line of two surfaces runs along a border, and whether one does.

use nurbs::PatchSurface;

use super::gap::{Gap, Line, Reach};
use super::touch;
use crate::assemble::Placement;
use crate::border::map::MapEdge;
use crate::polygon::norm;

/// How far a crease or a vertex is moved at most, and how much the surfaces bend there at least
/// (3 degrees): what hardly bends is off by twenty times what the surfaces are.
pub(super) const REACH: Reach = Reach {
    farthest: 1.5,
    least_bend: 0.05,
};

/// The same of surfaces that hardly bend: what the nodes are off leads their crease astray.
const FAINT: Reach = Reach {
    farthest: 4.0,
    least_bend: 0.02,
};

/// Slope (7 degrees) from which on a crease is one. Where surfaces bend less they may touch instead.
pub(super) const PLAIN_BEND: f64 = 0.12;

/// How far surfaces that touch may be apart for their join to be where they meet, millimetres: what
/// CAD programs sew.
const TOUCHED_MM: f64 = 0.01;

/// Share of a border's places that must find its line: a few are drawn too far off, mostly beside
/// its ends.
pub(super) const LEAST_SHARE: f64 = 0.8;

/// A crease is looked at so often, pitches.
pub(super) const STEP: f64 = 0.5;

/// Ends of a crease that are not looked at, pitches: its vertices are.
const TIP: f64 = 1.0;

/// What belongs to the two different pieces on the sides of an edge, if there are two; `of_pieces[k]`
/// belongs to piece `k + 1`.
pub(super) fn sides<T: Copy>(edge: &MapEdge, of_pieces: &[T]) -> Option<[T; 2]> {
    let side = |k: usize| of_pieces.get((edge.sides[k] as usize).checked_sub(1)?);
    let [left, right] = [side(0)?, side(1)?];
    (edge.sides[0] != edge.sides[1]).then_some([*left, *right])
}

/// The line of two surfaces that is near to nearly all of these places. `sides` are the surfaces and
/// the root mean squares of their residuals, millimetres.
pub(super) fn line<'a>(
    sides: [(&'a PatchSurface, f64); 2],
    placement: Placement,
    places: impl ExactSizeIterator<Item = [f64; 2]> + Clone,
) -> Option<Gap<'a>> {
    let gap = |line: Line| Gap {
        sides: sides.map(|side| side.0),
        placement,
        line,
    };
    let meets = |line: Line, least_bend: f64| {
        let gap = gap(line);
        let reach = Reach {
            least_bend,
            ..reach(&gap)
        };
        let least = LEAST_SHARE * places.len() as f64;
        let is_of = |on: [f64; 2]| line != Line::Faint || norm(gap.height(on).1) < PLAIN_BEND;
        let found = places
            .clone()
            .filter(|place| gap.nearest(*place, reach).is_some_and(is_of));
        (found.count() as f64 >= least).then_some(gap)
    };
    meets(Line::Intersection, PLAIN_BEND)
        .or_else(|| touch(sides, placement, places.clone()).map(|(gap, _)| gap))
        .or_else(|| meets(Line::Intersection, REACH.least_bend))
        .or_else(|| meets(Line::Faint, FAINT.least_bend))
}

/// Places along an edge, but for its tips.
pub(super) fn places(edge: &MapEdge) -> impl ExactSizeIterator<Item = [f64; 2]> + Clone {
    let (first, last) = edge.path.domain();
    let (from, to) = if edge.start == edge.end {
        (first, last)
    } else {
        let tip = TIP.min((last - first) / 4.0);
        (first + tip, last - tip)
    };
    let steps = ((to - from) / STEP).ceil().max(1.0) as usize;
    (0..steps + 1).map(move |k| {
        let at = from + (to - from) * k as f64 / steps as f64;
        edge.path.evaluate(at)
    })
}

/// Whether surfaces are so near to each other along an edge that it lies on both.
pub(super) fn is_closed_up(gap: &Gap<'_>, edge: &MapEdge) -> bool {
    places(edge).all(|place| gap.height(place).0.abs() <= TOUCHED_MM)
}

/// How far an edge is moved onto its line.
pub(super) fn reach(gap: &Gap<'_>) -> Reach {
    match gap.line {
        Line::Intersection => REACH,
        Line::Faint => FAINT,
        Line::Touch => touch::REACH,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meeting::testing::{PLACEMENT, graph, plane};

    /// The line of two surfaces along row 20, which is y = 0, and so many rows beside it.
    fn found(sides: [&PatchSurface; 2], rows: f64) -> Option<Line> {
        let places = (0..10).map(|k| [10.0 + f64::from(k), 20.0 + rows]);
        line(sides.map(|side| (side, 0.01)), PLACEMENT, places).map(|gap| gap.line)
    }

    #[test]
    fn surfaces_that_hardly_bend_meet_farther_off() {
        let flat = plane(0.0, 0.0, 0.0);
        let tilted = |slope: f64| plane(0.0, 0.0, slope);
        let plain = tilted(0.2);
        assert_eq!(found([&plain, &flat], 1.4), Some(Line::Intersection));
        assert_eq!(found([&plain, &flat], 1.6), None);
        let gentle = tilted(0.03);
        for rows in [0.0, 3.9] {
            assert_eq!(found([&gentle, &flat], rows), Some(Line::Faint));
        }
        assert_eq!(found([&gentle, &flat], 4.1), None);
        // What bends less tells no line.
        assert_eq!(found([&tilted(0.015), &flat], 0.0), None);
    }

    #[test]
    fn a_fillet_touches_its_plane() {
        let flat = plane(0.0, 0.0, 0.0);
        let fillet = graph(1.5, |_, y| y * y / 6.0);
        assert_eq!(found([&fillet, &flat], 1.0), Some(Line::Touch));
    }

    #[test]
    fn a_few_places_may_be_too_far_off() {
        let (flat, tilted) = (plane(0.0, 0.0, 0.0), plane(0.0, 0.0, 0.2));
        let found = |far: usize| {
            let row = |k: usize| if k < far { 25.0 } else { 20.0 };
            let places = (0..10).map(|k| [10.0 + k as f64, row(k)]);
            line([(&tilted, 0.01), (&flat, 0.01)], PLACEMENT, places).is_some()
        };
        assert!(found(2) && !found(3));
    }
}
