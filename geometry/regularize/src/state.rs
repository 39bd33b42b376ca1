//! All shapes together, and what is known of them once rules hold.
//!
//! Free numbers x have the covariance C about where the fits left them. Where a x = b is to hold,
//! the likeliest numbers are those that C a / (a C a) of what is left of b adds, and C loses
//! C a (C a)^T / (a C a): the solution of the weighted least squares with a multiplier for each
//! equation, one by one (Mikhail and Ackermann 1976, "Observations and least squares", sequential
//! adjustment). Nothing is inverted, so that what is hardly known does no harm.

use nalgebra::{Matrix3, SMatrix, SymmetricEigen, Vector3};

use crate::chance::{ball, survival};
use crate::chart::{Chart, MOST, Told};
use crate::rule::{ROWS, Rule, Unit};

/// Share of its variance below which what an equation is off does not vary any more: other rules
/// have settled it. Those that were accepted since all were last solved for together hold to first
/// order only, which leaves up to some millionths.
const SETTLED: f64 = 1e-4;
/// Standard deviations that what is settled may be off and still be what others rules make it.
const LEFT: f64 = 0.05;
/// Rounds of making rules linear, and the change in standard deviations at which they end.
const ROUNDS: usize = 12;
const ENDED: f64 = 1e-7;

/// All shapes, with what is known of them.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) charts: Vec<Chart>,
    /// Where each shape's free numbers begin, and where the last's end.
    first: Vec<usize>,
    /// Covariance of each shape as it was fitted.
    fitted: Vec<SMatrix<f64, MOST, MOST>>,
    /// The free numbers.
    pub(crate) moved: Vec<f64>,
    /// Their covariance, row by row.
    covariance: Vec<f64>,
    /// Size of the part.
    pub(crate) size_mm: f64,
}

/// A rule that holds, by those of its equations that nothing else had settled.
#[derive(Debug, Clone)]
pub(crate) struct Held {
    pub(crate) rule: Rule,
    /// Each a sum of the rule's equations with these factors.
    sums: Vec<Vector3<f64>>,
}

/// How a rule stands to what is known.
#[derive(Debug, Clone)]
pub(crate) struct Standing {
    /// Square of how far it is off, in standard deviations, but for what is settled.
    pub(crate) squares: f64,
    /// Equations that are not settled.
    pub(crate) freedom: usize,
    /// Probability that noise alone leaves it so far off.
    pub(crate) p: f64,
    /// Probability that things without any tie are so near.
    pub(crate) chance: f64,
    /// Logarithm of how many times likelier what was measured is if it holds than if not.
    pub(crate) log_odds: f64,
    /// What is settled is off by so many standard deviations of the fits.
    pub(crate) settled_off: f64,
    held: Held,
    /// Of each sum: how far it is off, its variance.
    off: Vec<(f64, f64)>,
}

impl Standing {
    /// Other rules make it hold.
    pub(crate) fn is_implied(&self) -> bool {
        self.freedom == 0 && self.settled_off <= LEFT
    }

    /// Other rules make it not hold.
    pub(crate) fn is_contradicted(&self) -> bool {
        self.settled_off > LEFT
    }
}

/// A rule as it is near the present numbers.
struct Linear {
    off: [f64; ROWS],
    /// Index of each free number concerned, and how each equation changes with it.
    slopes: Vec<(usize, Vector3<f64>)>,
}

