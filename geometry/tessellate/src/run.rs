//! All stages in order.

use std::collections::{BTreeMap, BTreeSet};

use nurbs::PatchSurface;
use range_image::{Cancelled, Monitor};
use rayon::prelude::*;
use reconstruct::{Face, Model, Surface};
use shapes::Form;

use crate::divide::Division;
use crate::error::TessellateError;
use crate::face::{Trouble, fill};
use crate::mesh::{Accuracy, Corner, Mesh, MeshFace};
use crate::outline::{Outline, loops};
use crate::refine::{MOST, Patch, Stop};
use crate::settings::TessellateSettings;
use crate::sew::{Sewn, sew};

/// Times that sides in each other's way are halved: from a millimetre to half a micrometre.
const ROUNDS: usize = 11;

/// Triangles of a model's faces.
///
/// The same model and settings give the same triangles, whatever the threads of the caller's
/// pool. Triangles lie on the faces' own surfaces to the tolerance, but for the points of a
/// crease, which lie half way between those of its two faces ([`Accuracy`]).
///
/// # Errors
/// [`TessellateError`].
pub fn tessellate(
    model: &Model,
    settings: &TessellateSettings,
    monitor: &dyn Monitor,
) -> Result<Mesh, TessellateError> {
    settings.validate()?;
    if model.faces.is_empty() {
        return Err(TessellateError::NoFaces);
    }
    for face in &model.faces {
        check(model, face)?;
    }
    monitor.check()?;
    let mut divisions = divisions(model, settings);
    monitor.progress(0.1);
    let filled = fill_all(model, &mut divisions, monitor)?;
    monitor.progress(0.3);

    let outlines: Vec<Outline> = filled.iter().map(|face| face.outline.clone()).collect();
    let height = |(face, outline): (&Face, &Outline)| {
        let surface = patches(face);
        let z = |p: &[f64; 2]| surface.z(p[0], p[1]);
        outline.places.iter().map(z).collect()
    };
    let heights: Vec<Vec<f64>> = model.faces.iter().zip(&outlines).map(height).collect();
    let sewn = sew(model, &outlines, &heights, settings.sharing_mm);

    let refined: Vec<Result<Patch<'_>, TessellateError>> = (0..model.faces.len())
        .into_par_iter()
        .map(|k| {
            let face = &model.faces[k];
            let Filled { outline, triangles } = &filled[k];
            let numbers = sewn.numbers[k].iter();
            let points = numbers.map(|&n| sewn.points[n as usize]).collect();
            let side =
                |ends: [usize; 2]| [ends[0].min(ends[1]) as u32, ends[0].max(ends[1]) as u32];
            let border: BTreeSet<[u32; 2]> = outline.sides.iter().map(|s| side(s.ends)).collect();
            let surface = patches(face);
            let mut patch = Patch::new(points, triangles.clone(), &border, surface, settings);
            patch.refine(monitor).map_err(|stop| match stop {
                Stop::Cancelled => Cancelled.into(),
                Stop::TooMany => TessellateError::TooMany {
                    face: face.name.clone(),
                    most: MOST,
                },
            })?;
            Ok(patch)
        })
        .collect();
    let refined: Vec<Patch<'_>> = refined.into_iter().collect::<Result<_, _>>()?;
    monitor.progress(1.0);
    Ok(assemble(model, sewn, &refined))
}

/// What the other stages rest on.
fn check(model: &Model, face: &Face) -> Result<(), TessellateError> {
    let malformed = |reason| TessellateError::Malformed {
        face: face.name.clone(),
        reason,
    };
    if patches(face).validate().is_err() {
        return Err(malformed(
            "its surface has counts or numbers that make none",
        ));
    }
    for coedge in loops(face).flat_map(|border| &border.coedges) {
        let edge = model.edges.get(coedge.edge.0);
        let edge =
            edge.ok_or_else(|| malformed("its border names an edge that the model lacks"))?;
        if edge.path.validate().is_err() {
            return Err(malformed("an edge of it has numbers that make no path"));
        }
    }
    Ok(())
}

fn patches(face: &Face) -> &PatchSurface {
    let Surface::Patches(patches) = &face.surface;
    patches
}

