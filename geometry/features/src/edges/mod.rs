//! Edge points (Jun & Park, section 4.1): sharp ones, where the tangent of a scan line, or the line
//! itself, is discontinuous; smooth ones, where its curvature changes at once.
//!
//! At each place between two points, parabolas are fitted to those before it and those behind it;
//! their heights, tangents and curvatures there are compared with what noise makes of them. Windows
//! of several sizes are tried, and the one that is surest counts, if both parabolas lie as close to
//! their points as the noise lets them.

mod fit;
mod lines;

pub use lines::edges_of_columns;

use fit::{Fit, parabola};

/// What an edge point is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeKind {
    /// The tangent turns, or the height jumps.
    Sharp,
    /// The curvature changes at once, as where a fillet begins.
    Smooth,
}

/// What counts as an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSettings {
    /// Standard deviation of z, millimetres; above 0.
    pub noise_mm: f64,
    /// The tangent turns by this at a sharp edge at least, radians.
    pub least_turn: f64,
    /// The curvature changes by this at a smooth edge at least, per millimetre.
    pub least_curvature: f64,
    /// Changes are so many times their standard deviation at least.
    pub significance: f64,
}

impl EdgeSettings {
    /// Turns of 20 degrees, radii up to 50 mm, 6 standard deviations.
    #[must_use]
    pub fn new(noise_mm: f64) -> Self {
        Self {
            noise_mm,
            least_turn: 20.0_f64.to_radians(),
            least_curvature: 0.02,
            significance: 6.0,
        }
    }
}

/// Points on either side of a place that parabolas are fitted to.
const WINDOWS: [usize; 6] = [5, 7, 10, 14, 20, 28];
/// Where an arc goes on, parabolas of more points than these end too far off it to tell of jumps.
const MOST_FOR_JUMPS: usize = 10;
/// Steeper than this between neighbours is a jump: 70 degrees.
const JUMP_SLOPE: f64 = 2.747_477_419_454_622;
/// A parabola fits where the mean square of its residuals is within so many standard deviations of
/// the noise's.
const FIT_SIGMAS: f64 = 2.5;
/// Noise is not taken to be smaller, millimetres: no curve is a parabola to less.
const LEAST_NOISE_MM: f64 = 0.001;

struct Candidate {
    kind: EdgeKind,
    /// The point that it is told of.
    point: usize,
    /// Between which it lies.
    before: usize,
    window: usize,
    significance: f64,
}

/// Edge points of one scan line: (u, z) with u along the line, not falling, and z the height, both
/// millimetres. For each point what edge it is, if any.
#[must_use]
pub fn edges(line: &[[f64; 2]], settings: &EdgeSettings) -> Vec<Option<EdgeKind>> {
    let noise_mm = settings.noise_mm.max(LEAST_NOISE_MM);
    let mut found = vec![None; line.len()];
    let usable = without_spikes(line, noise_mm);
    let points: Vec<[f64; 2]> = usable.iter().map(|&k| line[k]).collect();
    let mut begin = 0;
    for k in 1..=points.len() {
        let is_over = k == points.len();
        if !is_over && !is_jump(points[k - 1], points[k], noise_mm, settings.significance) {
            continue;
        }
        if !is_over {
            found[usable[k - 1]] = Some(EdgeKind::Sharp);
            found[usable[k]] = Some(EdgeKind::Sharp);
        }
        let run = &points[begin..k];
        for (point, kind) in along(run, settings, noise_mm) {
            let place = &mut found[usable[begin + point]];
            *place = place.or(Some(kind));
        }
        begin = k;
    }
    found
}

fn is_jump(a: [f64; 2], b: [f64; 2], noise_mm: f64, significance: f64) -> bool {
    let rise = (b[1] - a[1]).abs();
    rise > significance * core::f64::consts::SQRT_2 * noise_mm && rise > JUMP_SLOPE * (b[0] - a[0])
}

/// Points that are finite and lie between what their neighbours say: no outliers.
fn without_spikes(line: &[[f64; 2]], noise_mm: f64) -> Vec<usize> {
    const REACH: usize = 3;
    let finite: Vec<usize> = (0..line.len())
        .filter(|&k| line[k].iter().all(|own| own.is_finite()))
        .collect();
    let is_kept = |&(place, &k): &(usize, &usize)| {
        let low = place.saturating_sub(REACH);
        let high = (place + REACH + 1).min(finite.len());
        if high - low < 2 * REACH + 1 {
            return true;
        }
        let mut heights = [0.0; 2 * REACH + 1];
        for (own, &other) in heights.iter_mut().zip(&finite[low..high]) {
            *own = line[other][1];
        }
        heights.sort_by(f64::total_cmp);
        (line[k][1] - heights[REACH]).abs() <= 6.0 * noise_mm
            // On a slope the median is the point itself; at a peak of one it is a neighbour.
            || [place - 1, place + 1].iter().any(|&other| {
                (line[finite[other]][1] - line[k][1]).abs()
                    <= 6.0 * noise_mm + JUMP_SLOPE * (line[finite[other]][0] - line[k][0]).abs()
            })
    };
    let kept = finite.iter().enumerate().filter(is_kept);
    kept.map(|(_, &k)| k).collect()
}

