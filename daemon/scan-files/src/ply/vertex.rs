//! What the PLY parser fills in.

use ply_rs_bw::ply::{BeginList, Property, PropertyAccess, PropertyAccessResult};

/// Longest list that is read, to be ignored: a face has a handful of corners. A longer one
/// is a sign of damage, and would be held in memory.
pub(super) const LONGEST_LIST: usize = 1 << 16;

/// Refuses lists beyond [`LONGEST_LIST`] before memory is given to them.
macro_rules! bounded_lists {
    () => {
        bounded_lists! {
            begin_list_char: i8, begin_list_uchar: u8, begin_list_short: i16,
            begin_list_ushort: u16, begin_list_int: i32, begin_list_uint: u32,
            begin_list_float: f32, begin_list_double: f64
        }
    };
    ($($hook:ident: $kind:ty),*) => {
        $(
            fn $hook(&mut self, _name: &str, length: usize) -> BeginList<'_, $kind> {
                if length > LONGEST_LIST {
                    BeginList::UnsupportedType
                } else {
                    BeginList::UseSetter
                }
            }
        )*
    };
}

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

    bounded_lists!();

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

    bounded_lists!();
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
