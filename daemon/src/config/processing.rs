//! Settings that decide what a job makes of a scan. They are kept with the scan.

use std::collections::BTreeSet;

use deliverables::features::EditEntry;
use deliverables::{MeshFormat, MeshOptions, PointFormat};
use pipeline::Settings;
use scan_files::recommended_pitch_mm;
use serde::{Deserialize, Serialize};

use super::fill::FillConfig;
use super::further::{self, SkinConfig, SurfaceConfig, ToolpathConfig};
use super::network::NetworkChoice;
use super::regularities::{Regularize, RegularizeUnits};
use super::{formats, value};

/// Settings that decide what a job makes of a scan. Whatever is left out follows the
/// default of its stage.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Processing {
    /// From samples to the uniform range image.
    pub regrid: RegridConfig,
    /// From the range image to regions.
    pub segment: SegmentConfig,
    /// Which holes of the range image are closed.
    pub fill: FillConfig,
    /// From regions to trimmed surfaces.
    pub reconstruct: ReconstructConfig,
    /// What is left in the spool.
    pub deliverables: DeliverablesConfig,
}

/// From samples to the uniform range image.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RegridConfig {
    /// Distance of the grid's nodes; fitted to the scan's density if left out.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub pitch_mm: Option<f64>,
    /// Samples looked at for a node (M).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub neighbours: Option<usize>,
    /// Planes tried for a node (N_s).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub draws: Option<usize>,
    /// Columns to either side in which a node's samples are sought.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reach_columns: Option<usize>,
    /// How z at a node is estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimator: Option<Estimator>,
    /// Seed of every random draw, those of the segmentation included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Samples with x outside of these limits are ignored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roi_x_mm: Option<[f64; 2]>,
    /// Samples with y outside of these limits are ignored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roi_y_mm: Option<[f64; 2]>,
    /// Samples with z outside of these limits are ignored, such as a back plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roi_z_mm: Option<[f64; 2]>,
}

/// How z at a node is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The surface that most of the evidence near the node speaks for: withstands outliers,
    /// also at step edges.
    Consensus,
    /// The plane with the least median of squared residuals, the paper's.
    LeastMedian,
    /// The same over all planes through three samples, for comparison: slow.
    ExhaustiveLeastMedian,
    /// The plane with the least sum of squared residuals, for comparison.
    LeastSquares,
}

/// Which road is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Ours.
    Relief,
    /// Shim & Lee 1995 as printed.
    ShimLee,
}

/// What is done with a recognised table, back plane or fixture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BackgroundPolicy {
    /// It gives no faces; the report lists it.
    Remove,
    /// Nothing is looked for; every region is a face of the part.
    Keep,
}

/// What becomes of a region of several surfaces that join smoothly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SmoothJoins {
    /// It is taken apart into faces of one kind each.
    Split,
    /// It stays one.
    Keep,
}

/// Which kinds of surface faces may be of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kinds {
    /// Planes, spheres, cylinders, cones and tori where the samples speak for them.
    Auto,
    /// Free forms all.
    FreeForm,
}

/// From the range image to regions.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SegmentConfig {
    /// Which road is taken; that of `reconstruct.method` if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Method>,
    /// Clusters before merging (B).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clusters: Option<usize>,
    /// Change of direction at which two surfaces are kept apart.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub crease_angle_rad: Option<f64>,
    /// Offset at which two surfaces are kept apart, in pitches.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub step_factor: Option<f64>,
    /// Smaller regions are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_nodes: Option<usize>,
    /// Regions that cover less, seen from the camera, are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_area_mm2: Option<f64>,
    /// What is done with a recognised table, back plane or fixture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundPolicy>,
    /// What becomes of a region of several surfaces that join smoothly; kinds `auto` of method
    /// `relief` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smooth_joins: Option<SmoothJoins>,
}

/// From regions to trimmed surfaces.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReconstructConfig {
    /// Which road is taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Method>,
    /// Which kinds of surface faces may be of; method `relief` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kinds: Option<Kinds>,
    /// Whether shapes are given the regularities that they are likely to have, and within how
    /// many standard uncertainties; method `relief` with kinds `auto` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regularize: Option<Regularize>,
    /// The unit that numbers are round in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regularize_units: Option<RegularizeUnits>,
    /// Root mean square distance from the range image at which a surface is near enough and
    /// gets no further knots; no bound on how far it may lie off.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub tolerance_mm: Option<f64>,
    /// Most knots of a fitted spline along a side; method `relief` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub knots_per_side: Option<usize>,
    /// Width of a patch in thirds, in grid pitches; method `shim-lee` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patch_third_nodes: Option<usize>,
    /// Least turn of a border that makes a vertex.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub corner_angle_rad: Option<f64>,
}

