//! From the pieces of a border to cubic paths between vertices.

use nurbs::PiecewiseCubic;

use super::segments::{Form, Samples, Segment};
use crate::polygon::{cross, distance_to_segment, dot, minus, norm};

/// How far a corner may lie from the sample at which its pieces meet, pitches.
const CORNER_REACH: f64 = 4.0;

/// Reach of the arc that rounds a joint of two lines too blunt for a vertex, pitches.
const BLEND_REACH: f64 = 2.0;

/// Length over which a curve leaves its course to reach a vertex beside it, pitches.
const BEND_REACH: f64 = 12.0;

/// Share of the shorter side of a polyline's corner that its rounding takes.
const ROUNDED_SHARE: f64 = 0.3;

/// Shorter pieces are dropped, pitches.
const NEGLIGIBLE: f64 = 1e-6;

/// A place where two pieces meet, or a border ends.
#[derive(Debug, Clone, Copy)]
struct Joint {
    place: [f64; 2],
    /// A vertex of the model.
    vertex: bool,
}

/// Cuts the pieces of a border at its corners (second stage of section IV) and draws
/// each stretch between vertices as one smooth path with arc length as parameter.
///
/// `ends` are the places of the junctions of an open border; a closed one has its first
/// sample repeated as its last. `None` when a stretch has no length.
pub(crate) fn draw(
    samples: &Samples,
    segments: &[Segment],
    ends: Option<([f64; 2], [f64; 2])>,
    corner_cosine: f64,
) -> Option<Vec<PiecewiseCubic<2>>> {
    let joints = joints(samples, segments, ends, corner_cosine)?;
    let mut stretches = Vec::new();
    let mut first = 0;
    for last in 1..joints.len() {
        if joints[last].vertex || last + 1 == joints.len() {
            let wraps =
                ends.is_none() && first == 0 && last + 1 == joints.len() && !joints[0].vertex;
            let pen = Pen {
                samples,
                segments,
                joints: &joints,
                first,
                last,
                wraps,
            };
            stretches.push(pen.stretch()?);
            first = last;
        }
    }
    Some(stretches)
}

fn joints(
    samples: &Samples,
    segments: &[Segment],
    ends: Option<([f64; 2], [f64; 2])>,
    corner_cosine: f64,
) -> Option<Vec<Joint>> {
    let joint = |before: &Segment, after: &Segment| {
        let ((p, u), (q, v)) = (
            samples.at(before, before.last),
            samples.at(after, after.first),
        );
        let middle = [(p[0] + q[0]) / 2.0, (p[1] + q[1]) / 2.0];
        if dot(u, v) > corner_cosine {
            return Joint {
                place: middle,
                vertex: false,
            };
        }
        let meeting = meeting(p, u, q, v)
            .filter(|m| norm(minus(*m, samples.points[after.first])) <= CORNER_REACH);
        Joint {
            place: meeting.unwrap_or(middle),
            vertex: true,
        }
    };
    let inner = segments.windows(2).map(|pair| joint(&pair[0], &pair[1]));
    let (first, last) = (segments.first()?, segments.last()?);
    let (start, end) = match ends {
        Some((a, b)) => (
            Joint {
                place: a,
                vertex: true,
            },
            Joint {
                place: b,
                vertex: true,
            },
        ),
        None => {
            let seam = joint(last, first);
            (seam, seam)
        }
    };
    Some(core::iter::once(start).chain(inner).chain([end]).collect())
}

/// Where two lines meet.
fn meeting(p: [f64; 2], u: [f64; 2], q: [f64; 2], v: [f64; 2]) -> Option<[f64; 2]> {
    let sine = cross(u, v);
    if sine.abs() < 1e-6 {
        return None;
    }
    let t = cross(minus(q, p), v) / sine;
    Some([p[0] + t * u[0], p[1] + t * u[1]])
}

/// An end of a segment as it is drawn.
struct End {
    place: [f64; 2],
    /// Derivative of the segment's form there.
    slope: [f64; 2],
    /// Arc length from the form's origin.
    at: f64,
}

