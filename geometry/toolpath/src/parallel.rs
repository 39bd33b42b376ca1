//! Parallel finishing passes: each as far from the one before as the demanded cusp allows along most of
//! it. Where cusps would be higher, short passes are added later (see `mend`).

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::cusp::{self, Near};
use crate::error::ToolpathError;
use crate::field::Field;

/// Where the surface is steeper than this, z of its normal, passes are not drawn closer for it:
/// 75 degrees. Along a wall they would never come to an end.
pub(crate) const STEEP: f64 = 0.258_819;
/// The step is sought until the highest cusp is this share below what is asked for, at most.
const NEAR_ENOUGH: f64 = 0.015;
const ROUNDS: usize = 12;
/// Share of a pass along which cusps may be higher at first: short passes mend them.
const EXCEEDED: f64 = 0.25;
/// Stations within the cutter's radius.
const STATIONS: f64 = 16.0;
/// The greatest share of the cutter's diameter that a step may be.
const WIDEST: f64 = 0.9;

/// More finishing passes are not planned: they would take hours to plan, and days to mill.
const MOST_PASSES: usize = 20_000;

/// Whether there are too many passes.
///
/// # Errors
/// [`ToolpathError::TooMany`]
pub(crate) fn limit(passes: usize) -> Result<(), ToolpathError> {
    if passes <= MOST_PASSES {
        return Ok(());
    }
    Err(ToolpathError::TooMany {
        what: "finishing passes",
        wanted: passes,
        most: MOST_PASSES,
        mend: "choose a larger scallop, or a larger cutter",
    })
}

/// Heights of a pass at the stations.
struct Line {
    across: f64,
    /// Heights of the tip, and whether the cutter is on an edge there.
    tips: Vec<Option<(f64, bool)>>,
}

impl Line {
    fn new(field: &Field<'_>, stations: &[f64], across: f64) -> Self {
        let tips = stations.par_iter().map(|s| field.contact_at(*s, across));
        Self {
            across,
            tips: tips.collect(),
        }
    }
}

/// Places the passes: where they run across, ascending.
pub(crate) fn passes(
    field: &Field<'_>,
    cusp_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<f64>>, ToolpathError> {
    let stations = field.stations(STATIONS);
    let line = |across: f64| Line::new(field, &stations, across);
    let level = cusp::level_step_mm(&field.cutter, cusp_mm).max(1e-3);
    let widest = (WIDEST * 2.0 * field.cutter.radius_mm()).min(3.0 * level);
    // On a slope it is the corner alone that leaves cusps, and flat ends leave steps.
    let corner = level - 2.0 * field.cutter.disc_mm();
    let cautious = if corner > 0.0 {
        0.5 * corner
    } else {
        0.25 * level
    };
    let least = (corner * STEEP * 0.5).max(cusp_mm);
    let Some([first, last]) = limits(field, level, monitor)? else {
        return Ok(None);
    };
    let mut across_mm = vec![first];
    let mut here = line(first);
    let mut step = level;
    limit(((last - first) / (1.5 * level).min(widest)) as usize)?;
    while here.across < last {
        monitor.check()?;
        limit(across_mm.len())?;
        monitor.progress((here.across - first) / (last - first));
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        let mut best: Option<Line> = None;
        for _ in 0..ROUNDS {
            let next = line((here.across + step).min(last));
            let amid = line(f64::midpoint(here.across, next.across));
            let tally = tally(field, &stations, &here, &next, &amid);
            let reached = next.across - here.across;
            let is_last = next.across >= last;
            // Where nothing can be told, as at the outline, the next pass is near enough anyhow.
            let is_told = tally.is_told || reached <= cautious;
            let cusp = if is_told { tally.cusp } else { f64::INFINITY };
            let fits = cusp <= cusp_mm;
            if fits {
                low = reached;
                let done = cusp >= (1.0 - NEAR_ENOUGH) * cusp_mm
                    || reached >= widest
                    || is_last
                    || !tally.is_told;
                best = Some(next);
                if done {
                    break;
                }
            } else {
                high = reached;
                if reached <= least * 1.0001 {
                    best = Some(next);
                    break;
                }
            }
            // Cusps grow with the square of the step, those of a flat end as the step.
            let wanted = reached * ((1.0 - NEAR_ENOUGH / 2.0) * cusp_mm / cusp.max(1e-9)).sqrt();
            step = if wanted > low && wanted < high {
                wanted
            } else if high.is_finite() {
                f64::midpoint(low, high)
            } else {
                2.0 * reached
            }
            .max(least)
            .min(widest);
        }
        let next = best.unwrap_or_else(|| line((here.across + low.max(least)).min(last)));
        step = (next.across - here.across).max(least);
        across_mm.push(next.across);
        here = next;
    }
    Ok(Some(across_mm))
}

struct Tally {
    /// The cusp that is exceeded at [`EXCEEDED`] of the stations.
    cusp: f64,
    /// Whether anything could be told.
    is_told: bool,
}

/// The cusps between two lines.
fn tally(field: &Field<'_>, stations: &[f64], a: &Line, b: &Line, amid: &Line) -> Tally {
    let near = |line: &Line, k: usize| {
        let [before, tip, behind] =
            [k.checked_sub(1)?, k, k + 1].map(|k| line.tips.get(k).copied().flatten());
        let ((before, _), (tip, on_edge), (behind, _)) = (before?, tip?, behind?);
        let near = Near {
            across: line.across,
            tip,
            slope: (behind - before) / (stations[k + 1] - stations[k - 1]),
        };
        Some((near, on_edge))
    };
    let of = |k: usize| {
        let ((a, _), (b, _)) = (near(a, k)?, near(b, k)?);
        // Where it rolls around an edge, there is no surface to leave cusps on.
        let (amid, false) = near(amid, k)? else {
            return None;
        };
        Some(cusp::height_mm(&field.cutter, a, b, amid))
    };
    let told: Vec<(f64, f64)> = (0..stations.len()).into_par_iter().filter_map(of).collect();
    let mut cusps: Vec<f64> = told
        .iter()
        .filter(|(_, nz)| *nz >= STEEP)
        .map(|(cusp, _)| *cusp)
        .collect();
    let exceeded = (EXCEEDED * cusps.len() as f64) as usize;
    let cusp = if exceeded < cusps.len() {
        *cusps
            .select_nth_unstable_by(exceeded, |a, b| b.total_cmp(a))
            .1
    } else {
        0.0
    };
    Tally {
        cusp,
        is_told: !told.is_empty(),
    }
}

/// The first and the last place across where the cutter mills anything.
pub(crate) fn limits(
    field: &Field<'_>,
    level: f64,
    monitor: &dyn Monitor,
) -> Result<Option<[f64; 2]>, Cancelled> {
    let [low, high] = field.t;
    let stations = field.stations(STATIONS);
    let mills = |across: f64| {
        let line = Line::new(field, &stations, across);
        line.tips.iter().any(Option::is_some)
    };
    let stride = level.max((high - low) / 4000.0) / 2.0;
    let mut limits = [0.0; 2];
    for (limit, (from, sign)) in limits.iter_mut().zip([(low, 1.0), (high, -1.0)]) {
        let (mut outside, mut inside) = (from, from);
        while !mills(inside) {
            monitor.check()?;
            outside = inside;
            inside += sign * stride;
            if inside < low || inside > high {
                return Ok(None);
            }
        }
        while (inside - outside).abs() > 0.01 * level {
            let middle = f64::midpoint(inside, outside);
            if mills(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        *limit = inside;
    }
    Ok(Some(limits))
}
