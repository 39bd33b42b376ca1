//! The surface to be milled: triangles, found by where they lie as seen from above.

use crate::cutter::Cutter;
use crate::error::ToolpathError;
use crate::facet::{Contact, Facet, height};

/// Triangles below which a branch of the tree is not divided further.
const LEAF: usize = 3;
/// Branches that wait to be looked at: the tree halves what is below, so that it is no deeper.
const WAITING: usize = 64;

/// A surface of triangles. Millimetres, z upwards.
#[derive(Debug, Clone)]
pub struct Surface {
    facets: Vec<Facet>,
    branches: Vec<Branch>,
    bounds_mm: [[f64; 3]; 2],
}

/// A rectangle, the highest point in it, and what it holds.
#[derive(Debug, Clone)]
struct Branch {
    low: [f64; 2],
    high: [f64; 2],
    top: f64,
    /// Of a leaf its first facet and how many there are; else the second branch, the first being
    /// the next one, and 0.
    at: u32,
    count: u32,
}

impl Surface {
    /// A surface of triangles by the indices of their corners. Which way they turn does not
    /// matter; those without an area are left out.
    ///
    /// # Errors
    /// [`ToolpathError::Empty`], [`ToolpathError::NotFinite`], [`ToolpathError::Missing`]
    pub fn new(vertices_mm: &[[f64; 3]], triangles: &[[usize; 3]]) -> Result<Self, ToolpathError> {
        let is_sound = |vertex: &[f64; 3]| vertex.iter().all(|c| c.is_finite());
        if let Some(vertex) = vertices_mm.iter().position(|vertex| !is_sound(vertex)) {
            return Err(ToolpathError::NotFinite { vertex });
        }
        let mut facets = Vec::with_capacity(triangles.len());
        let mut indices = Vec::with_capacity(triangles.len());
        for (number, triangle) in triangles.iter().enumerate() {
            let mut corners = [[0.0; 3]; 3];
            for (corner, &vertex) in corners.iter_mut().zip(triangle) {
                *corner = *vertices_mm.get(vertex).ok_or(ToolpathError::Missing {
                    triangle: number,
                    vertex,
                    vertices: vertices_mm.len(),
                })?;
            }
            let mut turned = false;
            if let Some(facet) = Facet::new(corners, &mut turned) {
                let [a, b, c] = *triangle;
                indices.push(if turned { [a, c, b] } else { [a, b, c] });
                facets.push(facet);
            }
        }
        if facets.is_empty() {
            return Err(ToolpathError::Empty);
        }
        share_out(&mut facets, &indices, vertices_mm.len());
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for corner in facets.iter().flat_map(Facet::corners) {
            for axis in 0..3 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        let mut order: Vec<(u32, [f64; 2])> = (0..).zip(facets.iter().map(middle)).collect();
        let mut branches = Vec::with_capacity(2 * facets.len() / LEAF + 1);
        grow(&facets, &mut order, 0, &mut branches);
        let mut slots: Vec<Option<Facet>> = facets.into_iter().map(Some).collect();
        let facets = order
            .iter()
            .filter_map(|(index, _)| slots.get_mut(*index as usize)?.take())
            .collect();
        Ok(Self {
            facets,
            branches,
            bounds_mm: [low, high],
        })
    }

    /// Least and greatest coordinates, millimetres.
    #[must_use]
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        self.bounds_mm
    }

    /// How many triangles it has.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.facets.len()
    }

    /// Height of the highest point of the surface above a place; `None` where there is none.
    #[must_use]
    pub fn height_mm(&self, at_mm: [f64; 2]) -> Option<f64> {
        self.drop_cutter(&Cutter::POINT, at_mm).map(|c| c.z_mm)
    }

    /// Lowers a cutter at a place until it touches the surface: exact contact with faces, edges and
    /// corners. `None` where nothing is below it.
    #[must_use]
    pub fn drop_cutter(&self, cutter: &Cutter, at_mm: [f64; 2]) -> Option<Contact> {
        self.drop_below(cutter, at_mm, f64::INFINITY)
    }

    /// The same; `None` also where the tip would stand as high as `limit_mm`, which is often told long
    /// before it is known how high that is.
    pub(crate) fn drop_below(
        &self,
        cutter: &Cutter,
        at_mm: [f64; 2],
        limit_mm: f64,
    ) -> Option<Contact> {
        let mut best = Contact {
            z_mm: f64::NEG_INFINITY,
            on_edge: false,
        };
        let mut waiting = [(0_u32, 0.0_f64); WAITING];
        let mut count = 0;
        if let Some(bound) = self.branches.first().and_then(|b| b.bound(cutter, at_mm)) {
            waiting[0] = (0, bound);
            count = 1;
        }
        while count > 0 {
            count -= 1;
            let (index, bound) = waiting[count];
            if bound <= best.z_mm {
                continue;
            }
            let branch = &self.branches[index as usize];
            if branch.count > 0 {
                let from = branch.at as usize;
                for facet in &self.facets[from..from + branch.count as usize] {
                    if facet.top_mm > best.z_mm {
                        facet.raise(cutter, at_mm, &mut best);
                    }
                }
                if best.z_mm >= limit_mm {
                    return None;
                }
                continue;
            }
            let of = |index: u32| {
                let bound = self.branches[index as usize].bound(cutter, at_mm);
                bound.filter(|b| *b > best.z_mm).map(|b| (index, b))
            };
            let (first, second) = (of(index + 1), of(branch.at));
            // The higher one is looked at first: it may spare us the other.
            let swap = matches!((first, second), (Some(a), Some(b)) if a.1 > b.1);
            let pair = if swap {
                [second, first]
            } else {
                [first, second]
            };
            for next in pair.into_iter().flatten() {
                if count < WAITING {
                    waiting[count] = next;
                    count += 1;
                }
            }
        }
        (best.z_mm > f64::NEG_INFINITY).then_some(best)
    }
}

