//! One place of a border, seen square to the surface.
//!
//! z over columns and rows turns ever faster where a round surface falls away, which no
//! quadric follows. Seen along its own normal, the same surface is as round there as elsewhere.

use crate::merge::Pair;
use crate::relief::least_squares::LeastSquares;
use crate::scene::{NONE, Scene};

/// Terms of the plane that the place is seen along: 1, u, v, sign s.
const FRAME_TERMS: usize = 4;
/// Terms of the model: 1, u, v, |s|, sign s, u u, u v, v v, s |s|.
const TERMS: usize = 9;
const KINK: usize = 3;
const STEP: usize = 4;
/// Weight of nodes less than one node from the border, which mix both sides.
const NEAR_WEIGHT: f64 = 0.3;
/// Fewer nodes on either side of a place tell nothing.
const LEAST_NODES: usize = 8;
/// On slopes, windows reach up to so many times further along the surface than they do in the
/// image.
const STRETCH: f64 = 2.0;

/// What was measured at one place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) turn_rad: f64,
    pub(super) turn_error_rad: f64,
    pub(super) jump_mm: f64,
    pub(super) jump_error_mm: f64,
    /// Turn across the border from node to node by the curvature of either side.
    pub(super) bends_rad: [f64; 2],
    /// z of the surface's unit normal.
    pub(super) facing: f64,
}

/// A node of either side: place from the middle of the pair, pitches, and its side.
struct Node {
    place: [f64; 3],
    is_other: bool,
}

/// Measures the border between two regions about a pair of its nodes, in a window of so many
/// nodes either way; `None` where there are too few of them.
pub(super) fn place(
    scene: &Scene<'_>,
    labels: &[u32],
    regions: (u32, u32),
    pair: Pair,
    reach: usize,
) -> Option<Place> {
    let nodes = nodes(scene, labels, regions, pair, reach);
    let counts = [false, true].map(|side| nodes.iter().filter(|n| n.is_other == side).count());
    if counts.into_iter().any(|count| count < LEAST_NODES) {
        return None;
    }
    let frame = Frame::of(&nodes)?;
    // From the one side's middle to the other's.
    let mut across = [0.0; 2];
    for node in &nodes {
        let share = 1.0 / counts[usize::from(node.is_other)] as f64;
        let sign = if node.is_other { share } else { -share };
        let [u, v, _] = frame.seen(node.place);
        across[0] += sign * u;
        across[1] += sign * v;
    }
    let length = libm::hypot(across[0], across[1]);
    if length < 0.5 {
        return None;
    }
    let across = across.map(|v| v / length);
    let mut sums = LeastSquares::<TERMS>::new();
    let mut sides = [0_usize; 2];
    let most = STRETCH * (reach as f64 + 0.5);
    for node in &nodes {
        let [u, v, w] = frame.seen(node.place);
        let s = u * across[0] + v * across[1];
        // Where the border bends away, s is not the distance from it.
        if (s > 0.0) != node.is_other || u.abs() > most || v.abs() > most {
            continue;
        }
        sides[usize::from(node.is_other)] += 1;
        let sign = if s > 0.0 { 0.5 } else { -0.5 };
        let weight = if s.abs() < 1.0 { NEAR_WEIGHT } else { 1.0 };
        let terms = [1.0, u, v, s.abs(), sign, u * u, u * v, v * v, s * s.abs()];
        sums.add(&terms, w, weight);
    }
    if sides.into_iter().any(|count| count < LEAST_NODES) {
        return None;
    }
    measured(scene, &sums, &frame, across)
}

