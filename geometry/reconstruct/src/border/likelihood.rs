//! How likely an outline is, given the samples beside it.
//!
//! Samples lie closer to an outline than nodes do, on both sides of it once the missing ones
//! are counted: those that are there lie inside, and the missing ones outside. None of them is
//! believed beyond doubt: samples are lost inside, too, and the edge of a spot may catch a
//! surface that its middle misses.

use nalgebra::{DMatrix, DVector};
use nurbs::Basis;

use super::layout::Condition;
use crate::evidence::Seen;

/// A sample as seen from a path; lengths in pitches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sighting {
    /// Where along the path it is nearest, from its start.
    pub(crate) along: f64,
    /// How far it lies inside the path.
    pub(crate) inside: f64,
    pub(crate) place: [f64; 2],
    pub(crate) seen: Seen,
}

/// Samples present and missing of which an outline has at least so many each.
const LEAST: usize = 6;
/// Over how much of the pitch an edge is found blurred: wide first, so that far ones draw.
pub(crate) const WIDTHS: [f64; 4] = [0.108, 0.063, 0.036, 0.0216];
/// Farther than so many of these widths from an outline a sample does not tell where it is.
const SATURATED: f64 = 20.0;
/// Chances that are multiplied before a logarithm is taken: none is so small that the product
/// vanishes.
const FACTORS: u32 = 16;
/// Sightings between two looks at what they have come to.
const LOOK: usize = 32;
/// Chance that a sample is there although the middle of its spot misses the surface.
const GRAZED: f64 = 0.003;
/// Share of samples lost where too few are known to tell, and how many that counts for.
const DROPPED: f64 = 0.03;
const DROPPED_OF: f64 = 30.0;
/// Steps of Newton's method for each width.
const STEPS: usize = 12;
/// What a step gains at least to be followed by another, for the last width and those before.
const ENOUGH: f64 = 1e-3;
const ENOUGH_BEFORE: f64 = 0.1;
/// Price of each number of a path, in logarithms of the sightings.
const PRICE: f64 = 0.5;
/// How much each condition weighs.
const BINDING: f64 = 1e9;

/// Sightings, and what can be known from their numbers alone.
#[derive(Debug, Clone)]
pub(crate) struct Sightings {
    /// But for the lost ones.
    all: Vec<Sighting>,
    /// Share of samples lost inside.
    dropped: f64,
}

/// An outline that is moved inwards by sums of functions.
pub(crate) struct Linear<'a> {
    /// The functions that do not vanish at each sighting, the first `width` of each.
    pub(crate) bases: &'a [Basis],
    pub(crate) width: usize,
    /// All functions.
    pub(crate) count: usize,
    pub(crate) conditions: &'a [Condition],
    /// Standard deviation of each coefficient before anything is known of it.
    pub(crate) before: f64,
    /// Over how much of the pitch edges are blurred, one after the other.
    pub(crate) widths: &'a [f64],
}

/// The likeliest coefficients.
pub(crate) struct Likeliest {
    /// Minus the logarithm of the likelihood.
    pub(crate) cost: f64,
    pub(crate) coefficients: DVector<f64>,
    /// The inverse of the coefficients' covariance.
    pub(crate) information: DMatrix<f64>,
}

impl Sightings {
    /// What an outline costs that is moved inwards by so much, whatever is known before.
    pub(crate) fn cost_of(&self, linear: &Linear<'_>, at: &DVector<f64>) -> f64 {
        let mut cost = Cost::new(self.dropped, WIDTHS[WIDTHS.len() - 1]);
        for (s, basis) in self.all.iter().zip(linear.bases) {
            cost.add(s.seen, s.inside - linear.sum(basis, at));
        }
        cost.total()
    }

    /// The same, if it is no more than so much: most outlines cost far more, which some of the
    /// sightings tell. Of those that cost hardly more, some are told of, too.
    pub(crate) fn cost_up_to(
        &self,
        linear: &Linear<'_>,
        at: &DVector<f64>,
        most: f64,
    ) -> Option<f64> {
        let mut cost = Cost::new(self.dropped, WIDTHS[WIDTHS.len() - 1]);
        let far = cost.of_far();
        let mut each = self.all.iter().zip(linear.bases).peekable();
        while each.peek().is_some() {
            for (s, basis) in each.by_ref().take(LOOK) {
                cost.add(s.seen, s.inside - linear.sum(basis, at));
            }
            // Each sighting adds to it.
            if cost.at_least(far) > most {
                return None;
            }
        }
        Some(cost.total())
    }

    /// `None` where they are too few to tell of an outline.
    pub(crate) fn enough(all: Vec<Sighting>) -> Option<Self> {
        let count = |seen: Seen| all.iter().filter(|s| s.seen == seen).count();
        let is_enough = count(Seen::Present) >= LEAST && count(Seen::Missing) >= LEAST;
        is_enough.then(|| Self::new(all))
    }

