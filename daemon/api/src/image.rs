//! Range images, for showing.

use serde::{Deserialize, Serialize};

use crate::event::LiveColumn;
use crate::scan::SettingOverrides;

/// Nodes of a range image that are sent unless a request says otherwise.
pub const DEFAULT_NODES: u32 = 250_000;
/// Most nodes of a range image that a request may ask for.
pub const MAX_NODES: u32 = 4_000_000;

/// How much of a range image is wanted.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::IntoParams,
)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields, default)]
pub struct ImageRequest {
    /// Most nodes in the reply, 1 to [`MAX_NODES`]; [`DEFAULT_NODES`] unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(minimum = 1, maximum = 4000000)]
    pub most_nodes: Option<u32>,
}

/// The range image of a scan as far as it has come, perhaps thinned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScanImage {
    /// The scan.
    pub scan: String,
    /// Distance of neighbouring nodes of the lattice, millimetres.
    pub pitch_mm: f64,
    /// Every so manyth node of every so manyth column is sent. Indices are those of the whole
    /// lattice: node `k` of a column lies at `(i, j_first + k * step)` times the pitch.
    pub step: u32,
    /// The columns in the order of x.
    pub columns: Vec<LiveColumn>,
}

/// Asks what a kept scan's range image would be with other settings.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Regrid {
    /// Settings that differ from those of the scan, such as `regrid.pitch_mm`.
    #[serde(skip_serializing_if = "SettingOverrides::is_empty")]
    #[schema(schema_with = crate::scan::settings_schema)]
    pub settings: SettingOverrides,
    /// Most nodes in the reply, 1 to [`MAX_NODES`]; [`DEFAULT_NODES`] unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1, maximum = 4000000)]
    pub most_nodes: Option<u32>,
}

/// A kept scan's range image with other settings, and how it has come out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RegridImage {
    /// The range image, perhaps thinned.
    #[serde(flatten)]
    pub image: ScanImage,
    /// Nodes that have a value.
    pub nodes: u64,
    /// Median of what the inliers at nodes stray by, millimetres: the noise of single samples;
    /// absent where the estimator does not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_mm: Option<f64>,
    /// Median share of the samples at a node that agree with it, 0 to 1; absent where the
    /// estimator does not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inlier_share: Option<f64>,
    /// How long it took.
    pub seconds: f64,
}