/// Edges of a piece without jumps.
fn along(points: &[[f64; 2]], settings: &EdgeSettings, noise_mm: f64) -> Vec<(usize, EdgeKind)> {
    let mut candidates = Vec::new();
    for before in 0..points.len().saturating_sub(1) {
        let mut surest: [Option<Candidate>; 2] = [None, None];
        for window in WINDOWS {
            if before + 1 < window || before + 1 + window > points.len() {
                break;
            }
            let middle = 0.5 * (points[before][0] + points[before + 1][0]);
            let sides = [
                parabola(&points[before + 1 - window..=before], middle),
                parabola(&points[before + 1..=before + window], middle),
            ];
            let [Some(left), Some(right)] = sides else {
                continue;
            };
            let bound = 1.0 + FIT_SIGMAS * libm::sqrt(2.0 / (window - 3) as f64);
            if left.mean_square.max(right.mean_square) > bound * noise_mm * noise_mm {
                continue;
            }
            let tells_jumps = window <= MOST_FOR_JUMPS;
            let found = compare(&left, &right, settings, noise_mm, tells_jumps);
            for (place, (kind, significance)) in surest.iter_mut().zip(found) {
                let is_surer = place
                    .as_ref()
                    .is_none_or(|own| own.significance < significance);
                if significance > 0.0 && is_surer {
                    *place = Some(Candidate {
                        kind,
                        point: before + usize::from(nearer(&left, &right, points, before)),
                        before,
                        window,
                        significance,
                    });
                }
            }
        }
        candidates.extend(surest.into_iter().flatten());
    }
    strongest(candidates)
}

/// Whether the tangents meet nearer to the second of the two points.
fn nearer(left: &Fit, right: &Fit, points: &[[f64; 2]], before: usize) -> bool {
    let turn = right.slope - left.slope;
    let off = if turn == 0.0 {
        0.0
    } else {
        (left.height - right.height) / turn
    };
    let half = 0.5 * (points[before + 1][0] - points[before][0]);
    off.clamp(-half, half) > 0.0
}

/// How sure a sharp edge is, and a smooth one; 0 where there is none.
fn compare(
    left: &Fit,
    right: &Fit,
    settings: &EdgeSettings,
    noise_mm: f64,
    tells_jumps: bool,
) -> [(EdgeKind, f64); 2] {
    let sure = |change: f64, sigmas: [f64; 2], least: f64| {
        let sigma = noise_mm * libm::hypot(sigmas[0], sigmas[1]);
        let times = change.abs() / sigma;
        if change.abs() >= least && times >= settings.significance {
            times
        } else {
            0.0
        }
    };
    let turn = libm::atan(right.slope) - libm::atan(left.slope);
    // Of the angle: the slope's, less steep ones counting for more.
    let sigma_of_angle = |fit: &Fit| fit.sigmas[1] / (1.0 + fit.slope * fit.slope);
    let turned = sure(
        turn,
        [sigma_of_angle(left), sigma_of_angle(right)],
        settings.least_turn,
    );
    let jumped = sure(
        right.height - left.height,
        [left.sigmas[0], right.sigmas[0]],
        settings.significance * noise_mm,
    );
    let bend = |fit: &Fit| {
        let length = libm::sqrt(1.0 + fit.middle_slope * fit.middle_slope);
        let scale = 1.0 / (length * length * length);
        (fit.second * scale, fit.sigmas[2] * scale)
    };
    let ((a, sigma_a), (b, sigma_b)) = (bend(left), bend(right));
    let bent = sure(b - a, [sigma_a, sigma_b], settings.least_curvature);
    [
        (
            EdgeKind::Sharp,
            if tells_jumps {
                turned.max(jumped)
            } else {
                turned
            },
        ),
        (EdgeKind::Smooth, bent),
    ]
}

/// Of candidates whose windows overlap by more than half, the surest; sharp ones first, since the
/// curvature of a window with a corner in it says nothing.
fn strongest(mut candidates: Vec<Candidate>) -> Vec<(usize, EdgeKind)> {
    candidates.sort_by(|a, b| {
        let is_smooth = |own: &Candidate| own.kind == EdgeKind::Smooth;
        is_smooth(a)
            .cmp(&is_smooth(b))
            .then(b.significance.total_cmp(&a.significance))
            .then(a.before.cmp(&b.before))
    });
    let mut taken: Vec<Candidate> = Vec::new();
    for own in candidates {
        let is_free = taken.iter().all(|other| {
            let reach = match (own.kind, other.kind) {
                (EdgeKind::Smooth, EdgeKind::Sharp) => own.window.max(other.window),
                _ => own.window.max(other.window) / 2,
            };
            own.before.abs_diff(other.before) > reach
        });
        if is_free {
            taken.push(own);
        }
    }
    taken.into_iter().map(|own| (own.point, own.kind)).collect()
}
