//! A net refined to the wanted lengths and relaxed on its surface.

use glam::DVec3;
use rayon::prelude::*;

use super::cavity::cut_folds;
use super::net::{Net, Placed};
use crate::implicit::Implicit;

/// Rounds of splitting: each halves what is too long.
const MOST_ROUNDS: usize = 40;
/// Rounds that vertices are relaxed in once lengths are right.
const RELAXING: usize = 6;
/// How far a vertex goes towards the middle of its neighbours at a time.
const DAMPING: f64 = 0.6;

/// Rounds in which folds are smoothed out.
const UNFOLDING: usize = 30;
/// Rounds in which those that are left are cut out.
const CUTTING: usize = 4;
/// A net is folded for good where every so many-th of its triangles is.
const MOST_FOLDED: usize = 8;

/// Splits, flips, collapses and relaxes until edges have the wanted lengths; new vertices lie on the
/// surface where they reach it. False where there would be more vertices than `most`.
pub(crate) fn refine(
    net: &mut Net,
    surface: Option<&Implicit>,
    is_forbidden: &impl Fn(u32, u32) -> bool,
    most: usize,
) -> bool {
    let place = |at: DVec3, reach: f64| foot(surface, at, reach).unwrap_or((at, DVec3::ZERO));
    for _ in 0..MOST_ROUNDS {
        let split = net.split(&place);
        net.flip(is_forbidden);
        if net.places.len() > most {
            return false;
        }
        if split == 0 {
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
    unfold(net, surface, is_forbidden);
    for _ in 0..CUTTING {
        let folds = net.folds().len();
        let is_hopeless = folds * MOST_FOLDED > net.triangles.len();
        if surface.is_none() || is_hopeless || cut_folds(net, is_forbidden) == 0 {
            break;
        }
        for _ in 0..RELAXING {
            net.split(&place);
            net.flip(is_forbidden);
            if net.places.len() > most {
                return false;
            }
            relax(net, surface);
        }
        net.flip(is_forbidden);
    }
    true
}

/// Relaxes on until nothing is folded.
pub(super) fn unfold(
    net: &mut Net,
    surface: Option<&Implicit>,
    is_forbidden: &impl Fn(u32, u32) -> bool,
) {
    for _ in 0..UNFOLDING {
        if net.folds().is_empty() {
            return;
        }
        relax(net, surface);
        net.flip(is_forbidden);
    }
}

/// The foot of a place on the surface, and the normal there.
pub(super) fn foot(surface: Option<&Implicit>, at: DVec3, reach: f64) -> Option<Placed> {
    let own = surface?;
    let foot = own.foot(at, reach)?;
    Some((foot, own.at(foot).1.normalize_or_zero()))
}

/// Moves each new vertex towards the middle of the triangles around it, along the surface and back
/// onto it; where that would fold a triangle the vertex stays. Vertices of folded triangles go to the
/// middle of their neighbours, which unfolds them.
pub(super) fn relax(net: &mut Net, surface: Option<&Implicit>) {
    let stars = net.stars();
    let mut was_folded = vec![false; net.triangles.len()];
    net.folds().into_iter().for_each(|t| was_folded[t] = true);
    let moved = |v: usize| -> Placed {
        let at = net.places[v];
        let is_folded = stars[v].iter().any(|&t| was_folded[t as usize]);
        let (mut sum, mut weights, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for &t in &stars[v] {
            let own = net.triangles[t as usize];
            let doubled = net.doubled_area(own);
            let [a, b, c] = own.map(|w| net.places[w as usize]);
            // Areas by what is wanted there, so that lengths may change across the filling.
            let size = own.iter().map(|&w| net.sizes[w as usize]).sum::<f64>() / 3.0;
            let (weight, middle) = if is_folded {
                (1.0, 0.5 * (a + b + c - at))
            } else {
                (doubled.length() / (size * size), (a + b + c) / 3.0)
            };
            sum += weight * middle;
            weights += weight;
            normal += doubled;
        }
        let stays = (at, net.normals[v]);
        if weights <= 0.0 {
            return stays;
        }
        let known = net.normals[v];
        let normal = if known == DVec3::ZERO {
            normal.normalize_or_zero()
        } else {
            known
        };
        let step = if is_folded { 1.0 } else { DAMPING } * (sum / weights - at);
        let step = step - step.dot(normal) * normal;
        match surface {
            Some(_) => foot(surface, at + step, 2.0 * net.sizes[v]).unwrap_or(stays),
            None => (at + step, DVec3::ZERO),
        }
    };
    let first = net.fixed;
    let new: Vec<Placed> = (first..net.places.len())
        .into_par_iter()
        .with_min_len(16)
        .map(moved)
        .collect();
    let before: Vec<DVec3> = net.triangles.iter().map(|&t| net.normal_at(t)).collect();
    let old: Vec<Placed> = (first..net.places.len())
        .map(|v| (net.places[v], net.normals[v]))
        .collect();
    for (k, (at, normal)) in new.into_iter().enumerate() {
        net.places[first + k] = at;
        net.normals[first + k] = normal;
    }
    // Several rounds: what goes back may fold what moved.
    for _ in 0..4 {
        let mut is_back = false;
        for t in 0..net.triangles.len() {
            if was_folded[t] || !net.faces_away(net.triangles[t], before[t]) {
                continue;
            }
            for v in net.triangles[t].map(|v| v as usize) {
                if v >= first && net.places[v] != old[v - first].0 {
                    is_back = true;
                    (net.places[v], net.normals[v]) = old[v - first];
                }
            }
        }
        if !is_back {
            break;
        }
    }
}
