//! A net refined to the wanted lengths and relaxed on its surface.

use glam::DVec3;
use rayon::prelude::*;

use super::net::Net;
use crate::implicit::Implicit;

/// Rounds of splitting: each halves what is too long.
const MOST_ROUNDS: usize = 40;
/// Rounds that vertices are relaxed in once lengths are right.
const RELAXING: usize = 6;
/// How far a vertex goes towards the middle of its neighbours at a time.
const DAMPING: f64 = 0.6;
/// Most vertices of one filling.
const MOST_VERTICES: usize = 4_000_000;

/// Splits, flips, collapses and relaxes until edges have the wanted lengths; new vertices lie on the
/// surface where they reach it.
pub(crate) fn refine(
    net: &mut Net,
    surface: Option<&Implicit>,
    is_forbidden: &impl Fn(u32, u32) -> bool,
) {
    let place = |at: DVec3, reach: f64| foot(surface, at, reach).unwrap_or(at);
    for _ in 0..MOST_ROUNDS {
        let split = net.split(&place);
        net.flip(is_forbidden);
        if split == 0 || net.places.len() > MOST_VERTICES {
            break;
        }
        relax(net, surface);
    }
    for round in 0..RELAXING {
        if round < RELAXING / 2 {
            net.collapse(is_forbidden);
            net.split(&place);
        }
        net.flip(is_forbidden);
        relax(net, surface);
    }
    net.flip(is_forbidden);
}

pub(super) fn foot(surface: Option<&Implicit>, at: DVec3, reach: f64) -> Option<DVec3> {
    surface.and_then(|surface| surface.foot(at, reach))
}

/// Moves each new vertex towards the middle of the triangles around it, along the surface and back
/// onto it; where that would fold a triangle the vertex stays.
pub(super) fn relax(net: &mut Net, surface: Option<&Implicit>) {
    let stars = net.stars();
    let moved = |v: usize| -> DVec3 {
        let at = net.places[v];
        let (mut sum, mut weights, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for &t in &stars[v] {
            let own = net.triangles[t as usize];
            let doubled = net.doubled_area(own);
            let [a, b, c] = own.map(|w| net.places[w as usize]);
            // Areas by what is wanted there, so that lengths may change across the filling.
            let size = own.iter().map(|&w| net.sizes[w as usize]).sum::<f64>() / 3.0;
            let weight = doubled.length() / (size * size);
            sum += weight * (a + b + c) / 3.0;
            weights += weight;
            normal += doubled;
        }
        if weights <= 0.0 {
            return at;
        }
        let normal = normal.normalize_or_zero();
        let step = DAMPING * (sum / weights - at);
        let step = step - step.dot(normal) * normal;
        let reach = 2.0 * net.sizes[v];
        match surface {
            Some(own) => own.foot(at + step, reach).unwrap_or(at),
            None => at + step,
        }
    };
    let range = net.fixed..net.places.len();
    let new: Vec<DVec3> = range
        .clone()
        .into_par_iter()
        .with_min_len(16)
        .map(moved)
        .collect();
    let before: Vec<DVec3> = net.doubled_areas();
    let old: Vec<DVec3> = net.places[net.fixed..].to_vec();
    net.places[range.start..].copy_from_slice(&new);
    // Two rounds: what goes back may fold what moved.
    for _ in 0..2 {
        let mut is_back = false;
        for (t, was) in before.iter().enumerate() {
            let own = net.triangles[t];
            let is = net.doubled_area(own);
            if is.dot(*was) <= 0.2 * is.length() * was.length() {
                for v in own.map(|v| v as usize).into_iter().filter(|v| *v >= net.fixed) {
                    is_back |= net.places[v] != old[v - net.fixed];
                    net.places[v] = old[v - net.fixed];
                }
            }
        }
        if !is_back {
            break;
        }
    }
}

impl Net {
    fn doubled_areas(&self) -> Vec<DVec3> {
        self.triangles.iter().map(|&t| self.doubled_area(t)).collect()
    }
}
