//! `report.json`: what was measured, how it was processed, what came of it.
//!
//! Units are part of the key names. Keys are only ever added; a number that does not
//! exist (the PSNR of an exact fit, say) is `null`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use crate::holes::{EvidenceReport, FillReport, HoleReport, RaysReport};

use crate::further::{
    SkinReport, SkinSettingsReport, SurfaceReport, SurfaceSettingsReport, ToolpathReport,
    ToolpathSettingsReport,
};

/// Everything that is known about one processed scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the part or scan; the CAD file carries it.
    pub name: String,
    /// When the scan was taken (or the moment its owner gave for it), RFC 3339.
    pub timestamp: String,
    /// Where the samples came from.
    pub scan: ScanReport,
    /// The settings that can change the result.
    pub settings: SettingsReport,
    /// The uniform range image.
    pub range_image: RangeImageReport,
    /// The surface regions of the part.
    pub regions: RegionsReport,
    /// Regions recognised as table, back plane or fixture, and removed.
    #[serde(default)]
    pub background: BackgroundReport,
    /// Nodes that belong to no region.
    #[serde(default)]
    pub crumbs: CrumbsReport,
    /// What became of the holes of the range image; absent where none were to be closed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fill: Option<FillReport>,
    /// The neighbours whose shapes were made to touch along a line.
    #[serde(default)]
    pub tangent: RegularitiesReport,
    /// The regularities that their shapes were given; `null` where none were looked for.
    #[serde(default)]
    pub regularities: Option<RegularitiesReport>,
    /// The trimmed faces made of them.
    pub model: ModelReport,
    /// The triangles of the model; absent where no file of them is asked for.
    #[serde(default)]
    pub mesh: Option<MeshReport>,
    /// The B-spline surface over the range image; absent where none is asked for, or none was made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceReport>,
    /// The surface skinned over sections of the range image; absent likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<SkinReport>,
    /// The NC program; absent likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub toolpath: Option<ToolpathReport>,
    /// How far the nodes lie off the faces; absent in reports of earlier versions.
    #[serde(default)]
    pub deviations: Option<DeviationsReport>,
    /// Signal-to-noise ratio of the whole restored image against the range image, its nodes next
    /// to outlines decided anew ([`RangeImageReport::dropped_nodes`]), decibels, as in Shim & Lee 1995: R in 0.1 mm, 7000 to 8000; a node that one has
    /// and the other lacks counts with its full value. Larger is nearer; `null` where
    /// both are equal.
    pub snr_db: Option<f64>,
    /// Nodes of that range image that lie outside every trimmed face.
    pub lost_nodes: usize,
    /// Nodes inside a trimmed face that it does not have.
    pub invented_nodes: usize,
    /// Duration of each stage, seconds.
    pub timings_s: BTreeMap<String, f64>,
    /// What the user should know, in plain sentences.
    pub warnings: Vec<String>,
    /// Versions of the programs that took part, by name.
    pub versions: BTreeMap<String, String>,
}

/// Where the samples came from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanReport {
    /// Identity of the scan in the service; absent for converted files.
    pub id: Option<String>,
    /// Name of the scanner in the service; absent for converted files, and for scans from
    /// before scanners had names.
    #[serde(default)]
    pub scanner: Option<String>,
    /// The scanner (model and serial number) or the file.
    pub source: String,
    /// Who took the scan.
    pub operator: Option<String>,
    /// What was scanned: part or serial number.
    pub part: Option<String>,
    /// Anything else worth keeping.
    pub note: Option<String>,
    /// Columns measured.
    pub columns: u64,
    /// Samples measured.
    pub samples: u64,
    /// Rays that brought no sample, where the source counts them.
    pub dropouts: Option<u64>,
    /// The correction of the scanner that was in use; `null` without one.
    #[serde(default)]
    pub calibration: Option<CalibrationReport>,
}

