//! Floors that are no planes, as B-splines over the plan.

use std::sync::Arc;

use nurbs::{BSplineSurface, KnotVector, Observation, TensorSpline};

use crate::candidate::Candidate;
use crate::outline::Shape;
use crate::sight::Sight;

/// Sample distances to a span of the knots, and most spans.
const PITCHES: f64 = 8.0;
const MOST_SPANS: f64 = 10.0;
/// How much the control net resists bending, see [`TensorSpline::fit_scattered`].
const BENDING: f64 = 1e-4;
/// The surface reaches beyond the outline by this share of its size.
const BEYOND: f64 = 0.15;

/// The floor of a candidate, least squares over its samples.
pub(crate) fn free_form(
    sight: &Sight<'_>,
    candidate: &Candidate,
) -> Option<Arc<BSplineSurface<1>>> {
    let floors: Vec<u16> = candidate
        .levels
        .iter()
        .filter_map(|level| sight.levels.levels[usize::from(*level)].regions.first())
        .copied()
        .collect();
    let observations: Vec<Observation> = sight
        .samples(&|region| floors.contains(&region))
        .into_iter()
        .map(|[u, v, value]| Observation {
            u,
            v,
            value,
            weight: 1.0,
        })
        .collect();
    let (low, high) = extent(&candidate.outline.shape);
    let knots = |axis: usize| {
        let size = high[axis] - low[axis];
        let spans = (size / (PITCHES * sight.field.pitch_mm())).clamp(1.0, MOST_SPANS) as usize;
        let beyond = BEYOND * size;
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

/// The box around an outline along u and v.
fn extent(shape: &Shape) -> ([f64; 2], [f64; 2]) {
    match shape {
        Shape::Circle(circle) => {
            let [u, v] = circle.centre_mm;
            let r = circle.radius_mm;
            ([u - r, v - r], [u + r, v + r])
        }
        Shape::Rectangle(own) => {
            let mut low = [f64::INFINITY; 2];
            let mut high = [f64::NEG_INFINITY; 2];
            for a in own.first_mm {
                for b in own.second_mm {
                    let place = own.place([a, b]);
                    for axis in 0..2 {
                        low[axis] = low[axis].min(place[axis]);
                        high[axis] = high[axis].max(place[axis]);
                    }
                }
            }
            (low, high)
        }
    }
}
