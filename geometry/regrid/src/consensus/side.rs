//! On which side of the line between two surfaces a node lies.

use crate::solve::solve;

/// A sample of one of the two surfaces, as seen from the node, in local spacings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Labelled {
    pub(crate) u: f64,
    pub(crate) v: f64,
    /// 1 for a sample of the first surface, -1 for one of the second.
    pub(crate) label: f64,
}

/// How much a steeper transition costs against samples on the wrong side: so little that
/// between sets which a line separates the widest lane is found.
const RIDGE: f64 = 1e-4;
/// Newton's steps; each about doubles the steepness between separable sets.
const STEPS: usize = 16;
/// Share of samples on the wrong side up to which the edge is taken for straight.
const STRAIGHT: f64 = 0.015;
/// Share of either set on the wrong side beyond which no line separates them.
const MIXED: f64 = 0.4;
/// The nearer samples are one in so many, nearest first. They suffice where they show the
/// node to be this many spacings from the edge, with no more than this share of either set
/// on the wrong side.
const NEARER: usize = 4;
const CLEAR: f64 = 1.2;
const CLEAN: f64 = 0.1;
/// Windows tried, each with half the samples of the one before.
const WINDOWS: usize = 3;

/// Signed distance of the node from the line that separates the two sets best, in local
/// spacings: positive on the side of the first. The line follows from logistic regression
/// over all samples, which come nearest first; where it leaves too many of them on the
/// wrong side, as at a bent edge or a corner, over the nearer half, and so on. `None` where
/// the two sets do not lie apart.
pub(crate) fn signed_distance(samples: &[Labelled], kept: &mut Vec<Labelled>) -> Option<f64> {
    // Far from the edge the nearer samples tell.
    let near = samples.get(..samples.len() / NEARER)?;
    if let Some(line) = logistic(near) {
        let length = (line[0] * line[0] + line[1] * line[1]).sqrt();
        let distance = line[2] / length;
        if distance.abs() > CLEAR
            && wrong_side(near, &line).1 <= CLEAN
            && wrong_side(samples, &line).1 <= MIXED
        {
            return Some(distance);
        }
    }
    let mut number = samples.len();
    let mut distance = None;
    for window in 0..WINDOWS {
        let near = samples.get(..number)?;
        let line = logistic(near)?;
        let (wrong, share) = wrong_side(near, &line);
        if share > MIXED {
            break;
        }
        distance = Some(line);
        if wrong as f64 <= (STRAIGHT * number as f64).max(1.0) {
            if wrong > 0 {
                // Outliers that agree by chance; the line is better known without.
                kept.clear();
                kept.extend(near.iter().filter(|s| s.label * at(&line, s) > 0.0));
                distance = logistic(kept).or(distance);
            }
            break;
        }
        number /= 2;
        if window + 1 < WINDOWS && number < 16 {
            break;
        }
    }
    let line = distance?;
    let length = (line[0] * line[0] + line[1] * line[1]).sqrt();
    (length > 0.0).then(|| line[2] / length)
}

fn at(line: &[f64; 3], s: &Labelled) -> f64 {
    line[0] * s.u + line[1] * s.v + line[2]
}

/// How many samples lie on the wrong side, and the larger share of both sets.
fn wrong_side(samples: &[Labelled], line: &[f64; 3]) -> (usize, f64) {
    let (mut wrong, mut all) = ([0_usize; 2], [0_usize; 2]);
    for s in samples {
        let set = usize::from(s.label > 0.0);
        all[set] += 1;
        wrong[set] += usize::from(s.label * at(line, s) <= 0.0);
    }
    let share = |set: usize| wrong[set] as f64 / all[set].max(1) as f64;
    (wrong[0] + wrong[1], share(0).max(share(1)))
}

/// `g, h, o` so that `g u + h v + o` is the logarithm of the odds of the first surface.
fn logistic(samples: &[Labelled]) -> Option<[f64; 3]> {
    let mut line = [0.0; 3];
    for _ in 0..STEPS {
        // The second ridge keeps the system regular where all samples have one label.
        let mut hessian = [[RIDGE, 0.0, 0.0], [0.0, RIDGE, 0.0], [0.0, 0.0, 1e-9]];
        let mut gradient = [RIDGE * line[0], RIDGE * line[1], 0.0];
        for s in samples {
            let odds = s.label * at(&line, s);
            // Beyond this a sample's share in either sum is nothing.
            if odds > 20.0 {
                continue;
            }
            let wrong = 1.0 / (1.0 + libm::exp(odds));
            let slope = -s.label * wrong;
            let bend = wrong * (1.0 - wrong);
            gradient[0] += slope * s.u;
            gradient[1] += slope * s.v;
            gradient[2] += slope;
            hessian[0][0] += bend * s.u * s.u;
            hessian[1][0] += bend * s.v * s.u;
            hessian[1][1] += bend * s.v * s.v;
            hessian[2][0] += bend * s.u;
            hessian[2][1] += bend * s.v;
            hessian[2][2] += bend;
        }
        let step = solve(hessian, gradient)?;
        for (value, step) in line.iter_mut().zip(step) {
            *value -= step;
        }
    }
    line.iter().all(|v| v.is_finite()).then_some(line)
}
