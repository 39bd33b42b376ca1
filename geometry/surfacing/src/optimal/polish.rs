//! Knots taken away and moved while the tolerance holds.

use range_image::{Cancelled, Monitor};

use crate::axis::{Axis, Breaks, DEGREE};
use crate::fit;
use crate::knots::Knots;
use crate::optimal::halve_until_near;
use crate::problem::{Problem, Score};

/// Nodes visited by all fits together, at most: a bound on the time that follows from the
/// grid alone.
pub(crate) const MOST_VISITS: usize = 600_000_000;
/// Knots whose loss is tried in earnest, those that are missed least first.
pub(super) const TRIED: usize = 8;
/// Knots to either side of a lost one that make up for it.
const REACH: usize = 3;
/// First and last share of the way to the next knot by which one is moved.
const FIRST_STEP: f64 = 0.3;
const LAST_STEP: f64 = 0.04;
/// A move must lower the soft maximum to this share.
const GAIN: f64 = 0.995;
/// Knots nearer than this to each other may be joined, nodes.
const JOIN: f64 = 1.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Along {
    U,
    V,
}

/// Knots with what is needed to judge others that differ along one direction.
pub(super) struct State {
    pub(super) knots: Knots,
    pub(super) u: Axis,
    pub(super) v: Axis,
    /// Coefficients along y of each column, and along x of each row.
    along_v: Vec<f64>,
    along_u: Vec<f64>,
    score: Score,
}

pub(super) struct Polish<'a, 'b> {
    pub(super) problem: &'a mut Problem<'b>,
    /// Knots of creases along x and y, which stay where they are.
    fixed: &'a [Vec<f64>; 2],
    pub(super) monitor: &'a dyn Monitor,
    pub(super) fits_left: usize,
    fits: usize,
}

/// Fewer knots, in better places.
pub(super) fn polish(
    problem: &mut Problem,
    knots: Knots,
    fixed: &[Vec<f64>; 2],
    visits: usize,
    monitor: &dyn Monitor,
) -> Result<Knots, Cancelled> {
    let fits = visits / problem.nodes().max(1);
    let is_near = |problem: &Problem, knots: &Knots| {
        problem
            .fit(knots)
            .is_some_and(|fit| fit.score.max <= problem.tolerance)
    };
    if !is_near(problem, &knots) {
        return Ok(knots);
    }
    let mut polish = Polish {
        problem,
        fixed,
        monitor,
        fits_left: fits,
        fits,
    };
    // What really holds the tolerance, holes and all.
    let mut safe = knots.clone();
    let Some(mut state) = polish.state(knots) else {
        return Ok(safe);
    };
    loop {
        let before = state.knots.control_points();
        polish.remove_all(&mut state)?;
        if !polish.settle(&mut state, &mut safe)? {
            break;
        }
        polish.move_all(&mut state, |score| score.soft)?;
        if !polish.settle(&mut state, &mut safe)? {
            break;
        }
        if state.knots.control_points() < before {
            continue;
        }
        if polish.fits_left == 0
            || !(polish.remove_all_changes(&mut state)? || polish.remove_boldly(&mut state)?)
        {
            break;
        }
    }
    if is_near(polish.problem, &state.knots)
        && state.knots.control_points() <= safe.control_points()
    {
        safe = state.knots;
    }
    polish.draw(safe)
}

impl Polish<'_, '_> {
    pub(super) fn state(&mut self, knots: Knots) -> Option<State> {
        let (u, v) = (Axis::new(&knots.u)?, Axis::new(&knots.v)?);
        let along_v = fit::along_v(&v, &self.problem.z);
        let along_u = fit::along_u(&u, &self.problem.z, self.problem.rows);
        let coefficients = fit::along_u(&u, &along_v, v.count);
        let score = self.problem.score(&u, &v, &coefficients);
        Some(State {
            knots,
            u,
            v,
            along_v,
            along_u,
            score,
        })
    }

    /// Fills the holes anew and makes sure of the tolerance over what is around them, for
    /// which a knot or two may be wanted after all. False where that leads to nothing better
    /// than was there before.
    fn settle(&mut self, state: &mut State, safe: &mut Knots) -> Result<bool, Cancelled> {
        if !self.problem.is_full {
            self.problem.refill(&state.knots);
            let knots = halve_until_near(self.problem, state.knots.clone(), self.monitor)?;
            match self.state(knots) {
                Some(fresh) => *state = fresh,
                None => return Ok(false),
            }
        }
        let is_near = self
            .problem
            .fit(&state.knots)
            .is_some_and(|fit| fit.score.max <= self.problem.tolerance);
        let is_better = is_near && state.knots.control_points() <= safe.control_points();
        if is_better {
            *safe = state.knots.clone();
        }
        Ok(is_better)
    }

