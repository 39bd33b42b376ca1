//! What is really there: for tests and for judging results, never for the code under test.
//!
//! Faces and outlines are known in closed form for an object that is one convex solid of
//! planes and a cylinder ([`faces`]). For any object, [`SampleTruth`] tells what each sample
//! saw and [`GraphNode`] what stands at a place of the grid, labelled by face (on a mesh: by
//! group of neighbouring coplanar triangles).

mod outline;

use thiserror::Error;

use crate::Vec3;
use crate::noise::Kind;
use crate::optics::Optics;
use crate::scanner::Scanner;
use crate::scene::{Body, FaceId, Surface};

/// What lies behind one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleTruth {
    /// The face that the spot's light comes from; `None` where the sensor sees no light.
    pub face: Option<FaceId>,
    /// The surface point that stands for the spot, millimetres.
    pub point_mm: Option<Vec3>,
    /// The distance along the beam's axis without noise or mixing, millimetres.
    pub range_mm: Option<f64>,
    /// Cosine of the angle of incidence.
    pub incidence_cos: Option<f64>,
    /// What became of it; `None` for a lost sample.
    pub kind: Option<Kind>,
}

/// The object at a place of the grid, as a graph z(x, y): the highest point, met by a line
/// parallel to z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraphNode {
    /// Height, millimetres.
    pub z_mm: f64,
    /// Unit normal there, out of the body.
    pub normal: Vec3,
    /// The face met.
    pub face: FaceId,
    /// Whether light comes back from that point: laser and sensor both see it along their
    /// perspective rays, and the beam does not graze it.
    pub seen: bool,
}

/// Why there is no closed form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum TruthError {
    /// The object is not one convex solid.
    #[error("the visible outlines are known for an object of one convex solid only")]
    NotConvex,
    /// A face of a kind that is not traced.
    #[error("face {0} is not a plane between planes, a disc, or the side of a right cylinder")]
    Surface(usize),
    /// Light comes back from a part of a plane only.
    #[error("the laser grazes face {0} so that light comes back from a part of it only")]
    Grazed(usize),
}

/// A face of the object as far as light comes back from it: laser and sensor both see it,
/// and the beam does not graze it beyond the angle at which the scanner goes blind.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibleFace {
    /// Which face.
    pub id: FaceId,
    /// Its surface.
    pub surface: Surface,
    /// The border of the visible part, a closed polyline (the first point is not repeated),
    /// millimetres. Straight edges are exact; arcs are cut to chords whose sagitta is below
    /// 1 um on the built-in objects.
    pub outline_mm: Vec<Vec3>,
    /// The points where two edges of the outline meet at an angle.
    pub corners_mm: Vec<Vec3>,
    /// Area of the visible part on the surface itself, square millimetres.
    pub area_mm2: f64,
    flat: outline::Chart,
}

impl VisibleFace {
    /// Distance of a point from the unbounded surface, millimetres.
    #[must_use]
    pub fn surface_distance_mm(&self, point_mm: Vec3) -> f64 {
        self.surface.signed_distance_mm(point_mm).abs()
    }

    /// Distance of a point from the visible part of the face, millimetres.
    #[must_use]
    pub fn distance_mm(&self, point_mm: Vec3) -> f64 {
        if self.flat.covers(&self.outline_mm, point_mm) {
            self.surface_distance_mm(point_mm)
        } else {
            self.outline_distance_mm(point_mm)
        }
    }

    /// Distance of a point from the outline, millimetres.
    #[must_use]
    pub fn outline_distance_mm(&self, point_mm: Vec3) -> f64 {
        outline::edges(&self.outline_mm)
            .map(|(from, to)| outline::segment_distance(point_mm, from, to))
            .fold(f64::INFINITY, f64::min)
    }
}

/// The faces of the object that laser and sensor both see, in the order of the solid's faces.
///
/// # Errors
/// [`TruthError`] when the object has no closed form.
pub fn faces(scanner: &Scanner) -> Result<Vec<VisibleFace>, TruthError> {
    let scene = &scanner.scene;
    let (1, Some((Body::Solid(solid), _))) = (scene.object_bodies, scene.bodies.first()) else {
        return Err(TruthError::NotConvex);
    };
    outline::visible_faces(solid, &scanner.optics, scanner.noise.incidence_max_rad)
}

