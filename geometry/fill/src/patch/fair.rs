//! A coarse net made fair: its umbrellas as flat as its border's tangents allow.

use glam::DVec3;

use super::net::Net;
use crate::implicit::dense::{Square, eliminate};

/// A vertex outside a border vertex, where the surface around would go on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ghost {
    pub(super) vertex: u32,
    pub(super) place: DVec3,
}

/// A ghost counts for as many neighbours as an inner border vertex lacks.
const GHOST_WEIGHT: f64 = 2.0;

/// Moves new vertices to where the squares of all umbrellas, differences of vertices to the mean of
/// their neighbours, sum up to the least: a thin plate that is clamped along its border. Without ghosts
/// to clamp it: a membrane, each new vertex in the middle of its neighbours.
pub(super) fn fair(net: &mut Net, ghosts: &[Ghost]) {
    let (fixed, count) = (net.fixed, net.places.len());
    let inner = count - fixed;
    if inner == 0 {
        return;
    }
    let mut around: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
    for &[a, b, c] in &net.triangles {
        for (u, v) in [(a, b), (b, c), (c, a)] {
            for (own, other) in [(u, v), (v, u)] {
                if !around[own as usize].iter().any(|n| n.0 == other) {
                    around[own as usize].push((other, 1.0));
                }
            }
        }
    }
    let mut outside: Vec<(DVec3, f64)> = vec![(DVec3::ZERO, 0.0); count];
    for ghost in ghosts {
        let own = &mut outside[ghost.vertex as usize];
        own.0 += GHOST_WEIGHT * ghost.place;
        own.1 += GHOST_WEIGHT;
    }
    // Rows of the umbrellas: coefficients of new vertices, and what the fixed ones give.
    let mut normal = Square::zero(inner);
    let mut right = [vec![0.0; inner], vec![0.0; inner], vec![0.0; inner]];
    let first = if ghosts.is_empty() { fixed } else { 0 };
    for v in first..count {
        let total: f64 = around[v].iter().map(|n| n.1).sum::<f64>() + outside[v].1;
        if total == 0.0 {
            continue;
        }
        let mut row: Vec<(usize, f64)> = Vec::new();
        let mut known = outside[v].0 / total;
        let mut add = |vertex: usize, by: f64| {
            if vertex < fixed {
                known += by * net.places[vertex];
            } else {
                row.push((vertex - fixed, by));
            }
        };
        add(v, -1.0);
        for &(other, weight) in &around[v] {
            add(other as usize, weight / total);
        }
        for &(i, by) in &row {
            for &(j, other) in &row {
                normal.values[i * inner + j] += by * other;
            }
            for (right, known) in right.iter_mut().zip(known.to_array()) {
                right[i] -= by * known;
            }
        }
    }
    let solved = right.map(|own| eliminate(normal.clone(), own));
    if let [Some(x), Some(y), Some(z)] = solved {
        for k in 0..inner {
            let at = DVec3::new(x[k], y[k], z[k]);
            if at.is_finite() {
                net.places[fixed + k] = at;
            }
        }
    }
}
