//! What a processed scan leaves behind: CAD files, triangles, points, surfaces and an NC program where
//! they are asked for, pictures, report, manifest.
//!
//! [`write`](fn@write) fills a directory that nobody looks at yet and syncs it; the caller
//! puts it in place by one rename. [`write_atomically`] is for a single file.
//!
//! The bytes follow from the arguments alone, timings in the report apart: the time of
//! the scan is given by the caller.

pub mod acceptance;
pub mod comparison;
mod deviations;
mod export;
mod extras;
pub mod features;
mod file;
mod filed;
mod further;
mod holes;
mod manifest;
mod meshes;
pub mod picture;
mod regular;
pub mod report;
mod shape;
mod stopwatch;
mod summary;
mod view;
mod write;

pub use acceptance::AcceptanceReport;
pub use comparison::ComparisonReport;
pub use export::{
    CadOptions, Entities, LengthUnit, Schema, WriteError, file_stem, write_iges, write_step,
    write_surfaces, write_trimmed,
};
pub use file::{hexadecimal, sha256_of, write_atomically};
pub use filed::{PageFormat, PageFormats, acceptance_page, comparison_page, scan_page};
pub use further::{
    CharacterLineFigures, FairingFigures, Further, MachineFile, MachineFileError, MillError,
    MillOf, Milled, OperationFigures, SectionFigures, SimulationFigures, SkinCounts, SkinDeviation,
    SkinFigures, SkinOptions, SkinReport, SkinSettingsReport, SurfaceFigures, SurfaceFormat,
    SurfaceReport, SurfaceSettingsReport, SurfaceWords, SurfacesError, ToolpathOptions,
    ToolpathReport, ToolpathSettingsReport, TrimmedFigures, cut_remark, mill, rows_of,
    skin_pictures, surface_pictures, surface_remarks, write_made,
};
pub use manifest::{MANIFEST_NAME, Manifest, ManifestFile};
pub use meshes::{
    MeasuredPoints, MeshFormat, MeshOptions, PointFormat, TrianglesError, mesh_report, triangles,
    write_measured, write_triangles,
};
pub use page::Page;
pub use report::{MeshReport, Report, ScanReport};
pub use stopwatch::Stopwatch;
pub use view::{VIEW_NAME, ViewError, write_view};
pub use write::{
    DeliverError, Delivered, Drawings, INLIERS_PICTURE_NAME, Inputs, PAGE_STEM, Pictures,
    RANGE_PICTURE_NAME, REGIONS_PICTURE_NAME, REPORT_NAME, RESIDUALS_PICTURE_NAME, draw_pictures,
    write, write_pictures,
};
