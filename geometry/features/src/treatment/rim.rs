//! Rims and feet of candidates that may be treated: which face a section would run out in, how far it
//! reaches, and what is seen of it.

use super::places::{Face, Place};
use super::section::Strays;
use super::settle::{Edge, Known};
use crate::candidate::{Candidate, Lie, side_of};
use crate::levels::{AROUND, Strip};
use crate::outline::Shape;
use crate::sight::Sight;

/// Fewest samples that make a treatment.
const FEWEST: usize = 24;
/// Places across walls are so uncertain, shares of the pitch: the spot and the rays.
const BLUR: f64 = 0.03;
/// Noise is not taken to be smaller, shares of the pitch.
const LEAST_NOISE: f64 = 0.01;
/// What is looked at reaches into the face this much further than the strip, and so many pitches ...
const INTO_FACE: f64 = 1.2;
const FACE_PITCHES: f64 = 4.0;
/// ... and out of the outline as measured this much of its width, and so many pitches.
const OUT: f64 = 1.0;
const OUT_PITCHES: f64 = 3.0;
/// A strip runs along an outline where it is seen so near to it, pitches, in this share of as many
/// sectors about its middle.
const NEAR_PITCHES: f64 = 4.0;
const ALONG: f64 = 0.4;
const SECTORS: usize = 32;
/// Share of samples of a strip that may reach further than the strip.
const BEYOND: f64 = 0.03;
/// How well feet of walls are known by their tops, shares of the pitch.
const FOOT: f64 = 0.15;
/// And walls below broken edges, if they were taken for what they are.
const TOP: f64 = 0.1;
/// Where there is no strip: samples so far from the wall, pitches, lie neither on the face nor on
/// what is beyond by so many standard deviations, and there are as many as make this many rows along
/// the outline; fewer where a strip is seen along a part of it.
const BESIDE_PITCHES: core::ops::Range<f64> = 0.6..6.0;
const BETWEEN: f64 = 3.0;
const ROWS: f64 = 0.5;
const ROWS_BESIDE_STRIP: f64 = 0.2;
/// So far, pitches, such a section is taken to reach at least.
const HINTED_PITCHES: f64 = 4.0;

/// A rim or a foot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rim {
    /// Index of the candidate.
    pub(super) of: usize,
    /// The face that a section runs out in.
    pub(super) face: Face,
    /// Whether the section lies within the outline.
    is_inside: bool,
    /// The level of the face.
    level: u16,
    /// How far what is seen of the section reaches from the outline, millimetres.
    reach_mm: f64,
}

impl Rim {
    /// The rim, or foot, along which strips run; `None` where they do not.
    pub(super) fn of_strips(
        sight: &Sight<'_>,
        found: &[Candidate],
        of: usize,
        strips: &[Strip],
    ) -> Option<Self> {
        let first = strips.first()?;
        let rim = Self::at(sight, found, of, first.level, first.falls)?;
        let shape = found[of].outline.shape;
        let is_strip = |region: u16| strips.iter().any(|strip| strip.region == region);
        let seen = sight.samples(&is_strip);
        let near_mm = NEAR_PITCHES * sight.field.pitch_mm();
        if seen.len() < FEWEST || !runs_along(&seen, &shape, near_mm) {
            return None;
        }
        let offs = seen
            .iter()
            .map(|[u, v, _]| shape.distance_mm([*u, *v]).abs());
        rim.reaching(offs.collect())
    }

    /// The rim, or foot, where too many samples lie neither on the face nor beyond it, though nothing
    /// was segmented there, or not all along: amid much noise sections are narrower than regions can be.
    pub(super) fn hinted(
        sight: &Sight<'_>,
        found: &[Candidate],
        of: usize,
        falls: bool,
        has_strip: bool,
    ) -> Option<Self> {
        let candidate = &found[of];
        let own = *candidate.levels.first()?;
        let (face, beyond) = match (candidate.lie, falls) {
            (Lie::Body, false) => return None,
            (Lie::Body | Lie::Raised, true) | (Lie::Hollow, false) => (own, candidate.host),
            (Lie::Hollow, true) | (Lie::Raised, false) => (candidate.host, own),
        };
        // What rises from a floor that is no plane, such as a drill's cone, is that floor.
        let is_floor = sight.levels.levels.get(usize::from(face))?.is_plane;
        if face == AROUND || (!falls && !is_floor) {
            return None;
        }
        let rim = Self::at(sight, found, of, face, falls)?;
        let pitch_mm = sight.field.pitch_mm();
        let shape = candidate.outline.shape;
        let within = BETWEEN * sight.field.noise_mm;
        let deepest = sight.levels.levels.get(usize::from(beyond))?.plane;
        let depth_mm = deepest.map_or(f64::INFINITY, |plane| {
            let [x, y] = plane.middle_mm;
            (plane.z_mm(x, y) - rim.face.plane.z_mm(x, y)).abs()
        });
        let is_beside = |place: [f64; 2]| {
            let off = shape.distance_mm(place).abs() / pitch_mm;
            BESIDE_PITCHES.contains(&off) && Self::is_wall(&shape, place)
        };
        let own = rim.levels(sight, found);
        let is_own = |level: u16| own[usize::from(level)];
        let offs: Vec<f64> = rim
            .face
            .samples(sight, &is_own, &is_beside)
            .into_iter()
            .filter(|own| (within..depth_mm - within).contains(&own.height_mm))
            .map(|own| shape.distance_mm(own.at).abs())
            .collect();
        let rows = if has_strip { ROWS_BESIDE_STRIP } else { ROWS };
        let least = rows * length_mm(&shape) / pitch_mm;
        if (offs.len() as f64) < least.max(FEWEST as f64) {
            return None;
        }
        let rim = rim.reaching(offs)?;
        Some(Self {
            reach_mm: rim.reach_mm.max(HINTED_PITCHES * pitch_mm),
            ..rim
        })
    }

