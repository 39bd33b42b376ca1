//! The outline that the samples beside it make likeliest: by how few numbers it is drawn, and
//! where it runs.

use nurbs::PiecewiseCubic;
use range_image::Monitor;
use rayon::prelude::*;

use super::conic::{self, Conic};
use super::course::Course;
use super::deflect::{Deflection, bent};
use super::layout::Layout;
use super::likelihood::{Sighting, Sightings};
use super::redraw::redraw;
use super::settle::Placed;
use super::sway::{Known, Sway};
use crate::evidence::Seen;
use crate::polygon::{distance_to_segment, norm};

/// Samples farther from the path than this tell nothing of it, pitches.
pub(crate) const NEAR: f64 = 2.5;
/// How closely a spline may follow what is drawn, pitches: the samples choose.
const TOLERANCES: [f64; 7] = [1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001];
/// Most pieces of a path.
const MOST: usize = 200;
/// Farthest that a path drawn by fewer numbers lies beside the one before, and that it is moved
/// then; pitches.
const REDRAWN: f64 = 1.5;
const FARTHEST: f64 = 1.5;
/// How closely a path with other straight stretches is followed, against the one before.
const FINER: [f64; 2] = [3.0, 1.0];
/// A path runs nearly straight where it is so near to a chord, seen at steps of this length;
/// pitches.
const NEARLY: f64 = 0.15;
const RUN_STEP: f64 = 1.0;
/// Such a run may be straight but for so much at its ends, pitches.
const SHORTER: [f64; 4] = [0.0, 3.0, 6.0, 12.0];
/// By how much the ends of straight stretches are shifted, pitches.
const SHIFTS: [f64; 4] = [2.0, 5.0, 10.0, 20.0];
/// With more straight stretches they stay as they were drawn.
const STRETCHES: usize = 8;
/// Most ends of straight stretches that are looked at.
const SHIFTED: usize = 64;
/// Where no sample tells of so much of a path, it stays as it was drawn; pitches.
const UNTOLD: f64 = 8.0;
/// Cost of each sample, in logarithms of chances, from which on an outline is not believed: what it
/// costs to toss for which are there. So it is where points lie in no columns.
const DOUBTFUL: f64 = core::f64::consts::LN_2;
/// Samples beside a path so long that trying others takes too long: straight stretches stay as
/// they were drawn.
const MANY: usize = 5000;
/// Shortest arc of a conic, and how much of it at each end tells nothing of it; pitches.
const ARC: f64 = 12.0;
const END: f64 = 1.5;
/// Farthest that splines may lie from the conic in their place, pitches.
const LIKE: f64 = 0.5;
/// What follows a conic has pieces no longer than this, pitches.
const PIECE: f64 = 3.0;
/// Most of them: a long path bends little.
const MOST_PIECES: f64 = 500.0;
/// Places at which a conic is followed lie so far apart, pitches.
const STEP: f64 = 0.5;

/// A path and what lies beside it.
pub(crate) struct Search<'a> {
    pub(crate) curve: &'a PiecewiseCubic<2>,
    pub(crate) course: &'a Course,
    pub(crate) is_closed: bool,
    /// 1 where the region lies to the left.
    pub(crate) side: f64,
    pub(crate) samples: &'a [Placed],
    /// Once the work is cancelled no more is tried, and what was found so far is of no use.
    pub(crate) monitor: &'a dyn Monitor,
}

/// Where a path is the likeliest.
#[derive(Debug, Clone)]
pub(crate) struct Likely {
    pub(crate) layout: Layout,
    /// As drawn anew, with the same ends.
    pub(crate) base: PiecewiseCubic<2>,
    /// How far it is to be moved inwards.
    pub(crate) sway: Sway,
    /// Minus the logarithm of its likelihood, and the price of its numbers.
    pub(crate) cost: f64,
}

/// A path drawn anew, and moved.
struct Found {
    layout: Layout,
    base: PiecewiseCubic<2>,
    sway: Sway,
    known: Known,
    tolerance: f64,
    cost: f64,
    sightings: Sightings,
    /// Bent stretches that are arcs of conics; what they gain is in the cost.
    conics: Vec<([f64; 2], Conic)>,
    gain: f64,
}

