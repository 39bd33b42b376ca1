//! Creases that are cut loose from what keeps them from their line.
//!
//! Where a crease runs out, as that at the foot of a ring does where the ring begins to hide it, and
//! where more faces meet than have one corner, its vertex cannot be put on it. That is no reason to
//! leave all of it as it was drawn: it is cut a little before.

use nurbs::PatchSurface;

use super::Meeting;
use super::gap::Line;
use super::line::{STEP, line, sides};
use super::part::{cut, runs};
use crate::assemble::Placement;
use crate::border::map::{MapEdge, PlanarMap};

/// What is cut loose is no shorter than this, pitches.
const LEAST_LENGTH: f64 = 4.0;

/// What is cut off at a vertex is no shorter than this, pitches: where that is too little, the next
/// round cuts off as much again. And so far from where the surfaces cease to meet is the cut.
const TIP: f64 = 1.0;
const MARGIN: f64 = 0.5;

/// Stretches shorter than this, pitches, along which the line is lost are no reason to cut.
const LOST: f64 = 2.0;

/// Cuts creases that were left as drawn; says whether there were any. `surfaces[k]` belongs to piece
/// `k + 1`, with the root mean square of its residuals in millimetres.
pub(crate) fn loosen(
    map: &mut PlanarMap,
    surfaces: &[(&PatchSurface, f64)],
    is_crease: &[bool],
    meeting: &Meeting,
    placement: Placement,
) -> bool {
    let mut any = false;
    let asked = is_crease.iter().zip(&meeting.is_met).enumerate();
    for (index, (is_crease, is_met)) in asked {
        let edge = &map.edges[index];
        let Some(sides) = sides(edge, surfaces).filter(|_| *is_crease && !is_met) else {
            continue;
        };
        let ends = [edge.start, edge.end].map(|v| meeting.loose.contains(&(index, v)));
        let cuts = cuts(edge, sides, ends, placement);
        any |= !cuts.is_empty();
        cut(map, index, &cuts);
    }
    any
}

/// Parameters of a path between stretches along which its surfaces meet in one line, and others.
/// Without loose ends both may be.
fn cuts(
    edge: &MapEdge,
    sides: [(&PatchSurface, f64); 2],
    ends: [bool; 2],
    placement: Placement,
) -> Vec<f64> {
    let (first, last) = edge.path.domain();
    let count = ((last - first) / STEP).ceil().max(1.0) as usize;
    let at = |k: usize| first + (last - first) * (k as f64 + 0.5) / count as f64;
    let mut found: Vec<Option<Line>> = (0..count)
        .map(|k| {
            let place = edge.path.evaluate(at(k));
            line(sides, placement, [place].into_iter()).map(|gap| gap.line)
        })
        .collect();
    let steps = |pitches: f64| (pitches / STEP) as usize;
    let both = !ends.contains(&true);
    let tip = steps(TIP).min(count);
    if ends[0] || both {
        found[..tip].fill(None);
    }
    if ends[1] || both {
        found[count - tip..].fill(None);
    }
    fill(&mut found, steps(LOST));
    let mut cuts = Vec::new();
    for (from, to) in runs(&found) {
        if found[from].is_none() {
            continue;
        }
        let inner = |end: usize| end != 0 && end != count;
        let from = if inner(from) {
            from + steps(MARGIN)
        } else {
            from
        };
        let to = if inner(to) { to - steps(MARGIN) } else { to };
        if to < from + steps(LEAST_LENGTH) {
            continue;
        }
        let cut = |end: &usize| first + (last - first) * *end as f64 / count as f64;
        cuts.extend([from, to].iter().filter(|end| inner(**end)).map(cut));
    }
    cuts
}

