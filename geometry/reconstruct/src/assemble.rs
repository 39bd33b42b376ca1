//! From the planar map and the surfaces to the model.

use nurbs::{PatchSurface, PiecewiseCubic};
use range_image::RangeImage;
use shapes::Form;

use crate::border::cracks::{Chain, CrackMap};
use crate::border::map::{MapEdge, PlanarMap};
use crate::border::path::polyline;
use crate::fit::Domain;
use crate::lift::lift;
use crate::model::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};
use crate::polygon::{dot, minus, norm};

/// Places along an edge at which its two surfaces are compared.
const PROBES: usize = 15;

/// Surfaces that differ by less than this many standard deviations of their residuals
/// may be continuous.
pub(crate) const STEP_SIGMAS: f64 = 4.0;

/// Distance inside its face at which a surface is compared, pitches.
const INSIDE: f64 = 1.5;

/// Difference of slopes granted to surfaces that seem to have none.
const LEAST_BEND: f64 = 0.1;

/// Margin of a surface around its face, pitches.
const MARGIN: f64 = 1.0;

/// Maps pitches, counted from the image's first node, to the part frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement {
    pub(crate) origin_mm: [f64; 2],
    pub(crate) pitch_mm: f64,
}

impl Placement {
    pub(crate) fn of(image: &RangeImage) -> Self {
        Self {
            origin_mm: [image.x_mm(0), image.y_mm(0)],
            pitch_mm: image.pitch_mm(),
        }
    }

    pub(crate) fn to_mm(self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|d| self.origin_mm[d] + self.pitch_mm * p[d])
    }

    pub(crate) fn to_pitches(self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|d| (p[d] - self.origin_mm[d]) / self.pitch_mm)
    }

    fn path_to_mm(self, path: &PiecewiseCubic<2>) -> PiecewiseCubic<2> {
        let h = self.pitch_mm;
        PiecewiseCubic {
            breaks: path.breaks.iter().map(|b| b * h).collect(),
            pieces: path
                .pieces
                .iter()
                .map(|piece| {
                    [0, 1].map(|d| {
                        let c = piece[d];
                        [self.origin_mm[d] + h * c[0], c[1], c[2] / h, c[3] / (h * h)]
                    })
                })
                .collect(),
        }
    }
}

/// The rectangle of the x-y plane that each piece's surface must cover: its outline and
/// a margin. `None` for a piece without a closed outline.
pub(crate) fn domains(map: &PlanarMap, placement: Placement) -> Vec<Option<Domain>> {
    map.loops
        .iter()
        .map(|loops| {
            let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            for &(edge, _) in loops.first()? {
                for p in map.edges[edge].path.sampled(16) {
                    for d in 0..2 {
                        low[d] = low[d].min(p[d] - MARGIN);
                        high[d] = high[d].max(p[d] + MARGIN);
                    }
                }
            }
            let (low, high) = (placement.to_mm(low), placement.to_mm(high));
            let finite = low.iter().chain(&high).all(|v| v.is_finite());
            finite.then_some(Domain {
                x_mm: (low[0], high[0]),
                y_mm: (low[1], high[1]),
            })
        })
        .collect()
}

/// What a face is made of.
pub(crate) struct Carrier {
    pub(crate) region: u16,
    pub(crate) name: String,
    pub(crate) surface: PatchSurface,
    /// What the surface is, where that is known.
    pub(crate) form: Option<Form>,
    /// Root mean square residual, millimetres.
    pub(crate) rms_mm: f64,
}

/// What the edges of a map are; `carriers[k]` belongs to piece `k + 1`.
pub(crate) fn kinds(map: &PlanarMap, carriers: &[Carrier], placement: Placement) -> Vec<EdgeKind> {
    let side = |s: u32| carriers.get((s as usize).wrapping_sub(1));
    let kind = |edge: &MapEdge| match (side(edge.sides[0]), side(edge.sides[1])) {
        (Some(a), Some(b)) => {
            let path = placement.path_to_mm(&edge.path);
            let sides = [a, b].map(|carrier| (&carrier.surface, carrier.rms_mm));
            kind_between(sides, &path, placement.pitch_mm)
        }
        _ => EdgeKind::Silhouette,
    };
    map.edges.iter().map(kind).collect()
}

