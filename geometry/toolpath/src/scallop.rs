//! Finishing passes between which cusps are as high as asked for all along.
//!
//! The centre of a ball cutter moves on the surface's offset, whose heights are the tips' heights
//! shifted. Passes whose distance there is `D` leave cusps of `R - sqrt(R^2 - D^2 / 4)`, less what
//! the offset bulges between them. Each pass is grown from the one before: at every station it is
//! as far across as the nearest place of that pass allows. Where that one bends away, the notch of
//! the bend is farther from both than half their distance; there the new pass is drawn nearer, until
//! the cusp that both leave between them is no higher than it may be.

use range_image::Monitor;
use rayon::prelude::*;

use crate::between::Between;
use crate::cusp;
use crate::error::ToolpathError;
use crate::field::Field;
use crate::parallel::STEEP;
use crate::simplify::simplified;

/// Rounds for the way to the next pass.
const ROUNDS: usize = 10;
/// Stations within the cutter's radius: passes bend sharply where the surface does.
const STATIONS: f64 = 24.0;
/// How near to the cusp's height that is, as a share of it.
const NEAR_ENOUGH: f64 = 0.004;
/// How far corners of a pass may be off it, as a share of the step on a level plane.
const SMOOTH: f64 = 0.003;

/// Rounds in which places of a new pass are drawn nearer, and the share of the wanted cusp from which
/// that is done.
const REPAIRS: usize = 6;
const TOO_HIGH: f64 = 1.02;

/// A place of a pass that the cutter mills.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) s: f64,
    pub(crate) t: f64,
    pub(crate) tip: Option<f64>,
}

type Lines = Vec<Vec<[f64; 2]>>;

