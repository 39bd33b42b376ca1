//! Surfaces as CAD files: as they are in IGES; in STEP, which asks for borders, as rectangular faces
//! on bicubic patches, one for each span, which are the same surface.

use std::io::Write;

use cad_exchange::iges;
use jiff::Timestamp;
use nurbs::{BSplineSurface, PatchSurface, PiecewiseCubic, PiecewiseError, TensorSpline};
use reconstruct::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};

use surfacing::Made;

use crate::export::{
    CadOptions, Entities, Schema, WriteError, write_iges, write_step, write_surfaces,
};

/// A surface over x and y, with its name in the file.
#[derive(Debug, Clone)]
struct HeightSurface<'a> {
    /// Its name.
    name: String,
    /// Over x and y in millimetres.
    surface: &'a BSplineSurface,
}

/// Why surfaces were not written.
#[derive(Debug, thiserror::Error)]
pub enum SurfacesError {
    /// As IGES or STEP.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A control point that is no number.
    #[error("a surface has a control point that is not finite: {0}")]
    Piecewise(#[from] PiecewiseError),
    /// What the destination said.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

impl SurfacesError {
    /// What the destination said, or the trouble in words as if it had.
    pub(crate) fn into_write(self) -> WriteError {
        match self {
            Self::Write(error) => error,
            Self::Piecewise(error) => WriteError::Io(std::io::Error::other(error)),
            Self::Io(error) => WriteError::Io(error),
        }
    }
}

/// What a surface is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceFormat {
    /// As IGES with these entities, of which 114 and 128 are known.
    Iges(Entities),
    /// As STEP.
    Step,
}

/// Writes a surface over a grid: its pieces whole, or trimmed where character lines run across the
/// grid. In IGES these are entities 144 on what is asked for, and that by itself where nothing is
/// trimmed.
///
/// # Errors
/// Any [`SurfacesError`].
pub fn write_made(
    made: &Made,
    name: &str,
    timestamp: Timestamp,
    author: &str,
    format: SurfaceFormat,
    sink: &mut dyn Write,
) -> Result<(), SurfacesError> {
    let entities = match format {
        SurfaceFormat::Iges(entities) if made.trimmed.is_none() => {
            let parts = made_parts(made);
            let names = names(name, parts.len());
            let whole: Vec<iges::NamedSurface<'_>> = parts
                .iter()
                .zip(&names)
                .map(|(surface, name)| iges::NamedSurface {
                    name,
                    surface,
                    is_closed: [false; 2],
                })
                .collect();
            write_surfaces(&whole, name, timestamp, author, entities, sink)?;
            return Ok(());
        }
        SurfaceFormat::Iges(entities) => entities,
        SurfaceFormat::Step => Entities::default(),
    };
    let cad = CadOptions {
        step: Some(Schema::Ap242),
        author: author.to_owned(),
        entities,
        ..CadOptions::default()
    };
    let model = made_model(made, name)?;
    match format {
        SurfaceFormat::Step => write_step(&model, name, timestamp, &cad, sink)?,
        SurfaceFormat::Iges(_) => write_iges(&model, name, timestamp, &cad, sink)?,
    }
    Ok(())
}

/// The pieces of a surface as they are, cut on lines along the grid.
fn made_parts(made: &Made) -> Vec<BSplineSurface> {
    made.pieces.iter().flat_map(|piece| piece.parts()).collect()
}

/// A surface as faces: with their trims, or rectangular ones.
pub(crate) fn made_model(made: &Made, name: &str) -> Result<Model, PiecewiseError> {
    if let Some(trimmed) = &made.trimmed {
        let mut model = trimmed.clone();
        let names = names(name, model.faces.len());
        for (face, name) in model.faces.iter_mut().zip(names) {
            face.name = name;
        }
        return Ok(model);
    }
    let parts = made_parts(made);
    let names = names(name, parts.len());
    let named: Vec<HeightSurface<'_>> = parts
        .iter()
        .zip(names)
        .map(|(surface, name)| HeightSurface { name, surface })
        .collect();
    surface_model(&named)
}

/// Names of so many surfaces in a file.
fn names(name: &str, count: usize) -> Vec<String> {
    match count {
        1 => vec![name.to_owned()],
        _ => (1..=count).map(|k| format!("{name} {k}")).collect(),
    }
}

/// Surfaces as rectangular faces, each within edges of its own.
fn surface_model(named: &[HeightSurface<'_>]) -> Result<Model, PiecewiseError> {
    let mut model = Model::default();
    for (index, named) in named.iter().enumerate() {
        add_face(&mut model, named, index)?;
    }
    Ok(model)
}

fn add_face(
    model: &mut Model,
    named: &HeightSurface<'_>,
    index: usize,
) -> Result<(), PiecewiseError> {
    let surface = named.surface;
    let heights = surface.points().iter().map(|point| point[2]).collect();
    let (u_knots, v_knots) = (surface.u_knots().clone(), surface.v_knots().clone());
    // A surface has as many control points as its knots ask for.
    let Ok(spline) = TensorSpline::new(u_knots, v_knots, heights) else {
        return Ok(());
    };
    let patches = spline.to_patches()?;
    let (u, v) = (patches.u_domain(), patches.v_domain());
    let corners = [[u.0, v.0], [u.1, v.0], [u.1, v.1], [u.0, v.1]];
    let first = model.vertices.len();
    for [x_mm, y_mm] in corners {
        model.vertices.push(Vertex { x_mm, y_mm });
    }
    let mut coedges = Vec::new();
    for side in 0..4 {
        let (from, to) = (corners[side], corners[(side + 1) % 4]);
        let (parameter_curve, space_curve) = border(&patches, from, to)?;
        let edge = EdgeId(model.edges.len());
        model.edges.push(Edge {
            start: VertexId(first + side),
            end: VertexId(first + (side + 1) % 4),
            kind: EdgeKind::Silhouette,
            origin: EdgeOrigin::Measured,
            path: parameter_curve.clone(),
        });
        coedges.push(Coedge {
            edge,
            reversed: false,
            parameter_curve,
            space_curve,
        });
    }
    model.faces.push(Face {
        name: named.name.clone(),
        region: u16::try_from(index + 1).unwrap_or(u16::MAX),
        surface: Surface::Patches(patches),
        form: None,
        outer: Loop { coedges },
        inner: Vec::new(),
    });
    Ok(())
}

/// A straight side of the rectangle, in the parameter plane and on the surface: one cubic for
/// each patch along it, by length.
fn border(
    patches: &PatchSurface,
    from: [f64; 2],
    to: [f64; 2],
) -> Result<(PiecewiseCubic<2>, PiecewiseCubic<3>), PiecewiseError> {
    let is_along_u = from[1] == to[1];
    let stations = if is_along_u {
        &patches.u_breaks
    } else {
        &patches.v_breaks
    };
    let start = if is_along_u { from[0] } else { from[1] };
    let mut breaks: Vec<f64> = stations.iter().map(|t| (t - start).abs()).collect();
    breaks.sort_by(f64::total_cmp);
    let length = breaks.last().copied().unwrap_or(0.0);
    let at = |s: f64| {
        let share = if length > 0.0 { s / length } else { 0.0 };
        [0, 1].map(|d| {
            if share >= 1.0 {
                to[d]
            } else {
                from[d] + share * (to[d] - from[d])
            }
        })
    };
    let (mut flat, mut space) = (Vec::new(), Vec::new());
    for piece in breaks.windows(2) {
        let &[low, high] = piece else { continue };
        let points: [[f64; 2]; 4] = core::array::from_fn(|k| {
            at(if k == 3 {
                high
            } else {
                low + (high - low) * k as f64 / 3.0
            })
        });
        let lifted = points.map(|[x, y]| [x, y, patches.z(x, y)]);
        flat.extend(PiecewiseCubic::through_thirds(low, high, &points)?.pieces);
        space.extend(PiecewiseCubic::through_thirds(low, high, &lifted)?.pieces);
    }
    Ok((
        PiecewiseCubic::new(breaks.clone(), flat)?,
        PiecewiseCubic::new(breaks, space)?,
    ))
}
