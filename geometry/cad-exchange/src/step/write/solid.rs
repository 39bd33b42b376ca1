//! A closed solid: `MANIFOLD_SOLID_BREP` (ISO 10303-42, 6.4.17) of faces on analytic surfaces.

use std::io;

use terraces::{Placement, Solid, SolidCurve, SolidSurface};

use super::data::{Data, Id};
use super::shapes::Shapes;
use super::style::Styles;
use super::{WriteError, WriteOptions, product};

/// What was written. Millimetres, whatever the file's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidSummary {
    /// Faces of the one shell.
    pub faces: usize,
    /// Edges, each counted once.
    pub edges: usize,
    /// Instances in the data section.
    pub instances: usize,
    /// Size of the file.
    pub bytes: usize,
    /// The solid's volume, as in the file's validation property.
    pub volume_mm3: f64,
}

/// Writes a closed solid as a STEP file (`ADVANCED_BREP_SHAPE_REPRESENTATION`). Faces have their
/// names, and the colour of the operation that made them; the uncertainty is the resolution of the
/// options. The same solid and options give the same bytes.
///
/// # Errors
/// [`WriteError::Option`] for an option that cannot stand in a file; [`WriteError::NoFaces`] for an
/// empty solid; [`WriteError::Solid`] for one that is not closed; [`WriteError::Io`] when `out`
/// fails.
pub fn write_solid(
    solid: &Solid,
    options: &WriteOptions,
    out: &mut impl io::Write,
) -> Result<SolidSummary, WriteError> {
    options.validate()?;
    if solid.faces.is_empty() {
        return Err(WriteError::NoFaces);
    }
    solid.check().map_err(WriteError::Solid)?;
    let mut data = Data::default();
    let shapes = Shapes { unit: options.unit };
    let shape = product::product(&mut data, options);
    let units = product::units(&mut data, options.unit, options.resolution_mm);
    let vertices = super::write_vertices(&mut data, &shapes, &solid.vertices);
    let edges: Vec<Id> = solid
        .edges
        .iter()
        .map(|edge| {
            let curve = curve(&mut data, &shapes, solid, edge);
            super::write_edge(&mut data, edge.ends.map(|end| vertices[end]), curve)
        })
        .collect();
    let mut styles = Styles::default();
    let faces: Vec<Id> = solid
        .faces
        .iter()
        .map(|face| {
            let surface = surface(&mut data, &shapes, &face.surface);
            let loops = face.loops.iter().map(|border| {
                let senses = border.iter().map(|of| (edges[of.edge], of.forward));
                senses.collect::<Vec<_>>()
            });
            super::advanced_face(&mut data, &face.name, surface, face.is_outward, loops)
        })
        .collect();
    let shell = data.add("CLOSED_SHELL", |v| {
        v.text("");
        v.ids(&faces);
    });
    let brep = data.add("MANIFOLD_SOLID_BREP", |v| {
        v.text(&options.product);
        v.id(shell);
    });
    let keyword = "ADVANCED_BREP_SHAPE_REPRESENTATION";
    super::represent(&mut data, &shapes, &units, options, shape, (keyword, brep));
    for (face, &id) in solid.faces.iter().zip(&faces) {
        let colour = u16::try_from(face.operation).unwrap_or(u16::MAX);
        styles.colour(&mut data, id, options.colour(colour));
    }
    styles.finish(&mut data, units.context);
    product::volume(&mut data, &shapes, &units, shape, solid.volume_mm3);
    let description = "a solid rebuilt from its features";
    let bytes = super::exchange(&data, options, description, out)?;
    Ok(SolidSummary {
        faces: faces.len(),
        edges: edges.len(),
        instances: data.count(),
        bytes,
        volume_mm3: solid.volume_mm3,
    })
}

fn placed(data: &mut Data, shapes: &Shapes, place: &Placement) -> Id {
    shapes.placement(data, place.origin_mm, place.axis, place.x)
}

fn curve(data: &mut Data, shapes: &Shapes, solid: &Solid, edge: &terraces::SolidEdge) -> Id {
    let ends = edge.ends.map(|end| solid.vertices[end]);
    match &edge.curve {
        SolidCurve::Line => {
            let along: [f64; 3] = core::array::from_fn(|k| ends[1][k] - ends[0][k]);
            let length_mm = along.iter().map(|c| c * c).sum::<f64>().sqrt();
            let from = shapes.point(data, "", ends[0]);
            let vector = shapes.vector(data, along.map(|c| c / length_mm), length_mm);
            data.add("LINE", |v| {
                v.text("");
                v.id(from);
                v.id(vector);
            })
        }
        SolidCurve::Circle { place, radius_mm } => {
            let place = placed(data, shapes, place);
            shapes.elementary(data, "CIRCLE", place, &[*radius_mm], None)
        }
        SolidCurve::Ellipse {
            place,
            half_axes_mm,
        } => {
            let place = placed(data, shapes, place);
            shapes.elementary(data, "ELLIPSE", place, half_axes_mm, None)
        }
        SolidCurve::Spline(spline) => shapes.spline_curve(data, spline, ends),
    }
}

fn surface(data: &mut Data, shapes: &Shapes, surface: &SolidSurface) -> Id {
    let (keyword, place, lengths, angle) = match surface {
        SolidSurface::Plane(place) => ("PLANE", place, vec![], None),
        SolidSurface::Cylinder { place, radius_mm } => {
            ("CYLINDRICAL_SURFACE", place, vec![*radius_mm], None)
        }
        SolidSurface::Cone {
            place,
            radius_mm,
            half_angle_rad,
        } => (
            "CONICAL_SURFACE",
            place,
            vec![*radius_mm],
            Some(*half_angle_rad),
        ),
        SolidSurface::Sphere { place, radius_mm } => {
            ("SPHERICAL_SURFACE", place, vec![*radius_mm], None)
        }
        SolidSurface::Torus { place, radii_mm } => {
            ("TOROIDAL_SURFACE", place, radii_mm.to_vec(), None)
        }
        SolidSurface::Spline(spline) => return shapes.spline_surface(data, spline),
    };
    let place = placed(data, shapes, place);
    shapes.elementary(data, keyword, place, &lengths, angle)
}
