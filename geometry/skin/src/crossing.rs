//! Polygons that cross themselves.

use crate::space::{area_vector, dot, minus, norm, plus, times};

/// A place where a closed polygon that is nearly plane crosses itself, if it does: in its own
/// mean plane, two sides that do not follow each other pass through each other.
pub(crate) fn of_polygon(points: &[[f64; 3]]) -> Option<[f64; 3]> {
    let [first, second] = directions(points)?;
    let flat: Vec<[f64; 2]> = points
        .iter()
        .map(|p| [dot(*p, first), dot(*p, second)])
        .collect();
    let n = flat.len();
    // From left to right, so that only sides that overlap along x are held against each other.
    let extent = |k: usize| {
        let (a, b) = (flat[k], flat[(k + 1) % n]);
        (a[0].min(b[0]), a[0].max(b[0]))
    };
    let mut sides: Vec<usize> = (0..n).collect();
    sides.sort_by(|a, b| extent(*a).0.total_cmp(&extent(*b).0));
    for (place, &a) in sides.iter().enumerate() {
        let reach = extent(a).1;
        let near = sides[place + 1..]
            .iter()
            .take_while(|b| extent(**b).0 <= reach);
        for &b in near {
            let apart = (a + n - b) % n;
            if apart == 1 || apart == n - 1 || apart == 0 {
                continue;
            }
            let side = |k: usize| [flat[k], flat[(k + 1) % n]];
            if let Some(share) = meeting(side(a), side(b)) {
                let (from, to) = (points[a], points[(a + 1) % n]);
                return Some(plus(from, times(minus(to, from), share)));
            }
        }
    }
    None
}

/// Two unit vectors across the normal of a closed polygon.
fn directions(points: &[[f64; 3]]) -> Option<[[f64; 3]; 2]> {
    let normal = area_vector(points);
    let length = norm(normal);
    if length.is_nan() || length <= 0.0 {
        return None;
    }
    let normal = times(normal, 1.0 / length);
    // The axis that is the farthest from it.
    let least = (0..3).min_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs()))?;
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let first = minus(axis, times(normal, dot(axis, normal)));
    let first = times(first, 1.0 / norm(first));
    Some([first, crate::space::cross(normal, first)])
}

/// How far along the first side it passes through the second, if it does.
fn meeting([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> Option<f64> {
    let across = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let (ca, cb) = (across(c, d, a), across(c, d, b));
    let (ac, ad) = (across(a, b, c), across(a, b, d));
    let is_through = ca * cb < 0.0 && ac * ad < 0.0;
    is_through.then(|| ca / (ca - cb))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_of_eight_crosses_itself_and_a_circle_does_not() {
        let at = |k: usize, count: usize| core::f64::consts::TAU * k as f64 / count as f64;
        let circle: Vec<[f64; 3]> = (0..50)
            .map(|k| [5.0, libm::cos(at(k, 50)), libm::sin(at(k, 50))])
            .collect();
        assert_eq!(of_polygon(&circle), None);
        // One half larger than the other, so that there is an area.
        let eight: Vec<[f64; 3]> = (0..50)
            .map(|k| {
                let t = at(k, 50) + 0.05;
                [libm::sin(t) * (1.5 + libm::sin(t)), libm::sin(2.0 * t), 2.0]
            })
            .collect();
        let [x, y, z] = of_polygon(&eight).unwrap();
        assert!(x.abs() < 0.1 && y.abs() < 0.2 && z == 2.0, "{x} {y}");
    }
}
