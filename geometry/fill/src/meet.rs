//! Whether triangles run through each other, told by exact signs.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;
use robust::{Coord, Coord3D, orient2d, orient3d};

type Triangle = [DVec3; 3];

fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let own = |p: DVec3| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    orient3d(own(a), own(b), own(c), own(d))
}

/// Whether two triangles have more in common than corners and sides that both have.
pub(crate) fn meet(a: &Triangle, b: &Triangle) -> bool {
    let shared = |own: &DVec3, other: &Triangle| other.contains(own);
    let a_own: Vec<usize> = (0..3).filter(|&k| !shared(&a[k], b)).collect();
    let b_own: Vec<usize> = (0..3).filter(|&k| !shared(&b[k], a)).collect();
    match (a_own.len(), b_own.len()) {
        (0, _) | (_, 0) => true,
        (1, 1) => {
            let (p, q) = (a[a_own[0]], b[b_own[0]]);
            let (e, f) = (a[(a_own[0] + 1) % 3], a[(a_own[0] + 2) % 3]);
            // Flat on each other only where both are on one side of the edge in one plane.
            side(e, f, p, q) == 0.0 && (f - e).cross(p - e).dot((f - e).cross(q - e)) > 0.0
        }
        (2, 2) => crosses(a[a_own[0]], a[a_own[1]], b) || crosses(b[b_own[0]], b[b_own[1]], a),
        _ => (0..3).any(|k| {
            let next = (k + 1) % 3;
            crosses(a[k], a[next], b) || crosses(b[k], b[next], a)
        }),
    }
}

/// Whether a segment meets a triangle.
fn crosses(p: DVec3, q: DVec3, &[a, b, c]: &Triangle) -> bool {
    let (from, to) = (side(a, b, c, p), side(a, b, c, q));
    if from == 0.0 && to == 0.0 {
        return crosses_flat(p, q, [a, b, c]);
    }
    if (from > 0.0 && to > 0.0) || (from < 0.0 && to < 0.0) {
        return false;
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    around.iter().all(|s| *s >= 0.0) || around.iter().all(|s| *s <= 0.0)
}

/// The same in the triangle's plane.
fn crosses_flat(p: DVec3, q: DVec3, corners: Triangle) -> bool {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).abs();
    let flat = |v: DVec3| -> Coord<f64> {
        if normal.x >= normal.y && normal.x >= normal.z {
            Coord { x: v.y, y: v.z }
        } else if normal.y >= normal.z {
            Coord { x: v.z, y: v.x }
        } else {
            Coord { x: v.x, y: v.y }
        }
    };
    let ([a, b, c], p, q) = (corners.map(flat), flat(p), flat(q));
    let is_in = |v| {
        let own = [orient2d(a, b, v), orient2d(b, c, v), orient2d(c, a, v)];
        own.iter().all(|s| *s >= 0.0) || own.iter().all(|s| *s <= 0.0)
    };
    let cuts = |u, v| {
        let (own, other) = (
            orient2d(p, q, u) * orient2d(p, q, v),
            orient2d(u, v, p) * orient2d(u, v, q),
        );
        own < 0.0 && other < 0.0
    };
    is_in(p) || is_in(q) || cuts(a, b) || cuts(b, c) || cuts(c, a)
}

fn bounds(triangle: &Triangle) -> Aabb {
    let [a, b, c] = *triangle;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    Aabb::new(
        Vector::new(low.x, low.y, low.z),
        Vector::new(high.x, high.y, high.z),
    )
}

