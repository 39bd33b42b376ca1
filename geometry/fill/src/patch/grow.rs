//! A hole closed with elements.

use std::collections::HashSet;

use glam::DVec3;

use super::cover::cover;
use super::fair::{Ghost, fair};
use super::net::Net;
use super::polygon::{Polygon, border_sizes};
use super::relax::{foot, refine, relax, unfold};
use crate::implicit::Implicit;
use crate::mesh::{NONE, Stars, TriangleMesh, ends};
use crate::yoo::Unseen;

/// Elements over the vertices of a border and new ones.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    /// The mesh's vertices of the border.
    pub(crate) border: Vec<u32>,
    /// New vertices.
    pub(crate) places: Vec<DVec3>,
    /// Over the border's vertices first, then the new ones.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Why a hole cannot be closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Trouble {
    /// There are no triangles over its loop without an edge that the mesh has already.
    #[error("its loop admits no triangles but over edges that the mesh has already")]
    NoCover,
    /// An edge would have more than two triangles.
    #[error("a filling would meet itself along an edge")]
    NotManifold,
    /// It would run through itself or the mesh.
    #[error("a filling would run through {0} triangles of itself or of the mesh")]
    Intersects(usize),
    /// It grows without end.
    #[error("a filling would take more than {0} vertices: nothing bounds it")]
    TooMany(usize),
    /// It has no base surface.
    #[error(transparent)]
    Unseen(Unseen),
}

/// Inner edges of the coarse net, as a share of the hole's size, where its polygon is finer.
const COARSE_SHARE: f64 = 0.125;
/// Rounds in which the coarse net is made fair and as fine again: what bulges grows.
const FAIR_ROUNDS: usize = 4;
/// Rounds in which it is relaxed on the surface.
const RELAXED: usize = 4;
/// Most new vertices of a coarse net.
const MOST_COARSE: usize = 800;
/// Most vertices of one filling.
const MOST_VERTICES: usize = 4_000_000;

impl Patch {
    fn of(polygon: &Polygon, net: Net) -> Self {
        Self {
            border: polygon.vertices.clone(),
            places: net.places[net.fixed..].to_vec(),
            triangles: net.triangles,
        }
    }
}

/// What elements lie on.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Ground<'a> {
    /// An implicit surface.
    Surface(&'a Implicit),
    /// Nothing; they go on as the mesh does at the border.
    Fair,
    /// Nothing; they go straight across.
    Flat,
}

/// Closes a polygon with elements.
pub(crate) fn grow(
    mesh: &TriangleMesh,
    stars: &Stars,
    polygon: &Polygon,
    ground: Ground<'_>,
    max_edge_mm: Option<f64>,
) -> Result<Patch, Trouble> {
    let surface = match ground {
        Ground::Surface(own) => Some(own),
        Ground::Fair | Ground::Flat => None,
    };
    let places = polygon.places(mesh);
    let sizes = border_sizes(mesh, stars, polygon, max_edge_mm);
    let is_forbidden = |a: u32, b: u32| {
        stars.are_joined(
            mesh,
            polygon.vertices[a as usize],
            polygon.vertices[b as usize],
        )
    };
    let coarse = polygon.coarse(&places);
    let chain: Vec<u32> = coarse.iter().map(|&k| polygon.chain[k]).collect();
    let spots: Vec<DVec3> = chain.iter().map(|&v| places[v as usize]).collect();
    let outside = outside(polygon, &coarse);
    // A bridge is an edge of the polygon, and can be no other.
    let bridges: HashSet<(u32, u32)> = (0..polygon.chain.len())
        .filter(|&k| polygon.outside[k].is_none())
        .map(|k| {
            (
                polygon.chain[k],
                polygon.chain[(k + 1) % polygon.chain.len()],
            )
        })
        .collect();
    let never = |i: usize, j: usize| {
        let (a, b) = (chain[i], chain[j]);
        a == b || bridges.contains(&(a, b)) || is_forbidden(a, b)
    };
    let triangles = cover(&spots, &outside, never).ok_or(Trouble::NoCover)?;
    let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|k| chain[k])).collect();
    let normal = |at: &DVec3| surface.map_or(DVec3::ZERO, |own| own.at(*at).1.normalize_or_zero());
    let mut net = Net {
        fixed: places.len(),
        normals: places.iter().map(normal).collect(),
        sizes: coarse_sizes(&places, &chain, &sizes),
        places,
        triangles,
    };
    let ghosts = match ground {
        Ground::Flat => Vec::new(),
        _ => ghosts(&net, &chain, &outside),
    };
    shape(&mut net, &ghosts, surface, &is_forbidden);
    insert_skipped(&mut net, polygon, &coarse);
    finish_sizes(&mut net, &sizes);
    let most = most_vertices(&net, polygon);
    if !refine(&mut net, surface, &is_forbidden, most) {
        return Err(Trouble::TooMany(most));
    }
    if !(net.is_manifold() && has_sides(&net, polygon) && !has_forbidden(&net, &is_forbidden)) {
        return Err(Trouble::NotManifold);
    }
    Ok(Patch::of(polygon, net))
}

