//! Meshes as they come, mended where that is safe.

use std::collections::{HashMap, HashSet};

use super::TriangleMesh;
use super::edges::{Edges, is_down, side_of};
use super::weld::{weld_equal, weld_near};
use crate::error::FillError;

/// What was found and done before holes were looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Mended {
    /// Vertices with the coordinates of others, made one with them.
    pub welded_equal: usize,
    /// Vertices on borders so near to others that they are one with them; these moved.
    pub welded_near: usize,
    /// Triangles with one vertex twice, left out.
    pub degenerate: usize,
    /// Triangles without an area over three vertices, kept since their neighbours hold on to them.
    pub slivers: usize,
    /// Triangles over the same vertices as others, left out; pairs that face each other count twice.
    pub duplicate: usize,
    /// Triangles turned around so that neighbours agree.
    pub turned: usize,
    /// Edges that more than two triangles had.
    pub non_manifold_edges: usize,
    /// Triangles left out so that no edge has more than two.
    pub left_out: usize,
    /// Edges across which triangles can be turned no way, as on a Moebius strip; one triangle at each is
    /// left out.
    pub one_sided_edges: usize,
    /// Triangles around holes left out since the holes could not be closed otherwise.
    pub cleared: usize,
    /// Vertices added so that every fan of triangles that met others only in one has its own; they are
    /// split once holes are closed, since holes may touch in a vertex.
    pub split_vertices: usize,
    /// Vertices that no triangle has, or has any more, left out.
    pub unused_vertices: usize,
}

impl Mended {
    /// Whether nothing but equal vertices was found.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        let own = Self {
            welded_equal: 0,
            ..*self
        };
        own == Self::default()
    }
}

/// Units in the last place of single precision by which vertices of a border are taken for one.
const NEAR_ULPS: f64 = 4.0;

/// Mends a mesh in place; no vertex moves but those of borders that are welded.
pub(crate) fn mend(mesh: &mut TriangleMesh, weld_mm: Option<f64>) -> Result<Mended, FillError> {
    mesh.validate()?;
    let mut done = Mended {
        welded_equal: weld_equal(mesh),
        ..Mended::default()
    };
    let given = mesh.triangles.len();
    drop_degenerate(mesh, &mut done);
    let within_mm = weld_mm.unwrap_or_else(|| {
        let largest = mesh.vertices_mm.as_flattened().iter();
        let largest = largest.fold(0.0_f64, |most, c| most.max(c.abs()));
        NEAR_ULPS * f64::from(f32::EPSILON) * largest
    });
    done.welded_near = weld_near(mesh, within_mm);
    drop_degenerate(mesh, &mut done);
    let no_area = |t: &&[u32; 3]| mesh.doubled_area(**t).length_squared() == 0.0;
    done.slivers = mesh.triangles.iter().filter(no_area).count();
    if mesh.triangles.len() == done.slivers {
        return Err(FillError::Degenerate { triangles: given });
    }
    drop_duplicates(mesh, &mut done);
    part_edges(mesh, &mut done);
    turn(mesh, &mut done);
    done.unused_vertices = mesh.compact();
    Ok(done)
}

fn drop_degenerate(mesh: &mut TriangleMesh, done: &mut Mended) {
    let before = mesh.triangles.len();
    mesh.triangles
        .retain(|&[a, b, c]| a != b && b != c && c != a);
    done.degenerate += before - mesh.triangles.len();
}

