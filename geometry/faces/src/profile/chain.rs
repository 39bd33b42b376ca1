//! A profile as a chain of lines and arcs.

use super::curve::{Curve, Moments};
use super::cut::Cut;
use super::stations::Station;

/// Rounds of placing breaks and fitting the curves between them.
const ROUNDS: usize = 3;
/// Places at which two curves are compared around their break.
const LOOKED_AT: usize = 101;
/// Twice the logarithm of the odds by which samples must speak against the place where two curves
/// meet for their break to lie elsewhere: what each number of a shape costs above its price.
const DOUBT: f64 = 4.0;

/// Curves one after the other, and the s at which each ends and the next begins.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub(super) curves: Vec<Curve>,
    pub(super) breaks_mm: Vec<f64>,
    /// How many numbers arcs that touch lines have less than others, with their ends.
    pub(super) spared: f64,
    /// Of the stations: small numbers keep their digits.
    middle: [f64; 2],
}

impl Chain {
    /// The chain of these cuts. Breaks lie up to `reach_mm` from
    /// there. `None` where there is no such chain.
    pub(super) fn of(stations: &[Station], cuts: &[Cut], reach_mm: f64) -> Option<Self> {
        let middle = middle(stations);
        let own: Vec<Station> = stations.iter().map(|s| moved(s, middle)).collect();
        let between = |cut: &Cut| 0.5 * (own[cut.first - 1].s_mm + own[cut.first].s_mm);
        let mut breaks_mm: Vec<f64> = cuts.iter().skip(1).map(between).collect();
        let mut curves = fitted(&own, &breaks_mm, cuts)?;
        for _ in 0..ROUNDS {
            let place = |k: usize| placed(&own, &curves, &breaks_mm, k, reach_mm);
            breaks_mm = (0..breaks_mm.len()).map(place).collect();
            curves = fitted(&own, &breaks_mm, cuts)?;
        }
        let ascend = breaks_mm.windows(2).all(|pair| pair[0] < pair[1]);
        ascend.then_some(Self {
            curves,
            breaks_mm,
            spared: 0.0,
            middle,
        })
    }

    /// Which curve is that of s.
    pub(super) fn at(&self, s_mm: f64) -> usize {
        self.seen_at(s_mm - self.middle[0])
    }

    /// The same of s from the middle.
    pub(super) fn seen_at(&self, s_mm: f64) -> usize {
        self.breaks_mm.iter().filter(|end| **end <= s_mm).count()
    }

    /// Stations from the middle, as curves and breaks are told.
    pub(super) fn seen(&self, stations: &[Station]) -> Vec<Station> {
        stations.iter().map(|s| moved(s, self.middle)).collect()
    }

    /// How far a point lies above the chain along its normal, and the slope there.
    pub(super) fn off(&self, s_mm: f64, t_mm: f64) -> (f64, f64) {
        self.curves[self.at(s_mm)].off(s_mm - self.middle[0], t_mm - self.middle[1])
    }

    /// Its free numbers.
    pub(super) fn freedom(&self) -> f64 {
        let curves = self.curves.iter().map(Curve::freedom).sum::<f64>();
        curves + self.breaks_mm.len() as f64 - self.spared
    }

    /// The weighted squares that it leaves.
    pub(super) fn left(&self, stations: &[Station]) -> f64 {
        self.left_seen(&self.seen(stations))
    }

    /// The same of stations from the middle.
    pub(super) fn left_seen(&self, stations: &[Station]) -> f64 {
        let curve = |s: &Station| &self.curves[self.seen_at(s.s_mm)];
        stations.iter().map(|s| square(curve(s), s)).sum()
    }
}

/// The weighted squares that a curve leaves of stations.
pub(super) fn left(curve: &Curve, stations: &[Station]) -> f64 {
    stations.iter().map(|s| square(curve, s)).sum()
}

/// What a curve leaves of a station.
pub(super) fn square(curve: &Curve, station: &Station) -> f64 {
    station.weight * curve.off(station.s_mm, station.t_mm).0.powi(2)
}

/// The middle of stations.
pub(super) fn middle(stations: &[Station]) -> [f64; 2] {
    let count = stations.len().max(1) as f64;
    let s: f64 = stations.iter().map(|s| s.s_mm).sum();
    let t: f64 = stations.iter().map(|s| s.t_mm).sum();
    [s / count, t / count]
}

