//! Basis functions of a grid at observations, line by line of equal u.

use core::ops::Range;
use std::collections::HashMap;

use pulp::{Arch, Simd, WithSimd};

use super::UniformSpline;
use crate::fit::Observation;

/// Observations and what a spline leaves of them, line by line of equal u.
#[derive(Debug, Clone)]
pub struct Lines<'a> {
    observations: &'a [Observation],
    lines: Vec<(f64, Range<usize>)>,
    /// The places in v at which there are observations, each once: those of a grid have few.
    places: Vec<f64>,
    /// Which of them each observation is at.
    at: Vec<u32>,
    weights: Vec<f64>,
}

impl<'a> Lines<'a> {
    /// Gathers neighbours in the list that have one u. Work grows with the number of such
    /// lines, so observations of a grid should come line by line.
    #[must_use]
    pub fn new(observations: &'a [Observation]) -> Self {
        let mut lines: Vec<(f64, Range<usize>)> = Vec::new();
        for (k, o) in observations.iter().enumerate() {
            match lines.last_mut() {
                Some((u, range)) if *u == o.u => range.end = k + 1,
                _ => lines.push((o.u, k..k + 1)),
            }
        }
        let (places, at) = places(observations);
        Self {
            observations,
            lines,
            places,
            at,
            weights: observations.iter().map(|o| o.weight).collect(),
        }
    }

    /// The observations.
    #[must_use]
    pub fn observations(&self) -> &'a [Observation] {
        self.observations
    }
}

/// The different v of observations, in the order in which they are met, and which of them each is.
fn places(observations: &[Observation]) -> (Vec<f64>, Vec<u32>) {
    let mut places: Vec<f64> = Vec::new();
    let mut known: HashMap<u64, u32> = HashMap::new();
    let mut at: Vec<u32> = Vec::with_capacity(observations.len());
    for o in observations {
        // On a grid, what comes next in one line does so in the others.
        let next = at.last().map_or(0, |last| last + 1);
        let is_next = |v: &f64| v.to_bits() == o.v.to_bits();
        at.push(if places.get(next as usize).is_some_and(is_next) {
            next
        } else {
            *known.entry(o.v.to_bits()).or_insert_with(|| {
                places.push(o.v);
                places.len() as u32 - 1
            })
        });
    }
    (places, at)
}

/// Index of the first of four functions that do not vanish at a place, and their values.
type Basis = (usize, [f64; 4]);

/// Basis functions of a grid at observations, those of some functions only.
pub(super) struct Design<'a> {
    lines: &'a Lines<'a>,
    u: Vec<Basis>,
    /// At each of the places in v.
    v: Vec<Basis>,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// What of each line is asked.
    parts: Vec<Part>,
}

/// What of a line lies under functions that are asked.
#[derive(Debug, Clone, Default)]
struct Part {
    /// Its observations.
    observations: Runs,
    /// The rows of all functions that these lie under.
    near: Runs,
    /// The rows of those that are asked.
    asked: Runs,
}

/// Numbers that follow each other, run by run.
pub(super) type Runs = Vec<Range<usize>>;

fn whole(run: Range<usize>) -> Runs {
    core::iter::once(run).collect()
}

