//! Triangles between the points of a border: none of its sides is crossed, none is divided.

use std::collections::BTreeMap;

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

use crate::outline::{Outline, Side};

/// Why a border cannot be filled.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Trouble {
    /// These parts of edges are in each other's way: they are to be divided.
    Sides(Vec<(usize, usize)>),
    /// A coordinate is no number, or the border does not go around.
    Broken(&'static str),
}

type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Triangles that fill the outline, counter-clockwise, of indices into its places.
pub(crate) fn fill(outline: &Outline) -> Result<Vec<[u32; 3]>, Trouble> {
    let (mut plane, handles) = points(outline)?;
    let mut blocked = Vec::new();
    // By its two ends; an edge that the face has on both sides is there once.
    let mut laid: BTreeMap<[usize; 2], Side> = BTreeMap::new();
    for side in &outline.sides {
        let [a, b] = side.ends;
        let key = [a.min(b), a.max(b)];
        if a == b {
            blocked.push(side.of);
            continue;
        }
        if let Some(other) = laid.get(&key) {
            if other.of != side.of {
                blocked.extend([other.of, side.of]);
            }
            continue;
        }
        let (from, to) = (handles[a], handles[b]);
        let added = plane.try_add_constraint(from, to);
        if added.len() == 1 {
            laid.insert(key, *side);
            continue;
        }
        blocked.push(side.of);
        let ends = |v: FixedVertexHandle| v.index();
        let across: Vec<[usize; 2]> = plane
            .get_conflicting_edges_between_vertices(from, to)
            .map(|edge| [ends(edge.from().fix()), ends(edge.to().fix())])
            .collect();
        for [a, b] in across {
            blocked.extend(laid.get(&[a.min(b), a.max(b)]).map(|other| other.of));
        }
    }
    if blocked.is_empty() {
        inside(&plane, &handles, outline)
    } else {
        blocked.sort_unstable();
        blocked.dedup();
        Err(Trouble::Sides(blocked))
    }
}

/// The plane with the points of the outline, and their handles: of the same numbers.
fn points(outline: &Outline) -> Result<(Plane, Vec<FixedVertexHandle>), Trouble> {
    let mut plane = Plane::new();
    let mut handles: Vec<FixedVertexHandle> = Vec::with_capacity(outline.places.len());
    for (k, &[x, y]) in outline.places.iter().enumerate() {
        let point = mitigate_underflow(Point2::new(x, y));
        let added = match handles.last() {
            Some(&near) => plane.insert_with_hint(point, near),
            None => plane.insert(point),
        };
        let handle = added.map_err(|_| Trouble::Broken("a point of its border is no number"))?;
        if handle.index() != k {
            // Two points in one place: all sides that end there are too coarse, if that helps.
            let at = |side: &&Side| side.ends.contains(&k) || side.ends.contains(&handle.index());
            let sides = outline.sides.iter().filter(at).map(|side| side.of);
            return Err(Trouble::Sides(sides.collect()));
        }
        handles.push(handle);
    }
    Ok((plane, handles))
}

/// The triangles to the left of the sides, and those behind them.
fn inside(
    plane: &Plane,
    handles: &[FixedVertexHandle],
    outline: &Outline,
) -> Result<Vec<[u32; 3]>, Trouble> {
    const OPEN: Trouble = Trouble::Broken("its border does not go around it");
    let mut is_inside = vec![false; plane.num_all_faces()];
    let mut waiting = Vec::new();
    for side in &outline.sides {
        let [from, to] = side.ends.map(|k| handles[k]);
        let edge = plane.get_edge_from_neighbors(from, to).ok_or(OPEN)?;
        waiting.push(edge.face());
    }
    while let Some(face) = waiting.pop() {
        let triangle = face.as_inner().ok_or(OPEN)?;
        let seen = &mut is_inside[triangle.fix().index()];
        if *seen {
            continue;
        }
        *seen = true;
        for edge in triangle.adjacent_edges() {
            if !edge.is_constraint_edge() {
                waiting.push(edge.rev().face());
            }
        }
    }
    let triangles = plane
        .inner_faces()
        .filter(|face| is_inside[face.fix().index()])
        .map(|face| face.vertices().map(|v| v.fix().index() as u32));
    Ok(triangles.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::Spot;
    use crate::vector::turn;

    /// Loops of points, each a list of places.
    fn outline(loops: &[&[[f64; 2]]]) -> Outline {
        let mut outline = Outline::default();
        for (edge, places) in loops.iter().enumerate() {
            let first = outline.places.len();
            for (k, place) in places.iter().enumerate() {
                outline.spots.push(Spot::Inner(edge, k));
                outline.places.push(*place);
                let next = (k + 1) % places.len();
                outline.sides.push(Side {
                    ends: [first + k, first + next],
                    of: (edge, k),
                });
            }
        }
        outline
    }

    fn area(outline: &Outline, triangles: &[[u32; 3]]) -> f64 {
        let at = |k: u32| outline.places[k as usize];
        let areas = triangles.iter().map(|&[a, b, c]| {
            let twice = turn(at(a), at(b), at(c));
            assert!(twice > 0.0);
            twice / 2.0
        });
        areas.sum()
    }

    #[test]
    fn a_hole_and_a_bay_stay_empty() {
        let outer = [
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 10.0],
            [5.0, 4.0],
            [0.0, 10.0],
        ];
        let hole = [[4.0, 1.0], [4.0, 2.0], [6.0, 2.0], [6.0, 1.0]];
        let outline = outline(&[&outer, &hole]);
        let triangles = fill(&outline).unwrap();
        assert!((area(&outline, &triangles) - (100.0 - 30.0 - 2.0)).abs() < 1e-12);
        // Euler: points - 2 + 2 holes.
        assert_eq!(triangles.len(), 9 - 2 + 2);
    }

    #[test]
    fn sides_that_cross_are_told_both() {
        let outer = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        let hole = [[4.0, -1.0], [4.0, 2.0], [6.0, 2.0]];
        let Err(Trouble::Sides(sides)) = fill(&outline(&[&outer, &hole])) else {
            panic!("it was filled");
        };
        assert_eq!(sides, [(0, 0), (1, 0), (1, 2)]);
        // A corner of the hole on a side of the border.
        let touching = [[4.0, 0.0], [4.0, 2.0], [6.0, 2.0]];
        assert_eq!(
            fill(&outline(&[&outer, &touching])),
            Err(Trouble::Sides(vec![(0, 0)]))
        );
    }

    #[test]
    fn points_in_one_place_are_trouble() {
        let outer = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [10.0, 0.0]];
        let found = fill(&outline(&[&outer]));
        assert!(matches!(found, Err(Trouble::Sides(sides)) if !sides.is_empty()));
        let nan = [[0.0, 0.0], [f64::NAN, 0.0], [10.0, 10.0]];
        assert!(matches!(fill(&outline(&[&nan])), Err(Trouble::Broken(_))));
    }

    #[test]
    fn a_border_of_two_sides_is_trouble() {
        let found = fill(&outline(&[&[[0.0, 0.0], [10.0, 0.0]]]));
        assert_eq!(found, Err(Trouble::Sides(vec![(0, 0), (0, 1)])));
    }
}