/// For each group of new triangles how many of it run through others: of its own, of other groups
/// before it that do not run through anything themselves, or of those that are there.
pub(crate) fn meetings(groups: &[Vec<Triangle>], there: &[Triangle]) -> Vec<usize> {
    let new: Vec<(usize, &Triangle)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, own)| own.iter().map(move |t| (group, t)))
        .collect();
    let mut bad = vec![0; groups.len()];
    if new.is_empty() {
        return bad;
    }
    let boxes: Vec<Aabb> = new.iter().map(|own| bounds(own.1)).collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    // Those that are there: which new ones each meets.
    let against_old: Vec<u32> = there
        .par_iter()
        .with_min_len(1024)
        .flat_map_iter(|old| {
            let own = bounds(old);
            let mut met: Vec<u32> = tree.intersect_aabb(&own).collect();
            met.retain(|&k| meet(old, new[k as usize].1));
            met
        })
        .collect();
    let mut is_bad = vec![false; new.len()];
    against_old.iter().for_each(|&k| is_bad[k as usize] = true);
    let pairs: Vec<(u32, u32)> = (0..new.len() as u32)
        .into_par_iter()
        .with_min_len(256)
        .flat_map_iter(|k| {
            let mut met: Vec<u32> = tree.intersect_aabb(&boxes[k as usize]).collect();
            met.retain(|&other| other < k && meet(new[k as usize].1, new[other as usize].1));
            met.into_iter().map(move |other| (other, k))
        })
        .collect();
    for (other, k) in &pairs {
        let same = new[*other as usize].0 == new[*k as usize].0;
        if same {
            is_bad[*k as usize] = true;
            is_bad[*other as usize] = true;
        }
    }
    for ((group, _), is_bad) in new.iter().zip(&is_bad) {
        bad[*group] += usize::from(*is_bad);
    }
    // Of two that run through each other the one that comes first may stay.
    let mut crossing: Vec<(usize, usize)> = pairs
        .iter()
        .map(|(other, k)| (new[*other as usize].0, new[*k as usize].0))
        .filter(|(a, b)| a != b)
        .map(|(a, b)| (a.max(b), a.min(b)))
        .collect();
    crossing.sort_unstable();
    for (later, earlier) in crossing {
        if bad[earlier] == 0 {
            bad[later] += 1;
        }
    }
    bad
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(own: [[f64; 3]; 3]) -> Triangle {
        own.map(DVec3::from_array)
    }

    #[test]
    fn triangles_that_meet_and_that_touch() {
        let flat = triangle([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let through = triangle([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [5.0, 5.0, 0.0]]);
        let above = triangle([[1.0, 1.0, 0.1], [1.0, 1.0, 1.0], [5.0, 5.0, 0.1]]);
        assert!(meet(&flat, &through) && meet(&through, &flat));
        assert!(!meet(&flat, &above));
        // A corner and a side in common, bent and folded back.
        let corner = triangle([[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 1.0]]);
        assert!(!meet(&flat, &corner));
        let bent = triangle([[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.5]]);
        assert!(!meet(&flat, &bent));
        let folded = triangle([[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
        assert!(meet(&flat, &folded));
        let beside = triangle([[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, -1.0, 0.0]]);
        assert!(!meet(&flat, &beside));
        let within = triangle([[1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.0, 1.5, 0.0]]);
        assert!(meet(&flat, &within));
        let from_corner = triangle([[0.0, 0.0, 0.0], [3.0, -3.0, -1.0], [3.0, -3.0, 1.0]]);
        assert!(!meet(&flat, &from_corner));
        let through_corner = triangle([[0.0, 0.0, 0.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0]]);
        assert!(meet(&flat, &through_corner));
    }

    #[test]
    fn groups_are_told_apart() {
        let flat = triangle([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let through = triangle([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [5.0, 5.0, 0.0]]);
        let away = triangle([[1.0, 1.0, 9.0], [1.0, 2.0, 9.0], [5.0, 5.0, 9.0]]);
        assert_eq!(
            meetings(&[vec![flat], vec![through], vec![away]], &[]),
            [0, 1, 0]
        );
        assert_eq!(meetings(&[vec![away], vec![through]], &[flat]), [0, 1]);
        assert_eq!(meetings(&[vec![flat, through]], &[]), [2]);
    }
}
