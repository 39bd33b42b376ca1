//! The paths of outlines and steps, with the samples beside each.

use std::collections::BTreeMap;

use nurbs::PiecewiseCubic;
use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use super::course::Course;
use super::deflect::Drawn;
use super::search::{Likely, NEAR, Search};
use super::settle::{Outlines, Placed};
use crate::evidence::Seen;
use crate::polygon::{dot, minus, norm};

/// Samples nearer than this to an end of their path are of no use: they may as well lie beside
/// the next one. Pitches.
const END: f64 = 0.5;

/// Ends that are so near to each other are one, pitches.
const CLOSED: f64 = 1e-6;

/// Samples between two looks whether the work is cancelled.
const CHUNK: usize = 1_000;

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
    /// It stays where it was drawn. Its samples are its own all the same.
    as_drawn: bool,
    region: u16,
    /// The region on the other side, where the path is a step down or up to one.
    beyond: Option<u16>,
    /// 1 where the region lies to the left.
    pub(super) side: f64,
    samples: Vec<Placed>,
}

/// A path of a border, and where it is the likeliest if that can be told.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    pub(super) border: usize,
    /// As it was drawn.
    pub(super) curve: PiecewiseCubic<2>,
    /// 1 where the region lies to the left.
    pub(super) side: f64,
    pub(super) found: Option<Likely>,
}

/// What was found for paths that go on into each other, by all that it was found from. Borders are
/// drawn several times, and most of them the same.
#[derive(Debug, Default)]
pub(crate) struct Memory(BTreeMap<Vec<u64>, Vec<Settled>>);

