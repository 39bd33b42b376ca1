//! Floors that run out in the face without a wall: where they meet it, and how deep they are.
//!
//! A sample beside such a rim does not tell on which side of it its ray passed: the floor is as high
//! as the face there. So the rim is where the floor's course across it, carried on, meets the face
//! (the paper names its edge points as the main cause of its deviations, section 7).

use nalgebra::{SMatrix, SVector};

use super::border_sides::side_of;
use crate::border::Border;
use crate::levels::{Bow, Sense};
use crate::outline::{Outline, Rectangle, Shape};
use crate::plane::Plane;
use crate::sight::Sight;

/// The deepest of a floor that sags, or the highest of a top that bulges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bowed {
    /// Its height above the plan, millimetres.
    pub end_mm: f64,
    /// Standard uncertainty of that.
    pub sigma_mm: f64,
}

/// Samples within so many pitches of the rim, and this share of the feature's width, tell its course
/// there ...
const REACH_PITCHES: f64 = 12.0;
const REACH_SHARE: f64 = 0.35;
/// ... but for the outermost, of which some may be the face's.
const LEAST_PITCHES: f64 = 0.3;
/// Along a side its ends are not asked, this share of its length at each.
const ENDS: f64 = 0.1;
/// A rim lies no more than so many pitches from where the regions end.
const FURTHEST_PITCHES: f64 = 6.0;
/// What is so deep already at the outline, standard deviations of samples and what it slants by within
/// a pitch, has a wall there.
const WALL_DEVIATIONS: f64 = 6.0;
/// No number of samples makes it surer than this share of a pitch.
const LEAST_SIGMA: f64 = 0.05;
/// The deepest is looked for in this share of the width, along this share of the length.
const MIDDLE: f64 = 0.7;
const ALONG: f64 = 0.5;
/// Fewest samples that are asked.
const FEWEST: usize = 20;
/// Numbers of a course. A quartic begins within 8 um where an arc does that is 8 mm wide and 60 degrees
/// steep at its rim, a cubic within 22.
const PARABOLA: usize = 3;
const QUARTIC: usize = 5;
const EDGED: usize = 4;
/// Rounds in which walls are moved to where quartics begin, and these fitted to what is within.
const ROUNDS_AT_RIM: usize = 2;

/// Takes the rim towards planes, which has no step, for one that goes up from what sags, and down from
/// what bulges. The plane that most of it is towards is the face that the floor runs out in: where the
/// feature ends at higher walls, too, it is not the one that it goes into.
pub(super) fn as_walls(sight: &Sight<'_>, bow: Bow, border: &mut Border) -> Option<Plane> {
    let levels = &sight.levels.levels;
    let mut counts = vec![0_usize; levels.len()];
    for pair in &mut border.pairs {
        let beyond = &levels[usize::from(pair.beyond)];
        if pair.sense == Sense::Level && beyond.is_plane && beyond.bow.is_none() {
            counts[usize::from(pair.beyond)] += 1;
            pair.sense = match bow {
                Bow::Sags => Sense::Rises,
                Bow::Bulges => Sense::Falls,
            };
        }
    }
    let all = (0..counts.len()).filter(|level| counts[*level] > 0);
    let most = all.max_by_key(|level| (counts[*level], std::cmp::Reverse(*level)))?;
    levels[most].plane
}

