//! Division of a border into straight and curved pieces.
//!
//! The samples are the middles of cracks: a straight border of any slope leaves them
//! within half a pitch, in a pattern with a variance of about a twelfth. The division
//! with the least sum of squared distances plus a price for each piece is found by
//! dynamic programming; the price is what keeps a straight border whole. Corners are the
//! joints at which the tangents of neighbouring pieces disagree: the local maxima of
//! curvature change of section IV, found without differentiating a staircase.

use super::separate::{Line, is_wrong, separating, separating_cubic};
use super::sums::Sums;
use crate::polygon::{cross, dot, minus, norm};

/// Price of pieces in square pitches, against sums of squared distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Price {
    pub(crate) line: f64,
    pub(crate) cubic: f64,
}

/// A curved piece has at least this many steps between samples.
const MIN_CUBIC_STEPS: usize = 8;

/// Greatest turn of a curved piece once cut into arcs, radians.
const MAX_TURN: f64 = 0.5;

/// Least steps of the halves of a curved piece.
const MIN_HALF_STEPS: usize = 16;

/// Nodes on the wrong side of a curved piece are put up with up to this number and one
/// in [`WRONG_SHARE`] of its samples.
const WRONG_FREE: usize = 1;
const WRONG_SHARE: usize = 40;

/// No piece costs more than this many times the price of a cubic: several would be
/// cheaper. Costs grow with length, so the search ends there.
const HOPELESS: f64 = 6.0;

/// No piece has more steps: as many as the longest side of the largest usual grid has nodes.
/// A straight border costs next to nothing however long it is, and is not hopeless ever; the
/// search would take the square of its length.
const MOST_STEPS: usize = 4096;

/// Newton steps to the point of a curve nearest to a place.
const NEAREST_STEPS: usize = 3;

/// The least-squares curve of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Form {
    /// Through a point, along a unit vector.
    Line { point: [f64; 2], along: [f64; 2] },
    /// Coefficients of x and of y in ascending powers of the arc length from the first
    /// sample.
    Cubic { x: [f64; 4], y: [f64; 4] },
}

/// A piece of a border: samples `first..=last`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub(crate) first: usize,
    pub(crate) last: usize,
    /// Sample from which the form counts arc length.
    pub(crate) origin: usize,
    pub(crate) form: Form,
}

/// Samples of a border with their arc length.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    pub(crate) points: Vec<[f64; 2]>,
    /// The points with their staircase filtered out, and corners with it.
    pub(crate) smooth: Vec<[f64; 2]>,
    /// Length of the smoothed border up to each sample: the staircase itself is longer.
    pub(crate) length: Vec<f64>,
    /// The samples lie on the border itself, and are no middles of cracks.
    pub(crate) placed: bool,
}

impl Samples {
    /// Samples on the border itself.
    pub(crate) fn placed(points: Vec<[f64; 2]>) -> Self {
        Self {
            placed: true,
            ..Self::new(points)
        }
    }

    /// Samples that are the middles of cracks.
    pub(crate) fn new(points: Vec<[f64; 2]>) -> Self {
        let smooth = smoothed(&points, 4);
        let mut length = Vec::with_capacity(points.len());
        let mut sum = 0.0;
        for (k, p) in smooth.iter().enumerate() {
            if k > 0 {
                sum += norm(minus(*p, smooth[k - 1])).max(1e-3);
            }
            length.push(sum);
        }
        Self {
            points,
            smooth,
            length,
            placed: false,
        }
    }

    /// The division into pieces; none when there are fewer than two samples.
    pub(crate) fn divide(&self, price: Price) -> Vec<Segment> {
        let count = self.points.len();
        if count < 2 {
            return Vec::new();
        }
        // best[j]: least cost up to sample j, the first sample of the last piece, and
        // whether that piece is curved.
        let mut best = vec![(f64::INFINITY, 0, false); count];
        best[0].0 = 0.0;
        for first in 0..count - 1 {
            let base = best[first].0;
            let mut sums = Sums::start(self, first);
            for (last, reached) in best.iter_mut().enumerate().skip(first + 1).take(MOST_STEPS) {
                sums.push(self, last);
                let line = sums.line_error();
                let mut cost = (line + price.line, false);
                let mut cubic = line;
                if line + price.line > price.cubic && last - first >= MIN_CUBIC_STEPS {
                    cubic = sums.cubic_error();
                    if cubic + price.cubic < cost.0 {
                        cost = (cubic + price.cubic, true);
                    }
                }
                if base + cost.0 < reached.0 {
                    *reached = (base + cost.0, first, cost.1);
                }
                if cubic.min(line) > HOPELESS * price.cubic {
                    break;
                }
            }
        }
        let mut segments = Vec::new();
        let mut last = count - 1;
        while last > 0 {
            let (_, first, curved) = best[last];
            self.settle(first, last, curved, &mut segments);
            last = first;
        }
        segments.reverse();
        segments
    }

