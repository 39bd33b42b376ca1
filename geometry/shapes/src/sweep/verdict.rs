//! Whether samples that no simple shape explains speak for a surface of extrusion or revolution.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::fit::{Fitted, STEPS, SweptFit};
use super::motion::Sweep;
use super::motions::{Normal, motions};
use crate::evidence::{CAUTION, Scale, Surface, polynomials_of};
use crate::fit::Sample;
use crate::spread::spread;
use crate::start::Frame;

/// Fewest independent samples that a profile and a motion are looked for in.
const FEWEST: f64 = 400.0;
/// Blocks of samples whose planes give normals: the fewer, the better is each known, and the less does
/// it tell of what bends. And fewest samples of one.
const BLOCKS: [f64; 3] = [300.0, 150.0, 75.0];
const FEWEST_OF_BLOCK: usize = 8;
/// Deviations of the best polynomial beyond which samples have no say in these.
const STRAY: f64 = 4.0;
/// Samples by which a motion is found, and whether it may be one, and those by which it is held against
/// polynomials.
const SOME: usize = 1500;
const MANY: usize = 6000;
/// Spans of the profile, and steps, with the former.
const SOME_SPANS: usize = 10;
const SOME_STEPS: usize = 12;
/// What the former may leave, of what the best polynomial does, in deviations.
const MOST_LEFT: f64 = 1.5;
/// Spans of the profile that are tried with all samples.
const SPANS: [usize; 9] = [4, 6, 8, 12, 16, 24, 32, 48, 64];
/// So many in a row that are worse than the best tell that more spans will not be better.
const ENOUGH_WORSE: usize = 3;
/// By how much a swept surface must be better than the best polynomial: what is hardly told from a
/// free form is called one.
const DOUBT: f64 = 10.0;
/// Blocks along either side of the samples' plane in which they must not lie off together.
const SIDES: [f64; 4] = [6.0, 12.0, 24.0, 48.0];
/// Least samples of a block on average, and by how much all blocks that lie off may speak against a
/// surface.
const PER_BLOCK: f64 = 5.0;
const MOST_AGAINST: f64 = 10.0;
/// An axis that is known no better is none, radians.
const LEAST_KNOWN_RAD: f64 = 0.05;

/// The surface of extrusion or revolution that samples speak for, if they speak for one rather than
/// for a free form. `area` is that of [`crate::fit`].
#[must_use]
pub fn swept(samples: &[Sample], area: f64) -> Option<SweptFit> {
    let independent = samples.len() as f64 / area.max(1.0);
    if independent < FEWEST {
        return None;
    }
    let some_of = |count: usize| -> Vec<Sample> {
        spread(samples.len(), count).map(|k| samples[k]).collect()
    };
    let (many, some) = (some_of(MANY), some_of(SOME));
    let frame = Frame::of(&many)?;
    // Of these many: what they leave out is looked at, too, in blocks.
    let independent = many.len() as f64 / area.max(1.0);
    let mut scale = Scale {
        independent,
        surfaces: polynomials_of(&many, independent),
    };
    let polynomials = scale.surfaces.len();
    let told = scale
        .surfaces
        .iter()
        .map(|surface| (surface.deviation(), surface));
    let (least, nearest) = told.min_by(|a, b| a.0.total_cmp(&b.0))?;
    // A stray turns the plane of its block.
    let each = many.iter().zip(&nearest.off);
    let kept = each.filter(|(_, off)| off.abs() <= STRAY * least);
    let kept: Vec<Sample> = kept.map(|(sample, _)| *sample).collect();
    let mut found = Vec::new();
    for start in starts(&kept, &some, &frame) {
        let Some(first) = Fitted::of(&start.sweep, &some, SOME_SPANS, SOME_STEPS) else {
            continue;
        };
        if first.spline.deviation() > MOST_LEFT * least {
            continue;
        }
        found.extend(with_spans(first.sweep, &many, &mut scale));
    }
    let scored = scale.scored();
    let score = |k: usize| scored[k].0.score;
    let other = (0..polynomials).map(score).fold(f64::INFINITY, f64::min);
    let mut better: Vec<usize> = (polynomials..scored.len())
        .filter(|k| score(*k) + DOUBT <= other)
        .collect();
    better.sort_by(|a, b| score(*a).total_cmp(&score(*b)));
    // The best on the whole may have too few spans for some place with few samples.
    let is_good = |k: &usize| !are_off_together(&many, &found[*k], &frame, independent);
    let mut good = better.into_iter().map(|k| k - polynomials);
    let good = good.find(is_good)?;
    let fitted = found.swap_remove(good);
    let told = fitted.told(&many, area)?;
    (told.direction_rad.most() <= LEAST_KNOWN_RAD).then_some(told)
}

