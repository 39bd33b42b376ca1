//! How much of a crease or step a border is, by local fits carried on to it from both sides.

use crate::local_fit::{Belief, LocalFit};
use crate::merge::{Border, Pair};
use crate::scene::Scene;

/// At most so many places of a border are examined.
const PLACES: usize = 16;
/// Surfaces whose normal's z is below this (60 degrees of incidence) must turn by more to count
/// as creased, in proportion.
const STEEP: f64 = 0.5;
/// Reach and margin of a look at the border from further away.
const AFAR: (usize, usize) = (8, 3);
/// What counts as a crease or step from afar, in those of close by: surfaces are carried on
/// over several nodes, which costs certainty.
const ALLOWANCE: f64 = 2.5;
/// Shorter borders, in pairs of nodes, are no ground for merging.
const LEAST_PAIRS: usize = 3;

/// What the two surfaces do at one place of their border.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// Change of direction, radians, positive where the border is a ridge.
    turn_rad: f64,
    /// Distance between the two, millimetres square to the surface.
    jump_mm: f64,
    /// z of the mean normal: 1 faces the camera, 0 is seen edge on.
    facing: f64,
}

/// How a border measures up.
#[derive(Debug, Clone, Copy)]
struct Verdict {
    /// Crease angle and jump, each over what is allowed, the greater of both.
    strength: f64,
    /// z of the mean normal.
    facing: f64,
}

/// The border's strength by fits of the first reach. Where surfaces are steep the least by
/// any reach: what is truly broken is so at any scale, while what only bends away sharply is
/// smoother the closer one looks. Elsewhere short fits would see no more of an edge than the
/// narrow chamfer or rounding that it may have.
pub(crate) fn strength(
    scene: &Scene<'_>,
    labels: &[u32],
    border: &Border,
    reaches: &[usize],
) -> Option<f64> {
    let mut least = None;
    for &reach in reaches {
        let Some(near) = verdict(scene, labels, border, (reach, 1)) else {
            continue;
        };
        least = Some(least.map_or(near.strength, |s: f64| s.min(near.strength)));
        if near.facing > STEEP {
            // The sides of a narrow chamfer or rounding meet smoothly in its middle.
            let afar = verdict(scene, labels, border, AFAR).map(|v| v.strength / ALLOWANCE);
            return least.map(|s| s.max(afar.unwrap_or(0.0)));
        }
    }
    least
}

fn verdict(
    scene: &Scene<'_>,
    labels: &[u32],
    border: &Border,
    (reach, margin): (usize, usize),
) -> Option<Verdict> {
    let (a, b) = border.regions;
    let pairs = &border.pairs;
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let places = pairs.len().min(PLACES);
    let mut sums = Vec::new();
    let mut meetings = Vec::with_capacity(places);
    for place in 0..places {
        let pair = pairs[(2 * place + 1) * pairs.len() / (2 * places)];
        scene.sums_around(
            labels,
            pair.first as usize,
            (reach, margin),
            |l| l == a || l == b,
            &mut sums,
        );
        let fit = |label| sums.iter().find(|s| s.label == label)?.fit(Belief::Ready);
        if let (Some(one), Some(other)) = (fit(a), fit(b)) {
            meetings.push(meet(scene, pair, &one, &other));
        }
    }
    if 3 * meetings.len() < places {
        return None;
    }
    let median = |value: &dyn Fn(&Meeting) -> f64| {
        let mut values: Vec<f64> = meetings.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    // Noise turns this way and that, a crease one way; a border that is ridge here and
    // valley there betrays itself by sizes that noise does not explain.
    let one_way = median(&|m| m.turn_rad).abs();
    let either_way = median(&|m| m.turn_rad.abs()) - scene.turn_noise_rad(reach);
    // Steep surfaces run out of nodes: z over x and y bends ever more sharply there, and a
    // fit foretells its direction the less.
    let facing = median(&|m| m.facing);
    let crease = scene.crease_rad * (STEEP / facing).max(1.0);
    let jump = median(&|m| m.jump_mm);
    Some(Verdict {
        strength: (one_way.max(either_way) / crease).max(jump / scene.step_mm),
        facing,
    })
}

fn meet(scene: &Scene<'_>, pair: Pair, one: &LocalFit, other: &LocalFit) -> Meeting {
    let (u, v) = if pair.to_the_right {
        (0.5, 0.0)
    } else {
        (0.0, 0.5)
    };
    let pitch = scene.grid.pitch_mm;
    let (m, n) = (one.normal(pitch, u, v), other.normal(pitch, u, v));
    // On a ridge the normals lean apart, each to its own side.
    let apart = (n[0] - m[0]) * (other.centroid[0] - one.centroid[0])
        + (n[1] - m[1]) * (other.centroid[1] - one.centroid[1]);
    let turn = angle(m, n);
    let facing = 0.5 * (m[2] + n[2]);
    // The gap along z, as seen square to the mean surface.
    let gap = (one.z_mm(u, v) - other.z_mm(u, v)).abs();
    Meeting {
        turn_rad: if apart < 0.0 { -turn } else { turn },
        jump_mm: gap * facing,
        facing,
    }
}

/// Angle between unit vectors.
fn angle(m: [f64; 3], n: [f64; 3]) -> f64 {
    let cross = [
        m[1] * n[2] - m[2] * n[1],
        m[2] * n[0] - m[0] * n[2],
        m[0] * n[1] - m[1] * n[0],
    ];
    let sine = libm::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    libm::atan2(sine, m[0] * n[0] + m[1] * n[1] + m[2] * n[2])
}
