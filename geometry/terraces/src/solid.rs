//! A closed solid: faces on surfaces, sharing edges and vertices.

use std::collections::BTreeMap;

use nurbs::{BSplineCurve, BSplineSurface};

pub use crate::regions::Role;

/// One closed solid in space. Millimetres and radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Points where edges end.
    pub vertices: Vec<[f64; 3]>,
    /// Edges, each of two faces, or twice of one that is cut open along it.
    pub edges: Vec<SolidEdge>,
    /// Faces.
    pub faces: Vec<SolidFace>,
    /// Volume, cubic millimetres; exact but for free-form floors.
    pub volume_mm3: f64,
}

/// An edge from one vertex to another along a curve, in the curve's sense.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidEdge {
    /// The vertices at its ends; the same one of a closed curve.
    pub ends: [usize; 2],
    /// What it runs along.
    pub curve: SolidCurve,
}

/// What an edge runs along.
#[derive(Debug, Clone, PartialEq)]
pub enum SolidCurve {
    /// The straight line between its ends.
    Line,
    /// A circle, counter-clockwise around its axis.
    Circle {
        /// Its centre, axis, the direction from which angles count, and radius.
        place: Placement,
        /// Its radius.
        radius_mm: f64,
    },
    /// An ellipse, counter-clockwise around its axis; `x` is along the longer half axis.
    Ellipse {
        /// Its centre and axes.
        place: Placement,
        /// Longer and shorter half axis.
        half_axes_mm: [f64; 2],
    },
    /// A spline from end to end.
    Spline(BSplineCurve<3>),
}

/// A right-handed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Its origin.
    pub origin_mm: [f64; 3],
    /// Unit vector along its z.
    pub axis: [f64; 3],
    /// Unit vector along its x.
    pub x: [f64; 3],
}

/// What a face lies on. Normals are those of ISO 10303-42: along the axis of planes, away from
/// axes, centres and the middles of tubes otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum SolidSurface {
    /// A plane.
    Plane(Placement),
    /// A cylinder around the axis.
    Cylinder {
        /// Its axis.
        place: Placement,
        /// Its radius.
        radius_mm: f64,
    },
    /// A cone around the axis, wider along it.
    Cone {
        /// Its axis; the origin is where it has its radius.
        place: Placement,
        /// Its radius at the origin.
        radius_mm: f64,
        /// Between axis and surface.
        half_angle_rad: f64,
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        place: Placement,
        /// Its radius.
        radius_mm: f64,
    },
    /// A tube around a circle.
    Torus {
        /// Centre and axis of the circle.
        place: Placement,
        /// Radii of the circle and of the tube.
        radii_mm: [f64; 2],
    },
    /// A spline.
    Spline(BSplineSurface),
}

/// A face of the solid.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidFace {
    /// A name of its own: the operation's, and what of it the face is.
    pub name: String,
    /// 0 is the block, 1 the first operation.
    pub operation: usize,
    /// What of the operation it is.
    pub role: Role,
    /// What it lies on.
    pub surface: SolidSurface,
    /// The surface's normal leads out of the solid.
    pub is_outward: bool,
    /// Its loops, the outer one first: counter-clockwise as seen from outside of the solid.
    pub loops: Vec<Vec<EdgeUse>>,
}

/// An edge in a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeUse {
    /// Which edge.
    pub edge: usize,
    /// In its own sense.
    pub forward: bool,
}

/// Why faces do not make one closed solid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} at ({:.3}, {:.3}, {:.3})", at_mm[0], at_mm[1], at_mm[2])]
pub struct Unsound {
    /// What is wrong.
    pub what: &'static str,
    /// Where.
    pub at_mm: [f64; 3],
}