/// A station seen from a middle.
pub(super) fn moved(station: &Station, middle: [f64; 2]) -> Station {
    Station {
        s_mm: station.s_mm - middle[0],
        t_mm: station.t_mm - middle[1],
        ..*station
    }
}

/// The curves between breaks, of given kinds.
fn fitted(stations: &[Station], breaks_mm: &[f64], cuts: &[Cut]) -> Option<Vec<Curve>> {
    let ends = breaks_mm.iter().copied().chain([f64::INFINITY]);
    let starts = [f64::NEG_INFINITY]
        .into_iter()
        .chain(breaks_mm.iter().copied());
    let curve = |((start, end), cut): ((f64, f64), &Cut)| {
        let is_own = |s: &&Station| s.s_mm >= start && s.s_mm < end;
        let own: Vec<&Station> = stations.iter().filter(is_own).collect();
        let (first, last) = (own.first()?, own.last()?);
        let moments = own.iter().fold(Moments::default(), |sum, s| sum.with(s));
        if cut.is_arc {
            moments.arc(first.s_mm, last.s_mm).map(|(arc, _)| arc)
        } else {
            Some(moments.line().0)
        }
    };
    starts.zip(ends).zip(cuts).map(curve).collect()
}

/// Where a curve and the next meet, as far as stations do not speak against it; else where these
/// have the break.
fn placed(
    stations: &[Station],
    curves: &[Curve],
    breaks_mm: &[f64],
    k: usize,
    reach_mm: f64,
) -> f64 {
    let now = breaks_mm[k];
    // Breaks do not pass each other.
    let before = k
        .checked_sub(1)
        .map_or(f64::NEG_INFINITY, |b| 0.5 * (breaks_mm[b] + now));
    let after = breaks_mm
        .get(k + 1)
        .map_or(f64::INFINITY, |next| 0.5 * (next + now));
    let (low, high) = (before.max(now - reach_mm), after.min(now + reach_mm));
    let [a, b] = [curves[k], curves[k + 1]];
    let near: Vec<&Station> = stations
        .iter()
        .filter(|s| s.s_mm > low && s.s_mm < high)
        .collect();
    let cost = |at_mm: f64| {
        let costs = near
            .iter()
            .map(|s| square(if s.s_mm < at_mm { &a } else { &b }, s));
        costs.sum::<f64>()
    };
    let least = |a: (f64, f64), b: (f64, f64)| if b.0 < a.0 { b } else { a };
    let between = near
        .windows(2)
        .map(|pair| 0.5 * (pair[0].s_mm + pair[1].s_mm));
    let best = between
        .map(|at| (cost(at), at))
        .fold((cost(now), now), least);
    let met = meetings(&a, &b, low, high).into_iter();
    let met = met.filter(|at| cost(*at) <= best.0 + DOUBT);
    let nearest = met.min_by(|a, b| (a - best.1).abs().total_cmp(&(b - best.1).abs()));
    nearest.unwrap_or(best.1)
}

/// Where two curves cross or touch. Curves that touch come close to each other without crossing, or
/// cross twice beside the place.
fn meetings(a: &Curve, b: &Curve, low: f64, high: f64) -> Vec<f64> {
    let step = (high - low) / (LOOKED_AT - 1) as f64;
    let apart = |k: usize| {
        let s = low + step * k as f64;
        Some((s, a.height(s)? - b.height(s)?))
    };
    let apart: Vec<(f64, f64)> = (0..LOOKED_AT).filter_map(apart).collect();
    let crossings = apart.windows(2).filter(|pair| pair[0].1 * pair[1].1 < 0.0);
    let crossings = crossings.map(|pair| {
        let share = pair[0].1 / (pair[0].1 - pair[1].1);
        pair[0].0 + share * (pair[1].0 - pair[0].0)
    });
    let crossings: Vec<f64> = crossings.collect();
    match crossings[..] {
        [first, second] => vec![0.5 * (first + second)],
        [] => {
            let closest = (1..apart.len().saturating_sub(1))
                .min_by(|a, b| apart[*a].1.abs().total_cmp(&apart[*b].1.abs()));
            let is_within = |k: &usize| {
                let own = apart[*k].1.abs();
                own < apart[k - 1].1.abs() && own < apart[k + 1].1.abs()
            };
            closest
                .filter(is_within)
                .map(|k| apart[k].0)
                .into_iter()
                .collect()
        }
        _ => crossings,
    }
}
