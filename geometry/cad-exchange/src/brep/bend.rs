//! Curves between curves, and curves led to other ends.

use nurbs::PiecewiseCubic;

use crate::common::shifted;

/// An end is led to its vertex over this many times the distance.
const REACH: f64 = 100.0;

/// Breaks nearer than this part of a curve's domain are one.
const SAME_BREAK: f64 = 1e-9;

/// Chords to a piece of a curve that is measured.
const CHORDS: usize = 4;

pub(super) fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// The length of a curve, by chords.
pub(super) fn length_mm(curve: &PiecewiseCubic<3>) -> f64 {
    let points = curve.sampled(CHORDS * curve.pieces.len());
    points.windows(2).map(|pair| apart(pair[0], pair[1])).sum()
}

/// The curve half way between two over the same parameters.
pub(super) fn mean(a: &PiecewiseCubic<3>, b: &PiecewiseCubic<3>) -> PiecewiseCubic<3> {
    let (first, last) = a.domain();
    let apart = SAME_BREAK * (last - first);
    let mut inner: Vec<f64> = a.breaks.iter().chain(&b.breaks).copied().collect();
    inner.sort_by(f64::total_cmp);
    let mut breaks = vec![first];
    for t in inner {
        let before = breaks.last().copied().unwrap_or(first);
        if t - before > apart && last - t > apart {
            breaks.push(t);
        }
    }
    breaks.push(last);
    let pieces = breaks
        .windows(2)
        .map(|pair| {
            let (one, other) = (from(a, pair[0], pair[1]), from(b, pair[0], pair[1]));
            core::array::from_fn(|d| core::array::from_fn(|k| (one[d][k] + other[d][k]) / 2.0))
        })
        .collect();
    PiecewiseCubic { breaks, pieces }
}

/// The cubic that holds between two neighbouring breaks, its parameter counted from the
/// first of them.
fn from(curve: &PiecewiseCubic<3>, t: f64, next: f64) -> [[f64; 4]; 3] {
    let inside = t + (next - t) / 2.0;
    let piece = curve.breaks.partition_point(|&b| b <= inside);
    let piece = piece.saturating_sub(1).min(curve.pieces.len() - 1);
    let s = t - curve.breaks[piece];
    curve.pieces[piece].map(|c| shifted(&c, s))
}

/// The curve with its ends led to other points: near each end a cubic is added that comes
/// from nothing without a jump of the second derivative. Nowhere is the curve further
/// from the original than the two ends are together.
pub(super) fn bent(curve: &PiecewiseCubic<3>, start: [f64; 3], end: [f64; 3]) -> PiecewiseCubic<3> {
    let backwards = led(&curve.reversed(), curve.start(), start);
    match backwards {
        Some(backwards) => {
            let curve = backwards.reversed();
            led(&curve, curve.end(), end).unwrap_or(curve)
        }
        None => led(curve, curve.end(), end).unwrap_or_else(|| curve.clone()),
    }
}