    pub(crate) fn new(mut all: Vec<Sighting>) -> Self {
        let count = |seen: Seen| all.iter().filter(|s| s.seen == seen).count();
        let (present, lost) = (count(Seen::Present), count(Seen::Lost) as f64);
        let dropped = (lost + DROPPED * DROPPED_OF) / (lost + present as f64 + DROPPED_OF);
        all.retain(|s| s.seen != Seen::Lost);
        Self { all, dropped }
    }

    pub(crate) fn those(&self, keep: impl FnMut(&Sighting) -> bool) -> Self {
        let mut part = self.clone();
        part.all.retain(keep);
        part
    }

    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = &Sighting> {
        self.all.iter()
    }

    /// The same samples as seen from another outline.
    pub(crate) fn elsewhere(&self, mut inside: impl FnMut(&Sighting) -> f64) -> Self {
        let mut seen = self.clone();
        for sighting in &mut seen.all {
            sighting.inside = inside(sighting);
        }
        seen
    }

    /// What so many numbers have to gain at least, to be worth it.
    pub(crate) fn price(&self, numbers: usize) -> f64 {
        PRICE * libm::log(self.all.len() as f64) * numbers as f64
    }

    /// What an outline costs that is where the sightings are seen from.
    pub(crate) fn cost(&self) -> f64 {
        let mut cost = Cost::new(self.dropped, WIDTHS[WIDTHS.len() - 1]);
        for s in &self.all {
            cost.add(s.seen, s.inside);
        }
        cost.total()
    }

    /// The coefficients with which the sightings are the likeliest.
    pub(crate) fn likeliest(&self, linear: &Linear<'_>) -> Option<Likeliest> {
        let mut found = DVector::zeros(linear.count);
        let (mut here, mut next) = (Normal::new(linear.count), Normal::new(linear.count));
        for (k, &width) in linear.widths.iter().enumerate() {
            let enough = if k + 1 == linear.widths.len() {
                ENOUGH
            } else {
                ENOUGH_BEFORE
            };
            here.fill(self, linear, &found, width);
            let mut damping = 1e-3;
            for _ in 0..STEPS {
                let mut gained = 0.0;
                while damping < 1e6 {
                    let mut damped = here.matrix.clone();
                    for k in 0..linear.count {
                        damped[(k, k)] *= 1.0 + damping;
                    }
                    bind(&mut damped, linear.conditions);
                    let there = &found + damped.cholesky()?.solve(&here.right);
                    next.fill(self, linear, &there, width);
                    if next.cost < here.cost {
                        gained = here.cost - next.cost;
                        found = there;
                        core::mem::swap(&mut here, &mut next);
                        damping *= 0.1;
                        break;
                    }
                    damping *= 10.0;
                }
                if gained <= enough {
                    break;
                }
            }
        }
        let Normal {
            cost, mut matrix, ..
        } = here;
        bind(&mut matrix, linear.conditions);
        Some(Likeliest {
            cost,
            information: matrix,
            coefficients: found,
        })
    }
}

/// The sum of minus the logarithms of chances.
///
/// Most samples lie so far from the outline that their chances do not depend on it; those are
/// counted. The others' are multiplied, and there is one logarithm for many.
struct Cost {
    width: f64,
    /// Share of samples there inside.
    share: f64,
    sum: f64,
    product: f64,
    factors: u32,
    /// Samples present far outside, and missing far inside.
    far: [u32; 2],
}

impl Cost {
    fn new(dropped: f64, width: f64) -> Self {
        Self {
            width,
            share: 1.0 - dropped,
            sum: 0.0,
            product: 1.0,
            factors: 0,
            far: [0; 2],
        }
    }

    /// Adds a sighting; gives its chance and the derivative of that by how far it lies inside,
    /// where it depends on that.
    fn add(&mut self, seen: Seen, inside: f64) -> Option<(f64, f64)> {
        let there = seen != Seen::Missing;
        let steps = inside / self.width;
        if steps.abs() > SATURATED {
            if there == (steps < 0.0) {
                self.far[usize::from(!there)] += 1;
            }
            return None;
        }
        let within = 1.0 / (1.0 + libm::exp(-steps));
        let slope = within * (1.0 - within) / self.width;
        // A lost sample is one that could be there.
        let (chance, slope) = if there {
            (GRAZED + (1.0 - GRAZED) * within, (1.0 - GRAZED) * slope)
        } else {
            (1.0 - self.share * within, -self.share * slope)
        };
        self.product *= chance;
        self.factors += 1;
        if self.factors == FACTORS {
            self.sum -= libm::log(self.product);
            (self.product, self.factors) = (1.0, 0);
        }
        Some((chance, slope))
    }

    /// What each of those far off costs.
    fn of_far(&self) -> [f64; 2] {
        [GRAZED, 1.0 - self.share].map(|chance| -libm::log(chance))
    }

