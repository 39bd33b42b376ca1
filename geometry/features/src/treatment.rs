//! Chamfers, rounds, fillets and countersinks: the slanting strips along the edges of features.

use crate::candidate::tip::line;
use crate::candidate::{Candidate, Lie};
use crate::field::median;
use crate::levels::Strip;
use crate::outline::Shape;
use crate::sight::Sight;

/// What a strip is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A slanting edge that falls away from a face.
    Chamfer,
    /// A rounded one.
    Round,
    /// A rounded foot, that rises from a floor to a wall.
    Fillet,
    /// The cone around a hole.
    Countersink,
}

impl Kind {
    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Chamfer => "chamfer",
            Self::Round => "round",
            Self::Fillet => "fillet",
            Self::Countersink => "countersink",
        }
    }
}

/// A treated edge of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Treatment {
    /// What it is.
    pub kind: Kind,
    /// Index of the candidate whose edge it is.
    pub of: usize,
    /// Width in the plan, of what slants, or radius, of what is round, millimetres.
    pub size_mm: f64,
    /// Its standard uncertainty.
    pub sigma_mm: f64,
    /// How far it reaches down from the face or up from the floor, millimetres.
    pub rise_mm: f64,
    /// Height of the face or floor that it runs out in, above the plan, millimetres.
    pub level_mm: f64,
    /// Share of its samples that it explains.
    pub score: f64,
    /// How far the edge lies beyond the outline as measured, away from the strip, millimetres: what
    /// is steep is hardly seen.
    pub beyond_mm: f64,
}

/// A strip is round where places lie nearer to an arc than this times their distance from a line.
const ROUND: f64 = 0.95;
/// Holes are countersunk more often than rounded.
const ROUND_HOLE: f64 = 0.6;
/// Radii and starts of arcs that are tried.
const RADII: usize = 60;
const STARTS: usize = 24;
/// Of so many samples at most arcs are told.
const MOST: usize = 4000;
/// Fewest samples that make a treatment.
const FEWEST: usize = 24;

/// The treatments that the strips make, for each candidate and kind one.
#[must_use]
pub fn treatments(sight: &Sight<'_>, found: &[Candidate]) -> Vec<Treatment> {
    let mut groups: Vec<((usize, bool), Vec<Strip>)> = Vec::new();
    for strip in &sight.levels.strips {
        let Some(of) = owner(sight, found, strip) else {
            continue;
        };
        let key = (of, strip.falls);
        match groups.iter_mut().find(|(own, _)| *own == key) {
            Some((_, strips)) => strips.push(*strip),
            None => groups.push((key, vec![*strip])),
        }
    }
    groups.sort_by_key(|(key, _)| *key);
    groups
        .iter()
        .filter_map(|((of, falls), strips)| treatment(sight, found, *of, *falls, strips))
        .collect()
}

/// The candidate whose edge a strip runs along: a hollow in the face that it falls from, or that
/// face's own.
fn owner(sight: &Sight<'_>, found: &[Candidate], strip: &Strip) -> Option<usize> {
    let regions = sight.regions;
    let mut beside = vec![0_usize; sight.levels.levels.len()];
    for node in 0..regions.labels.len() {
        if regions.labels[node] != strip.region {
            continue;
        }
        for other in regions.neighbours(node) {
            let level = sight.levels.labels[other];
            if level != strip.level {
                beside[usize::from(level)] += 1;
            }
        }
    }
    let holder = |level: u16| found.iter().position(|c| c.levels.contains(&level));
    let own = holder(strip.level)?;
    let most = (0..beside.len())
        .filter(|k| beside[*k] > 0)
        .max_by_key(|k| beside[*k]);
    let other = most.and_then(|k| holder(u16::try_from(k).ok()?));
    let Some(other) = other.filter(|other| *other != own) else {
        return Some(own);
    };
    let goes_into = found[other].host != 0 && found[own].levels.contains(&found[other].host);
    let is_others = match (strip.falls, found[other].lie) {
        // Falls into a hollow of its face, or rises to what stands on its floor.
        (true, Lie::Hollow) | (false, Lie::Raised) => goes_into,
        _ => false,
    };
    Some(if is_others { other } else { own })
}