/// Draws the segments `first..last` as one path.
struct Pen<'a> {
    samples: &'a Samples,
    segments: &'a [Segment],
    joints: &'a [Joint],
    first: usize,
    last: usize,
    /// The stretch is a closed border without a corner.
    wraps: bool,
}

impl Pen<'_> {
    fn is_line(&self, k: usize) -> bool {
        matches!(self.segments[k].form, Form::Line { .. })
    }

    /// Direction of the chord of segment `k`.
    fn chord(&self, k: usize) -> Option<[f64; 2]> {
        let chord = minus(self.joints[k + 1].place, self.joints[k].place);
        let length = norm(chord);
        (length > NEGLIGIBLE).then(|| [chord[0] / length, chord[1] / length])
    }

    /// The segments before and after joint `k` where the path goes smoothly through it.
    fn through(&self, k: usize) -> Option<(usize, usize)> {
        if k > self.first && k < self.last {
            Some((k - 1, k))
        } else if self.wraps {
            Some((self.last - 1, self.first))
        } else {
            None
        }
    }

    /// Where segment `k` is drawn from or to: `by` after its start or before its end.
    fn end_of(&self, k: usize, at_end: bool, by: f64) -> Option<End> {
        let segment = &self.segments[k];
        let joint = &self.joints[if at_end { k + 1 } else { k }];
        let inward = if at_end { -by } else { by };
        if let Form::Line { .. } = segment.form {
            let along = self.chord(k)?;
            return Some(End {
                place: [0, 1].map(|d| joint.place[d] + inward * along[d]),
                slope: along,
                at: 0.0,
            });
        }
        let lengths = &self.samples.length;
        let sample = if at_end { segment.last } else { segment.first };
        let mut at = lengths[sample] - lengths[segment.origin] + inward;
        if by > 0.0 {
            let (place, slope) = segment.on_form(at);
            return Some(End { place, slope, at });
        }
        // A vertex may lie beyond the last sample or before it: the curve goes on to the
        // place nearest to it.
        at = segment.foot(joint.place, at);
        Some(End {
            place: joint.place,
            slope: segment.on_form(at).1,
            at,
        })
    }

    /// How far pieces of different form stop short of joint `k`, where the path goes on,
    /// to make room for a rounding arc.
    fn room(&self, k: usize) -> f64 {
        let Some((before, after)) = self.through(k) else {
            return 0.0;
        };
        let (before, after) = (&self.segments[before], &self.segments[after]);
        if before.form == after.form {
            return 0.0;
        }
        let third =
            |s: &Segment| (self.samples.length[s.last] - self.samples.length[s.first]) / 3.0;
        BLEND_REACH.min(third(before)).min(third(after))
    }

    /// Draws curved segment `k`. It is bent only next to a vertex that lies beside it.
    fn curve(&self, k: usize, from: &End, to: &End, path: &mut Builder) {
        let mut inner = Vec::new();
        if to.at - from.at > 2.0 * BEND_REACH {
            let (starts, ends) = (k == self.first, k + 1 == self.last);
            inner.extend((starts && !self.wraps).then_some(from.at + BEND_REACH));
            inner.extend((ends && !self.wraps).then_some(to.at - BEND_REACH));
        }
        let (mut place, mut slope, mut at) = (from.place, from.slope, from.at);
        for next in inner {
            let (beyond, onward) = self.segments[k].on_form(next);
            path.hermite(place, slope, beyond, onward, next - at);
            (place, slope, at) = (beyond, onward, next);
        }
        path.hermite(place, slope, to.place, to.slope, to.at - at);
    }

    fn stretch(&self) -> Option<PiecewiseCubic<2>> {
        let mut path = Builder::default();
        for k in self.first..self.last {
            let (head, tail) = (self.room(k), self.room(k + 1));
            let (from, to) = (self.end_of(k, false, head)?, self.end_of(k, true, tail)?);
            if self.is_line(k) {
                path.line(from.place, to.place);
            } else if to.at - from.at > NEGLIGIBLE {
                self.curve(k, &from, &to, &mut path);
            } else {
                // A vertex lies beyond the far end of the segment next to it.
                return None;
            }
            if tail > 0.0
                && let Some((_, after)) = self.through(k + 1)
            {
                let next = self.end_of(after, false, tail)?;
                path.arc(to.place, to.slope, next.place, next.slope);
            }
        }
        path.finish()
    }
}

