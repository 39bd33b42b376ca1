//! Triangles on the zero set of a function of space.

use std::collections::BTreeMap;

use fill::TriangleMesh;
use glam::DVec3;

/// Rounds in which vertices are brought to the middle of their neighbours, and back onto the surface.
const ROUNDS: usize = 12;
const SHARE: f64 = 0.5;
/// Newton's steps back.
const STEPS: usize = 6;

/// Dual contouring of a smooth function on cubes of a side: a vertex for each cube that the surface runs
/// through, a square for each edge of cubes; then the vertices are spread evenly.
///
/// The function gives its value and its gradient. Triangles look to where it grows.
pub(crate) fn contour(
    function: impl Fn(DVec3) -> (f64, DVec3),
    [low, high]: [DVec3; 2],
    side: f64,
) -> TriangleMesh {
    let counts = ((high - low) / side).ceil().to_array().map(|n| n as usize);
    let at = |[x, y, z]: [usize; 3]| low + side * DVec3::new(x as f64, y as f64, z as f64);
    let index = |[x, y, z]: [usize; 3]| (z * (counts[1] + 1) + y) * (counts[0] + 1) + x;
    let nodes = |first: usize, last: [usize; 3]| {
        (first..last[2]).flat_map(move |z| {
            (first..last[1]).flat_map(move |y| (first..last[0]).map(move |x| [x, y, z]))
        })
    };
    let all = nodes(0, counts.map(|n| n + 1));
    let values: Vec<f64> = all.map(|node| function(at(node)).0).collect();
    // In the order in which edges are met, which is that of nodes and axes.
    let mut mesh = TriangleMesh::default();
    let mut vertex_of: BTreeMap<[usize; 3], u32> = BTreeMap::new();
    let moved = |mut node: [usize; 3], axes: &[usize]| {
        axes.iter().for_each(|&k| node[k] -= 1);
        node
    };
    for node in nodes(1, counts) {
        let is_inside = values[index(node)] < 0.0;
        for axis in 0..3 {
            let mut next = node;
            next[axis] += 1;
            if is_inside == (values[index(next)] < 0.0) {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let cubes = [&[u, v][..], &[v], &[], &[u]].map(|axes| moved(node, axes));
            let mut ring = cubes.map(|cube| {
                *vertex_of.entry(cube).or_insert_with(|| {
                    let middle = at(cube) + DVec3::splat(0.5 * side);
                    mesh.vertices_mm.push(middle.to_array());
                    mesh.vertices_mm.len() as u32 - 1
                })
            });
            if !is_inside {
                ring.reverse();
            }
            let [a, b, c, d] = ring;
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    spread(&mut mesh, function);
    mesh
}

fn spread(mesh: &mut TriangleMesh, function: impl Fn(DVec3) -> (f64, DVec3)) {
    let onto = |mut p: DVec3| {
        for _ in 0..STEPS {
            let (value, slope) = function(p);
            p -= value / slope.length_squared() * slope;
        }
        p
    };
    let mut places: Vec<DVec3> = mesh
        .vertices_mm
        .iter()
        .map(|p| onto(DVec3::from_array(*p)))
        .collect();
    for _ in 0..ROUNDS {
        let mut sums = vec![(DVec3::ZERO, 0.0); places.len()];
        for triangle in &mesh.triangles {
            for k in 0..3 {
                let own = &mut sums[triangle[k] as usize];
                for other in [triangle[(k + 1) % 3], triangle[(k + 2) % 3]] {
                    own.0 += places[other as usize];
                    own.1 += 1.0;
                }
            }
        }
        for (place, (sum, count)) in places.iter_mut().zip(sums) {
            *place = onto(place.lerp(sum / f64::max(count, 1.0), SHARE));
        }
        flip(&mut mesh.triangles, &places);
    }
    mesh.vertices_mm = places.iter().map(DVec3::to_array).collect();
}

/// Squares are divided along their shorter diagonals; triangles come in pairs.
fn flip(triangles: &mut [[u32; 3]], places: &[DVec3]) {
    for pair in triangles.chunks_mut(2) {
        let [[a, b, c], [_, _, d]] = *pair else {
            continue;
        };
        let apart = |u: u32, v: u32| places[u as usize].distance(places[v as usize]);
        if apart(b, d) < apart(a, c) {
            pair.copy_from_slice(&[[b, c, d], [b, d, a]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::is_watertight;

    #[test]
    fn a_ball_is_closed_and_round() {
        let ball = |p: DVec3| (p.length() - 5.0, p.normalize_or_zero());
        let own = contour(ball, [DVec3::splat(-6.3), DVec3::splat(6.2)], 0.7);
        assert!(is_watertight(&own));
        let mut volume = 0.0;
        for triangle in &own.triangles {
            let [a, b, c] = triangle.map(|v| DVec3::from_array(own.vertices_mm[v as usize]));
            assert!((a.length() - 5.0).abs() < 1e-9);
            volume += a.dot(b.cross(c)) / 6.0;
        }
        // Chords cut a few per cent off, and what is turned inside out would be negative.
        let whole = 4.0 / 3.0 * std::f64::consts::PI * 125.0;
        assert!((0.97..1.0).contains(&(volume / whole)), "{volume}");
    }
}
