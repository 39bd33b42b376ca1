//! How much of a crease or a step a border is.
//!
//! At places along the border, a quadric is fitted to the nodes of both sides together with
//! what a crease and a step would add: |s|, s |s| and the sign of s, where s is the distance
//! from the border. A crease looks the same through windows of any size, while a bend that is
//! round at the scale of a small window only looks sharp through a large one. So the smallest
//! window that noise lets decide has the say.

mod place;

use rayon::prelude::*;

use crate::merge::Border;
use crate::scene::Scene;
use place::{Place, place};

/// Half the sides of the windows, nodes, the largest first,
/// and the share of a crease that is left in them, since the regridder rounds it.
const REACHES: [(usize, f64); 3] = [(8, 1.0), (5, 0.8), (3, 0.4)];
/// A step is blurred over a few nodes, so smaller windows see a slope instead.
const LEAST_STEP_REACH: usize = 5;
/// At most so many places of a border are examined.
const PLACES: usize = 12;
/// Shorter borders, in pairs of nodes, are no ground for merging.
const LEAST_PAIRS: usize = 3;
/// Share of a bend seen through the largest window that a crease shows through the smaller ones.
const SHARP: f64 = 0.25;
/// Surfaces whose normal's z is below this (60 degrees of incidence) must turn by more to count
/// as creased, in proportion.
const STEEP: f64 = 0.5;
/// A border may be off by so many nodes, in which a curved side turns without being creased.
const BENDS: f64 = 1.0;

/// What was measured along a border through windows of one size.
#[derive(Debug, Clone, Copy)]
struct Reading {
    turn_rad: f64,
    turn_error_rad: f64,
    jump_mm: f64,
    /// Turn from node to node by the curvature beside the border, of the more curved side.
    bend_rad: f64,
    facing: f64,
}

/// The border's strength: crease angle and jump, each over what is allowed, the greater of
/// both. `None` where too little can be measured.
///
/// The turn counts with so many of its standard errors on top.
pub(crate) fn strength(
    scene: &Scene<'_>,
    labels: &[u32],
    border: &Border,
    errors: f64,
) -> Option<f64> {
    if border.pairs.len() < LEAST_PAIRS {
        return None;
    }
    let mut afar: Option<Reading> = None;
    let mut least: Option<f64> = None;
    let mut facing = 0.0;
    let mut step: Option<f64> = None;
    for (reach, share) in REACHES {
        let Some(reading) = reading(scene, labels, border, reach) else {
            continue;
        };
        let first = *afar.get_or_insert(reading);
        facing = f64::max(facing, reading.facing);
        let allowed = scene.crease_rad * (STEEP / facing).max(1.0);
        let allowed = (share * allowed)
            .max(SHARP * first.turn_rad)
            .max(BENDS * reading.bend_rad);
        let doubt = 2.0 * reading.turn_error_rad;
        let decides =
            doubt <= 0.5 * allowed || reading.turn_rad + doubt < 0.9 * share * first.turn_rad;
        if least.is_some() && !decides {
            break;
        }
        let turn_rad = reading.turn_rad + errors * reading.turn_error_rad;
        let strength = turn_rad / allowed;
        if reach >= LEAST_STEP_REACH {
            let jump = reading.jump_mm / scene.step_mm;
            step = Some(step.map_or(jump, |s| s.min(jump)));
        }
        least = Some(least.map_or(strength, |s| s.min(strength)));
    }
    least.map(|s| s.max(step.unwrap_or(0.0)))
}

fn reading(scene: &Scene<'_>, labels: &[u32], border: &Border, reach: usize) -> Option<Reading> {
    let pairs = &border.pairs;
    let wanted = pairs.len().min(PLACES);
    let mut places: Vec<Place> = (0..wanted)
        .into_par_iter()
        .filter_map(|k| {
            let pair = pairs[(2 * k + 1) * pairs.len() / (2 * wanted)];
            place(scene, labels, border.regions, pair, reach)
        })
        .collect();
    if 3 * places.len() < wanted {
        return None;
    }
    Some(pool(&mut places, reach, pairs.len()))
}

/// How many windows along a border do not overlap.
fn apart(reach: usize, pairs: usize) -> f64 {
    (pairs as f64 / (2 * reach + 1) as f64).clamp(1.0, PLACES as f64)
}

fn pool(places: &mut [Place], reach: usize, pairs: usize) -> Reading {
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let take = |places: &[Place], value: &dyn Fn(&Place) -> f64| {
        places.iter().map(value).collect::<Vec<f64>>()
    };
    let turn_error = median(&mut take(places, &|p| p.turn_error_rad));
    let jump_error = median(&mut take(places, &|p| p.jump_error_mm));
    let facing = median(&mut take(places, &|p| p.facing));
    let one_way = median(&mut take(places, &|p| p.turn_rad)).abs();
    let either_way = median(&mut take(places, &|p| p.turn_rad.abs())) - turn_error;
    let jump_one_way = median(&mut take(places, &|p| p.jump_mm)).abs();
    let jump_either_way = median(&mut take(places, &|p| p.jump_mm.abs())) - jump_error;
    // Windows that overlap tell less than as many that do not.
    let apart = apart(reach, pairs).min(places.len() as f64);
    Reading {
        turn_rad: one_way.max(either_way),
        turn_error_rad: 1.25 * turn_error / libm::sqrt(apart),
        jump_mm: jump_one_way.max(jump_either_way),
        bend_rad: [0, 1]
            .map(|side| median(&mut take(places, &|p| p.bends_rad[side])).abs())
            .into_iter()
            .fold(0.0, f64::max),
        facing,
    }
}