/// How a scanner was corrected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// When it was calibrated.
    pub date: String,
    /// Whole days from then to the scan; `null` where the scan's time is not known.
    pub age_days: Option<i64>,
    /// Root mean square of the distances of samples from the reference once corrected.
    pub residual_mm: f64,
    /// Deviations that were not determined.
    pub undetermined: Vec<String>,
}

/// The settings that can change the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SettingsReport {
    /// `relief` or `shim-lee`.
    pub method: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// Distance of neighbouring grid nodes.
    pub pitch_mm: f64,
    /// Samples looked at for a grid node.
    pub neighbours: usize,
    /// Planes tried for a grid node.
    pub draws: usize,
    /// Columns on either side in which the neighbours are sought.
    pub reach_columns: usize,
    /// How z at a node is estimated: `consensus`, `least-median`, `exhaustive-least-median`
    /// or `least-squares`.
    pub estimator: String,
    /// Clusters the segmentation begins with.
    pub clusters: usize,
    /// Change of direction at which two surfaces are kept apart.
    pub crease_angle_rad: f64,
    /// Offset at which two surfaces are kept apart, in pitches.
    pub step_factor: f64,
    /// Smaller regions are left out.
    pub minimum_nodes: usize,
    /// Regions that cover less, seen from the camera, are left out.
    #[serde(default)]
    pub minimum_area_mm2: f64,
    /// What is done with a table or back plane: `remove` or `keep`.
    #[serde(default)]
    pub background: String,
    /// What becomes of regions whose surfaces join smoothly: `split` or `keep`.
    #[serde(default)]
    pub smooth_joins: String,
    /// Which holes of the range image are closed: `off`, `auto` or `all`.
    #[serde(default)]
    pub fill: String,
    /// Largest of them.
    #[serde(default)]
    pub fill_max_size_mm: f64,
    /// Region of interest, least and greatest x; `null` where there is no limit.
    #[serde(default)]
    pub roi_x_mm: [Option<f64>; 2],
    /// Region of interest, least and greatest y.
    #[serde(default)]
    pub roi_y_mm: [Option<f64>; 2],
    /// Region of interest, least and greatest z.
    #[serde(default)]
    pub roi_z_mm: [Option<f64>; 2],
    /// Which kinds of surface faces may be of: `auto` or `freeform`.
    #[serde(default)]
    pub kinds: String,
    /// How many standard uncertainties a regularity may be off; `null` where none were looked
    /// for.
    #[serde(default)]
    pub regularize: Option<f64>,
    /// The unit that numbers are round in: `mm` or `inch`; `null` where none were looked for.
    #[serde(default)]
    pub regularize_units: Option<String>,
    /// Root mean square distance from the nodes at which a fitted surface is not made
    /// nearer still; no bound on how far it may lie off.
    pub tolerance_mm: f64,
    /// IGES entities of the surfaces: 114, 128, 190 for surfaces by their numbers, or 186 for
    /// shells of these.
    pub iges_entities: u16,
    /// What the STEP file follows: `ap242`, `ap214`, or `off` where there is none.
    #[serde(default)]
    pub step: String,
    /// The unit of lengths in the STEP file: `mm` or `inch`.
    #[serde(default)]
    pub step_units: String,
    /// Formats of the files of triangles: `stl`, `ply`, `3mf`, `glb`.
    #[serde(default)]
    pub meshes: Vec<String>,
    /// Farthest that a triangle may lie off the model.
    #[serde(default)]
    pub mesh_tolerance_mm: f64,
    /// Formats of the files of measured points: `ply`, `e57`.
    #[serde(default)]
    pub points: Vec<String>,
    /// How the B-spline surface was asked for; absent where it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceSettingsReport>,
    /// How the skinned surface was; absent likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<SkinSettingsReport>,
    /// How the NC program was; absent likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub toolpath: Option<ToolpathSettingsReport>,
}

