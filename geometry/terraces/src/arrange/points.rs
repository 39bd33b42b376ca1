//! Where curves meet, and the edges between.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::{Arrangement, Curve, Drawing, Edge, POINT_MM};
use crate::plan::{Meeting, P2, Support, distance, positive};

/// Vertices by the squares of a grid, so that near ones are found.
#[derive(Default)]
struct Vertices {
    points: Vec<P2>,
    squares: BTreeMap<[i64; 2], Vec<usize>>,
}

const SQUARE_MM: f64 = 1e-3;

impl Vertices {
    fn near(&self, at: P2, within_mm: f64) -> Option<usize> {
        let [x, y] = at.map(|c| (c / SQUARE_MM).floor() as i64);
        let reach = (within_mm / SQUARE_MM).ceil() as i64;
        let mut nearest: Option<(f64, usize)> = None;
        for i in x - reach..=x + reach {
            for j in y - reach..=y + reach {
                for &index in self.squares.get(&[i, j]).into_iter().flatten() {
                    let off = distance(self.points[index], at);
                    if off < within_mm && nearest.is_none_or(|(best, _)| off < best) {
                        nearest = Some((off, index));
                    }
                }
            }
        }
        nearest.map(|(_, index)| index)
    }

    fn insert(&mut self, at: P2) -> usize {
        self.near(at, POINT_MM).unwrap_or_else(|| {
            let square = at.map(|c| (c / SQUARE_MM).floor() as i64);
            self.points.push(at);
            let index = self.points.len() - 1;
            self.squares.entry(square).or_default().push(index);
            index
        })
    }
}

/// The point lies on the curve, ends included.
fn is_on(curve: &Curve, support: &Support, at: P2) -> bool {
    if curve.ends.iter().any(|&end| distance(end, at) < POINT_MM) {
        return true;
    }
    let t = support.parameter(at);
    match support {
        Support::Line { .. } => t > curve.from && t < curve.to,
        Support::Circle { .. } => positive(t - curve.from) < curve.to - curve.from,
    }
}

/// All vertices and edges; cells are yet to be found.
pub(super) fn edges(drawing: &Drawing) -> Arrangement {
    let supports = &drawing.supports;
    let mut by_support: Vec<Vec<&Curve>> = vec![Vec::new(); supports.len()];
    for curve in &drawing.curves {
        by_support[curve.support].push(curve);
    }
    let mut vertices = Vertices::default();
    let mut on: Vec<Vec<usize>> = vec![Vec::new(); supports.len()];
    for curve in &drawing.curves {
        for &end in &curve.ends {
            let vertex = vertices.insert(end);
            on[curve.support].push(vertex);
        }
    }
    let is_drawn = |support: usize, at: P2| {
        let curves = &by_support[support];
        curves
            .iter()
            .any(|curve| is_on(curve, &supports[support], at))
    };
    // Ends that lie on other curves: found by their distance, which touching curves need.
    let ends = vertices.points.clone();
    for (vertex, &at) in ends.iter().enumerate() {
        for support in 0..supports.len() {
            if supports[support].distance(at) < POINT_MM && is_drawn(support, at) {
                on[support].push(vertex);
            }
        }
    }
    for a in 0..supports.len() {
        for b in a + 1..supports.len() {
            let meets = match supports[a].meet(&supports[b]) {
                Meeting::Apart => continue,
                Meeting::Points(points) => points,
                // An end near where they touch is where they part.
                Meeting::Touch { at, reach } => {
                    let shared = |vertex: &&usize| on[b].contains(*vertex);
                    let near = |vertex: &&usize| distance(vertices.points[**vertex], at) < reach;
                    if on[a].iter().filter(shared).any(|v| near(&v)) {
                        continue;
                    }
                    vec![at]
                }
            };
            for at in meets {
                if is_drawn(a, at) && is_drawn(b, at) {
                    let vertex = vertices.insert(at);
                    on[a].push(vertex);
                    on[b].push(vertex);
                }
            }
        }
    }
    for &(support, t) in &drawing.cuts {
        let at = supports[support].at(t);
        if is_drawn(support, at) {
            let vertex = vertices.insert(at);
            on[support].push(vertex);
        }
    }
    let mut plan = Arrangement {
        supports: supports.clone(),
        vertices: vertices.points,
        ..Arrangement::default()
    };
    for (support, points) in on.into_iter().enumerate() {
        along(&mut plan, support, points, &by_support[support]);
    }
    plan
}

/// The edges of one support.
fn along(plan: &mut Arrangement, support: usize, mut points: Vec<usize>, curves: &[&Curve]) {
    let on = plan.supports[support];
    points.sort_unstable();
    points.dedup();
    let mut stops: Vec<(f64, usize)> = points
        .into_iter()
        .map(|vertex| (on.parameter(plan.vertices[vertex]), vertex))
        .collect();
    stops.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let (Support::Circle { .. }, Some(&(t, vertex))) = (on, stops.first()) {
        stops.push((t + TAU, vertex));
    }
    for pair in stops.windows(2) {
        let ((from, start), (to, end)) = (pair[0], pair[1]);
        let middle = on.at(0.5 * (from + to));
        let over: Vec<&&Curve> = curves
            .iter()
            .filter(|curve| is_on(curve, &on, middle))
            .collect();
        if over.is_empty() {
            continue;
        }
        let mut owners: Vec<usize> = Vec::new();
        for owner in over.iter().filter_map(|curve| curve.owner) {
            // Run twice by one loop is not at all.
            match owners.iter().position(|&other| other == owner) {
                Some(at) => {
                    owners.swap_remove(at);
                }
                None => owners.push(owner),
            }
        }
        owners.sort_unstable();
        plan.edges.push(Edge {
            support,
            from,
            to,
            ends: [start, end],
            owners,
            is_seam: over.iter().any(|curve| curve.is_seam),
            cells: [0; 2],
        });
    }
}