/// Of triangles over the same vertices one is kept, and none of two that face each other: they are a
/// fold without a volume.
fn drop_duplicates(mesh: &mut TriangleMesh, done: &mut Mended) {
    let key = |t: &[u32; 3]| {
        let mut own = *t;
        own.sort_unstable();
        own
    };
    let is_even = |t: &[u32; 3]| {
        let [a, b, c] = *t;
        (a < b) ^ (b < c) ^ (c < a)
    };
    let mut seen: HashMap<[u32; 3], (u32, u32)> = HashMap::with_capacity(mesh.triangles.len());
    for triangle in &mesh.triangles {
        let count = seen.entry(key(triangle)).or_default();
        if is_even(triangle) {
            count.0 += 1;
        } else {
            count.1 += 1;
        }
    }
    if seen.values().all(|own| own.0 + own.1 == 1) {
        return;
    }
    let before = mesh.triangles.len();
    let mut taken = HashSet::new();
    mesh.triangles.retain(|triangle| {
        let own = key(triangle);
        match seen.get(&own) {
            Some((even, odd)) if *even > 0 && *odd > 0 => false,
            Some((even, odd)) if even + odd > 1 => taken.insert(own),
            _ => true,
        }
    });
    done.duplicate = before - mesh.triangles.len();
}

/// Leaves out triangles so that no edge has more than two: of those at such an edge the ones that hang
/// on least, and where all do the same, all but the two that are most nearly one surface.
fn part_edges(mesh: &mut TriangleMesh, done: &mut Mended) {
    let mut is_first = true;
    loop {
        let edges = Edges::of(&mesh.triangles);
        // How many edges of each triangle nobody else has.
        let mut free = vec![0_u8; mesh.triangles.len()];
        let mut crowded = Vec::new();
        for group in edges.groups() {
            match group {
                [own] => free[side_of(own) as usize / 3] += 1,
                [_, _] => {}
                _ => crowded.push(group),
            }
        }
        if is_first {
            done.non_manifold_edges = crowded.len();
            is_first = false;
        }
        if crowded.is_empty() {
            return;
        }
        let mut is_out = vec![false; mesh.triangles.len()];
        for group in crowded {
            let own: Vec<usize> = group.iter().map(|s| side_of(s) as usize / 3).collect();
            let left: Vec<usize> = own.into_iter().filter(|&t| !is_out[t]).collect();
            if left.len() <= 2 {
                continue;
            }
            let loosest = left.iter().map(|&t| free[t]).max().unwrap_or(0);
            if loosest > 0 {
                left.iter()
                    .filter(|&&t| free[t] == loosest)
                    .take(left.len() - 2)
                    .for_each(|&t| is_out[t] = true);
                continue;
            }
            let pair = flattest(mesh, &left, (group[0].0, group[0].1));
            left.iter()
                .filter(|t| !pair.contains(*t))
                .for_each(|&t| is_out[t] = true);
        }
        let before = mesh.triangles.len();
        let mut outs = is_out.into_iter();
        mesh.triangles.retain(|_| !outs.next().unwrap_or(false));
        done.left_out += before - mesh.triangles.len();
    }
}

/// Of triangles at an edge the two that turn least across it.
fn flattest(mesh: &TriangleMesh, triangles: &[usize], (a, b): (u32, u32)) -> [usize; 2] {
    let axis = (mesh.place(b) - mesh.place(a)).normalize_or_zero();
    // The direction in which each leaves the edge.
    let leaves = |t: usize| {
        let sum: glam::DVec3 = mesh.corners(mesh.triangles[t]).into_iter().sum();
        let own = sum / 3.0 - mesh.place(a);
        (own - own.dot(axis) * axis).normalize_or_zero()
    };
    let mut best = (f64::INFINITY, [triangles[0], triangles[1]]);
    for (k, &t) in triangles.iter().enumerate() {
        for &other in &triangles[k + 1..] {
            let along = leaves(t).dot(leaves(other));
            if along < best.0 {
                best = (along, [t, other]);
            }
        }
    }
    best.1
}

