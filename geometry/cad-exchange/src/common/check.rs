//! What a model must be so that its file opens cleanly; checked before a byte is written.

use std::collections::BTreeSet;

use nurbs::{PatchSurface, PiecewiseCubic};
use reconstruct::model::SPACE_CURVE_TOLERANCE_MM;
use reconstruct::{Coedge, Face, Loop, Model, Surface, VertexId};

use super::defect::{Defect, FaceDefect};

/// Gaps up to this many times the resolution are written, with the file's resolution
/// raised to the largest of them; a larger one is a defect of the model.
const GAP_LIMIT_FACTOR: f64 = 10.0;

/// Checks every face and returns the largest gap between things that should meet,
/// millimetres.
pub(crate) fn check(model: &Model, resolution_mm: f64) -> Result<f64, Defect> {
    if model.faces.is_empty() {
        return Err(Defect::NoFaces);
    }
    let limit = GAP_LIMIT_FACTOR * resolution_mm.max(SPACE_CURVE_TOLERANCE_MM);
    let mut names = BTreeSet::new();
    let mut gaps = Gaps {
        largest: 0.0,
        limit,
    };
    for face in &model.faces {
        if !names.insert(face.name.as_str()) {
            return Err(Defect::DuplicateName {
                name: face.name.clone(),
            });
        }
        check_face(model, face, &mut gaps).map_err(|defect| Defect::Face {
            face: face.name.clone(),
            defect,
        })?;
    }
    Ok(gaps.largest)
}

/// The largest gap so far and the size at which one becomes a defect.
struct Gaps {
    largest: f64,
    limit: f64,
}

impl Gaps {
    /// Notes a gap; true when it is too large or beyond all numbers.
    fn too_large(&mut self, gap_mm: f64) -> bool {
        self.largest = self.largest.max(gap_mm);
        gap_mm.is_nan() || gap_mm > self.limit
    }
}

/// The largest of some gaps; unlike `f64::max`, it does not lose what is not a number.
pub(crate) fn largest(gaps: impl IntoIterator<Item = f64>) -> f64 {
    let worse = |worst: f64, gap: f64| {
        if gap.is_nan() || gap > worst {
            gap
        } else {
            worst
        }
    };
    gaps.into_iter().fold(0.0, worse)
}

fn check_face(model: &Model, face: &Face, gaps: &mut Gaps) -> Result<(), FaceDefect> {
    if face.name.trim().is_empty() {
        return Err(FaceDefect::NoName);
    }
    let Surface::Patches(surface) = &face.surface;
    check_surface(surface, gaps)?;
    check_loop(model, surface, &face.outer, "the outer loop", gaps)?;
    if enclosed_area(&face.outer) <= 0.0 {
        return Err(FaceDefect::WrongSense {
            place: "the outer loop".to_owned(),
            expected: "counter-clockwise",
        });
    }
    for (index, inner) in face.inner.iter().enumerate() {
        let place = format!("inner loop {}", index + 1);
        check_loop(model, surface, inner, &place, gaps)?;
        if enclosed_area(inner) >= 0.0 {
            return Err(FaceDefect::WrongSense {
                place,
                expected: "clockwise",
            });
        }
    }
    Ok(())
}

fn check_surface(surface: &PatchSurface, gaps: &mut Gaps) -> Result<(), FaceDefect> {
    let place = "its surface";
    surface.validate().map_err(|source| FaceDefect::Malformed {
        place: place.to_owned(),
        source,
    })?;
    let (columns, rows) = (surface.u_breaks.len() - 1, surface.v_breaks.len() - 1);
    let width = |breaks: &[f64], k: usize| breaks[k + 1] - breaks[k];
    for i in 0..columns {
        for j in 0..rows {
            let index = i * rows + j;
            let (du, dv) = (width(&surface.u_breaks, i), width(&surface.v_breaks, j));
            let corners = [[0.0, 0.0], [du, 0.0], [0.0, dv], [du, dv]];
            if !corners
                .iter()
                .all(|c| patch_z(&surface.patches[index], c[0], c[1]).is_finite())
            {
                return Err(FaceDefect::Overflow {
                    place: format!("patch {index} of {place}"),
                });
            }
            // Cubics that agree at four places agree everywhere between them.
            let mut gap = |other: usize, own: [f64; 2], its: [f64; 2], along: [f64; 2]| {
                let gap_mm = largest((0..4).map(|k| {
                    let f = f64::from(k) / 3.0;
                    let at = |p: [f64; 2], c: &[[f64; 4]; 4]| {
                        patch_z(c, p[0] + f * along[0], p[1] + f * along[1])
                    };
                    (at(own, &surface.patches[index]) - at(its, &surface.patches[other])).abs()
                }));
                if gaps.too_large(gap_mm) {
                    return Err(FaceDefect::Torn {
                        place: place.to_owned(),
                        piece: index,
                        neighbour: other,
                        gap_mm,
                    });
                }
                Ok(())
            };
            if i + 1 < columns {
                gap(index + rows, [du, 0.0], [0.0, 0.0], [0.0, dv])?;
            }
            if j + 1 < rows {
                gap(index + 1, [0.0, dv], [0.0, 0.0], [du, 0.0])?;
            }
        }
    }
    Ok(())
}

fn patch_z(patch: &[[f64; 4]; 4], s: f64, t: f64) -> f64 {
    let horner = |c: &[f64; 4], x: f64| c[0] + x * (c[1] + x * (c[2] + x * c[3]));
    horner(&patch.map(|row| horner(&row, s)), t)
}

