//! Equal holes that lie on a line or a circle at equal distances.

use crate::feature::Feature;
use crate::outline::Shape;

/// What a pattern is along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// A straight line.
    Line,
    /// A circle.
    Circle,
}

/// A pattern of equal features.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// What it is along.
    pub along: Along,
    /// Its features, in order.
    pub members: Vec<u32>,
    /// Distance of neighbours, millimetres.
    pub step_mm: f64,
    /// Diameter of the circle that the middles lie on.
    pub diameter_mm: Option<f64>,
}

/// Diameters and places of one pattern differ by no more than this share of the diameter ...
const DIAMETERS: f64 = 0.03;
const PLACES: f64 = 0.06;
/// ... or so many of their uncertainties.
const SIGMAS: f64 = 4.0;

/// Patterns among the round hollows of one parent; each hollow is in one at most, the longest
/// first.
#[must_use]
pub fn patterns(features: &[Feature]) -> Vec<Pattern> {
    let holes: Vec<(&Feature, [f64; 2], f64)> = features
        .iter()
        .filter(|f| f.class == crate::class::Class::Hole.as_str())
        .filter_map(|f| match f.outline {
            Shape::Circle(circle) => Some((f, circle.centre_mm, 2.0 * circle.radius_mm)),
            Shape::Rectangle(_) => None,
        })
        .collect();
    let alike = |a: usize, b: usize| {
        let sigma = |f: &Feature| f.dimension("diameter").map_or(0.0, |d| d.sigma_mm);
        let within = (DIAMETERS * holes[a].2).max(SIGMAS * (sigma(holes[a].0) + sigma(holes[b].0)));
        holes[a].0.parent == holes[b].0.parent && (holes[a].2 - holes[b].2).abs() <= within
    };
    let near = |hole: usize, place: [f64; 2]| {
        let [u, v] = holes[hole].1;
        let sigma = holes[hole].0.centre_sigma_mm;
        let within = (PLACES * holes[hole].2).max(SIGMAS * (sigma[0] + sigma[1]));
        let off = ((u - place[0]) * (u - place[0]) + (v - place[1]) * (v - place[1])).sqrt();
        off <= within
    };
    let mut found: Vec<Pattern> = Vec::new();
    for a in 0..holes.len() {
        for b in (0..holes.len()).filter(|b| *b != a && alike(a, *b)) {
            let step = [holes[b].1[0] - holes[a].1[0], holes[b].1[1] - holes[a].1[1]];
            let mut chain = vec![a, b];
            let mut place = holes[b].1;
            loop {
                place = [place[0] + step[0], place[1] + step[1]];
                let next = (0..holes.len())
                    .find(|c| !chain.contains(c) && alike(a, *c) && near(*c, place));
                let Some(next) = next else { break };
                place = holes[next].1;
                chain.push(next);
            }
            if chain.len() >= 3 {
                let length = (step[0] * step[0] + step[1] * step[1]).sqrt();
                found.push(told(&holes, &chain, Along::Line, length, None));
            }
        }
    }
    circles(&holes, &alike, &near, &mut found);
    found.sort_by_key(|p| {
        (
            std::cmp::Reverse(p.members.len()),
            p.along as u8,
            p.members.clone(),
        )
    });
    let mut taken = std::collections::BTreeSet::new();
    found.retain(|pattern| {
        let free = pattern.members.iter().all(|m| !taken.contains(m));
        if free {
            taken.extend(pattern.members.iter().copied());
        }
        free
    });
    found
}

type Hole<'a> = (&'a Feature, [f64; 2], f64);

fn told(
    holes: &[Hole<'_>],
    chain: &[usize],
    along: Along,
    step_mm: f64,
    diameter_mm: Option<f64>,
) -> Pattern {
    Pattern {
        along,
        members: chain.iter().map(|k| holes[*k].0.id).collect(),
        step_mm,
        diameter_mm,
    }
}

/// Circles through three holes that hold at least four at equal steps all around.
fn circles(
    holes: &[Hole<'_>],
    alike: &dyn Fn(usize, usize) -> bool,
    near: &dyn Fn(usize, [f64; 2]) -> bool,
    found: &mut Vec<Pattern>,
) {
    for a in 0..holes.len() {
        for b in (a + 1..holes.len()).filter(|b| alike(a, *b)) {
            for c in (b + 1..holes.len()).filter(|c| alike(a, *c)) {
                let three = [holes[a].1, holes[b].1, holes[c].1];
                let Some(circle) = crate::outline::circle(&three) else {
                    continue;
                };
                for count in 4..=24_usize {
                    let [cu, cv] = circle.centre_mm;
                    let [du, dv] = [holes[a].1[0] - cu, holes[a].1[1] - cv];
                    let step = core::f64::consts::TAU / count as f64;
                    let around: Vec<Option<usize>> = (0..count)
                        .map(|k| {
                            let (sin, cos) = libm::sincos(step * k as f64);
                            let place = [cu + du * cos - dv * sin, cv + du * sin + dv * cos];
                            (0..holes.len()).find(|h| alike(a, *h) && near(*h, place))
                        })
                        .collect();
                    let chain: Option<Vec<usize>> = around.into_iter().collect();
                    if let Some(chain) = chain {
                        let chord = 2.0 * circle.radius_mm * libm::sin(0.5 * step);
                        let diameter = Some(2.0 * circle.radius_mm);
                        found.push(told(holes, &chain, Along::Circle, chord, diameter));
                    }
                }
            }
        }
    }
}
