//! Folds that no moving of vertices smooths out, cut out and closed anew.
//!
//! Around teeth of a ragged border new vertices can come to lie on the wrong side of it, where relaxing
//! moves nothing. What is around such a fold is small and so nearly flat: its triangles are taken out,
//! new vertices inside with them, and the polygon that they leave is triangulated in its plane, where
//! triangles that all look up cannot overlap.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use glam::DVec3;
use robust::{Coord, orient2d};

use super::net::Net;

/// Rings around folds that are taken out at first, and at most.
const RINGS: usize = 1;
const MOST_RINGS: usize = 5;
/// Corners of a polygon that is triangulated at most.
const MOST_CORNERS: usize = 160;
/// Cosine of the largest angle of a normal to that of the plane.
const FLAT: f64 = 0.3;

/// Cuts out all folds and closes what they leave; how many triangles are new. Where no polygon comes of
/// it a fold stays.
pub(super) fn cut_folds(net: &mut Net, is_forbidden: &impl Fn(u32, u32) -> bool) -> usize {
    let mut new = 0;
    for rings in RINGS..=MOST_RINGS {
        let folds = net.folds();
        if folds.is_empty() {
            break;
        }
        let stars = net.stars();
        let mut is_out = vec![false; net.triangles.len()];
        let mut added = Vec::new();
        for cavity in cavities(net, &stars, &folds, rings) {
            if let Some(own) = closed(net, &stars, &cavity, is_forbidden) {
                cavity.iter().for_each(|&t| is_out[t] = true);
                added.extend(own);
            }
        }
        if added.is_empty() {
            continue;
        }
        new += added.len();
        let mut outs = is_out.into_iter();
        net.triangles.retain(|_| !outs.next().unwrap_or(false));
        net.triangles.extend(added);
        net.compact();
    }
    new
}

/// Folds with the rings around them, those that overlap as one.
fn cavities(net: &Net, stars: &[Vec<u32>], folds: &[usize], rings: usize) -> Vec<BTreeSet<usize>> {
    let mut done: Vec<BTreeSet<usize>> = Vec::new();
    for &fold in folds {
        let mut own: BTreeSet<usize> = [fold].into();
        for _ in 0..rings {
            let corners: BTreeSet<u32> = own.iter().flat_map(|&t| net.triangles[t]).collect();
            let beside = corners.iter().flat_map(|&v| &stars[v as usize]);
            own.extend(beside.map(|&t| t as usize));
        }
        let (met, mut apart): (Vec<_>, Vec<_>) =
            done.into_iter().partition(|other| !own.is_disjoint(other));
        met.into_iter().for_each(|other| own.extend(other));
        apart.push(own);
        done = apart;
    }
    done
}

/// The border of a set of triangles as one simple chain of vertices, what lies inside to its left.
fn chain(net: &Net, cavity: &BTreeSet<usize>) -> Option<Vec<u32>> {
    let mut next: BTreeMap<u32, u32> = BTreeMap::new();
    let sides: HashSet<(u32, u32)> = cavity
        .iter()
        .flat_map(|&t| {
            let [a, b, c] = net.triangles[t];
            [(a, b), (b, c), (c, a)]
        })
        .collect();
    let mut outer = 0;
    for &(from, to) in &sides {
        if !sides.contains(&(to, from)) {
            outer += 1;
            next.insert(from, to);
        }
    }
    let (&first, _) = next.iter().next()?;
    let mut chain = vec![first];
    let mut at = *next.get(&first)?;
    while at != first && chain.len() < outer {
        chain.push(at);
        at = *next.get(&at)?;
    }
    (at == first && chain.len() == outer && outer <= MOST_CORNERS).then_some(chain)
}

