//! Points of borders in space: which of them faces share, and at what height.

use std::collections::BTreeMap;

use reconstruct::{EdgeKind, Model};

use crate::outline::{Outline, Spot, loops};
use crate::vector::Point3;

/// Points of all borders.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Sewn {
    /// Millimetres.
    pub(crate) points: Vec<Point3>,
    /// By face and place of its outline: index into `points`.
    pub(crate) numbers: Vec<Vec<u32>>,
    /// Farthest that a point lies off the surface of one of its faces, along z, millimetres.
    pub(crate) off_mm: f64,
}

/// A point as a face has it.
struct Has {
    face: usize,
    place: usize,
    z: f64,
}

/// `heights` are those of the outlines' places on the surfaces of their own faces.
pub(crate) fn sew(
    model: &Model,
    outlines: &[Outline],
    heights: &[Vec<f64>],
    sharing_mm: f64,
) -> Sewn {
    let mut at: BTreeMap<Spot, Vec<Has>> = BTreeMap::new();
    for (face, (outline, heights)) in outlines.iter().zip(heights).enumerate() {
        for (place, (spot, &z)) in outline.spots.iter().zip(heights).enumerate() {
            at.entry(*spot).or_default().push(Has { face, place, z });
        }
    }
    let creases = creases(model);
    // Creases by the vertices in which they end.
    let mut around: BTreeMap<usize, Vec<[usize; 2]>> = BTreeMap::new();
    for (&edge, &sides) in &creases {
        let edge = &model.edges[edge];
        around.entry(edge.start.0).or_default().push(sides);
        around.entry(edge.end.0).or_default().push(sides);
    }
    let mut sewn = Sewn {
        numbers: outlines.iter().map(|o| vec![0; o.places.len()]).collect(),
        ..Sewn::default()
    };
    for (spot, have) in &at {
        let seams: &[[usize; 2]] = match spot {
            Spot::Vertex(vertex) => around.get(vertex).map_or(&[], Vec::as_slice),
            Spot::Inner(edge, _) => creases.get(edge).map_or(&[], core::slice::from_ref),
        };
        for group in together(have, seams, sharing_mm) {
            let heights = group.iter().map(|&k| have[k].z);
            let low = heights.clone().fold(f64::INFINITY, f64::min);
            let high = heights.fold(f64::NEG_INFINITY, f64::max);
            // A point alone keeps its last digit.
            let z = if low == high { low } else { (low + high) / 2.0 };
            sewn.off_mm = sewn.off_mm.max(high - z);
            let number = sewn.points.len() as u32;
            for (n, &k) in group.iter().enumerate() {
                let Has { face, place, .. } = have[k];
                if n == 0 {
                    let [x, y] = outlines[face].places[place];
                    sewn.points.push([x, y, z]);
                }
                sewn.numbers[face][place] = number;
            }
        }
    }
    sewn
}

/// The two faces of each crease.
fn creases(model: &Model) -> BTreeMap<usize, [usize; 2]> {
    let mut sides: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (k, face) in model.faces.iter().enumerate() {
        for coedge in loops(face).flat_map(|border| &border.coedges) {
            let is_crease = |edge: &reconstruct::Edge| edge.kind == EdgeKind::Crease;
            if model.edges.get(coedge.edge.0).is_some_and(is_crease) {
                sides.entry(coedge.edge.0).or_default().push(k);
            }
        }
    }
    let pair = |(edge, faces): (usize, Vec<usize>)| match faces[..] {
        [a, b] if a != b => Some((edge, [a, b])),
        _ => None,
    };
    sides.into_iter().filter_map(pair).collect()
}

/// Which faces have one point: those whose heights are near across a seam, and what hangs together
/// by that. Indices into `have`, ascending by their least.
fn together(have: &[Has], seams: &[[usize; 2]], sharing_mm: f64) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..have.len()).collect();
    let find = |face: usize| have.iter().position(|has| has.face == face);
    for &[a, b] in seams {
        let (Some(a), Some(b)) = (find(a), find(b)) else {
            continue;
        };
        if (have[a].z - have[b].z).abs() <= sharing_mm {
            let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
            group
                .iter_mut()
                .filter(|g| **g == from)
                .for_each(|g| *g = to);
        }
    }
    let least = (0..have.len()).filter(|&k| group[k] == k);
    let members = |least: usize| (0..have.len()).filter(|&k| group[k] == least).collect();
    least.map(members).collect()
}
