//! Surfaces and NC programs: what a scan is made into beside the trimmed model.

mod machine;
mod make;
mod milled;
mod options;
mod recognised;
mod report;
mod skinned;
mod surface_file;
mod surface_pictures;
mod surfaced;

pub use machine::{MachineFile, MachineFileError};
pub(crate) use make::write_further;
pub use milled::{MillError, Milled, OperationFigures, SimulationFigures, mill};
pub use options::{Further, MillOf, SkinOptions, ToolpathOptions};
pub use report::{
    SkinReport, SkinSettingsReport, SurfaceReport, SurfaceSettingsReport, ToolpathReport,
    ToolpathSettingsReport,
};
pub use skinned::{
    SectionFigures, SkinCounts, SkinDeviation, SkinFigures, cut_remark, rows_of, skin_pictures,
};
pub use surface_file::{SurfaceFormat, SurfacesError, write_made};
pub use surface_pictures::surface_pictures;
pub use surfaced::{
    CharacterLineFigures, FairingFigures, SurfaceFigures, SurfaceWords, TrimmedFigures,
    surface_remarks,
};
