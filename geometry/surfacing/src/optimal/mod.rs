//! As few knots as the tolerance allows, over the whole grid: ours.
//!
//! 1. Lines along the grid on which the slope breaks get triple knots ([`crate::character`]), which
//!    stay.
//! 2. For each direction by itself a density of knots is found under which every span's
//!    greatest deviation is the same share of the tolerance ([`density`]): a cubic's falls
//!    with the fourth power of its span.
//! 3. Where that does not reach the tolerance, spans that exceed it are halved.
//! 4. Knots are taken away while the tolerance holds, and moved to lower the deviations,
//!    in turn ([`polish`]).
//! 5. More are taken away as long as a surface of those left can be drawn within the tolerance
//!    where least squares are not ([`draw`]).
//!
//! Masked nodes are filled anew from the surface between the steps, so that they ask for no
//! knots of their own.

mod density;
mod draw;
mod polish;

use range_image::{Cancelled, Monitor};

use crate::axis::{Axis, Breaks};
use crate::grid::HeightGrid;
use crate::knots::Knots;
use crate::problem::Problem;
use density::Direction;
pub(crate) use polish::MOST_VISITS;

/// Shares of the tolerance that each direction may take, tried from the largest.
const SHARES: [f64; 8] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.42, 0.35];

/// Times that holes are filled anew once the tolerance holds.
const REFILLS: usize = 2;

/// Rounds of halving after which spans are halved that are within the tolerance by more and more, and
/// what the least share of it comes down to with each.
const PATIENT: usize = 12;
const HASTE: f64 = 0.7;

/// Places the knots. `fixed` are those that character lines ask for, along x and y; `visits` bounds
/// the work, [`MOST_VISITS`] at most.
///
/// # Errors
/// [`Cancelled`] at the monitor's wish.
pub(crate) fn place(
    problem: &mut Problem,
    fixed: &[Vec<f64>; 2],
    visits: usize,
    monitor: &dyn Monitor,
) -> Result<Knots, Cancelled> {
    let mut u = Direction::new(problem.columns, fixed[0].clone());
    let mut v = Direction::new(problem.rows, fixed[1].clone());
    if !problem.is_full {
        let first = first_knots(problem);
        problem.refill(&first);
    }
    let mut knots = None;
    for (step, share) in SHARES.into_iter().enumerate() {
        monitor.check()?;
        let target = share * problem.tolerance;
        let candidate = Knots {
            u: u.spread(target, |axis| problem.columns_off(axis), monitor)?,
            v: v.spread(target, |axis| problem.rows_off(axis), monitor)?,
        };
        monitor.progress(0.3 * (step + 1) as f64 / SHARES.len() as f64);
        let is_near = problem
            .fit(&candidate)
            .is_some_and(|fit| fit.score.max <= problem.tolerance);
        if !problem.is_full && step < 3 {
            problem.refill(&candidate);
        }
        knots = Some(candidate);
        if is_near {
            break;
        }
    }
    let knots = knots.unwrap_or_else(|| Knots {
        u: Breaks::none(problem.columns),
        v: Breaks::none(problem.rows),
    });
    let mut knots = halve_until_near(problem, knots, monitor)?;
    // Filling the holes anew moves the surface a little, as long as it has not settled.
    for _ in 0..REFILLS {
        problem.refill(&knots);
        knots = halve_until_near(problem, knots, monitor)?;
    }
    monitor.progress(0.4);
    let is_near = problem
        .fit(&knots)
        .is_some_and(|fit| fit.score.max <= problem.tolerance);
    if !is_near {
        return Ok(every_node(problem));
    }
    polish::polish(problem, knots, fixed, visits, monitor)
}

/// Of the tolerance, what each direction may take where control points are only estimated, and how
/// often what holes are filled with is found anew: they are to ask for none.
const ESTIMATED_SHARE: f64 = 0.9;
const ESTIMATES: usize = 2;