/// Gathers pieces, each over its own arc length.
#[derive(Default)]
struct Builder {
    breaks: Vec<f64>,
    pieces: Vec<[[f64; 4]; 2]>,
}

impl Builder {
    fn push(&mut self, length: f64, piece: [[f64; 4]; 2]) {
        if self.breaks.is_empty() {
            self.breaks.push(0.0);
        }
        let at = self.breaks[self.breaks.len() - 1];
        self.breaks.push(at + length);
        self.pieces.push(piece);
    }

    fn line(&mut self, from: [f64; 2], to: [f64; 2]) {
        let length = norm(minus(to, from));
        if length > NEGLIGIBLE {
            let piece = [0, 1].map(|d| [from[d], (to[d] - from[d]) / length, 0.0, 0.0]);
            self.push(length, piece);
        }
    }

    /// The cubic with these derivatives at its ends whose parameter ends at its own length.
    fn arc(&mut self, from: [f64; 2], out: [f64; 2], to: [f64; 2], into: [f64; 2]) {
        let mut length = norm(minus(to, from));
        if length <= NEGLIGIBLE {
            return;
        }
        for _ in 0..2 {
            let trial = PiecewiseCubic {
                breaks: vec![0.0, length],
                pieces: vec![hermite(from, out, to, into, length)],
            };
            length = trial.arc_length();
        }
        self.push(length, hermite(from, out, to, into, length));
    }

    /// The cubic with these derivatives at its ends over a parameter of this length.
    fn hermite(
        &mut self,
        from: [f64; 2],
        out: [f64; 2],
        to: [f64; 2],
        into: [f64; 2],
        length: f64,
    ) {
        self.push(length, hermite(from, out, to, into, length));
    }

    fn finish(self) -> Option<PiecewiseCubic<2>> {
        PiecewiseCubic::new(self.breaks, self.pieces).ok()
    }
}

/// The coefficients of the cubic with these derivatives at its ends over a parameter of this
/// length.
pub(crate) fn hermite(
    from: [f64; 2],
    out: [f64; 2],
    to: [f64; 2],
    into: [f64; 2],
    length: f64,
) -> [[f64; 4]; 2] {
    [0, 1].map(|d| {
        let mean = (to[d] - from[d]) / length;
        [
            from[d],
            out[d],
            (3.0 * mean - 2.0 * out[d] - into[d]) / length,
            (out[d] + into[d] - 2.0 * mean) / (length * length),
        ]
    })
}

/// The polyline itself as a path: the last resort, which separates the nodes whatever
/// their labels. Straight runs become one piece.
pub(crate) fn polyline(points: &[[f64; 2]]) -> Option<PiecewiseCubic<2>> {
    let mut path = Builder::default();
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for &p in points {
        if let [.., a, b] = corners[..]
            && cross(minus(b, a), minus(p, b)) == 0.0
            && dot(minus(b, a), minus(p, b)) > 0.0
        {
            corners.pop();
        }
        corners.push(p);
    }
    // Corners are rounded a little, inside the triangle that they cut off: readers split
    // a curve where its tangent jumps.
    let mut from = *corners.first()?;
    for (k, pair) in corners.windows(2).enumerate() {
        let length = norm(minus(pair[1], pair[0]));
        let along = minus(pair[1], pair[0]).map(|d| d / length);
        let Some(&next) = corners.get(k + 2) else {
            path.line(from, pair[1]);
            break;
        };
        let beyond = norm(minus(next, pair[1]));
        let onward = minus(next, pair[1]).map(|d| d / beyond);
        let reach = ROUNDED_SHARE * length.min(beyond);
        let end = [0, 1].map(|d| pair[1][d] - reach * along[d]);
        let begin = [0, 1].map(|d| pair[1][d] + reach * onward[d]);
        path.line(from, end);
        path.arc(end, along, begin, onward);
        from = begin;
    }
    path.finish()
}

