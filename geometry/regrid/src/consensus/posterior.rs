//! What is believed of an edge between two sets of samples: the mean of all curves near a
//! known line, each weighted by the samples that it leaves on the wrong side.

use core::ops::Range;

use super::at_issue::AtIssue;
use super::side::Labelled;

/// How far from the line that is known others are looked at: offset, slope and bend, in
/// spacings.
const WITHIN: [f64; 3] = [1.5, 0.3, 0.02];
/// Curves tried per search: offsets, slopes and bends.
const STRAIGHT: [usize; 3] = [11, 11, 1];
const BENT: [usize; 3] = [9, 9, 5];
/// Searches, each among what the one before left likely.
const SEARCHES: usize = 6;
/// Logarithm of the odds against the best curve beyond which another is not likely.
const UNLIKELY: f64 = 7.0;
/// How well the edge is known, in spacings, when no further search is worth its time.
const KNOWN: f64 = 0.005;

/// Radius of the laser's spot, about, in spacings: part of it may be on a surface that its
/// middle just misses.
const SPOT: f64 = 0.25;

/// A curve `across = offset + slope along + bend along^2`.
pub(crate) type Curve = [f64; 3];

/// A sample that wants to have the edge on one side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Witness {
    pub(super) along: f64,
    pub(super) across: f64,
    /// 1 above the edge, -1 below.
    pub(super) side: f64,
    /// Logarithm of the odds that it tells the truth, 0 or more.
    pub(super) trust: f64,
}

/// The samples that tell where an edge is; keeps its buffers.
#[derive(Debug, Default)]
pub(crate) struct Posterior {
    witnesses: Vec<Witness>,
    /// Those that the curves searched among disagree about.
    at_issue: AtIssue,
    costs: Vec<f64>,
}

impl Posterior {
    /// Forgets all samples.
    pub(crate) fn begin(&mut self) {
        self.witnesses.clear();
    }

    /// Takes a sample above the edge, where `side` is positive, or below; `trust` is the
    /// logarithm of the odds that it is.
    pub(crate) fn hear(&mut self, along: f64, across: f64, side: f64, trust: f64) {
        self.witnesses.push(Witness {
            along,
            across,
            side,
            trust,
        });
    }

    /// Takes a labelled sample.
    pub(super) fn weigh(&mut self, sample: &Labelled, along: f64, across: f64) {
        let (side, trust) = (sample.label, sample.trust);
        self.hear(along, across, side, trust.min(sample.trust_beside));
        if sample.trust_beside < trust {
            self.hear(
                along,
                across + side * SPOT,
                side,
                trust - sample.trust_beside,
            );
        }
    }

    /// The mean of the straight lines near `across = 0`.
    pub(crate) fn line(&mut self) -> Curve {
        self.mean(STRAIGHT)
    }

    /// The mean of the parabolas near `across = 0`.
    pub(crate) fn parabola(&mut self) -> Curve {
        self.mean(BENT)
    }

    fn mean(&mut self, tried: [usize; 3]) -> Curve {
        let mut ranges = WITHIN.map(|most| -most..most);
        if tried[2] == 1 {
            ranges[2] = 0.0..0.0;
        }
        let mut mean = [0.0; 3];
        for _ in 0..SEARCHES {
            let likely;
            (mean, likely) = self.search(&ranges, tried);
            let known = likely[0].end - likely[0].start < KNOWN;
            if known || likely == ranges {
                break;
            }
            ranges = likely;
        }
        mean
    }