/// Moves an outline to where the floor meets the face, and tells how deep that is; `None` where too
/// little of it was seen. The border is as [`as_walls`] leaves it.
pub(super) fn settled(
    sight: &Sight<'_>,
    levels: &[u16],
    bow: Bow,
    (face, border): (&Plane, &Border),
    outline: &mut Outline,
) -> Option<Bowed> {
    // Beside a gentle rim noise has told which nodes are the face's: those of both are asked, by where
    // they are.
    let mut asked = levels.to_vec();
    let outermost = border.pairs.iter().filter(|pair| pair.outermost);
    asked.extend(outermost.map(|pair| pair.beyond).filter(|beyond| {
        let beyond = &sight.levels.levels[usize::from(*beyond)];
        beyond.is_plane && beyond.bow.is_none()
    }));
    let places: Vec<[f64; 3]> = sight
        .samples_of_levels(&|level| asked.contains(&level))
        .into_iter()
        .map(|[u, v, w]| {
            let at = sight.frame.world([u, v, w]);
            let off = (at.z - face.z_mm(at.x, at.y)) * sight.frame.axes[2].z;
            [u, v, bow.sign() * off]
        })
        .collect();
    let sample = Sampling {
        pitch_mm: sight.field.pitch_mm(),
        noise_mm: sight.sigma_mm(),
    };
    // Regions may end well within the rim, from where a parabola finds it better.
    move_to_rims::<PARABOLA>(&places, &sample, outline);
    for _ in 0..ROUNDS_AT_RIM {
        move_to_rims::<QUARTIC>(&places, &sample, outline);
    }
    let deepest = deepest(&places, &outline.shape, sample.noise_mm)?;
    let middle = outline.shape.middle_mm();
    let at = sight.frame.world([middle[0], middle[1], 0.0]);
    let face_mm = (face.z_mm(at.x, at.y) - at.z) * sight.frame.axes[2].z;
    Some(Bowed {
        end_mm: face_mm + bow.sign() * deepest.value_mm,
        sigma_mm: deepest.sigma_mm,
    })
}

/// How samples lie and stray.
struct Sampling {
    pitch_mm: f64,
    noise_mm: f64,
}

/// Moves the walls of an outline to where courses of so many numbers begin.
fn move_to_rims<const N: usize>(places: &[[f64; 3]], sample: &Sampling, outline: &mut Outline) {
    let before = outline.shape;
    let least_mm = LEAST_SIGMA * sample.pitch_mm;
    let variance = |rim: &Told| rim.sigma_mm * rim.sigma_mm + least_mm * least_mm;
    let reach_mm = |size_mm: f64| (REACH_SHARE * size_mm).min(REACH_PITCHES * sample.pitch_mm);
    match (&mut outline.shape, before) {
        (Shape::Circle(own), Shape::Circle(was)) => {
            let inwards = |place: [f64; 2]| Some(-before.distance_mm(place));
            let course = course(places, inwards, sample, reach_mm(2.0 * was.radius_mm));
            if let Some(rim) = rim::<N>(&course, sample) {
                own.radius_mm -= rim.value_mm;
                outline.covariance[2][2] = variance(&rim);
            }
        }
        (Shape::Rectangle(own), Shape::Rectangle(was)) => {
            for side in (0..4).filter(|side| was.walls[*side]) {
                let inwards = |place: [f64; 2]| inwards_mm(&was, side, place);
                let course = course(places, inwards, sample, reach_mm(was.sizes_mm()[side / 2]));
                let Some(rim) = rim::<N>(&course, sample) else {
                    continue;
                };
                let [low, high] = if side < 2 {
                    &mut own.first_mm
                } else {
                    &mut own.second_mm
                };
                if side.is_multiple_of(2) {
                    *low += rim.value_mm;
                } else {
                    *high -= rim.value_mm;
                }
                outline.covariance[1 + side][1 + side] = variance(&rim);
            }
        }
        _ => {}
    }
}

/// How far a place lies within a side, of those nearest to it and not at its ends.
fn inwards_mm(rectangle: &Rectangle, side: usize, place: [f64; 2]) -> Option<f64> {
    if side_of(rectangle, place) != side {
        return None;
    }
    let [a, b] = rectangle.along(place);
    let (own, other, along) = if side < 2 {
        (rectangle.first_mm, rectangle.second_mm, [a, b])
    } else {
        (rectangle.second_mm, rectangle.first_mm, [b, a])
    };
    let ends = ENDS * (other[1] - other[0]);
    let is_along = (other[0] + ends..other[1] - ends).contains(&along[1]);
    let off = if side.is_multiple_of(2) {
        along[0] - own[0]
    } else {
        own[1] - along[0]
    };
    is_along.then_some(off)
}

