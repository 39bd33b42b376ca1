//! PLY, text and binary of both byte orders.

use std::io::BufRead;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::{MOST_TRIANGLES, ReadMeshError, Triangles, fan};
use crate::format::TriangleFormat;

const AXES: [&str; 3] = ["x", "y", "z"];
/// Names under which the corners of a face go.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// How the library tells that a file ends too early.
const CUT: [&str; 2] = ["end of file", "fill whole buffer"];

struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if let (Some(axis), Some(value)) = (AXES.iter().position(|a| *a == name), number(&value)) {
            self.0[axis] = value;
            return PropertyAccessResult::Set;
        }
        PropertyAccessResult::Ignored
    }
}

fn number(value: &Property) -> Option<f64> {
    Some(match *value {
        Property::Float(own) => f64::from(own),
        Property::Double(own) => own,
        Property::Int(own) => f64::from(own),
        Property::UInt(own) => f64::from(own),
        Property::Short(own) => f64::from(own),
        Property::UShort(own) => f64::from(own),
        Property::Char(own) => f64::from(own),
        Property::UChar(own) => f64::from(own),
        _ => return None,
    })
}

/// Corners; `None` where one of them is no index.
struct Face(Option<Vec<u32>>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(None)
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match value {
            Property::ListInt(own) => own.into_iter().map(|v| u32::try_from(v).ok()).collect(),
            Property::ListUInt(own) => Some(own),
            Property::ListShort(own) => own.into_iter().map(|v| u32::try_from(v).ok()).collect(),
            Property::ListUShort(own) => Some(own.into_iter().map(u32::from).collect()),
            Property::ListChar(own) => own.into_iter().map(|v| u32::try_from(v).ok()).collect(),
            Property::ListUChar(own) => Some(own.into_iter().map(u32::from).collect()),
            _ => None,
        };
        PropertyAccessResult::Set
    }
}

/// What else stands in a file is passed over.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}

pub(super) fn read(source: &mut impl BufRead, bytes: u64) -> Result<Triangles, ReadMeshError> {
    let mut reader = Reader::new(source);
    let header = Parser::<Other>::new()
        .read_header(&mut reader)
        .map_err(|error| ReadMeshError::damaged("PLY", &error))?;
    let is_single = check(&header, bytes)?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for element in header.elements.values() {
        let damaged = |error: &dyn std::error::Error| {
            let told = error.to_string();
            if CUT.iter().any(|sign| told.contains(sign)) {
                return ReadMeshError(format!(
                    "is cut off: it ends before the last of {} {} entries",
                    element.count, element.name
                ));
            }
            ReadMeshError(format!("is damaged: {}: {told}", element.name))
        };
        match element.name.as_str() {
            "vertex" => {
                let own = Parser::<Vertex>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|error| damaged(&error))?;
                vertices = own.into_iter().map(|vertex| vertex.0).collect();
            }
            "face" => {
                let own = Parser::<Face>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|error| damaged(&error))?;
                for (number, face) in (1..).zip(own) {
                    let Some(corners) = face.0 else {
                        return Err(ReadMeshError(format!(
                            "is damaged: face {number} has a corner that is no vertex"
                        )));
                    };
                    fan(&corners, &mut triangles);
                }
            }
            _ => {
                Parser::<Other>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|error| damaged(&error))?;
            }
        }
    }
    Ok(Triangles {
        vertices,
        triangles,
        format: TriangleFormat::Ply,
        is_single,
    })
}

/// Refuses headers whose data would be meaningless; whether coordinates have 32 bits.
fn check(header: &Header, bytes: u64) -> Result<bool, ReadMeshError> {
    let refuse = |why: &str| Err(ReadMeshError(why.to_owned()));
    let Some(vertex) = header.elements.get("vertex") else {
        return refuse("is a PLY file without vertices");
    };
    let Some(face) = header.elements.get("face") else {
        return refuse("is a PLY file of points, without faces; a mesh is needed");
    };
    if !CORNERS
        .iter()
        .any(|name| face.properties.contains_key(*name))
    {
        return refuse("is a PLY file whose faces have no `vertex_indices`");
    }
    let mut is_single = true;
    for axis in AXES {
        match vertex.properties.get(axis).map(|own| &own.data_type) {
            Some(PropertyType::Scalar(kind)) => is_single &= *kind != ScalarType::Double,
            _ => return refuse("is a PLY file whose vertices have no x, y and z"),
        }
    }
    for element in header.elements.values() {
        // Every entry takes a byte at least, so that an announced number alone takes no memory.
        if element.count as u64 > bytes || (element.properties.is_empty() && element.count > 0) {
            return refuse("is cut off: it announces more than it can hold");
        }
        if element.count > MOST_TRIANGLES {
            return Err(ReadMeshError(format!(
                "has more than {MOST_TRIANGLES} entries, the most that are read: decimate the \
                 mesh first"
            )));
        }
    }
    Ok(is_single)
}
