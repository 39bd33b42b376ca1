//! Sections of candidates, for their codes.

use crate::candidate::{Candidate, Lie};
use crate::code::{End, Section};
use crate::levels::AROUND;
use crate::outline::Shape;
use crate::sight::Sight;

/// Lines tried beside each other, over the middle half of the candidate.
const LINES: usize = 7;
/// A section goes on beyond the outline by this share of its length, and by so many pitches.
const BEYOND_SHARE: f64 = 0.2;
const BEYOND_PITCHES: (f64, f64) = (4.0, 8.0);

/// Points of a section, and what lies at its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    /// (s, z) in the order along it, millimetres.
    pub points: Vec<[f64; 2]>,
    /// What it ends in.
    pub ends: [End; 2],
}

impl Cut {
    /// As the coder takes it.
    #[must_use]
    pub fn section(&self, sight: &Sight<'_>) -> Section<'_> {
        Section {
            points: &self.points,
            noise_mm: sight.field.noise_mm,
            pitch_mm: sight.field.image.pitch_mm(),
            ends: self.ends,
        }
    }
}

/// The section that shows a candidate best: across its walls, where it meets the least of other
/// features. What these take away within the outline is put back.
#[must_use]
pub fn section(sight: &Sight<'_>, candidate: &Candidate) -> Option<Cut> {
    let across = Across::of(candidate);
    let least = -0.25 * across.breadth_mm;
    let step = 0.5 * across.breadth_mm / (LINES - 1) as f64;
    (0..LINES)
        .map(|line| cut(sight, candidate, &across, least + step * line as f64))
        .max_by_key(|(own, _)| *own)
        .map(|(_, cut)| cut)
        .filter(|cut| cut.points.len() >= 2)
}

/// The way a section goes.
struct Across {
    middle_mm: [f64; 2],
    along: [f64; 2],
    length_mm: f64,
    breadth_mm: f64,
    ends: [End; 2],
}

impl Across {
    fn of(candidate: &Candidate) -> Self {
        match candidate.outline.shape {
            Shape::Circle(circle) => Self {
                middle_mm: circle.centre_mm,
                along: [1.0, 0.0],
                length_mm: 2.0 * circle.radius_mm,
                breadth_mm: circle.radius_mm,
                ends: [End::Rim; 2],
            },
            Shape::Rectangle(rectangle) => {
                let [first, second] = rectangle.sizes_mm();
                let [a, b, c, d] = rectangle.walls;
                let walls = [
                    usize::from(a) + usize::from(b),
                    usize::from(c) + usize::from(d),
                ];
                // Across as many walls as can be; of two such ways the shorter.
                let is_first = (walls[0], second) > (walls[1], first) && walls[0] >= walls[1];
                let (sin, cos) = libm::sincos(rectangle.angle_rad);
                let (along, length_mm, breadth_mm) = if is_first {
                    ([cos, sin], first, second)
                } else {
                    ([-sin, cos], second, first)
                };
                Self {
                    middle_mm: rectangle.middle_mm(),
                    along,
                    length_mm,
                    breadth_mm,
                    ends: [End::Rim; 2],
                }
            }
        }
    }
}

/// One section, and how many of its points are the candidate's own.
fn cut(sight: &Sight<'_>, candidate: &Candidate, across: &Across, beside_mm: f64) -> (usize, Cut) {
    let image = &sight.field.image;
    let pitch = image.pitch_mm();
    let beyond =
        (BEYOND_SHARE * across.length_mm).clamp(BEYOND_PITCHES.0 * pitch, BEYOND_PITCHES.1 * pitch);
    let half = 0.5 * across.length_mm + beyond;
    let count = (2.0 * half / pitch).ceil() as usize;
    let mut places: Vec<Place> = Vec::with_capacity(count + 1);
    let mut own = 0;
    for k in 0..=count {
        let s = -half + 2.0 * half * k as f64 / count as f64;
        let place = [
            across.middle_mm[0] + across.along[0] * s - across.along[1] * beside_mm,
            across.middle_mm[1] + across.along[1] * s + across.along[0] * beside_mm,
        ];
        let point = sight.frame.world([place[0], place[1], 0.0]);
        let beyond_mm = candidate.outline.shape.distance_mm(place);
        let node = sight.regions.node(image, point.x, point.y);
        let level = node.map_or(AROUND, |node| sight.levels.labels[node]);
        let is_inside = beyond_mm < -0.5 * pitch;
        let is_own = candidate.levels.contains(&level);
        own += usize::from(is_own);
        let height = match node {
            _ if is_inside && candidate.bowed.is_some() => bowed(sight, candidate, place),
            _ if is_inside && (!is_own || candidate.tip.is_some()) => {
                floor(sight, candidate, point.x, point.y)
            }
            Some(node) => face(sight, node, point.x, point.y)
                .or_else(|| sight.regions.height_mm(image, node))
                .or_else(|| unseen(sight, candidate)),
            None => unseen(sight, candidate),
        };
        if let Some(z_mm) = height {
            places.push(Place {
                point: [s, z_mm],
                level,
                is_rim: beyond_mm > RIM_PITCHES * pitch,
            });
        }
    }
    let middle = places.partition_point(|place| place.point[0] < 0.0);
    let (before, behind) = places.split_at_mut(middle);
    only_first_rim(before.iter_mut().rev());
    only_first_rim(behind.iter_mut());
    let points = places.iter().map(|place| place.point).collect();
    let ends = across.ends;
    (own, Cut { points, ends })
}

/// A place of a section.
struct Place {
    point: [f64; 2],
    level: u16,
    is_rim: bool,
}

/// So far beyond the outline a place is of the rim and not of the wall, pitches.
const RIM_PITCHES: f64 = 1.5;

/// Going outwards, what lies beyond the first level of the rim is another feature: that level goes
/// on in its place.
fn only_first_rim<'a>(outwards: impl Iterator<Item = &'a mut Place>) {
    let mut first: Option<(u16, f64)> = None;
    for place in outwards.filter(|place| place.is_rim) {
        let (level, z_mm) = *first.get_or_insert((place.level, place.point[1]));
        if place.level != level {
            place.point[1] = z_mm;
        }
    }
}

