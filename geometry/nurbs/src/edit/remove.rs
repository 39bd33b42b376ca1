//! Knots removed where that moves a curve by little (Piegl & Tiller 1997, algorithm A5.8).

use super::polygon::Polygon;
use super::refine::multiplicity;
use crate::knots::KnotVector;

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

/// Control points over clamped knots, to be looked at.
pub(super) struct View<'a> {
    pub(super) knots: &'a KnotVector,
    /// Numbers in a point.
    pub(super) width: usize,
    /// Point by point.
    pub(super) points: &'a [f64],
}

/// What takes the place of the points that change when a knot is removed.
struct Joint {
    /// Index of the last of the knots that are equal to it.
    last_of: usize,
    /// The points that change, first and last.
    changed: (usize, usize),
    /// New points from both ends of these, from the unchanged neighbour on.
    left: Vec<Vec<f64>>,
    right: Vec<Vec<f64>>,
    /// By how much what comes from both ends differs, and which function carries that.
    moved: f64,
    function: usize,
}

/// By how much a knot's removal moves a curve, and which function carries that; nothing is copied
/// but the points around it.
pub(super) fn bound(curve: &View<'_>, knot: f64, chunk: usize) -> Option<(f64, usize)> {
    joint(curve, knot, chunk).map(|joint| (joint.moved, joint.function))
}

fn joint(curve: &View<'_>, knot: f64, chunk: usize) -> Option<Joint> {
    let (p, w, knots) = (curve.knots.degree(), curve.width, curve.knots.knots());
    let (low, high) = curve.knots.domain();
    let times = multiplicity(knots, knot);
    if times == 0 || !(knot > low && knot < high) {
        return None;
    }
    let point = |i: usize| &curve.points[i * w..(i + 1) * w];
    let last_of = knots.partition_point(|&k| k <= knot) - 1;
    let (first, last) = (last_of - p, last_of - times);
    let share = |i: usize| (knot - knots[i]) / (knots[i + p + 1] - knots[i]);
    let mut left = vec![point(first - 1).to_vec()];
    let mut right = vec![point(last + 1).to_vec()];
    let (mut i, mut j) = (first, last);
    while j > i {
        let (a, b) = (share(i), share(j));
        let (before, after) = (&left[left.len() - 1], &right[right.len() - 1]);
        let of_left = |(q, l): (&f64, &f64)| (q - (1.0 - a) * l) / a;
        let of_right = |(q, r): (&f64, &f64)| (q - b * r) / (1.0 - b);
        let next: Vec<f64> = point(i).iter().zip(before).map(of_left).collect();
        let previous: Vec<f64> = point(j).iter().zip(after).map(of_right).collect();
        left.push(next);
        right.push(previous);
        (i, j) = (i + 1, j - 1);
    }
    let (before, after) = (&left[left.len() - 1], &right[right.len() - 1]);
    // Of an even number of points the last two are one; of an odd number one goes.
    let off: Vec<f64> = if i == j {
        let a = share(i);
        let between = before.iter().zip(after).map(|(b, f)| (1.0 - a) * b + a * f);
        point(i).iter().zip(between).map(|(q, m)| q - m).collect()
    } else {
        before.iter().zip(after).map(|(b, f)| b - f).collect()
    };
    if i != j {
        // The left one stays, so that only the function beside it carries what they are apart.
        right.pop();
    }
    let length = |place: &[f64]| place.iter().map(|c| c * c).sum::<f64>().sqrt();
    Some(Joint {
        last_of,
        changed: (first, last),
        left,
        right,
        moved: off.chunks(chunk).map(length).fold(0.0, f64::max),
        function: i,
    })
}

/// Removes an inner knot once; `chunk` numbers of a point are a place, and the farthest moved counts.
/// `None` where there is no such knot inside.
pub(super) fn removed(curve: &View<'_>, knot: f64, chunk: usize) -> Option<Removal<Polygon>> {
    let joint = joint(curve, knot, chunk)?;
    let (w, (first, last)) = (curve.width, joint.changed);
    let mut points = curve.points[..first * w].to_vec();
    joint
        .left
        .iter()
        .skip(1)
        .for_each(|point| points.extend(point));
    joint
        .right
        .iter()
        .skip(1)
        .rev()
        .for_each(|point| points.extend(point));
    points.extend_from_slice(&curve.points[(last + 1) * w..]);
    let mut knots = curve.knots.knots().to_vec();
    knots.remove(joint.last_of);
    Some(Removal {
        left: Polygon {
            degree: curve.knots.degree(),
            knots,
            width: w,
            points,
        },
        moved: joint.moved,
        function: joint.function,
    })
}
