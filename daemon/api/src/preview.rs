//! What a scan would be, before it is begun.

use serde::{Deserialize, Serialize};

use crate::scan::SettingOverrides;

/// What a [`crate::StartScan`] would come to, with nothing moved and nothing kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ScanPreview {
    /// Name of the scanner.
    pub scanner: String,
    /// Columns.
    pub columns: u32,
    /// Distance of neighbouring columns, millimetres.
    pub column_pitch_mm: f64,
    /// x of the first and of the last column in the part frame, millimetres.
    pub x_mm: [f64; 2],
    /// Samples in a column.
    pub samples: u16,
    /// y of the first and of the last sample, millimetres; of a head that turns its ray, where
    /// z is 0. `None` where the rays do not meet that plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y_mm: Option<[f64; 2]>,
    /// Distance of neighbouring samples of a column there, millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_spacing_mm: Option<f64>,
    /// Exposure of a sample, microseconds; 0 leaves it to the scanner.
    pub exposure_us: u32,
    /// Least time for the columns at the scanner's greatest line rate, seconds; `None` if it
    /// names none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_s: Option<f64>,
    /// Nodes of the range image, columns and rows, if all that is in view is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid_nodes: Option<[u64; 2]>,
    /// Diameter of the circle from which a node's samples come, where none is missing,
    /// millimetres: what is smaller than a part of it is smoothed away.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window_mm: Option<f64>,
    /// The least area, seen from the camera, that becomes a face, square millimetres.
    pub least_face_mm2: f64,
    /// The settings that shape the result, those included that follow from the scan.
    #[schema(schema_with = crate::scan::settings_schema)]
    pub settings: SettingOverrides,
    /// Room that is set aside for the columns, bytes.
    pub journal_bytes: u64,
    /// Why the scan would be refused at this moment, if it would.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// What one may want to know of these settings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}
