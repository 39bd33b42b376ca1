//! Knots inserted, and curves cut where they are (Piegl & Tiller 1997, section 5.2 and 5.3), by the
//! polar form of their pieces.

use super::polygon::Polygon;
use crate::knots::{KnotError, KnotVector};

/// Knots with more of them, in order.
///
/// # Errors
/// [`KnotError`] where one lies outside, or comes more often than the degree.
pub(super) fn with(knots: &KnotVector, more: &[f64]) -> Result<KnotVector, KnotError> {
    let mut all = knots.knots().to_vec();
    all.extend_from_slice(more);
    all.sort_by(f64::total_cmp);
    KnotVector::new(knots.degree(), all)
}

/// How often a knot comes.
pub(super) fn multiplicity(knots: &[f64], knot: f64) -> usize {
    let from = knots.partition_point(|&k| k < knot);
    knots[from..].iter().take_while(|&&k| k == knot).count()
}

/// The parts of a curve before and after a parameter inside its domain.
pub(super) fn halves(curve: &Polygon, t: f64) -> Option<(Polygon, Polygon)> {
    let (p, w) = (curve.degree, curve.width);
    let (first, last) = (curve.knots[p], curve.knots[curve.count()]);
    if !(t > first && t < last) {
        return None;
    }
    let missing = p - multiplicity(&curve.knots, t).min(p);
    let at = curve.knots.partition_point(|&k| k < t);
    let mut knots = curve.knots.clone();
    knots.splice(at..at, core::iter::repeat_n(t, missing));
    let whole = curve.over(knots);
    // `at` is now the first of p equal knots.
    let mut before = whole.knots[..at + p].to_vec();
    before.push(t);
    let mut after = vec![t];
    after.extend_from_slice(&whole.knots[at..]);
    let part = |knots: Vec<f64>, points: &[f64]| Polygon {
        degree: p,
        knots,
        width: w,
        points: points.to_vec(),
    };
    let shared = at - 1;
    Some((
        part(before, &whole.points[..(shared + 1) * w]),
        part(after, &whole.points[shared * w..]),
    ))
}

/// The polynomial pieces of a curve, as curves without inner knots.
pub(super) fn pieces(curve: &Polygon) -> Vec<Polygon> {
    let (p, w) = (curve.degree, curve.width);
    let mut breaks = curve.knots.clone();
    breaks.dedup();
    let mut knots = Vec::new();
    for (k, &t) in breaks.iter().enumerate() {
        let is_end = k == 0 || k + 1 == breaks.len();
        knots.extend(core::iter::repeat_n(t, if is_end { p + 1 } else { p }));
    }
    let whole = curve.over(knots);
    let piece = |(k, pair): (usize, &[f64])| Polygon {
        degree: p,
        knots: [vec![pair[0]; p + 1], vec![pair[1]; p + 1]].concat(),
        width: w,
        points: whole.points[k * p * w..(k * p + p + 1) * w].to_vec(),
    };
    breaks.windows(2).enumerate().map(piece).collect()
}