/// A path by the letter of section V: one cubic in arc length through the ends and the
/// points at the thirds of the traced border (equation 7), divided where it leaves the
/// border by more than `bound`.
pub(crate) fn through_thirds(points: &[[f64; 2]], bound: f64) -> Option<PiecewiseCubic<2>> {
    let mut path = Builder::default();
    let mut length = vec![0.0];
    for pair in points.windows(2) {
        length.push(length[length.len() - 1] + norm(minus(pair[1], pair[0])));
    }
    thirds_between(
        &mut path,
        points,
        &length,
        (0, points.len().checked_sub(1)?),
        bound,
    );
    path.finish()
}

fn thirds_between(
    path: &mut Builder,
    points: &[[f64; 2]],
    length: &[f64],
    (first, last): (usize, usize),
    bound: f64,
) {
    let total = length[last] - length[first];
    if last <= first || total <= NEGLIGIBLE {
        return;
    }
    if last - first < 3 {
        for k in first..last {
            path.line(points[k], points[k + 1]);
        }
        return;
    }
    let third = |k: f64| along(points, length, length[first] + total * k / 3.0);
    let four = [points[first], third(1.0), third(2.0), points[last]];
    let Ok(cubic) = PiecewiseCubic::through_thirds(0.0, total, &four) else {
        return;
    };
    let drawn = cubic.sampled(2 * (last - first));
    let mut worst = (bound, 0);
    for k in first + 1..last {
        let share = (length[k] - length[first]) / total;
        let near = (share * (drawn.len() - 1) as f64) as usize;
        let window = &drawn[near.saturating_sub(6)..(near + 7).min(drawn.len())];
        let off = window
            .windows(2)
            .map(|s| distance_to_segment(points[k], s[0], s[1]))
            .fold(f64::INFINITY, f64::min);
        if off > worst.0 {
            worst = (off, k);
        }
    }
    if worst.1 == 0 {
        path.push(total, cubic.pieces[0]);
    } else {
        thirds_between(path, points, length, (first, worst.1), bound);
        thirds_between(path, points, length, (worst.1, last), bound);
    }
}