    /// The mean of the curves tried in these ranges, and the ranges of those that are likely.
    fn search(&mut self, ranges: &[Range<f64>; 3], tried: [usize; 3]) -> (Curve, [Range<f64>; 3]) {
        let middle = |k: usize| 0.5 * (ranges[k].start + ranges[k].end);
        let half = |k: usize| 0.5 * (ranges[k].end - ranges[k].start);
        let (centre, reach) = ([0, 1, 2].map(middle), [0, 1, 2].map(half));
        let step = [0, 1, 2].map(|k| 2.0 * reach[k] / tried[k] as f64);
        self.at_issue.clear();
        for w in &self.witnesses {
            let along = w.along.abs();
            let room = w.side * (w.across - at(&centre, w.along));
            let reach_there = reach[0] + along * (reach[1] + along * reach[2]);
            if room.abs() <= reach_there {
                let cell = 0.5 * (step[0] + along * (step[1] + along * step[2]));
                self.at_issue.push(w, cell);
            }
        }
        let value = |k: usize, number: usize| ranges[k].start + (number as f64 + 0.5) * step[k];
        let numbers = |place: usize| {
            [
                place / (tried[1] * tried[2]),
                place / tried[2] % tried[1],
                place % tried[2],
            ]
        };
        let curves = (0..tried[0] * tried[1] * tried[2]).map(|place| {
            let [i, j, k] = numbers(place);
            [value(0, i), value(1, j), value(2, k)]
        });
        self.at_issue.costs(curves, UNLIKELY, &mut self.costs);
        let least = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let (mut sum, mut all) = ([0.0; 3], 0.0);
        let mut likely = tried.map(|number| (number, 0));
        for (place, cost) in self.costs.iter().enumerate() {
            if *cost > least + UNLIKELY {
                continue;
            }
            let numbers = numbers(place);
            let weight = libm::exp(least - cost);
            all += weight;
            for k in 0..3 {
                sum[k] += weight * value(k, numbers[k]);
                likely[k] = (likely[k].0.min(numbers[k]), likely[k].1.max(numbers[k]));
            }
        }
        let left = [0, 1, 2].map(|k| {
            // What lies beside a likely curve may be as likely.
            let (first, last) = (likely[k].0.saturating_sub(1), likely[k].1 + 2);
            ranges[k].start + first as f64 * step[k]
                ..ranges[k].start + last.min(tried[k]) as f64 * step[k]
        });
        (sum.map(|value| value / all), left)
    }
}

pub(super) fn at(curve: &Curve, along: f64) -> f64 {
    curve[0] + along * (curve[1] + along * curve[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rows_leave_the_lines_between_them() {
        let mut posterior = Posterior::default();
        posterior.begin();
        for along in [-10.0, -2.0, 3.0, 10.0] {
            posterior.hear(along, 0.5, 1.0, 5.0);
            posterior.hear(along, -0.1, -1.0, 5.0);
        }
        let [offset, slope, bend] = posterior.line();
        assert!((offset - 0.2).abs() < 0.01, "{offset}");
        assert!(slope.abs() < 1e-3 && bend == 0.0);
    }

    #[test]
    fn a_sample_of_little_trust_gives_way() {
        let mut posterior = Posterior::default();
        posterior.begin();
        for k in -12..=12 {
            let along = f64::from(k);
            let start = libm::fmod(0.618 * f64::from(k + 100), 1.0);
            posterior.hear(along, 0.3 + 0.1 * along + start, 1.0, 6.0);
            posterior.hear(along, 0.3 + 0.1 * along + start - 1.0, -1.0, 3.0);
        }
        let clean = posterior.line();
        for (k, trust) in [(-7, 3.0), (4, 3.0)] {
            let along = f64::from(k);
            posterior.hear(along, 0.3 + 0.1 * along + 0.8, -1.0, trust);
        }
        let line = posterior.line();
        assert!((clean[0] - 0.3).abs() < 0.05 && (clean[1] - 0.1).abs() < 0.01);
        assert!((line[0] - clean[0]).abs() < 0.03, "{line:?} {clean:?}");
        assert!((line[1] - clean[1]).abs() < 0.005, "{line:?} {clean:?}");
    }

    #[test]
    fn a_parabola_is_found() {
        let mut posterior = Posterior::default();
        posterior.begin();
        for k in -14..=14 {
            let along = f64::from(k);
            let start = libm::fmod(0.618 * f64::from(k + 100), 1.0);
            let edge = 0.2 - 0.05 * along + along * along / 90.0;
            posterior.hear(along, edge + start, 1.0, 6.0);
            posterior.hear(along, edge + start - 1.0, -1.0, 3.0);
        }
        let [offset, slope, bend] = posterior.parabola();
        assert!((offset - 0.2).abs() < 0.06, "{offset}");
        assert!((slope + 0.05).abs() < 0.01, "{slope}");
        assert!((bend - 1.0 / 90.0).abs() < 1e-3, "{bend}");
    }
}
