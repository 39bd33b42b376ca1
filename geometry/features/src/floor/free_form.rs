//! A floor as a B-spline over the plan.

use std::sync::Arc;

use nurbs::{BSplineSurface, KnotVector, Observation, TensorSpline};

use super::samples;
use crate::candidate::Candidate;
use crate::rebuild::BEYOND_MM;
use crate::sight::Sight;

/// Sample distances to a span of the knots, and most spans.
const PITCHES: f64 = 8.0;
const MOST_SPANS: f64 = 10.0;
/// How much the control net resists bending, see [`TensorSpline::fit_scattered`].
const BENDING: f64 = 1e-4;
/// The surface reaches beyond the outline by this share of its size, and by no less than this much more
/// than what runs out is cut beyond its end, millimetres.
const BEYOND: f64 = 0.15;
const MORE_MM: f64 = 0.5;

/// The floor of a candidate, least squares over its samples.
pub(crate) fn free_form(
    sight: &Sight<'_>,
    candidate: &Candidate,
) -> Option<Arc<BSplineSurface<1>>> {
    let observations: Vec<Observation> = samples(sight, candidate)
        .into_iter()
        .map(|[u, v, value]| Observation {
            u,
            v,
            value,
            weight: 1.0,
        })
        .collect();
    let (low, high) = candidate.outline.shape.extent();
    let knots = |axis: usize| {
        let size = high[axis] - low[axis];
        let spans = (size / (PITCHES * sight.field.pitch_mm())).clamp(1.0, MOST_SPANS) as usize;
        let beyond = (BEYOND * size).max(BEYOND_MM + MORE_MM);
        KnotVector::uniform(3, spans, low[axis] - beyond, high[axis] + beyond).ok()
    };
    let (u_knots, v_knots) = (knots(0)?, knots(1)?);
    let inside: Vec<Observation> = observations
        .into_iter()
        .filter(|o| {
            let within = |value: f64, (first, last): (f64, f64)| first <= value && value <= last;
            within(o.u, u_knots.domain()) && within(o.v, v_knots.domain())
        })
        .collect();
    let fitted = TensorSpline::fit_scattered(u_knots, v_knots, &inside, BENDING).ok()?;
    let points = fitted.coefficients().iter().map(|c| [*c]).collect();
    BSplineSurface::new(fitted.u_knots().clone(), fitted.v_knots().clone(), points)
        .ok()
        .map(Arc::new)
}
