//! Vectors in space.

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|d| a[d] - b[d])
}

pub(crate) fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|d| a[d] + b[d])
}

pub(crate) fn times(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|c| c * by)
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| a * b).sum()
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(minus(a, b))
}

/// The mean of places; the origin without any.
pub(crate) fn middle(places: &[[f64; 3]]) -> [f64; 3] {
    let sum = places.iter().fold([0.0; 3], |sum, place| plus(sum, *place));
    times(sum, 1.0 / places.len().max(1) as f64)
}

/// The diagonal of the box around places.
pub(crate) fn farthest_apart(places: &[[f64; 3]]) -> f64 {
    let side = |d: usize| {
        let of = places.iter().map(|place| place[d]);
        let (low, high) = (
            of.clone().fold(f64::INFINITY, f64::min),
            of.fold(f64::NEG_INFINITY, f64::max),
        );
        if high > low { high - low } else { 0.0 }
    };
    norm([side(0), side(1), side(2)])
}

/// Twice the area of a closed polygon, along its normal.
pub(crate) fn area_vector(places: &[[f64; 3]]) -> [f64; 3] {
    let around = middle(places);
    let next = places.iter().cycle().skip(1);
    places.iter().zip(next).fold([0.0; 3], |sum, (a, b)| {
        plus(sum, cross(minus(*a, around), minus(*b, around)))
    })
}

/// Lengths along a chain, from 0 on; of a closed one with that of its last side at the end.
pub(crate) fn lengths(places: &[[f64; 3]], is_closed: bool) -> Vec<f64> {
    let mut lengths = vec![0.0];
    let mut sum = 0.0;
    let closing = is_closed.then(|| places.first()).flatten();
    let next = places.iter().skip(1).chain(closing);
    for (a, b) in places.iter().zip(next) {
        sum += distance(*a, *b);
        lengths.push(sum);
    }
    lengths
}

/// The place so far along a chain with these lengths.
pub(crate) fn along(places: &[[f64; 3]], lengths: &[f64], at: f64) -> [f64; 3] {
    let after = lengths.partition_point(|length| *length <= at);
    let k = after.saturating_sub(1).min(lengths.len() - 2);
    let share = (at - lengths[k]) / (lengths[k + 1] - lengths[k]);
    let (a, b) = (places[k], places[(k + 1) % places.len()]);
    plus(a, times(minus(b, a), share))
}

/// The greatest of values; not a number if one of them is none.
pub(crate) fn greatest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, value| {
        if most.is_nan() || value <= most {
            most
        } else {
            value
        }
    })
}

/// Whether a deviation is less than another one; any is less than what is not a number.
pub(crate) fn is_nearer(own: f64, other: f64) -> bool {
    own < other || other.is_nan()
}
