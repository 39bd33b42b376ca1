//! Smooth stretches of a border as one spline each.
//!
//! The division into lines and cubics finds what a border is made of, but each of its
//! pieces knows only its own samples. Along a stretch that goes on smoothly, a spline
//! with continuous curvature and as few spans as the samples justify averages over all of
//! them, and so lies well below a pitch from the border, and reaches farther beyond its
//! ends, where a junction has to be found.

use nurbs::{BandedMatrix, Basis, KnotVector};

use super::segments::{Form, Samples, Segment};
use crate::polygon::{dot, minus, norm};

/// Fewer samples are left as they are.
const LEAST_SAMPLES: usize = 16;

/// Samples next to a junction that do not count: three regions share the nodes there,
/// and windows reach across.
const JUNCTION_SAMPLES: usize = 3;

/// The same next to a corner, which the traced border cuts off.
const CORNER_SAMPLES: usize = 1;

/// Samples for each span of a spline, at least.
const SPAN_SAMPLES: usize = 6;

/// Price of a corner against that of a span.
const CORNER_PRICE: f64 = 1.0;

/// Neighbouring stretches that are tried as one, at most.
const MERGED: usize = 3;

/// Samples to either side over which a turn is seen, and how far beside the sharpest turn
/// a corner is looked for.
const TURN_SAMPLES: usize = 12;
const CORNER_SHIFT: usize = 3;

/// Price of a straight stretch against that of a span.
const LINE_PRICE: f64 = 0.5;

/// Numbers of spans tried in vain before the search for a better one ends.
const PATIENCE: usize = 3;

/// Rounds in which distances are measured across the curve.
const ROUNDS: usize = 3;

/// Weight of distances along the curve against those across it: the arc lengths of the
/// samples are rough.
const ALONG: f64 = 0.02;

/// Weight of the squared third derivative, which stiffens the ends; it widens a circle
/// with a radius of five pitches by a hundredth.
const STIFFNESS: f64 = 200.0;

/// A spline may leave the samples by this root mean square, pitches: a straight or evenly
/// curved digital border does.
const DIGITAL_RMS: f64 = 0.36;

/// What lies next to an end of a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Neighbour {
    Junction,
    Corner,
}

/// Consecutive segments between two corners.
struct Stretch {
    segments: Vec<Segment>,
    curved: bool,
    cost: f64,
}

impl Stretch {
    fn range(&self) -> Option<(usize, usize)> {
        Some((self.segments.first()?.first, self.segments.last()?.last))
    }
}

/// Replaces curved stretches between corners by splines. Corners that the samples do not
/// justify vanish. `price` is that of a span in square pitches.
pub(crate) fn smooth(
    samples: &Samples,
    segments: Vec<Segment>,
    corner_cosine: f64,
    price: f64,
) -> Vec<Segment> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for segment in segments {
        let goes_on = stretches
            .last()
            .and_then(|s| s.segments.last())
            .is_some_and(|before| {
                let (u, v) = (
                    samples.at(before, before.last).1,
                    samples.at(&segment, segment.first).1,
                );
                dot(u, v) > corner_cosine
            });
        let curved = matches!(segment.form, Form::Cubic { .. });
        match stretches.last_mut() {
            Some(stretch) if goes_on => {
                stretch.segments.push(segment);
                stretch.curved |= curved;
            }
            _ => stretches.push(Stretch {
                segments: vec![segment],
                curved,
                cost: 0.0,
            }),
        }
    }
    let count = stretches.len();
    for (k, stretch) in stretches.iter_mut().enumerate() {
        let around = [k > 0, k + 1 < count].map(neighbour);
        stretch.cost = cost_of(samples, stretch, price);
        if stretch.curved
            && let Some(splined) = splined(samples, stretch, around, price)
        {
            *stretch = splined;
        }
    }
    let mut k = 0;
    while k < stretches.len() {
        let around = [k > 0, k + 1 < stretches.len()].map(neighbour);
        if let Some(parts) = parted(samples, &stretches[k], around, corner_cosine, price) {
            stretches.splice(k..=k, parts);
        } else {
            k += 1;
        }
    }
    k = 0;
    while k + 1 < stretches.len() {
        // Two false corners may each need the other.
        let joined = (2..=MERGED).find_map(|count| {
            let group = stretches.get(k..k + count)?;
            let around = [k > 0, k + count < stretches.len()].map(neighbour);
            Some((merged(samples, group, around, price)?, count))
        });
        if let Some((merged, count)) = joined {
            stretches.splice(k..k + count, [merged]);
            k = k.saturating_sub(MERGED - 1);
        } else {
            k += 1;
        }
    }
    stretches.into_iter().flat_map(|s| s.segments).collect()
}