/// The point of a polyline at a length along it.
fn along(points: &[[f64; 2]], length: &[f64], at: f64) -> [f64; 2] {
    let k = length
        .partition_point(|&l| l <= at)
        .clamp(1, points.len() - 1);
    let t = ((at - length[k - 1]) / (length[k] - length[k - 1])).clamp(0.0, 1.0);
    let (a, b) = (points[k - 1], points[k]);
    [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::border::segments::Price;

    const PRICE: Price = Price {
        line: 7.0,
        cubic: 11.0,
    };

    #[test]
    fn a_square_gets_four_straight_stretches() {
        let mut points = Vec::new();
        for side in 0..4 {
            for k in 0..20 {
                let k = f64::from(k);
                points.push(match side {
                    0 => [k, 0.0],
                    1 => [20.0, k],
                    2 => [20.0 - k, 20.0],
                    _ => [0.0, 20.0 - k],
                });
            }
        }
        points.push(points[0]);
        let samples = Samples::new(points);
        let stretches = draw(&samples, &samples.divide(PRICE), None, 0.94).unwrap();
        assert_eq!(stretches.len(), 4);
        for path in &stretches {
            assert_eq!(path.pieces.len(), 1);
            assert!((path.arc_length() - 20.0).abs() < 1e-6);
        }
        assert!(norm(minus(stretches[3].end(), stretches[0].start())) < 1e-12);
    }

    #[test]
    fn a_circle_is_one_smooth_stretch_in_arc_length() {
        let points: Vec<[f64; 2]> = (0..=250)
            .map(|k| {
                let (sin, cos) = libm::sincos(f64::from(k) * core::f64::consts::TAU / 250.0);
                [40.0 * cos, 40.0 * sin]
            })
            .collect();
        let samples = Samples::new(points);
        let stretches = draw(&samples, &samples.divide(PRICE), None, 0.94).unwrap();
        assert_eq!(stretches.len(), 1);
        let path = &stretches[0];
        let length = path.domain().1;
        assert!(
            (length - 40.0 * core::f64::consts::TAU).abs() < 4.0,
            "{length}"
        );
        for k in 0..=500 {
            let t = length * f64::from(k) / 500.0;
            assert!((norm(path.evaluate(t)) - 40.0).abs() < 0.3);
            assert!((norm(path.derivative(t, 1)) - 1.0).abs() < 0.2);
        }
        for (k, &b) in path
            .breaks
            .iter()
            .enumerate()
            .skip(1)
            .take(path.pieces.len() - 1)
        {
            let width = b - path.breaks[k - 1];
            let (left, right) = (
                path.piece_value(k - 1, width, 1),
                path.piece_value(k, 0.0, 1),
            );
            assert!(norm(minus(left, right)) < 1e-9);
        }
    }

    #[test]
    fn a_blunt_joint_of_lines_is_rounded() {
        let mut points: Vec<[f64; 2]> = (0..60).map(|k| [f64::from(k), 0.0]).collect();
        points.extend((1..60).map(|k| [59.0 + f64::from(k), 0.2 * f64::from(k)]));
        let ends = Some((points[0], points[points.len() - 1]));
        let samples = Samples::new(points);
        let segments = samples.divide(PRICE);
        assert_eq!(segments.len(), 2);
        let stretches = draw(&samples, &segments, ends, 0.94).unwrap();
        assert_eq!((stretches.len(), stretches[0].pieces.len()), (1, 3));
        let at = stretches[0].evaluate(59.0);
        assert!(norm(minus(at, [59.0, 0.0])) < 0.5, "{at:?}");
    }

    #[test]
    fn a_curve_bends_to_a_vertex_beside_it_only_near_it() {
        let points: Vec<[f64; 2]> = (0..=100)
            .map(|k| {
                let x = f64::from(k);
                [x, 0.004 * x * x]
            })
            .collect();
        let samples = Samples::new(points.clone());
        let whole = Segment {
            first: 0,
            last: 100,
            origin: 0,
            form: samples.form(0, 100, true),
        };
        let ends = ([-0.2, 1.0], points[100]);
        let paths = draw(&samples, &[whole], Some(ends), 0.94).unwrap();
        assert_eq!(paths.len(), 1);
        let drawn = paths[0].sampled(600);
        assert!(norm(minus(drawn[0], ends.0)) < 1e-9);
        assert!(norm(minus(drawn[drawn.len() - 1], ends.1)) < 1e-9);
        for p in drawn.iter().filter(|p| p[0] > BEND_REACH + 1.0) {
            let off = p[1] - 0.004 * p[0] * p[0];
            assert!(off.abs() < 0.3, "{p:?}: {off}");
        }
    }

    #[test]
    fn thirds_follow_a_staircase_within_the_bound() {
        let points: Vec<[f64; 2]> = (0..200)
            .map(|k| [f64::from(k), (0.3 * f64::from(k)).floor()])
            .collect();
        let path = through_thirds(&points, 1.0).unwrap();
        assert!(path.pieces.len() < 12, "{}", path.pieces.len());
        assert_eq!(path.start(), points[0]);
        assert!(norm(minus(path.end(), points[199])) < 1e-9);
    }

    #[test]
    fn a_polyline_merges_straight_runs() {
        let path = polyline(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.5, 0.5]]).unwrap();
        // Two lines and the arc between them.
        assert_eq!(path.pieces.len(), 3);
        assert!(norm(minus(path.end(), [2.5, 0.5])) < 1e-12);
    }
}