impl Solid {
    /// Least and greatest coordinates of all vertices and of points along the edges.
    #[must_use]
    pub fn bounding_box_mm(&self) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let along = (0..self.edges.len())
            .flat_map(|edge| (0..=16).map(move |k| self.edge_point(edge, f64::from(k) / 16.0)));
        for point in self.vertices.iter().copied().chain(along) {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(point[k]);
                bounds[1][k] = bounds[1][k].max(point[k]);
            }
        }
        bounds
    }

    /// The point of an edge at a part of it, 0 to 1.
    ///
    /// # Panics
    /// When there is no such edge.
    #[must_use]
    pub fn edge_point(&self, edge: usize, part: f64) -> [f64; 3] {
        let SolidEdge { ends, curve } = &self.edges[edge];
        let [from, to] = ends.map(|end| self.vertices[end]);
        let round = |place: &Placement, a: f64, b: f64| {
            let angle = |p: [f64; 3]| {
                let [x, y, _] = place.local(p);
                crate::plan::angle([x / a, y / b])
            };
            let first = angle(from);
            let turn = crate::plan::positive(angle(to) - first);
            let turn = if ends[0] == ends[1] {
                std::f64::consts::TAU
            } else {
                turn
            };
            let [x, y] = crate::plan::polar(first + part * turn);
            place.space([a * x, b * y, 0.0])
        };
        match curve {
            SolidCurve::Line => core::array::from_fn(|k| from[k] + part * (to[k] - from[k])),
            SolidCurve::Circle { place, radius_mm } => round(place, *radius_mm, *radius_mm),
            SolidCurve::Ellipse {
                place,
                half_axes_mm: [a, b],
            } => round(place, *a, *b),
            SolidCurve::Spline(spline) => {
                let (first, last) = spline.knots().domain();
                spline.evaluate(first + part * (last - first))
            }
        }
    }

    /// Checks that the solid is closed: every edge is used twice, once in each sense; loops run
    /// from vertex to vertex; the faces around each vertex are one fan; all hang together, and
    /// Euler's formula gives a whole number of handles.
    ///
    /// # Errors
    /// [`Unsound`] names the first thing that is not so.
    pub fn check(&self) -> Result<(), Unsound> {
        let fail = |what, at: usize| {
            Err(Unsound {
                what,
                at_mm: self.vertices.get(at).copied().unwrap_or([f64::NAN; 3]),
            })
        };
        let mut senses = vec![[0_usize; 2]; self.edges.len()];
        let mut parent: Vec<usize> = (0..self.faces.len()).collect();
        let mut first_face = vec![None; self.edges.len()];
        // Corners between an edge's end and the next edge's beginning, by vertex.
        let mut corners: BTreeMap<usize, Vec<[(usize, bool); 2]>> = BTreeMap::new();
        let mut loops = 0;
        for (index, face) in self.faces.iter().enumerate() {
            if face.loops.is_empty() {
                return fail("a face has no loop", 0);
            }
            for border in &face.loops {
                loops += 1;
                for (k, of) in border.iter().enumerate() {
                    let next = border[(k + 1) % border.len()];
                    senses[of.edge][usize::from(of.forward)] += 1;
                    let end = self.edges[of.edge].ends[usize::from(of.forward)];
                    let start = self.edges[next.edge].ends[usize::from(!next.forward)];
                    if end != start {
                        return fail("a loop is open", end);
                    }
                    // Which end of which edge, so that closed edges have two.
                    let corner = [(of.edge, of.forward), (next.edge, !next.forward)];
                    corners.entry(end).or_default().push(corner);
                    match first_face[of.edge] {
                        None => first_face[of.edge] = Some(index),
                        Some(other) => {
                            crate::union::join(&mut parent, index, other);
                        }
                    }
                }
            }
        }
        if let Some(edge) = senses.iter().position(|&senses| senses != [1, 1]) {
            return fail(
                "an edge is not used once in each sense",
                self.edges[edge].ends[0],
            );
        }
        for (&vertex, corners) in &corners {
            let mut at = corners[0][1];
            let mut count = 1;
            while at != corners[0][0] && count <= corners.len() {
                let Some(next) = corners.iter().find(|corner| corner[0] == at) else {
                    return fail("the faces around a vertex are open", vertex);
                };
                at = next[1];
                count += 1;
            }
            if count != corners.len() {
                return fail("two parts touch in a point", vertex);
            }
        }
        if (1..parent.len()).any(|face| crate::union::root(&mut parent, face) != 0) {
            return fail("there is more than one shell", 0);
        }
        // A loop within a face counts as if it were joined to the outer one by an edge.
        let inner = loops - self.faces.len();
        let (plus, minus) = (corners.len() + self.faces.len(), self.edges.len() + inner);
        if plus > minus + 2 || (plus + minus) % 2 != 0 {
            return fail("Euler's formula does not hold", 0);
        }
        Ok(())
    }
}

impl Placement {
    /// Unit vector along its y.
    #[must_use]
    pub fn y(&self) -> [f64; 3] {
        let ([a, b, c], [x, y, z]) = (self.axis, self.x);
        [b * z - c * y, c * x - a * z, a * y - b * x]
    }

    /// A point of space in the frame.
    #[must_use]
    pub fn local(&self, p: [f64; 3]) -> [f64; 3] {
        let from: [f64; 3] = core::array::from_fn(|k| p[k] - self.origin_mm[k]);
        let along = |d: [f64; 3]| d.iter().zip(from).map(|(d, f)| d * f).sum();
        [along(self.x), along(self.y()), along(self.axis)]
    }

    /// A point of the frame in space.
    #[must_use]
    pub fn space(&self, p: [f64; 3]) -> [f64; 3] {
        let y = self.y();
        core::array::from_fn(|k| {
            self.origin_mm[k] + p[0] * self.x[k] + p[1] * y[k] + p[2] * self.axis[k]
        })
    }
}