/// The runs of those of some numbers, ascending, that are wanted.
pub(super) fn runs(numbers: Range<usize>, wanted: impl Fn(usize) -> bool) -> Runs {
    let mut runs = Runs::new();
    for k in numbers.filter(|k| wanted(*k)) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end += 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// Runs that reach so much farther on either side, up to an end.
fn widened(runs: &Runs, by: usize, end: usize) -> Runs {
    let mut wide = Runs::new();
    for run in runs {
        let run = run.start.saturating_sub(by)..(run.end + by).min(end);
        match wide.last_mut() {
            Some(last) if last.end >= run.start => last.end = run.end,
            _ => wide.push(run),
        }
    }
    wide
}

impl<'a> Design<'a> {
    /// All functions of a spline.
    pub(super) fn new(spline: &UniformSpline, lines: &'a Lines<'a>) -> Self {
        let rows = spline.v.functions();
        let all = lines.lines.iter().map(|(_, range)| Part {
            observations: whole(range.clone()),
            near: whole(0..rows),
            asked: whole(0..rows),
        });
        Self {
            lines,
            u: lines.lines.iter().map(|l| spline.u.basis(l.0)).collect(),
            v: lines.places.iter().map(|v| spline.v.basis(*v)).collect(),
            columns: spline.u.functions(),
            rows,
            parts: all.collect(),
        }
    }

    /// The same, for coefficients that are 0 but where they are free, and for sums that are asked of
    /// free functions only: observations under none of these are passed over.
    pub(super) fn restricted(mut self, free: &[bool]) -> Self {
        let rows = self.rows;
        let mut is_asked = vec![false; rows];
        let lines = self.lines.lines.iter().zip(&self.u);
        for (((_, range), (i, _)), part) in lines.zip(&mut self.parts) {
            is_asked.fill(false);
            for line in free[i * rows..][..4 * rows].chunks_exact(rows) {
                for (asked, free) in is_asked.iter_mut().zip(line) {
                    *asked |= free;
                }
            }
            part.asked = runs(0..rows, |j| is_asked[j]);
            // Of the four functions at an observation only one may be asked.
            part.near = widened(&part.asked, 3, rows);
            part.observations = runs(range.clone(), |k| {
                let first = self.v[self.lines.at[k] as usize].0;
                is_asked[first..first + 4].contains(&true)
            });
        }
        self
    }

    /// Values at the observations of the function with these coefficients; those passed over stay.
    pub(super) fn values(&self, coefficients: &[f64], values: &mut [f64]) {
        Arch::new().dispatch(Valued {
            design: self,
            coefficients,
            values,
        });
    }

    /// Weighted sums over the observations of `values` times each function that is asked; those of
    /// others are of some of the observations only.
    pub(super) fn sums(&self, values: &[f64], sums: &mut [f64]) {
        Arch::new().dispatch(Gathered {
            design: self,
            value: |k: usize| self.lines.weights[k] * values[k],
            power: |b| b,
            sums,
        });
    }

    /// Weighted sums over the observations of the square of each function.
    pub(super) fn masses(&self) -> Vec<f64> {
        let mut masses = vec![0.0; self.columns * self.rows];
        Arch::new().dispatch(Gathered {
            design: self,
            value: |k: usize| self.lines.weights[k],
            power: |b| b * b,
            sums: &mut masses,
        });
        masses
    }

    /// Adds some observations that follow each other to the sums of their line.
    #[inline(always)]
    fn gather_run(
        &self,
        run: Range<usize>,
        value: &impl Fn(usize) -> f64,
        power: &impl Fn(f64) -> f64,
        gathered: &mut [f64],
    ) {
        // Neighbours lie under the same four functions, mostly: their sums are at hand.
        let mut first = self.v[self.lines.at[run.start] as usize].0;
        let mut four = four_of(gathered, first);
        for k in run {
            let (next, b) = &self.v[self.lines.at[k] as usize];
            if *next != first {
                gathered[first..][..4].copy_from_slice(&four);
                first = *next;
                four = four_of(gathered, first);
            }
            let value = value(k);
            for (sum, b) in four.iter_mut().zip(b) {
                *sum += power(*b) * value;
            }
        }
        gathered[first..][..4].copy_from_slice(&four);
    }
}

/// See [`Design::values`]; with the lanes that the processor has.
struct Valued<'a> {
    design: &'a Design<'a>,
    coefficients: &'a [f64],
    values: &'a mut [f64],
}

impl WithSimd for Valued<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (design, coefficients) = (self.design, self.coefficients);
        let mut combined = vec![0.0; design.rows];
        for (part, (i, a)) in design.parts.iter().zip(&design.u) {
            for near in &part.near {
                let line = |k: usize| &coefficients[(i + k) * design.rows..][near.clone()];
                let lines = line(0).iter().zip(line(1)).zip(line(2)).zip(line(3));
                for (sum, (((c0, c1), c2), c3)) in combined[near.clone()].iter_mut().zip(lines) {
                    *sum = a[0] * c0 + a[1] * c1 + a[2] * c2 + a[3] * c3;
                }
            }
            for run in &part.observations {
                let at = &design.lines.at[run.clone()];
                for (value, at) in self.values[run.clone()].iter_mut().zip(at) {
                    let (first, b) = &design.v[*at as usize];
                    let c = &combined[*first..][..4];
                    *value = b[0] * c[0] + b[1] * c[1] + b[2] * c[2] + b[3] * c[3];
                }
            }
        }
    }
}