/// What is left in the spool.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeliverablesConfig {
    /// IGES entities of the surfaces: 114 (parametric splines), 128 (rational B-splines), 190
    /// (planes, cylinders, cones, spheres and tori by their numbers, other faces as 128), or 186
    /// (the same as shells on common edges).
    #[serde(deserialize_with = "entities", skip_serializing_if = "Option::is_none")]
    pub entities: Option<u16>,
    /// What the STEP file beside the IGES file follows, or that there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<StepChoice>,
    /// The unit of lengths in the STEP file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_units: Option<StepUnits>,
    /// Formats of the files of triangles: `stl`, `ply`, `3mf`, `glb`. None if left out.
    #[serde(
        deserialize_with = "formats::meshes",
        serialize_with = "formats::meshes_told",
        skip_serializing_if = "BTreeSet::is_empty"
    )]
    pub meshes: BTreeSet<MeshFormat>,
    /// Farthest that a triangle may lie off the model.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub mesh_tolerance_mm: Option<f64>,
    /// Formats of the files of measured points: `ply`, `e57`. None if left out.
    #[serde(
        deserialize_with = "formats::points",
        serialize_with = "formats::points_told",
        skip_serializing_if = "BTreeSet::is_empty"
    )]
    pub points: BTreeSet<PointFormat>,
    /// In which forms the page that can be filed is left; none if empty.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub page: Option<Vec<PageChoice>>,
    /// One B-spline surface over the range image; none if left out.
    #[serde(
        deserialize_with = "further::or_off",
        skip_serializing_if = "Option::is_none"
    )]
    pub surface: Option<SurfaceConfig>,
    /// A surface skinned over sections of the range image; none if left out.
    #[serde(
        deserialize_with = "further::or_off",
        skip_serializing_if = "Option::is_none"
    )]
    pub skin: Option<SkinConfig>,
    /// An NC program; none if left out.
    #[serde(
        deserialize_with = "further::or_off",
        skip_serializing_if = "Option::is_none"
    )]
    pub toolpath: Option<ToolpathConfig>,
    /// Whether machining features are recognised, and the part rebuilt from them.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub features: bool,
    /// The network that tells them; the one that is built in if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub features_network: Option<NetworkChoice>,
    /// What is changed of the features of one scan; given with a rerun.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub edit: Vec<EditEntry>,
    /// Author in the CAD file's header; the scan's operator if left out.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub author: String,
    /// Organisation in the CAD file's header.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub organisation: String,
}

impl DeliverablesConfig {
    /// Which files of triangles and of points are written.
    #[must_use]
    pub fn mesh_options(&self) -> MeshOptions {
        let defaults = MeshOptions::default();
        MeshOptions {
            meshes: self.meshes.clone(),
            tolerance_mm: self.mesh_tolerance_mm.unwrap_or(defaults.tolerance_mm),
            points: self.points.clone(),
        }
    }
}

/// What a STEP file follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StepChoice {
    /// ISO 10303-242.
    #[default]
    Ap242,
    /// ISO 10303-214.
    Ap214,
    /// There is no STEP file.
    Off,
}

/// A form of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PageChoice {
    /// One HTML file.
    Html,
    /// PDF on A4.
    Pdf,
}

/// A unit of lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StepUnits {
    /// Millimetre.
    #[default]
    Mm,
    /// Inch of 25.4 mm.
    Inch,
}

fn entities<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<u16>, D::Error> {
    match Option::<i64>::deserialize(deserializer)? {
        None => Ok(None),
        Some(114) => Ok(Some(114)),
        Some(128) => Ok(Some(128)),
        Some(186) => Ok(Some(186)),
        Some(190) => Ok(Some(190)),
        Some(other) => Err(serde::de::Error::custom(format!(
            "{other} is no surface entity that can be written: use 114, 128, 190 or 186"
        ))),
    }
}