/// Which of the traced borders are steps between two surfaces; `sides[k]` belongs to piece
/// `k + 1`, as [`kind_between`] has them. Those in `placed` are creases.
pub(crate) fn steps(
    cracks: &CrackMap,
    placed: &[Option<Vec<[f64; 2]>>],
    sides: &[(&PatchSurface, f64)],
    placement: Placement,
) -> Vec<bool> {
    let side = |piece: u32| sides.get((piece as usize).checked_sub(1)?).copied();
    let is_step = |chain: &Chain| {
        let sides = [side(chain.left)?, side(chain.right)?];
        let path = placement.path_to_mm(&polyline(&chain.middles)?);
        Some(kind_between(sides, &path, placement.pitch_mm) == EdgeKind::Step)
    };
    let chains = cracks.chains.iter().zip(placed);
    chains
        .map(|(chain, placed)| placed.is_none() && is_step(chain) == Some(true))
        .collect()
}

/// Joins the map and the surfaces; `carriers[k]` belongs to piece `k + 1`, and `kinds` and
/// `origins` to the map's edges.
pub(crate) fn model(
    map: &PlanarMap,
    carriers: Vec<Carrier>,
    (kinds, origins): (&[EdgeKind], &[EdgeOrigin]),
    placement: Placement,
) -> Model {
    let vertices: Vec<Vertex> = map
        .vertices
        .iter()
        .map(|&v| {
            let [x_mm, y_mm] = placement.to_mm(v);
            Vertex { x_mm, y_mm }
        })
        .collect();
    let edges: Vec<Edge> = map
        .edges
        .iter()
        .zip(kinds.iter().zip(origins))
        .map(|(edge, (&kind, &origin))| {
            let mut path = placement.path_to_mm(&edge.path);
            let start = vertices[edge.start];
            path.pieces[0][0][0] = start.x_mm;
            path.pieces[0][1][0] = start.y_mm;
            Edge {
                start: VertexId(edge.start),
                end: VertexId(edge.end),
                kind,
                origin,
                path,
            }
        })
        .collect();
    let mut faces = Vec::with_capacity(carriers.len());
    for (carrier, loops) in carriers.into_iter().zip(&map.loops) {
        let mut lifted = loops.iter().map(|uses| Loop {
            coedges: uses
                .iter()
                .map(|&(edge, reversed)| {
                    let path = &edges[edge].path;
                    let mut parameter_curve = if reversed {
                        path.reversed()
                    } else {
                        path.clone()
                    };
                    let end = if reversed {
                        edges[edge].end
                    } else {
                        edges[edge].start
                    };
                    let start = vertices[end.0];
                    parameter_curve.pieces[0][0][0] = start.x_mm;
                    parameter_curve.pieces[0][1][0] = start.y_mm;
                    let space_curve = lift(&carrier.surface, &parameter_curve);
                    Coedge {
                        edge: EdgeId(edge),
                        reversed,
                        parameter_curve,
                        space_curve,
                    }
                })
                .collect(),
        });
        if let Some(outer) = lifted.next() {
            let inner = lifted.collect();
            faces.push(Face {
                name: carrier.name,
                region: carrier.region,
                surface: Surface::Patches(carrier.surface),
                form: carrier.form,
                outer,
                inner,
            });
        }
    }
    Model {
        vertices,
        edges,
        faces,
    }
}

