//! The paths of outlines, with the samples beside each.

use nurbs::PiecewiseCubic;
use rayon::prelude::*;

use super::course::Course;
use super::deflect::Drawn;
use super::search::{Found, NEAR, Search};
use super::settle::{Outlines, Placed};
use crate::polygon::{dot, minus, norm};

/// Samples nearer than this to an end of their path are of no use: they may as well lie beside
/// the next one. Pitches.
const END: f64 = 0.5;

/// Ends that are so near to each other are one, pitches.
const CLOSED: f64 = 1e-6;

/// Cosine of the greatest angle at which two paths may be one after all.
const BLUNT: f64 = 0.8;

/// A path beside which samples may lie.
pub(super) struct Beside {
    pub(super) border: usize,
    pub(super) curve: PiecewiseCubic<2>,
    course: Course,
    /// Its border runs back into itself.
    may_close: bool,
    is_closed: bool,
    /// It comes back to its start at an angle.
    has_cusp: bool,
    region: u16,
    /// 1 where the region lies to the left.
    pub(super) side: f64,
    low: [f64; 2],
    high: [f64; 2],
    samples: Vec<Placed>,
}

/// The paths of all outlines in their order, with the samples that are nearest to each.
pub(super) fn with_samples(borders: &[Drawn<'_>], outlines: &Outlines) -> Vec<Beside> {
    let mut all = Vec::new();
    for (border, drawn) in borders.iter().enumerate() {
        if drawn.as_drawn {
            continue;
        }
        let (piece, side) = match (drawn.chain.left, drawn.chain.right) {
            (piece, 0) if piece != 0 => (piece, 1.0),
            (0, piece) if piece != 0 => (piece, -1.0),
            _ => continue,
        };
        let Some(&region) = outlines.regions.get(piece as usize - 1) else {
            continue;
        };
        for curve in drawn.paths.as_deref().into_iter().flatten() {
            let is_closed = drawn.chain.ends.is_none();
            all.push(Beside::new(border, curve.clone(), is_closed, region, side));
        }
    }
    for sample in &outlines.samples {
        note(&mut all, sample);
    }
    all
}

/// Finds for each path where it is the likeliest; those that go on into each other become one
/// where that is likelier, for its fewer numbers: on a staircase corners are seen where none are.
pub(super) fn settled(all: Vec<Beside>) -> Vec<(Beside, Option<Found>)> {
    let mut runs: Vec<Vec<Beside>> = Vec::new();
    for beside in all {
        match runs.last_mut() {
            Some(run) if run[run.len() - 1].goes_on_into(&beside) => run.push(beside),
            _ => runs.push(vec![beside]),
        }
    }
    let settled: Vec<Vec<_>> = runs.into_par_iter().map(settled_run).collect();
    settled.into_iter().flatten().collect()
}

/// The same for paths that go on into each other.
fn settled_run(run: Vec<Beside>) -> Vec<(Beside, Option<Found>)> {
    let apart: Vec<Option<Found>> = run.iter().map(Beside::best).collect();
    if run.len() > 1 {
        let costs = run.iter().zip(&apart).map(|(beside, found)| match found {
            Some(found) => found.cost,
            None => beside.search().cost_as_drawn(),
        });
        let whole = Beside::joined(&run);
        let found = whole.best();
        if found.as_ref().is_some_and(|found| found.cost < costs.sum()) {
            return vec![(whole, found)];
        }
    }
    run.into_iter().zip(apart).collect()
}

impl Beside {
    fn new(
        border: usize,
        curve: PiecewiseCubic<2>,
        may_close: bool,
        region: u16,
        side: f64,
    ) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let course = Course::of(&curve);
        for place in course.places() {
            for d in 0..2 {
                low[d] = low[d].min(place[d] - NEAR);
                high[d] = high[d].max(place[d] + NEAR);
            }
        }
        let ends_meet = may_close && norm(minus(curve.end(), curve.start())) < CLOSED;
        let (first, last) = curve.domain();
        let goes_on = goes_on(curve.derivative(last, 1), curve.derivative(first, 1));
        Self {
            border,
            may_close,
            is_closed: ends_meet && goes_on,
            has_cusp: ends_meet && !goes_on,
            curve,
            course,
            region,
            side,
            low,
            high,
            samples: Vec::new(),
        }
    }

    /// The likeliest, if it can be told. A path that comes back to its start at an angle stays as
    /// it was drawn: its end would have to move with its start.
    fn best(&self) -> Option<Found> {
        if self.has_cusp {
            return None;
        }
        self.search().best()
    }

    fn search(&self) -> Search<'_> {
        Search {
            curve: &self.curve,
            course: &self.course,
            is_closed: self.is_closed,
            side: self.side,
            samples: &self.samples,
        }
    }

    /// Whether this path may go on into the next without a corner.
    fn goes_on_into(&self, next: &Self) -> bool {
        let into = self.curve.derivative(self.curve.domain().1, 1);
        let out = next.curve.derivative(next.curve.domain().0, 1);
        self.border == next.border
            && norm(minus(next.curve.start(), self.curve.end())) < CLOSED
            && goes_on(into, out)
    }

    /// Paths that go on into each other as one.
    fn joined(run: &[Self]) -> Self {
        let mut curve = run[0].curve.clone();
        for next in &run[1..] {
            let (start, last) = (next.curve.domain().0, curve.domain().1);
            let breaks = next.curve.breaks.iter().skip(1);
            curve.breaks.extend(breaks.map(|b| last + b - start));
            curve.pieces.extend_from_slice(&next.curve.pieces);
        }
        let first = &run[0];
        let mut whole = Self::new(
            first.border,
            curve,
            first.may_close,
            first.region,
            first.side,
        );
        whole.samples = run.iter().flat_map(|b| &b.samples).copied().collect();
        whole
    }
}

/// Whether a path may go on from one direction into another without a corner.
fn goes_on(into: [f64; 2], out: [f64; 2]) -> bool {
    dot(into, out) > BLUNT * norm(into) * norm(out)
}

/// Notes a sample with the path that it is nearest to.
fn note(all: &mut [Beside], sample: &Placed) {
    let mut best: Option<(f64, usize, f64)> = None;
    for (k, beside) in all.iter().enumerate() {
        let within = |d: usize| (beside.low[d]..=beside.high[d]).contains(&sample.place[d]);
        if beside.region != sample.region || !(within(0) && within(1)) {
            continue;
        }
        let Some((at, _)) = beside.course.place(&beside.curve, sample.place, NEAR) else {
            continue;
        };
        let distance = norm(minus(sample.place, beside.curve.evaluate(at)));
        if best.is_none_or(|(least, ..)| distance < least) {
            best = Some((distance, k, at));
        }
    }
    let Some((_, k, at)) = best else { return };
    let (first, last) = all[k].curve.domain();
    if at - first > END && last - at > END {
        all[k].samples.push(*sample);
    }
}
