//! `manifest.json`: the files of a deliverable, so that a receiver can check them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::report::SettingsReport;

/// Name of the manifest in the directory it describes.
pub const MANIFEST_NAME: &str = "manifest.json";

/// What lies beside it, and how it came to be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Name of the part or scan.
    pub name: String,
    /// When the scan was taken, RFC 3339.
    pub timestamp: String,
    /// Name of the scanner in the service, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scanner: Option<String>,
    /// Every file but the manifest itself, in the order in which they were written.
    pub files: Vec<ManifestFile>,
    /// Versions of the programs that took part, by name.
    pub versions: BTreeMap<String, String>,
    /// Seed of every random draw.
    pub seed: u64,
    /// The settings that can change the result.
    pub settings: SettingsReport,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestFile {
    /// Name within the directory.
    pub name: String,
    /// Length.
    pub bytes: u64,
    /// SHA-256 of the content, 64 lower-case hexadecimal digits.
    pub sha256: String,
}
