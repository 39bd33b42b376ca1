//! A motion made to fit: that which leaves samples the least off the profile it sweeps.

use nalgebra::{SMatrix, SVector};
use shapes::{MOST_FREE, Sample, Sweep};

use super::stations::Profile;

/// Most of a turn in one step, radians: farther, slopes are others.
const MOST_TURN: f64 = 0.1;
/// Change of the deviation, relative, at which it has settled.
const SETTLED: f64 = 1e-3;
/// What is added to a number that the samples hardly tell, of what they tell at most of any.
const DAMPING: f64 = 1e-9;
/// Times that a step which makes nothing better is halved.
const HALVINGS: usize = 4;
/// Samples of each bin.
const PER_BIN: f64 = 12.0;

/// The motion after at most so many steps of Gauss and Newton, and the deviation of samples about
/// its profile in bins of this width.
pub(super) fn refined(
    sweep: Sweep,
    samples: &[Sample],
    width_mm: f64,
    steps: usize,
) -> Option<(Sweep, f64)> {
    let mut now = (sweep, Profile::of(&sweep, samples, width_mm, PER_BIN)?);
    for _ in 0..steps {
        let Some(mut step) = step(&now.0, &now.1, samples) else {
            break;
        };
        let mut better = None;
        for _ in 0..HALVINGS {
            better = now
                .0
                .moved(&step)
                .and_then(|sweep| Some((sweep, Profile::of(&sweep, samples, width_mm, PER_BIN)?)))
                .filter(|(_, profile)| profile.deviation < now.1.deviation);
            if better.is_some() {
                break;
            }
            step = step.map(|number| 0.5 * number);
        }
        let Some(better) = better else { break };
        let is_settled = better.1.deviation > (1.0 - SETTLED) * now.1.deviation;
        now = better;
        if is_settled {
            break;
        }
    }
    Some((now.0, now.1.deviation))
}

/// The step that linearised offs ask for.
fn step(sweep: &Sweep, profile: &Profile, samples: &[Sample]) -> Option<[f64; MOST_FREE]> {
    let mut matrix = SMatrix::<f64, MOST_FREE, MOST_FREE>::zeros();
    let mut right = SVector::<f64, MOST_FREE>::zeros();
    for (by, off, weight) in profile.equations(sweep, samples) {
        let by = SVector::from(by);
        matrix += by * by.transpose() * weight;
        right -= by * (off * weight);
    }
    for k in sweep.freedom()..MOST_FREE {
        matrix[(k, k)] = 1.0;
    }
    // Turns and shifts differ by orders of magnitude.
    let scale =
        SVector::<f64, MOST_FREE>::from_fn(|k, _| matrix[(k, k)].max(1e-300).sqrt().recip());
    let scaled = SMatrix::<f64, MOST_FREE, MOST_FREE>::from_fn(|i, j| {
        let damping = if i == j { DAMPING } else { 0.0 };
        matrix[(i, j)] * scale[i] * scale[j] + damping
    });
    let solved = scaled.cholesky()?.solve(&right.component_mul(&scale));
    let step: [f64; MOST_FREE] = solved.component_mul(&scale).into();
    let turn = step[0].abs().max(step[1].abs());
    let share = (MOST_TURN / turn.max(f64::MIN_POSITIVE)).min(1.0);
    step.iter()
        .all(|number| number.is_finite())
        .then(|| step.map(|number| share * number))
}
