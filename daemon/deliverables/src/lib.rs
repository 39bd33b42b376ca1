//! What a processed scan leaves behind: CAD files, pictures, report, manifest.
//!
//! [`write`](fn@write) fills a directory that nobody looks at yet and syncs it; the caller
//! puts it in place by one rename. [`write_atomically`] is for a single file.
//!
//! The bytes follow from the arguments alone, timings in the report apart: the time of
//! the scan is given by the caller.

pub mod comparison;
mod export;
mod file;
mod manifest;
pub mod picture;
mod regular;
pub mod report;
mod shape;
mod stopwatch;
mod summary;
mod write;

pub use comparison::ComparisonReport;
pub use export::{
    CadOptions, Entities, LengthUnit, Schema, WriteError, file_stem, write_iges, write_step,
};
pub use file::{hexadecimal, sha256_of, write_atomically};
pub use manifest::{MANIFEST_NAME, Manifest, ManifestFile};
pub use report::{Report, ScanReport};
pub use stopwatch::Stopwatch;
pub use write::{
    DeliverError, Delivered, INLIERS_PICTURE_NAME, Inputs, Pictures, RANGE_PICTURE_NAME,
    REGIONS_PICTURE_NAME, REPORT_NAME, RESIDUALS_PICTURE_NAME, write, write_pictures,
};
