//! What the writers of all formats ask of a model, and do to it, alike.

mod check;
mod decimal;
mod defect;
mod rounding;

pub use defect::FaceDefect;

pub(crate) use check::{check, largest};
pub(crate) use decimal::decimal;
pub(crate) use defect::Defect;
pub(crate) use rounding::{shifted, without_kinks};

/// Joints whose derivatives differ by less than this, in millimetres, count as smooth.
pub(crate) const SMOOTH_MM: f64 = 1e-9;

/// Part of the resolution that curves may be off for the sake of smooth joints.
pub(crate) const ROUNDING_PART: f64 = 0.5;

/// Colours that neighbours are told apart by, red, green and blue of 0 to 255.
pub const DEFAULT_PALETTE: [[u8; 3]; 10] = [
    [78, 121, 167],
    [242, 142, 43],
    [89, 161, 79],
    [225, 87, 89],
    [118, 183, 178],
    [237, 201, 72],
    [176, 122, 161],
    [255, 157, 167],
    [156, 117, 95],
    [186, 176, 172],
];
