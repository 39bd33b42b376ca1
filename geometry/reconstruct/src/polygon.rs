//! Plane polygons given as their corners in order, closed by themselves.

/// Area in the square of the unit of the points; counter-clockwise is positive.
#[must_use]
pub fn signed_area(points: &[[f64; 2]]) -> f64 {
    let Some(&origin) = points.first() else {
        return 0.0;
    };
    let mut twice = 0.0;
    for pair in points.windows(2) {
        let (a, b) = (minus(pair[0], origin), minus(pair[1], origin));
        twice += cross(a, b);
    }
    twice / 2.0
}

/// Difference of two points.
#[must_use]
pub fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// Twice the area of the triangle that two vectors span; positive for a left turn.
#[must_use]
pub fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Scalar product.
#[must_use]
pub fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Length of a vector.
#[must_use]
pub fn norm(a: [f64; 2]) -> f64 {
    dot(a, a).sqrt()
}

/// Distance of a point from a segment.
#[must_use]
pub fn distance_to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (along, offset) = (minus(b, a), minus(p, a));
    let length2 = dot(along, along);
    let t = if length2 > 0.0 {
        (dot(offset, along) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    norm(minus(offset, [along[0] * t, along[1] * t]))
}

/// Least distance of two segments; 0 when they cross.
#[must_use]
pub fn distance_of_segments(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> f64 {
    let side = |p, q, r| cross(minus(q, p), minus(r, p));
    let crossing = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
    if crossing {
        return 0.0;
    }
    distance_to_segment(a, c, d)
        .min(distance_to_segment(b, c, d))
        .min(distance_to_segment(c, a, b))
        .min(distance_to_segment(d, a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_of_a_square_in_both_senses() {
        let square = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
        assert_eq!(signed_area(&square), 4.0);
        let back: Vec<[f64; 2]> = square.iter().rev().copied().collect();
        assert_eq!(signed_area(&back), -4.0);
        assert_eq!(signed_area(&[]), 0.0);
    }

    #[test]
    fn distances() {
        let (a, b) = ([0.0, 0.0], [4.0, 0.0]);
        assert_eq!(distance_to_segment([2.0, 3.0], a, b), 3.0);
        assert_eq!(distance_to_segment([7.0, 4.0], a, b), 5.0);
        assert_eq!(distance_of_segments(a, b, [1.0, -1.0], [1.0, 1.0]), 0.0);
        assert_eq!(distance_of_segments(a, b, [1.0, 1.0], [3.0, 2.0]), 1.0);
        assert_eq!(distance_of_segments(a, a, b, b), 4.0);
    }
}
