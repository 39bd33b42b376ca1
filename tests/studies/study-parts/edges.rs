//! Edges of a model where two surfaces meet, against the true edges.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use reconstruct::model::{EdgeKind, Model, Surface};

use crate::grid::Matched;
use crate::part::TrueEdge;
use crate::truth_grid::TruthGrid;

/// A true edge counts where both faces are seen so near.
const SEEN_MM: f64 = 1.0;
/// A model's edge stands for a true one that is so near.
const NEAR_MM: f64 = 0.5;
/// Surfaces meet where they are no farther apart than this.
pub(crate) const MEETS_MM: f64 = 0.01;
/// Points to a piece of an edge's path.
const PER_PIECE: usize = 16;

/// Lengths of true edges between faces that are seen, and what stands for them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Edges {
    pub(crate) true_mm: f64,
    /// A crease of the model between the two faces' regions is near.
    pub(crate) near_mm: f64,
    /// And the two surfaces meet in it.
    pub(crate) met_mm: f64,
    /// Of these, squared distances times lengths.
    pub(crate) squares_mm3: f64,
}

impl Edges {
    pub(crate) fn join(&mut self, other: &Self) {
        self.true_mm += other.true_mm;
        self.near_mm += other.near_mm;
        self.met_mm += other.met_mm;
        self.squares_mm3 += other.squares_mm3;
    }

    pub(crate) fn rms_mm(&self) -> f64 {
        (self.squares_mm3 / self.met_mm).sqrt()
    }
}

/// A point of a crease, and how far apart the surfaces are there.
type CreasePoint = (Vector3<f64>, f64);

/// Lengths of sharp true edges, and of those where faces join smoothly.
pub(crate) fn compare(
    edges: &[TrueEdge],
    model: &Model,
    truth: &TruthGrid,
    matched: &Matched,
) -> (Edges, Edges) {
    let creases = creases(model, matched);
    let (mut sharp, mut smooth) = (Edges::default(), Edges::default());
    for edge in edges {
        let told = if edge.is_smooth {
            &mut smooth
        } else {
            &mut sharp
        };
        let own = creases.get(&edge.faces).map_or(&[][..], Vec::as_slice);
        for pair in edge.points_mm.windows(2) {
            let (a, b) = (Vector3::from(pair[0]), Vector3::from(pair[1]));
            let (middle, length_mm) = ((a + b) / 2.0, (b - a).norm());
            if !truth.sees_both(edge.faces, middle.into(), SEEN_MM) {
                continue;
            }
            told.true_mm += length_mm;
            let Some((distance_mm, gap_mm)) = nearest(own, &middle) else {
                continue;
            };
            if distance_mm <= NEAR_MM {
                told.near_mm += length_mm;
                if gap_mm <= MEETS_MM {
                    told.met_mm += length_mm;
                    told.squares_mm3 += length_mm * distance_mm * distance_mm;
                }
            }
        }
    }
    (sharp, smooth)
}