fn nodes(
    scene: &Scene<'_>,
    labels: &[u32],
    (one, other): (u32, u32),
    pair: Pair,
    reach: usize,
) -> Vec<Node> {
    let grid = &scene.grid;
    let first = pair.first as usize;
    let (beside, middle) = if pair.to_the_right {
        (first + grid.rows, [0.5, 0.0])
    } else {
        (first + 1, [0.0, 0.5])
    };
    let z0_mm = 0.5 * (grid.z_mm[first] + grid.z_mm[beside]);
    let (column, row) = grid.column_row(first);
    let (columns, rows) = grid.window(first, reach);
    let mut nodes = Vec::with_capacity(columns.len() * rows.len());
    for c in columns {
        for r in rows.clone() {
            let k = c * grid.rows + r;
            let label = labels[k];
            if label == NONE || (label != one && label != other) {
                continue;
            }
            nodes.push(Node {
                place: [
                    c as f64 - column as f64 - middle[0],
                    r as f64 - row as f64 - middle[1],
                    (grid.z_mm[k] - z0_mm) / grid.pitch_mm,
                ],
                is_other: label == other,
            });
        }
    }
    nodes
}

/// Axes along the surface and its normal.
struct Frame {
    axes: [[f64; 3]; 3],
}

impl Frame {
    /// That of the plane through the nodes of both sides, a step between them left aside.
    fn of(nodes: &[Node]) -> Option<Self> {
        let mut sums = LeastSquares::<FRAME_TERMS>::new();
        for node in nodes {
            let [u, v, w] = node.place;
            let sign = if node.is_other { 0.5 } else { -0.5 };
            sums.add(&[1.0, u, v, sign], w, 1.0);
        }
        let [_, p, q, _] = sums.solve(FRAME_TERMS)?.terms;
        let length = libm::sqrt(1.0 + p * p + q * q);
        let n = [-p / length, -q / length, 1.0 / length];
        let length = libm::sqrt(1.0 + p * p);
        let e = [1.0 / length, 0.0, p / length];
        let f = [
            n[1] * e[2] - n[2] * e[1],
            n[2] * e[0] - n[0] * e[2],
            n[0] * e[1] - n[1] * e[0],
        ];
        Some(Self { axes: [e, f, n] })
    }

    fn seen(&self, place: [f64; 3]) -> [f64; 3] {
        self.axes
            .map(|axis| axis.iter().zip(place).map(|(a, p)| a * p).sum())
    }

    /// z of the normal.
    fn facing(&self) -> f64 {
        self.axes[2][2]
    }

    /// How far along the surface a direction in it goes for every node that it goes in the
    /// image.
    fn stretch(&self, [u, v]: [f64; 2]) -> f64 {
        let [e, f, _] = self.axes;
        let [x, y] = [0, 1].map(|k| u * e[k] + v * f[k]);
        1.0 / libm::hypot(x, y)
    }
}

fn measured(
    scene: &Scene<'_>,
    sums: &LeastSquares<TERMS>,
    frame: &Frame,
    across: [f64; 2],
) -> Option<Place> {
    let solution = sums.solve(TERMS)?;
    let pitch_mm = scene.grid.pitch_mm;
    let [_, p, q, kink, step, uu, uv, vv, odd] = solution.terms;
    let even = uu * across[0] * across[0] + uv * across[0] * across[1] + vv * across[1] * across[1];
    // On either side, the slope at the border is that of the plane with the kink's, away from
    // the border.
    let along = p * across[0] + q * across[1];
    let turn_rad = libm::atan(along + kink) - libm::atan(along - kink);
    let [_, _, n] = frame.axes;
    let rise_mm = [-n[0], -n[1]].map(|v| v / n[2] * pitch_mm);
    let noise = scene.noise.on_slope_mm(rise_mm, pitch_mm) * frame.facing() / pitch_mm;
    let left = solution.error / (sums.weight() - TERMS as f64).max(1.0);
    let variance = (noise * noise).max(left) * scene.noise.area_nodes;
    let errors = [KINK, STEP].map(|term| libm::sqrt(solution.variance(term) * variance));
    let bend = 2.0 * frame.stretch(across) / (1.0 + along * along);
    Some(Place {
        turn_rad,
        // A kink is half a change of slope.
        turn_error_rad: 2.0 * errors[0] / (1.0 + along * along),
        jump_mm: step * pitch_mm,
        jump_error_mm: errors[1] * pitch_mm,
        bends_rad: [even - odd, even + odd].map(|curvature| curvature * bend),
        facing: frame.facing(),
    })
}
