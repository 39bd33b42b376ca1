//! Frames as types, so that a position measured in one cannot be used in the other.
//!
//! ```text
//!        y up
//!        |          camera
//!        |         /
//!        |   <----o   looks along -z, steps its ray in the y-z plane
//!        |
//!        +--------- z towards the camera
//!       /
//!      x along the slide table
//! ```

use core::marker::PhantomData;

/// The camera's own frame: origin at the centre of projection, z along its optical axis
/// away from the part, y up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sensor;

/// The part's right-handed frame: x along the slide table, y up, z towards the camera. Of a scanner
/// with a correction x is square to the laser plane, and the table travels nearly along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part;

/// A position in millimetres in the frame `F`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position<F> {
    /// Along the slide table.
    pub x_mm: f64,
    /// Up.
    pub y_mm: f64,
    /// Along the optical axis; its sense depends on the frame.
    pub z_mm: f64,
    frame: PhantomData<F>,
}

impl<F> Position<F> {
    /// The position with these coordinates, in millimetres.
    #[must_use]
    pub const fn new(x_mm: f64, y_mm: f64, z_mm: f64) -> Self {
        Self {
            x_mm,
            y_mm,
            z_mm,
            frame: PhantomData,
        }
    }
}