/// Has short stretches without a line go by those on their two sides, where these agree.
fn fill(found: &mut [Option<Line>], most: usize) {
    for (from, to) in runs(found) {
        let is_between = from > 0 && to < found.len();
        if is_between && to - from < most && found[from - 1] == found[to] {
            let line = found[to];
            found[from..to].fill(line);
        }
    }
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::meeting::meet;
    use crate::meeting::testing::{PLACEMENT, crease_and_outline, graph, plane, running_out};

    /// The map with what is cut loose of the crease, and what is met of it.
    fn loosened(tilted: &PatchSurface) -> (PlanarMap, Vec<bool>) {
        let flat = plane(0.0, 0.0, 0.0);
        let sides = [(tilted, 0.01), (&flat, 0.01)];
        let mut map = crease_and_outline();
        let mut is_crease = vec![true, false];
        let mut rounds = 0..2;
        loop {
            let mut moved = map.clone();
            let found = meet(&mut moved, &sides, &is_crease, PLACEMENT, &Unmonitored).unwrap();
            let goes_on = rounds.next().is_some();
            if !goes_on || !loosen(&mut map, &sides, &is_crease, &found, PLACEMENT) {
                return (moved, found.is_met);
            }
            is_crease.resize(map.edges.len(), true);
        }
    }

    #[test]
    fn a_crease_is_cut_before_a_vertex_that_is_not_on_it() {
        let (map, is_met) = loosened(&running_out());
        let edges = map.edges.iter().zip(&is_met);
        let met_pitches: f64 = edges
            .clone()
            .filter(|(_, is_met)| **is_met)
            .map(|(edge, _)| {
                let places = edge.path.sampled(4);
                assert!(places.iter().all(|p| (p[1] - 20.0).abs() < 1e-3));
                edge.path.arc_length()
            })
            .sum();
        assert!((30.0..36.0).contains(&met_pitches), "{met_pitches}");
        let mut all = edges.map(|(edge, is_met)| (edge.end, *is_met));
        assert!(all.any(|tip| tip == (1, false)));
        // The end itself stays where it was drawn.
        assert_eq!(map.vertices[1], [40.0, 20.25]);
    }

    #[test]
    fn a_pitch_is_cut_off_at_a_vertex_that_is_not_on_its_crease() {
        let (flat, tilted) = (plane(0.0, 0.0, 0.0), plane(0.0, 0.0, 0.5));
        let edge = crease_and_outline().edges.swap_remove(0);
        let (first, last) = edge.path.domain();
        let found = |ends| cuts(&edge, [(&tilted, 0.01), (&flat, 0.01)], ends, PLACEMENT);
        let cut = 1.5;
        for (ends, expected) in [
            ([false, true], vec![last - cut]),
            ([true, false], vec![first + cut]),
            ([true, true], vec![first + cut, last - cut]),
        ] {
            let found = found(ends);
            assert_eq!(found.len(), expected.len(), "{found:?}");
            let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 0.26, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn a_crease_that_is_met_stays_whole() {
        let (map, is_met) = loosened(&plane(0.0, 0.0, 0.5));
        assert_eq!((map.edges.len(), is_met), (2, vec![true, false]));
    }

    #[test]
    fn what_meets_nowhere_or_for_a_moment_is_not_cut() {
        for width in [0.0, 0.7] {
            let near = |x: f64, y: f64| 0.5 * y + if x.abs() < width { 0.0 } else { 3.0 };
            let (map, is_met) = loosened(&graph(0.5, near));
            assert_eq!(
                (map.edges.len(), is_met),
                (2, vec![false, false]),
                "{width}"
            );
        }
    }

    /// Where a crease of 40 pitches is cut, with these ends loose.
    fn cut_at(tilted: &PatchSurface, ends: [bool; 2]) -> Vec<f64> {
        let flat = plane(0.0, 0.0, 0.0);
        let map = crease_and_outline();
        cuts(
            &map.edges[0],
            [(tilted, 0.01), (&flat, 0.01)],
            ends,
            PLACEMENT,
        )
    }

    #[test]
    fn tips_are_cut_off_at_loose_ends_and_at_both_if_none_is() {
        let tilted = plane(0.0, 0.0, 0.5);
        let (from, to) = (TIP + MARGIN, 40.0 - TIP - MARGIN);
        assert_eq!(cut_at(&tilted, [false, true]), [to]);
        assert_eq!(cut_at(&tilted, [true, false]), [from]);
        for both in [[true; 2], [false; 2]] {
            assert_eq!(cut_at(&tilted, both), [from, to]);
        }
    }

    #[test]
    fn where_the_line_is_lost_for_a_moment_nothing_is_cut() {
        // Lost within 0.3 mm of x = 0, which is column 20, and within 1.3 mm.
        let lost = |width: f64| {
            let notch = |x: f64, y: f64| 0.5 * y + if x.abs() < width { 3.0 } else { 0.0 };
            cut_at(&graph(0.1, notch), [false, true])
        };
        assert_eq!(lost(0.3), [40.0 - TIP - MARGIN]);
        assert_eq!(lost(1.3).len(), 3);
    }

    #[test]
    fn short_stretches_go_by_those_beside_them() {
        use Line::{Intersection as I, Touch as T};
        let filled = |found: &[Option<Line>]| {
            let mut found = found.to_vec();
            fill(&mut found, 3);
            found
        };
        let (i, t) = (Some(I), Some(T));
        assert_eq!(filled(&[i, None, t, i]), [i, None, t, i]);
        assert_eq!(filled(&[i, None, None, i]), [i; 4]);
        assert_eq!(filled(&[i, t, t, i]), [i; 4]);
        let long = [i, None, None, None, i];
        assert_eq!(filled(&long), long);
        let at_ends = [None, i, i, i, None];
        assert_eq!(filled(&at_ends), at_ends);
    }
}