fn treatment(
    sight: &Sight<'_>,
    found: &[Candidate],
    of: usize,
    falls: bool,
    strips: &[Strip],
) -> Option<Treatment> {
    let candidate = &found[of];
    let level = sight
        .levels
        .levels
        .get(usize::from(strips.first()?.level))?;
    let plane = level.plane?;
    // Distance from the outline, and height off the face or floor that it runs out in.
    let is_strip = |region: u16| strips.iter().any(|strip| strip.region == region);
    let places: Vec<(f64, f64)> = sight
        .samples(&is_strip)
        .into_iter()
        .map(|[u, v, w]| {
            let at = sight.frame.world([u, v, w]);
            let off = (at.z - plane.z_mm(at.x, at.y)) * sight.frame.axes[2].z;
            (candidate.outline.shape.distance_mm([u, v]).abs(), off.abs())
        })
        .collect();
    if places.len() < FEWEST {
        return None;
    }
    let fitted = line(&places, sight.field.noise_mm)?;
    let (at_outline, slope) = (fitted.at_zero, fitted.slope);
    if slope >= -0.1 {
        return None;
    }
    let width = -at_outline / slope;
    let few: Vec<(f64, f64)> = {
        let stride = places.len().div_ceil(MOST).max(1);
        places.iter().copied().step_by(stride).collect()
    };
    let arc = arc(&few);
    let straight = cost_of(&few, &|distance| (at_outline + slope * distance, slope));
    let share = match candidate.outline.shape {
        Shape::Circle(_) if candidate.lie == Lie::Hollow => ROUND_HOLE,
        _ => ROUND,
    };
    let is_round = arc.is_some_and(|arc| arc.cost < share * straight);
    let kind = match (falls, is_round) {
        (false, _) => Kind::Fillet,
        (true, true) => Kind::Round,
        (true, false) => match candidate.outline.shape {
            Shape::Circle(_) if candidate.lie == Lie::Hollow => Kind::Countersink,
            _ => Kind::Chamfer,
        },
    };
    let middle = candidate.outline.shape.middle_mm();
    let at = sight.frame.world([middle[0], middle[1], 0.0]);
    let level_mm = (plane.z_mm(at.x, at.y) - at.z) * sight.frame.axes[2].z;
    let score = fitted.count as f64 / places.len() as f64;
    match kind {
        Kind::Fillet | Kind::Round => {
            let arc = arc?;
            let step = 1.5 * arc.radius_mm / RADII as f64;
            let spread = 4.0 * arc.cost / (places.len() as f64).sqrt();
            Some(Treatment {
                kind,
                of,
                size_mm: arc.radius_mm,
                sigma_mm: (spread * spread + step * step).sqrt(),
                rise_mm: arc.radius_mm,
                level_mm,
                score,
                beyond_mm: -arc.start_mm,
            })
        }
        Kind::Chamfer | Kind::Countersink => Some(Treatment {
            kind,
            of,
            size_mm: width,
            sigma_mm: fitted.sigma_mm(width) / slope.abs(),
            rise_mm: at_outline,
            level_mm,
            score,
            beyond_mm: 0.0,
        }),
    }
}

/// An arc that is steep at the outline, and runs out in the face a radius away.
#[derive(Debug, Clone, Copy)]
struct Arc {
    radius_mm: f64,
    /// Where it is steep, millimetres beyond the outline as measured: what is steep is hardly seen.
    start_mm: f64,
    cost: f64,
}

/// Median distance of places from a curve, along its normal; told by height and slope.
fn cost_of(places: &[(f64, f64)], curve: &dyn Fn(f64) -> (f64, f64)) -> f64 {
    let mut sizes: Vec<f64> = places
        .iter()
        .map(|(distance, height)| {
            let (expected, slope) = curve(*distance);
            (height - expected).abs() / (1.0 + slope * slope).sqrt()
        })
        .collect();
    median(&mut sizes).unwrap_or(f64::INFINITY)
}

/// The quarter circle that places lie on, by the least median of their distances.
fn arc(places: &[(f64, f64)]) -> Option<Arc> {
    let widest = places.iter().map(|p| p.0).fold(0.0, f64::max);
    let mut best: Option<Arc> = None;
    for k in 0..=RADII {
        let radius_mm = widest * (0.5 + 1.5 * k as f64 / RADII as f64);
        for s in 0..=STARTS {
            let start_mm = radius_mm * (-0.3 + 0.4 * s as f64 / STARTS as f64);
            let cost = cost_of(places, &|distance| {
                let along = (radius_mm - (distance - start_mm)).clamp(0.0, radius_mm);
                let root = (radius_mm * radius_mm - along * along).max(1e-6).sqrt();
                (radius_mm - root, along / root)
            });
            if best.is_none_or(|best| cost < best.cost) {
                best = Some(Arc {
                    radius_mm,
                    start_mm,
                    cost,
                });
            }
        }
    }
    best
}