    fn at(
        sight: &Sight<'_>,
        found: &[Candidate],
        of: usize,
        level: u16,
        falls: bool,
    ) -> Option<Self> {
        let plane = sight.levels.levels.get(usize::from(level))?.plane?;
        Some(Self {
            of,
            face: Face { plane, falls },
            // A face falls into a hollow outside of its outline; what stands out falls inside of its own.
            is_inside: (found[of].lie == Lie::Hollow) != falls,
            level,
            reach_mm: 0.0,
        })
    }

    fn reaching(self, mut offs: Vec<f64>) -> Option<Self> {
        offs.sort_by(f64::total_cmp);
        let last = offs.len().checked_sub(1)?;
        let reach_mm = offs[((1.0 - BEYOND) * last as f64) as usize];
        (reach_mm > 0.0).then_some(Self { reach_mm, ..self })
    }

    /// Of each level whether it counts: all but those of other candidates than the one whose edge it is
    /// and those that it runs out in and goes into.
    fn levels(&self, sight: &Sight<'_>, found: &[Candidate]) -> Vec<bool> {
        let (level, host) = (self.level, found[self.of].host);
        let mut counts = vec![true; sight.levels.levels.len()];
        for (index, other) in found.iter().enumerate() {
            let is_own =
                index == self.of || other.levels.contains(&level) || other.levels.contains(&host);
            if !is_own {
                for own in &other.levels {
                    counts[usize::from(*own)] = false;
                }
            }
        }
        counts
    }

    /// Whether the side that a place is beside is a wall.
    fn is_wall(shape: &Shape, place: [f64; 2]) -> bool {
        match shape {
            Shape::Circle(_) => true,
            Shape::Rectangle(own) => own.walls[side_of(own, place)],
        }
    }

    /// What is seen on both sides of the wall.
    pub(super) fn edge(&self, sight: &Sight<'_>, found: &[Candidate]) -> Option<Edge> {
        let shape = found[self.of].outline.shape;
        let pitch_mm = sight.field.pitch_mm();
        let noise_mm = sight.field.noise_mm;
        let into = self.reach_mm * (1.0 + INTO_FACE) + FACE_PITCHES * pitch_mm;
        let out = OUT * self.reach_mm + OUT_PITCHES * pitch_mm;
        let is_wanted = |place: [f64; 2]| {
            let off = shape.distance_mm(place);
            let within = if self.is_inside { -off } else { off };
            (-out..into).contains(&within) && Self::is_wall(&shape, place)
        };
        let own = self.levels(sight, found);
        let is_own = |level: u16| own[usize::from(level)];
        let mut places = self.face.samples(sight, &is_own, &is_wanted);
        // What stands on the face tells nothing of its edge.
        places.retain(|place| place.height_mm > -6.0 * noise_mm);
        if places.len() < FEWEST {
            return None;
        }
        let heights = places.iter().map(|own: &Place| own.height_mm);
        let deepest = heights.fold(0.0, f64::max);
        places.extend(self.face.missing(sight, &is_own, &is_wanted));
        Some(Edge {
            outline: shape,
            is_inside: self.is_inside,
            reach_mm: self.reach_mm,
            known: if self.face.falls {
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
}

/// Length of an outline.
fn length_mm(shape: &Shape) -> f64 {
    match shape {
        Shape::Circle(own) => core::f64::consts::TAU * own.radius_mm,
        Shape::Rectangle(own) => 2.0 * own.sizes_mm().iter().sum::<f64>(),
    }
}

/// Whether samples lie all along an outline.
fn runs_along(seen: &[[f64; 3]], shape: &Shape, near_mm: f64) -> bool {
    let middle = shape.middle_mm();
    let mut has = [false; SECTORS];
    let is_near = |[u, v, _]: &&[f64; 3]| shape.distance_mm([*u, *v]).abs() < near_mm;
    for [u, v, _] in seen.iter().filter(is_near) {
        let angle = libm::atan2(v - middle[1], u - middle[0]) / core::f64::consts::TAU + 0.5;
        has[((angle * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
    }
    has.iter().filter(|own| **own).count() as f64 >= ALONG * SECTORS as f64
}
