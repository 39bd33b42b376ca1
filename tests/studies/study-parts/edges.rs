//! Edges of the STEP file that two faces share, against the true edges.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use cad_exchange::step;
use nalgebra::Vector3;
use reconstruct::model::{Face, Model, Surface};

use crate::bound::Known;
use crate::grid::Matched;
use crate::part::TrueEdge;
use crate::truth_grid::TruthGrid;

/// A true edge counts where both faces are seen so near.
const SEEN_MM: f64 = 1.0;
/// A model's edge stands for a true one that is so near.
const NEAR_MM: f64 = 0.5;
/// Surfaces meet where they are no farther apart than this.
pub(crate) const MEETS_MM: f64 = 0.01;
/// Points to a piece of an edge.
const PER_PIECE: usize = 16;
/// A section that leads on beyond a free end by more than this, of its distance, is not beside it.
const BEYOND: f64 = 0.5;

/// Lengths of true edges between faces that are seen, and what stands for them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Edges {
    pub(crate) true_mm: f64,
    /// An edge that the two faces' regions share is near.
    pub(crate) near_mm: f64,
    /// And the two surfaces meet in it.
    pub(crate) met_mm: f64,
    /// Of these, squared distances times lengths.
    pub(crate) squares_mm3: f64,
    /// The same of the least distances that readings of the two faces allow, were the edge where two
    /// surfaces meet that know nothing of each other. Of smooth edges it says nothing.
    pub(crate) bound_mm3: f64,
}

impl Edges {
    pub(crate) fn join(&mut self, other: &Self) {
        self.true_mm += other.true_mm;
        self.near_mm += other.near_mm;
        self.met_mm += other.met_mm;
        self.squares_mm3 += other.squares_mm3;
        self.bound_mm3 += other.bound_mm3;
    }

    pub(crate) fn rms_mm(&self) -> f64 {
        (self.squares_mm3 / self.met_mm).sqrt()
    }

    pub(crate) fn bound_mm(&self) -> f64 {
        (self.bound_mm3 / self.met_mm).sqrt()
    }
}

/// Of true faces, those that can be told by numbers, as well as readings let them be known.
pub(crate) type KnownFaces = BTreeMap<usize, Known>;

/// The variance of where the faces meet, square millimetres: a free form is taken to be known, and
/// no more than that of what is spread evenly as far as an edge counts.
fn bound_mm2(known: &KnownFaces, faces: [usize; 2], at: &Vector3<f64>) -> f64 {
    let [a, b] = faces.map(|face| known.get(&face));
    let variance = |face: Option<&Known>| face.map_or(0.0, |face| face.deviation_mm(at).powi(2));
    let both = variance(a) + variance(b);
    let most = NEAR_MM * NEAR_MM / 3.0;
    match (a, b) {
        (Some(a), Some(b)) => {
            let cross = a.normal(at).cross(&b.normal(at));
            (both / cross.norm_squared()).min(most)
        }
        // At what angle is not known, and a right one is the best.
        _ => both.min(most),
    }
}

/// A point of a shared edge, and how far the two surfaces are off it, taken together.
type CreasePoint = (Vector3<f64>, f64);
/// Polylines of the edges that two true faces' regions share.
type Creases = BTreeMap<[usize; 2], Vec<Vec<CreasePoint>>>;

/// Lengths of sharp true edges, and of those where faces join smoothly.
pub(crate) fn compare(
    edges: &[TrueEdge],
    model: &Model,
    truth: &TruthGrid,
    matched: &Matched,
    known: &KnownFaces,
) -> Result<(Edges, Edges)> {
    Ok(lengths(edges, &creases(model, matched)?, truth, known))
}

fn lengths(
    edges: &[TrueEdge],
    creases: &Creases,
    truth: &TruthGrid,
    known: &KnownFaces,
) -> (Edges, Edges) {
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
                    told.bound_mm3 += length_mm * bound_mm2(known, edge.faces, &middle);
                }
            }
        }
    }
    (sharp, smooth)
}