fn check_loop(
    model: &Model,
    surface: &PatchSurface,
    border: &Loop,
    place: &str,
    gaps: &mut Gaps,
) -> Result<(), FaceDefect> {
    let count = border.coedges.len();
    if count == 0 {
        return Err(FaceDefect::EmptyLoop {
            place: place.to_owned(),
        });
    }
    for (index, coedge) in border.coedges.iter().enumerate() {
        let number = index + 1;
        check_curve(&coedge.parameter_curve, gaps, || {
            format!("the parameter curve of edge {number} of {place}")
        })?;
        check_curve(&coedge.space_curve, gaps, || {
            format!("the space curve of edge {number} of {place}")
        })?;
        check_on_surface(surface, coedge, gaps, || {
            format!("edge {number} of {place}")
        })?;
    }
    for (index, coedge) in border.coedges.iter().enumerate() {
        let next = &border.coedges[(index + 1) % count];
        let here = || format!("edge {} of {place}", index + 1);
        let (_, end) = ends(model, coedge).ok_or_else(|| FaceDefect::Dangling { place: here() })?;
        let (start, _) = ends(model, next).ok_or_else(|| FaceDefect::Dangling { place: here() })?;
        if end != start {
            return Err(FaceDefect::OpenLoop {
                place: here(),
                gap_mm: f64::INFINITY,
            });
        }
        let flat = distance(&coedge.parameter_curve.end(), &next.parameter_curve.start());
        let spatial = distance(&coedge.space_curve.end(), &next.space_curve.start());
        for (gap_mm, curve) in [(flat, "the parameter curve"), (spatial, "the space curve")] {
            if gaps.too_large(gap_mm) {
                return Err(FaceDefect::OpenLoop {
                    place: format!("{curve} of {}", here()),
                    gap_mm,
                });
            }
        }
    }
    Ok(())
}

/// The vertices of a coedge in the sense of travel; `None` where the model lacks them.
fn ends(model: &Model, coedge: &Coedge) -> Option<(VertexId, VertexId)> {
    let edge = model.edges.get(coedge.edge.0)?;
    model.vertices.get(edge.start.0)?;
    model.vertices.get(edge.end.0)?;
    Some(if coedge.reversed {
        (edge.end, edge.start)
    } else {
        (edge.start, edge.end)
    })
}

fn check_curve<const D: usize>(
    curve: &PiecewiseCubic<D>,
    gaps: &mut Gaps,
    place: impl Fn() -> String,
) -> Result<(), FaceDefect> {
    curve.validate().map_err(|source| FaceDefect::Malformed {
        place: place(),
        source,
    })?;
    for piece in 1..curve.pieces.len() {
        let width = curve.breaks[piece] - curve.breaks[piece - 1];
        let gap_mm = distance(
            &curve.piece_value(piece - 1, width, 0),
            &curve.piece_value(piece, 0.0, 0),
        );
        if gaps.too_large(gap_mm) {
            return Err(FaceDefect::Torn {
                place: place(),
                piece: piece - 1,
                neighbour: piece,
                gap_mm,
            });
        }
    }
    Ok(())
}

/// The two curves of a coedge have the same ends, and both lie on the surface.
fn check_on_surface(
    surface: &PatchSurface,
    coedge: &Coedge,
    gaps: &mut Gaps,
    place: impl Fn() -> String,
) -> Result<(), FaceDefect> {
    let flat = coedge.parameter_curve.sampled(2);
    let (u, v) = (surface.u_domain(), surface.v_domain());
    for p in &flat {
        let gap_mm = largest([u.0 - p[0], p[0] - u.1, v.0 - p[1], p[1] - v.1]);
        if gaps.too_large(gap_mm) {
            return Err(FaceDefect::OutsideRectangle {
                place: format!("the parameter curve of {}", place()),
                gap_mm,
            });
        }
    }
    let spatial = coedge.space_curve.sampled(2);
    let off = spatial.iter().map(|p| (surface.z(p[0], p[1]) - p[2]).abs());
    let apart = [
        (flat.first(), spatial.first()),
        (flat.last(), spatial.last()),
    ]
    .into_iter()
    .map(|pair| match pair {
        (Some(a), Some(b)) => distance(&surface.evaluate(a[0], a[1]), b),
        _ => 0.0,
    });
    let gap_mm = largest(off.chain(apart));
    if gaps.too_large(gap_mm) {
        return Err(FaceDefect::OffSurface {
            place: format!("the space curve of {}", place()),
            gap_mm,
        });
    }
    Ok(())
}

fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

/// Area that a loop encloses in the parameter plane, positive when it runs
/// counter-clockwise: the integral of u dv, exact for cubics.
fn enclosed_area(border: &Loop) -> f64 {
    let Some(first) = border.coedges.first() else {
        return 0.0;
    };
    let origin = first.parameter_curve.start()[0];
    let mut area = 0.0;
    for coedge in &border.coedges {
        let curve = &coedge.parameter_curve;
        for (k, [u, v]) in curve.pieces.iter().enumerate() {
            let width = curve.breaks[k + 1] - curve.breaks[k];
            let mut shifted = *u;
            shifted[0] -= origin;
            for (i, a) in shifted.iter().enumerate() {
                let mut power = (0..=i).fold(1.0, |p, _| p * width);
                for (j, b) in v.iter().enumerate().skip(1) {
                    area += a * b * j as f64 / (i + j) as f64 * power;
                    power *= width;
                }
            }
        }
    }
    area
}
