//! The writer: a model in, header and data section out.
//!
//! Product, units and uncertainty come first; then vertices and edges, each once however
//! many faces they belong to; then each face on its surface, with loops of oriented edges;
//! then the shells, the shape representation over them, colours, and the properties by
//! which a reader can check what it made of the file. Every reference points back, and one
//! pass numbers everything.

mod data;
mod error;
mod measure;
mod options;
mod product;
mod shapes;
mod solid;
mod spell;
mod style;

use std::io;

use reconstruct::{Face, Model};

pub use crate::common::{DEFAULT_PALETTE, FaceDefect};
pub use error::WriteError;
pub use options::{LengthUnit, Schema, WriteOptions};
pub use solid::{SolidSummary, write_solid};

use crate::brep::{Brep, Carrier, Sharing, Topology, Use};
use crate::common::check;
use data::{Data, Id};
use measure::Moments;
use product::Units;
use shapes::Shapes;
use style::Styles;

/// What was written. Millimetres, whatever the file's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Trimmed faces.
    pub faces: usize,
    /// Shells: faces that hang together by shared edges.
    pub shells: usize,
    /// Edges, each counted once.
    pub edges: usize,
    /// Edges that belong to two faces.
    pub shared_edges: usize,
    /// Those of them that end where the two faces part ([`WriteOptions::sharing_mm`]);
    /// from there on each has an edge of its own.
    pub partly_shared: usize,
    /// Creases that are two edges, since their faces are too far apart along most of them.
    pub parted_creases: usize,
    /// Instances in the data section.
    pub instances: usize,
    /// Size of the file.
    pub bytes: usize,
    /// The uncertainty in the file: the resolution of the options, or the largest gap
    /// where that is larger.
    pub uncertainty_mm: f64,
    /// Area of all faces, as in the file's validation properties.
    pub area_mm2: f64,
    /// Their common centroid, as in the file's validation properties.
    pub centroid_mm: [f64; 3],
}

/// Writes a model as a STEP file of open shells.
///
/// The same model and options give the same bytes. The two curves of a crease become one
/// as far as they are as near as the options allow; the file's uncertainty is never less than
/// the distance of any vertex or edge from where a face of the model has it. Slight kinks
/// of curves are rounded within half the resolution. Nothing is written unless the whole
/// model can be.
///
/// # Errors
/// [`WriteError::Option`] for an option that cannot stand in a file; [`WriteError::Face`]
/// for a face that breaks a promise of [`Model`], such as an open loop or a number that
/// is not finite; [`WriteError::Io`] when `out` fails.
pub fn write(
    model: &Model,
    options: &WriteOptions,
    out: &mut impl io::Write,
) -> Result<Summary, WriteError> {
    options.validate()?;
    let gap_mm = check(model, options.resolution_mm)?;
    let sharing = Sharing {
        sharing_mm: options.sharing_mm,
        resolution_mm: options.resolution_mm,
    };
    let Brep { carriers, topology } = Brep::by_numbers(model, sharing);
    let moments = Moments::of(model, &topology);
    let uncertainty_mm = (gap_mm + topology.gap_mm).max(options.resolution_mm);

    let mut data = Data::default();
    let shapes = Shapes { unit: options.unit };
    let shape = product::product(&mut data, options);
    let units = product::units(&mut data, options.unit, uncertainty_mm);
    let faces = write_faces(&mut data, &shapes, model, &carriers, &topology);
    write_shells(
        &mut data, &shapes, &units, options, shape, &topology, &faces,
    );
    let mut styles = Styles::default();
    for (face, &id) in model.faces.iter().zip(&faces) {
        styles.colour(&mut data, id, options.colour(face.region));
    }
    styles.finish(&mut data, units.context);
    product::properties(&mut data, &shapes, &units, shape, &moments);

    let bytes = exchange(&data, options, "trimmed faces from a range scan", out)?;
    Ok(Summary {
        faces: faces.len(),
        shells: topology.shells.len(),
        edges: topology.edges.len(),
        shared_edges: topology.shared,
        partly_shared: topology.partly_shared,
        parted_creases: topology.parted,
        instances: data.count(),
        bytes,
        uncertainty_mm,
        area_mm2: moments.area_mm2,
        centroid_mm: moments.centroid_mm(),
    })
}

/// Writes header and data; returns how many bytes these are.
fn exchange(
    data: &Data,
    options: &WriteOptions,
    description: &str,
    out: &mut impl io::Write,
) -> io::Result<usize> {
    let head = header(options, description);
    let parts = [
        &head,
        "DATA;\n",
        data.text(),
        "ENDSEC;\nEND-ISO-10303-21;\n",
    ];
    for part in parts {
        out.write_all(part.as_bytes())?;
    }
    Ok(parts.iter().map(|part| part.len()).sum())
}

/// The header section (ISO 10303-21, clause 8).
fn header(options: &WriteOptions, description: &str) -> String {
    let text = |value: &str| {
        let mut out = String::new();
        spell::text(&mut out, value);
        out
    };
    let (name, time) = (text(&options.file_name), text(&options.timestamp));
    let (author, organization) = (text(&options.author), text(&options.organization));
    let (system, schema) = (text(&options.system), options.schema.identifier());
    format!(
        "ISO-10303-21;\nHEADER;\n\
         FILE_DESCRIPTION(('{description}'),'2;1');\n\
         FILE_NAME({name},{time},({author}),\n({organization}),{system},{system},'');\n\
         FILE_SCHEMA(('{schema}'));\nENDSEC;\n"
    )
}

