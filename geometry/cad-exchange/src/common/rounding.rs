//! Slight kinks of a curve, rounded within the file's resolution.
//!
//! A border that crosses the joints of patches has a slight kink at each. Readers split a
//! curve where its tangent jumps (OpenCASCADE does), and one edge with two vertices
//! becomes many. A kink is therefore replaced by a short cubic that leaves one piece and
//! joins the next along their tangents. True corners stay.

use nurbs::PiecewiseCubic;

/// Jumps of the tangent's x and y up to this part of them are kinks to be rounded, larger
/// ones are corners of the border to be kept. A jump of z is always the surface's kink.
const CORNER: f64 = 0.5;

/// The largest part of a piece that the rounding of one of its ends may take.
const LARGEST_PART: f64 = 0.25;

/// The curve with tangents that do not jump, except at corners; nowhere further from the
/// original than `tolerance_mm`. Jumps below `smooth_mm` (times the narrower piece's
/// width) are left as they are.
pub(crate) fn without_kinks<const D: usize>(
    curve: &PiecewiseCubic<D>,
    smooth_mm: f64,
    tolerance_mm: f64,
) -> PiecewiseCubic<D> {
    let count = curve.pieces.len();
    let width = |k: usize| curve.breaks[k + 1] - curve.breaks[k];
    // Half the width of the rounding at each break; none at the ends.
    let half_width = |k: usize| {
        let (before, after) = (
            curve.piece_value(k - 1, width(k - 1), 1),
            curve.piece_value(k, 0.0, 1),
        );
        let jumps: [f64; D] = core::array::from_fn(|d| after[d] - before[d]);
        let jump = length(&jumps);
        let narrow = width(k - 1).min(width(k));
        if jump * narrow <= smooth_mm
            || plan_length(&jumps) > CORNER * plan_length(&before).max(plan_length(&after))
        {
            return 0.0;
        }
        // Half way, the cubic is a quarter of the reach times the jump off the kink.
        (4.0 * tolerance_mm / jump).min(LARGEST_PART * narrow)
    };
    let reach: Vec<f64> = (0..=count)
        .map(|k| {
            if k == 0 || k == count {
                0.0
            } else {
                half_width(k)
            }
        })
        .collect();
    if reach.iter().all(|&reach| reach == 0.0) {
        return curve.clone();
    }
    let mut breaks = vec![curve.breaks[0]];
    let mut pieces = Vec::with_capacity(2 * count);
    for k in 0..count {
        let (from, to) = (reach[k], width(k) - reach[k + 1]);
        pieces.push(curve.pieces[k].map(|c| shifted(&c, from)));
        if reach[k + 1] == 0.0 {
            breaks.push(curve.breaks[k + 1]);
            continue;
        }
        let here = curve.breaks[k + 1];
        let (start, end) = (here - reach[k + 1], here + reach[k + 1]);
        breaks.extend([start, end]);
        let (p, dp) = (curve.piece_value(k, to, 0), curve.piece_value(k, to, 1));
        let (q, dq) = (
            curve.piece_value(k + 1, reach[k + 1], 0),
            curve.piece_value(k + 1, reach[k + 1], 1),
        );
        pieces.push(core::array::from_fn(|d| {
            hermite(p[d], dp[d], q[d], dq[d], end - start)
        }));
    }
    PiecewiseCubic { breaks, pieces }
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Length without z.
fn plan_length<const D: usize>(vector: &[f64; D]) -> f64 {
    length(vector.get(..2).unwrap_or(vector))
}

/// The same cubic, its parameter counted from `s`.
pub(crate) fn shifted(c: &[f64; 4], s: f64) -> [f64; 4] {
    if s == 0.0 {
        return *c;
    }
    [
        c[0] + s * (c[1] + s * (c[2] + s * c[3])),
        c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]),
        c[2] + s * 3.0 * c[3],
        c[3],
    ]
}

/// The cubic over `0..=width` with these values and slopes at its ends.
fn hermite(p: f64, dp: f64, q: f64, dq: f64, width: f64) -> [f64; 4] {
    let rise = (q - p) / width;
    [
        p,
        dp,
        (3.0 * rise - 2.0 * dp - dq) / width,
        (dp + dq - 2.0 * rise) / (width * width),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three pieces: a kink of 0.1 at 1, a corner of 1 at 3.
    fn bent() -> PiecewiseCubic<2> {
        PiecewiseCubic::new(
            vec![0.0, 1.0, 3.0, 4.0],
            vec![
                [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.3, -0.1]],
                [[1.0, 1.0, 0.0, 0.0], [0.2, 0.4, 0.0, 0.0]],
                [[3.0, 1.0, 0.0, 0.0], [1.0, -0.6, 0.0, 0.0]],
            ],
        )
        .unwrap()
    }

    #[test]
    fn kinks_go_and_corners_stay() {
        let curve = bent();
        let tolerance = 1e-4;
        let round = without_kinks(&curve, 1e-9, tolerance);
        round.validate().unwrap();
        assert_eq!(round.pieces.len(), 4);
        let mut corners = 0;
        for k in 1..round.pieces.len() {
            let width = round.breaks[k] - round.breaks[k - 1];
            let (a, b) = (
                round.piece_value(k - 1, width, 0),
                round.piece_value(k, 0.0, 0),
            );
            assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
            let (a, b) = (
                round.piece_value(k - 1, width, 1),
                round.piece_value(k, 0.0, 1),
            );
            let jump = (a[1] - b[1]).abs();
            if jump > 1e-9 {
                assert!((jump - 1.0).abs() < 1e-12 && round.breaks[k] == 3.0);
                corners += 1;
            }
        }
        assert_eq!(corners, 1);
        let mut worst = 0.0_f64;
        for step in 0..=400_000 {
            let t = 1e-5 * f64::from(step);
            let (p, q) = (round.evaluate(t), curve.evaluate(t));
            worst = worst.max((p[0] - q[0]).abs().max((p[1] - q[1]).abs()));
        }
        assert!((0.5 * tolerance..=tolerance).contains(&worst), "{worst:e}");
        assert_eq!((round.start(), round.end()), (curve.start(), curve.end()));
    }

    #[test]
    fn a_straight_border_over_a_ridge_is_rounded_however_steep() {
        let slope = |z0: f64, slope: f64| [[z0, 1.0, 0.0, 0.0], [0.0; 4], [0.0, slope, 0.0, 0.0]];
        let mut pieces = vec![slope(0.0, 3.0), slope(1.0, -2.0)];
        pieces[1][2][0] = 3.0;
        let curve = PiecewiseCubic::new(vec![0.0, 1.0, 2.0], pieces).unwrap();
        let round = without_kinks(&curve, 1e-9, 1e-4);
        assert_eq!(round.pieces.len(), 3);
        let top = round.evaluate(1.0)[2];
        assert!((top - (3.0 - 1e-4)).abs() < 1e-9, "{top}");
        // The same turn in the plane is a corner.
        let flat = curve.pieces.iter().map(|[x, _, z]| [*x, *z]).collect();
        let flat = PiecewiseCubic::new(curve.breaks.clone(), flat).unwrap();
        assert_eq!(without_kinks(&flat, 1e-9, 1e-4), flat);
    }

    #[test]
    fn a_smooth_curve_is_left_alone() {
        let mut curve = bent();
        curve.pieces[1][1][1] = 0.3;
        curve.pieces[2] = [[3.0, 1.0, 0.0, 0.0], [0.8, 0.3, 0.0, 0.0]];
        assert_eq!(without_kinks(&curve, 1e-9, 1e-4), curve);
    }
}
