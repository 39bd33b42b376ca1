//! Nodes beside a crease, whose normals mix two surfaces.

use crate::grid::{Grid, Links};
use crate::normals::Normals;
use crate::scene::Scene;

/// Distance from a node to the normals compared on either side of it, nodes: their windows
/// just miss each other, so at a crease neither mixes the two sides.
const ASIDE: isize = 3;
/// Creased nodes further than this from uncreased ones are no strip along a crease.
const HALF_WIDTH: u8 = 3;

/// True at nodes across which the direction changes like a crease: by more than the crease
/// angle from one side to the other, and clearly more than within both sides.
pub(crate) fn creased(scene: &Scene<'_>, normals: &Normals) -> Vec<bool> {
    let grid = &scene.grid;
    let mut creased: Vec<bool> = (0..grid.nodes())
        .map(|node| {
            [(1, 0), (0, 1), (1, 1), (1, -1)]
                .into_iter()
                .any(|direction| turns(scene, normals, node, direction))
        })
        .collect();
    release_wide_areas(grid, &scene.links, &mut creased);
    creased
}

fn turns(
    scene: &Scene<'_>,
    normals: &Normals,
    node: usize,
    (columns, rows): (isize, isize),
) -> bool {
    let at = |steps: isize| {
        scene
            .grid
            .offset(node, steps * columns, steps * rows)
            .and_then(|node| normals.of_node(node))
    };
    // Masked nodes leave gaps in a crease unless others stand in for them.
    let beside = |side: isize| {
        [ASIDE, ASIDE + 1, ASIDE - 1]
            .into_iter()
            .find_map(|s| at(side * s))
    };
    let (Some(before), Some(after)) = (beside(-1), beside(1)) else {
        return false;
    };
    let across = chord(before, after);
    // Chords are compared: the crease angle's is shorter than its arc by next to nothing.
    if across < 0.8 * scene.crease_rad {
        return false;
    }
    // A surface that is curved evenly turns as much within the sides as across the node.
    let sides = [
        at(-2 * ASIDE).map(|n| chord(n, before)),
        at(2 * ASIDE).map(|n| chord(after, n)),
    ];
    let within = match sides {
        [Some(a), Some(b)] => a + b,
        [Some(a), None] | [None, Some(a)] => 2.0 * a,
        [None, None] => 0.0,
    };
    across - within > 0.4 * scene.crease_rad
}

fn chord(a: [f64; 3], b: [f64; 3]) -> f64 {
    let mut sum = 0.0;
    for k in 0..3 {
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    }
    libm::sqrt(sum)
}

/// Takes back what is too wide for a strip along a crease: small round things, for instance.
fn release_wide_areas(grid: &Grid<'_>, links: &Links, creased: &mut [bool]) {
    let mut depth = vec![u8::MAX; grid.nodes()];
    let mut queue: Vec<usize> = (0..grid.nodes())
        .filter(|&n| grid.is_valid(n) && !creased[n])
        .collect();
    for &node in &queue {
        depth[node] = 0;
    }
    let mut next = 0;
    while let Some(&node) = queue.get(next) {
        next += 1;
        for n in links.linked(node) {
            if depth[n] == u8::MAX {
                depth[n] = depth[node].saturating_add(1);
                queue.push(n);
            }
        }
    }
    for (creased, depth) in creased.iter_mut().zip(depth) {
        *creased &= depth <= HALF_WIDTH;
    }
}
