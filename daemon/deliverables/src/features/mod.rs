//! Recognised features as a file.

mod edits;
mod network;
mod picture;
mod step;

use std::collections::BTreeMap;
use std::io::Write;

use features::arrangement::{Along, Pattern};
use features::feature::Feature;
use features::floor::{Curve, CurveKind};
use features::recognise::Recognition;
use serde::Serialize;

pub use edits::{EditEntry, EditsError, read_edits};
pub use network::FeatureNetwork;
pub use picture::write_features_picture;
pub use step::{FeaturesStepError, features_solid, write_features_step};

/// Name of the file in the spool.
pub const FEATURES_NAME: &str = "features.json";

/// `features.json`.
#[derive(Debug, Clone, Serialize)]
pub struct FeaturesFile {
    units: &'static str,
    /// The plan in which outlines were measured.
    frame: FrameEntry,
    noise_mm: f64,
    pitch_mm: f64,
    /// The features, the block first, parents before what they hold.
    pub features: Vec<FeatureEntry>,
    /// Equal holes in rows and on circles.
    patterns: Vec<PatternEntry>,
    notes: Vec<String>,
}

#[derive(Debug, Clone, Serialize)]
struct FrameEntry {
    origin_mm: [f64; 3],
    x_axis: [f64; 3],
    y_axis: [f64; 3],
    z_axis: [f64; 3],
}

#[derive(Debug, Clone, Serialize)]
struct PatternEntry {
    kind: &'static str,
    members: Vec<u32>,
    /// Distance of neighbours.
    step_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    diameter_mm: Option<f64>,
}

/// One feature of the file.
#[derive(Debug, Clone, Serialize)]
pub struct FeatureEntry {
    /// Its number; the block is 0.
    pub id: u32,
    /// What it goes into or stands on.
    pub parent: Option<u32>,
    /// Its class, or `unknown`.
    #[serde(rename = "type")]
    pub class: String,
    /// How sure the network is of the class, 0 to 1; 1 where the user said so. Of treated edges the share
    /// of the samples that the section explains.
    pub score: f64,
    /// The code of its section (Jun & Park, Table 2).
    pub code: String,
    /// The middle of its outline, on the face that it goes into or stands on; of the block, on its
    /// top.
    pub center_mm: [f64; 3],
    /// Unit vector out of the material.
    pub axis: [f64; 3],
    /// Unit vector along its length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Its dimensions by their names.
    pub dimensions_mm: BTreeMap<&'static str, f64>,
    /// Their standard uncertainties, and those of the centre along the axes of `frame`.
    pub sigma_mm: SigmaEntry,
    /// The sphere or cylinder that its floor or top is part of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<FloorEntry>,
    /// Whether it goes through the part.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub through: bool,
    /// The thread that a hole may have, by its diameter; a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thread_guess: Option<&'static str>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Whether the user changed something of it; what is theirs has an uncertainty of 0.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub edited: bool,
}

/// A floor or top that is part of a sphere or a cylinder.
#[derive(Debug, Clone, Serialize)]
pub struct FloorEntry {
    /// `sphere` or `cylinder`.
    pub kind: &'static str,
    /// Its radius.
    pub radius_mm: f64,
    /// Standard uncertainty of that.
    pub sigma_mm: f64,
    /// Whether it is seen from within, as a groove is.
    pub hollow: bool,
    /// Unit vector along a cylinder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
}

impl FloorEntry {
    fn of(curve: &Curve) -> Self {
        Self {
            kind: curve.kind.as_str(),
            radius_mm: round(curve.radius.value_mm, LEAST_MM),
            sigma_mm: round(curve.radius.sigma_mm, LEAST_MM),
            hollow: curve.is_hollow,
            axis: match curve.kind {
                CurveKind::Sphere => None,
                CurveKind::Cylinder(axis) => Some(rounded(axis.into(), 1e-9)),
            },
        }
    }
}

/// Standard uncertainties, millimetres.
#[derive(Debug, Clone, Serialize)]
pub struct SigmaEntry {
    /// Of the dimensions, by their names.
    #[serde(flatten)]
    pub dimensions: BTreeMap<&'static str, f64>,
    /// Of the centre, along the axes of the plan.
    pub center: [f64; 3],
}

impl FeaturesFile {
    /// What was recognised, for a file.
    #[must_use]
    pub fn of(recognition: &Recognition) -> Self {
        let frame = &recognition.frame;
        let [x_axis, y_axis, z_axis] = frame.axes.map(|axis| rounded(axis.into(), 1e-9));
        Self {
            units: "mm",
            frame: FrameEntry {
                origin_mm: rounded(frame.origin_mm.into(), LEAST_MM),
                x_axis,
                y_axis,
                z_axis,
            },
            noise_mm: round(recognition.noise_mm, LEAST_MM),
            pitch_mm: round(recognition.pitch_mm, LEAST_MM),
            features: recognition.features.iter().map(FeatureEntry::of).collect(),
            patterns: recognition.patterns.iter().map(PatternEntry::of).collect(),
            notes: recognition.notes.clone(),
        }
    }

    /// Writes it.
    ///
    /// # Errors
    /// The sink's.
    pub fn write(&self, sink: &mut dyn Write) -> std::io::Result<()> {
        serde_json::to_writer_pretty(&mut *sink, self)?;
        sink.write_all(b"\n")
    }
}

impl PatternEntry {
    fn of(pattern: &Pattern) -> Self {
        Self {
            kind: match pattern.along {
                Along::Line => "line",
                Along::Circle => "circle",
            },
            members: pattern.members.clone(),
            step_mm: round(pattern.step_mm, LEAST_MM),
            diameter_mm: pattern.diameter_mm.map(|d| round(d, LEAST_MM)),
        }
    }
}

impl FeatureEntry {
    fn of(feature: &Feature) -> Self {
        let values = feature.dimensions.iter();
        Self {
            id: feature.id,
            parent: feature.parent,
            class: feature.class.clone(),
            score: round(feature.score, 1e-4),
            code: feature.code.clone(),
            center_mm: rounded(feature.centre_mm.into(), LEAST_MM),
            axis: rounded(feature.axis.into(), 1e-9),
            direction: feature.direction.map(|d| rounded(d.into(), 1e-9)),
            dimensions_mm: values
                .clone()
                .map(|d| (d.name, round(d.value_mm, LEAST_MM)))
                .collect(),
            sigma_mm: SigmaEntry {
                dimensions: values
                    .map(|d| (d.name, round(d.sigma_mm, LEAST_MM)))
                    .collect(),
                center: rounded(feature.centre_sigma_mm, LEAST_MM),
            },
            floor: feature.curve.as_ref().map(FloorEntry::of),
            through: feature.through,
            thread_guess: feature.thread(),
            warnings: feature.warnings.clone(),
            edited: feature.is_edited,
        }
    }
}

/// Lengths are written to a tenth of a micrometre.
const LEAST_MM: f64 = 1e-4;

fn rounded<const N: usize>(values: [f64; N], least: f64) -> [f64; N] {
    values.map(|value| round(value, least))
}

/// The nearest multiple of a power of ten below 1; never a negative zero.
fn round(value: f64, least: f64) -> f64 {
    let parts = (1.0 / least).round();
    (value * parts).round() / parts + 0.0
}