    /// The score with other knots along one direction; `None` where they are not held, or
    /// the work is used up.
    fn try_other(&mut self, state: &State, along: Along, breaks: &Breaks) -> Option<Score> {
        self.fits_left = self.fits_left.checked_sub(1)?;
        let axis = Axis::new(breaks)?;
        Some(match along {
            Along::U => {
                let coefficients = fit::along_u(&axis, &state.along_v, state.v.count);
                self.problem.score(&axis, &state.v, &coefficients)
            }
            Along::V => {
                let coefficients = fit::along_v(&axis, &state.along_u);
                self.problem.score(&state.u, &axis, &coefficients)
            }
        })
    }

    fn take(&self, state: &mut State, along: Along, breaks: Breaks, score: Score) {
        let Some(axis) = Axis::new(&breaks) else {
            return;
        };
        match along {
            Along::U => {
                state.along_u = fit::along_u(&axis, &self.problem.z, self.problem.rows);
                state.u = axis;
                state.knots.u = breaks;
            }
            Along::V => {
                state.along_v = fit::along_v(&axis, &self.problem.z);
                state.v = axis;
                state.knots.v = breaks;
            }
        }
        state.score = score;
    }

    fn is_fixed(&self, along: Along, knot: f64) -> bool {
        self.fixed[usize::from(along == Along::V)].contains(&knot)
    }

    /// Where a knot, or all that lie with it, could go.
    fn moves(&self, along: Along, breaks: &Breaks, index: usize, step: f64) -> Vec<Breaks> {
        match breaks.inner.get(index) {
            Some(&knot) if !self.is_fixed(along, knot) => moved(breaks, index, step),
            _ => Vec::new(),
        }
    }

    fn told(&self) -> Result<(), Cancelled> {
        let used = 1.0 - self.fits_left as f64 / self.fits.max(1) as f64;
        self.monitor.progress(0.4 + 0.6 * used);
        self.monitor.check()
    }

    fn remove_all_changes(&mut self, state: &mut State) -> Result<bool, Cancelled> {
        let before = state.knots.control_points();
        self.remove_all(state)?;
        Ok(state.knots.control_points() < before)
    }

    /// Takes knots away while the tolerance holds, those that are missed least first.
    fn remove_all(&mut self, state: &mut State) -> Result<(), Cancelled> {
        while self.fits_left > 0 && self.remove_one(state)? {}
        Ok(())
    }

    /// What it costs to lose each knot, least first.
    pub(super) fn losses(
        &mut self,
        state: &State,
    ) -> Result<Vec<(Score, Along, usize)>, Cancelled> {
        let mut losses: Vec<(Score, Along, usize)> = Vec::new();
        for along in [Along::U, Along::V] {
            let breaks = breaks_of(state, along).clone();
            let mut previous = f64::NAN;
            for index in 0..breaks.inner.len() {
                // Of repeated knots each is as good as the next.
                if breaks.inner[index] == previous || self.is_fixed(along, breaks.inner[index]) {
                    continue;
                }
                previous = breaks.inner[index];
                self.monitor.check()?;
                if let Some(score) = self.try_other(state, along, &breaks.without(index)) {
                    losses.push((score, along, index));
                }
            }
        }
        losses.sort_by(|a, b| a.0.soft.total_cmp(&b.0.soft));
        Ok(losses)
    }