/// A step where the two surfaces part by more than their residuals explain, and more
/// than a border off by a pitch would make of their different slopes. Each surface is
/// judged on the border, and a little inside its own face, where its data are, and carried on
/// from there; what is nearer counts.
///
/// `sides` are the surfaces on the left and on the right, with the root mean squares of their
/// residuals in millimetres.
fn kind_between(
    sides: [(&PatchSurface, f64); 2],
    path: &PiecewiseCubic<2>,
    pitch_mm: f64,
) -> EdgeKind {
    let (first, last) = path.domain();
    let (mut gaps, mut bends) = (Vec::new(), Vec::new());
    for k in 0..PROBES {
        let t = first + (last - first) * (k as f64 + 0.5) / PROBES as f64;
        let (at, along) = (path.evaluate(t), path.derivative(t, 1));
        let length = norm(along).max(1e-9);
        let inward = INSIDE * pitch_mm / length;
        let step = [-along[1] * inward, along[0] * inward];
        let seen = |surface: &PatchSurface, side: f64| {
            let (x, y) = (at[0] + side * step[0], at[1] + side * step[1]);
            let slope = [surface.z_partial(x, y, 1, 0), surface.z_partial(x, y, 0, 1)];
            (surface.z(x, y) - side * dot(slope, step), slope)
        };
        let ((z_left, left), (z_right, right)) = (seen(sides[0].0, 1.0), seen(sides[1].0, -1.0));
        let carried = z_left - z_right;
        let [x, y] = at;
        let there = sides[0].0.z(x, y) - sides[1].0.z(x, y);
        gaps.push(if there.abs() < carried.abs() {
            there
        } else {
            carried
        });
        bends.push(norm(minus(left, right)));
    }
    let noise = STEP_SIGMAS * norm(sides.map(|side| side.1));
    let explained = noise + pitch_mm * (median(&mut bends) + LEAST_BEND);
    if median(&mut gaps).abs() > explained {
        EdgeKind::Step
    } else {
        EdgeKind::Crease
    }
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meeting::testing::{PLACEMENT, graph, plane};

    #[test]
    fn steps_are_borders_where_z_jumps() {
        let chain = |left: u32, right: u32| Chain {
            left,
            right,
            middles: (0..20).map(|k| [f64::from(k), 20.5]).collect(),
            ends: Some((0, 1)),
        };
        let cracks = CrackMap {
            chains: vec![chain(1, 2), chain(2, 1), chain(1, 3), chain(1, 0)],
            ..CrackMap::default()
        };
        // The first is 5 mm above the second all along, and meets the third on the border.
        let surfaces = [
            plane(5.0, 0.0, 0.1),
            plane(0.0, 0.0, 0.1),
            plane(5.0, 0.0, 0.5),
        ];
        let placed = vec![None; 4];
        let found = |rms_mm: f64| {
            let sides: Vec<_> = surfaces.iter().map(|s| (s, rms_mm)).collect();
            steps(&cracks, &placed, &sides, PLACEMENT)
        };
        assert_eq!(found(0.02), [true, true, false, false]);
        // What the residuals explain is none.
        assert_eq!(found(2.0), [false; 4]);
        // By the letter of the paper there are no surfaces yet.
        assert_eq!(steps(&cracks, &placed, &[], PLACEMENT), [false; 4]);
    }

    /// A rounding goes over into a fillet where both are steep, along y = 0: a little inside their
    /// faces they part from their tangents by far more than a step has.
    #[test]
    fn steep_surfaces_that_touch_have_no_step_between_them() {
        let arc = |y: f64| 2.5 * y - 1.2 * y * y.abs();
        let (left, right) = (
            graph(1.5, |_, y| if y > -2.0 { arc(y.min(2.0)) } else { -9.8 }),
            graph(1.5, |_, y| arc(y.clamp(-2.0, 2.0)) + 0.04),
        );
        let path = polyline(&[[-5.0, 0.0], [5.0, 0.0]]).unwrap();
        let kind = |lift_mm: f64| {
            let mut right = right.clone();
            right
                .patches
                .iter_mut()
                .for_each(|patch| patch[0][0] += lift_mm);
            kind_between([(&left, 0.01), (&right, 0.01)], &path, 0.5)
        };
        assert_eq!(kind(0.0), EdgeKind::Crease);
        assert_eq!(kind(2.0), EdgeKind::Step);
    }
}