/// The paths of all outlines and steps in their order, with the samples that are nearest to each.
///
/// # Errors
/// Cancelled.
pub(super) fn with_samples(
    borders: &[Drawn<'_>],
    outlines: &Outlines,
    monitor: &dyn Monitor,
) -> Result<Vec<Beside>, Cancelled> {
    let mut all = Vec::new();
    for (border, drawn) in borders.iter().enumerate() {
        let region = |piece: u32| {
            let piece = (piece as usize).checked_sub(1)?;
            outlines.regions.get(piece).copied()
        };
        let (region, beyond, side) = match (region(drawn.chain.left), region(drawn.chain.right)) {
            (Some(region), None) => (region, None, 1.0),
            (None, Some(region)) => (region, None, -1.0),
            (Some(left), Some(right)) if drawn.is_step && left != right => (left, Some(right), 1.0),
            _ => continue,
        };
        for curve in drawn.paths.as_deref().into_iter().flatten() {
            let is_closed = drawn.chain.ends.is_none();
            let mut beside = Beside::new(border, curve.clone(), is_closed, region, side);
            beside.as_drawn = drawn.as_drawn;
            beside.beyond = beyond;
            all.push(beside);
        }
    }
    let cells = Cells::of(&all);
    for some in outlines.samples.chunks(CHUNK) {
        monitor.check()?;
        for sample in some {
            note(&mut all, &cells, sample);
        }
    }
    Ok(all)
}

/// Finds for each path where it is the likeliest; those that go on into each other become one
/// where that is likelier, for its fewer numbers: on a staircase corners are seen where none are.
///
/// # Errors
/// Cancelled.
pub(super) fn settled(
    all: Vec<Beside>,
    memory: &mut Memory,
    monitor: &dyn Monitor,
) -> Result<Vec<Settled>, Cancelled> {
    let mut runs: Vec<Vec<Beside>> = Vec::new();
    for beside in all {
        match runs.last_mut() {
            Some(run) if run[run.len() - 1].goes_on_into(&beside) => run.push(beside),
            _ => runs.push(vec![beside]),
        }
    }
    let known = &memory.0;
    let settled = runs.into_par_iter().map(|run| {
        let key: Vec<u64> = run.iter().flat_map(Beside::key).collect();
        let settled = match known.get(&key) {
            Some(settled) => settled.clone(),
            None => settled_run(run, monitor),
        };
        (key, settled)
    });
    let settled: Vec<_> = settled.collect();
    monitor.check()?;
    let mut done = Vec::new();
    for (key, settled) in settled {
        done.extend_from_slice(&settled);
        memory.0.entry(key).or_insert(settled);
    }
    Ok(done)
}

/// The same for paths that go on into each other.
fn settled_run(run: Vec<Beside>, monitor: &dyn Monitor) -> Vec<Settled> {
    let apart: Vec<Option<Likely>> = run.iter().map(|beside| beside.best(monitor)).collect();
    if run.len() > 1 {
        let costs = run.iter().zip(&apart).map(|(beside, found)| match found {
            Some(found) => found.cost,
            None => beside.search(monitor).cost_as_drawn(),
        });
        let whole = Beside::joined(&run);
        let found = whole.best(monitor);
        if found.as_ref().is_some_and(|found| found.cost < costs.sum()) {
            return vec![whole.settled(found)];
        }
    }
    let both = run.into_iter().zip(apart);
    both.map(|(beside, found)| beside.settled(found)).collect()
}

impl Beside {
    fn new(
        border: usize,
        curve: PiecewiseCubic<2>,
        may_close: bool,
        region: u16,
        side: f64,
    ) -> Self {
        let course = Course::of(&curve);
        let ends_meet = may_close && norm(minus(curve.end(), curve.start())) < CLOSED;
        let (first, last) = curve.domain();
        let goes_on = goes_on(curve.derivative(last, 1), curve.derivative(first, 1));
        Self {
            border,
            may_close,
            is_closed: ends_meet && goes_on,
            has_cusp: ends_meet && !goes_on,
            as_drawn: false,
            curve,
            course,
            region,
            beyond: None,
            side,
            samples: Vec::new(),
        }
    }

    fn settled(self, found: Option<Likely>) -> Settled {
        Settled {
            border: self.border,
            curve: self.curve,
            side: self.side,
            found,
        }
    }

    /// A sample as it tells of the path. At a step those of the region beyond are where this one
    /// has none. What is missing there tells nothing: the upper surface hides some of the lower.
    fn seen(&self, sample: &Placed) -> Option<Placed> {
        if self.beyond.is_none() {
            return Some(*sample);
        }
        let is_own = sample.region == self.region;
        let seen = match sample.seen {
            Seen::Present if is_own => Seen::Present,
            Seen::Present => Seen::Missing,
            Seen::Lost if is_own => Seen::Lost,
            Seen::Lost | Seen::Missing => return None,
        };
        Some(Placed { seen, ..*sample })
    }

    /// All that matters for where it is found to be.
    fn key(&self) -> Vec<u64> {
        let counts = [
            self.border,
            self.as_drawn.into(),
            self.curve.breaks.len(),
            self.samples.len(),
        ];
        let mut key: Vec<u64> = counts.map(|n| n as u64).to_vec();
        let numbers = self.curve.pieces.iter().flatten().flatten();
        key.extend(self.curve.breaks.iter().chain(numbers).map(|n| n.to_bits()));
        for sample in &self.samples {
            key.extend(sample.place.map(f64::to_bits));
            key.push(sample.seen as u64);
        }
        key
    }

    /// The likeliest, if it can be told. A path that comes back to its start at an angle stays as
    /// it was drawn: its end would have to move with its start.
    fn best(&self, monitor: &dyn Monitor) -> Option<Likely> {
        if self.has_cusp || self.as_drawn {
            return None;
        }
        self.search(monitor).best()
    }

    fn search<'a>(&'a self, monitor: &'a dyn Monitor) -> Search<'a> {
        Search {
            curve: &self.curve,
            course: &self.course,
            is_closed: self.is_closed,
            side: self.side,
            samples: &self.samples,
            monitor,
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
        whole.as_drawn = first.as_drawn;
        whole.beyond = first.beyond;
        whole.samples = run.iter().flat_map(|b| &b.samples).copied().collect();
        whole
    }
}

/// Whether a path may go on from one direction into another without a corner.
fn goes_on(into: [f64; 2], out: [f64; 2]) -> bool {
    dot(into, out) > BLUNT * norm(into) * norm(out)
}

/// Paths near places, by region and square cells.
struct Cells(BTreeMap<(u16, [i64; 2]), Vec<usize>>);

impl Cells {
    /// Side of a cell, pitches.
    const SIDE: f64 = 8.0;

    fn of(all: &[Beside]) -> Self {
        let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (k, beside) in all.iter().enumerate() {
            for [a, b] in beside.course.chords().flat_map(Self::shortened) {
                let range = |d: usize| {
                    let (low, high) = (a[d].min(b[d]) - NEAR, a[d].max(b[d]) + NEAR);
                    Self::cell(low)..=Self::cell(high)
                };
                for (x, y) in range(0).flat_map(|x| range(1).map(move |y| (x, y))) {
                    for region in core::iter::once(beside.region).chain(beside.beyond) {
                        let paths = cells.entry((region, [x, y])).or_default();
                        if paths.last() != Some(&k) {
                            paths.push(k);
                        }
                    }
                }
            }
        }
        Self(cells)
    }

    /// A chord in parts no longer than a cell.
    fn shortened([a, b]: [[f64; 2]; 2]) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let count = (norm(minus(b, a)) / Self::SIDE).ceil().clamp(1.0, 1e5) as u32;
        let at = move |n: u32| {
            let share = f64::from(n) / f64::from(count);
            [0, 1].map(|d| a[d] + share * (b[d] - a[d]))
        };
        (0..count).map(move |n| [at(n), at(n + 1)])
    }

    fn cell(at: f64) -> i64 {
        (at / Self::SIDE).floor() as i64
    }

    fn near(&self, sample: &Placed) -> &[usize] {
        let cell = (sample.region, sample.place.map(Self::cell));
        self.0.get(&cell).map_or(&[], Vec::as_slice)
    }
}

/// Notes a sample with the path that it is nearest to.
fn note(all: &mut [Beside], cells: &Cells, sample: &Placed) {
    let mut best: Option<(f64, usize, f64)> = None;
    for &k in cells.near(sample) {
        let beside = &all[k];
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
        all[k].samples.extend(all[k].seen(sample));
    }
}

#[cfg(test)]
mod tests {
    use super::super::deflect::Deflection;
    use super::*;
    use range_image::Unmonitored;

    #[test]
    fn what_was_settled_is_remembered_by_all_that_it_was_found_from() {
        let beside = |row: f64| {
            let line = PiecewiseCubic::line([0.0, 0.0], [40.0, 0.1], 40.0).unwrap();
            let mut beside = Beside::new(3, line, false, 1, 1.0);
            for k in 1..40 {
                for (y, seen) in [(row + 0.5, Seen::Present), (row - 0.5, Seen::Missing)] {
                    let place = [f64::from(k), y];
                    let region = 1;
                    beside.samples.push(Placed {
                        region,
                        place,
                        seen,
                    });
                }
            }
            beside
        };
        let mut memory = Memory::default();
        let at_20 = |memory: &mut Memory, row: f64| {
            let settled = settled(vec![beside(row)], memory, &Unmonitored).unwrap();
            let found = settled[0].found.clone();
            let end = settled[0].curve.end();
            assert_eq!((settled[0].border, end), (3, [40.0, 0.1]));
            found.map(|found| found.sway.at(20.0, 0))
        };
        let first = at_20(&mut memory, 0.0).expect("samples tell");
        let other = at_20(&mut memory, 0.3).expect("samples tell");
        assert!((other - first - 0.3).abs() < 0.05, "{other}");
        assert_eq!(memory.0.len(), 2);
        // It does not look again.
        for settled in memory.0.values_mut().flatten() {
            settled.found = None;
        }
        assert_eq!(at_20(&mut memory, 0.0), None);
    }

    #[test]
    fn samples_that_bear_out_no_outline_leave_it_as_drawn() {
        let with = |is_there: &dyn Fn(f64, i32) -> bool| {
            let line = PiecewiseCubic::line([0.0, 0.0], [40.0, 0.0], 40.0).unwrap();
            let mut beside = Beside::new(0, line, false, 1, 1.0);
            for k in 1..40 {
                for y in [-1.3, -0.4, 0.5, 1.4] {
                    beside.samples.push(Placed {
                        region: 1,
                        place: [f64::from(k), y],
                        seen: if is_there(y, k) {
                            Seen::Present
                        } else {
                            Seen::Missing
                        },
                    });
                }
            }
            beside.best(&Unmonitored)
        };
        assert!(with(&|y, _| y > 0.1).is_some());
        // Here and there on both sides, as of points that lie in no columns.
        assert!(with(&|y, k| (k * 7 + (10.0 * y) as i32) % 3 != 0).is_none());
    }
}