impl Search<'_> {
    /// The path by as few numbers as the samples ask for; `None` where they do not tell, where none is
    /// found that is as likely as what was drawn, or where the samples do not bear it out.
    pub(crate) fn best(&self) -> Option<Likely> {
        self.is_told_of().then_some(())?;
        let found = self.sought()?;
        let seen = self.seen_from(&found.path(self.side)?, NEAR + REDRAWN + FARTHEST);
        let is_whole = seen.len() == self.samples.len();
        let doubtful = DOUBTFUL * seen.len() as f64;
        let cost = Sightings::new(seen).cost();
        let is_likely = is_whole && cost <= self.cost_as_drawn() && cost <= doubtful;
        is_likely.then(|| Likely {
            layout: found.layout,
            base: found.base,
            sway: found.sway.with(&found.known),
            cost: found.cost,
        })
    }

    /// Whether there are samples on both sides all along: what nothing tells of stays as drawn.
    fn is_told_of(&self) -> bool {
        let seen = self.seen_from(self.curve, NEAR);
        let (first, last) = self.curve.domain();
        let is_told_by = |seen_there: bool| {
            let told = seen
                .iter()
                .filter(|s| (s.seen != Seen::Missing) == seen_there);
            let mut at: Vec<f64> = told.map(|s| s.along).collect();
            at.sort_unstable_by(f64::total_cmp);
            let (Some(start), Some(end)) = (at.first(), at.last()) else {
                return false;
            };
            let ends = if self.is_closed {
                [start + (last - first) - end, 0.0]
            } else {
                [*start, last - first - end]
            };
            let between = at.windows(2).map(|pair| pair[1] - pair[0]);
            between.chain(ends).all(|gap| gap <= UNTOLD)
        };
        is_told_by(true) && is_told_by(false)
    }

    fn sought(&self) -> Option<Found> {
        let drawn = Layout::of(self.curve, self.is_closed);
        if drawn.is_line() {
            return self.moved(&drawn, 1.0);
        }
        // Some of what was drawn straight may be no more than the steps between nodes.
        let mut best = cheapest([&drawn, &drawn.without_lines()].map(|l| self.of_layout(l)))?;
        // Bends are better known now than from what was drawn between nodes.
        let layout = best.layout.seen_from(&best.path(self.side)?);
        best = cheapest([self.of_layout(&layout), Some(best)])?;
        if self.samples.len() > MANY {
            return Some(self.drawn_by_conics(best));
        }
        while best.layout.straight.len() < STRETCHES {
            let others = straighter(&best.layout, &best.path(self.side)?);
            let Some(better) = self.better(&best, &others) else {
                break;
            };
            best = better;
        }
        if best.layout.straight.len() <= STRETCHES {
            best = self.with_ends_shifted(best);
        }
        Some(self.drawn_by_conics(best))
    }

    /// The same with straight stretches that begin and end where that is the likeliest: one end
    /// after the other, until none is better elsewhere.
    fn with_ends_shifted(&self, mut best: Found) -> Found {
        let (mut end, mut in_vain, mut tried) = (0, 0, 0);
        while in_vain < 2 * best.layout.straight.len() && tried < SHIFTED {
            end %= 2 * best.layout.straight.len();
            match self.better(&best, &shifted(&best.layout, end)) {
                Some(better) => (best, in_vain) = (better, 0),
                None => (end, in_vain) = (end + 1, in_vain + 1),
            }
            tried += 1;
        }
        best
    }

    /// The best by one of these layouts, where it is better.
    fn better(&self, best: &Found, layouts: &[Layout]) -> Option<Found> {
        let each = layouts
            .par_iter()
            .map(|layout| cheapest(FINER.map(|f| self.moved(layout, f * best.tolerance))));
        let found: Vec<Option<Found>> = each.collect();
        cheapest(found).filter(|found| found.cost < best.cost)
    }

    /// The path by splines that follow a layout as closely as the samples ask for.
    fn of_layout(&self, layout: &Layout) -> Option<Found> {
        cheapest(TOLERANCES.map(|tolerance| self.moved(layout, tolerance)))
    }

    /// The path drawn by splines of a layout, and moved to where it is the likeliest.
    fn moved(&self, layout: &Layout, tolerance: f64) -> Option<Found> {
        let splines = layout.splines(tolerance, MOST)?;
        self.monitor.check().ok()?;
        // A line that is drawn anew would only lose digits.
        let is_drawn = layout.is_line() && Layout::of(self.curve, self.is_closed).is_line();
        let base = if is_drawn {
            self.curve.clone()
        } else {
            let first = self.curve.domain().0;
            redraw(|along| self.curve.evaluate(first + along), &splines)?
        };
        self.is_beside(&base).then_some(())?;
        let seen = self.seen_from(&base, NEAR + REDRAWN);
        // What is drawn goes where the samples are, into notches, too.
        (seen.len() == self.samples.len()).then_some(())?;
        let sightings = Sightings::enough(seen)?;
        let (cost, sway, known) = Sway::of(&sightings, splines)?;
        (sway.farthest() <= FARTHEST).then_some(())?;
        let mut found = Found {
            layout: layout.clone(),
            base,
            sway,
            known,
            tolerance,
            cost,
            sightings,
            conics: Vec::new(),
            gain: 0.0,
        };
        self.seek_conics(&mut found);
        Some(found)
    }

    /// Whether a path runs where this one was drawn.
    fn is_beside(&self, path: &PiecewiseCubic<2>) -> bool {
        let (first, last) = path.domain();
        let steps = (last - first).ceil().max(1.0) as usize;
        (0..=steps)
            .map(|k| path.evaluate(first + (last - first) * k as f64 / steps as f64))
            .all(|place| self.course.place(self.curve, place, REDRAWN).is_some())
    }

    /// What the path costs as it was drawn.
    pub(crate) fn cost_as_drawn(&self) -> f64 {
        Sightings::new(self.seen_from(self.curve, NEAR)).cost()
    }

    /// The samples as seen from a path near the one that was drawn, but for those farther away
    /// than `near`.
    fn seen_from(&self, path: &PiecewiseCubic<2>, near: f64) -> Vec<Sighting> {
        let course = Course::of(path);
        let seen = self.samples.iter().filter_map(|sample| {
            let (at, left) = course.place(path, sample.place, near)?;
            Some(Sighting {
                along: at - path.domain().0,
                inside: self.side * left,
                place: sample.place,
                seen: sample.seen,
            })
        });
        seen.collect()
    }

    /// Looks for bent stretches that are arcs of conics, for their fewer numbers.
    fn seek_conics(&self, found: &mut Found) {
        let Some(path) = found.path(self.side) else {
            return;
        };
        for stretch in found.layout.bent() {
            let conic = self.conic(found, &path, stretch);
            if let Some((gain, conic)) = conic.filter(|(gain, _)| *gain > 0.0) {
                found.cost -= gain;
                found.gain += gain;
                found.conics.push((stretch, conic));
            }
        }
    }

    /// The same with its arcs of conics drawn as such.
    fn drawn_by_conics(&self, mut found: Found) -> Found {
        let drawn = || {
            let piece = PIECE.max(found.layout.length / MOST_PIECES);
            let splines = found.sway.splines().finer(piece)?;
            let amounts = self.amounts(&found)?;
            found.sway.replaced(splines, &amounts)
        };
        if found.conics.is_empty() {
            return found;
        }
        match drawn().filter(|sway| sway.farthest() <= FARTHEST) {
            Some(sway) => found.sway = sway,
            // It stays a spline, at a spline's price.
            None => found.cost += found.gain,
        }
        found
    }

    /// The conic nearest to a bent stretch of a path, and what it gains over splines.
    fn conic(
        &self,
        found: &Found,
        path: &PiecewiseCubic<2>,
        stretch: [f64; 2],
    ) -> Option<(f64, Conic)> {
        let layout = &found.layout;
        let [from, to] = stretch;
        (to - from >= ARC).then_some(())?;
        let first = path.domain().0;
        let steps = ((to - from - 2.0 * END) / STEP) as usize;
        let at = |k: usize| first + layout.on_path(from + END + k as f64 * STEP);
        let places: Vec<[f64; 2]> = (0..=steps).map(|k| path.evaluate(at(k))).collect();
        let middle = at(steps / 2);
        let [x, y] = path.derivative(middle, 1);
        let place = path.evaluate(middle);
        let inside = [place[0] - self.side * y, place[1] + self.side * x];

        let conic = Conic::near(&places, inside)?;
        places
            .iter()
            .all(|p| conic.inside(*p).abs() < LIKE)
            .then_some(())?;

        let lines = layout.lines_beside(stretch);
        let is_whole = self.is_closed && lines == 0;
        let part = found.sightings.those(|s| {
            let into = layout.within_stretch(s.along, stretch);
            is_whole || into.is_some_and(|into| into > END && to - from - into > END)
        });
        let splines = found.sway.splines();
        let pieces = splines.pieces_between(from, to)
            + splines.pieces_between(from - layout.length, to - layout.length);
        // Where it goes over into a line, two of a spline's numbers are the line's.
        let numbers = if is_whole {
            pieces
        } else {
            (pieces + 3).saturating_sub(2 * lines)
        };
        let (cost, conic) = conic.likeliest(&part)?;
        let free = part.elsewhere(|s| s.inside - found.sway.at(s.along, 0));
        let gain = free.cost() + part.price(numbers) - cost - part.price(conic::NUMBERS);
        Some((gain, conic))
    }

    /// How far the path lies off inwards at places along it.
    fn amounts(&self, found: &Found) -> Option<Vec<(f64, f64)>> {
        let layout = &found.layout;
        let first = found.base.domain().0;
        let steps = (layout.length / STEP).ceil() as usize;
        let mut amounts = Vec::with_capacity(steps + 1);
        for k in 0..=steps {
            let along = layout.length * k as f64 / steps as f64;
            let within = found.conics.iter().find_map(|(stretch, conic)| {
                let into = layout.within_stretch(along, *stretch)?;
                Some((into, *stretch, conic))
            });
            let Some((into, [from, to], conic)) = within else {
                amounts.push((along, found.sway.at(along, 0)));
                continue;
            };
            // Where it goes over into a line there may be a step.
            let goes_on = self.is_closed && layout.lines_beside([from, to]) == 2;
            let is_step = ((goes_on || from > 0.0) && into < END)
                || ((goes_on || to != layout.length) && to - from - into < END);
            if is_step {
                continue;
            }
            let place = found.base.evaluate(first + along);
            let [x, y] = found.base.derivative(first + along, 1);
            let scale = self.side / norm([x, y]);
            amounts.push((along, conic.along(place, [-y * scale, x * scale])?));
        }
        Some(amounts)
    }
}

