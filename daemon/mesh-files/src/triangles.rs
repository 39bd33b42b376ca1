//! Bare triangles written: binary STL, binary PLY, Wavefront OBJ.

use std::io::Write;

use ply_rs_bw::ply::{PropertyAccess, PropertyType, ScalarType};
use ply_rs_bw::writer::Writer;
use stl_io::{Normal, Triangle, Vertex};

use crate::error::MeshFileError;
use crate::format::TriangleFormat;
use crate::{ply, stl};

/// A vertex of PLY, in the precision that the file has.
struct Place([f64; 3]);

impl PropertyAccess for Place {
    fn new() -> Self {
        Self([0.0; 3])
    }

    fn get_double(&self, key: &str) -> Option<f64> {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == key)?;
        self.0.get(axis).copied()
    }

    fn get_float(&self, key: &str) -> Option<f32> {
        self.get_double(key).map(|c| c as f32)
    }
}

struct Corners([i32; 3]);

impl PropertyAccess for Corners {
    fn new() -> Self {
        Self([0; 3])
    }

    fn get_list_int(&self, key: &str) -> Option<&[i32]> {
        (key == "vertex_indices").then_some(&self.0[..])
    }
}

/// Writes triangles over shared vertices. `is_single` says whether PLY has coordinates of 32 bits or 64;
/// STL always has 32, and OBJ as many digits as tell each coordinate. `generator` names the program.
///
/// # Errors
/// [`MeshFileError`] where there are too many for the format, a triangle names no vertex, or `sink`
/// fails.
pub fn write_triangles(
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
    (format, is_single): (TriangleFormat, bool),
    generator: &str,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let refused = |reason: &str| MeshFileError::Format {
        format: format.name(),
        reason: reason.to_owned(),
    };
    if i32::try_from(vertices.len()).is_err() || u32::try_from(triangles.len()).is_err() {
        return Err(refused("it has more than the format can count"));
    }
    let there = vertices.len() as u32;
    if triangles.as_flattened().iter().any(|v| *v >= there) {
        return Err(refused("a triangle names a vertex that is not there"));
    }
    match format {
        TriangleFormat::Stl => write_stl(vertices, triangles, sink),
        TriangleFormat::Ply => write_ply(vertices, triangles, is_single, generator, sink),
        TriangleFormat::Obj => write_obj(vertices, triangles, generator, sink),
    }
}

fn write_stl(
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
    mut sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let facets: Vec<Triangle> = triangles
        .iter()
        .map(|own| {
            let corners = own.map(|v| vertices[v as usize]);
            Triangle {
                normal: Normal::new(stl::normal(corners).map(|c| c as f32)),
                vertices: corners.map(|corner| Vertex::new(corner.map(|c| c as f32))),
            }
        })
        .collect();
    stl_io::write_stl(&mut sink, facets.iter())?;
    Ok(())
}

fn write_ply(
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
    is_single: bool,
    generator: &str,
    mut sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let coordinate = || {
        PropertyType::Scalar(if is_single {
            ScalarType::Float
        } else {
            ScalarType::Double
        })
    };
    let places = ply::element(
        "vertex",
        vertices.len(),
        &[
            ("x", coordinate()),
            ("y", coordinate()),
            ("z", coordinate()),
        ],
    );
    let list = PropertyType::List(ScalarType::UChar, ScalarType::Int);
    let faces = ply::element("face", triangles.len(), &[("vertex_indices", list)]);
    let header = ply::header(vec![ply::comment(generator)], &[&places, &faces]);
    let writer = Writer::<Place>::new();
    writer.write_header(&mut sink, &header)?;
    for &own in vertices {
        writer.write_little_endian_element(&mut sink, &Place(own), &places)?;
    }
    let writer = Writer::<Corners>::new();
    for own in triangles {
        let corners = Corners(own.map(|v| v as i32));
        writer.write_little_endian_element(&mut sink, &corners, &faces)?;
    }
    Ok(())
}

fn write_obj(
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
    generator: &str,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    writeln!(sink, "# {}", ply::comment(generator))?;
    for [x, y, z] in vertices {
        writeln!(sink, "v {x} {y} {z}")?;
    }
    for own in triangles {
        let [a, b, c] = own.map(|v| v + 1);
        writeln!(sink, "f {a} {b} {c}")?;
    }
    Ok(())
}
