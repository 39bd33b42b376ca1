//! The triangles of a polygon in space that bend least.

use glam::DVec3;

/// What triangles between two vertices of the polygon come to at best.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cost {
    /// Largest angle between neighbours, as one less its cosine.
    bend: f64,
    area: f64,
}

impl Cost {
    const NEVER: Self = Self {
        bend: f64::INFINITY,
        area: f64::INFINITY,
    };

    fn is_less(self, other: Self) -> bool {
        (self.bend, self.area) < (other.bend, other.area)
    }
}

/// Twice the area of a triangle that has none, of its longest side's square.
const SLIVER: f64 = 1e-3;

/// Triangles of a polygon as places in its chain, such that the largest angle between neighbours, those
/// outside included, is the least, and of these the area (Barequet & Sharir 1995; Liepa 2003).
///
/// `is_forbidden` says which pairs of places cannot have an edge. `None` where there are no triangles.
pub(super) fn cover(
    places: &[DVec3],
    outside: &[Option<DVec3>],
    is_forbidden: impl Fn(usize, usize) -> bool,
) -> Option<Vec<[usize; 3]>> {
    let count = places.len();
    if count < 3 {
        return None;
    }
    let index = |i: usize, j: usize| i * count + j;
    let mut best = vec![Cost::NEVER; count * count];
    let mut middle = vec![usize::MAX; count * count];
    // Normals of the best triangle on each pair.
    let mut normals = vec![DVec3::ZERO; count * count];
    for i in 0..count - 1 {
        best[index(i, i + 1)] = Cost {
            bend: 0.0,
            area: 0.0,
        };
        normals[index(i, i + 1)] = outside[i].unwrap_or(DVec3::ZERO);
    }
    let bend = |a: DVec3, b: DVec3| {
        if a == DVec3::ZERO || b == DVec3::ZERO {
            0.0
        } else {
            1.0 - a.dot(b)
        }
    };
    for span in 2..count {
        for i in 0..count - span {
            let j = i + span;
            let is_whole = span == count - 1;
            if !is_whole && is_forbidden(i, j) {
                continue;
            }
            let mut own = (Cost::NEVER, usize::MAX, DVec3::ZERO);
            for k in i + 1..j {
                let (left, right) = (best[index(i, k)], best[index(k, j)]);
                if left.bend.is_infinite() || right.bend.is_infinite() {
                    continue;
                }
                let doubled = (places[k] - places[i]).cross(places[j] - places[i]);
                let area = doubled.length();
                let normal = doubled.normalize_or_zero();
                let longest = places[i]
                    .distance_squared(places[j])
                    .max(places[i].distance_squared(places[k]))
                    .max(places[k].distance_squared(places[j]));
                // What has no area bends as far as anything can.
                let flat = if area <= SLIVER * longest { 2.0 } else { 0.0 };
                let mut most = left.bend.max(right.bend).max(flat);
                most = most.max(bend(normals[index(i, k)], normal));
                most = most.max(bend(normals[index(k, j)], normal));
                if is_whole {
                    most = most.max(bend(outside[j].unwrap_or(DVec3::ZERO), normal));
                }
                let cost = Cost {
                    bend: most,
                    area: left.area + right.area + area,
                };
                if cost.is_less(own.0) {
                    own = (cost, k, normal);
                }
            }
            best[index(i, j)] = own.0;
            middle[index(i, j)] = own.1;
            normals[index(i, j)] = own.2;
        }
    }
    if best[index(0, count - 1)].bend.is_infinite() {
        return None;
    }
    let mut triangles = Vec::new();
    let mut left = vec![(0, count - 1)];
    while let Some((i, j)) = left.pop() {
        if j - i < 2 {
            continue;
        }
        let k = middle[index(i, j)];
        triangles.push([i, k, j]);
        left.extend([(i, k), (k, j)]);
    }
    Some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_and_a_notch() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let places = square.map(|[x, y]| DVec3::new(x, y, 0.0));
        let outside = [Some(DVec3::Z); 4];
        assert_eq!(cover(&places, &outside, |_, _| false).unwrap().len(), 2);
        let one = cover(&places, &outside, |i, j| (i, j) == (0, 2)).unwrap();
        assert!(
            one.iter().all(|t| !(t.contains(&0) && t.contains(&2))),
            "{one:?}"
        );
        assert!(cover(&places, &outside, |_, _| true).is_none());
        // An L: no triangle lies outside of it.
        let corner = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        let places = corner.map(|[x, y]| DVec3::new(x, y, 0.0));
        let own = cover(&places, &[Some(DVec3::Z); 6], |_, _| false).unwrap();
        let area: f64 = own
            .iter()
            .map(|&[a, b, c]| (places[b] - places[a]).cross(places[c] - places[a]).z / 2.0)
            .sum();
        assert!((area - 5.0).abs() < 1e-12);
        assert_eq!(own.len(), 4);
    }
}
