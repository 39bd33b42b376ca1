//! A triangle made ready for cutters, and what of it each kind of contact asks for.

use crate::cutter::{Cutter, Kind};
use crate::edge::Edge;

/// Slopes across an edge that differ by more than this make a valley: rounding is far below.
const VALLEY: f64 = 1e-9;

/// Cosine of the angle by which the surface turns at a sharp edge: 30 degrees.
const SHARP: f64 = 0.866_025;
/// A plane whose unit normal has less than this of z is as good as vertical: cutters touch its edges
/// within nanometres of where they touch it, and slopes have lost too many digits.
const STEEPEST: f64 = 1e-7;

/// A triangle of the surface. Millimetres.
#[derive(Debug, Clone)]
pub(crate) struct Facet {
    /// Corners, counter-clockwise from above.
    corners: [[f64; 3]; 3],
    /// The plane's slopes along x and y, and z of its unit normal; `None` where it is vertical.
    plane: Option<([f64; 2], f64)>,
    /// Highest corner.
    pub(crate) top_mm: f64,
    /// Corners that no other triangle looks after, and whether a sharp edge ends there.
    owned: [Option<bool>; 3],
    /// Edges that no other triangle looks after, and that a cutter can touch; whether they are sharp.
    edges: [Option<(Edge, bool)>; 3],
}

/// Where a cutter stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Height of the tip, millimetres.
    pub z_mm: f64,
    /// The cutter touches the surface's outline or an edge at which it turns by more than 30
    /// degrees, not a face or an edge within one.
    pub on_edge: bool,
}

impl Facet {
    /// A triangle that looks after nothing but its inside; `None` where it has no area.
    pub(crate) fn new(mut corners: [[f64; 3]; 3], turned: &mut bool) -> Option<Self> {
        let [a, b, c] = corners;
        let normal = normal(&corners);
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        if length == 0.0 {
            return None;
        }
        *turned = normal[2] < 0.0;
        if *turned {
            corners.swap(1, 2);
        }
        let is_level = normal[2].abs() > STEEPEST * length;
        let plane = is_level.then(|| {
            let slopes = [-normal[0] / normal[2], -normal[1] / normal[2]];
            (slopes, normal[2].abs() / length)
        });
        Some(Self {
            plane,
            top_mm: a[2].max(b[2]).max(c[2]),
            corners,
            owned: [None; 3],
            edges: [const { None }; 3],
        })
    }

    pub(crate) fn corners(&self) -> &[[f64; 3]; 3] {
        &self.corners
    }

    /// Looks after a corner from now on.
    pub(crate) fn own_corner(&mut self, corner: usize, is_sharp: bool) {
        self.owned[corner] = Some(is_sharp);
    }

    /// Looks after the edge from a corner to the next.
    pub(crate) fn own_edge(&mut self, side: usize, is_sharp: bool) {
        let edge = Edge::new(self.corners[side], self.corners[(side + 1) % 3]);
        self.edges[side] = edge.map(|edge| (edge, is_sharp));
    }

    /// Whether the surface turns sharply between two triangles.
    pub(crate) fn is_sharp(a: &Self, b: &Self) -> bool {
        let (p, q) = (normal(&a.corners), normal(&b.corners));
        let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        dot(p, q) < SHARP * (dot(p, p) * dot(q, q)).sqrt()
    }

    /// How steeply it rises away from a side, to its inside; `None` where it is vertical.
    fn rise_from(&self, side: usize) -> Option<f64> {
        let ([gx, gy], _) = self.plane?;
        let (a, b) = (self.corners[side], self.corners[(side + 1) % 3]);
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let length = (dx * dx + dy * dy).sqrt();
        (length > 0.0).then(|| (gy * dx - gx * dy) / length)
    }

    /// Whether two triangles rise away from their common edge on its two sides: no cutter touches
    /// the bottom of a valley that does not touch its sides.
    ///
    /// Both lie on different sides as seen from above where they name the edge's ends in opposite
    /// order. At the highest tip neither side may go on rising above the cutter, whose own slope
    /// across the edge is one number with two signs; so their rises cannot add up to more than
    /// zero.
    pub(crate) fn is_valley(a: (&Self, usize), b: (&Self, usize)) -> bool {
        let apart = a.0.corners[a.1] == b.0.corners[(b.1 + 1) % 3]
            && a.0.corners[(a.1 + 1) % 3] == b.0.corners[b.1];
        let rises = a.0.rise_from(a.1).zip(b.0.rise_from(b.1));
        apart && rises.is_some_and(|(p, q)| p + q > VALLEY)
    }

    /// Raises `best` to where the cutter at `at` touches this triangle.
    pub(crate) fn raise(&self, cutter: &Cutter, at: [f64; 2], best: &mut Contact) {
        if self.raise_inside(cutter, at, best) {
            return;
        }
        let radius = cutter.radius_mm();
        for corner in 0..3 {
            if let Some((edge, on_edge)) = &self.edges[corner]
                && let Some(z_mm) = edge.tip_mm(cutter, at, best.z_mm)
                && z_mm > best.z_mm
            {
                *best = Contact {
                    z_mm,
                    on_edge: *on_edge,
                };
            }
            let Some(on_edge) = self.owned[corner] else {
                continue;
            };
            let [x, y, z] = self.corners[corner];
            if z <= best.z_mm {
                continue;
            }
            let (dx, dy) = (x - at[0], y - at[1]);
            let square = dx * dx + dy * dy;
            if square <= radius * radius {
                let z_mm = z - height(cutter, square);
                if z_mm > best.z_mm {
                    *best = Contact { z_mm, on_edge };
                }
            }
        }
    }

    /// The contact with the plane, where that lies within the triangle: nothing of it is higher
    /// then, as the cutter is convex.
    fn raise_inside(&self, cutter: &Cutter, at: [f64; 2], best: &mut Contact) -> bool {
        let Some(([gx, gy], nz)) = self.plane else {
            return false;
        };
        let r = cutter.corner_mm();
        let mut out = r * nz;
        let disc = cutter.disc_mm();
        if disc > 0.0 {
            let slope = (gx * gx + gy * gy).sqrt();
            if slope > 0.0 {
                out += disc / slope;
            }
        }
        let (x, y) = (at[0] + gx * out, at[1] + gy * out);
        let [a, b, c] = &self.corners;
        let left = |p: &[f64; 3], q: &[f64; 3]| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0.0
        };
        if !(left(a, b) && left(b, c) && left(c, a)) {
            return false;
        }
        let plane_mm = a[2] + gx * (x - a[0]) + gy * (y - a[1]);
        let z_mm = plane_mm.min(self.top_mm) - r + r * nz;
        if z_mm > best.z_mm {
            *best = Contact {
                z_mm,
                on_edge: false,
            };
        }
        true
    }
}

/// How far above the tip the cutter is, by the square of the distance from its axis.
#[inline]
pub(crate) fn height(cutter: &Cutter, square: f64) -> f64 {
    let r = cutter.corner_mm();
    match cutter.kind() {
        Kind::Flat => 0.0,
        Kind::Ball => r - (r * r - square).max(0.0).sqrt(),
        Kind::Bull => cutter.profile(square.sqrt()),
    }
}

/// The cross product of two sides.
fn normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    let (p, q) = (minus(*b, *a), minus(*c, *a));
    [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
