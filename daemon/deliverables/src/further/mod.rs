//! Surfaces and NC programs: what a scan is made into beside the trimmed model.

mod machine;
mod milled;
mod skinned;
mod surface_file;
mod surface_pictures;
mod surfaced;

pub use machine::{MachineFile, MachineFileError};
pub use milled::{MillError, Milled, OperationFigures, SimulationFigures, mill};
pub use skinned::{SectionFigures, SkinCounts, SkinDeviation, SkinFigures, cut_remark, rows_of};
pub use surface_file::{HeightSurface, SurfacesError, write_height_surfaces};
pub use surface_pictures::surface_pictures;
pub use surfaced::{
    CharacterLineFigures, FairingFigures, SurfaceFigures, SurfaceWords, surface_remarks,
};
