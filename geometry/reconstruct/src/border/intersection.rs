//! Borders placed where the surfaces on their two sides intersect or touch.
//!
//! The nodes tell on which side of a crease they lie to half a pitch at best, and of a smooth join
//! less; the surfaces fitted to all nodes of either side tell where they meet far better.

use nurbs::PatchSurface;

use super::cracks::{Chain, CrackMap};
use crate::assemble::Placement;
use crate::meeting::{Gap, Line, Reach, touch};

/// Farthest a sample moves, pitches, and least difference of the slopes of two surfaces that
/// place their intersection. Where surfaces meet farther away, or not at all, the border is a
/// step.
pub(super) const CREASE: Reach = Reach {
    farthest: 1.5,
    least_bend: 0.15,
};

/// Share of a border's samples that must find the intersection.
const LEAST_SHARE: f64 = 0.8;

/// Samples on the lines, in pitches, for the chains that are creases or smooth joins between two
/// of the surfaces; `surfaces[k]` belongs to piece `k + 1`, with the root mean square of its
/// residuals in millimetres.
pub(crate) fn intersections(
    cracks: &CrackMap,
    surfaces: &[(&PatchSurface, f64)],
    placement: Placement,
) -> Vec<Option<Vec<[f64; 2]>>> {
    let surface = |piece: u32| surfaces.get((piece as usize).checked_sub(1)?).copied();
    cracks
        .chains
        .iter()
        .map(|chain| {
            let sides = [surface(chain.left)?, surface(chain.right)?];
            placed(chain, sides, placement)
        })
        .collect()
}

/// How far two surfaces are from each other.
pub(super) fn gap(sides: [&PatchSurface; 2], placement: Placement) -> Gap<'_> {
    Gap {
        sides,
        placement,
        line: Line::Intersection,
    }
}

fn placed(
    chain: &Chain,
    sides: [(&PatchSurface, f64); 2],
    placement: Placement,
) -> Option<Vec<[f64; 2]>> {
    let gap = gap(sides.map(|side| side.0), placement);
    let found: Vec<[f64; 2]> = chain
        .middles
        .iter()
        .filter_map(|&middle| gap.nearest(middle, CREASE))
        .collect();
    let enough = found.len() as f64 >= LEAST_SHARE * chain.middles.len() as f64;
    if enough && found.len() >= 2 {
        return Some(found);
    }
    let (_, found) = touch(sides, placement, chain.middles.iter().copied())?;
    (found.len() >= 2).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meeting::testing::{PLACEMENT, plane};

    fn chain(middles: Vec<[f64; 2]>) -> CrackMap {
        CrackMap {
            chains: vec![Chain {
                left: 1,
                right: 2,
                middles,
                ends: None,
            }],
            ..CrackMap::default()
        }
    }

    #[test]
    fn a_staircase_goes_to_the_line_where_planes_meet() {
        // They meet on y = x / 4 + 1, that is row = column / 4 + 17.
        let surfaces = [plane(1.0, 0.25, 0.0), plane(0.0, 0.0, 1.0)];
        let surfaces = [(&surfaces[0], 0.0), (&surfaces[1], 0.0)];
        let row = |column: f64| column / 4.0 + 17.0;
        let middles: Vec<_> = (0..40)
            .map(|k| [f64::from(k), row(f64::from(k)).floor() + 0.5])
            .collect();
        let found = intersections(&chain(middles), &surfaces, PLACEMENT);
        let found = found[0].as_ref().unwrap();
        assert_eq!(found.len(), 40);
        for p in found {
            assert!((p[1] - row(p[0])).abs() < 1e-9, "{p:?}");
        }
    }

    #[test]
    fn steps_and_planes_that_hardly_part_stay_where_the_nodes_put_them() {
        let middles: Vec<_> = (0..40).map(|k| [f64::from(k), 20.5]).collect();
        let found = |surfaces: [PatchSurface; 2]| {
            let surfaces = [(&surfaces[0], 0.02), (&surfaces[1], 0.02)];
            intersections(&chain(middles.clone()), &surfaces, PLACEMENT)
        };
        let step = [plane(5.0, 0.0, 0.3), plane(0.0, 0.0, 0.0)];
        assert_eq!(found(step), [None]);
        let hardly = [plane(0.0, 0.0, 0.1), plane(0.0, 0.0, 0.0)];
        assert_eq!(found(hardly), [None]);
    }
}
