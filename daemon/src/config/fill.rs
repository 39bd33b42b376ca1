//! Holes of range images that are closed.

use serde::{Deserialize, Serialize};

use super::value;

/// Which holes of the range image are closed; none unless something is set. Method `relief` only.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FillConfig {
    /// Which; `auto` where anything else of the section is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<FillMode>,
    /// Diameter of the largest circle that fits into a hole up to which it is closed.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub max_size_mm: Option<f64>,
    /// The holes at these places, x and y, stay open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keep_mm: Vec<[f64; 2]>,
    /// The holes at these places, x and y, are closed, whatever their size.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub close_mm: Vec<[f64; 2]>,
}

/// Which holes are closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FillMode {
    /// None.
    Off,
    /// Those that are no openings of the part, as far as can be told.
    Auto,
    /// All that are small enough.
    All,
}

impl FillConfig {
    pub(super) fn apply(&self, settings: &mut pipeline::FillSettings) {
        if *self == Self::default() {
            return;
        }
        settings.mode = match self.mode {
            Some(FillMode::Off) => pipeline::FillMode::Off,
            Some(FillMode::Auto) | None => pipeline::FillMode::Auto,
            Some(FillMode::All) => pipeline::FillMode::All,
        };
        if let Some(max_size_mm) = self.max_size_mm {
            settings.max_size_mm = max_size_mm;
        }
        settings.keep_mm.clone_from(&self.keep_mm);
        settings.close_mm.clone_from(&self.close_mm);
    }
}