/// More vertices than a filling of any sensible shape takes: many times those of a disc.
fn most_vertices(net: &Net, polygon: &Polygon) -> usize {
    let count = polygon.chain.len();
    let around: f64 = (0..count)
        .map(|k| {
            let (a, b) = (
                polygon.chain[k] as usize,
                polygon.chain[(k + 1) % count] as usize,
            );
            net.places[a].distance(net.places[b]) / net.sizes[a].min(net.sizes[b])
        })
        .sum();
    5000.max((2.0 * around * around) as usize)
        .min(MOST_VERTICES)
}

/// Whether all sides of the polygon are there; with a manifold net, nothing else is its border.
fn has_sides(net: &Net, polygon: &Polygon) -> bool {
    let sides = net.triangles.iter();
    let sides: HashSet<(u32, u32)> = sides
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .collect();
    let count = polygon.chain.len();
    (0..count)
        .filter(|&k| polygon.outside[k].is_some())
        .all(|k| {
            let (from, to) = (polygon.chain[k], polygon.chain[(k + 1) % count]);
            sides.contains(&(from, to)) && !sides.contains(&(to, from))
        })
}

/// Whether an inner edge runs where the mesh has one.
fn has_forbidden(net: &Net, is_forbidden: &impl Fn(u32, u32) -> bool) -> bool {
    let opposite = net.opposite();
    (0..opposite.len() as u32).any(|side| {
        let (a, b) = ends(&net.triangles, side);
        let is_inner = opposite[side as usize] != NONE;
        let is_fixed = (a.max(b) as usize) < net.fixed;
        is_inner && is_fixed && is_forbidden(a, b)
    })
}

/// Normals outside the edges of the coarse polygon: the mean over what each skips.
fn outside(polygon: &Polygon, coarse: &[usize]) -> Vec<Option<DVec3>> {
    let count = polygon.chain.len();
    (0..coarse.len())
        .map(|k| {
            let from = coarse[k];
            let to = coarse.get(k + 1).copied().unwrap_or(coarse[0] + count);
            let own: Vec<DVec3> = (from..to)
                .filter_map(|k| polygon.outside[k % count])
                .collect();
            (!own.is_empty()).then(|| own.iter().sum::<DVec3>().normalize_or_zero())
        })
        .collect()
}

/// Wanted lengths while the net is coarse: those of the polygon's edges, which may be longer than those
/// of the border, and towards the inside as long as the hole allows.
fn coarse_sizes(places: &[DVec3], chain: &[u32], fine: &[f64]) -> Vec<f64> {
    let mut sizes = fine.to_vec();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &v in chain {
        low = low.min(places[v as usize]);
        high = high.max(places[v as usize]);
    }
    let least = COARSE_SHARE * low.distance(high);
    let count = chain.len();
    for k in 0..count {
        let own = chain[k] as usize;
        let at = |j: usize| places[chain[j % count] as usize];
        let beside = 0.5 * (at(k).distance(at(k + 1)) + at(k).distance(at(k + count - 1)));
        sizes[own] = sizes[own].max(beside).max(least);
    }
    sizes
}