/// Depths over the way inwards from a rim.
fn course(
    places: &[[f64; 3]],
    inwards_mm: impl Fn([f64; 2]) -> Option<f64>,
    sample: &Sampling,
    reach_mm: f64,
) -> Vec<[f64; 2]> {
    places
        .iter()
        .filter_map(|[u, v, depth]| Some([inwards_mm([*u, *v])?, *depth]))
        .filter(|[inwards, _]| (LEAST_PITCHES * sample.pitch_mm..reach_mm).contains(inwards))
        .collect()
}

/// A length with its standard uncertainty.
struct Told {
    value_mm: f64,
    sigma_mm: f64,
}

/// Where a course begins: the nearest place to its rim at which its depth is none; of one that begins at
/// a wall, none.
fn rim<const N: usize>(course: &[[f64; 2]], sample: &Sampling) -> Option<Told> {
    let own = Course::<N>::fitted(course, sample.noise_mm, powers)?;
    let high = WALL_DEVIATIONS * sample.noise_mm + own.slope(0.0).max(0.0) * sample.pitch_mm;
    if own.value(0.0) > high {
        return None;
    }
    let mut at = 0.0;
    for _ in 0..30 {
        let slope = own.slope(at);
        if slope <= 0.0 {
            return None;
        }
        at -= (own.value(at) / slope).clamp(-sample.pitch_mm, sample.pitch_mm);
    }
    (at.abs() <= FURTHEST_PITCHES * sample.pitch_mm).then(|| Told {
        value_mm: at,
        sigma_mm: own.sigma(at) / own.slope(at),
    })
}

/// The greatest depth across the middle of the feature.
fn deepest(places: &[[f64; 3]], shape: &Shape, noise_mm: f64) -> Option<Told> {
    let (course, reach_mm): (Vec<[f64; 2]>, f64) = match shape {
        Shape::Circle(circle) => {
            let reach_mm = MIDDLE * circle.radius_mm;
            let far = |u: f64, v: f64| {
                let [du, dv] = [u - circle.centre_mm[0], v - circle.centre_mm[1]];
                (du * du + dv * dv).sqrt()
            };
            let own = places.iter().map(|[u, v, depth]| [far(*u, *v), *depth]);
            // Each to both sides: what turns about an axis is even.
            (
                own.flat_map(|[far, depth]| [[far, depth], [-far, depth]])
                    .collect(),
                reach_mm,
            )
        }
        Shape::Rectangle(own) => {
            let sizes = own.sizes_mm();
            let across = usize::from(sizes[1] < sizes[0]);
            let middle = own.along(own.middle_mm());
            let course = places
                .iter()
                .filter_map(|[u, v, depth]| {
                    let at = own.along([*u, *v]);
                    let along = (at[1 - across] - middle[1 - across]).abs();
                    (along < 0.5 * ALONG * sizes[1 - across])
                        .then_some([at[across] - middle[across], *depth])
                })
                .collect();
            (course, 0.5 * MIDDLE * sizes[across])
        }
    };
    let inner: Vec<[f64; 2]> = course
        .into_iter()
        .filter(|[off, _]| off.abs() < reach_mm)
        .collect();
    // Round across, or with an edge in the middle, as a V-groove has, or the tip of a cone.
    let round = Course::<QUARTIC>::fitted(&inner, noise_mm, powers)?;
    let edged = Course::<EDGED>::fitted(&inner, noise_mm, edged);
    match edged {
        Some(edged) if edged.left + CLEARLY < round.left => edged.greatest(reach_mm),
        _ => round.greatest(reach_mm),
    }
}

