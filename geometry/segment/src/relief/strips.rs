//! Faces that are a node or two wide. Nodes beside each other on one that is steep differ as if
//! a step lay between, since no slope foretells the difference: their plane does.

mod joints;

pub(crate) use joints::{bridge, joints};

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::grow::MISS_NOISES;
use super::piece::Pieces;
use super::surface::Surface;
use crate::scene::{NONE, Scene};

/// Nodes about a seed by which its strip is first known, to each side.
const REACH: usize = 5;
/// Nodes of a strip are so far apart at most, where one in between lies on a face beside it.
const HOP: usize = 2;
/// Nodes that a strip is wide, at most.
const WIDE: usize = 3;
/// Fewer nodes tell of no plane, and more are no strip.
const LEAST_SEED: usize = 10;
const MOST_SEED: usize = WIDE * (2 * REACH + 1);
/// Noises that a seed's plane may leave.
const CLEAN: f64 = 1.5;
/// Fewer nodes are no strip.
const LEAST_NODES: usize = 20;
/// Growth that has not settled after so many rounds wanders.
const ROUNDS: usize = 12;

/// Makes pieces of nodes without one that lie near each other, whatever lies between, on a plane
/// of their own; those from the first label on that follow each other become one.
pub(crate) fn find(scene: &Scene<'_>, pieces: &mut Pieces, first: u32) {
    let open = (0..pieces.labels.len())
        .into_par_iter()
        .filter(|&n| pieces.labels[n] == NONE && scene.grid.is_valid(n));
    // The flattest first.
    let mut seeds: Vec<(f64, usize)> = open
        .filter_map(|seed| {
            let nodes = about(scene, &*pieces, seed);
            let surface = narrow_plane(scene, &nodes)?;
            Some((left(scene, &surface, &nodes), seed))
        })
        .filter(|(left, _)| *left < CLEAN)
        .collect();
    seeds.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut vain = vec![false; pieces.labels.len()];
    for (_, seed) in seeds {
        if pieces.labels[seed] != NONE || vain[seed] {
            continue;
        }
        let nodes = about(scene, pieces, seed);
        // Seeds close by would fare no better.
        for &node in &nodes {
            vain[node as usize] = true;
        }
        let Some((surface, nodes)) = grown(scene, pieces, seed, nodes) else {
            continue;
        };
        let label = pieces.surfaces.len() as u32;
        pieces.surfaces.push(Some(surface));
        for node in nodes {
            pieces.labels[node as usize] = label;
        }
    }
    unite(scene, pieces, first);
}

/// The strip that grows from the nodes about a seed, and its plane.
fn grown(
    scene: &Scene<'_>,
    pieces: &Pieces,
    seed: usize,
    mut nodes: Vec<u32>,
) -> Option<(Surface, Vec<u32>)> {
    let mut surface = narrow_plane(scene, &nodes)?;
    if left(scene, &surface, &nodes) >= CLEAN {
        return None;
    }
    let most = WIDE * (scene.grid.columns + scene.grid.rows);
    for _ in 0..ROUNDS {
        let lies_on = |n| surface.miss(scene, n) < MISS_NOISES;
        let grown = flood(scene, pieces, seed, most, lies_on);
        if grown.len() > most {
            return None;
        }
        let Some(next) = plane(scene, &grown) else {
            break;
        };
        let settled = grown.len() == nodes.len();
        (nodes, surface) = (grown, next);
        if settled {
            break;
        }
    }
    let is_strip = nodes.len() >= LEAST_NODES
        && left(scene, &surface, &nodes) < CLEAN
        && !is_broad(scene, &nodes);
    is_strip.then_some((surface, nodes))
}