/// Where the surface around the hole would go on outside of each coarse border vertex.
fn ghosts(net: &Net, chain: &[u32], outside: &[Option<DVec3>]) -> Vec<Ghost> {
    let count = chain.len();
    let at = |k: usize| net.places[chain[k % count] as usize];
    let ghost = |k: usize| {
        let before = (k + count - 1) % count;
        let normal = [outside[before], outside[k]]
            .into_iter()
            .flatten()
            .sum::<DVec3>();
        let along = at(k + 1) - at(before);
        let inward = normal.cross(along).normalize_or_zero();
        if inward == DVec3::ZERO {
            return None;
        }
        let step = 0.5 * (at(k).distance(at(k + 1)) + at(k).distance(at(before)));
        Some(Ghost {
            vertex: chain[k],
            place: at(k) - step * inward,
        })
    };
    (0..count).filter_map(ghost).collect()
}

/// Gives the coarse net its shape: fair first, then on the surface.
fn shape(
    net: &mut Net,
    ghosts: &[Ghost],
    surface: Option<&Implicit>,
    is_forbidden: &impl Fn(u32, u32) -> bool,
) {
    // Normals of the surface say nothing as long as the net is not on it.
    let normals = std::mem::replace(&mut net.normals, vec![DVec3::ZERO; net.places.len()]);
    for _ in 0..FAIR_ROUNDS {
        for _ in 0..8 {
            let split = net.split(&|at, _| (at, DVec3::ZERO));
            net.flip(is_forbidden);
            if split == 0 || net.places.len() > net.fixed + MOST_COARSE {
                break;
            }
        }
        if net.places.len() > net.fixed + 2 * MOST_COARSE {
            break;
        }
        fair(net, ghosts);
        net.flip(is_forbidden);
    }
    if surface.is_none() {
        return;
    }
    net.normals[..net.fixed].copy_from_slice(&normals[..net.fixed]);
    for v in net.fixed..net.places.len() {
        let reach = 4.0 * net.sizes[v];
        if let Some(found) = foot(surface, net.places[v], reach) {
            (net.places[v], net.normals[v]) = found;
        }
    }
    for _ in 0..RELAXED {
        net.flip(is_forbidden);
        relax(net, surface);
    }
    unfold(net, surface, is_forbidden);
}

/// Puts the border vertices that the coarse polygon skips back in: a fan in place of the triangle at
/// the edge that skips them.
fn insert_skipped(net: &mut Net, polygon: &Polygon, coarse: &[usize]) {
    let count = polygon.chain.len();
    for k in 0..coarse.len() {
        let from = coarse[k];
        let to = coarse.get(k + 1).copied().unwrap_or(coarse[0] + count);
        if to == from + 1 {
            continue;
        }
        let at = |k: usize| polygon.chain[k % count];
        let (a, b) = (at(from), at(to));
        let runs = |t: &[u32; 3]| (0..3).any(|j| t[j] == a && t[(j + 1) % 3] == b);
        let Some(own) = net.triangles.iter_mut().find(|t| runs(t)) else {
            continue;
        };
        let apex = own.iter().copied().find(|&v| v != a && v != b).unwrap_or(a);
        *own = [a, at(from + 1), apex];
        // A later edge may be one of these triangles'.
        net.triangles
            .extend((from + 1..to).map(|j| [at(j), at(j + 1), apex]));
    }
}

/// Wanted lengths of the whole border, and of new vertices as their neighbours have them.
fn finish_sizes(net: &mut Net, border: &[f64]) {
    net.sizes[..net.fixed].copy_from_slice(border);
    let mean = border.iter().sum::<f64>() / border.len().max(1) as f64;
    net.sizes[net.fixed..].fill(mean);
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); net.places.len()];
    for &[a, b, c] in &net.triangles {
        for (u, v) in [(a, b), (b, c), (c, a)] {
            around[u as usize].push(v);
            around[v as usize].push(u);
        }
    }
    for _ in 0..20 {
        for (v, own) in around.iter().enumerate().skip(net.fixed) {
            if !own.is_empty() {
                let sum: f64 = own.iter().map(|&w| net.sizes[w as usize]).sum();
                net.sizes[v] = sum / own.len() as f64;
            }
        }
    }
}
