//! What may be asked for.

use toolpath::Machine;

use super::machine::MachineFile;
use super::report::{SkinSettingsReport, SurfaceSettingsReport, ToolpathSettingsReport};
use crate::features::{EditEntry, FeatureNetwork};

/// What is made of a scan beside the trimmed model. Nothing by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Further {
    /// One B-spline surface over the range image.
    pub surface: Option<surfacing::Settings>,
    /// A surface skinned over sections of the range image.
    pub skin: Option<SkinOptions>,
    /// An NC program.
    pub toolpath: Option<ToolpathOptions>,
    /// Machining features, as this network tells them, and the part rebuilt from them.
    pub features: Option<FeatureNetwork>,
    /// What is changed of them.
    pub edits: Vec<EditEntry>,
}

/// How a surface is skinned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinOptions {
    /// The skinning itself.
    pub settings: skin::Settings,
    /// Distance of the sections, millimetres; each row of the range image without it.
    pub every_mm: Option<f64>,
}

/// What is milled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MillOf {
    /// The trimmed model.
    #[default]
    Model,
    /// The B-spline surface.
    Surface,
}

impl MillOf {
    /// The word for it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Model => "model",
            Self::Surface => "surface",
        }
    }
}

/// How something is milled.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolpathOptions {
    /// What.
    pub of: MillOf,
    /// How.
    pub settings: toolpath::Settings,
    /// Distance of the simulation's nodes, millimetres; after the model's size without it.
    pub pitch_mm: Option<f64>,
    /// On what, as its file has it.
    pub file: MachineFile,
    /// The same, checked.
    pub machine: Machine,
}

impl Further {
    pub(crate) fn surface_settings(&self) -> Option<SurfaceSettingsReport> {
        self.surface.map(|settings| SurfaceSettingsReport {
            tolerance_mm: settings.tolerance_mm,
            knots: settings.placement.as_str().to_owned(),
            thresholds: settings.thresholds.0,
            fair_mm: settings.fair_mm,
        })
    }

    pub(crate) fn skin_settings(&self) -> Option<SkinSettingsReport> {
        self.skin.map(|options| SkinSettingsReport {
            tolerance_mm: options.settings.tolerance_mm,
            method: match options.settings.method {
                skin::Method::Relief => "relief",
                skin::Method::Jo => "jo",
            }
            .to_owned(),
            degree: options.settings.degree_across,
            every_mm: options.every_mm,
        })
    }

    pub(crate) fn toolpath_settings(&self) -> Option<ToolpathSettingsReport> {
        self.toolpath.as_ref().map(|options| {
            let settings = &options.settings;
            ToolpathSettingsReport {
                of: options.of.as_str().to_owned(),
                tool: settings.finish.to_string(),
                rough: settings.rough.map(|cutter| cutter.to_string()),
                scallop_mm: settings.scallop_mm,
                tolerance_mm: settings.tolerance_mm,
                pattern: match settings.pattern {
                    toolpath::Pattern::Parallel => "parallel",
                    toolpath::Pattern::Scallop => "scallop",
                }
                .to_owned(),
                angle_deg: settings.angle_deg,
                allowance_mm: settings.allowance_mm,
                arcs: settings.arcs,
                pitch_mm: options.pitch_mm,
                machine: options.file.clone(),
            }
        })
    }
}