/// Triangles that close a cavity without a fold.
fn closed(
    net: &Net,
    stars: &[Vec<u32>],
    cavity: &BTreeSet<usize>,
    is_forbidden: &impl Fn(u32, u32) -> bool,
) -> Option<Vec<[u32; 3]>> {
    let chain = chain(net, cavity)?;
    let sum: DVec3 = chain.iter().map(|&v| net.normals[v as usize]).sum();
    let normal = sum.normalize_or_zero();
    let is_flat = |v: &u32| net.normals[*v as usize].dot(normal) > FLAT;
    if normal == DVec3::ZERO || !chain.iter().all(is_flat) {
        return None;
    }
    let (x, y) = normal.any_orthonormal_pair();
    let origin = net.places[chain[0] as usize];
    let flat: Vec<Coord<f64>> = chain
        .iter()
        .map(|&v| {
            let arm = net.places[v as usize] - origin;
            Coord {
                x: arm.dot(x),
                y: arm.dot(y),
            }
        })
        .collect();
    if !is_simple(&flat) {
        return None;
    }
    // Edges that stay, of which there can be no second.
    let mut kept: HashSet<(u32, u32)> = HashSet::new();
    for &v in &chain {
        for &t in &stars[v as usize] {
            if !cavity.contains(&(t as usize)) {
                let [a, b, c] = net.triangles[t as usize];
                kept.extend([(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]);
            }
        }
    }
    let fixed = net.fixed as u32;
    let never = |i: usize, j: usize| {
        let (a, b) = (chain[i], chain[j]);
        kept.contains(&(a, b)) || (a < fixed && b < fixed && is_forbidden(a, b))
    };
    let cost = |i: usize, k: usize, j: usize| {
        let own = [chain[i], chain[k], chain[j]];
        let is_up = orient2d(flat[i], flat[k], flat[j]) > 0.0;
        let is_folded = !is_up || net.faces_away(own, net.normal_at(own));
        (!is_folded).then(|| slimness(own.map(|v| net.places[v as usize])))
    };
    let triangles = triangulated(chain.len(), never, cost)?;
    Some(triangles.into_iter().map(|t| t.map(|k| chain[k])).collect())
}

/// How far a triangle is from one of equal sides: its squared sides over its area.
fn slimness([a, b, c]: [DVec3; 3]) -> f64 {
    let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    sides / (b - a).cross(c - a).length().max(f64::MIN_POSITIVE)
}

/// Whether no two sides of a polygon meet but in the corner that both have, and its inside is to the left.
fn is_simple(flat: &[Coord<f64>]) -> bool {
    let count = flat.len();
    let at = |k: usize| flat[k % count];
    let doubled: f64 = (0..count)
        .map(|k| at(k).x * at(k + 1).y - at(k).y * at(k + 1).x)
        .sum();
    let is_crossed = |i: usize, j: usize| {
        let (a, b, c, d) = (at(i), at(i + 1), at(j), at(j + 1));
        let (own, other) = (
            [orient2d(a, b, c), orient2d(a, b, d)],
            [orient2d(c, d, a), orient2d(c, d, b)],
        );
        let parts = |s: [f64; 2]| (s[0] > 0.0 && s[1] > 0.0) || (s[0] < 0.0 && s[1] < 0.0);
        !(parts(own) || parts(other))
    };
    let meets = |i: usize| {
        let last = if i == 0 { count - 1 } else { count };
        (i + 2..last).any(|j| is_crossed(i, j))
    };
    doubled > 0.0 && !(0..count).any(meets)
}

/// Triangles over the places of a polygon whose costs sum up to the least, none of which is `None`, with no
/// inner edge that must never be.
fn triangulated(
    count: usize,
    never: impl Fn(usize, usize) -> bool,
    cost: impl Fn(usize, usize, usize) -> Option<f64>,
) -> Option<Vec<[usize; 3]>> {
    let mut best: HashMap<(usize, usize), (f64, usize)> = HashMap::new();
    for i in 0..count.saturating_sub(1) {
        best.insert((i, i + 1), (0.0, i));
    }
    for span in 2..count {
        for i in 0..count - span {
            let j = i + span;
            if span < count - 1 && never(i, j) {
                continue;
            }
            let mut own: Option<(f64, usize)> = None;
            for k in i + 1..j {
                let (Some(left), Some(right)) = (best.get(&(i, k)), best.get(&(k, j))) else {
                    continue;
                };
                let Some(cost) = cost(i, k, j) else {
                    continue;
                };
                let sum = left.0 + right.0 + cost;
                if own.is_none_or(|o| sum < o.0) {
                    own = Some((sum, k));
                }
            }
            if let Some(own) = own {
                best.insert((i, j), own);
            }
        }
    }
    best.get(&(0, count - 1))?;
    let mut triangles = Vec::new();
    let mut left = vec![(0, count - 1)];
    while let Some((i, j)) = left.pop() {
        if j - i >= 2 {
            let k = best.get(&(i, j))?.1;
            triangles.push([i, k, j]);
            left.extend([(i, k), (k, j)]);
        }
    }
    Some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of cells whose border stays, one of its inner vertices moved.
    fn net(moved: DVec3) -> Net {
        let side = 6_u32;
        let mut places = Vec::new();
        let mut number = vec![0; (side * side) as usize];
        let is_border = |k: u32| {
            let (x, y) = (k % side, k / side);
            x == 0 || y == 0 || x == side - 1 || y == side - 1
        };
        for border in [true, false] {
            for k in (0..side * side).filter(|&k| is_border(k) == border) {
                number[k as usize] = places.len() as u32;
                places.push(DVec3::new(f64::from(k % side), f64::from(k / side), 0.0));
            }
        }
        let mut triangles = Vec::new();
        for y in 0..side - 1 {
            for x in 0..side - 1 {
                let at = |dx: u32, dy: u32| number[((y + dy) * side + x + dx) as usize];
                triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
        places[number[(side + 1) as usize] as usize] = moved;
        Net {
            sizes: vec![1.0; places.len()],
            normals: vec![DVec3::Z; places.len()],
            fixed: 4 * (side as usize - 1),
            places,
            triangles,
        }
    }

    #[test]
    fn a_vertex_on_the_wrong_side_of_the_border() {
        let mut own = net(DVec3::new(-0.7, -0.4, 0.0));
        assert!(!own.folds().is_empty());
        assert!(cut_folds(&mut own, &|_, _| false) > 0);
        assert!(own.folds().is_empty());
        assert!(own.is_manifold());
        let area: f64 = own.triangles.iter().map(|&t| own.doubled_area(t).z).sum();
        assert!((area - 50.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn what_is_not_folded_stays() {
        let mut own = net(DVec3::new(1.1, 0.9, 0.0));
        let before = own.triangles.clone();
        assert_eq!(cut_folds(&mut own, &|_, _| false), 0);
        assert_eq!(own.triangles, before);
    }

    #[test]
    fn polygons_that_cross_themselves_are_told() {
        let at = |x: f64, y: f64| Coord { x, y };
        let square = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        assert!(is_simple(&square));
        let crossed = [square[0], square[2], square[1], square[3]];
        assert!(!is_simple(&crossed));
        let mut around = square;
        around.reverse();
        assert!(!is_simple(&around));
    }
}
