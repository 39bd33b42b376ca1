//! Elements inside a trimmed surface, made in its parameter plane.

use glam::DVec3;
use spade::{
    AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation,
};

use super::base::{Base, Unseen};
use super::trim::Trim;

/// Area of an equilateral triangle with edges of 1.
const EQUILATERAL: f64 = 0.433_012_701_892_219_3;
/// Largest area of an element, of that of one with edges as long as those of the loop.
const LARGEST: f64 = 1.3;
const LEAST_ANGLE_DEG: f64 = 25.0;
const MOST_ELEMENTS: usize = 2_000_000;

/// New vertices, and triangles over the loops' vertices first, in order, then those.
pub(crate) fn elements(
    base: &Base,
    trim: &Trim,
    edge_mm: f64,
) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), Unseen> {
    let failed = |_| Unseen::NoElements;
    let mut net: ConstrainedDelaunayTriangulation<Point2<f64>> =
        ConstrainedDelaunayTriangulation::new();
    let mut handles = Vec::new();
    for own in &trim.loops {
        let mut ring = Vec::with_capacity(own.len());
        for &[u, v] in own {
            ring.push(net.insert(Point2::new(u, v)).map_err(failed)?);
        }
        for (k, &from) in ring.iter().enumerate() {
            let to = ring[(k + 1) % ring.len()];
            if from == to || !net.can_add_constraint(from, to) {
                return Err(Unseen::Crossed);
            }
            net.add_constraint(from, to);
        }
        handles.extend(ring);
    }
    let parameters = RefinementParameters::<f64>::new()
        .exclude_outer_faces(true)
        .keep_constraint_edges()
        .with_angle_limit(AngleLimit::from_deg(LEAST_ANGLE_DEG))
        .with_max_allowed_area(LARGEST * EQUILATERAL * edge_mm * edge_mm)
        .with_min_required_area(0.1 * EQUILATERAL * edge_mm * edge_mm)
        .with_max_additional_vertices(MOST_ELEMENTS);
    let refined = net.refine(parameters);
    let outside: std::collections::HashSet<usize> = refined
        .excluded_faces
        .iter()
        .map(|face| face.index())
        .collect();
    let mut number = vec![u32::MAX; net.num_vertices()];
    for (k, handle) in handles.iter().enumerate() {
        if number[handle.index()] != u32::MAX {
            return Err(Unseen::Crossed);
        }
        number[handle.index()] = k as u32;
    }
    let mut places = Vec::new();
    for vertex in net.vertices() {
        let own = &mut number[vertex.fix().index()];
        if *own == u32::MAX {
            *own = (handles.len() + places.len()) as u32;
            let at = vertex.position();
            places.push(DVec3::from_array(base.surface.evaluate(at.x, at.y)));
        }
    }
    let triangles: Vec<[u32; 3]> = net
        .inner_faces()
        .filter(|face| !outside.contains(&face.fix().index()))
        .map(|face| face.vertices().map(|v| number[v.fix().index()]))
        .collect();
    if triangles.is_empty() {
        return Err(Unseen::NoElements);
    }
    Ok((places, triangles))
}
