//! Chamfers, rounds, fillets and countersinks: the slanting strips along the edges of features.

mod places;
mod section;
mod settle;

use crate::candidate::{Candidate, Lie, side_of};
use crate::levels::Strip;
use crate::outline::{Outline, Shape};
use crate::sight::Sight;
use places::Face;
use section::{Section, Strays};
use settle::{Edge, Form, Known, Settled};

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
}

/// Fewest samples that make a treatment.
const FEWEST: usize = 24;
/// Places across walls are so uncertain, shares of the pitch: the spot and the rays.
const BLUR: f64 = 0.03;
/// What is looked at reaches into the face this much further than the strip, and so many pitches ...
const INTO_FACE: f64 = 1.2;
const FACE_PITCHES: f64 = 4.0;
/// ... and out of the outline as measured this much of its width, and so many pitches.
const OUT: f64 = 1.0;
const OUT_PITCHES: f64 = 3.0;
/// A strip runs along an outline where it is seen in this share of as many sectors about its middle.
const ALONG: f64 = 0.4;
const SECTORS: usize = 32;
/// Share of samples of a strip that may reach further than the strip.
const BEYOND: f64 = 0.03;
/// Where a section is told, samples lie within so many standard deviations of it.
const EXPLAINED: f64 = 3.0;
/// How well feet of walls are known by their tops, shares of the pitch.
const FOOT: f64 = 0.15;
/// And walls below broken edges, if they were taken for what they are.
const TOP: f64 = 0.1;
/// Standard uncertainty of widths that no number of samples falls below, shares of the pitch: no edge
/// is made as exactly.
const LEAST_SIGMA: f64 = 0.03;

/// The treatments that the strips make, for each candidate and kind one. What is steep of a section
/// is hardly seen: the outlines of candidates are moved to where the sections say that walls are.
#[must_use]
pub fn treatments(sight: &Sight<'_>, found: &mut [Candidate]) -> Vec<Treatment> {
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
    let mut treated = Vec::new();
    for ((of, falls), strips) in groups {
        if let Some((own, outline)) = treatment(sight, found, of, falls, &strips) {
            found[of].outline = outline;
            treated.push(own);
        }
    }
    treated
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
) -> Option<(Treatment, Outline)> {
    let candidate = &found[of];
    let first = strips.first()?;
    let level = sight.levels.levels.get(usize::from(first.level))?;
    let plane = level.plane?;
    let edge = edge(sight, found, of, falls, strips)?;
    let is_hole = matches!(candidate.outline.shape, Shape::Circle(_)) && candidate.lie == Lie::Hollow;
    let arc = edge.settled(Form::Arc);
    let settled = match (falls, edge.settled(Form::Slant)) {
        (false, _) | (true, None) => arc?,
        (true, Some(slant)) => match arc {
            Some(arc) if arc.evidence(edge.places.len()) > slant.evidence(edge.places.len()) => arc,
            _ => slant,
        },
    };
    let kind = match (falls, settled.section) {
        (false, _) => Kind::Fillet,
        (true, Section::Arc(_)) => Kind::Round,
        (true, Section::Slant(..)) if is_hole => Kind::Countersink,
        (true, Section::Slant(..)) => Kind::Chamfer,
    };
    let middle = settled.outline.middle_mm();
    let at = sight.frame.world([middle[0], middle[1], 0.0]);
    let [own, _] = settled.sigmas_mm;
    let least = LEAST_SIGMA * sight.field.pitch_mm();
    let treatment = Treatment {
        kind,
        of,
        size_mm: settled.section.width_mm(),
        sigma_mm: (own * own + least * least).sqrt(),
        rise_mm: settled.section.rise_mm(),
        level_mm: (plane.z_mm(at.x, at.y) - at.z) * sight.frame.axes[2].z,
        score: explained(&edge, &settled),
    };
    let mut outline = candidate.outline;
    if falls {
        outline.shape = settled.outline;
        for (a, row) in settled.covariance.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                if *value != 0.0 {
                    outline.covariance[a][b] = *value;
                }
            }
        }
    }
    Some((treatment, outline))
}

