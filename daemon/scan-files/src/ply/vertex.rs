//! What the PLY parser fills in.

use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

/// A vertex: its position and intensity, everything else ignored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub(super) xyz: [f64; 3],
    pub(super) intensity: Option<f64>,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self {
            xyz: [f64::NAN; 3],
            intensity: None,
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(value) = scalar(&property) else {
            return PropertyAccessResult::Ignored;
        };
        match name {
            "x" => self.xyz[0] = value,
            "y" => self.xyz[1] = value,
            "z" => self.xyz[2] = value,
            "intensity" => self.intensity = Some(value),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// An entry of an element that is not wanted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

fn scalar(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(v) => f64::from(v),
        Property::UChar(v) => f64::from(v),
        Property::Short(v) => f64::from(v),
        Property::UShort(v) => f64::from(v),
        Property::Int(v) => f64::from(v),
        Property::UInt(v) => f64::from(v),
        Property::Float(v) => f64::from(v),
        Property::Double(v) => v,
        _ => return None,
    })
}
