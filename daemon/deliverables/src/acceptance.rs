//! How well a scanner measures references: what `relief accept --report` writes.
//!
//! Units are part of the key names. Keys are only ever added.

use serde::{Deserialize, Serialize};

use crate::report::CalibrationReport;

/// A scanner held against references, in the manner of VDI/VDE 2634; no certificate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AcceptanceReport {
    /// Whether every figure that has a limit is within it.
    pub passed: bool,
    /// What was measured, as its file has it.
    pub reference: String,
    /// The scanner: model and serial number.
    pub scanner: String,
    /// The correction that was in use; `null` without one.
    pub calibration: Option<CalibrationReport>,
    /// The figures, the worst of all scans of each.
    pub figures: Vec<FigureReport>,
    /// The scans, in the order given.
    pub scans: Vec<AcceptedScan>,
    /// How figures repeat in scans of the same; empty for single scans.
    pub repeatability: Vec<RepeatabilityReport>,
    /// How figures change with time; empty for fewer than five scans of the same.
    pub drift: Vec<DriftReport>,
    /// What the user should know, in plain sentences.
    pub warnings: Vec<String>,
}

/// A figure against its limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FigureReport {
    /// Its key in the file of the reference, such as `probing_size_mm`.
    pub key: String,
    /// What it is, for people.
    pub name: String,
    /// The worst value of all scans, with its sign.
    pub worst: f64,
    /// The unit of value and limit: `mm` or `mm/h`.
    pub unit: String,
    /// The most that is permitted, without sign; `null` where nothing was said.
    pub limit: Option<f64>,
    /// Whether it is within the limit; `null` where there is none.
    pub passed: Option<bool>,
    /// How many values there are.
    pub count: usize,
}

/// What a scan shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AcceptedScan {
    /// Its id or file.
    pub scan: String,
    /// When it was taken, where that is known.
    pub started_at: Option<String>,
    /// Its spheres.
    pub spheres: Vec<SphereReport>,
    /// Distance of its two spheres less the true one.
    pub sphere_spacing_error_mm: Option<f64>,
    /// Range of the distances from the best plane.
    pub flatness_mm: Option<f64>,
    /// Error of each height of a step gauge against the first that is seen.
    pub step_errors_mm: Vec<Option<f64>>,
}

/// A sphere in a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SphereReport {
    /// Its centre.
    pub centre_mm: [f64; 3],
    /// Its diameter less the true one: probing error of size.
    pub size_error_mm: f64,
    /// Standard uncertainty of that from the samples' scatter.
    pub size_uncertainty_mm: f64,
    /// Range of the samples' distances from it: probing error of form.
    pub form_mm: f64,
    /// Standard deviation of these, strays left out.
    pub deviation_mm: f64,
    /// Samples on it.
    pub samples: usize,
    /// Samples left out, 3 of 1000.
    pub left_out: usize,
}

/// How a figure repeats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RepeatabilityReport {
    /// What repeats.
    pub figure: String,
    /// Mean of its values.
    pub mean_mm: f64,
    /// Standard deviation of single values.
    pub standard_deviation_mm: f64,
    /// Largest less smallest.
    pub range_mm: f64,
    /// How many values.
    pub count: usize,
}

/// How a figure changes with time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriftReport {
    /// What changes.
    pub figure: String,
    /// By how much in an hour.
    pub slope_mm_per_h: f64,
    /// Standard uncertainty of that.
    pub uncertainty_mm_per_h: f64,
    /// From the first to the last scan along the line.
    pub change_mm: f64,
    /// Hours after the first scan from which on it stayed where it was at last; `null` if it still
    /// moves.
    pub settled_after_h: Option<f64>,
}
