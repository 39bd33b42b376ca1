//! The degree raised by one (Piegl & Tiller 1997, section 5.5).

use super::polygon::Polygon;
use super::refine::multiplicity;

/// The same curve, one degree higher: each knot comes once more. Its polar form is the mean of the
/// old one over all arguments but one.
pub(super) fn elevated(curve: &Polygon) -> Polygon {
    let degree = curve.degree + 1;
    let mut breaks = curve.knots.clone();
    breaks.dedup();
    let knots: Vec<f64> = breaks
        .iter()
        .flat_map(|&t| core::iter::repeat_n(t, multiplicity(&curve.knots, t) + 1))
        .collect();
    let count = knots.len() - degree - 1;
    let mut points = Vec::with_capacity(count * curve.width);
    for i in 0..count {
        let span = curve.span_of(&knots, i, degree);
        let arguments = &knots[i + 1..=i + degree];
        let mut sum = vec![0.0; curve.width];
        for left_out in 0..degree {
            let mut rest = arguments.to_vec();
            rest.remove(left_out);
            let polar = curve.polar(span, &rest);
            sum.iter_mut().zip(polar).for_each(|(s, p)| *s += p);
        }
        points.extend(sum.into_iter().map(|s| s / degree as f64));
    }
    Polygon {
        degree,
        knots,
        width: curve.width,
        points,
    }
}