impl Processing {
    /// The settings of every stage, for a scan of this density. Spacings in millimetres,
    /// 0 where unknown.
    #[must_use]
    pub fn pipeline_settings(&self, column_pitch_mm: f64, sample_spacing_mm: f64) -> Settings {
        let pitch_mm = self.regrid.pitch_mm.unwrap_or_else(|| {
            let known = [column_pitch_mm, sample_spacing_mm].map(|mm| mm > 0.0 && mm.is_finite());
            match known {
                [false, false] => FALLBACK_PITCH_MM,
                [false, true] => recommended_pitch_mm(sample_spacing_mm, sample_spacing_mm),
                _ => recommended_pitch_mm(column_pitch_mm, sample_spacing_mm.max(0.0)),
            }
        });
        let mut settings = Settings::new(pitch_mm);
        if let Some(method) = self.reconstruct.method {
            settings = settings.with_method(method.into());
        }
        if let Some(seed) = self.regrid.seed {
            settings = settings.with_seed(seed);
        }
        self.regrid.apply(&mut settings.regrid);
        self.segment.apply(&mut settings.segment);
        self.fill.apply(&mut settings.fill);
        set(
            &mut settings.background,
            self.segment.background.map(|policy| match policy {
                BackgroundPolicy::Remove => pipeline::BackgroundPolicy::Remove,
                BackgroundPolicy::Keep => pipeline::BackgroundPolicy::Keep,
            }),
        );
        set(
            &mut settings.smooth_joins,
            self.segment.smooth_joins.map(|joins| match joins {
                SmoothJoins::Split => pipeline::SmoothJoins::Split,
                SmoothJoins::Keep => pipeline::SmoothJoins::Keep,
            }),
        );
        set(
            &mut settings.kinds,
            self.reconstruct.kinds.map(|kinds| match kinds {
                Kinds::Auto => pipeline::Kinds::Auto,
                Kinds::FreeForm => pipeline::Kinds::FreeForm,
            }),
        );
        let units = self.reconstruct.regularize_units;
        set(
            &mut settings.regularize,
            self.reconstruct
                .regularize
                .map(|regularize| regularize.settings(units)),
        );
        self.reconstruct.apply(&mut settings.reconstruct);
        settings
    }

    /// The first section that cannot be used, and why.
    pub(super) fn check(&self) -> Result<(), (&'static str, String)> {
        let meshes = self.deliverables.mesh_options().check();
        meshes.map_err(|error| ("deliverables", format!("mesh_{error}")))?;
        self.deliverables.further()?;
        // The pitch is checked where it is read; any other serves here.
        self.pipeline_settings(FALLBACK_PITCH_MM, FALLBACK_PITCH_MM)
            .validate()
            .map_err(|error| (error.stage, error.message))
    }
}

/// Pitch where nothing is known of a scan's density; a tenth of a 5 mm feature.
const FALLBACK_PITCH_MM: f64 = 0.5;

fn set<T>(place: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *place = value;
    }
}

impl RegridConfig {
    fn apply(&self, settings: &mut regrid::RegridSettings) {
        if let Some(estimator) = self.estimator {
            *settings = settings.with_estimator(match estimator {
                Estimator::Consensus => regrid::Estimator::Consensus,
                Estimator::LeastMedian => regrid::Estimator::LeastMedian,
                Estimator::ExhaustiveLeastMedian => regrid::Estimator::ExhaustiveLeastMedian,
                Estimator::LeastSquares => regrid::Estimator::LeastSquares,
            });
        }
        set(&mut settings.neighbours, self.neighbours);
        set(&mut settings.draws, self.draws);
        set(&mut settings.reach_columns, self.reach_columns);
        let roi = &mut settings.roi;
        set(&mut roi.x_mm, self.roi_x_mm.map(Into::into));
        set(&mut roi.y_mm, self.roi_y_mm.map(Into::into));
        set(&mut roi.z_mm, self.roi_z_mm.map(Into::into));
    }
}

impl SegmentConfig {
    fn apply(&self, settings: &mut segment::SegmentSettings) {
        set(
            &mut settings.method,
            self.method
                .map(|method| pipeline::Method::from(method).into()),
        );
        set(&mut settings.clusters, self.clusters);
        set(&mut settings.crease_angle_rad, self.crease_angle_rad);
        set(&mut settings.step_factor, self.step_factor);
        set(&mut settings.minimum_nodes, self.minimum_nodes);
        set(&mut settings.minimum_area_mm2, self.minimum_area_mm2);
    }
}

impl ReconstructConfig {
    fn apply(&self, settings: &mut reconstruct::ReconstructSettings) {
        set(&mut settings.tolerance_mm, self.tolerance_mm);
        set(&mut settings.knots_per_side, self.knots_per_side);
        set(&mut settings.patch_third_nodes, self.patch_third_nodes);
        set(&mut settings.corner_angle_rad, self.corner_angle_rad);
    }
}

impl From<Method> for pipeline::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Relief => Self::Relief,
            Method::ShimLee => Self::ShimLee,
        }
    }
}
