//! Edges as chains of points.

use crate::{Body, BodyError, Edge, Point};

/// Most halvings of what lies between two breaks of a curve.
const HALVINGS: u32 = 16;
/// Places between two points of a chain at which the chord's distance from the curve is taken.
const PROBES: [f64; 3] = [0.25, 0.5, 0.75];
/// Where, between two points, directions are taken.
const WITHIN: [f64; 2] = [1e-3, 1.0 - 1e-3];
/// Cosine of the most that neighbouring chords turn (20 degrees).
const TURN_COSINE: f64 = 0.94;

/// A point of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    pub(crate) parameter: f64,
    /// Index among all points of the body.
    pub(crate) point: usize,
}

/// All edges of a body, divided.
#[derive(Debug, Clone)]
pub(crate) struct Division {
    /// The vertices first.
    pub(crate) points_mm: Vec<Point>,
    /// Of each edge, from its start to its end.
    pub(crate) chains: Vec<Vec<Link>>,
}

impl Division {
    /// Chains that lie within a tolerance of their curves.
    pub(crate) fn new(body: &Body, tolerance_mm: f64) -> Result<Self, BodyError> {
        let mut all = Self {
            points_mm: body.vertices_mm.clone(),
            chains: Vec::with_capacity(body.edges.len()),
        };
        for edge in &body.edges {
            let chain = all.chain(edge, tolerance_mm)?;
            all.chains.push(chain);
        }
        Ok(all)
    }

    fn vertex(&self, index: usize) -> Result<Point, BodyError> {
        let what = "vertex";
        let found = self.points_mm.get(index).copied();
        found.ok_or(BodyError::Missing { what, index })
    }

    fn chain(&mut self, edge: &Edge, tolerance_mm: f64) -> Result<Vec<Link>, BodyError> {
        let [start, end] = edge.vertices;
        let (from, to) = ends(edge, self.vertex(start)?, self.vertex(end)?);
        let breaks = edge.curve.breaks(from, to);
        let mut parameters = vec![from];
        for pair in breaks.windows(2) {
            halve(
                edge,
                [pair[0], pair[1]],
                tolerance_mm,
                HALVINGS,
                &mut parameters,
            );
        }
        let last = parameters.len() - 1;
        let mut chain = Vec::with_capacity(parameters.len());
        for (k, parameter) in parameters.into_iter().enumerate() {
            let point = match k {
                0 => start,
                k if k == last => end,
                _ => self.add(edge.curve.at(parameter).0),
            };
            chain.push(Link { parameter, point });
        }
        Ok(chain)
    }

    fn add(&mut self, point_mm: Point) -> usize {
        self.points_mm.push(point_mm);
        self.points_mm.len() - 1
    }

    /// Puts one more point into a chain, before that of index `before`.
    pub(crate) fn insert(&mut self, body: &Body, edge: usize, before: usize, parameter: f64) {
        let point = self.add(body.edges[edge].curve.at(parameter).0);
        self.chains[edge].insert(before, Link { parameter, point });
    }
}

/// Parameters where an edge begins and ends, in its direction.
fn ends(edge: &Edge, start: Point, end: Point) -> (f64, f64) {
    let (from, mut to) = (edge.curve.parameter(&start), edge.curve.parameter(&end));
    let sign = if edge.same_sense { 1.0 } else { -1.0 };
    let is_round = edge.vertices[0] == edge.vertices[1];
    if let Some(period) = edge.curve.period() {
        let ahead = sign * (to - from);
        if is_round {
            to = from + sign * period;
        } else if ahead <= 0.0 {
            to += sign * period;
        }
        return (from, to);
    }
    if is_round && let Some((first, last)) = edge.curve.domain() {
        return if edge.same_sense {
            (first, last)
        } else {
            (last, first)
        };
    }
    (from, to)
}

/// Adds parameters after the first up to the second one.
fn halve(
    edge: &Edge,
    [from, to]: [f64; 2],
    tolerance_mm: f64,
    left: u32,
    parameters: &mut Vec<f64>,
) {
    let at = |share: f64| edge.curve.at(from + (to - from) * share);
    let (a, b) = (at(0.0).0, at(1.0).0);
    let chord = b - a;
    let off = |share: &f64| {
        let p = at(*share).0 - a;
        match chord.norm_squared() {
            0.0 => p.norm(),
            squared => (p - chord * (p.dot(&chord) / squared)).norm(),
        }
    };
    let is_near = PROBES.iter().map(off).all(|off_mm| off_mm <= tolerance_mm);
    // At a corner itself the direction is that beyond it.
    let [along_a, along_b] = WITHIN.map(|share| at(share).1);
    let turns = along_a.dot(&along_b) < TURN_COSINE * along_a.norm() * along_b.norm();
    if left == 0 || (is_near && !turns) {
        parameters.push(to);
        return;
    }
    let middle = (from + to) / 2.0;
    halve(edge, [from, middle], tolerance_mm, left - 1, parameters);
    halve(edge, [middle, to], tolerance_mm, left - 1, parameters);
}
