//! The border of a face as a polygon in the x-y plane.

use std::collections::BTreeMap;

use reconstruct::{Face, Loop, Model};

use crate::divide::Division;
use crate::vector::Point2;

/// What a point of a border is, the same for all faces that have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Spot {
    /// A vertex of the model.
    Vertex(usize),
    /// A point inside of an edge: the edge, and its number along that.
    Inner(usize, usize),
}

/// A straight side of a border; the face lies to its left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Side {
    /// Indices into [`Outline::places`].
    pub(crate) ends: [usize; 2],
    /// The edge that it is a part of, and which part in the edge's own sense.
    pub(crate) of: (usize, usize),
}

/// All loops of a face.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Outline {
    pub(crate) spots: Vec<Spot>,
    pub(crate) places: Vec<Point2>,
    pub(crate) sides: Vec<Side>,
}

pub(crate) fn loops(face: &Face) -> impl Iterator<Item = &Loop> {
    core::iter::once(&face.outer).chain(&face.inner)
}

/// A point of a closed border, and the side that begins there: edge and part.
type Link = ((Spot, Point2), (usize, usize));

impl Outline {
    /// `divisions` are those of the model's edges; `Err` with what the model lacks.
    pub(crate) fn of(
        model: &Model,
        face: &Face,
        divisions: &[Division],
    ) -> Result<Self, &'static str> {
        let mut outline = Self::default();
        let mut numbers = BTreeMap::new();
        for border in loops(face) {
            if border.coedges.is_empty() {
                return Err("a loop of its border has no edges");
            }
            let mut chain = Vec::new();
            for coedge in &border.coedges {
                let index = coedge.edge.0;
                let (edge, division) = model
                    .edges
                    .get(index)
                    .zip(divisions.get(index))
                    .ok_or("its border names an edge that the model lacks")?;
                let vertex = |id: reconstruct::VertexId| {
                    let vertex = model.vertices.get(id.0);
                    let vertex = vertex.ok_or("an edge ends in a vertex that the model lacks")?;
                    Ok::<_, &'static str>((Spot::Vertex(id.0), [vertex.x_mm, vertex.y_mm]))
                };
                let sides = division.sides();
                let mut stretch = vec![vertex(edge.start)?];
                let inner = division.inner(&edge.path).into_iter().enumerate();
                stretch.extend(inner.map(|(k, p)| (Spot::Inner(index, k), p)));
                stretch.push(vertex(edge.end)?);
                let mut parts: Vec<usize> = (0..sides).collect();
                if coedge.reversed {
                    stretch.reverse();
                    parts.reverse();
                }
                // The next edge begins where this one ends.
                stretch.pop();
                chain.extend(
                    stretch
                        .into_iter()
                        .zip(parts.iter().map(|&part| (index, part))),
                );
            }
            outline.close(&chain, &mut numbers);
        }
        Ok(outline)
    }

    fn close(&mut self, chain: &[Link], numbers: &mut BTreeMap<Spot, usize>) {
        let mut number = |(spot, place): (Spot, Point2)| {
            *numbers.entry(spot).or_insert_with(|| {
                self.spots.push(spot);
                self.places.push(place);
                self.places.len() - 1
            })
        };
        let ids: Vec<usize> = chain.iter().map(|(point, _)| number(*point)).collect();
        for (k, (_, of)) in chain.iter().enumerate() {
            let ends = [ids[k], ids[(k + 1) % ids.len()]];
            self.sides.push(Side { ends, of: *of });
        }
    }
}
