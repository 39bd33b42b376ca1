//! Smooth stretches of a border as one spline each.
//!
//! The division into lines and cubics finds what a border is made of, but each of its
//! pieces knows only its own samples. Along a stretch that goes on smoothly, a spline
//! with continuous curvature and as few spans as the samples justify averages over all of
//! them, and so lies well below a pitch from the border, and reaches farther beyond its
//! ends, where a junction has to be found.

use super::segments::{Form, Samples, Segment};
use super::spline::Splines;
use crate::polygon::{dot, minus, norm};

/// Fewer samples are left as they are.
const LEAST_SAMPLES: usize = 16;

/// Samples next to a junction that do not count: three regions share the nodes there,
/// and windows reach across.
const JUNCTION_SAMPLES: usize = 3;

/// The same next to a corner, which the traced border cuts off.
const CORNER_SAMPLES: usize = 1;

/// Price of a corner against that of a span.
const CORNER_PRICE: f64 = 1.0;

/// Neighbouring stretches that are tried as one, or as two that meet elsewhere, at most.
const MERGED: usize = 3;

/// A corner passed over has to be cheaper by this share of the price of a span once found,
/// lest rounding errors keep the search for better ones going.
const FOUND_GAIN: f64 = 1e-3;

/// The same for a corner that moves, or stands for several. The samples at the ends that
/// count for a line and not for a spline are no reason to: with a thousandth, 12 of 40
/// simulated cylinders have an outline off by more than a pitch, with 0.3 to 1 none. With 1
/// a blunt corner is rounded in one of 128 cases.
const MOVED_GAIN: f64 = 0.5;

/// Samples to either side over which a turn is seen, and how far beside the sharpest turn
/// a corner is looked for.
const TURN_SAMPLES: usize = 12;
const CORNER_SHIFT: usize = 3;

/// Price of a straight stretch against that of a span.
const LINE_PRICE: f64 = 0.5;

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
    let mut splines = Splines::new(samples, price);
    let count = stretches.len();
    for (k, stretch) in stretches.iter_mut().enumerate() {
        let around = [k > 0, k + 1 < count].map(neighbour);
        stretch.cost = cost_of(samples, stretch, price);
        // A short arc may as well have been taken for two lines.
        if (stretch.curved || stretch.segments.len() > 1)
            && let Some(splined) = splined(&mut splines, stretch, around)
            && (stretch.curved || splined.cost < stretch.cost)
        {
            *stretch = splined;
        }
    }
    let part = |splines: &mut Splines, stretches: &mut Vec<Stretch>, most: usize| {
        regroup(stretches, 1..=most, |group, around| {
            let parts = parted(splines, group, around, corner_cosine)?;
            Some(parts.into())
        })
    };
    part(&mut splines, &mut stretches, 1);
    loop {
        // Two false corners may each need the other.
        regroup(&mut stretches, 2..=MERGED, |group, around| {
            Some(vec![merged(&mut splines, group, around)?])
        });
        // A spline that did away with false corners may have passed over a true one, or
        // left it to a false one beside it.
        if !part(&mut splines, &mut stretches, MERGED) {
            break;
        }
    }
    stretches.into_iter().flat_map(|s| s.segments).collect()
}

/// Replaces groups of neighbouring stretches, as many as one of `sizes`, by what `better`
/// makes of them, until it makes nothing of any. True when there was one.
fn regroup(
    stretches: &mut Vec<Stretch>,
    sizes: core::ops::RangeInclusive<usize>,
    mut better: impl FnMut(&[Stretch], [Neighbour; 2]) -> Option<Vec<Stretch>>,
) -> bool {
    let (mut k, mut changed) = (0, false);
    while k < stretches.len() {
        let found = sizes.clone().find_map(|size| {
            let group = stretches.get(k..k + size)?;
            let around = [k > 0, k + size < stretches.len()].map(neighbour);
            Some((better(group, around)?, size))
        });
        if let Some((made, size)) = found {
            stretches.splice(k..k + size, made);
            k = k.saturating_sub(sizes.end() - 1);
            changed = true;
        } else {
            k += 1;
        }
    }
    changed
}

fn neighbour(corner: bool) -> Neighbour {
    if corner {
        Neighbour::Corner
    } else {
        Neighbour::Junction
    }
}

