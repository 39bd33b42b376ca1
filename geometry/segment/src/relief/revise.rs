//! Pieces that need not be, and nodes that need a piece of their own.

use super::grow::MISS_NOISES;
use super::piece::Pieces;
use super::surface::Surface;
use crate::components::{Border, depths, label_components, sizes};
use crate::scene::{NONE, Scene};

/// A piece is none when another explains this share of its nodes.
const EXPLAINED: f64 = 0.85;
/// Fewer nodes that nothing explains are no piece.
const LEAST_LEFTOVER: usize = 20;
/// Rounds of fitting a surface to those of the nodes that it explains.
const TRIMS: usize = 8;
/// A node so far from what ends its part lies deep.
const SLIM: u8 = 2;
/// A sliver lies beside something so many times its size.
const FAR_LARGER: usize = 10;
/// z of the normal of what is seen almost edge on (66 degrees of incidence).
const STEEP: f64 = 0.4;
/// Cosine of the turn (30 degrees) up to which a sliver goes on from a region.
const ONWARD: f64 = 0.866;
/// Of so many nodes of a part one must lie deep in it, or it is a sliver.
const LEAST_DEEP: usize = 8;

/// Gives pieces to a neighbour whose surface explains nearly all their nodes as well, the
/// smallest first.
pub(crate) fn dissolve(scene: &Scene<'_>, pieces: &mut Pieces) {
    let members = pieces.members();
    let mut order: Vec<usize> = (1..members.len()).collect();
    order.sort_by_key(|&label| (members[label].len(), label));
    for label in order {
        let nodes = &members[label];
        let mut beside: Vec<u32> = nodes
            .iter()
            .flat_map(|&n| scene.links.linked(n as usize))
            .map(|n| pieces.labels[n])
            .filter(|&l| l != NONE && l as usize != label)
            .collect();
        beside.sort_unstable();
        beside.dedup();
        let explained = |other: u32| {
            let explained = nodes
                .iter()
                .filter(|&&n| pieces.miss(scene, other, n as usize) < MISS_NOISES);
            explained.count() as f64 / nodes.len() as f64
        };
        let best = beside
            .into_iter()
            .filter(|&l| members[l as usize].len() > nodes.len())
            .map(|l| (explained(l), l))
            .filter(|(share, _)| *share >= EXPLAINED)
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        if let Some((_, other)) = best {
            for &node in nodes {
                pieces.labels[node as usize] = other;
            }
            pieces.surfaces[label] = None;
        }
    }
}

/// Makes pieces of connected nodes that no surface explains, where a plane or quadric of their
/// own does: faces too narrow for any window.
pub(crate) fn leftovers(scene: &Scene<'_>, pieces: &mut Pieces) {
    let open = |n: usize| (pieces.labels[n] == NONE && scene.grid.is_valid(n)).then_some(());
    let mut parts = vec![NONE; pieces.labels.len()];
    let next = label_components(&scene.grid, &scene.links, open, &mut parts, 1);
    let mut members = vec![Vec::new(); next as usize];
    for (node, &part) in parts.iter().enumerate() {
        if part != NONE {
            members[part as usize].push(node as u32);
        }
    }
    for nodes in members {
        if nodes.len() < LEAST_LEFTOVER {
            continue;
        }
        let mut inside = nodes.clone();
        let mut found = None;
        for _ in 0..TRIMS {
            let Some(surface) = Surface::fit(scene, &inside, 1.0) else {
                break;
            };
            // Half of the nodes, and those that it explains.
            let mut misses: Vec<(f64, u32)> = nodes
                .iter()
                .map(|&n| (surface.miss(scene, n as usize), n))
                .collect();
            misses.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let explained = misses.partition_point(|m| m.0 < MISS_NOISES);
            inside = misses[..explained.max(nodes.len() / 2)]
                .iter()
                .map(|m| m.1)
                .collect();
            found = Some((surface, explained));
        }
        if let Some((surface, explained)) = found
            && explained >= LEAST_LEFTOVER
            && explained * 2 >= nodes.len()
        {
            let label = pieces.surfaces.len() as u32;
            pieces.surfaces.push(Some(surface));
            for &node in &inside {
                pieces.labels[node as usize] = label;
            }
        }
    }
}

