//! Knots removed where that moves a curve by little (Piegl & Tiller 1997, algorithm A5.8).

use super::polygon::Polygon;
use super::refine::multiplicity;

/// What comes of a curve or surface of which a knot is removed once.
#[derive(Debug, Clone, PartialEq)]
pub struct Removal<T> {
    /// What is left.
    pub left: T,
    /// By how much no point of it moves farther, in the unit of the control points: the distance of
    /// two places that a control point would have to be in (their equations 5.28 to 5.30), times
    /// the function that carries it.
    pub moved: f64,
    /// Which function of the old knots carries that.
    pub function: usize,
}

/// Removes an inner knot once; `chunk` numbers of a point are a place, and the farthest moved counts.
/// `None` where there is no such knot inside.
pub(super) fn removed(curve: &Polygon, knot: f64, chunk: usize) -> Option<Removal<Polygon>> {
    let (p, w, knots) = (curve.degree, curve.width, &curve.knots);
    let (low, high) = (knots[p], knots[curve.count()]);
    let times = multiplicity(knots, knot);
    if times == 0 || !(knot > low && knot < high) {
        return None;
    }
    let last_of = knots.partition_point(|&k| k <= knot) - 1;
    let (first, last) = (last_of - p, last_of - times);
    let share = |i: usize| (knot - knots[i]) / (knots[i + p + 1] - knots[i]);
    // New points from both ends of those that change.
    let mut left = vec![curve.point(first - 1).to_vec()];
    let mut right = vec![curve.point(last + 1).to_vec()];
    let (mut i, mut j) = (first, last);
    while j > i {
        let (a, b) = (share(i), share(j));
        let (before, after) = (&left[left.len() - 1], &right[right.len() - 1]);
        let of_left = |(q, l): (&f64, &f64)| (q - (1.0 - a) * l) / a;
        let of_right = |(q, r): (&f64, &f64)| (q - b * r) / (1.0 - b);
        let next: Vec<f64> = curve.point(i).iter().zip(before).map(of_left).collect();
        let previous: Vec<f64> = curve.point(j).iter().zip(after).map(of_right).collect();
        left.push(next);
        right.push(previous);
        (i, j) = (i + 1, j - 1);
    }
    let (before, after) = (&left[left.len() - 1], &right[right.len() - 1]);
    let is_odd = i == j;
    // Of an even number of points the last two are one; of an odd number one goes.
    let off: Vec<f64> = if is_odd {
        let a = share(i);
        let between = before.iter().zip(after).map(|(b, f)| (1.0 - a) * b + a * f);
        curve
            .point(i)
            .iter()
            .zip(between)
            .map(|(q, m)| q - m)
            .collect()
    } else {
        before.iter().zip(after).map(|(b, f)| b - f).collect()
    };
    let length = |place: &[f64]| place.iter().map(|c| c * c).sum::<f64>().sqrt();
    let moved = off.chunks(chunk).map(length).fold(0.0, f64::max);
    let mut points = curve.points[..first * w].to_vec();
    left.iter().skip(1).for_each(|point| points.extend(point));
    if !is_odd {
        // The last two would have to be one: the left one stays, so that only the function beside
        // it carries what they are apart.
        right.pop();
    }
    right
        .iter()
        .skip(1)
        .rev()
        .for_each(|point| points.extend(point));
    points.extend_from_slice(&curve.points[(last + 1) * w..]);
    let mut rest = knots.clone();
    rest.remove(last_of);
    Some(Removal {
        left: Polygon {
            degree: p,
            knots: rest,
            width: w,
            points,
        },
        moved,
        function: i,
    })
}
