//! A section as a few straight pieces.

use super::Section;

/// From one point to another, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
    /// Without points between its ends, where levels change at once or behind a shadow.
    pub(super) is_jump: bool,
}

impl Piece {
    /// Along the section.
    pub(super) fn run_mm(&self) -> f64 {
        self.to[0] - self.from[0]
    }

    /// Up.
    pub(super) fn rise_mm(&self) -> f64 {
        self.to[1] - self.from[1]
    }
}

/// Points farther apart than so many pitches have a gap between them.
const GAP_PITCHES: f64 = 3.0;
/// Steeper than this, the change between two neighbours is no slope that was sampled: 70 degrees.
const JUMP_SLOPE: f64 = 2.747_477_419_454_622;
/// A step between neighbours that is as steep as this share of the one beside it is of its slope.
const SAME_SLOPE: f64 = 0.4;
/// Over a gap, this much is a wall that hides what is beside it: light comes in at no more than 63
/// degrees off the vertical.
const SHADOW_SLOPE: f64 = 0.5;
/// What differs by so many standard deviations from its neighbours is not one of them.
const OUTLIER_SIGMAS: f64 = 5.0;
/// Half the window that a point is compared with, pitches.
const WINDOW_PITCHES: f64 = 3.0;
/// A piece bends where a point is so many standard deviations off it.
const BEND_SIGMAS: f64 = 4.0;

/// What two levels must differ by to be two, millimetres.
pub(super) fn least_rise_mm(section: &Section<'_>) -> f64 {
    (6.0 * section.noise_mm).max(1e-9)
}

/// The pieces in order; jumps stand between pieces that were sampled.
pub(super) fn pieces(section: &Section<'_>) -> Vec<Piece> {
    let points = without_spikes(section);
    let jump_mm = least_rise_mm(section);
    let tolerance_mm = (BEND_SIGMAS * section.noise_mm).max(1e-6 + 0.05 * section.pitch_mm);
    let mut pieces = Vec::new();
    let mut begin = 0;
    for k in 1..=points.len() {
        let is_over = k == points.len();
        if !is_over && !is_jump(&points, k, jump_mm, section.pitch_mm) {
            continue;
        }
        lines(&points[begin..k], tolerance_mm, &mut pieces);
        if !is_over {
            pieces.push(Piece {
                from: points[k - 1],
                to: points[k],
                is_jump: true,
            });
        }
        begin = k;
    }
    pieces
}

/// Whether levels change at once between a point and the one before it.
fn is_jump(points: &[[f64; 2]], k: usize, jump_mm: f64, pitch_mm: f64) -> bool {
    let step = |k: usize| {
        let (a, b) = (points.get(k.wrapping_sub(1))?, points.get(k)?);
        Some((b[0] - a[0], b[1] - a[1]))
    };
    let Some((run, rise)) = step(k).map(|(run, rise)| (run, rise.abs())) else {
        return false;
    };
    if rise <= jump_mm {
        return false;
    }
    if pitch_mm <= 0.0 {
        return rise >= JUMP_SLOPE * run;
    }
    if run > GAP_PITCHES * pitch_mm {
        return rise >= SHADOW_SLOPE * run;
    }
    // A slope goes on beside it; a wall does not.
    let is_slope = |own: Option<(f64, f64)>| {
        own.is_some_and(|(own_run, own_rise)| {
            own_rise.abs() * run > SAME_SLOPE * rise * own_run && own_rise.abs() > 0.5 * jump_mm
        })
    };
    rise >= JUMP_SLOPE * run
        || rise >= run && !is_slope(step(k.wrapping_sub(1))) && !is_slope(step(k + 1))
}

/// Leaves out points that lie on neither side's level: outliers, and spots that saw two levels.
/// A median over the window leaves corners and slopes alone.
fn without_spikes(section: &Section<'_>) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = section.points.to_vec();
    points.retain(|point| point.iter().all(|own| own.is_finite()));
    let bound_mm = (OUTLIER_SIGMAS * section.noise_mm).max(0.05 * section.pitch_mm);
    let reach_mm = WINDOW_PITCHES * section.pitch_mm;
    let mut window = Vec::new();
    let is_kept = |k: usize, window: &mut Vec<f64>| {
        let [s, z] = points[k];
        let near = |&&[other, _]: &&[f64; 2]| (other - s).abs() <= 1.01 * reach_mm;
        window.clear();
        window.extend(points[..k].iter().rev().take_while(near).map(|own| own[1]));
        window.extend(points[k..].iter().take_while(near).map(|own| own[1]));
        if window.len() < 4 {
            return true;
        }
        window.sort_by(f64::total_cmp);
        let half = window.len() / 2;
        let (low, high) = if window.len() % 2 == 1 {
            (window[half], window[half])
        } else {
            (window[half - 1], window[half])
        };
        z >= low - bound_mm && z <= high + bound_mm
    };
    let kept: Vec<bool> = (0..points.len()).map(|k| is_kept(k, &mut window)).collect();
    let mut kept = kept.into_iter();
    points.retain(|_| kept.next().unwrap_or(true));
    points
}

/// Straight pieces through points, parted where one is farther off than the tolerance (Ramer;
/// Douglas & Peucker); the ends of each are on its own least-squares line.
fn lines(points: &[[f64; 2]], tolerance_mm: f64, pieces: &mut Vec<Piece>) {
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else {
        return;
    };
    if points.len() < 2 {
        return;
    }
    let length = libm::hypot(last[0] - first[0], last[1] - first[1]).max(f64::MIN_POSITIVE);
    let off = |point: &[f64; 2]| {
        let cross = (last[0] - first[0]) * (point[1] - first[1])
            - (last[1] - first[1]) * (point[0] - first[0]);
        (cross / length).abs()
    };
    let mut worst = (0.0, 0);
    for (k, point) in points.iter().enumerate() {
        let own = off(point);
        if own > worst.0 {
            worst = (own, k);
        }
    }
    if worst.0 > tolerance_mm && worst.1 > 0 && worst.1 + 1 < points.len() {
        lines(&points[..=worst.1], tolerance_mm, pieces);
        lines(&points[worst.1..], tolerance_mm, pieces);
        return;
    }
    let (from, to) = fitted(points, first, last);
    pieces.push(Piece {
        from,
        to,
        is_jump: false,
    });
}

/// Ends on the least-squares line z(s); the points themselves where s says too little.
fn fitted(points: &[[f64; 2]], first: [f64; 2], last: [f64; 2]) -> ([f64; 2], [f64; 2]) {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|own| own[axis]).sum::<f64>() / count;
    let (s, z) = (mean(0), mean(1));
    let moment = |axis: usize| {
        points
            .iter()
            .map(|own| (own[0] - s) * (own[axis] - [s, z][axis]))
            .sum::<f64>()
    };
    let (along, across) = (moment(0), moment(1));
    // A steep piece has its errors along s as well.
    if points.len() < 4 || along <= 0.0 || across.abs() > JUMP_SLOPE * along {
        return (first, last);
    }
    let at = |own: f64| [own, z + across / along * (own - s)];
    (at(first[0]), at(last[0]))
}