/// Makes one of strips, from this label on, that follow each other on one plane: the first part
/// of a strip tells little of how it turns about its length, so that growth may stop half way.
fn unite(scene: &Scene<'_>, pieces: &mut Pieces, first: u32) {
    let mut members = pieces.members();
    for label in first..pieces.surfaces.len() as u32 {
        loop {
            let nodes = &members[label as usize];
            let mut beside: Vec<u32> = nodes
                .iter()
                .flat_map(|&n| around(scene, n as usize, REACH))
                .map(|n| pieces.labels[n])
                .filter(|&l| l >= first && l != label)
                .collect();
            beside.sort_unstable();
            beside.dedup();
            let united = beside.into_iter().find_map(|other| {
                let both = [nodes.as_slice(), &members[other as usize]].concat();
                let surface = plane(scene, &both)?;
                let is_strip = left(scene, &surface, &both) < CLEAN && !is_broad(scene, &both);
                is_strip.then_some((other, surface))
            });
            let Some((other, surface)) = united else {
                break;
            };
            let others = std::mem::take(&mut members[other as usize]);
            for &node in &others {
                pieces.labels[node as usize] = label;
            }
            members[label as usize].extend(others);
            pieces.surfaces[label as usize] = Some(surface);
            pieces.surfaces[other as usize] = None;
        }
    }
}

/// Nodes within so many columns and rows, this one too.
fn around(scene: &Scene<'_>, node: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
    let height = scene.grid.rows;
    let (columns, rows) = scene.grid.window(node, reach);
    columns.flat_map(move |c| rows.clone().map(move |r| c * height + r))
}

/// Whether there are more of the nodes about one of them than a strip has.
fn is_broad(scene: &Scene<'_>, nodes: &[u32]) -> bool {
    let own: BTreeSet<usize> = nodes.iter().map(|&n| n as usize).collect();
    let about = |&node: &usize| around(scene, node, REACH).filter(|n| own.contains(n));
    own.iter().any(|node| about(node).count() > MOST_SEED)
}

/// The plane of nodes about a seed, where these are a strip.
fn narrow_plane(scene: &Scene<'_>, nodes: &[u32]) -> Option<Surface> {
    (nodes.len() <= MOST_SEED).then(|| plane(scene, nodes))?
}

fn plane(scene: &Scene<'_>, nodes: &[u32]) -> Option<Surface> {
    if nodes.len() < LEAST_SEED {
        return None;
    }
    Surface::plane(scene, nodes)
}

/// What a surface leaves at its nodes, in noises.
fn left(scene: &Scene<'_>, surface: &Surface, nodes: &[u32]) -> f64 {
    let squares: f64 = nodes
        .iter()
        .map(|&n| surface.miss(scene, n as usize))
        .map(|miss| miss * miss)
        .sum();
    libm::sqrt(squares / (nodes.len() as f64 - 3.0))
}

/// Open nodes near a seed, and connected with it there; where they are too many, not all.
fn about(scene: &Scene<'_>, pieces: &Pieces, seed: usize) -> Vec<u32> {
    let (column, row) = scene.grid.column_row(seed);
    flood(scene, pieces, seed, MOST_SEED, |n| {
        let (c, r) = scene.grid.column_row(n);
        c.abs_diff(column) <= REACH && r.abs_diff(row) <= REACH
    })
}

/// The open nodes that are connected with a seed through such as are wanted; no further once
/// there are more than the most.
fn flood(
    scene: &Scene<'_>,
    pieces: &Pieces,
    seed: usize,
    most: usize,
    wanted: impl Fn(usize) -> bool,
) -> Vec<u32> {
    let grid = &scene.grid;
    let mut found = vec![seed as u32];
    let mut seen = BTreeSet::from([seed]);
    let mut next = 0;
    while found.len() <= most
        && let Some(&node) = found.get(next)
    {
        next += 1;
        for n in around(scene, node as usize, HOP) {
            let is_open = pieces.labels[n] == NONE && grid.is_valid(n);
            if is_open && !seen.contains(&n) && wanted(n) {
                seen.insert(n);
                found.push(n as u32);
            }
        }
    }
    found
}