    fn remove_one(&mut self, state: &mut State) -> Result<bool, Cancelled> {
        self.told()?;
        let tolerance = self.problem.tolerance;
        let losses = self.losses(state)?;
        // Where many can go without a word, they go at once.
        let mut gone = false;
        for along in [Along::U, Along::V] {
            let idle: Vec<usize> = losses
                .iter()
                .filter(|(score, of, _)| *of == along && score.max <= 0.98 * tolerance)
                .map(|(_, _, index)| *index)
                .collect();
            gone |= self.remove_apart(state, along, &idle);
        }
        if gone {
            return Ok(true);
        }
        for (score, along, index) in losses.into_iter().take(TRIED) {
            self.told()?;
            let breaks = breaks_of(state, along).without(index);
            if score.max <= tolerance {
                self.take(state, along, breaks, score);
                return Ok(true);
            }
            if let Some((breaks, score)) = self.relax(state, along, breaks, index, score)?
                && score.max <= tolerance
            {
                self.take(state, along, breaks, score);
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Takes away a knot that is missed, and moves all others to make up for it.
    fn remove_boldly(&mut self, state: &mut State) -> Result<bool, Cancelled> {
        let losses = self.losses(state)?;
        for (_, along, index) in losses.into_iter().take(TRIED) {
            let Some(mut fewer) = self.state(without(&state.knots, along, index)) else {
                continue;
            };
            self.move_all(&mut fewer, |score| score.gentle)?;
            self.move_all(&mut fewer, |score| score.soft)?;
            if fewer.score.max <= self.problem.tolerance {
                *state = fewer;
                return Ok(true);
            }
            if self.fits_left == 0 {
                break;
            }
        }
        Ok(false)
    }

    /// Takes away those of the knots that lie far from each other, the first of them first,
    /// if the tolerance holds without them; else half as many.
    fn remove_apart(&mut self, state: &mut State, along: Along, idle: &[usize]) -> bool {
        let mut apart: Vec<usize> = Vec::new();
        for &index in idle {
            if apart.iter().all(|a| a.abs_diff(index) > 2 * DEGREE) {
                apart.push(index);
            }
        }
        while !apart.is_empty() {
            let breaks = breaks_of(state, along);
            let kept = breaks.inner.iter().enumerate();
            let kept = kept.filter(|(k, _)| !apart.contains(k)).map(|(_, t)| *t);
            let breaks = Breaks::new(breaks.nodes, kept.collect());
            if let Some(score) = self.try_other(state, along, &breaks)
                && score.max <= self.problem.tolerance
            {
                self.take(state, along, breaks, score);
                return true;
            }
            apart.truncate(apart.len() / 2);
        }
        false
    }

    /// Moves the knots beside a lost one towards where it was, and further where that helps.
    fn relax(
        &mut self,
        state: &State,
        along: Along,
        mut breaks: Breaks,
        lost: usize,
        mut score: Score,
    ) -> Result<Option<(Breaks, Score)>, Cancelled> {
        let from = lost.saturating_sub(REACH);
        let to = (lost + REACH).min(breaks.inner.len());
        let mut step = 2.0 * FIRST_STEP;
        while step > 3.0 * LAST_STEP {
            let mut is_better = false;
            for index in from..to {
                self.monitor.check()?;
                for other in self.moves(along, &breaks, index, step) {
                    let Some(tried) = self.try_other(state, along, &other) else {
                        continue;
                    };
                    if tried.soft < GAIN * score.soft {
                        (breaks, score) = (other, tried);
                        is_better = true;
                        break;
                    }
                }
                if score.max <= self.problem.tolerance {
                    return Ok(Some((breaks, score)));
                }
            }
            self.told()?;
            if !is_better {
                step /= 2.0;
            }
        }
        Ok(Some((breaks, score)))
    }

    /// Moves all knots to where the deviations are least.
    pub(super) fn move_all(
        &mut self,
        state: &mut State,
        cost: impl Fn(&Score) -> f64,
    ) -> Result<(), Cancelled> {
        let mut step = FIRST_STEP;
        while step > LAST_STEP && self.fits_left > 0 {
            let before = cost(&state.score);
            for along in [Along::U, Along::V] {
                let mut index = 0;
                while index < breaks_of(state, along).inner.len() {
                    self.monitor.check()?;
                    let breaks = breaks_of(state, along).clone();
                    for other in self.moves(along, &breaks, index, step) {
                        if let Some(score) = self.try_other(state, along, &other)
                            && cost(&score) < GAIN * cost(&state.score)
                        {
                            self.take(state, along, other, score);
                            break;
                        }
                    }
                    index += 1;
                }
                self.told()?;
            }
            if cost(&state.score) > 0.9 * before {
                step /= 2.0;
            }
        }
        Ok(())
    }
}

/// All knots but one.
pub(super) fn without(knots: &Knots, along: Along, index: usize) -> Knots {
    let mut knots = knots.clone();
    match along {
        Along::U => knots.u = knots.u.without(index),
        Along::V => knots.v = knots.v.without(index),
    }
    knots
}

fn breaks_of(state: &State, along: Along) -> &Breaks {
    match along {
        Along::U => &state.knots.u,
        Along::V => &state.knots.v,
    }
}

/// Where a knot, or all that lie with it, could go: a share of the way to the next one to
/// either side, and onto it where that is near.
fn moved(breaks: &Breaks, index: usize, step: f64) -> Vec<Breaks> {
    let Some(&here) = breaks.inner.get(index) else {
        return Vec::new();
    };
    if index > 0 && breaks.inner[index - 1] == here {
        return Vec::new();
    }
    let group = breaks.inner[index..].iter().take_while(|&&t| t == here);
    let end = index + group.count();
    let low = index.checked_sub(1).map_or(0.0, |k| breaks.inner[k]);
    let last = breaks.nodes.saturating_sub(1) as f64;
    let high = breaks.inner.get(end).copied().unwrap_or(last);
    let to = |t: f64| {
        let mut inner = breaks.inner.clone();
        inner[index..end].fill(t);
        Breaks::new(breaks.nodes, inner)
    };
    let mut others = vec![
        to(here + step * (high - here)),
        to(here - step * (here - low)),
    ];
    for (next, is_end) in [(high, high == last), (low, low == 0.0)] {
        if !is_end && (next - here).abs() < JOIN {
            others.push(to(next));
        }
    }
    // Joined knots beyond three are lost, which is not what was asked for.
    others.retain(|other| other.inner.len() == breaks.inner.len());
    others
}