/// Vertices, edges and faces; the faces in the order of the model.
fn write_faces(
    data: &mut Data,
    shapes: &Shapes,
    model: &Model,
    carriers: &[Carrier],
    topology: &Topology,
) -> Vec<Id> {
    let vertices = write_vertices(data, shapes, &topology.vertices);
    let edges: Vec<Id> = topology
        .edges
        .iter()
        .map(|strand| {
            let ends_mm = strand.ends.map(|vertex| topology.vertices[vertex]);
            let curve = shapes.curve(data, strand, ends_mm);
            write_edge(data, strand.ends.map(|end| vertices[end]), curve)
        })
        .collect();
    let faces = model.faces.iter().zip(carriers).zip(&topology.uses);
    faces
        .map(|((face, carrier), loops)| write_face(data, shapes, face, carrier, loops, &edges))
        .collect()
}

/// `ADVANCED_FACE` (ISO 10303-511). Every face has its normal on the side of +z, as the model's
/// have: outer loops run counter-clockwise as seen from there. So have planes and splines; the
/// others have theirs outwards.
fn write_face(
    data: &mut Data,
    shapes: &Shapes,
    face: &Face,
    carrier: &Carrier,
    loops: &[Vec<Use>],
    edges: &[Id],
) -> Id {
    let surface = shapes.surface(data, carrier, &face.surface);
    let uses = loops.iter().map(|border| {
        let senses = border.iter().map(|of| (edges[of.edge], of.forward));
        senses.collect::<Vec<_>>()
    });
    advanced_face(data, &face.name, surface, carrier.same_sense(), uses)
}

/// `VERTEX_POINT` of each point.
fn write_vertices(data: &mut Data, shapes: &Shapes, points_mm: &[[f64; 3]]) -> Vec<Id> {
    let points = points_mm.iter().map(|&point| {
        let point = shapes.point(data, "", point);
        data.add("VERTEX_POINT", |v| {
            v.text("");
            v.id(point);
        })
    });
    points.collect()
}

/// `EDGE_CURVE`, in the sense of its curve.
fn write_edge(data: &mut Data, ends: [Id; 2], curve: Id) -> Id {
    data.add("EDGE_CURVE", |v| {
        v.text("");
        ends.iter().for_each(|&end| v.id(end));
        v.id(curve);
        v.word(".T.");
    })
}

/// `ADVANCED_FACE` of a surface and its loops, the outer one first, by edges and their senses.
fn advanced_face(
    data: &mut Data,
    name: &str,
    surface: Id,
    same_sense: bool,
    loops: impl Iterator<Item = Vec<(Id, bool)>>,
) -> Id {
    let bounds: Vec<Id> = loops
        .enumerate()
        .map(|(n, border)| {
            let uses: Vec<Id> = border
                .into_iter()
                .map(|(edge, forward)| {
                    data.add("ORIENTED_EDGE", |v| {
                        v.text("");
                        v.word("*");
                        v.word("*");
                        v.id(edge);
                        v.word(if forward { ".T." } else { ".F." });
                    })
                })
                .collect();
            let border = data.add("EDGE_LOOP", |v| {
                v.text("");
                v.ids(&uses);
            });
            let keyword = if n == 0 {
                "FACE_OUTER_BOUND"
            } else {
                "FACE_BOUND"
            };
            data.add(keyword, |v| {
                v.text("");
                v.id(border);
                v.word(".T.");
            })
        })
        .collect();
    data.add("ADVANCED_FACE", |v| {
        v.text(name);
        v.ids(&bounds);
        v.id(surface);
        v.word(if same_sense { ".T." } else { ".F." });
    })
}

/// The shells and the representation that gives them to the product.
fn write_shells(
    data: &mut Data,
    shapes: &Shapes,
    units: &Units,
    options: &WriteOptions,
    shape: Id,
    topology: &Topology,
    faces: &[Id],
) {
    let shells: Vec<Id> = topology
        .shells
        .iter()
        .map(|shell| {
            let members: Vec<Id> = shell.iter().map(|&face| faces[face]).collect();
            data.add("OPEN_SHELL", |v| {
                v.text("");
                v.ids(&members);
            })
        })
        .collect();
    let model = data.add("SHELL_BASED_SURFACE_MODEL", |v| {
        v.text("");
        v.ids(&shells);
    });
    let keyword = "MANIFOLD_SURFACE_SHAPE_REPRESENTATION";
    represent(data, shapes, units, options, shape, (keyword, model));
}

/// The representation that gives a model to the product.
fn represent(
    data: &mut Data,
    shapes: &Shapes,
    units: &Units,
    options: &WriteOptions,
    shape: Id,
    (keyword, model): (&str, Id),
) {
    let origin = shapes.placement(data, [0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let representation = data.add(keyword, |v| {
        v.text(&options.product);
        v.ids(&[origin, model]);
        v.id(units.context);
    });
    data.add("SHAPE_DEFINITION_REPRESENTATION", |v| {
        v.id(shape);
        v.id(representation);
    });
}