/// Every edge divided for the faces that it bounds.
fn divisions(model: &Model, settings: &TessellateSettings) -> Vec<Division> {
    let mut surfaces: BTreeMap<usize, Vec<&PatchSurface>> = BTreeMap::new();
    for face in &model.faces {
        for coedge in loops(face).flat_map(|border| &border.coedges) {
            surfaces
                .entry(coedge.edge.0)
                .or_default()
                .push(patches(face));
        }
    }
    (0..model.edges.len())
        .into_par_iter()
        .map(|edge| {
            let surfaces = surfaces.get(&edge).map_or(&[][..], Vec::as_slice);
            let path = &model.edges[edge].path;
            // What bounds no face is not looked at again.
            if path.validate().is_err() {
                return Division::default();
            }
            Division::of(path, surfaces, settings)
        })
        .collect()
}

/// A face's border, and triangles between its points.
struct Filled {
    outline: Outline,
    triangles: Vec<[u32; 3]>,
}

/// Index of a face, its border, and the triangles that fill it, if they do.
type Attempt = (usize, Outline, Result<Vec<[u32; 3]>, Trouble>);

/// Fills all borders. Sides that are in each other's way, as those of a strip thinner than the
/// tolerance, are halved in all faces that have them until they are not.
fn fill_all(
    model: &Model,
    divisions: &mut [Division],
    monitor: &dyn Monitor,
) -> Result<Vec<Filled>, TessellateError> {
    let mut filled: Vec<Option<Filled>> = model.faces.iter().map(|_| None).collect();
    for round in 0..=ROUNDS {
        monitor.check()?;
        let open: Vec<usize> = (0..filled.len()).filter(|&k| filled[k].is_none()).collect();
        let tried: Vec<Attempt> = open
            .into_par_iter()
            .map(|k| {
                let outline = Outline::of(model, &model.faces[k], divisions);
                match outline {
                    Ok(outline) => {
                        let triangles = fill(&outline);
                        (k, outline, triangles)
                    }
                    Err(reason) => (k, Outline::default(), Err(Trouble::Broken(reason))),
                }
            })
            .collect();
        let mut blocked: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut trouble = None;
        for (k, outline, triangles) in tried {
            let face = || model.faces[k].name.clone();
            match triangles {
                Ok(triangles) => filled[k] = Some(Filled { outline, triangles }),
                Err(Trouble::Broken(reason)) => {
                    return Err(TessellateError::Malformed {
                        face: face(),
                        reason,
                    });
                }
                Err(Trouble::Sides(sides)) => {
                    let first = outline.sides.iter().find(|side| sides.contains(&side.of));
                    let at_mm = first.map_or([f64::NAN; 2], |side| outline.places[side.ends[0]]);
                    trouble.get_or_insert(TessellateError::Crossing {
                        face: face(),
                        at_mm,
                    });
                    for (edge, side) in sides {
                        blocked.entry(edge).or_default().insert(side);
                    }
                }
            }
        }
        let Some(trouble) = trouble else {
            break;
        };
        let mut is_finer = false;
        for (&edge, sides) in &blocked {
            let sides: Vec<usize> = sides.iter().copied().collect();
            is_finer |= divisions[edge].halve(&sides);
        }
        if round == ROUNDS || !is_finer {
            return Err(trouble);
        }
        for (face, filled) in model.faces.iter().zip(&mut filled) {
            let mut coedges = loops(face).flat_map(|border| &border.coedges);
            if coedges.any(|coedge| blocked.contains_key(&coedge.edge.0)) {
                *filled = None;
            }
        }
    }
    // The loop ends with all of them, or with an error.
    Ok(filled.into_iter().flatten().collect())
}

fn assemble(model: &Model, sewn: Sewn, refined: &[Patch<'_>]) -> Mesh {
    let mut mesh = Mesh {
        vertices_mm: sewn.points,
        accuracy: Accuracy {
            surface_mm: 0.0,
            seam_mm: sewn.off_mm,
        },
        ..Mesh::default()
    };
    for ((face, patch), numbers) in model.faces.iter().zip(refined).zip(sewn.numbers) {
        let off_mm = patch.deviation_mm();
        mesh.accuracy.surface_mm = mesh.accuracy.surface_mm.max(off_mm);
        let corners = patch.net.points.iter().zip(&patch.normals).enumerate();
        let corners = corners.map(|(k, (point, normal))| {
            let vertex = numbers.get(k).copied().unwrap_or_else(|| {
                mesh.vertices_mm.push(*point);
                mesh.vertices_mm.len() as u32 - 1
            });
            Corner {
                vertex,
                normal: *normal,
            }
        });
        let corners = corners.collect();
        mesh.faces.push(MeshFace {
            name: face.name.clone(),
            region: face.region,
            form: face.form.as_ref().map_or("free form", Form::as_str),
            corners,
            triangles: patch.net.triangles.clone(),
        });
    }
    mesh
}
