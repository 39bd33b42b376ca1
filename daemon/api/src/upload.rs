//! Uploads: where copies of results go.

use serde::{Deserialize, Serialize};

use crate::webhook::Delivery;

/// Where copies of results go.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Upload {
    /// Its name.
    pub name: String,
    /// A folder, or the address of an object store or of a folder of another machine.
    pub to: String,
    /// Results that are still to be copied.
    pub waiting: usize,
    /// Results that had to make room since the service started: too many waited.
    #[serde(default)]
    pub dropped: u64,
    /// The copy that was tried last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latest: Option<Delivery>,
}

/// The uploads.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct UploadList {
    /// In the order of the configuration.
    pub uploads: Vec<Upload>,
}

/// What was copied.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct UploadRuns {
    /// Newest first, those that wait included: `about` is the scan.
    pub runs: Vec<Delivery>,
}
