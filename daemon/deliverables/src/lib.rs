//! What a processed scan leaves behind: CAD file, pictures, report, manifest.

pub mod file;
pub mod manifest;
pub mod picture;
pub mod report;
mod stopwatch;

pub use file::{sha256_of, sync_directory, write_atomically};
pub use manifest::{MANIFEST_NAME, Manifest, ManifestFile};
pub use report::Report;
pub use stopwatch::Stopwatch;