    /// Adds the segments of a piece, the last one first. A cubic that leaves too many
    /// nodes on the wrong side is halved where two cubics do best.
    fn settle(&self, first: usize, last: usize, curved: bool, segments: &mut Vec<Segment>) {
        let form = self.form(first, last, curved);
        let whole = Segment {
            first,
            last,
            origin: first,
            form,
        };
        let steps = last - first;
        if !self.placed && matches!(form, Form::Cubic { .. }) && steps >= 2 * MIN_HALF_STEPS {
            let wrong = (first + 1..last)
                .filter(|&k| {
                    let (point, along) = self.at(&whole, k);
                    is_wrong(self.points[k], &Line { point, along })
                })
                .count();
            if wrong > WRONG_FREE + steps / WRONG_SHARE
                && let Some(middle) = self.halved(first, last)
            {
                self.settle(middle, last, true, segments);
                self.settle(first, middle, true, segments);
                return;
            }
        }
        segments.extend(self.arcs(whole));
    }

    /// The sample at which two cubics instead of one have the least error.
    fn halved(&self, first: usize, last: usize) -> Option<usize> {
        let places = first + MIN_HALF_STEPS..=last - MIN_HALF_STEPS;
        let errors = |end: usize, middles: &mut dyn Iterator<Item = usize>| -> Vec<f64> {
            let mut sums = Sums::start(self, end);
            let mut errors = Vec::new();
            let mut count = 0;
            for k in middles {
                sums.push(self, k);
                count += 1;
                if count >= MIN_HALF_STEPS {
                    errors.push(sums.cubic_error());
                }
            }
            errors
        };
        let before = errors(first, &mut (first + 1..=last - MIN_HALF_STEPS));
        let after = errors(last, &mut (first + MIN_HALF_STEPS..last).rev());
        let total = before.iter().zip(after.iter().rev()).map(|(a, b)| a + b);
        places
            .zip(total)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|p| p.0)
    }

    /// A piece cut into arcs of little turn, the last one first: cubics with unit speed at
    /// both ends follow only such arcs.
    fn arcs(&self, whole: Segment) -> Vec<Segment> {
        let mut cuts = vec![whole.first];
        if matches!(whole.form, Form::Cubic { .. }) {
            let (mut turn, mut before) = (0.0, self.at(&whole, whole.first).1);
            for k in whole.first + 1..whole.last {
                let here = self.at(&whole, k).1;
                turn += libm::atan2(cross(before, here), dot(before, here)).abs();
                before = here;
                if turn > MAX_TURN {
                    cuts.push(k);
                    turn = 0.0;
                }
            }
        }
        cuts.push(whole.last);
        let arc = |pair: &[usize]| Segment {
            first: pair[0],
            last: pair[1],
            ..whole
        };
        cuts.windows(2).rev().map(arc).collect()
    }

    /// The line or cubic of least squares along samples.
    pub(crate) fn form(&self, first: usize, last: usize, curved: bool) -> Form {
        let mut sums = Sums::start(self, first);
        for k in first + 1..=last {
            sums.push(self, k);
        }
        let origin = self.points[first];
        if let (true, Some((x, y))) = (curved, sums.cubic()) {
            let shift = |mut c: [f64; 4], by: f64| {
                c[0] += by;
                c
            };
            if self.placed {
                return Form::Cubic {
                    x: shift(x, origin[0]),
                    y: shift(y, origin[1]),
                };
            }
            let reach = self.length[last] - self.length[first];
            let scaled = |c: [f64; 4]| {
                [
                    c[0],
                    c[1] * reach,
                    c[2] * reach * reach,
                    c[3] * reach * reach * reach,
                ]
            };
            let whole = [shift(x, origin[0]), shift(y, origin[1])].map(scaled);
            let inner = first + 1..last;
            let shares: Vec<f64> = self.length[inner.clone()]
                .iter()
                .map(|l| (l - self.length[first]) / reach)
                .collect();
            let [x, y] = separating_cubic(&self.points[inner], &shares, whole).map(|c| {
                [
                    c[0],
                    c[1] / reach,
                    c[2] / (reach * reach),
                    c[3] / (reach * reach * reach),
                ]
            });
            return Form::Cubic { x, y };
        }
        let (mean, mut along) = sums.line();
        let chord = minus(self.points[last], origin);
        if dot(along, chord) < 0.0 {
            along = [-along[0], -along[1]];
        }
        let point = [mean[0] + origin[0], mean[1] + origin[1]];
        if self.placed {
            return Form::Line { point, along };
        }
        // The samples next to a corner cut it off and say nothing about the line.
        let inner = if last - first >= 6 {
            first + 1..last
        } else {
            first..last + 1
        };
        let line = separating(&self.points[inner], Line { point, along });
        Form::Line {
            point: line.point,
            along: line.along,
        }
    }

    /// Point and unit tangent of a piece's curve at one of its samples.
    pub(crate) fn at(&self, segment: &Segment, sample: usize) -> ([f64; 2], [f64; 2]) {
        match segment.form {
            Form::Line { point, along } => {
                let t = dot(minus(self.points[sample], point), along);
                ([point[0] + t * along[0], point[1] + t * along[1]], along)
            }
            Form::Cubic { .. } => {
                let t = self.length[sample] - self.length[segment.origin];
                let (place, slope) = segment.on_form(t);
                let speed = norm(slope).max(1e-9);
                (place, [slope[0] / speed, slope[1] / speed])
            }
        }
    }

    /// Place and unit tangent of a piece's curve where it is nearest to a place, coming
    /// from one of its samples; the curve goes on beyond its ends.
    pub(crate) fn nearest(
        &self,
        segment: &Segment,
        sample: usize,
        place: [f64; 2],
    ) -> ([f64; 2], [f64; 2]) {
        let from = match segment.form {
            Form::Line { point, along } => dot(minus(self.points[sample], point), along),
            Form::Cubic { .. } => self.length[sample] - self.length[segment.origin],
        };
        let (found, slope) = segment.on_form(segment.foot(place, from));
        let speed = norm(slope).max(1e-9);
        (found, [slope[0] / speed, slope[1] / speed])
    }
}

