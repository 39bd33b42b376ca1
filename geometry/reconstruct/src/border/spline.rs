//! Cubic splines along the samples of a border.

use std::collections::BTreeMap;

use nurbs::{BandedMatrix, Basis, KnotVector};

use super::segments::{Form, Samples, Segment};
use crate::polygon::{dot, minus, norm};

/// Rounds in which distances are measured across the curve.
const ROUNDS: usize = 3;

/// Weight of distances along the curve against those across it: the arc lengths of the
/// samples are rough.
const ALONG: f64 = 0.02;

/// Weight of the squared third derivative, which stiffens the ends; it widens a circle
/// with a radius of five pitches by a hundredth.
const STIFFNESS: f64 = 200.0;

/// A curve over the arc length of the samples runs at a speed of about 1. A spline that
/// comes near a stop bends as sharply as a corner there, or folds back.
const LEAST_SPEED: f64 = 0.5;

/// Samples for each span of a spline, at least.
const SPAN_SAMPLES: usize = 6;

/// Numbers of spans tried in vain before the search for a better one ends.
const PATIENCE: usize = 3;

/// The splines of least cost along the samples of a border. Each is looked for once: the
/// search for corners comes back to the same samples many times.
pub(crate) struct Splines<'a> {
    pub(crate) samples: &'a Samples,
    /// Price of a span, square pitches.
    pub(crate) price: f64,
    known: BTreeMap<(usize, usize), Option<Spline>>,
}

impl<'a> Splines<'a> {
    pub(crate) fn new(samples: &'a Samples, price: f64) -> Self {
        Self {
            samples,
            price,
            known: BTreeMap::new(),
        }
    }

    /// The spline along samples `from..=to` whose error and spans cost the least.
    pub(crate) fn cheapest(&mut self, from: usize, to: usize) -> Option<&Spline> {
        let known = self.known.entry((from, to));
        known
            .or_insert_with(|| cheapest(self.samples, from, to, self.price))
            .as_ref()
    }
}

fn cheapest(samples: &Samples, from: usize, to: usize, price: f64) -> Option<Spline> {
    let mut best: Option<(f64, Spline)> = None;
    let (mut spans, mut vain) = (1, 0);
    while spans * SPAN_SAMPLES <= to - from && vain < PATIENCE {
        let spent = price * spans as f64;
        if best.as_ref().is_some_and(|(least, _)| spent >= *least) {
            break;
        }
        if let Some(spline) = Spline::fit(samples, from, to, spans) {
            let cost = spline.cost(price);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, spline));
                vain = 0;
            } else {
                vain += 1;
            }
        }
        spans += 1 + spans / 6;
    }
    best.map(|(_, spline)| spline)
}

/// A cubic spline over the arc length of samples.
pub(crate) struct Spline {
    knots: KnotVector,
    control: Vec<[f64; 2]>,
    /// Samples at the breaks.
    breaks: Vec<usize>,
    /// Sum of squared distances across the curve.
    pub(crate) error: f64,
}

impl Spline {
    /// The spline of least squares along samples `from..=to`; `None` when that does not
    /// run along them.
    fn fit(samples: &Samples, from: usize, to: usize, spans: usize) -> Option<Self> {
        let breaks: Vec<usize> = (0..=spans)
            .map(|k| from + (to - from) * k / spans)
            .collect();
        let at = |sample: usize| samples.length[sample] - samples.length[from];
        let mut knots = vec![0.0; 3];
        knots.extend(breaks.iter().map(|&b| at(b)));
        knots.extend([at(to); 3]);
        let knots = KnotVector::new(3, knots).ok()?;
        let bases: Vec<Basis> = (from..=to).map(|k| knots.basis(at(k))).collect();
        let slopes: Vec<Basis> = (from..=to)
            .map(|k| knots.basis_derivative(at(k), 1))
            .collect();
        let mut spline = Self {
            control: Vec::new(),
            breaks,
            error: 0.0,
            knots,
        };
        let points = &samples.points[from..=to];
        spline.control = spline.solve(points.iter().zip(&bases).map(|(&p, basis)| Pull {
            basis,
            normal: [0.0, 1.0],
            along: 1.0,
            point: p,
        }))?;
        for _ in 0..ROUNDS {
            let normals: Vec<[f64; 2]> = slopes.iter().map(|s| spline.normal(s)).collect();
            let pulls = points.iter().zip(&bases).zip(&normals);
            spline.control = spline.solve(pulls.map(|((&point, basis), &normal)| Pull {
                basis,
                normal,
                along: ALONG,
                point,
            }))?;
        }
        let speeds = slopes.iter().map(|slope| norm(spline.combine(slope)));
        if speeds.fold(f64::INFINITY, f64::min) < LEAST_SPEED {
            return None;
        }
        spline.error = points
            .iter()
            .zip(bases.iter().zip(&slopes))
            .map(|(&p, (basis, slope))| {
                let off = dot(spline.normal(slope), minus(p, spline.combine(basis)));
                off * off
            })
            .sum();
        spline.error.is_finite().then_some(spline)
    }

