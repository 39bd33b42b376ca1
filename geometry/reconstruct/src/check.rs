//! Whether a model keeps what it promises: closed, simple, rightly turned loops that lie
//! on their surfaces, and edges used once from each side.

use nurbs::PiecewiseCubic;

use crate::border::crossing::{Strand, crossings};
use crate::model::{Face, Loop, Model, SPACE_CURVE_TOLERANCE_MM, Surface};
use crate::polygon::signed_area;

/// Gap that ends which should meet may leave, millimetres.
pub const CLOSURE_MM: f64 = 1e-9;

/// Samples of each piece of a curve.
const SAMPLES: usize = 12;

/// A broken promise. Faces and edges are given by index, loops with 0 for the outer one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A curve or surface has counts or numbers that make no sense.
    #[error("face {face}, loop {of_loop}, coedge {coedge}: {reason}")]
    Malformed {
        /// Index of the face.
        face: usize,
        /// Index of the loop.
        of_loop: usize,
        /// Index of the coedge.
        coedge: usize,
        /// What is wrong.
        reason: String,
    },
    /// A coedge does not end where the next begins.
    #[error("face {face}, loop {of_loop}: gap of {gap_mm} mm after coedge {coedge}")]
    Open {
        /// Index of the face.
        face: usize,
        /// Index of the loop.
        of_loop: usize,
        /// Index of the coedge.
        coedge: usize,
        /// Width of the gap, in the parameter plane or in space.
        gap_mm: f64,
    },
    /// A loop runs the wrong way round, or encloses nothing.
    #[error("face {face}, loop {of_loop}: signed area {area_mm2} mm2")]
    Orientation {
        /// Index of the face.
        face: usize,
        /// Index of the loop.
        of_loop: usize,
        /// Its signed area.
        area_mm2: f64,
    },
    /// A parameter curve leaves the rectangle of its surface.
    #[error("face {face}, loop {of_loop}, coedge {coedge}: leaves the surface's rectangle")]
    Outside {
        /// Index of the face.
        face: usize,
        /// Index of the loop.
        of_loop: usize,
        /// Index of the coedge.
        coedge: usize,
    },
    /// A space curve leaves its surface.
    #[error("face {face}, loop {of_loop}, coedge {coedge}: {off_mm} mm off its surface")]
    OffSurface {
        /// Index of the face.
        face: usize,
        /// Index of the loop.
        of_loop: usize,
        /// Index of the coedge.
        coedge: usize,
        /// Greatest distance found.
        off_mm: f64,
    },
    /// An inner loop is not inside the outer one, or inside another inner one.
    #[error("face {face}: inner loop {of_loop} is misplaced")]
    Misplaced {
        /// Index of the face.
        face: usize,
        /// Index of the loop.
        of_loop: usize,
    },
    /// Two edges cross or touch, or one crosses itself.
    #[error("edges {first} and {second} cross")]
    Crossing {
        /// Index of an edge.
        first: usize,
        /// Index of the other, or the same.
        second: usize,
    },
    /// An edge is used by no face, or from one side by more than one.
    #[error("edge {edge} is used {forward} times forward and {backward} times backward")]
    Usage {
        /// Index of the edge.
        edge: usize,
        /// Uses from start to end.
        forward: usize,
        /// Uses from end to start.
        backward: usize,
    },
}

/// Checks a whole model.
///
/// # Errors
/// Every broken promise found.
pub fn model(model: &Model) -> Result<(), Vec<Fault>> {
    let mut faults = Vec::new();
    let mut used = vec![[0_usize; 2]; model.edges.len()];
    for (k, face) in model.faces.iter().enumerate() {
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        for (n, of_loop) in loops.enumerate() {
            for (c, coedge) in of_loop.coedges.iter().enumerate() {
                match used.get_mut(coedge.edge.0) {
                    Some(sides) => sides[usize::from(coedge.reversed)] += 1,
                    None => faults.push(Fault::Malformed {
                        face: k,
                        of_loop: n,
                        coedge: c,
                        reason: format!("there is no edge {}", coedge.edge.0),
                    }),
                }
            }
            check_loop(model, face, of_loop, (k, n), &mut faults);
        }
        check_nesting(face, k, &mut faults);
    }
    for (edge, [forward, backward]) in used.into_iter().enumerate() {
        if forward > 1 || backward > 1 || forward + backward == 0 {
            faults.push(Fault::Usage {
                edge,
                forward,
                backward,
            });
        }
    }
    if faults.is_empty() {
        check_crossings(model, &mut faults);
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults)
    }
}

fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    a.iter()
        .zip(&b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

fn polygon(of_loop: &Loop) -> Vec<[f64; 2]> {
    of_loop
        .coedges
        .iter()
        .flat_map(|coedge| {
            let mut points = coedge.parameter_curve.sampled(SAMPLES);
            points.pop();
            points
        })
        .collect()
}

fn check_loop(
    model: &Model,
    face: &Face,
    of_loop: &Loop,
    (k, n): (usize, usize),
    faults: &mut Vec<Fault>,
) {
    let Surface::Patches(surface) = &face.surface;
    let malformed = |coedge, reason: String| Fault::Malformed {
        face: k,
        of_loop: n,
        coedge,
        reason,
    };
    if let Err(error) = surface.validate() {
        faults.push(malformed(0, format!("surface: {error}")));
        return;
    }
    if of_loop.coedges.is_empty() {
        faults.push(malformed(0, "the loop is empty".to_owned()));
        return;
    }
    for (c, coedge) in of_loop.coedges.iter().enumerate() {
        let valid = coedge
            .parameter_curve
            .validate()
            .and(coedge.space_curve.validate());
        if let Err(error) = valid {
            faults.push(malformed(c, error.to_string()));
            return;
        }
    }
    let ((u0, u1), (v0, v1)) = (surface.u_domain(), surface.v_domain());
    for (c, coedge) in of_loop.coedges.iter().enumerate() {
        let next = &of_loop.coedges[(c + 1) % of_loop.coedges.len()];
        let gap_mm = distance(coedge.parameter_curve.end(), next.parameter_curve.start())
            .max(distance(coedge.space_curve.end(), next.space_curve.start()));
        if gap_mm > CLOSURE_MM {
            faults.push(Fault::Open {
                face: k,
                of_loop: n,
                coedge: c,
                gap_mm,
            });
        }
        if let Some(edge) = model.edges.get(coedge.edge.0) {
            let (start, end) = if coedge.reversed {
                (edge.end, edge.start)
            } else {
                (edge.start, edge.end)
            };
            let at = |id: crate::VertexId| model.vertices.get(id.0).map(|v| [v.x_mm, v.y_mm]);
            let meets = |id, p| at(id).is_some_and(|v| distance(v, p) <= CLOSURE_MM);
            if !meets(start, coedge.parameter_curve.start())
                || !meets(end, coedge.parameter_curve.end())
            {
                faults.push(malformed(
                    c,
                    "it does not end in the edge's vertices".to_owned(),
                ));
            }
        }
        let inside = |p: &[f64; 2]| p[0] >= u0 && p[0] <= u1 && p[1] >= v0 && p[1] <= v1;
        if !coedge.parameter_curve.sampled(SAMPLES).iter().all(inside) {
            faults.push(Fault::Outside {
                face: k,
                of_loop: n,
                coedge: c,
            });
        }
        let off_mm = off_surface(&coedge.space_curve, &coedge.parameter_curve, surface);
        if off_mm > SPACE_CURVE_TOLERANCE_MM {
            faults.push(Fault::OffSurface {
                face: k,
                of_loop: n,
                coedge: c,
                off_mm,
            });
        }
    }
    let area_mm2 = signed_area(&polygon(of_loop));
    let right = if n == 0 {
        area_mm2 > 0.0
    } else {
        area_mm2 < 0.0
    };
    if !right {
        faults.push(Fault::Orientation {
            face: k,
            of_loop: n,
            area_mm2,
        });
    }
}

/// Greatest distance of a space curve from the composition of surface and parameter
/// curve at equal parameters.
fn off_surface(
    space: &PiecewiseCubic<3>,
    parameter: &PiecewiseCubic<2>,
    surface: &nurbs::PatchSurface,
) -> f64 {
    let mut off = 0.0_f64;
    for pair in space.breaks.windows(2) {
        for s in 0..=SAMPLES {
            let t = pair[0] + (pair[1] - pair[0]) * s as f64 / SAMPLES as f64;
            let [u, v] = parameter.evaluate(t);
            off = off.max(distance(space.evaluate(t), surface.evaluate(u, v)));
        }
    }
    off
}

fn check_nesting(face: &Face, k: usize, faults: &mut Vec<Fault>) {
    let outlines: Vec<Vec<[f64; 2]>> = core::iter::once(&face.outer)
        .chain(&face.inner)
        .map(polygon)
        .collect();
    for n in 1..outlines.len() {
        let Some(&point) = outlines[n].first() else {
            continue;
        };
        let within = |m: usize| m != n && contains(&outlines[m], point);
        if !contains(&outlines[0], point) || (1..outlines.len()).any(within) {
            faults.push(Fault::Misplaced {
                face: k,
                of_loop: n,
            });
        }
    }
}

fn contains(polygon: &[[f64; 2]], p: [f64; 2]) -> bool {
    let mut inside = false;
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        {
            inside = !inside;
        }
    }
    inside
}

fn check_crossings(model: &Model, faults: &mut Vec<Fault>) {
    // The search works in steps of about a pitch; the shortest pieces are near that.
    let total: f64 = model.edges.iter().map(|e| e.path.arc_length()).sum();
    let scale = total / 2000.0;
    if !(scale.is_finite() && scale > 0.0) {
        return;
    }
    let strands: Vec<Strand> = model
        .edges
        .iter()
        .enumerate()
        .filter_map(|(k, edge)| {
            let (a, b) = (
                model.vertices.get(edge.start.0)?,
                model.vertices.get(edge.end.0)?,
            );
            let (a, b) = ([a.x_mm, a.y_mm], [b.x_mm, b.y_mm]);
            Some(Strand::scaled(k, &edge.path, a, b, scale))
        })
        .collect();
    for (first, second) in crossings(&strands) {
        faults.push(Fault::Crossing { first, second });
    }
}
