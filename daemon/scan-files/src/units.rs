//! Units of the coordinates in a file.

use std::str::FromStr;

/// Unit of length of the coordinates in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Units {
    /// Millimetres.
    Millimetre,
    /// Metres.
    Metre,
    /// Inches of 25.4 mm.
    Inch,
}

impl Units {
    /// Millimetres in one unit.
    #[must_use]
    pub fn in_mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Metre => 1000.0,
            Self::Inch => 25.4,
        }
    }
}

impl FromStr for Units {
    type Err = String;

    /// `mm`, `m` or `inch` (also `in`).
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "mm" => Ok(Self::Millimetre),
            "m" => Ok(Self::Metre),
            "inch" | "in" => Ok(Self::Inch),
            other => Err(format!("unit `{other}` is not known; use mm, m or inch")),
        }
    }
}
