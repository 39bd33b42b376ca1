//! Which triangles meet at which edges.

use rayon::slice::ParallelSliceMut;

/// No neighbour.
pub(crate) const NONE: u32 = u32::MAX;

/// Every side of every triangle, sorted so that those over the same vertices stand beside each other.
#[derive(Debug, Clone)]
pub(crate) struct Edges {
    /// Lower vertex, higher vertex, side (three times the triangle plus which).
    sides: Vec<(u32, u32, u32)>,
}

/// A side of a triangle: where it begins and ends.
pub(crate) fn ends(triangles: &[[u32; 3]], side: u32) -> (u32, u32) {
    let corners = triangles[side as usize / 3];
    let k = side as usize % 3;
    (corners[k], corners[(k + 1) % 3])
}

impl Edges {
    pub(crate) fn of(triangles: &[[u32; 3]]) -> Self {
        let mut sides = Vec::with_capacity(3 * triangles.len());
        for side in 0..3 * triangles.len() as u32 {
            let (a, b) = ends(triangles, side);
            sides.push((a.min(b), a.max(b), side | u32::from(a > b) << 31));
        }
        sides.par_sort_unstable_by_key(|own| (own.0, own.1, own.2 & DIRECTION_OFF));
        Self { sides }
    }

    /// The sides over each edge: index of the side, and whether it runs from the higher vertex.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &[(u32, u32, u32)]> {
        self.sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
    }

    /// Edges that one triangle has, from where to where it runs along them.
    pub(crate) fn border(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.groups().filter_map(|group| match group {
            [own] => Some(if is_down(own) {
                (own.1, own.0)
            } else {
                (own.0, own.1)
            }),
            _ => None,
        })
    }

    /// The side of another triangle over the same edge for every side, [`NONE`] where there is none or
    /// more than one.
    pub(crate) fn opposite(&self) -> Vec<u32> {
        let mut opposite = vec![NONE; self.sides.len()];
        for group in self.groups() {
            if let [a, b] = group {
                opposite[side_of(a) as usize] = side_of(b);
                opposite[side_of(b) as usize] = side_of(a);
            }
        }
        opposite
    }
}

const DIRECTION_OFF: u32 = (1 << 31) - 1;

/// The side itself.
pub(crate) fn side_of(entry: &(u32, u32, u32)) -> u32 {
    entry.2 & DIRECTION_OFF
}

/// Whether the triangle runs from the higher vertex to the lower one.
pub(crate) fn is_down(entry: &(u32, u32, u32)) -> bool {
    entry.2 >> 31 == 1
}
