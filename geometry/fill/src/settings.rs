//! What may be chosen.

use std::collections::BTreeSet;

use crate::error::FillError;
use crate::implicit::Kernel;

/// How a hole is closed once there is an implicit surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Elements on the zero set itself.
    Relief,
    /// Elements on a trimmed surface of Ferguson patches that are put through it (Yoo, section 3.2).
    Yoo,
}

/// The numbers in which new vertices will be written, so that they are checked as they will be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits, as in STL.
    Single,
    /// 64 bits.
    Double,
}

/// How holes are found and filled.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How a hole is closed.
    pub method: Method,
    /// The radial function; `None` for the method's own.
    pub kernel: Option<Kernel>,
    /// Longest edge of new triangles, millimetres; `None` for those of the triangles around.
    pub max_edge_mm: Option<f64>,
    /// Numbers of loops to be left open.
    pub keep: BTreeSet<usize>,
    /// Numbers of loops to be closed though they are borders of open sheets.
    pub force: BTreeSet<usize>,
    /// Vertices on borders that are so near are one, millimetres; `None` for a few units in the last
    /// place of single precision.
    pub weld_mm: Option<f64>,
    /// How new vertices will be written.
    pub precision: Precision,
    /// Whether base surfaces and their trims are wanted beside the triangles.
    pub patches: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Relief,
            kernel: None,
            max_edge_mm: None,
            keep: BTreeSet::new(),
            force: BTreeSet::new(),
            weld_mm: None,
            precision: Precision::Double,
            patches: false,
        }
    }
}

impl Settings {
    pub(crate) fn kernel(&self) -> Kernel {
        self.kernel.unwrap_or(match self.method {
            Method::Relief => Kernel::Quintic,
            Method::Yoo => Kernel::ThinPlate,
        })
    }

    /// Whether all are in their ranges.
    ///
    /// # Errors
    /// [`FillError::Setting`] with the first that is not.
    pub fn validate(&self) -> Result<(), FillError> {
        let lengths = [
            (
                "max-edge",
                self.max_edge_mm,
                f64::MIN_POSITIVE,
                "a length above 0",
            ),
            ("weld", self.weld_mm, 0.0, "a length of 0 or more"),
        ];
        for (name, value, least, expected) in lengths {
            if let Some(value) = value
                && !(value.is_finite() && value >= least)
            {
                return Err(FillError::Setting {
                    name,
                    value,
                    expected,
                });
            }
        }
        Ok(())
    }
}
