//! Which loops are holes, which are borders of open sheets, and which are of islands in holes.

use glam::DVec3;

use crate::mesh::{Stars, TriangleMesh};

/// What a loop is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HoleKind {
    /// A hole.
    Hole,
    /// The outer border of an open sheet.
    Border,
    /// The border of an island in the hole of this number.
    Island(usize),
}

/// A loop of border edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Hole {
    /// From 1, in the order of the lowest vertices.
    pub number: usize,
    /// What it is.
    pub kind: HoleKind,
    /// Vertices in the order in which triangles that close it run along it.
    pub vertices: Vec<u32>,
    /// Length of the loop, millimetres.
    pub length_mm: f64,
    /// Twice the distance of its farthest vertex from its centre, millimetres.
    pub size_mm: f64,
    /// Mean of its edges' middles, by their lengths.
    pub centre_mm: DVec3,
    /// Mean unit normal of the triangles beside it.
    pub normal: DVec3,
    /// Which connected part of the mesh it is of, from 0.
    pub component: usize,
}

/// A loop is a border where the surface beside it does not lead into it: what it encloses as the
/// surface goes on there, over the area that it spans, is 1 for a hole in a plane, the cosine of its
/// angle for one in a sphere, 0 for the end of a pipe or the rim of a hemisphere, and -1 for the
/// border of a flat sheet.
const LEADS_IN: f64 = 0.3;
/// A border is not much smaller than its part of the mesh is across.
const BORDER_SHARE: f64 = 0.05;
/// Where the surface leads straight on, the ends of pipes are borders and the stumps of limbs are holes:
/// these span less than this, of the area of their part of the mesh.
const STUMP: f64 = 0.02;

/// Sine of the largest angle at which a gap between an island and the hole around it may rise.
const LEVEL: f64 = 0.75;

/// Connected parts: for each vertex its part; how far each is across, and its area.
struct Parts {
    of_vertex: Vec<u32>,
    across_mm: Vec<f64>,
    area_mm2: Vec<f64>,
}

fn parts(mesh: &TriangleMesh) -> Parts {
    let mut parent: Vec<u32> = (0..mesh.vertices_mm.len() as u32).collect();
    fn root(parent: &mut [u32], mut k: u32) -> u32 {
        while parent[k as usize] != k {
            parent[k as usize] = parent[parent[k as usize] as usize];
            k = parent[k as usize];
        }
        k
    }
    for &[a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (own, other) = (root(&mut parent, a), root(&mut parent, other));
            let (low, high) = (own.min(other), own.max(other));
            parent[high as usize] = low;
        }
    }
    let mut number = vec![u32::MAX; parent.len()];
    let mut boxes: Vec<[DVec3; 2]> = Vec::new();
    let mut of_vertex = vec![u32::MAX; parent.len()];
    for v in 0..parent.len() as u32 {
        let own = root(&mut parent, v) as usize;
        if number[own] == u32::MAX {
            number[own] = boxes.len() as u32;
            boxes.push([DVec3::INFINITY, DVec3::NEG_INFINITY]);
        }
        of_vertex[v as usize] = number[own];
        let at = mesh.place(v);
        let own = &mut boxes[number[own] as usize];
        *own = [own[0].min(at), own[1].max(at)];
    }
    let mut area_mm2 = vec![0.0; boxes.len()];
    for &own in &mesh.triangles {
        area_mm2[of_vertex[own[0] as usize] as usize] += 0.5 * mesh.doubled_area(own).length();
    }
    Parts {
        of_vertex,
        area_mm2,
        across_mm: boxes
            .iter()
            .map(|[low, high]| low.distance(*high))
            .collect(),
    }
}

/// The loops with what is known of them.
pub(crate) fn holes(mesh: &TriangleMesh, loops: Vec<Vec<u32>>, stars: &Stars) -> Vec<Hole> {
    let parts = parts(mesh);
    let mut holes: Vec<Hole> = loops
        .into_iter()
        .enumerate()
        .map(|(k, vertices)| measured(mesh, stars, &parts, k + 1, vertices))
        .collect();
    tell_borders(mesh, stars, &parts, &mut holes);
    tell_islands(mesh, stars, &mut holes);
    holes
}

fn measured(
    mesh: &TriangleMesh,
    stars: &Stars,
    parts: &Parts,
    number: usize,
    vertices: Vec<u32>,
) -> Hole {
    let (mut length_mm, mut sum, mut normal) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for (k, &own) in vertices.iter().enumerate() {
        let next = vertices[(k + 1) % vertices.len()];
        let (a, b) = (mesh.place(own), mesh.place(next));
        let length = a.distance(b);
        length_mm += length;
        sum += 0.5 * length * (a + b);
        normal += length * stars.beside(mesh, next, own).normalize_or_zero();
    }
    let centre_mm = if length_mm > 0.0 {
        sum / length_mm
    } else {
        mesh.place(vertices[0])
    };
    let far = vertices
        .iter()
        .map(|&v| mesh.place(v).distance(centre_mm))
        .fold(0.0, f64::max);
    Hole {
        number,
        kind: HoleKind::Hole,
        component: parts.of_vertex[vertices[0] as usize] as usize,
        vertices,
        length_mm,
        size_mm: 2.0 * far,
        centre_mm,
        normal: normal.normalize_or_zero(),
    }
}

fn across(mesh: &TriangleMesh, vertices: &[u32]) -> f64 {
    let mut own = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for &v in vertices {
        own = [own[0].min(mesh.place(v)), own[1].max(mesh.place(v))];
    }
    own[0].distance(own[1])
}