    /// What it comes to at least, if those far off cost so much.
    fn at_least(&self, [of_present, of_missing]: [f64; 2]) -> f64 {
        let [present, missing] = self.far.map(f64::from);
        self.sum + present * of_present + missing * of_missing
    }

    fn total(&self) -> f64 {
        let [present, missing] = self.far.map(f64::from);
        self.sum
            - libm::log(self.product)
            - present * libm::log(GRAZED)
            - missing * libm::log(1.0 - self.share)
    }
}

/// Equations of a step of Newton's method, and the cost where they hold.
struct Normal {
    cost: f64,
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl Normal {
    fn new(count: usize) -> Self {
        Self {
            cost: f64::INFINITY,
            matrix: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
        }
    }

    fn fill(&mut self, sightings: &Sightings, linear: &Linear<'_>, at: &DVector<f64>, width: f64) {
        let known = 1.0 / (linear.before * linear.before);
        self.matrix.fill(0.0);
        self.matrix.fill_diagonal(known);
        self.right.copy_from(at);
        self.right *= -known;
        let mut cost = Cost::new(sightings.dropped, width);
        for (s, basis) in sightings.all.iter().zip(linear.bases) {
            let inside = s.inside - linear.sum(basis, at);
            let Some((chance, slope)) = cost.add(s.seen, inside) else {
                continue;
            };
            // Moving the outline inwards lessens how far a sample lies inside.
            let pull = -slope / chance;
            let weight = slope * slope / (chance * (1.0 - chance)).max(1e-9);
            let values = &basis.values[..linear.width];
            for (row, a) in values.iter().enumerate() {
                self.right[basis.first + row] += pull * a;
                for (column, b) in values.iter().enumerate() {
                    self.matrix[(basis.first + row, basis.first + column)] += weight * a * b;
                }
            }
        }
        self.cost = cost.total() + known * at.norm_squared() / 2.0;
    }
}

impl Linear<'_> {
    fn sum(&self, basis: &Basis, coefficients: &DVector<f64>) -> f64 {
        let own = coefficients.as_slice()[basis.first..].iter();
        basis.values[..self.width]
            .iter()
            .zip(own)
            .map(|(b, c)| b * c)
            .sum()
    }
}

/// Adds what conditions weigh.
pub(crate) fn bind(matrix: &mut DMatrix<f64>, conditions: &[Condition]) {
    for condition in conditions {
        for &(row, value) in condition {
            for &(column, other) in condition {
                matrix[(row, column)] += BINDING * value * other;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nurbs::MAX_DEGREE;

    /// Sightings far inside, far outside and at the outline, of all sorts.
    fn sightings() -> Sightings {
        let all = (0..300).map(|k| {
            let k = f64::from(k);
            Sighting {
                along: k / 10.0,
                inside: 2.5 * libm::sin(1.7 * k) * libm::sin(0.31 * k),
                place: [0.0; 2],
                seen: match k as u32 % 7 {
                    0 => Seen::Lost,
                    1..4 => Seen::Missing,
                    _ => Seen::Present,
                },
            }
        });
        Sightings::enough(all.collect()).unwrap()
    }

    #[test]
    fn the_cost_is_that_of_each_sighting_alone() {
        let sightings = sightings();
        let width = WIDTHS[WIDTHS.len() - 1];
        let alone = |s: &Sighting| {
            let within = 1.0 / (1.0 + libm::exp(-s.inside / width));
            let chance = match s.seen {
                Seen::Missing => 1.0 - (1.0 - sightings.dropped) * within,
                _ => GRAZED + (1.0 - GRAZED) * within,
            };
            -libm::log(chance)
        };
        let sum: f64 = sightings.iter().map(alone).sum();
        assert!((sightings.cost() - sum).abs() < 1e-6 * sum);
    }

    #[test]
    fn steps_go_down_the_steepest_way() {
        let sightings = sightings();
        let bases: Vec<Basis> = sightings
            .iter()
            .map(|s| {
                let mut values = [0.0; MAX_DEGREE + 1];
                (values[0], values[1]) = (1.0, s.along / 30.0);
                Basis { first: 0, values }
            })
            .collect();
        let linear = Linear {
            bases: &bases,
            width: 2,
            count: 2,
            conditions: &[],
            before: 0.5,
            widths: &WIDTHS,
        };
        let at = DVector::from_vec(vec![0.03, -0.07]);
        let mut normal = Normal::new(2);
        normal.fill(&sightings, &linear, &at, WIDTHS[0]);
        let right = normal.right.clone();
        for k in 0..2 {
            let cost = |by: f64| {
                let mut there = at.clone();
                there[k] += by;
                let mut normal = Normal::new(2);
                normal.fill(&sightings, &linear, &there, WIDTHS[0]);
                normal.cost
            };
            let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
            assert!((slope + right[k]).abs() < 1e-4 * (1.0 + slope.abs()));
        }
    }
}