/// What stands at (x, y), if anything does.
#[must_use]
pub fn graph_node(scanner: &Scanner, x_mm: f64, y_mm: f64) -> Option<GraphNode> {
    let optics: &Optics = &scanner.optics;
    let above = Vec3::new(x_mm, y_mm, optics.camera_z_mm);
    let hit = scanner.scene.cast(above, Vec3::NEG_Z)?;
    if hit.face.body >= scanner.scene.object_bodies {
        return None;
    }
    let sees = |viewer| scanner.scene.sees(hit.point_mm, hit.normal, viewer);
    let beam = (optics.laser_mm(x_mm) - hit.point_mm).normalize_or_zero();
    let lit = hit.normal.dot(beam) > libm::cos(scanner.noise.incidence_max_rad);
    Some(GraphNode {
        z_mm: hit.point_mm.z,
        normal: hit.normal,
        face: hit.face,
        seen: lit && sees(optics.laser_mm(x_mm)) && sees(optics.sensor_mm(x_mm)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::{self, Overrides, Preset};
    use std::collections::BTreeMap;

    fn scanner(object: &str) -> Scanner {
        let scene = preset::object(object, Preset::Paper.material()).expect("built in");
        Preset::Paper
            .set_up(scene, &Overrides::default(), 1)
            .expect("it fits")
            .0
    }

    /// Nodes of a fine grid by what is seen there.
    fn counted(scanner: &Scanner, pitch_mm: f64) -> BTreeMap<Option<FaceId>, Vec<(Vec3, bool)>> {
        let mut nodes: BTreeMap<_, Vec<_>> = BTreeMap::new();
        let reach = (55.0 / pitch_mm) as i32;
        for i in -reach..=reach {
            for j in -reach..=reach {
                // Off the symmetric places, where a node may lie on an edge.
                let x = (f64::from(i) + 0.137) * pitch_mm;
                let y = (f64::from(j) + 0.291) * pitch_mm;
                let Some(node) = graph_node(scanner, x, y) else {
                    continue;
                };
                let point = Vec3::new(x, y, node.z_mm);
                nodes
                    .entry(Some(node.face))
                    .or_default()
                    .push((point, node.seen));
            }
        }
        nodes
    }

    #[test]
    fn the_house_shows_four_good_faces() {
        let scanner = scanner("house");
        let faces = faces(&scanner).expect("the house is convex");
        assert_eq!(faces.len(), 4);
        let nodes = counted(&scanner, 0.5);
        for face in &faces {
            let seen = nodes[&Some(face.id)]
                .iter()
                .filter(|(_, seen)| *seen)
                .count();
            assert_eq!(
                seen,
                nodes[&Some(face.id)].len(),
                "all of a face is lit and seen"
            );
        }
        let all: usize = nodes.values().map(Vec::len).sum();
        for face in &faces {
            let share = nodes[&Some(face.id)].len() as f64 / all as f64;
            assert!(share >= 0.08, "{:?} takes {share}", face.id);
        }
        for (a, one) in faces.iter().enumerate() {
            for other in &faces[a + 1..] {
                let shared = |p: &&Vec3| other.corners_mm.iter().any(|q| q.distance(**p) < 1e-9);
                if one.corners_mm.iter().filter(shared).count() < 2 {
                    continue;
                }
                let (Surface::Plane { normal: n, .. }, Surface::Plane { normal: m, .. }) =
                    (one.surface, other.surface)
                else {
                    panic!("the house has planes only");
                };
                assert!(libm::acos(n.dot(m)).to_degrees() >= 20.0);
            }
        }
        let (low, high) = scanner.scene.object_extent_mm();
        assert!(((high - low).max_element() - 100.0).abs() < 1e-9);
        assert!((high - low).min_element() > 80.0, "{:?}", high - low);
        assert!(low.z >= -50.0 - 1e-9 && high.z <= 50.0 + 1e-9);
    }

    #[test]
    fn no_edge_of_the_house_runs_along_the_grid() {
        for face in faces(&scanner("house")).expect("convex") {
            for (from, to) in outline::edges(&face.outline_mm) {
                let edge = to - from;
                let angle = libm::atan2(edge.y, edge.x).to_degrees();
                let off = (angle - 90.0 * libm::round(angle / 90.0)).abs();
                assert!(off >= 1.0, "an edge {off} degrees off an axis");
            }
        }
    }

    #[test]
    fn the_outlines_bound_what_the_grid_sees() {
        for object in ["house", "cylinder"] {
            let scanner = scanner(object);
            let faces = faces(&scanner).expect("convex");
            let nodes = counted(&scanner, 0.5);
            let mut seen = 0;
            for face in &faces {
                for (point, is_seen) in &nodes[&Some(face.id)] {
                    seen += usize::from(*is_seen);
                    let distance = face.distance_mm(*point);
                    // Inside the outline exactly where it is seen, but for the chords.
                    if *is_seen {
                        assert!(distance < 1e-3, "{object} {point} {distance}");
                    } else {
                        assert!(face.outline_distance_mm(*point) <= distance + 1e-3);
                    }
                }
            }
            let by_nodes: usize = nodes.values().flatten().filter(|(_, seen)| *seen).count();
            assert_eq!(
                seen, by_nodes,
                "{object}: what is seen lies on the visible faces"
            );
        }
    }

    #[test]
    fn areas_agree_with_the_count_of_nodes() {
        for object in ["house", "cylinder"] {
            let scanner = scanner(object);
            let pitch_mm = 0.25;
            let nodes = counted(&scanner, pitch_mm);
            for face in faces(&scanner).expect("convex") {
                // A node stands for its cell, which a slope stretches by 1 / n_z.
                let area: f64 = nodes[&Some(face.id)]
                    .iter()
                    .filter(|(_, seen)| *seen)
                    .map(|(p, _)| pitch_mm * pitch_mm / face.surface.normal_at(*p).z)
                    .filter(|cell| cell.is_finite())
                    .sum();
                let off = (area / face.area_mm2 - 1.0).abs();
                assert!(
                    off < 0.015,
                    "{object} {:?}: {area} {}",
                    face.id,
                    face.area_mm2
                );
            }
        }
    }

    #[test]
    fn the_cylinder_shows_its_top_and_its_side() {
        let faces = faces(&scanner("cylinder")).expect("convex");
        assert_eq!(faces.len(), 2);
        let (side, top) = (&faces[0], &faces[1]);
        let Surface::Cylinder { radius_mm, .. } = side.surface else {
            panic!("{:?}", side.surface);
        };
        let disc = core::f64::consts::PI * radius_mm * radius_mm;
        assert!((top.area_mm2 / disc - 1.0).abs() < 1e-5);
        assert_eq!(side.corners_mm.len(), 4);
        assert_eq!(top.corners_mm.len(), 2);
        for corner in &top.corners_mm {
            assert!(side.corners_mm.iter().any(|c| c.distance(*corner) < 1e-6));
        }
        for point in &side.outline_mm {
            assert!(side.surface_distance_mm(*point) < 1e-9);
        }
    }

    #[test]
    fn an_object_without_closed_form_says_so() {
        assert_eq!(faces(&scanner("figure")), Err(TruthError::NotConvex));
    }
}