impl Segment {
    /// Arc length from the origin at which the form is nearest to a place, by Newton's
    /// method from a length nearby.
    pub(crate) fn foot(&self, place: [f64; 2], from: f64) -> f64 {
        let mut at = from;
        for _ in 0..NEAREST_STEPS {
            let (on_curve, slope) = self.on_form(at);
            at += dot(minus(place, on_curve), slope) / dot(slope, slope).max(1e-6);
        }
        at
    }

    /// Place and derivative of the form at an arc length from its origin.
    pub(crate) fn on_form(&self, t: f64) -> ([f64; 2], [f64; 2]) {
        match self.form {
            Form::Line { point, along } => {
                ([point[0] + t * along[0], point[1] + t * along[1]], along)
            }
            Form::Cubic { x, y } => (
                [x, y].map(|c| c[0] + t * (c[1] + t * (c[2] + t * c[3]))),
                [x, y].map(|c| c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])),
            ),
        }
    }
}

/// The polyline after passes of the binomial filter 1-2-1, its ends kept.
pub(crate) fn smoothed(points: &[[f64; 2]], passes: usize) -> Vec<[f64; 2]> {
    let mut smooth = points.to_vec();
    for _ in 0..passes {
        let before = smooth.clone();
        for k in 1..before.len().saturating_sub(1) {
            for d in 0..2 {
                smooth[k][d] = (before[k - 1][d] + 2.0 * before[k][d] + before[k + 1][d]) / 4.0;
            }
        }
    }
    smooth
}