/// Turns triangles around so that neighbours run along their edge in opposite senses. Of each component
/// the fewer are turned. Where no turning will do, the smaller of two triangles is left out.
fn turn(mesh: &mut TriangleMesh, done: &mut Mended) {
    while let Some(torn) = turned(mesh, done) {
        done.one_sided_edges += torn.len();
        let mut is_out = vec![false; mesh.triangles.len()];
        for [a, b] in torn {
            if !(is_out[a] || is_out[b]) {
                let area = |t: usize| mesh.doubled_area(mesh.triangles[t]).length_squared();
                is_out[if area(a) < area(b) { a } else { b }] = true;
            }
        }
        let before = mesh.triangles.len();
        let mut outs = is_out.into_iter();
        mesh.triangles.retain(|_| !outs.next().unwrap_or(false));
        done.left_out += before - mesh.triangles.len();
    }
}

/// Triangles by which way around they are to be, relative to others of their part.
struct Senses {
    parent: Vec<u32>,
    /// Whether a triangle is to be turned if its parent is not.
    is_turned: Vec<bool>,
}

impl Senses {
    /// The root of a triangle's part, and whether it is to be turned if that is not.
    fn root(&mut self, triangle: u32) -> (u32, bool) {
        let (mut at, mut way) = (triangle, Vec::new());
        while self.parent[at as usize] != at {
            way.push(at);
            at = self.parent[at as usize];
        }
        // Shortened from the root's end, so that each hangs on the root itself.
        let mut is_turned = false;
        for &own in way.iter().rev() {
            is_turned ^= self.is_turned[own as usize];
            self.is_turned[own as usize] = is_turned;
            self.parent[own as usize] = at;
        }
        (at, is_turned)
    }

    /// Joins two that lie beside each other; false where they are joined already and disagree.
    fn join(&mut self, a: u32, b: u32, same_way: bool) -> bool {
        let ((root_a, turned_a), (root_b, turned_b)) = (self.root(a), self.root(b));
        let disagree = turned_a ^ turned_b ^ same_way;
        if root_a == root_b {
            return !disagree;
        }
        let (low, high) = (root_a.min(root_b), root_a.max(root_b));
        self.parent[high as usize] = low;
        self.is_turned[high as usize] = disagree;
        true
    }
}

/// Turns what can be turned; the pairs of triangles that then run the same way, if there are any, and
/// nothing is turned. Neighbours that agree as they come are believed first, then those that lie
/// flattest beside each other, so that what disagrees in the end is what is least like a surface.
fn turned(mesh: &mut TriangleMesh, done: &mut Mended) -> Option<Vec<[usize; 2]>> {
    let edges = Edges::of(&mesh.triangles);
    let count = mesh.triangles.len();
    let mut senses = Senses {
        parent: (0..count as u32).collect(),
        is_turned: vec![false; count],
    };
    let mut against: Vec<(f64, u32, u32)> = Vec::new();
    for group in edges.groups() {
        let [a, b] = group else {
            continue;
        };
        let (ta, tb) = (side_of(a) / 3, side_of(b) / 3);
        if is_down(a) != is_down(b) {
            senses.join(ta, tb, false);
        } else {
            let normal = |t: u32| {
                mesh.doubled_area(mesh.triangles[t as usize])
                    .normalize_or_zero()
            };
            against.push((normal(ta).dot(normal(tb)), ta, tb));
        }
    }
    if against.is_empty() {
        return None;
    }
    // Turned against each other, flat ones have opposite normals.
    against.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut torn = Vec::new();
    for (_, a, b) in against {
        if !senses.join(a, b, true) {
            torn.push([a as usize, b as usize]);
        }
    }
    if !torn.is_empty() {
        return Some(torn);
    }
    let own: Vec<(u32, bool)> = (0..count as u32).map(|t| senses.root(t)).collect();
    let mut votes = vec![0_i64; count];
    for &(root, is_turned) in &own {
        votes[root as usize] += if is_turned { 1 } else { -1 };
    }
    for (triangle, &(root, is_turned)) in mesh.triangles.iter_mut().zip(&own) {
        if is_turned != (votes[root as usize] > 0) {
            triangle.swap(1, 2);
            done.turned += 1;
        }
    }
    None
}
