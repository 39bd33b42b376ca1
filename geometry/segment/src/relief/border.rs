//! How much of a crease or a step a border is.
//!
//! At places along the border, a quadric is fitted to the nodes of both sides together with
//! what a crease and a step would add: |s|, s |s| and the sign of s, where s is the distance
//! from the border. A crease looks the same through windows of any size, while a bend that is
//! round at the scale of a small window only looks sharp through a large one. So the smallest
//! window that noise lets decide has the say.

use super::least_squares::{LeastSquares, Solution};
use crate::merge::{Border, Pair};
use crate::scene::{NONE, Scene};

/// Terms of the model: 1, u, v, |s|, sign s, u u, u v, v v, s |s|.
const TERMS: usize = 9;
type System = LeastSquares<TERMS>;

const KINK: usize = 3;
const STEP: usize = 4;
/// Half the sides of the windows, nodes, the largest first,
/// and the share of a crease that is left in them, since the regridder rounds it.
const REACHES: [(usize, f64); 3] = [(8, 1.0), (5, 0.8), (3, 0.4)];
/// Weight of nodes less than one node from the border, which mix both sides.
const NEAR_WEIGHT: f64 = 0.3;
/// A step is blurred over a few nodes, so smaller windows see a slope instead.
const LEAST_STEP_REACH: usize = 5;
/// At most so many places of a border are examined.
const PLACES: usize = 12;
/// Shorter borders, in pairs of nodes, are no ground for merging.
const LEAST_PAIRS: usize = 3;
/// Fewer nodes on either side of a place tell nothing.
const LEAST_NODES: usize = 8;
/// Share of a bend seen through the largest window that a crease shows through the smaller ones.
const SHARP: f64 = 0.25;
/// Surfaces whose normal's z is below this (60 degrees of incidence) must turn by more to count
/// as creased, in proportion.
const STEEP: f64 = 0.5;
/// A border may be off by so many nodes, in which a curved side turns without being creased.
const BENDS: f64 = 1.0;
/// What was measured at one place.
#[derive(Debug, Clone, Copy)]
struct Place {
    turn_rad: f64,
    turn_error_rad: f64,
    jump_mm: f64,
    jump_error_mm: f64,
    /// Turn across the border from node to node by the curvature of either side.
    bends_rad: [f64; 2],
    facing: f64,
}

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
    let systems: Vec<(System, [f64; 2])> = (0..wanted)
        .filter_map(|k| {
            let pair = pairs[(2 * k + 1) * pairs.len() / (2 * wanted)];
            system(scene, labels, border.regions, pair, reach)
        })
        .collect();
    if 3 * systems.len() < wanted {
        return None;
    }
    let mut places: Vec<Place> = systems
        .iter()
        .filter_map(|(system, across)| Some(place(scene, system, &system.solve(TERMS)?, *across)))
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

fn system(
    scene: &Scene<'_>,
    labels: &[u32],
    (a, b): (u32, u32),
    pair: Pair,
    reach: usize,
) -> Option<(System, [f64; 2])> {
    let grid = &scene.grid;
    let node = pair.first as usize;
    let (column, row) = grid.column_row(node);
    let (columns, rows) = grid.window(node, reach);
    let (mu, mv) = if pair.to_the_right {
        (0.5, 0.0)
    } else {
        (0.0, 0.5)
    };
    // From the one side's middle to the other's.
    let mut middles = [[0.0; 3]; 2];
    for c in columns.clone() {
        for r in rows.clone() {
            let label = labels[c * grid.rows + r];
            if label == a || label == b {
                let middle = &mut middles[usize::from(label == b)];
                middle[0] += 1.0;
                middle[1] += c as f64 - column as f64;
                middle[2] += r as f64 - row as f64;
            }
        }
    }
    let [one, other] = middles;
    if one[0] < LEAST_NODES as f64 || other[0] < LEAST_NODES as f64 {
        return None;
    }
    let across = [
        other[1] / other[0] - one[1] / one[0],
        other[2] / other[0] - one[2] / one[0],
    ];
    let length = libm::sqrt(across[0] * across[0] + across[1] * across[1]);
    if length < 0.5 {
        return None;
    }
    let across = across.map(|v| v / length);
    let mut system = System::new();
    let z0 = grid.z_mm[node];
    let mut sides = [0_usize; 2];
    for c in columns {
        for r in rows.clone() {
            let k = c * grid.rows + r;
            let label = labels[k];
            if label == NONE || (label != a && label != b) {
                continue;
            }
            let u = c as f64 - column as f64 - mu;
            let v = r as f64 - row as f64 - mv;
            let s = u * across[0] + v * across[1];
            // Where the border bends away, s is not the distance from it.
            if (s > 0.0) != (label == b) {
                continue;
            }
            sides[usize::from(label == b)] += 1;
            let sign = if s > 0.0 { 0.5 } else { -0.5 };
            let weight = if s.abs() < 1.0 { NEAR_WEIGHT } else { 1.0 };
            let terms = [1.0, u, v, s.abs(), sign, u * u, u * v, v * v, s * s.abs()];
            system.add(&terms, grid.z_mm[k] - z0, weight);
        }
    }
    (sides[0] >= LEAST_NODES && sides[1] >= LEAST_NODES).then_some((system, across))
}

fn place(
    scene: &Scene<'_>,
    system: &System,
    solution: &Solution<TERMS>,
    across: [f64; 2],
) -> Place {
    let pitch = scene.grid.pitch_mm;
    let noise = &scene.noise;
    let [_, p, q, kink, step, uu, uv, vv, odd] = solution.terms;
    let even = uu * across[0] * across[0] + uv * across[0] * across[1] + vv * across[1] * across[1];
    let to_angle = facing_squared(p / pitch, q / pitch) / pitch;
    // On either side, the rise at the border is that of the plane with the kink's, away from
    // the border.
    let normal = |sign: f64| {
        let (p, q) = (
            (p + sign * kink * across[0]) / pitch,
            (q + sign * kink * across[1]) / pitch,
        );
        let length = libm::sqrt(1.0 + p * p + q * q);
        [-p / length, -q / length, 1.0 / length]
    };
    let (m, n) = (normal(-1.0), normal(1.0));
    let cross = [
        m[1] * n[2] - m[2] * n[1],
        m[2] * n[0] - m[0] * n[2],
        m[0] * n[1] - m[1] * n[0],
    ];
    let sine = libm::sqrt(cross.iter().map(|c| c * c).sum::<f64>());
    let cosine = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
    let turn = libm::atan2(sine, cosine);
    let facing = 0.5 * (m[2] + n[2]);
    let left = solution.error / (system.weight() - TERMS as f64).max(1.0);
    let noise_mm = noise.on_slope_mm([p, q], pitch);
    let variance = (noise_mm * noise_mm).max(left) * noise.area_nodes;
    let errors = [KINK, STEP].map(|term| libm::sqrt(solution.variance(term) * variance));
    // A kink is half a change of slope; angles shrink slopes by the square of the facing.
    Place {
        turn_rad: if kink > 0.0 { turn } else { -turn },
        turn_error_rad: 2.0 * errors[0] / pitch * facing * facing,
        jump_mm: step * facing,
        jump_error_mm: errors[1] * facing,
        bends_rad: [even - odd, even + odd].map(|curvature| 2.0 * curvature * to_angle),
        facing,
    }
}

/// Square of the z of a unit normal, from its slopes.
fn facing_squared(p: f64, q: f64) -> f64 {
    1.0 / (1.0 + p * p + q * q)
}