/// The curve with its end led from one point to another; `None` where they are the same.
fn led(curve: &PiecewiseCubic<3>, from: [f64; 3], to: [f64; 3]) -> Option<PiecewiseCubic<3>> {
    let offset: [f64; 3] = core::array::from_fn(|d| to[d] - from[d]);
    let length = offset.iter().map(|d| d * d).sum::<f64>().sqrt();
    let (first, last) = curve.domain();
    let domain = last - first;
    // What is below rounding is left to the last control point.
    if length <= 1e-9 || domain.is_nan() || domain <= 0.0 {
        return None;
    }
    let reach = (REACH * length).min(domain);
    let begin = last - reach;
    let near = |t: f64| (t - begin).abs() <= SAME_BREAK * domain;
    let begin = curve
        .breaks
        .iter()
        .copied()
        .find(|&t| near(t))
        .unwrap_or(begin);
    let mut breaks = vec![first];
    let mut pieces = Vec::with_capacity(curve.pieces.len() + 1);
    for (piece, pair) in curve.pieces.iter().zip(curve.breaks.windows(2)) {
        if pair[0] < begin && begin < pair[1] {
            breaks.push(begin);
            pieces.push(*piece);
            pieces.push(piece.map(|c| shifted(&c, begin - pair[0])));
        } else {
            pieces.push(*piece);
        }
        breaks.push(pair[1]);
    }
    let reach = last - begin;
    for (piece, &t) in pieces.iter_mut().zip(&breaks) {
        if t < begin {
            continue;
        }
        let s = (t - begin) / reach;
        let added = [
            s * s * s,
            3.0 * s * s / reach,
            3.0 * s / (reach * reach),
            1.0 / (reach * reach * reach),
        ];
        for (coordinate, by) in piece.iter_mut().zip(offset) {
            for (c, a) in coordinate.iter_mut().zip(added) {
                *c += by * a;
            }
        }
    }
    Some(PiecewiseCubic { breaks, pieces })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(breaks: &[f64], height: f64) -> PiecewiseCubic<3> {
        let whole = [
            [0.0, 1.0, 0.0, 0.0],
            [2.0, 0.5, 0.0, 0.0],
            [height, 0.3, -0.2, 0.01],
        ];
        let pieces = breaks
            .windows(2)
            .map(|pair| whole.map(|c| shifted(&c, pair[0])))
            .collect();
        PiecewiseCubic::new(breaks.to_vec(), pieces).unwrap()
    }

    #[test]
    fn the_mean_is_half_way_everywhere() {
        let (a, b) = (
            wave(&[0.0, 1.0, 4.0], 1.0),
            wave(&[0.0, 2.5, 3.0, 4.0], 2.0),
        );
        let between = mean(&a, &b);
        between.validate().unwrap();
        assert_eq!(between.breaks, [0.0, 1.0, 2.5, 3.0, 4.0]);
        for k in 0..=400 {
            let t = 0.01 * f64::from(k);
            let (p, q, m) = (a.evaluate(t), b.evaluate(t), between.evaluate(t));
            for d in 0..3 {
                assert!((m[d] - (p[d] + q[d]) / 2.0).abs() < 1e-12, "{t}");
            }
        }
    }

    #[test]
    fn breaks_that_nearly_agree_are_one() {
        let (a, b) = (
            wave(&[0.0, 1.0, 4.0], 1.0),
            wave(&[0.0, 1.0 + 1e-12, 4.0], 1.0),
        );
        assert_eq!(mean(&a, &b).breaks, [0.0, 1.0, 4.0]);
    }

    #[test]
    fn ends_are_led_to_their_vertices_and_the_rest_stays() {
        let curve = wave(&[0.0, 1.0, 9.0], 1.0);
        let (start, end) = (curve.start(), curve.end());
        let to = (
            [start[0], start[1], start[2] + 0.02],
            [end[0], end[1], end[2] - 0.01],
        );
        let moved = bent(&curve, to.0, to.1);
        moved.validate().unwrap();
        for d in 0..3 {
            assert!((moved.start()[d] - to.0[d]).abs() < 1e-12);
            assert!((moved.end()[d] - to.1[d]).abs() < 1e-12);
        }
        // Reach of 2 at the start, of 1 at the end.
        for t in [2.0, 3.7, 8.0] {
            let (p, q) = (moved.evaluate(t), curve.evaluate(t));
            assert!((p[2] - q[2]).abs() < 1e-12, "{t}");
        }
        assert!((moved.evaluate(1.0)[2] - curve.evaluate(1.0)[2] - 0.02 / 8.0).abs() < 1e-12);
        // Curvature does not jump: knots stay single.
        let knots = moved.to_bspline(1e-9).knots().knots().len();
        assert_eq!(knots, 8 + moved.pieces.len() - 1);
        assert_eq!(bent(&curve, start, end), curve);
    }
}