/// Index of the sample of a closed border with the sharpest turn, seen over a window.
pub(crate) fn sharpest(points: &[[f64; 2]]) -> usize {
    let count = points.len();
    let window = (count / 6).clamp(1, 6);
    let mut best = (f64::INFINITY, 0);
    for k in 0..count {
        let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
        for w in 1..=window {
            let (a, b) = (points[(k + count - w) % count], points[(k + w) % count]);
            for d in 0..2 {
                before[d] += points[k][d] - a[d];
                after[d] += b[d] - points[k][d];
            }
        }
        let cosine = dot(before, after) / (norm(before) * norm(after)).max(1e-9);
        if cosine < best.0 - 1e-12 {
            best = (cosine, k);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRICE: Price = Price {
        line: 7.0,
        cubic: 11.0,
    };

    #[test]
    fn a_line_of_any_slope_stays_whole() {
        for step in 0..60 {
            let slope = f64::from(step) / 59.0;
            // Middles of the cracks that part the nodes below a line from those above.
            let mut points = Vec::new();
            let height = |i: f64| (slope * i + 0.3).floor();
            for i in 0..150 {
                let i = f64::from(i);
                points.push([i, height(i) + 0.5]);
                if height(i + 1.0) > height(i) {
                    points.push([i + 0.5, height(i) + 1.0]);
                }
            }
            let samples = Samples::new(points);
            let segments = samples.divide(PRICE);
            assert_eq!(segments.len(), 1, "slope {slope}");
            let (_, along) = samples.at(&segments[0], 0);
            let error = libm::atan2(along[1], along[0]) - libm::atan(slope);
            assert!(error.abs() < 0.005, "slope {slope}: {error}");
        }
    }

    #[test]
    fn a_line_longer_than_any_piece_is_cut_and_stays_straight() {
        let count = 2 * MOST_STEPS + 10;
        let points = (0..count).map(|k| [k as f64, 0.5]).collect();
        let samples = Samples::new(points);
        let segments = samples.divide(PRICE);
        // Two pieces cannot span it.
        assert_eq!(segments.len(), 3);
        for pair in segments.windows(2) {
            assert_eq!(pair[0].last, pair[1].first);
        }
        for segment in &segments {
            assert!(segment.last - segment.first <= MOST_STEPS);
            assert_eq!(samples.at(segment, segment.first).1, [1.0, 0.0]);
        }
    }

    #[test]
    fn a_corner_divides_two_lines_where_it_is() {
        for degrees in [25.0_f64, 40.0, 90.0] {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let mut points: Vec<[f64; 2]> = (0..40).map(|k| [f64::from(k), 0.0]).collect();
            points.extend((1..40).map(|k| [39.0 + f64::from(k) * cos, f64::from(k) * sin]));
            for (k, p) in points.iter_mut().enumerate() {
                p[1] += [0.3, -0.2, 0.1, -0.3, 0.2][k % 5];
            }
            let samples = Samples::new(points);
            let segments = samples.divide(PRICE);
            assert_eq!(segments.len(), 2, "{degrees} degrees");
            assert!(segments[0].last.abs_diff(39) <= 1);
        }
    }

    #[test]
    fn a_circle_takes_a_few_cubics() {
        let points: Vec<[f64; 2]> = (0..=250)
            .map(|k| {
                let (sin, cos) = libm::sincos(f64::from(k) * core::f64::consts::TAU / 250.0);
                [40.0 * cos, 40.0 * sin]
            })
            .collect();
        let samples = Samples::new(points);
        let segments = samples.divide(PRICE);
        assert!(segments.len() <= 16, "{}", segments.len());
        for s in &segments {
            for k in s.first..=s.last {
                let radius = norm(samples.at(s, k).0);
                assert!((radius - 40.0).abs() < 0.5, "{radius}");
            }
        }
    }

    #[test]
    fn the_sharpest_sample_is_the_corner() {
        let mut points: Vec<[f64; 2]> = (0..20).map(|k| [f64::from(k), 0.0]).collect();
        points.extend((1..20).map(|k| [19.0, f64::from(k)]));
        points.extend((1..19).rev().map(|k| [f64::from(k), f64::from(k)]));
        let at = points[sharpest(&points)];
        assert!(norm(minus(at, [0.0, 0.0])) < 1.5 || norm(minus(at, [19.0, 19.0])) < 1.5);
    }
}