/// A motion with profiles of ever more spans, as long as these are better; all come onto the scale.
fn with_spans(mut sweep: Sweep, samples: &[Sample], scale: &mut Scale) -> Vec<Fitted> {
    let mut found = Vec::new();
    let (mut least, mut worse) = (f64::INFINITY, 0);
    for spans in SPANS {
        let Some(fitted) = Fitted::of(&sweep, samples, spans, STEPS) else {
            continue;
        };
        sweep = fitted.sweep;
        scale.surfaces.push(Surface {
            off: fitted.spline.offs.clone(),
            freedom: fitted.freedom(),
            fit: None,
        });
        found.push(fitted);
        let own = scale.scored().pop();
        let score = own.map_or(f64::INFINITY, |(own, _)| own.score);
        worse = if score < least { 0 } else { worse + 1 };
        least = least.min(score);
        if worse == ENOUGH_WORSE {
            break;
        }
    }
    found
}

/// The best of each kind of motion that normals tell, held against some of the samples.
fn starts(samples: &[Sample], some: &[Sample], frame: &Frame) -> Vec<Fitted> {
    let told = BLOCKS.map(|blocks| motions(&normals(samples, frame, blocks)));
    let all: Vec<Fitted> = told
        .into_iter()
        .flatten()
        .filter_map(|sweep| Fitted::of(&sweep, some, SOME_SPANS, 0))
        .collect();
    let mut best: Vec<Fitted> = Vec::new();
    for fitted in all {
        let is_same = |other: &&mut Fitted| other.sweep.motion == fitted.sweep.motion;
        match best.iter_mut().find(is_same) {
            Some(other) if fitted.spline.deviation() < other.spline.deviation() => *other = fitted,
            Some(_) => {}
            None => best.push(fitted),
        }
    }
    best
}

/// The planes of samples in so many blocks.
fn normals(samples: &[Sample], frame: &Frame, blocks: f64) -> Vec<Normal> {
    let side = 2.0 * frame.reach / blocks.sqrt();
    let mut blocks: BTreeMap<(i64, i64), Vec<Vector3<f64>>> = BTreeMap::new();
    for sample in samples {
        let [u, v, _] = frame.coordinates(&sample.point_mm);
        let block = ((u / side).floor() as i64, (v / side).floor() as i64);
        blocks.entry(block).or_default().push(sample.point_mm);
    }
    let normal = |points: &Vec<Vector3<f64>>| {
        if points.len() < FEWEST_OF_BLOCK {
            return None;
        }
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let mut spread = Matrix3::zeros();
        for point in points {
            spread += (point - middle) * (point - middle).transpose();
        }
        let eigen = nalgebra::SymmetricEigen::new(spread);
        let least = eigen.eigenvalues.imin();
        Some((middle, eigen.eigenvectors.column(least).into_owned()))
    };
    blocks.values().filter_map(normal).collect()
}

/// Whether samples of some places lie off a surface together, more than noise would let them.
fn are_off_together(samples: &[Sample], of: &Fitted, frame: &Frame, independent: f64) -> bool {
    let (offs, held) = (&of.spline.offs, &of.spline.held);
    let count = held.iter().sum::<f64>();
    let variance = of.spline.squares() / (count - of.freedom() as f64).max(1.0);
    let share = independent / samples.len() as f64;
    let price = libm::log(independent.max(2.0)) + CAUTION;
    let places: Vec<[f64; 2]> = samples
        .iter()
        .map(|sample| {
            let [u, v, _] = frame.coordinates(&sample.point_mm);
            [u / frame.reach, v / frame.reach]
        })
        .collect();
    SIDES.into_iter().any(|sides| {
        let mut blocks: BTreeMap<[i64; 2], (f64, f64)> = BTreeMap::new();
        for ((place, off), held) in places.iter().zip(offs).zip(held) {
            let block = place.map(|at| (at * sides / 2.0).floor() as i64);
            let sums = blocks.entry(block).or_default();
            sums.0 += held;
            sums.1 += held * off;
        }
        if count < PER_BLOCK * blocks.len() as f64 {
            return false;
        }
        let against = blocks
            .values()
            .filter(|block| block.0 > 0.0)
            .map(|(count, sum)| (share * sum * sum / (count * variance) - price).max(0.0));
        against.sum::<f64>() > MOST_AGAINST
    })
}
