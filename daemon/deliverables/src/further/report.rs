//! What the report says of surfaces and NC programs, and of how they were asked for.

use serde::{Deserialize, Serialize};

use super::machine::MachineFile;
use super::milled::{OperationFigures, SimulationFigures};
use super::skinned::SkinFigures;
use super::surfaced::{CharacterLineFigures, FairingFigures, SurfaceFigures};

/// How the B-spline surface was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceSettingsReport {
    /// Greatest distance in z between surface and grid.
    pub tolerance_mm: f64,
    /// How knots were placed: `optimal`, `uniform`, `polyline` or `derivative`.
    pub knots: String,
    /// Jumps of z and its first three derivatives that are breaks; for derivative knots.
    pub thresholds: [f64; 4],
    /// Bound of fairing, where there was any.
    pub fair_mm: Option<f64>,
}

/// How the skinned surface was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkinSettingsReport {
    /// No data point is farther from the surface.
    pub tolerance_mm: f64,
    /// `relief` or `jo`.
    pub method: String,
    /// Degree across sections.
    pub degree: usize,
    /// Distance of the sections; `null` for each row of the grid.
    pub every_mm: Option<f64>,
}

/// How the NC program was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToolpathSettingsReport {
    /// What was milled: `model` or `surface`.
    pub of: String,
    /// The finishing cutter.
    pub tool: String,
    /// The roughing cutter, where there was one.
    pub rough: Option<String>,
    /// Height of the cusps between finishing passes.
    pub scallop_mm: f64,
    /// How far above contact the cutter was led.
    pub tolerance_mm: f64,
    /// `parallel` or `scallop`.
    pub pattern: String,
    /// Direction of the passes from x towards y.
    pub angle_deg: f64,
    /// What roughing left.
    pub allowance_mm: f64,
    /// Whether there are arcs.
    pub arcs: bool,
    /// Distance of the simulation's nodes; `null` where it followed the model's size.
    pub pitch_mm: Option<f64>,
    /// The machine, as its file had it when the configuration was read.
    pub machine: MachineFile,
}

/// One B-spline surface over the range image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceReport {
    /// Its file.
    pub file: String,
    /// Distance of the grid's nodes.
    pub pitch_mm: f64,
    /// Greatest distance in z that was asked for.
    pub tolerance_mm: f64,
    /// Noise of the grid, one standard deviation.
    pub noise_mm: f64,
    /// What it comes to.
    pub surface: SurfaceFigures,
    /// Lines along the grid on which z or the slope jumps.
    pub character_lines: Vec<CharacterLineFigures>,
    /// What fairing did, where it was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fairing: Option<FairingFigures>,
}

/// A surface skinned over sections of the range image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkinReport {
    /// Its file.
    pub file: String,
    /// Distance of the sections.
    pub every_mm: f64,
    /// What it comes to.
    #[serde(flatten)]
    pub figures: SkinFigures,
}

/// An NC program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToolpathReport {
    /// Its file.
    pub file: String,
    /// What it mills: `model` or `surface`.
    pub of: String,
    /// Triangles of that.
    pub triangles: usize,
    /// Operations in the order in which they are made.
    pub operations: Vec<OperationFigures>,
    /// Estimated time of them all.
    pub total_s: f64,
    /// What the simulated removal left.
    pub simulation: SimulationFigures,
}