impl State {
    pub(crate) fn new<'a>(
        fits: impl Iterator<Item = (&'a shapes::Shape, &'a shapes::Joint)>,
        size_mm: f64,
    ) -> Self {
        let (mut charts, mut fitted, mut first) = (Vec::new(), Vec::new(), vec![0]);
        for (shape, joint) in fits {
            let chart = Chart::of(shape);
            fitted.push(chart.covariance(joint));
            first.push(first[first.len() - 1] + chart.freedom());
            charts.push(chart);
        }
        let mut state = Self {
            charts,
            moved: Vec::new(),
            covariance: Vec::new(),
            first,
            fitted,
            size_mm,
        };
        state.reset();
        state
    }

    /// Back to the fits.
    fn reset(&mut self) {
        let all = self.all();
        self.moved = vec![0.0; all];
        self.covariance = vec![0.0; all * all];
        for (shape, fitted) in self.fitted.iter().enumerate() {
            let (from, to) = (self.first[shape], self.first[shape + 1]);
            for i in from..to {
                for j in from..to {
                    self.covariance[i * all + j] = fitted[(i - from, j - from)];
                }
            }
        }
    }

    fn all(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// The free numbers of a shape.
    pub(crate) fn of<'a>(&self, moved: &'a [f64], shape: usize) -> &'a [f64] {
        &moved[self.first[shape]..self.first[shape + 1]]
    }

    /// A shape as it is now.
    pub(crate) fn told(&self, shape: usize) -> Told {
        self.charts[shape].told(self.of(&self.moved, shape))
    }

    /// What is known of a shape now.
    pub(crate) fn covariance(&self, shape: usize) -> SMatrix<f64, MOST, MOST> {
        let (from, all) = (self.first[shape], self.all());
        let mut own = SMatrix::zeros();
        for i in 0..self.charts[shape].freedom() {
            for j in 0..self.charts[shape].freedom() {
                own[(i, j)] = self.covariance[(from + i) * all + from + j];
            }
        }
        own
    }

    /// How far a rule is off at the fits: its angles, radians, and its lengths, millimetres.
    pub(crate) fn off_at_fits(&self, rule: &Rule) -> (Option<f64>, Option<f64>) {
        let off = rule.off(&|shape| self.charts[shape].base, &self.charts);
        let norm = |of: Unit| {
            let rows = rule.rows(&self.charts, self.size_mm).into_iter();
            let own = rows.zip(off).filter(|((unit, _), _)| *unit == of);
            own.map(|(_, off)| off * off)
                .reduce(|a, b| a + b)
                .map(f64::sqrt)
        };
        (norm(Unit::Angle), norm(Unit::Length))
    }

    fn linear(&self, rule: &Rule, moved: &[f64]) -> Linear {
        let shapes = rule.shapes();
        let told = |shape: usize| self.charts[shape].told(self.of(moved, shape));
        let off = rule.off(&told, &self.charts);
        let mut slopes = Vec::new();
        for shape in shapes {
            let chart = &self.charts[shape];
            let own = self.of(moved, shape);
            for number in 0..chart.freedom() {
                let step = chart.step(number, self.size_mm);
                let at = |step: f64| {
                    let mut free = [0.0; MOST];
                    free[..own.len()].copy_from_slice(own);
                    free[number] += step;
                    let stepped = chart.told(&free[..own.len()]);
                    let at = |other| {
                        if other == shape { stepped } else { told(other) }
                    };
                    Vector3::from(rule.off(&at, &self.charts))
                };
                let slope = (at(step) - at(-step)) / (2.0 * step);
                slopes.push((self.first[shape] + number, slope));
            }
        }
        Linear { off, slopes }
    }

    /// Covariance of what a rule is off.
    fn spread(&self, linear: &Linear, covariance: &impl Fn(usize, usize) -> f64) -> Matrix3<f64> {
        let mut spread = Matrix3::zeros();
        for (i, a) in &linear.slopes {
            for (j, b) in &linear.slopes {
                spread += a * b.transpose() * covariance(*i, *j);
            }
        }
        0.5 * (spread + spread.transpose())
    }

    /// How a rule stands; `None` where its numbers are none. `range` is that of its only
    /// equation, where the rule does not know it.
    pub(crate) fn standing(&self, rule: &Rule, range: Option<f64>) -> Option<Standing> {
        let linear = self.linear(rule, &self.moved);
        let all = self.all();
        let now = self.spread(&linear, &|i, j| self.covariance[i * all + j]);
        let of = |i: usize| self.first.partition_point(|first| *first <= i) - 1;
        let fitted = self.spread(&linear, &|i, j| {
            let (shape, other) = (of(i), of(j));
            if shape == other {
                self.fitted[shape][(i - self.first[shape], j - self.first[shape])]
            } else {
                0.0
            }
        });
        let rows = rule.rows(&self.charts, self.size_mm);
        let mut scale = Vector3::zeros();
        let mut per_range = Vector3::zeros();
        for (row, (_, half)) in rows.iter().enumerate() {
            let deviation = fitted[(row, row)].sqrt();
            if !deviation.is_finite() || deviation <= 0.0 {
                return None;
            }
            scale[row] = 1.0 / deviation;
            per_range[row] = deviation / (2.0 * range.unwrap_or(*half));
        }
        let scaled = Matrix3::from_fn(|i, j| now[(i, j)] * scale[i] * scale[j]);
        let off = Vector3::from(linear.off).component_mul(&scale);
        if !scaled.iter().chain(off.iter()).all(|n| n.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new(scaled);
        let mut standing = Standing {
            squares: 0.0,
            freedom: 0,
            p: 1.0,
            chance: 1.0,
            log_odds: 0.0,
            settled_off: 0.0,
            held: Held {
                rule: *rule,
                sums: Vec::new(),
            },
            off: Vec::new(),
        };
        let mut volume = 1.0;
        for (k, variance) in eigen.eigenvalues.iter().enumerate() {
            let way = eigen.eigenvectors.column(k).into_owned();
            let along = way.dot(&off);
            // Equations that the rule does not have are 0.
            if *variance <= SETTLED {
                standing.settled_off = standing.settled_off.max(along.abs());
                continue;
            }
            standing.freedom += 1;
            standing.squares += along * along / variance;
            volume *= variance.sqrt() * way.component_mul(&per_range).norm();
            standing.held.sums.push(way.component_mul(&scale));
            standing.off.push((along, *variance));
        }
        let freedom = standing.freedom;
        standing.p = survival(standing.squares, freedom);
        // Nearer than one standard deviation is luck.
        let radius = standing.squares.sqrt().max((freedom as f64).sqrt());
        standing.chance = (ball(freedom) * volume * radius.powi(freedom as i32)).min(1.0);
        let normal = (2.0 * core::f64::consts::PI).sqrt().powi(freedom as i32);
        standing.log_odds = -0.5 * standing.squares - libm::log(normal * volume);
        Some(standing)
    }

    /// The free numbers once a rule holds, as it stands.
    pub(crate) fn after(&self, standing: &Standing) -> Vec<f64> {
        let mut moved = self.moved.clone();
        for ((with, variance), (off, _)) in self.shares(standing).iter().zip(&standing.off) {
            for (moved, with) in moved.iter_mut().zip(with) {
                *moved -= with * off / variance;
            }
        }
        moved
    }

    /// Lets a rule hold, as it stands.
    pub(crate) fn hold(&mut self, standing: &Standing) -> Held {
        let shares = self.shares(standing);
        self.moved = self.after(standing);
        for (with, variance) in shares {
            self.settle(&with, variance);
        }
        standing.held.clone()
    }

    /// The covariances of all free numbers with each of a rule's sums, and its variance. The sums
    /// have nothing in common.
    fn shares(&self, standing: &Standing) -> Vec<(Vec<f64>, f64)> {
        let linear = self.linear(&standing.held.rule, &self.moved);
        let sums = standing.held.sums.iter().zip(&standing.off);
        sums.map(|(sum, (_, variance))| (self.with(&linear, sum), *variance))
            .collect()
    }

    /// The covariances of all free numbers with a sum of a rule's equations.
    fn with(&self, linear: &Linear, sum: &Vector3<f64>) -> Vec<f64> {
        let all = self.all();
        let mut with = vec![0.0; all];
        for (index, slope) in &linear.slopes {
            let slope = slope.dot(sum);
            let row = &self.covariance[index * all..(index + 1) * all];
            for (with, own) in with.iter_mut().zip(row) {
                *with += own * slope;
            }
        }
        with
    }

    fn settle(&mut self, with: &[f64], variance: f64) {
        let all = self.all();
        for (row, a) in self.covariance.chunks_exact_mut(all).zip(with) {
            let share = a / variance;
            for (own, b) in row.iter_mut().zip(with) {
                *own -= share * b;
            }
        }
    }

    /// Solves for all rules together, from the fits on. `false` where that leads nowhere; the
    /// state is of no use then.
    pub(crate) fn solve<'a>(&mut self, held: impl Iterator<Item = &'a Held> + Clone) -> bool {
        self.reset();
        let deviations: Vec<f64> = (0..self.all())
            .map(|i| self.covariance[i * self.all() + i].sqrt())
            .collect();
        let mut here = self.moved.clone();
        for _ in 0..ROUNDS {
            self.reset();
            for own in held.clone() {
                let linear = self.linear(&own.rule, &here);
                for sum in &own.sums {
                    let mut off = Vector3::from(linear.off).dot(sum);
                    let mut variance = 0.0;
                    let with = self.with(&linear, sum);
                    for (index, slope) in &linear.slopes {
                        let slope = slope.dot(sum);
                        off += slope * (self.moved[*index] - here[*index]);
                        variance += slope * with[*index];
                    }
                    // Sums are of a variance near 1 as the fits have them.
                    if !off.is_finite() || variance.is_nan() {
                        return false;
                    }
                    if variance <= 0.01 * SETTLED {
                        if off.abs() > LEFT {
                            return false;
                        }
                        continue;
                    }
                    for (moved, with) in self.moved.iter_mut().zip(&with) {
                        *moved -= with * off / variance;
                    }
                    self.settle(&with, variance);
                }
            }
            let change = self.moved.iter().zip(&here).zip(&deviations);
            let change = change.map(|((now, before), deviation)| {
                (now - before).abs() / deviation.max(f64::MIN_POSITIVE)
            });
            let change = change.fold(0.0, f64::max);
            here.clone_from(&self.moved);
            if change <= ENDED {
                return true;
            }
        }
        false
    }
}