/// Places the passes: for each the corners of its way as seen from above.
pub(crate) fn passes(
    field: &Field<'_>,
    cusp_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<Lines>, ToolpathError> {
    let level = cusp::level_step_mm(&field.cutter, cusp_mm).max(1e-3);
    let stations = field.stations(STATIONS);
    let Some([first, last]) = crate::parallel::limits(field, level, monitor)? else {
        return Ok(None);
    };
    let at = |s: f64, t: f64| Place {
        s,
        t,
        tip: field.tip_at(s, t),
    };
    let mut here: Vec<Place> = stations.par_iter().map(|s| at(*s, first)).collect();
    let mut lines = vec![corners(field, &here, level)];
    let most = ((last - first) / (level * STEEP * 0.25)).ceil() as usize + 2;
    crate::parallel::limit(((last - first) / (1.5 * level)) as usize)?;
    for _ in 0..most {
        monitor.check()?;
        crate::parallel::limit(lines.len())?;
        let done = here.iter().map(|p| p.t).fold(f64::INFINITY, f64::min);
        if done >= last {
            break;
        }
        monitor.progress((done - first) / (last - first));
        let window = (2.0 * level / (stations[1] - stations[0])).ceil() as usize + 2;
        let steps: Vec<Option<f64>> = (0..here.len())
            .into_par_iter()
            .map(|k| {
                let from = k.saturating_sub(window);
                let near = &here[from..(k + window + 1).min(here.len())];
                step(field, here[k], near, cusp_mm, level, last)
            })
            .collect();
        // Where the cutter mills nothing a pass keeps to its neighbours.
        let across = filled(&steps, level);
        let mut next: Vec<Place> = here
            .par_iter()
            .zip(&across)
            .map(|(place, step)| at(place.s, (place.t + step).min(last)))
            .collect();
        for _ in 0..REPAIRS {
            let between = Between {
                field,
                passes: [&here, &next],
                window,
            };
            let nearer: Vec<Option<Place>> = (0..here.len())
                .into_par_iter()
                .map(|k| {
                    let cusp = between.cusp_mm(k).filter(|c| *c > TOO_HIGH * cusp_mm)?;
                    let step = next[k].t - here[k].t;
                    let nearer = (step * (cusp_mm / cusp).sqrt()).max(level * STEEP);
                    (nearer < step).then(|| at(here[k].s, here[k].t + nearer))
                })
                .collect();
            if nearer.iter().all(Option::is_none) {
                break;
            }
            for (place, nearer) in next.iter_mut().zip(nearer) {
                *place = nearer.unwrap_or(*place);
            }
        }
        here = next;
        lines.push(corners(field, &here, level));
    }
    Ok(Some(lines))
}

/// How far the next pass is across; no less than what suits 75 degrees.
fn step(
    field: &Field<'_>,
    here: Place,
    near: &[Place],
    cusp_mm: f64,
    level: f64,
    last: f64,
) -> Option<f64> {
    here.tip?;
    let least = level * STEEP;
    let most = 3.0 * level;
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    let mut step = level;
    let mut told = None;
    for _ in 0..ROUNDS {
        let Some(cusp) = cusp_at(field, here, step.min(last - here.t).max(0.0), near) else {
            // The next place is beside the surface: the step stays what is known to be good.
            high = step;
            if step <= least {
                break;
            }
            step = f64::midpoint(low.max(least * 0.9), step);
            continue;
        };
        let is_last = here.t + step >= last;
        if (cusp - cusp_mm).abs() <= NEAR_ENOUGH * cusp_mm || (is_last && cusp <= cusp_mm) {
            return Some(step);
        }
        if cusp < cusp_mm {
            low = step;
        } else {
            high = step;
            if step <= least {
                return Some(least);
            }
        }
        told = Some(step);
        let wanted = step * (cusp_mm / cusp.max(1e-9)).sqrt();
        let next = if wanted > low && wanted < high {
            wanted
        } else if high.is_finite() {
            f64::midpoint(low, high)
        } else {
            2.0 * step
        };
        if low >= most {
            return Some(most);
        }
        step = next.clamp(least, most);
    }
    if low > 0.0 {
        Some(low)
    } else {
        told.map(|_| least)
    }
}

/// Height of the cusp between a place `step` across from a pass and that pass.
fn cusp_at(field: &Field<'_>, here: Place, step: f64, near: &[Place]) -> Option<f64> {
    let (s, t) = (here.s, here.t + step);
    let tip = field.tip_at(s, t)?;
    let radius = field.cutter.radius_mm();
    let (square, foot, slope) = nearest(near, [s, t, tip])?;
    let quarter = square / 4.0;
    if quarter >= radius * radius {
        return Some(f64::INFINITY);
    }
    let amid = field.tip_at(f64::midpoint(s, foot[0]), f64::midpoint(t, foot[1]))?;
    let bulge = amid - f64::midpoint(tip, foot[2]);
    let flat = libm::hypot(s - foot[0], t - foot[1]).max(1e-12);
    let rise = (tip - foot[2]) / flat;
    let nz = 1.0 / (1.0 + rise * rise + slope * slope).sqrt();
    Some(radius - (radius * radius - quarter).sqrt() - bulge * nz)
}

/// The place of a pass nearest to a tip: the square of the distance, the place, and the slope along
/// the pass there.
pub(crate) fn nearest(near: &[Place], [s, t, tip]: [f64; 3]) -> Option<(f64, [f64; 3], f64)> {
    let mut nearest: Option<(f64, [f64; 3], f64)> = None;
    for pair in near.windows(2) {
        let &[a, b] = pair else { continue };
        let (Some(za), Some(zb)) = (a.tip, b.tip) else {
            continue;
        };
        let along = [b.s - a.s, b.t - a.t, zb - za];
        let off = [s - a.s, t - a.t, tip - za];
        let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let share = (dot(along, off) / dot(along, along)).clamp(0.0, 1.0);
        let foot = [
            a.s + share * along[0],
            a.t + share * along[1],
            za + share * along[2],
        ];
        let away = [s - foot[0], t - foot[1], tip - foot[2]];
        let square = dot(away, away);
        if nearest.is_none_or(|(least, _, _)| square < least) {
            let slope = along[2] / (along[0] * along[0] + along[1] * along[1]).sqrt();
            nearest = Some((square, foot, slope));
        }
    }
    nearest
}

/// Steps where there are none, from the nearest stations that have one.
fn filled(steps: &[Option<f64>], level: f64) -> Vec<f64> {
    let known: Vec<(usize, f64)> = steps
        .iter()
        .enumerate()
        .filter_map(|(k, step)| step.map(|step| (k, step)))
        .collect();
    (0..steps.len())
        .map(|k| {
            let behind = known.partition_point(|(at, _)| *at < k);
            let beside = [behind.checked_sub(1), Some(behind)];
            let beside = beside.into_iter().flatten().filter_map(|i| known.get(i));
            let nearest = beside.min_by_key(|(at, _)| at.abs_diff(k));
            nearest.map_or(level, |(_, step)| *step)
        })
        .collect()
}

/// The corners of a pass, few where it is straight.
fn corners(field: &Field<'_>, places: &[Place], level: f64) -> Vec<[f64; 2]> {
    let all: Vec<[f64; 2]> = places.iter().map(|p| field.place(p.s, p.t)).collect();
    simplified(&all, SMOOTH * level)
}