impl Found {
    /// The path where it is the likeliest.
    fn path(&self, side: f64) -> Option<PiecewiseCubic<2>> {
        let sway = if side > 0.0 {
            self.sway.clone()
        } else {
            self.sway.clone().reversed()
        };
        let (first, last) = self.base.domain();
        let ends = [first, last].map(|at| {
            let [x, y] = self.base.derivative(at, 1);
            let by = sway.at(at - first, 0) / norm([x, y]);
            [-y * by, x * by]
        });
        bent(&self.base, Some(&sway), ends)
    }
}

/// The one of least cost; the first of several.
fn cheapest(found: impl IntoIterator<Item = Option<Found>>) -> Option<Found> {
    let found = found.into_iter().flatten();
    found.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Layouts with one straight stretch more, where the path runs nearly straight.
fn straighter(layout: &Layout, path: &PiecewiseCubic<2>) -> Vec<Layout> {
    let first = path.domain().0;
    let bent = layout.bent().into_iter();
    let mut all = Vec::new();
    for [from, to] in bent {
        let steps = ((to - from) / RUN_STEP) as usize;
        let at = |k: usize| from + k as f64 * RUN_STEP;
        let places: Vec<[f64; 2]> = (0..=steps)
            .map(|k| path.evaluate(first + layout.on_path(at(k))))
            .collect();
        let Some((start, end)) = longest_run(&places) else {
            continue;
        };
        // To the very end of the path, if that is near.
        let starts = SHORTER.map(|by| at(start) + by);
        let ends = SHORTER.map(|by| at(end) - by);
        let starts = if start == 0 { &[from][..] } else { &starts };
        let ends = if end == steps { &[to][..] } else { &ends };
        for start in starts {
            all.extend(ends.iter().filter_map(|end| layout.and([*start, *end])));
        }
    }
    all
}

/// The longest run of places near the chord between its ends.
fn longest_run(places: &[[f64; 2]]) -> Option<(usize, usize)> {
    let is_run = |from: usize, to: usize| {
        let near = |p: &[f64; 2]| distance_to_segment(*p, places[from], places[to]) <= NEARLY;
        places[from..=to].iter().all(near)
    };
    let mut best: Option<(usize, usize)> = None;
    let mut from = 0;
    while from + 2 < places.len() {
        // One step longer than the best.
        let mut to = from + best.map_or(2, |(a, b)| b - a + 1);
        while to < places.len() && is_run(from, to) {
            best = Some((from, to));
            to += 1;
        }
        from += 1;
    }
    best
}

/// Layouts of which a straight stretch begins or ends elsewhere, or is missing. Ends are counted
/// through all stretches, two of each.
fn shifted(layout: &Layout, end: usize) -> Vec<Layout> {
    let (k, is_last) = (end / 2, end % 2 == 1);
    let Some(&stretch) = layout.straight.get(k) else {
        return Vec::new();
    };
    let before = k.checked_sub(1).map_or(0.0, |k| layout.straight[k][1]);
    let after = layout.straight.get(k + 1).map_or(layout.length, |s| s[0]);
    let [from, to] = stretch;
    let (old, low, high) = if is_last {
        (to, from, after)
    } else {
        (from, before, to)
    };
    let mut stretches = Vec::new();
    if old > 0.0 && old < layout.length {
        let moved = SHIFTS.iter().flat_map(|by| [old - by, old + by]);
        let within = moved.filter(|at| *at > low && *at < high);
        stretches.extend(within.map(|at| if is_last { [from, at] } else { [at, to] }));
    }
    if !is_last {
        stretches.push([from, from]);
    }
    let mut all: Vec<Layout> = Vec::new();
    for stretch in stretches {
        let other = layout.with(k, stretch);
        if !all.contains(&other) {
            all.push(other);
        }
    }
    all
}