fn neighbour(corner: bool) -> Neighbour {
    if corner {
        Neighbour::Corner
    } else {
        Neighbour::Junction
    }
}

/// A curved stretch as two, if a corner parts it that the pieces have passed over.
fn parted(
    samples: &Samples,
    stretch: &Stretch,
    around: [Neighbour; 2],
    corner_cosine: f64,
    price: f64,
) -> Option<[Stretch; 2]> {
    if !stretch.curved {
        return None;
    }
    let (first, last) = stretch.range()?;
    let sharpest = (first + LEAST_SAMPLES..=last.checked_sub(LEAST_SAMPLES)?)
        .map(|k| (turn_cosine(&samples.points, k), k))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(cosine, _)| *cosine < corner_cosine.sqrt())?
        .1;
    let part = |first: usize, last: usize, around: [Neighbour; 2]| {
        let whole = Stretch {
            segments: vec![Segment {
                first,
                last,
                ..*stretch.segments.first()?
            }],
            curved: true,
            cost: 0.0,
        };
        splined(samples, &whole, around, price)
    };
    let places = [sharpest - CORNER_SHIFT, sharpest, sharpest + CORNER_SHIFT];
    places
        .into_iter()
        .filter_map(|k| {
            let parts = [
                part(first, k, [around[0], Neighbour::Corner])?,
                part(k, last, [Neighbour::Corner, around[1]])?,
            ];
            let (a, b) = (parts[0].segments.last()?, parts[1].segments.first()?);
            let turns = dot(samples.at(a, a.last).1, samples.at(b, b.first).1) <= corner_cosine;
            let cost = parts[0].cost + parts[1].cost + CORNER_PRICE * price;
            (turns && cost < stretch.cost).then_some((cost, parts))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, parts)| parts)
}

/// Cosine of the turn at a sample, seen over [`TURN_SAMPLES`] to either side.
fn turn_cosine(points: &[[f64; 2]], sample: usize) -> f64 {
    let direction = |from: usize, to: usize| {
        // Farther samples tell more: the slope of the line of least squares, with places
        // in the order of samples for the parameter.
        let middle = (from + to) as f64 / 2.0;
        let sum = |d: usize| {
            let terms = (from..=to).map(|k| (k as f64 - middle) * points[k][d]);
            terms.sum::<f64>()
        };
        let slope = [sum(0), sum(1)];
        let length = norm(slope).max(1e-9);
        [slope[0] / length, slope[1] / length]
    };
    dot(
        direction(sample - TURN_SAMPLES, sample),
        direction(sample, sample + TURN_SAMPLES),
    )
}

/// Neighbouring stretches as one, if no corner parts them.
fn merged(
    samples: &Samples,
    group: &[Stretch],
    around: [Neighbour; 2],
    price: f64,
) -> Option<Stretch> {
    if group.iter().all(|s| !s.curved) {
        return None;
    }
    let corners = CORNER_PRICE * price * (group.len() - 1) as f64;
    let apart = Stretch {
        segments: group.iter().flat_map(|s| &s.segments).copied().collect(),
        curved: true,
        cost: group.iter().map(|s| s.cost).sum::<f64>() + corners,
    };
    splined(samples, &apart, around, price).filter(|s| s.cost <= apart.cost)
}