/// Gives slivers that are seen almost edge on, as outlines of round things leave them, to the
/// region that they go on from. Those that hang beside something far larger without a link to
/// it lose their label.
pub(crate) fn clear_slivers(scene: &Scene<'_>, labels: &mut [u32]) {
    let grid = &scene.grid;
    let mut parts = vec![NONE; labels.len()];
    let key = |n: usize| (labels[n] != NONE).then(|| labels[n]);
    label_components(grid, &scene.links, key, &mut parts, 1);
    let sizes = sizes(&parts);
    let mut deep = vec![0; sizes.len()];
    let mut members = vec![Vec::new(); sizes.len()];
    for (node, depth) in depths(scene, &parts, SLIM, Border::All)
        .into_iter()
        .enumerate()
    {
        deep[parts[node] as usize] += usize::from(depth >= SLIM);
        members[parts[node] as usize].push(node as u32);
    }
    for part in 1..sizes.len() {
        let nodes = &members[part];
        if deep[part] * LEAST_DEEP >= nodes.len() {
            continue;
        }
        let Some(normal) = normal(scene, nodes).filter(|normal| normal[2] < STEEP) else {
            continue;
        };
        let mut linked: Vec<usize> = nodes
            .iter()
            .flat_map(|&n| scene.links.linked(n as usize))
            .filter(|&n| parts[n] != part as u32 && sizes[parts[n] as usize] > nodes.len())
            .collect();
        linked.sort_unstable_by_key(|&n| (parts[n], n));
        let onward = linked
            .chunk_by(|&a, &b| parts[a] == parts[b])
            .filter(|beside| goes_on(scene, &parts, beside, normal))
            .max_by_key(|beside| beside.len());
        let label = match onward {
            Some(beside) => labels[beside[0]],
            None if linked.is_empty() && hangs_beside(scene, &parts, &sizes, nodes) => NONE,
            None => continue,
        };
        for &node in nodes {
            labels[node as usize] = label;
        }
    }
}

/// Whether a region's nodes about these face much the same way.
fn goes_on(scene: &Scene<'_>, parts: &[u32], beside: &[usize], towards: [f64; 3]) -> bool {
    let grid = &scene.grid;
    let mut about: Vec<u32> = beside
        .iter()
        .flat_map(|&node| {
            let (columns, rows) = grid.window(node, usize::from(SLIM));
            columns.flat_map(move |c| rows.clone().map(move |r| c * grid.rows + r))
        })
        .filter(|&n| parts[n] == parts[beside[0]])
        .map(|n| n as u32)
        .collect();
    about.sort_unstable();
    about.dedup();
    normal(scene, &about).is_some_and(|own| {
        let cosine: f64 = (0..3).map(|k| own[k] * towards[k]).sum();
        cosine > ONWARD
    })
}

fn hangs_beside(scene: &Scene<'_>, parts: &[u32], sizes: &[usize], nodes: &[u32]) -> bool {
    let grid = &scene.grid;
    nodes.iter().any(|&node| {
        let (columns, rows) = grid.window(node as usize, usize::from(SLIM));
        columns.into_iter().any(|c| {
            rows.clone().any(|r| {
                let part = parts[c * grid.rows + r];
                part != NONE && sizes[part as usize] > FAR_LARGER * nodes.len()
            })
        })
    })
}

/// Unit normal of a surface through nodes, at their middle.
fn normal(scene: &Scene<'_>, nodes: &[u32]) -> Option<[f64; 3]> {
    let surface = Surface::fit(scene, nodes, 1.0)?;
    let pitch = scene.grid.pitch_mm;
    let [p, q] = surface.middle_rise_mm().map(|rise| rise / pitch);
    let length = libm::sqrt(1.0 + p * p + q * q);
    Some([-p / length, -q / length, 1.0 / length])
}