/// Distance from the nearest of the polylines, and the gap there; `None` where the nearest place is an
/// end, and the way there leads along the edge: that does not reach so far.
fn nearest(creases: &[Vec<CreasePoint>], point: &Vector3<f64>) -> Option<(f64, f64)> {
    let sections = creases.iter().flat_map(|crease| {
        let last = crease.len().saturating_sub(2);
        let of = crease.windows(2).enumerate();
        of.map(move |(k, pair)| (pair, [k == 0, k == last]))
    });
    let each = sections.map(|(section, is_end)| {
        let ((a, gap_a), (b, gap_b)) = (section[0], section[1]);
        let along = b - a;
        let squared = along.norm_squared();
        let share = if squared > 0.0 {
            (point - a).dot(&along) / squared
        } else {
            0.0
        };
        let way = a + along * share.clamp(0.0, 1.0) - point;
        let is_beyond = (is_end[0] && share < 0.0) || (is_end[1] && share > 1.0);
        let beyond = way.dot(&along).abs() / squared.sqrt().max(f64::MIN_POSITIVE);
        let is_beside = !is_beyond || beyond <= BEYOND * way.norm();
        (way.norm(), is_beside.then_some(gap_a.max(gap_b)))
    });
    let (distance_mm, gap_mm) = each.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((distance_mm, gap_mm?))
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

/// The edges that two faces of the written file share, by the true faces that their regions stand for.
fn creases(model: &Model, matched: &Matched) -> Result<Creases> {
    let mut file = Vec::new();
    let options = step::WriteOptions::new("part", "2026-01-01T00:00:00");
    step::write(model, &options, &mut file).context("no STEP file of it can be written")?;
    let read = step::read_model(&file[..]).context("its STEP file cannot be read")?;
    let by_name: BTreeMap<&str, &Face> = model.faces.iter().map(|f| (&*f.name, f)).collect();
    let mut users: Vec<Vec<&Face>> = vec![Vec::new(); read.edges.len()];
    for face in &read.faces {
        let of = by_name.get(&*face.name).context("a face has no name")?;
        for border in core::iter::once(&face.outer).chain(&face.inner).flatten() {
            users[border.edge].push(of);
        }
    }
    let mut found = Creases::new();
    for (edge, users) in read.edges.iter().zip(&users) {
        let &[first, second] = users.as_slice() else {
            continue;
        };
        // A face that closes on itself has its seam twice.
        let faces = [first, second];
        let real = faces.map(|face| matched.face_of_region.get(&face.region).copied());
        let ([Some(a), Some(b)], false) = (real, first.name == second.name) else {
            continue;
        };
        let breaks = edge.curve.knots().breaks();
        let mut points = Vec::new();
        for (k, ends) in breaks.windows(2).enumerate() {
            let at = |n: usize| ends[0] + (ends[1] - ends[0]) * n as f64 / PER_PIECE as f64;
            points.extend((usize::from(k > 0)..=PER_PIECE).map(|n| {
                let at = Vector3::from(edge.curve.evaluate(at(n)));
                (at, faces.iter().map(|face| off(face, &at)).sum::<f64>())
            }));
        }
        let own = found.entry([a.min(b), a.max(b)]).or_default();
        own.push(points);
    }
    Ok(found)
}

/// How far a place is off the surface of a face, millimetres.
fn off(face: &Face, at: &Vector3<f64>) -> f64 {
    if let Some(form) = &face.form {
        return form.distance_mm(at).abs();
    }
    let Surface::Patches(surface) = &face.surface;
    let [_, _, facing] = surface.normal(at.x, at.y);
    ((at.z - surface.z(at.x, at.y)) * facing).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bound::Reading;
    use crate::surface::tests::surface;
    use crate::truth_grid::tests::step;
    use nurbs::{PatchSurface, PiecewiseCubic};
    use reconstruct::model::{Coedge, Edge, EdgeId, EdgeKind, Loop, Vertex, VertexId};
    use shapes::Family;

    /// Two level faces with a crease along x = `x`, one `gap` above the other.
    fn model(x: f64, gap: f64) -> Model {
        let places = [
            [-20.0, -10.0],
            [x, -10.0],
            [x, 10.0],
            [-20.0, 10.0],
            [20.0, -10.0],
            [20.0, 10.0],
        ];
        // The first is the shared one.
        let ends = [[1, 2], [0, 1], [2, 3], [3, 0], [1, 4], [4, 5], [5, 2]];
        let line = |[from, to]: [usize; 2]| {
            let (p, q): ([f64; 2], [f64; 2]) = (places[from], places[to]);
            let length = (q[0] - p[0]).abs() + (q[1] - p[1]).abs();
            PiecewiseCubic::line(p, q, length).unwrap()
        };
        let edge = |(k, ends): (usize, [usize; 2])| Edge {
            start: VertexId(ends[0]),
            end: VertexId(ends[1]),
            kind: if k == 0 {
                EdgeKind::Crease
            } else {
                EdgeKind::Silhouette
            },
            origin: reconstruct::EdgeOrigin::Intersected,
            path: line(ends),
        };
        let face = |region: u16, uses: [(usize, bool); 4], z: f64| {
            let coedge = |(edge, reversed): (usize, bool)| {
                let path = line(ends[edge]);
                let parameter_curve = if reversed { path.reversed() } else { path };
                let up = |piece: &[[f64; 4]; 2]| [piece[0], piece[1], [z, 0.0, 0.0, 0.0]];
                let pieces = parameter_curve.pieces.iter().map(up).collect();
                Coedge {
                    edge: EdgeId(edge),
                    reversed,
                    space_curve: PiecewiseCubic::new(parameter_curve.breaks.clone(), pieces)
                        .unwrap(),
                    parameter_curve,
                }
            };
            let side = vec![-30.0, 30.0];
            let surface = PatchSurface::through_thirds(side.clone(), side, |_, _| z).unwrap();
            Face {
                name: format!("R{region}"),
                region,
                surface: Surface::Patches(surface),
                form: None,
                outer: Loop {
                    coedges: uses.map(coedge).to_vec(),
                },
                inner: Vec::new(),
            }
        };
        Model {
            vertices: places.map(|[x_mm, y_mm]| Vertex { x_mm, y_mm }).to_vec(),
            edges: ends.into_iter().enumerate().map(edge).collect(),
            faces: vec![
                face(1, [(1, false), (0, false), (2, false), (3, false)], 0.0),
                face(2, [(4, false), (5, false), (6, false), (0, true)], gap),
            ],
        }
    }

    /// A true edge along x = 0 from y = -5 to so far.
    fn told(x: f64, gap: f64, to: f64) -> (Edges, Edges) {
        let (_, truth) = step(0.0);
        let edge = TrueEdge {
            faces: [0, 1],
            is_smooth: false,
            points_mm: (0..=100)
                .map(|k| [0.0, -5.0 + (to + 5.0) * f64::from(k) / 100.0, 0.0])
                .collect(),
        };
        let matched = Matched {
            face_of_region: [(1, 0), (2, 1)].into(),
            found_faces: vec![0, 1],
        };
        compare(
            &[edge],
            &model(x, gap),
            &truth,
            &matched,
            &KnownFaces::new(),
        )
        .unwrap()
    }

    #[test]
    fn a_crease_is_as_far_off_as_it_was_moved() {
        let (sharp, smooth) = told(0.03, 0.0, 5.0);
        assert!((sharp.true_mm - 10.0).abs() < 1e-9);
        assert!((sharp.met_mm - 10.0).abs() < 1e-9);
        assert!((sharp.rms_mm() - 0.03).abs() < 1e-9);
        assert_eq!(smooth, Edges::default());
        assert_eq!(told(0.7, 0.0, 5.0).0.near_mm, 0.0);
    }

    #[test]
    fn the_smaller_the_angle_the_less_is_known_of_where_planes_meet() {
        let plane = |lean: f64| {
            let mut plane = surface(Family::Plane);
            plane.direction = Vector3::new(lean, 0.0, 1.0).normalize();
            let readings: Vec<Reading> = (-10..=10)
                .flat_map(|x| (-10..=10).map(move |y| (f64::from(x), f64::from(y))))
                .map(|(x, y)| {
                    let point_mm = Vector3::new(x, y, -lean * x);
                    Reading {
                        point_mm,
                        told_mm: point_mm,
                        ray: -plane.direction,
                        deviation_mm: 0.05,
                    }
                })
                .collect();
            Known::of(&plane, &readings).unwrap()
        };
        let bound_mm = |lean: f64| {
            let known = [(3, plane(0.0)), (8, plane(lean))].into();
            bound_mm2(&known, [3, 8], &Vector3::zeros()).sqrt()
        };
        let each_mm = 0.05 / 21.0;
        let sin = |lean: f64| lean / (1.0 + lean * lean).sqrt();
        for lean in [0.03, 0.4, 2.0] {
            let exact = each_mm * 2.0_f64.sqrt() / sin(lean);
            assert!((bound_mm(lean) / exact - 1.0).abs() < 1e-3, "{lean}");
        }
        assert!((bound_mm(1e-5) - NEAR_MM / 3.0_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn where_surfaces_do_not_meet_nothing_is_intersected() {
        let (sharp, _) = told(0.0, 0.05, 5.0);
        assert!((sharp.near_mm - 10.0).abs() < 1e-9);
        assert_eq!(sharp.met_mm, 0.0);
    }

    #[test]
    fn beyond_its_end_an_edge_is_not_near() {
        let crease = |x: f64| -> Vec<CreasePoint> {
            let at = |k: u32| (Vector3::new(x, f64::from(k), 0.0), 0.0);
            (0..=3).map(at).collect()
        };
        let near = |x: f64, y: f64| nearest(&[crease(0.1)], &Vector3::new(x, y, 0.0));
        let (distance_mm, _) = near(0.0, 1.5).unwrap();
        assert!((distance_mm - 0.1).abs() < 1e-12);
        assert_eq!(near(0.0, 3.2), None);
        assert_eq!(near(0.0, -0.2), None);
        // Hardly beyond it, but aside.
        let (distance_mm, _) = near(0.0, 3.01).unwrap();
        assert!((0.1..0.102).contains(&distance_mm));
        assert_eq!(nearest(&[], &Vector3::zeros()), None);
    }
}