/// Squared distances of the samples from a stretch, and the price of its pieces.
fn cost_of(samples: &Samples, stretch: &Stretch, price: f64) -> f64 {
    let costs = stretch.segments.iter().map(|segment| {
        let share = match segment.form {
            Form::Line { .. } => LINE_PRICE,
            Form::Cubic { .. } => 1.0,
        };
        share * price + squared_distances(samples, segment, segment.first, segment.last)
    });
    costs.sum()
}

fn squared_distances(samples: &Samples, segment: &Segment, from: usize, to: usize) -> f64 {
    let off2 = (from..to).map(|k| {
        let (place, along) = samples.at(segment, k);
        let off = minus(samples.points[k], place);
        let across = off[1] * along[0] - off[0] * along[1];
        across * across
    });
    off2.sum()
}

/// The spline of least cost along a stretch; `None` when it does not follow the samples.
fn splined(
    samples: &Samples,
    stretch: &Stretch,
    around: [Neighbour; 2],
    price: f64,
) -> Option<Stretch> {
    let (first, last) = stretch.range()?;
    if last - first < LEAST_SAMPLES {
        return None;
    }
    let clear = around.map(|n| match n {
        Neighbour::Junction => JUNCTION_SAMPLES,
        Neighbour::Corner => CORNER_SAMPLES,
    });
    let (from, to) = (first + clear[0], last - clear[1]);
    let mut best: Option<(f64, Spline)> = None;
    let (mut spans, mut vain) = (1, 0);
    while spans * SPAN_SAMPLES <= to - from && vain < PATIENCE {
        if let Some(spline) = Spline::fit(samples, from, to, spans) {
            let cost = spline.error + price * spans as f64;
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, spline));
                vain = 0;
            } else {
                vain += 1;
            }
        }
        spans += 1 + spans / 6;
    }
    let (cost, spline) = best?;
    let line = Segment {
        first,
        last,
        origin: first,
        form: samples.form(from, to, false),
    };
    let line_cost = LINE_PRICE * price + squared_distances(samples, &line, from, to);
    if line_cost <= cost {
        return Some(Stretch {
            segments: vec![line],
            curved: false,
            cost: line_cost,
        });
    }
    let allowed = DIGITAL_RMS * DIGITAL_RMS * (to - from) as f64;
    let followed = spline.error <= allowed || cost <= stretch.cost;
    followed.then(|| Stretch {
        segments: spline.segments(samples, first, last),
        curved: true,
        cost,
    })
}

/// A cubic spline over the arc length of samples.
struct Spline {
    knots: KnotVector,
    control: Vec<[f64; 2]>,
    /// Samples at the breaks.
    breaks: Vec<usize>,
    /// Sum of squared distances across the curve.
    error: f64,
}

