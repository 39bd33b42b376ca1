//! The cells between the edges, and which loops they are within.

use std::collections::VecDeque;

use super::{Arrangement, Cell, Half, Torn};
use crate::plan::{Piece, Support, angle, area, distance, encloses, norm, scale, sub};

/// Finds the cells.
pub(super) fn fill(plan: &mut Arrangement, loops: usize) -> Result<(), Torn> {
    rotate(plan);
    let cycles = cycles(plan);
    let components = components(plan);
    let pieces: Vec<Vec<Piece>> = cycles
        .iter()
        .map(|cycle| cycle.iter().map(|&half| plan.half_piece(half)).collect())
        .collect();
    let areas: Vec<f64> = pieces.iter().map(|pieces| area(pieces)).collect();
    plan.cells = vec![Cell::default()];
    let mut cell_of = vec![0; cycles.len()];
    for (k, cycle) in cycles.iter().enumerate() {
        if areas[k] > 1e-12 {
            cell_of[k] = plan.cells.len();
            plan.cells.push(Cell {
                loops: vec![cycle.clone()],
                within: Vec::new(),
            });
        }
    }
    for (k, cycle) in cycles.iter().enumerate() {
        if areas[k] > 1e-12 {
            continue;
        }
        let vertex = plan.edges[cycle[0].edge].ends[0];
        let (at, component) = (plan.vertices[vertex], components[vertex]);
        let around = (0..cycles.len()).filter(|&j| {
            let other = plan.edges[cycles[j][0].edge].ends[0];
            areas[j] > 1e-12 && components[other] != component && encloses(&pieces[j], at)
        });
        let smallest = around.min_by(|&a, &b| areas[a].total_cmp(&areas[b]));
        cell_of[k] = smallest.map_or(0, |j| cell_of[j]);
        plan.cells[cell_of[k]].loops.push(cycle.clone());
    }
    for (k, cycle) in cycles.iter().enumerate() {
        for half in cycle {
            plan.edges[half.edge].cells[usize::from(!half.forward)] = cell_of[k];
        }
    }
    members(plan, loops)
}

/// Sorts the edges around each vertex: by where they cross a circle that is smaller than all of
/// them, within which none crosses another.
fn rotate(plan: &mut Arrangement) {
    plan.around = vec![Vec::new(); plan.vertices.len()];
    for edge in 0..plan.edges.len() {
        let [from, to] = plan.edges[edge].ends;
        for (vertex, forward) in [(from, true), (to, false)] {
            plan.around[vertex].push(Half { edge, forward });
        }
    }
    for vertex in 0..plan.vertices.len() {
        let at = plan.vertices[vertex];
        let mut around = std::mem::take(&mut plan.around[vertex]);
        let reach = |half: &Half| {
            let middle = plan.on_edge(half.edge, 0.5);
            distance(at, middle)
        };
        let radius = around.iter().map(reach).fold(f64::INFINITY, f64::min);
        let key = |half: &Half| {
            let piece = plan.half_piece(*half);
            angle(sub(leaving(&piece, radius), at))
        };
        let mut keyed: Vec<(f64, Half)> = around.iter().map(|half| (key(half), *half)).collect();
        keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
        around.clear();
        around.extend(keyed.into_iter().map(|(_, half)| half));
        plan.around[vertex] = around;
    }
}

/// Where a piece first is at a distance from its beginning.
fn leaving(piece: &Piece, radius: f64) -> [f64; 2] {
    match (piece, piece.support()) {
        (Piece::Arc { from, to, ccw, .. }, Support::Circle { c, r }) => {
            let turn = 2.0 * libm::asin((0.5 * radius / r).min(1.0));
            let full = piece.sweep().abs();
            // A whole circle begins where it ends.
            let full = if distance(*from, *to) == 0.0 {
                std::f64::consts::TAU
            } else {
                full
            };
            let turn = if *ccw {
                turn.min(full)
            } else {
                -turn.min(full)
            };
            let from = sub(*from, c);
            let on = scale(crate::plan::polar(angle(from) + turn), norm(from));
            [c[0] + on[0], c[1] + on[1]]
        }
        _ => {
            let from = piece.from();
            let along = scale(piece.tangent(0.0), radius);
            [from[0] + along[0], from[1] + along[1]]
        }
    }
}

/// Closed runs of halves with one cell to their left.
fn cycles(plan: &Arrangement) -> Vec<Vec<Half>> {
    let index = |half: Half| 2 * half.edge + usize::from(!half.forward);
    let mut next = vec![
        Half {
            edge: 0,
            forward: true
        };
        2 * plan.edges.len()
    ];
    for around in &plan.around {
        for (k, &leaving) in around.iter().enumerate() {
            // Who arrives along this edge leaves by the next clockwise.
            let arriving = Half {
                edge: leaving.edge,
                forward: !leaving.forward,
            };
            next[index(arriving)] = around[(k + around.len() - 1) % around.len()];
        }
    }
    let mut is_done = vec![false; next.len()];
    let mut cycles = Vec::new();
    for edge in 0..plan.edges.len() {
        for forward in [true, false] {
            let mut half = Half { edge, forward };
            let mut cycle = Vec::new();
            while !is_done[index(half)] {
                is_done[index(half)] = true;
                cycle.push(half);
                half = next[index(half)];
            }
            if !cycle.is_empty() {
                cycles.push(cycle);
            }
        }
    }
    cycles
}

/// Which vertices hang together, by the least of their number.
fn components(plan: &Arrangement) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..plan.vertices.len()).collect();
    for edge in &plan.edges {
        crate::union::join(&mut parent, edge.ends[0], edge.ends[1]);
    }
    (0..parent.len())
        .map(|vertex| crate::union::root(&mut parent, vertex))
        .collect()
}

/// Crossing an edge of a loop leads into it or out of it.
fn members(plan: &mut Arrangement, loops: usize) -> Result<(), Torn> {
    let mut beside: Vec<Vec<usize>> = vec![Vec::new(); plan.cells.len()];
    for (index, edge) in plan.edges.iter().enumerate() {
        let [left, right] = edge.cells;
        beside[left].push(index);
        beside[right].push(index);
    }
    let mut is_known = vec![false; plan.cells.len()];
    is_known[0] = true;
    plan.cells[0].within = vec![false; loops];
    let mut waiting = VecDeque::from([0]);
    while let Some(cell) = waiting.pop_front() {
        for &index in &beside[cell] {
            let [left, right] = plan.edges[index].cells;
            let other = if left == cell { right } else { left };
            let mut within = plan.cells[cell].within.clone();
            if left != right {
                for &owner in &plan.edges[index].owners {
                    within[owner] = !within[owner];
                }
            }
            if !is_known[other] {
                is_known[other] = true;
                plan.cells[other].within = within;
                waiting.push_back(other);
            } else if plan.cells[other].within != within {
                return Err(Torn {
                    at: plan.on_edge(index, 0.5),
                });
            }
        }
    }
    let is_torn = |cell: &Cell| cell.within.is_empty() && loops > 0;
    if let Some(cell) = plan.cells.iter().find(|cell| is_torn(cell)) {
        let half = cell.loops.first().and_then(|halves| halves.first());
        return Err(Torn {
            at: half.map_or([0.0; 2], |half| plan.on_edge(half.edge, 0.5)),
        });
    }
    // An edge of a loop that has one cell on both sides belongs to no region.
    for index in 0..plan.edges.len() {
        let [left, right] = plan.edges[index].cells;
        if left == right && !plan.edges[index].owners.is_empty() {
            return Err(Torn {
                at: plan.on_edge(index, 0.5),
            });
        }
    }
    Ok(())
}