/// The samples on both sides of a treated wall.
fn edge(
    sight: &Sight<'_>,
    found: &[Candidate],
    of: usize,
    falls: bool,
    strips: &[Strip],
) -> Option<Edge> {
    let candidate = &found[of];
    let shape = candidate.outline.shape;
    let pitch_mm = sight.field.pitch_mm();
    let noise_mm = sight.field.noise_mm;
    let first = strips.first()?;
    let plane = sight.levels.levels.get(usize::from(first.level))?.plane?;
    // A face falls into a hollow outside of its outline; what stands out falls inside of its own.
    let is_inside = (candidate.lie == Lie::Hollow) != falls;
    let is_strip = |region: u16| strips.iter().any(|strip| strip.region == region);
    let seen = sight.samples(&is_strip);
    if seen.len() < FEWEST || !runs_along(&seen, &shape) {
        return None;
    }
    let mut reaches: Vec<f64> = seen
        .into_iter()
        .map(|[u, v, _]| shape.distance_mm([u, v]).abs())
        .collect();
    reaches.sort_by(f64::total_cmp);
    let reach_mm = reaches[((1.0 - BEYOND) * (reaches.len() - 1) as f64) as usize];
    let into = INTO_FACE * reach_mm + FACE_PITCHES * pitch_mm;
    let out = OUT * reach_mm + OUT_PITCHES * pitch_mm;
    let others = levels_of_others(found, of, first.level);
    let is_wanted = |place: [f64; 2]| {
        let off = shape.distance_mm(place);
        let within = if is_inside { -off } else { off };
        let is_near = (-out..reach_mm + into).contains(&within);
        is_near
            && match shape {
                Shape::Circle(_) => true,
                Shape::Rectangle(own) => own.walls[side_of(&own, place)],
            }
    };
    let mut places = Face { plane, falls }.places(sight, &|level| !others.contains(&level), &is_wanted);
    // What stands on the face tells nothing of its edge.
    places.retain(|place| place.height_mm > -6.0 * noise_mm);
    if places.len() < FEWEST {
        return None;
    }
    let seen = places.iter().map(|own| own.height_mm);
    let deepest = seen.filter(|height| height.is_finite()).fold(0.0, f64::max);
    Some(Edge {
        outline: shape,
        is_inside,
        reach_mm,
        known: if falls {
            Known::Tailed(TOP * pitch_mm)
        } else {
            Known::Normal(FOOT * pitch_mm)
        },
        strays: Strays {
            noise_mm: noise_mm.max(LEAST_NOISE * pitch_mm),
            blur_mm: BLUR * pitch_mm,
            span_mm: deepest + 6.0 * noise_mm,
        },
        places,
    })
}

/// Whether samples lie all along an outline.
fn runs_along(seen: &[[f64; 3]], shape: &Shape) -> bool {
    let middle = shape.middle_mm();
    let mut has = [false; SECTORS];
    for [u, v, _] in seen {
        let angle = libm::atan2(v - middle[1], u - middle[0]) / core::f64::consts::TAU + 0.5;
        has[((angle * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
    }
    has.iter().filter(|own| **own).count() as f64 >= ALONG * SECTORS as f64
}

/// Noise is not taken to be smaller, shares of the pitch.
const LEAST_NOISE: f64 = 0.01;

/// Levels of other candidates than the one whose edge it is and the one whose face it runs out in.
fn levels_of_others(found: &[Candidate], of: usize, face: u16) -> Vec<u16> {
    let host = found[of].host;
    let is_other = |(index, own): &(usize, &Candidate)| {
        *index != of && !own.levels.contains(&face) && !own.levels.contains(&host)
    };
    let others = found.iter().enumerate().filter(is_other);
    others.flat_map(|(_, own)| own.levels.iter().copied()).collect()
}

/// Share of the samples between wall and face that lie on the section.
fn explained(edge: &Edge, settled: &Settled) -> f64 {
    let sign = if edge.is_inside { -1.0 } else { 1.0 };
    let (mut on, mut all) = (0_usize, 0_usize);
    for place in edge.places.iter().filter(|own| own.height_mm.is_finite()) {
        let height = place.height_mm;
        let distance = sign * settled.outline.distance_mm(place.at);
        if (0.0..settled.section.width_mm()).contains(&distance) {
            let (expected, slope) = settled.section.at(distance);
            let sigma = edge.strays.noise_mm + slope * edge.strays.blur_mm;
            all += 1;
            on += usize::from((height - expected).abs() <= EXPLAINED * sigma);
        }
    }
    on as f64 / all.max(1) as f64
}