impl Spline {
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
            for i in 0..8 {
                for j in 0..=i {
                    matrix.add(first + i, first + j, weight * row[i] * row[j]);
                }
                rhs[first + i] += weight * row[i] * target;
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
    fn segments(&self, samples: &Samples, first: usize, last: usize) -> Vec<Segment> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::border::segments::Price;

    const PRICE: Price = Price {
        line: 7.0,
        cubic: 16.0,
    };
    const SPAN_PRICE: f64 = 6.0;
    const CORNER_COSINE: f64 = 0.94;

    /// Places along a curve, each moved to the nearest middle of a lattice's crack.
    fn digital(curve: impl Fn(f64) -> [f64; 2], count: usize) -> Vec<[f64; 2]> {
        let mut points: Vec<[f64; 2]> = Vec::new();
        for k in 0..=20 * count {
            let [x, y] = curve(k as f64 / (20 * count) as f64);
            // Middles of cracks have one whole and one half coordinate.
            let upright = [x.floor() + 0.5, y.round()];
            let flat = [x.round(), y.floor() + 0.5];
            let off = |p: [f64; 2]| norm(minus(p, [x, y]));
            let nearest = if off(upright) < off(flat) {
                upright
            } else {
                flat
            };
            if points.last() != Some(&nearest) {
                points.push(nearest);
            }
        }
        points
    }

    fn arc(turn: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(turn);
        [0.3 + 60.0 * cos, 0.1 + 60.0 * sin]
    }

    fn corners(samples: &Samples, segments: &[Segment]) -> Vec<usize> {
        let turns = |pair: &&[Segment]| {
            let (a, b) = (&pair[0], &pair[1]);
            dot(samples.at(a, a.last).1, samples.at(b, b.first).1) <= CORNER_COSINE
        };
        let joints = segments.windows(2).filter(turns);
        joints.map(|pair| pair[1].first).collect()
    }

    fn assert_whole(samples: &Samples, segments: &[Segment]) {
        assert_eq!(segments[0].first, 0);
        assert_eq!(segments[segments.len() - 1].last, samples.points.len() - 1);
        for pair in segments.windows(2) {
            assert_eq!(pair[0].last, pair[1].first);
        }
    }

    #[test]
    fn an_arc_is_followed_well_below_a_pitch() {
        let samples = Samples::new(digital(|t| arc(2.5 * t), 200));
        let segments = smooth(&samples, samples.divide(PRICE), CORNER_COSINE, SPAN_PRICE);
        assert_whole(&samples, &segments);
        assert!(corners(&samples, &segments).is_empty());
        for segment in &segments {
            for k in segment.first..=segment.last {
                let off = norm(minus(samples.at(segment, k).0, [0.3, 0.1])) - 60.0;
                assert!(off.abs() < 0.35, "sample {k}: {off}");
            }
        }
    }

    #[test]
    fn false_corners_near_both_ends_vanish_together() {
        let samples = Samples::new(digital(|t| arc(2.5 * t), 200));
        let last = samples.points.len() - 1;
        let piece = |first: usize, last: usize, curved: bool| Segment {
            first,
            last,
            origin: first,
            form: samples.form(first, last, curved),
        };
        let cut = vec![
            piece(0, 24, false),
            piece(24, last - 24, true),
            piece(last - 24, last, false),
        ];
        let segments = smooth(&samples, cut, CORNER_COSINE, SPAN_PRICE);
        assert_whole(&samples, &segments);
        assert!(corners(&samples, &segments).is_empty());
        let curved = |s: &Segment| matches!(s.form, Form::Cubic { .. });
        assert!(segments.iter().all(curved));
    }

    #[test]
    fn a_corner_between_arc_and_line_stays_where_it_is() {
        let tip = arc(1.5);
        let curve = |t: f64| match 2.0 * t - 1.0 {
            before if before < 0.0 => arc(1.5 * (1.0 + before)),
            after => [tip[0] - 20.0 * after, tip[1] - 80.0 * after],
        };
        let samples = Samples::new(digital(curve, 200));
        let segments = smooth(&samples, samples.divide(PRICE), CORNER_COSINE, SPAN_PRICE);
        assert_whole(&samples, &segments);
        let corners = corners(&samples, &segments);
        assert_eq!(corners.len(), 1, "{corners:?}");
        let off = norm(minus(samples.points[corners[0]], tip));
        assert!(off < 4.0, "{off}");
    }

    #[test]
    fn lines_stay_lines() {
        let curve = |t: f64| [90.0 * t, 0.4 + 33.0 * t];
        let samples = Samples::new(digital(curve, 100));
        let before = samples.divide(PRICE);
        let after = smooth(&samples, before.clone(), CORNER_COSINE, SPAN_PRICE);
        assert_eq!(before, after);
    }
}