/// The uniform range image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RangeImageReport {
    /// Distance of neighbouring nodes.
    pub pitch_mm: f64,
    /// Grid columns.
    pub columns: usize,
    /// Nodes in a column.
    pub rows: usize,
    /// Nodes that have a value.
    pub nodes: usize,
    /// Least z, `null` for an empty image.
    pub z_min_mm: Option<f64>,
    /// Greatest z, `null` for an empty image.
    pub z_max_mm: Option<f64>,
    /// Median over the nodes of the share of samples that agree with the node's surface.
    #[serde(default)]
    pub inlier_share: Option<f64>,
    /// Median over the nodes of the standard deviation of those samples about it.
    #[serde(default)]
    pub noise_mm: Option<f64>,
    /// Nodes beside borders that the samples around them gave to another region.
    #[serde(default)]
    pub claimed_nodes: usize,
    /// Nodes next to outlines that lost their value once these were settled by the samples.
    #[serde(default)]
    pub dropped_nodes: usize,
    /// Nodes next to outlines that got one then.
    #[serde(default)]
    pub filled_nodes: usize,
}

/// The surface regions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegionsReport {
    /// How many there are.
    pub count: usize,
    /// One entry for each, in the order of their labels.
    pub list: Vec<RegionReport>,
}

/// One surface region and how well its face fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegionReport {
    /// Its label, from 1.
    pub label: u16,
    /// What its surface is: `plane`, `sphere`, `cylinder`, `cone`, `torus`, or `bicubic patches`
    /// for a free form; `none` where no face could be made of it.
    pub kind: String,
    /// What shape its samples speak for, whatever the faces in the CAD file are made of.
    #[serde(default)]
    pub shape: Option<ShapeReport>,
    /// Names of its faces in the CAD file.
    pub faces: Vec<String>,
    /// Patches of its surfaces, in all.
    pub patches: usize,
    /// Its nodes in the range image.
    pub nodes: usize,
    /// Area of its trimmed faces on the surface.
    #[serde(default)]
    pub area_mm2: Option<f64>,
    /// Root mean square distance of the nodes from the surface, along z.
    pub rms_mm: Option<f64>,
    /// Largest distance of a node from the surface, along z.
    pub max_mm: Option<f64>,
    /// Peak signal-to-noise ratio of the surface at the region's nodes.
    pub psnr_db: Option<f64>,
    /// How many numbers its surfaces were given by what was measured; absent where none was made,
    /// and in reports of earlier versions.
    #[serde(default)]
    pub freedom: Option<FreedomReport>,
}

/// How far a surface is free to follow the noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FreedomReport {
    /// Numbers of the shape (3 for a plane to 7 for a torus), of motion and profile of what is swept,
    /// or coefficients of splines that were
    /// free to follow the nodes.
    pub parameters: usize,
    /// Independent values that determined them: samples for a shape that was fitted to these, else
    /// nodes, or the samples under these where they are fewer.
    pub independent: usize,
}

/// The shape of a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShapeReport {
    /// `plane`, `sphere`, `cylinder`, `cone`, `torus`, `extrusion`, `revolution` or `free-form`.
    pub family: String,
    /// Whether it is seen from within, as a bore or a fillet is; absent for a plane, an extrusion and
    /// a free form.
    pub hollow: Option<bool>,
    /// Its numbers; absent for a free form, and where the samples were not at hand.
    #[serde(default)]
    pub numbers: Option<ShapeNumbers>,
}