/// How far the surface beside a loop leads into it, as [`LEADS_IN`] has it, and the area that it spans.
fn leads_in(mesh: &TriangleMesh, stars: &Stars, hole: &Hole) -> (f64, f64) {
    let (mut flux, mut area) = (0.0, DVec3::ZERO);
    for (k, &own) in hole.vertices.iter().enumerate() {
        let next = hole.vertices[(k + 1) % hole.vertices.len()];
        let (a, b) = (mesh.place(own), mesh.place(next));
        let normal = stars.beside(mesh, next, own).normalize_or_zero();
        // As long as the edge, along the surface and away from the triangle.
        let inward = normal.cross(b - a);
        flux += 0.5 * inward.dot(hole.centre_mm - 0.5 * (a + b));
        area += 0.5 * (a - hole.centre_mm).cross(b - hole.centre_mm);
    }
    let area = area.length();
    (if area > 0.0 { flux / area } else { 1.0 }, area)
}

fn tell_borders(mesh: &TriangleMesh, stars: &Stars, parts: &Parts, holes: &mut [Hole]) {
    for hole in holes {
        let is_large =
            across(mesh, &hole.vertices) >= BORDER_SHARE * parts.across_mm[hole.component];
        let (leads_in, area) = leads_in(mesh, stars, hole);
        let is_stump = leads_in > -LEADS_IN && area < STUMP * parts.area_mm2[hole.component];
        if is_large && leads_in < LEADS_IN && !is_stump {
            hole.kind = HoleKind::Border;
        }
    }
}

/// A border that lies within a hole of another part is that of an island: as the hole's mean plane sees
/// it, or, where the hole bends around too much for that, as the island's border does.
fn tell_islands(mesh: &TriangleMesh, stars: &Stars, holes: &mut [Hole]) {
    let mut found = Vec::new();
    for (k, island) in holes.iter().enumerate() {
        if island.kind != HoleKind::Border {
            continue;
        }
        let around = holes.iter().filter(|hole| {
            hole.kind == HoleKind::Hole
                && hole.component != island.component
                && hole.size_mm > island.size_mm
                && encloses(mesh, hole, island)
        });
        let nearest = around.min_by(|a, b| a.size_mm.total_cmp(&b.size_mm));
        let number = match nearest {
            Some(hole) => Some(hole.number),
            None => surrounding(mesh, stars, holes, island),
        };
        found.extend(number.map(|own| (k, own)));
    }
    for (k, number) in found {
        holes[k].kind = HoleKind::Island(number);
    }
}

/// A place on a loop, the normal of the triangles beside it, and where they lead from it into the loop.
struct Rim {
    at: DVec3,
    normal: DVec3,
    inward: DVec3,
}

fn rims(mesh: &TriangleMesh, stars: &Stars, hole: &Hole) -> Vec<Rim> {
    let count = hole.vertices.len();
    let rim = |k: usize| {
        let [before, own, next] = [count - 1, 0, 1].map(|j| hole.vertices[(k + j) % count]);
        let beside = |from, to| stars.beside(mesh, to, from).normalize_or_zero();
        let normal = (beside(before, own) + beside(own, next)).normalize_or_zero();
        let along = mesh.place(next) - mesh.place(before);
        Rim {
            at: mesh.place(own),
            normal,
            inward: normal.cross(along).normalize_or_zero(),
        }
    };
    (0..count).map(rim).collect()
}

/// The hole of another part whose rim is the nearest to all of an island's border, and which most of that
/// border faces across the gap: both lead into it, and neither lies above the other.
fn surrounding(mesh: &TriangleMesh, stars: &Stars, holes: &[Hole], island: &Hole) -> Option<usize> {
    let around: Vec<(usize, Rim)> = holes
        .iter()
        .filter(|hole| {
            hole.kind == HoleKind::Hole
                && hole.component != island.component
                && hole.size_mm > island.size_mm
                && hole.centre_mm.distance(island.centre_mm) < hole.size_mm
        })
        .flat_map(|hole| {
            rims(mesh, stars, hole)
                .into_iter()
                .map(|own| (hole.number, own))
        })
        .collect();
    let border = rims(mesh, stars, island);
    let (mut number, mut facing) = (None, 0);
    for own in &border {
        let apart = |other: &&(usize, Rim)| other.1.at.distance_squared(own.at);
        let (hole, rim) = around.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        if number.is_some_and(|known| known != *hole) {
            return None;
        }
        number = Some(*hole);
        let gap = (rim.at - own.at).normalize_or_zero();
        let is_level = gap.dot(own.normal).abs().max(gap.dot(rim.normal).abs()) < LEVEL;
        let leads = own.inward.dot(gap) > 0.0 && rim.inward.dot(gap) < 0.0;
        facing += usize::from(is_level && leads && own.normal.dot(rim.normal) > 0.0);
    }
    (facing * 3 > border.len() * 2).then_some(number).flatten()
}

/// Whether a loop lies within another, seen along its normal, and not far off its mean plane.
fn encloses(mesh: &TriangleMesh, hole: &Hole, inner: &Hole) -> bool {
    let far = inner.centre_mm.distance(hole.centre_mm);
    if far > 0.5 * hole.size_mm || hole.normal == DVec3::ZERO {
        return false;
    }
    let (u, v) = hole.normal.any_orthonormal_pair();
    let flat = |own: u32| {
        let arm = mesh.place(own) - hole.centre_mm;
        [arm.dot(u), arm.dot(v), arm.dot(hole.normal)]
    };
    let polygon: Vec<[f64; 3]> = hole.vertices.iter().map(|&own| flat(own)).collect();
    let is_within = |[x, y, z]: [f64; 3]| {
        let mut is_in = false;
        for (k, a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            if (a[1] > y) != (b[1] > y) {
                let at = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                is_in ^= at > x;
            }
        }
        is_in && z.abs() <= 0.5 * hole.size_mm
    };
    inner.vertices.iter().all(|&own| is_within(flat(own)))
}