impl Branch {
    /// A height that no tip over this rectangle exceeds; `None` out of the cutter's reach.
    #[inline]
    fn bound(&self, cutter: &Cutter, at: [f64; 2]) -> Option<f64> {
        let dx = (self.low[0] - at[0]).max(at[0] - self.high[0]).max(0.0);
        let dy = (self.low[1] - at[1]).max(at[1] - self.high[1]).max(0.0);
        let square = dx * dx + dy * dy;
        let radius = cutter.radius_mm();
        (square <= radius * radius).then(|| self.top - height(cutter, square))
    }
}

/// Gives every corner and every edge that a cutter can touch to one of its triangles.
fn share_out(facets: &mut [Facet], indices: &[[usize; 3]], vertices: usize) {
    let mut sides: Vec<([usize; 2], usize, usize)> = Vec::with_capacity(3 * facets.len());
    for (facet, triangle) in indices.iter().enumerate() {
        for side in 0..3 {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], facet, side));
        }
    }
    sides.sort_unstable();
    let mut is_sharp = vec![false; vertices];
    for shared in sides.chunk_by(|p, q| p.0 == q.0) {
        let (ends, facet, side) = shared[0];
        let sharp = match *shared {
            [(_, a, i), (_, b, j)] => {
                if Facet::is_valley((&facets[a], i), (&facets[b], j)) {
                    continue;
                }
                Facet::is_sharp(&facets[a], &facets[b])
            }
            // The outline, or more than two sheets.
            _ => true,
        };
        facets[facet].own_edge(side, sharp);
        for end in ends {
            is_sharp[end] |= sharp;
        }
    }
    let mut is_owned = vec![false; vertices];
    for (facet, triangle) in indices.iter().enumerate() {
        for (corner, &vertex) in triangle.iter().enumerate() {
            if !is_owned[vertex] {
                is_owned[vertex] = true;
                facets[facet].own_corner(corner, is_sharp[vertex]);
            }
        }
    }
}

fn middle(facet: &Facet) -> [f64; 2] {
    let [a, b, c] = facet.corners();
    [a[0] + b[0] + c[0], a[1] + b[1] + c[1]]
}

/// Divides facets at the median of their middles until few are left in each leaf.
fn grow(facets: &[Facet], order: &mut [(u32, [f64; 2])], first: u32, branches: &mut Vec<Branch>) {
    let mut branch = Branch {
        low: [f64::INFINITY; 2],
        high: [f64::NEG_INFINITY; 2],
        top: f64::NEG_INFINITY,
        at: first,
        count: order.len() as u32,
    };
    let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (index, middle) in order.iter() {
        let facet = &facets[*index as usize];
        branch.top = branch.top.max(facet.top_mm);
        for axis in 0..2 {
            for corner in facet.corners() {
                branch.low[axis] = branch.low[axis].min(corner[axis]);
                branch.high[axis] = branch.high[axis].max(corner[axis]);
            }
            least[axis] = least[axis].min(middle[axis]);
            most[axis] = most[axis].max(middle[axis]);
        }
    }
    let place = branches.len();
    branches.push(branch);
    if order.len() <= LEAF {
        return;
    }
    let axis = usize::from(most[1] - least[1] > most[0] - least[0]);
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |p, q| {
        p.1[axis].total_cmp(&q.1[axis]).then(p.0.cmp(&q.0))
    });
    let (low, high) = order.split_at_mut(half);
    grow(facets, low, first, branches);
    let second = branches.len() as u32;
    if let Some(branch) = branches.get_mut(place) {
        branch.at = second;
        branch.count = 0;
    }
    grow(facets, high, first + half as u32, branches);
}