/// The numbers of a shape, in the part frame, fitted to the samples of the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShapeNumbers {
    /// Samples that they rest on.
    pub samples: usize,
    /// Root mean square distance of those samples from the shape, along its normal.
    pub rms_mm: f64,
    /// A point of a plane or extrusion amid the samples, or of the axis of a cylinder or revolution
    /// beside them; the centre of a sphere or torus; the apex of a cone.
    pub point_mm: [f64; 3],
    /// Standard uncertainty of the point where it is known least, of the ways that count: along
    /// the normal of a plane or extrusion, across the axis of a cylinder or revolution, all ways else.
    pub point_uncertainty_mm: f64,
    /// Unit normal of a plane towards the side that was seen; unit direction of an extrusion; unit
    /// axis of a cylinder, cone, torus or revolution.
    pub direction: Option<[f64; 3]>,
    /// Standard uncertainty of the direction, in the way in which it is known least.
    pub direction_uncertainty_deg: Option<f64>,
    /// Radius of a sphere or cylinder, or of the circle in the middle of a torus's tube.
    pub radius_mm: Option<Quantity>,
    /// Radius of a torus's tube.
    pub tube_radius_mm: Option<Quantity>,
    /// Angle between a cone's axis and surface.
    pub half_angle_deg: Option<Quantity>,
    /// The profile that an extrusion or a revolution is of; absent for others, and in reports of
    /// earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfileReport>,
}

/// A profile that is swept: a cubic spline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProfileReport {
    /// How many coefficients it has.
    pub coefficients: usize,
    /// Standard uncertainty along its normal, root mean square beside the samples.
    pub uncertainty_mm: f64,
}

/// A quantity, in the unit that its key names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// The best estimate.
    pub value: f64,
    /// Its standard uncertainty: the truth lies within twice as much in 95 of 100 cases.
    pub uncertainty: f64,
}

/// The regularities among the shapes of regions.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RegularitiesReport {
    /// Those that the shapes were given, in the order in which they were.
    pub accepted: Vec<RegularityReport>,
    /// What is nearly one, and why it is none.
    pub refused: Vec<RefusedReport>,
}

/// A regularity. What others imply is not listed: of three parallel planes, two pairs are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegularityReport {
    /// What it is, such as `parallel` or `equal radii`.
    pub kind: String,
    /// The regions that it ties.
    pub regions: Vec<u16>,
    /// What a round length is.
    pub value_mm: Option<f64>,
    /// What a round angle is.
    pub value_deg: Option<f64>,
    /// By how much places or sizes were off it, each shape by its own samples.
    pub off_mm: Option<f64>,
    /// By how much directions or half angles were.
    pub off_deg: Option<f64>,
    /// How far off it was when its turn came, in standard uncertainties: the root of chi-square.
    pub deviations: f64,
    /// Degrees of freedom of that.
    pub freedom: usize,
    /// Probability that what has it is measured to be so far off.
    pub p: f64,
    /// Probability that things without any tie are so near it.
    pub chance: f64,
    /// Most that a place or a size was moved by it.
    pub moved_mm: f64,
    /// Most that a direction or a half angle was turned by it.
    pub turned_deg: f64,
}

/// What is nearly a regularity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefusedReport {
    /// What it would be.
    pub kind: String,
    /// The regions that it would tie.
    pub regions: Vec<u16>,
    /// What a round length would be.
    pub value_mm: Option<f64>,
    /// What a round angle would be.
    pub value_deg: Option<f64>,
    /// By how much places or sizes are off it, each shape by its own samples.
    pub off_mm: Option<f64>,
    /// By how much directions or half angles are.
    pub off_deg: Option<f64>,
    /// How far off it was when its turn came, in standard uncertainties.
    pub deviations: f64,
    /// Probability that what has it is measured to be so far off.
    pub p: f64,
    /// Why it is none, in words.
    pub reason: String,
}

/// What was removed as background.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BackgroundReport {
    /// Regions removed.
    pub count: usize,
    /// Nodes removed, scraps beside the regions included.
    pub nodes: usize,
    /// One entry for each region.
    pub list: Vec<BackgroundRegionReport>,
}

