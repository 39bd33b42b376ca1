//! Binary PLY.

use std::io::Write;

use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;
use tessellate::Mesh;

use crate::MeshDetails;
use crate::error::MeshFileError;
use crate::points::{Census, Point, Points};
use crate::scan::ScanDetails;

/// A vertex of a mesh, or a point.
struct Vertex {
    place: [f64; 3],
    intensity: u8,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self {
            place: [0.0; 3],
            intensity: 0,
        }
    }

    fn get_double(&self, key: &str) -> Option<f64> {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == key)?;
        self.place.get(axis).copied()
    }

    fn get_float(&self, key: &str) -> Option<f32> {
        self.get_double(key).map(|c| c as f32)
    }

    fn get_uchar(&self, key: &str) -> Option<u8> {
        (key == "intensity").then_some(self.intensity)
    }
}

/// A triangle.
struct Facet {
    corners: [i32; 3],
    colour: [u8; 3],
    region: u16,
    face: u16,
}

impl PropertyAccess for Facet {
    fn new() -> Self {
        Self {
            corners: [0; 3],
            colour: [0; 3],
            region: 0,
            face: 0,
        }
    }

    fn get_list_int(&self, key: &str) -> Option<&[i32]> {
        (key == "vertex_indices").then_some(&self.corners[..])
    }

    fn get_uchar(&self, key: &str) -> Option<u8> {
        let index = ["red", "green", "blue"].iter().position(|c| *c == key)?;
        self.colour.get(index).copied()
    }

    fn get_ushort(&self, key: &str) -> Option<u16> {
        match key {
            "region" => Some(self.region),
            "face" => Some(self.face),
            _ => None,
        }
    }
}

pub(crate) fn element(name: &str, count: usize, properties: &[(&str, PropertyType)]) -> ElementDef {
    let mut element = ElementDef::new(name.to_owned());
    element.count = count;
    for (name, kind) in properties {
        element
            .properties
            .add(PropertyDef::new((*name).to_owned(), kind.clone()));
    }
    element
}

pub(crate) fn header(comments: Vec<String>, elements: &[&ElementDef]) -> Header {
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments = comments;
    for element in elements {
        header.elements.add((*element).clone());
    }
    header
}

/// A comment is one line of ASCII.
pub(crate) fn comment(text: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_graphic() || c == ' ' {
            c
        } else {
            '_'
        }
    };
    text.chars().map(plain).collect()
}

/// Triangles with the colour and region of their faces, whose names stand in comments.
pub(crate) fn write_mesh(
    mesh: &Mesh,
    details: &MeshDetails<'_>,
    mut sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let too_many = |what: &str, most: u64| MeshFileError::Format {
        format: "PLY",
        reason: format!("it has more than {most} {what}"),
    };
    if i32::try_from(mesh.vertices_mm.len()).is_err() {
        return Err(too_many("vertices", i32::MAX as u64));
    }
    if u16::try_from(mesh.faces.len()).is_err() {
        return Err(too_many("faces", u64::from(u16::MAX)));
    }
    let scalar = |kind: ScalarType| PropertyType::Scalar(kind);
    let float = || scalar(ScalarType::Float);
    let byte = || scalar(ScalarType::UChar);
    let vertices = element(
        "vertex",
        mesh.vertices_mm.len(),
        &[("x", float()), ("y", float()), ("z", float())],
    );
    let facets = element(
        "face",
        mesh.triangle_count(),
        &[
            (
                "vertex_indices",
                PropertyType::List(ScalarType::UChar, ScalarType::Int),
            ),
            ("red", byte()),
            ("green", byte()),
            ("blue", byte()),
            ("region", scalar(ScalarType::UShort)),
            ("face", scalar(ScalarType::UShort)),
        ],
    );
    let mut comments = vec![
        comment(details.generator),
        format!("part {}", comment(details.name)),
        "lengths in millimetres, y up, z towards the camera".to_owned(),
    ];
    comments.extend(
        mesh.faces
            .iter()
            .enumerate()
            .map(|(k, face)| comment(&format!("face {k}: {}, {}", face.name, face.form))),
    );
    let header = header(comments, &[&vertices, &facets]);
    Writer::<Vertex>::new().write_header(&mut sink, &header)?;
    let writer = Writer::<Vertex>::new();
    for &place in &mesh.vertices_mm {
        let vertex = Vertex {
            place,
            intensity: 0,
        };
        writer.write_little_endian_element(&mut sink, &vertex, &vertices)?;
    }
    let writer = Writer::<Facet>::new();
    for (k, face) in mesh.faces.iter().enumerate() {
        for triangle in face.triangles() {
            let facet = Facet {
                corners: triangle.map(|vertex| vertex as i32),
                colour: details.colour(face.region),
                region: face.region,
                face: k as u16,
            };
            writer.write_little_endian_element(&mut sink, &facet, &facets)?;
        }
    }
    Ok(())
}

/// Points in double precision, so that they are read again as they were.
pub(crate) fn write_points(
    points: &dyn Points,
    census: Census,
    details: &ScanDetails<'_>,
    mut sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let double = || PropertyType::Scalar(ScalarType::Double);
    let mut properties = vec![("x", double()), ("y", double()), ("z", double())];
    if census.has_intensity {
        properties.push(("intensity", PropertyType::Scalar(ScalarType::UChar)));
    }
    let vertices = element("vertex", census.count, &properties);
    let comments = vec![
        comment(details.generator),
        format!("scan {}", comment(details.name)),
        format!("scanner {}", comment(details.source)),
        "lengths in millimetres, y up, z towards the camera".to_owned(),
    ];
    let header = header(comments, &[&vertices]);
    let writer = Writer::<Vertex>::new();
    writer.write_header(&mut sink, &header)?;
    let mut failed = None;
    let mut written = 0;
    let visited = points.visit(&mut |point: Point| {
        let vertex = Vertex {
            place: point.place_mm,
            intensity: point.intensity,
        };
        written += 1;
        let done = writer.write_little_endian_element(&mut sink, &vertex, &vertices);
        done.map(|_| ()).map_err(|error| {
            let kind = error.kind();
            failed = Some(error);
            kind.into()
        })
    });
    match (failed, visited) {
        (Some(error), _) => Err(MeshFileError::Io(error)),
        (None, Err(error)) => Err(MeshFileError::Points(error)),
        (None, Ok(())) if written != census.count => Err(MeshFileError::Points(
            std::io::Error::other("they are others than they were"),
        )),
        (None, Ok(())) => Ok(()),
    }
}
