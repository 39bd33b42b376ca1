//! Units of coordinates in files.

use clap::ValueEnum;
use scan_files::Units;

/// A unit as the user names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum UnitName {
    Mm,
    M,
    Inch,
}

impl UnitName {
    pub(crate) fn units(self) -> Units {
        match self {
            Self::Mm => Units::Millimetre,
            Self::M => Units::Metre,
            Self::Inch => Units::Inch,
        }
    }
}