/// Chamfers and fillets are features of their own: their strips are put back to the faces and
/// floors that they are cut from.
fn face(sight: &Sight<'_>, node: usize, x_mm: f64, y_mm: f64) -> Option<f64> {
    let region = sight.regions.labels[node];
    let mut strips = sight.levels.strips.iter();
    let strip = strips.find(|strip| strip.region == region)?;
    let plane = sight.levels.levels[usize::from(strip.level)].plane?;
    Some(plane.z_mm(x_mm, y_mm))
}

/// Of what has no walls the section is that of the box around it: how its sides curve is not what
/// tells a groove from a pocket, and it may be too shallow for its sides to slant.
fn bowed(sight: &Sight<'_>, candidate: &Candidate, [u, v]: [f64; 2]) -> Option<f64> {
    let own = candidate.bowed?;
    Some(sight.frame.world([u, v, own.end_mm]).z)
}

/// The candidate's own floor at a place.
fn floor(sight: &Sight<'_>, candidate: &Candidate, x_mm: f64, y_mm: f64) -> Option<f64> {
    let level = candidate.levels.first()?;
    if let Some(tip) = candidate.tip {
        // What a drill leaves at the bottom is no floor to be told by.
        let [u, v, _] = sight.frame.local(nalgebra::Vector3::new(x_mm, y_mm, 0.0));
        return Some(sight.frame.world([u, v, tip.shoulder_mm]).z);
    }
    match sight.levels.levels[usize::from(*level)].plane.as_ref() {
        Some(plane) => Some(plane.z_mm(x_mm, y_mm)),
        None => unseen(sight, candidate),
    }
}

/// A floor that is not seen is taken to be as deep as the hollow is wide: a wall is all that its
/// code tells of it.
fn unseen(sight: &Sight<'_>, candidate: &Candidate) -> Option<f64> {
    let own = candidate.levels.first().copied().unwrap_or_default();
    let host = match candidate.lie {
        Lie::Body => sight.levels.levels[usize::from(own)].plane?,
        _ => sight.levels.levels[usize::from(candidate.host)].plane?,
    };
    let [x, y] = host.middle_mm;
    let size = match candidate.outline.shape {
        Shape::Circle(circle) => 2.0 * circle.radius_mm,
        Shape::Rectangle(rectangle) => {
            let [a, b] = rectangle.sizes_mm();
            a.min(b)
        }
    };
    let base = host.z_mm(x, y);
    let floor = sight.levels.levels[usize::from(own)].plane;
    let floor = floor.map_or(base, |plane| plane.z_mm(x, y));
    Some(base.min(floor) - size)
}
