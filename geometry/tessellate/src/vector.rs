//! Points of the plane and of space.

pub(crate) type Point2 = [f64; 2];
pub(crate) type Point3 = [f64; 3];

pub(crate) fn minus(a: Point3, b: Point3) -> Point3 {
    core::array::from_fn(|d| a[d] - b[d])
}

pub(crate) fn dot(a: Point3, b: Point3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point3, b: Point3) -> Point3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn norm(a: Point3) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn distance(a: Point3, b: Point3) -> f64 {
    norm(minus(a, b))
}

/// Between two points, at a share of the way.
pub(crate) fn between(a: Point3, b: Point3, share: f64) -> Point3 {
    core::array::from_fn(|d| a[d] + (b[d] - a[d]) * share)
}

/// Twice the area of a triangle in the x-y plane; positive where it turns counter-clockwise.
pub(crate) fn turn(a: Point2, b: Point2, c: Point2) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Distance of a point from the line through two others; from the first, where these are one.
pub(crate) fn off_line(p: Point3, a: Point3, b: Point3) -> f64 {
    let (along, from) = (minus(b, a), minus(p, a));
    let length2 = dot(along, along);
    if length2 <= 0.0 {
        return norm(from);
    }
    let share = (dot(from, along) / length2).clamp(0.0, 1.0);
    distance(p, between(a, b, share))
}

/// The least angle of a triangle in space, radians, and the corner that has it.
pub(crate) fn least_angle(p: [Point3; 3]) -> (f64, usize) {
    let mut least = (f64::INFINITY, 0);
    for k in 0..3 {
        let (a, b) = (minus(p[(k + 1) % 3], p[k]), minus(p[(k + 2) % 3], p[k]));
        let angle = libm::atan2(norm(cross(a, b)), dot(a, b));
        if angle < least.0 {
            least = (angle, k);
        }
    }
    least
}
