//! Faces that go over into each other without a crease, as a fillet does into the faces beside it.
//!
//! Where they touch their surfaces have one tangent plane. What the surfaces are off parts them a
//! little there, or lets them intersect twice, far to either side: the height of two surfaces that
//! touch is a parabola, and its vertex is known far better than where it vanishes.

use nurbs::PatchSurface;

use super::gap::{Gap, Line, Reach};
use super::line::LEAST_SHARE;
use crate::assemble::Placement;
use crate::polygon::norm;

/// How far a border may lie from the line of touch, pitches: of the nodes beside it, those tell
/// little whose surfaces are less apart than noise.
pub(crate) const REACH: Reach = Reach {
    farthest: 4.0,
    least_bend: 0.05,
};

/// Where the surfaces touch they may be apart by so many deviations of the nodes of both, and
/// differ in slope by so much (3 degrees) along the line.
const APART: f64 = 1.0;
const TURN: f64 = 0.05;

/// The line along which two surfaces touch near these places, in pitches, and the places on it.
/// `sides` are the surfaces and the root mean squares of their residuals, millimetres. `None` where
/// they do not touch.
pub(crate) fn touch<'a>(
    sides: [(&'a PatchSurface, f64); 2],
    placement: Placement,
    places: impl ExactSizeIterator<Item = [f64; 2]>,
) -> Option<(Gap<'a>, Vec<[f64; 2]>)> {
    let gap = Gap {
        sides: sides.map(|side| side.0),
        placement,
        line: Line::Touch,
    };
    let apart_mm = APART * norm(sides.map(|side| side.1));
    let least = LEAST_SHARE * places.len() as f64;
    let found: Vec<[f64; 2]> = places
        .filter_map(|place| {
            let on = gap.nearest(place, REACH)?;
            let (height_mm, slope) = gap.height(on);
            (height_mm.abs() <= apart_mm && norm(slope) <= TURN).then_some(on)
        })
        .collect();
    (found.len() as f64 >= least && !found.is_empty()).then_some((gap, found))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{PLACEMENT, graph, plane};
    use super::*;

    /// A plane, and a trough of radius 4 about an axis along the line x = y / 4 that it touches in
    /// that line, but for so much.
    fn fillet(off_mm: f64) -> [PatchSurface; 2] {
        let across = |x: f64, y: f64| (x - 0.25 * y) / 1.0625_f64.sqrt();
        let trough = graph(0.5, |x, y| {
            let s = across(x, y).clamp(-3.0, 3.0);
            4.0 - (16.0 - s * s).sqrt() + 0.1 * y + off_mm
        });
        [trough, plane(0.0, 0.0, 0.1)]
    }

    fn touched(sides: &[PatchSurface; 2], rms_mm: f64, off: f64) -> Option<Vec<[f64; 2]>> {
        let sides = [(&sides[0], rms_mm), (&sides[1], rms_mm)];
        let places = (10..30).map(|row| {
            let y = 0.5 * f64::from(row) - 10.0;
            [20.0 + 0.5 * y + off, f64::from(row)]
        });
        touch(sides, PLACEMENT, places).map(|found| found.1)
    }

    #[test]
    fn a_fillet_is_touched_where_it_would_touch() {
        for (off_mm, off) in [(0.0, 0.0), (0.01, 1.2), (-0.01, -1.2), (0.0, 3.5)] {
            let found = touched(&fillet(off_mm), 0.02, off).expect("it touches");
            assert_eq!(found.len(), 20);
            for place in found {
                let [x, y] = PLACEMENT.to_mm(place);
                assert!((x - 0.25 * y).abs() < 0.02, "{x} {y}");
            }
        }
    }

    #[test]
    fn what_is_apart_or_meets_in_a_crease_does_not_touch() {
        assert_eq!(touched(&fillet(0.2), 0.02, 0.0), None);
        assert_eq!(touched(&fillet(0.0), 0.02, 5.0), None, "too far");
        let planes = [plane(0.0, 0.1, 0.0), plane(0.0, -0.1, 0.1)];
        assert_eq!(touched(&planes, 0.02, 0.0), None);
        let same = [plane(0.0, 0.1, 0.0), plane(0.0, 0.1, 0.0)];
        assert_eq!(touched(&same, 0.02, 0.0), None);
    }
}
