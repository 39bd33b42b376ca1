//! Surfaces as CAD files: as they are in IGES; in STEP, which asks for borders, as rectangular faces
//! on bicubic patches, one for each span, which are the same surface.

use std::io::Write;

use cad_exchange::iges;
use jiff::Timestamp;
use nurbs::{BSplineSurface, PatchSurface, PiecewiseCubic, PiecewiseError, TensorSpline};
use reconstruct::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};

use crate::export::{CadOptions, Schema, WriteError, write_step, write_surfaces};

/// A surface over x and y, with its name in the file.
#[derive(Debug, Clone)]
pub struct HeightSurface<'a> {
    /// Its name.
    pub name: String,
    /// Over x and y in millimetres.
    pub surface: &'a BSplineSurface,
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

/// Writes surfaces, as IGES entities 128 or as STEP.
///
/// # Errors
/// Any [`SurfacesError`].
pub fn write_height_surfaces(
    named: &[HeightSurface<'_>],
    name: &str,
    timestamp: Timestamp,
    author: &str,
    is_step: bool,
    sink: &mut dyn Write,
) -> Result<(), SurfacesError> {
    if !is_step {
        let whole: Vec<iges::NamedSurface<'_>> = named
            .iter()
            .map(|own| iges::NamedSurface {
                name: &own.name,
                surface: own.surface,
                is_closed: [false; 2],
            })
            .collect();
        write_surfaces(&whole, name, timestamp, author, sink)?;
        return Ok(());
    }
    let model = surface_model(named)?;
    let cad = CadOptions {
        step: Some(Schema::Ap242),
        author: author.to_owned(),
        ..CadOptions::default()
    };
    write_step(&model, name, timestamp, &cad, sink)?;
    Ok(())
}

/// Surfaces as rectangular faces, each within edges of its own.
pub(crate) fn surface_model(named: &[HeightSurface<'_>]) -> Result<Model, PiecewiseError> {
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