/// One removed region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BackgroundRegionReport {
    /// `table`, `back plane` or `fixture`.
    pub kind: String,
    /// Its nodes in the range image.
    pub nodes: usize,
    /// Unit normal of its plane in the part frame; absent for a fixture.
    pub normal: Option<[f64; 3]>,
    /// Distance of its plane from the origin along the normal.
    pub offset_mm: Option<f64>,
    /// Root mean square distance of its nodes from the plane.
    pub rms_mm: Option<f64>,
    /// The evidence.
    pub why: String,
}

/// Nodes that belong to no region.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CrumbsReport {
    /// Connected pieces.
    pub count: usize,
    /// Nodes in all of them.
    pub nodes: usize,
    /// The largest of them, at most [`CrumbsReport::LISTED`].
    pub list: Vec<CrumbReport>,
}

impl CrumbsReport {
    /// Most crumbs that are listed one by one.
    pub const LISTED: usize = 50;
}

/// Connected nodes that belong to no region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrumbReport {
    /// How many.
    pub nodes: usize,
    /// Their mean place.
    pub centre_mm: [f64; 3],
}

/// The trimmed faces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelReport {
    /// Trimmed faces.
    pub faces: usize,
    /// Edges that two faces (or two loops of one) share.
    pub edges_shared: usize,
    /// Edges that bound one face only.
    pub free_edges: usize,
    /// How it is known where they run.
    #[serde(default)]
    pub edge_lengths: EdgeLengthsReport,
    /// The same for each kind of edge, `silhouette`, `step` and `crease`; empty in reports of
    /// earlier versions.
    #[serde(default)]
    pub edge_lengths_by_kind: BTreeMap<String, OriginLengthsReport>,
}

/// The triangles of the model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeshReport {
    /// How many there are.
    pub triangles: usize,
    /// Sides that belong to one of them only.
    pub free_edges: usize,
    /// Their area.
    pub area_mm2: f64,
    /// Farthest that one lies off the surface of its face.
    pub surface_mm: f64,
    /// Farthest that a point of a crease lies off one of its two surfaces, along z.
    pub seam_mm: f64,
}

/// Lengths of edges as the camera sees them, by how it is known where they run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EdgeLengthsReport {
    /// The samples beside them tell.
    pub measured_mm: f64,
    /// The surfaces of their two faces intersect there, or touch.
    pub intersected_mm: f64,
    /// They are drawn smoothly between nodes.
    pub assumed_mm: f64,
    /// Part of the last in all three, 0 to 1.
    pub assumed_share: f64,
}

/// Lengths of the edges of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct OriginLengthsReport {
    /// As [`EdgeLengthsReport::measured_mm`].
    pub measured_mm: f64,
    /// As [`EdgeLengthsReport::intersected_mm`].
    pub intersected_mm: f64,
    /// As [`EdgeLengthsReport::assumed_mm`].
    pub assumed_mm: f64,
}

/// Distances of the nodes from the trimmed faces along the normal of these, positive towards the
/// camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeviationsReport {
    /// Nodes under a face of their region; those beside outlines as these have settled them.
    pub nodes: usize,
    /// Nodes under a face of a region that they do not belong to, which have no deviation.
    pub elsewhere: usize,
    /// Mean.
    pub mean_mm: Option<f64>,
    /// Root mean square.
    pub rms_mm: Option<f64>,
    /// The size that 95 % do not exceed.
    pub percentile_95_mm: Option<f64>,
    /// The largest size.
    pub max_mm: Option<f64>,
    /// How often which occur.
    pub histogram: crate::comparison::HistogramReport,
    /// The largest, each the largest around it, at most [`DeviationsReport::WORST`].
    pub worst: Vec<WorstReport>,
}

impl DeviationsReport {
    /// Most places that are listed one by one.
    pub const WORST: usize = 10;
}

/// A node that lies far off its face.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WorstReport {
    /// Where it is.
    pub place_mm: [f64; 3],
    /// Label of the region of its face.
    pub region: u16,
    /// How far it lies off.
    pub deviation_mm: f64,
}