/// About how many control points a surface over the grid takes: as many as each direction needs by
/// itself.
///
/// # Errors
/// [`Cancelled`] at the monitor's wish.
pub(crate) fn estimate(
    grid: &HeightGrid,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<usize, Cancelled> {
    let mut problem = Problem::of_part(grid, tolerance_mm, monitor);
    let target = ESTIMATED_SHARE * tolerance_mm;
    let mut u = Direction::new(problem.columns, Vec::new());
    let mut v = Direction::new(problem.rows, Vec::new());
    let mut knots = first_knots(&problem);
    let times = if problem.is_full { 1 } else { ESTIMATES };
    for _ in 0..times {
        problem.refill(&knots);
        knots = Knots {
            u: u.spread(target, |axis| problem.columns_off(axis), monitor)?,
            v: v.spread(target, |axis| problem.rows_off(axis), monitor)?,
        };
    }
    Ok(knots.control_points())
}

/// Those of a first surface, so that holes are filled from more than their neighbours.
fn first_knots(problem: &Problem) -> Knots {
    Knots {
        u: Breaks::uniform(problem.columns, 8).solvable(),
        v: Breaks::uniform(problem.rows, 8).solvable(),
    }
}

/// Halves the spans that exceed the tolerance until none does, or all nodes have a knot.
fn halve_until_near(
    problem: &mut Problem,
    mut knots: Knots,
    monitor: &dyn Monitor,
) -> Result<Knots, Cancelled> {
    let mut share = 0.5;
    for round in 0.. {
        monitor.check()?;
        if round >= PATIENT {
            // A span or two at a time would take as many rounds as there are nodes.
            share *= HASTE;
        }
        let Some(fit) = problem.fit(&knots) else {
            return Ok(every_node(problem));
        };
        if fit.score.max <= problem.tolerance {
            return Ok(knots);
        }
        let (Some(u), Some(v)) = (Axis::new(&knots.u), Axis::new(&knots.v)) else {
            return Ok(every_node(problem));
        };
        let mut target = share * problem.tolerance;
        let mut finer = knots.clone();
        let (columns_off, rows_off) = (problem.columns_off(&u), problem.rows_off(&v));
        // Both directions may be within their share, and yet not their sum.
        for _ in 0..6 {
            finer.u = halved(&knots.u, &columns_off, target, monitor)?;
            finer.v = halved(&knots.v, &rows_off, target, monitor)?;
            if finer != knots {
                break;
            }
            target *= 0.7;
        }
        if finer == knots {
            let every = every_node(problem);
            let is_better = problem
                .fit(&every)
                .is_some_and(|every| every.score.max < fit.score.max);
            return Ok(if is_better { every } else { knots });
        }
        problem.refill(&finer);
        knots = finer;
    }
    Ok(knots)
}

/// A knot at every node but those next to the ends: the interpolating spline.
pub(crate) fn every_node(problem: &Problem) -> Knots {
    let every = |nodes: usize| {
        let inner = (2..nodes.saturating_sub(2)).map(|k| k as f64).collect();
        Breaks::new(nodes, inner)
    };
    Knots {
        u: every(problem.columns),
        v: every(problem.rows),
    }
}

/// Knots with those spans halved in which a node is farther off than the target, as far as
/// the nodes hold them.
fn halved(
    breaks: &Breaks,
    off: &[f64],
    target: f64,
    monitor: &dyn Monitor,
) -> Result<Breaks, Cancelled> {
    let edges = breaks.edges();
    let spans = edges.windows(2).filter_map(|span| match span {
        &[low, high] if worst_within(off, low, high) > target => Some((low + high) / 2.0),
        _ => None,
    });
    with_held(breaks.clone(), &spans.collect::<Vec<f64>>(), monitor)
}

/// Knots with more, as many of these as the nodes hold: all at once, or each half of them by itself.
fn with_held(breaks: Breaks, more: &[f64], monitor: &dyn Monitor) -> Result<Breaks, Cancelled> {
    if more.is_empty() {
        return Ok(breaks);
    }
    monitor.check()?;
    let mut inner = breaks.inner.clone();
    inner.extend(more);
    let finer = Breaks::new(breaks.nodes, inner);
    if finer.inner.len() == breaks.inner.len() + more.len() && Axis::new(&finer).is_some() {
        return Ok(finer);
    }
    if more.len() == 1 {
        return Ok(breaks);
    }
    let (first, second) = more.split_at(more.len() / 2);
    let breaks = with_held(breaks, first, monitor)?;
    with_held(breaks, second, monitor)
}

/// The greatest of the nodes' values within a span, the nodes at its ends included.
fn worst_within(off: &[f64], low: f64, high: f64) -> f64 {
    let (from, to) = (low.floor() as usize, high.ceil() as usize);
    let nodes = off.get(from..(to + 1).min(off.len())).unwrap_or_default();
    nodes.iter().copied().fold(0.0, f64::max)
}