    /// Squared distances from the samples and the price of the spans.
    pub(crate) fn cost(&self, price: f64) -> f64 {
        self.error + price * (self.breaks.len() - 1) as f64
    }

    fn combine(&self, basis: &Basis) -> [f64; 2] {
        [0, 1].map(|d| {
            let terms = basis.values.iter().zip(&self.control[basis.first..]);
            terms.map(|(b, c)| b * c[d]).sum()
        })
    }

    fn normal(&self, slope: &Basis) -> [f64; 2] {
        let along = self.combine(slope);
        let speed = norm(along).max(1e-9);
        [-along[1] / speed, along[0] / speed]
    }

    /// Control points with the least sum of squared pulls.
    fn solve<'a>(&self, pulls: impl Iterator<Item = Pull<'a>>) -> Option<Vec<[f64; 2]>> {
        let count = self.knots.control_count();
        let mut matrix = BandedMatrix::zero(2 * count, 7);
        let mut rhs = vec![0.0; 2 * count];
        let mut add = |basis: &Basis, direction: [f64; 2], weight: f64, target: f64| {
            let row: [f64; 8] = core::array::from_fn(|k| direction[k % 2] * basis.values[k / 2]);
            let first = 2 * basis.first;
            let elements: [(usize, f64); 8] = core::array::from_fn(|k| (first + k, row[k]));
            for (i, value) in row.iter().enumerate() {
                matrix.add_to_row(first + i, weight * value, &elements[..=i]);
                rhs[first + i] += weight * value * target;
            }
        };
        for pull in pulls {
            let along = [pull.normal[1], -pull.normal[0]];
            add(pull.basis, pull.normal, 1.0, dot(pull.normal, pull.point));
            add(pull.basis, along, pull.along, dot(along, pull.point));
        }
        let breaks = self.knots.breaks();
        for pair in breaks.windows(2) {
            let jerk = self.knots.basis_derivative((pair[0] + pair[1]) / 2.0, 3);
            for direction in [[1.0, 0.0], [0.0, 1.0]] {
                add(&jerk, direction, STIFFNESS * (pair[1] - pair[0]), 0.0);
            }
        }
        matrix.cholesky().ok()?.solve(&mut rhs);
        Some(rhs.chunks_exact(2).map(|c| [c[0], c[1]]).collect())
    }

    /// A segment for each span; the outer ones reach to samples `first` and `last`.
    pub(crate) fn segments(&self, samples: &Samples, first: usize, last: usize) -> Vec<Segment> {
        let spans = self.breaks.len() - 1;
        (0..spans)
            .map(|k| {
                let (begin, end) = (self.breaks[k], self.breaks[k + 1]);
                let at = samples.length[begin] - samples.length[self.breaks[0]];
                let terms: [[f64; 2]; 4] = core::array::from_fn(|order| {
                    self.combine(&self.knots.basis_derivative(at, order))
                });
                let [x, y] = [0, 1].map(|d| {
                    [
                        terms[0][d],
                        terms[1][d],
                        terms[2][d] / 2.0,
                        terms[3][d] / 6.0,
                    ]
                });
                Segment {
                    first: if k == 0 { first } else { begin },
                    last: if k + 1 == spans { last } else { end },
                    origin: begin,
                    form: Form::Cubic { x, y },
                }
            })
            .collect()
    }
}

/// What a sample asks of a spline.
struct Pull<'a> {
    basis: &'a Basis,
    normal: [f64; 2],
    /// Weight along the curve against that across.
    along: f64,
    point: [f64; 2],
}