/// Sums over the observations of some value of each times a power of each function.
struct Gathered<'a, V, P> {
    design: &'a Design<'a>,
    value: V,
    power: P,
    sums: &'a mut [f64],
}

impl<V: Fn(usize) -> f64, P: Fn(f64) -> f64> WithSimd for Gathered<'_, V, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            design,
            value,
            power,
            sums,
        } = self;
        sums.fill(0.0);
        let mut gathered = vec![0.0; design.rows];
        for (part, (i, a)) in design.parts.iter().zip(&design.u) {
            for near in &part.near {
                gathered[near.clone()].fill(0.0);
            }
            for run in &part.observations {
                design.gather_run(run.clone(), &value, &power, &mut gathered);
            }
            for (k, a) in a.iter().enumerate() {
                let factor = power(*a);
                let line = &mut sums[(i + k) * design.rows..][..design.rows];
                for asked in &part.asked {
                    let own = &gathered[asked.clone()];
                    for (sum, g) in line[asked.clone()].iter_mut().zip(own) {
                        *sum += factor * g;
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn four_of(values: &[f64], first: usize) -> [f64; 4] {
    let mut four = [0.0; 4];
    four.copy_from_slice(&values[first..][..4]);
    four
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uniform::Parameter;

    /// Observations on lines that begin and end anywhere, with gaps.
    fn observations() -> Vec<Observation> {
        let places = (0..50).flat_map(|i| (i % 7..60 - i % 5).map(move |j| (i, j)));
        let seen = places.filter(|(i, j)| (i * 3 + j) % 11 != 0 && (j + i / 4) % 17 > 2);
        let observed = seen.map(|(i, j)| Observation {
            u: 0.2 * f64::from(i),
            v: 0.1 * f64::from(j),
            value: libm::sin(f64::from(i * j)),
            weight: f64::from(i % 3 + 1),
        });
        observed.collect()
    }

    #[test]
    fn what_is_passed_over_changes_no_bit() {
        let observations = observations();
        let lines = Lines::new(&observations);
        let of = |k: usize| lines.places[lines.at[k] as usize];
        assert!(observations.iter().enumerate().all(|(k, o)| of(k) == o.v));
        assert_eq!(lines.places.len(), 60);
        let (u, v) = ((-0.3, 10.0), (-0.1, 6.2));
        let mut spline =
            UniformSpline::fit_polynomial(u, v, &[(0, 0)], &observations, 0.0).unwrap();
        for along in [Parameter::U, Parameter::V].repeat(3) {
            spline = spline.halved(along);
        }
        let (columns, rows) = spline.functions();
        let free: Vec<bool> = (0..columns * rows)
            .map(|k| (k / rows + k % rows) % 9 < 2 && k / rows > 3)
            .collect();
        let all = Design::new(&spline, &lines);
        let some = Design::new(&spline, &lines).restricted(&free);
        let observed = |design: &Design<'_>| -> usize {
            let parts = design.parts.iter().flat_map(|part| &part.observations);
            parts.map(ExactSizeIterator::len).sum()
        };
        assert!(observed(&some) < observed(&all));

        let coefficient = |(k, free): (usize, &bool)| if *free { libm::cos(k as f64) } else { 0.0 };
        let coefficients: Vec<f64> = free.iter().enumerate().map(coefficient).collect();
        let values = |design: &Design<'_>| {
            let mut values = vec![0.0; observations.len()];
            design.values(&coefficients, &mut values);
            values
        };
        assert_eq!(values(&all), values(&some));
        let sums = |design: &Design<'_>| {
            let mut sums = vec![1.0; free.len()];
            design.sums(&values(&all), &mut sums);
            let of_free = sums.iter().zip(&free).filter(|(_, free)| **free);
            of_free.map(|(sum, _)| *sum).collect::<Vec<f64>>()
        };
        assert_eq!(sums(&all), sums(&some));
    }
}