/// Neighbouring stretches as two that meet at the sharpest turn, if they follow the samples
/// better: a corner that the pieces have passed over, or placed beside where it is.
fn parted(
    splines: &mut Splines,
    group: &[Stretch],
    around: [Neighbour; 2],
    corner_cosine: f64,
) -> Option<[Stretch; 2]> {
    let (samples, price) = (splines.samples, splines.price);
    let apart = apart(group, price)?;
    let (first, last) = apart.range()?;
    let sharpest = (first + LEAST_SAMPLES..=last.checked_sub(LEAST_SAMPLES)?)
        .map(|k| (turn_cosine(&samples.points, k), k))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(cosine, _)| *cosine < corner_cosine.sqrt())?
        .1;
    let mut part = |first: usize, last: usize, around: [Neighbour; 2]| {
        let whole = Stretch {
            segments: vec![Segment {
                first,
                last,
                ..*apart.segments.first()?
            }],
            curved: true,
            cost: apart.cost,
        };
        splined(splines, &whole, around)
    };
    let gain = if group.len() == 1 {
        FOUND_GAIN
    } else {
        MOVED_GAIN
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
            (turns && cost + gain * price < apart.cost).then_some((cost, parts))
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
fn merged(splines: &mut Splines, group: &[Stretch], around: [Neighbour; 2]) -> Option<Stretch> {
    let apart = apart(group, splines.price)?;
    splined(splines, &apart, around).filter(|s| s.cost <= apart.cost)
}

/// Neighbouring stretches taken together, at the price of the corners between them too;
/// `None` when none is curved.
fn apart(group: &[Stretch], price: f64) -> Option<Stretch> {
    let corners = CORNER_PRICE * price * group.len().checked_sub(1)? as f64;
    group.iter().any(|s| s.curved).then(|| Stretch {
        segments: group.iter().flat_map(|s| &s.segments).copied().collect(),
        curved: true,
        cost: group.iter().map(|s| s.cost).sum::<f64>() + corners,
    })
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
fn splined(splines: &mut Splines, stretch: &Stretch, around: [Neighbour; 2]) -> Option<Stretch> {
    let (samples, price) = (splines.samples, splines.price);
    let (first, last) = stretch.range()?;
    if last - first < LEAST_SAMPLES {
        return None;
    }
    let clear = around.map(|n| match n {
        Neighbour::Junction => JUNCTION_SAMPLES,
        Neighbour::Corner => CORNER_SAMPLES,
    });
    let (from, to) = (first + clear[0], last - clear[1]);
    let spline = splines.cheapest(from, to)?;
    let cost = spline.cost(price);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::border::path::draw;
    use crate::border::segments::Price;
    use crate::polygon::distance_to_segment;

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

    /// Two arcs of radius 60 that meet in the middle, at `TIP`, turning by an angle; the
    /// second is bent as the first is (1) or the other way (-1).
    fn meeting_arcs(turn: f64, heading: f64, bent: f64) -> impl Fn(f64) -> [f64; 2] {
        let from_tip = |heading: f64, bent: f64, length: f64| {
            let (sin, cos) = libm::sincos(heading);
            let (rise, run) = libm::sincos(length / 60.0);
            let (ahead, aside) = (60.0 * rise, bent * 60.0 * (1.0 - run));
            [
                TIP[0] + ahead * cos - aside * sin,
                TIP[1] + ahead * sin + aside * cos,
            ]
        };
        move |t: f64| match 140.0 * (t - 0.5) {
            before if before < 0.0 => from_tip(heading, 1.0, before),
            after => from_tip(heading + turn, bent, after),
        }
    }

    const TIP: [f64; 2] = [0.3, 0.1];

    /// Greatest distance of one polyline from another within 20 pitches of the tip.
    fn farthest_at_tip(these: &[[f64; 2]], those: &[[f64; 2]]) -> f64 {
        let within = |reach: f64| move |p: &[f64; 2]| norm(minus(*p, TIP)) < reach;
        let those: Vec<_> = those.iter().copied().filter(within(25.0)).collect();
        let off = these.iter().copied().filter(within(20.0)).map(|p| {
            let sides = those.windows(2);
            let off = sides.map(|s| distance_to_segment(p, s[0], s[1]));
            off.fold(f64::INFINITY, f64::min)
        });
        off.fold(0.0, f64::max)
    }

    #[test]
    fn corners_between_two_arcs_are_drawn_within_a_pitch() {
        let turns = [40.0_f64, 65.0, 90.0, 115.0].map(f64::to_radians);
        let cases = turns.into_iter().flat_map(|turn| {
            let headings = (0..16).map(|k| 0.1 + core::f64::consts::TAU * f64::from(k) / 16.0);
            headings.flat_map(move |heading| [1.0, -1.0].map(|bent| (turn, heading, bent)))
        });
        for case in cases {
            let curve = meeting_arcs(case.0, case.1, case.2);
            let samples = Samples::new(digital(&curve, 200));
            let segments = smooth(&samples, samples.divide(PRICE), CORNER_COSINE, SPAN_PRICE);
            assert_whole(&samples, &segments);
            let ends = Some((curve(0.0), curve(1.0)));
            let drawn = draw(&samples, &segments, ends, CORNER_COSINE).unwrap();
            let drawn: Vec<_> = drawn.iter().flat_map(|path| path.sampled(100)).collect();
            let truth: Vec<_> = (0..=400).map(|k| curve(f64::from(k) / 400.0)).collect();
            let (out, back) = (
                farthest_at_tip(&drawn, &truth),
                farthest_at_tip(&truth, &drawn),
            );
            assert!(out < 1.0 && back < 1.0, "{case:?}: {out}, {back}");
        }
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