/// The powers of a share of the reach.
fn powers<const N: usize>(share: f64) -> SVector<f64, N> {
    SVector::from_fn(|power, _| libm::pow(share, power as f64))
}

/// Of two slants that meet in the middle, and a parabola.
fn edged(share: f64) -> SVector<f64, EDGED> {
    SVector::from([1.0, share, share.abs(), share * share])
}

/// Depth over a distance, as a sum of functions of it.
struct Course<const N: usize> {
    functions: fn(f64) -> SVector<f64, N>,
    values: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
    /// What is left of the samples, in variances of the noise.
    left: f64,
    scale_mm: f64,
}

/// Rounds in which what strays loses weight, and how many standard deviations away it has none.
const ROUNDS: usize = 8;
const STRAYS: f64 = 4.7;
/// A difference of what is left that is hardly ever by chance.
const CLEARLY: f64 = 25.0;
/// Of the scale, for slopes.
const STEP: f64 = 1e-4;

impl<const N: usize> Course<N> {
    /// Least squares, without what strays (Beaton & Tukey 1974).
    fn fitted(
        course: &[[f64; 2]],
        noise_mm: f64,
        functions: fn(f64) -> SVector<f64, N>,
    ) -> Option<Self> {
        if course.len() < FEWEST {
            return None;
        }
        let scale_mm = course.iter().map(|[at, _]| at.abs()).fold(0.0, f64::max);
        if scale_mm <= 0.0 {
            return None;
        }
        let mut deviation_mm = f64::INFINITY;
        let mut found: Option<Self> = None;
        for _ in 0..ROUNDS {
            let mut normal = SMatrix::<f64, N, N>::zeros();
            let mut right = SVector::<f64, N>::zeros();
            for [at, depth] in course {
                let off = found.as_ref().map_or(0.0, |own| depth - own.value(*at));
                let share = off / (STRAYS * deviation_mm);
                if share.abs() >= 1.0 {
                    continue;
                }
                let weight = (1.0 - share * share) * (1.0 - share * share);
                let own = functions(at / scale_mm);
                normal += own * own.transpose() * weight;
                right += own * (weight * depth);
            }
            let inverse = normal.try_inverse()?;
            let mut own = Self {
                functions,
                values: inverse * right,
                covariance: inverse,
                left: 0.0,
                scale_mm,
            };
            let offs = course
                .iter()
                .map(|[at, depth]| (depth - own.value(*at)).abs());
            let mut offs: Vec<f64> = offs.collect();
            own.left = offs
                .iter()
                .map(|off| (off / noise_mm).min(STRAYS).powi(2))
                .sum();
            // What the floor strays from its course by counts as noise does.
            deviation_mm = (crate::field::median(&mut offs)? / 0.6745).max(noise_mm);
            own.covariance *= deviation_mm * deviation_mm;
            found = Some(own);
        }
        found
    }

    fn value(&self, at: f64) -> f64 {
        (self.functions)(at / self.scale_mm).dot(&self.values)
    }

    /// The greatest depth within a reach to both sides.
    fn greatest(&self, reach_mm: f64) -> Option<Told> {
        let steps = 200_i32;
        let at = (-steps..=steps)
            .map(|k| reach_mm * f64::from(k) / f64::from(steps))
            .max_by(|a, b| self.value(*a).total_cmp(&self.value(*b)))?;
        Some(Told {
            value_mm: self.value(at),
            sigma_mm: self.sigma(at),
        })
    }

    fn slope(&self, at: f64) -> f64 {
        let step_mm = STEP * self.scale_mm;
        (self.value(at + step_mm) - self.value(at - step_mm)) / (2.0 * step_mm)
    }

    fn sigma(&self, at: f64) -> f64 {
        let own = (self.functions)(at / self.scale_mm);
        (own.transpose() * self.covariance * own)[0].max(0.0).sqrt()
    }
}