/// Distance from the nearest of the polylines, and the gap there.
fn nearest(creases: &[Vec<CreasePoint>], point: &Vector3<f64>) -> Option<(f64, f64)> {
    let sections = creases.iter().flat_map(|crease| crease.windows(2));
    let each = sections.map(|section| {
        let ((a, gap_a), (b, gap_b)) = (section[0], section[1]);
        let along = b - a;
        let squared = along.norm_squared();
        let share = if squared > 0.0 {
            ((point - a).dot(&along) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        ((a + along * share - point).norm(), gap_a.max(gap_b))
    });
    each.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Edges between two faces on which these do not meet, for who looks for the cause.
pub(crate) fn apart(model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    for (index, edge) in model.edges.iter().enumerate() {
        let users = model.faces.iter().filter(|face| {
            let loops = core::iter::once(&face.outer).chain(&face.inner);
            let mut coedges = loops.flat_map(|l| &l.coedges);
            coedges.any(|coedge| coedge.edge.0 == index)
        });
        let [first, second] = users.collect::<Vec<_>>()[..] else {
            continue;
        };
        let points = edge.path.sampled(PER_PIECE);
        let gaps = points.iter().map(|&[x, y]| {
            let z = [first, second].map(|face| {
                let Surface::Patches(surface) = &face.surface;
                surface.z(x, y)
            });
            (z[0] - z[1]).abs()
        });
        let gaps: Vec<f64> = gaps.collect();
        let apart = gaps.iter().filter(|gap| **gap > MEETS_MM).count();
        if 10 * apart > gaps.len() {
            let [x, y] = points[points.len() / 2];
            let (from, to) = edge.path.domain();
            found.push(format!(
                "edge of regions {} and {}, {:.1} mm about ({x:.1}, {y:.1}): {:?}, {:?}, {:.3} mm apart \
                 in the mean, {:.3} mm at most",
                first.region,
                second.region,
                to - from,
                edge.kind,
                edge.origin,
                gaps.iter().sum::<f64>() / gaps.len() as f64,
                gaps.iter().copied().fold(0.0, f64::max),
            ));
        }
    }
    found
}

/// The creases of a model by the true faces that their regions stand for.
fn creases(model: &Model, matched: &Matched) -> BTreeMap<[usize; 2], Vec<Vec<CreasePoint>>> {
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); model.edges.len()];
    for (index, face) in model.faces.iter().enumerate() {
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        for coedge in loops.flat_map(|l| &l.coedges) {
            if let Some(users) = users.get_mut(coedge.edge.0) {
                users.push(index);
            }
        }
    }
    let mut found: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for (edge, users) in model.edges.iter().zip(&users) {
        let (EdgeKind::Crease, &[first, second]) = (edge.kind, users.as_slice()) else {
            continue;
        };
        let faces = [&model.faces[first], &model.faces[second]];
        let real = faces.map(|face| matched.face_of_region.get(&face.region).copied());
        let [Some(a), Some(b)] = real else { continue };
        let points = edge.path.sampled(PER_PIECE).into_iter().map(|[x, y]| {
            let z = faces.map(|face| {
                let Surface::Patches(surface) = &face.surface;
                surface.z(x, y)
            });
            let at = Vector3::new(x, y, (z[0] + z[1]) / 2.0);
            (at, (z[0] - z[1]).abs())
        });
        let own = found.entry([a.min(b), a.max(b)]).or_default();
        own.push(points.collect());
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trims::tests::square;
    use crate::truth_grid::tests::step;
    use nurbs::PiecewiseCubic;
    use reconstruct::model::{Edge, EdgeId, VertexId};

    /// Two level faces with a crease along x = `x`, one `gap` above the other.
    fn model(x: f64, gap: f64) -> Model {
        let mut faces = vec![
            square(1, [-10.0, 0.0], 10.0, None, 0.0),
            square(2, [10.0, 0.0], 10.0, None, gap),
        ];
        // The first side of either is the shared one.
        for face in &mut faces {
            face.outer.coedges[0].edge = EdgeId(0);
            for (k, coedge) in face.outer.coedges.iter_mut().enumerate().skip(1) {
                coedge.edge = EdgeId(usize::from(face.region) * 10 + k);
            }
        }
        Model {
            vertices: Vec::new(),
            edges: vec![Edge {
                start: VertexId(0),
                end: VertexId(1),
                kind: EdgeKind::Crease,
                origin: reconstruct::EdgeOrigin::Intersected,
                path: PiecewiseCubic::line([x, -10.0], [x, 10.0], 20.0).unwrap(),
            }],
            faces,
        }
    }

    fn told(x: f64, gap: f64) -> (Edges, Edges) {
        let (_, truth) = step(0.0);
        let edge = |is_smooth| TrueEdge {
            faces: [0, 1],
            is_smooth,
            points_mm: (0..=20)
                .map(|k| [0.0, f64::from(k) * 0.5 - 5.0, 0.0])
                .collect(),
        };
        let matched = Matched {
            face_of_region: [(1, 0), (2, 1)].into(),
            found_faces: vec![0, 1],
        };
        compare(&[edge(false)], &model(x, gap), &truth, &matched)
    }

    #[test]
    fn a_crease_is_as_far_off_as_it_was_moved() {
        let (sharp, smooth) = told(0.03, 0.0);
        assert!((sharp.true_mm - 10.0).abs() < 1e-9);
        assert!((sharp.met_mm - 10.0).abs() < 1e-9);
        assert!((sharp.rms_mm() - 0.03).abs() < 1e-9);
        assert_eq!(smooth, Edges::default());
        assert_eq!(told(0.7, 0.0).0.near_mm, 0.0);
    }

    #[test]
    fn where_surfaces_do_not_meet_nothing_is_intersected() {
        let (sharp, _) = told(0.0, 0.05);
        assert!((sharp.near_mm - 10.0).abs() < 1e-9);
        assert_eq!(sharp.met_mm, 0.0);
    }
}
