//! Knots removed from curves that have them in common, within a tolerance at every data point.

use nurbs::BSplineCurve;
use range_image::{Cancelled, Monitor};

/// A curve, and a bound of what its data points are off it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bounded {
    pub(super) curve: BSplineCurve<3>,
    /// Parameters of the data points.
    pub(super) at: Vec<f64>,
    /// Millimetres.
    pub(super) off_mm: Vec<f64>,
}

/// A common knot and by how much its removal moves the curve that it moves most; endless once it
/// may not be removed.
struct Candidate {
    knot: f64,
    moves_mm: f64,
}

/// Removes common knots one at a time, each time the one that moves all curves least, as long as the
/// bounds of all data points stay within the tolerance (Piegl & Tiller 1997, algorithm A9.9, for
/// several curves at once).
pub(super) fn thinned(
    all: &mut [Bounded],
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let Some(knots) = all.first().map(|own| own.curve.knots().clone()) else {
        return Ok(());
    };
    let degree = knots.degree();
    let inner = &knots.knots()[degree + 1..knots.control_count()];
    let of = |knot: f64, all: &[Bounded]| Candidate {
        knot,
        moves_mm: moves(all, knot),
    };
    let mut candidates: Vec<Candidate> = inner.iter().map(|knot| of(*knot, all)).collect();
    loop {
        let least = (0..candidates.len())
            .min_by(|a, b| candidates[*a].moves_mm.total_cmp(&candidates[*b].moves_mm));
        let Some(k) = least.filter(|k| candidates[*k].moves_mm.is_finite()) else {
            return Ok(());
        };
        monitor.check()?;
        if !remove(all, candidates[k].knot, tolerance_mm) {
            candidates[k].moves_mm = f64::INFINITY;
            continue;
        }
        candidates.remove(k);
        // Those whose functions reach it are other ones now; what may not be removed may be.
        let near = k.saturating_sub(degree + 1)..(k + degree + 1).min(candidates.len());
        for candidate in &mut candidates[near] {
            candidate.moves_mm = moves(all, candidate.knot);
        }
    }
}

/// By how much the removal of a knot moves the curve that it moves most.
fn moves(all: &[Bounded], knot: f64) -> f64 {
    let of = |own: &Bounded| {
        own.curve
            .removal_bound(knot)
            .map_or(f64::INFINITY, |(by, _)| by)
    };
    all.iter().map(of).fold(0.0, f64::max)
}

/// Removes a knot from all curves if the bounds of all data points stay within the tolerance; says
/// whether it did.
fn remove(all: &mut [Bounded], knot: f64, tolerance_mm: f64) -> bool {
    let mut bounds = Vec::with_capacity(all.len());
    for own in all.iter() {
        let Some((by_mm, function)) = own.curve.removal_bound(knot) else {
            return false;
        };
        let knots = own.curve.knots();
        let grown = |(t, off_mm): (&f64, &f64)| {
            let basis = knots.basis(*t);
            let local = function
                .checked_sub(basis.first)
                .filter(|k| *k <= knots.degree());
            off_mm + by_mm * local.map_or(0.0, |k| basis.values[k])
        };
        let grown: Vec<f64> = own.at.iter().zip(&own.off_mm).map(grown).collect();
        if grown.iter().any(|off_mm| *off_mm > tolerance_mm) {
            return false;
        }
        bounds.push(grown);
    }
    for (own, off_mm) in all.iter_mut().zip(bounds) {
        if let Some(removal) = own.curve.without_knot(knot) {
            own.curve = removal.left;
            own.off_mm = off_mm;
        }
    }
    true
}
