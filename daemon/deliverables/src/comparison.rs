//! What came of holding a scan against its nominal: what `relief compare --report` writes.
//!
//! Units are part of the key names. Keys are only ever added.

use compare::{Alignment, CompareSettings, Comparison, Freedom, NodeState, Nominal, Region};
use range_image::RangeImage;
use serde::{Deserialize, Serialize};

use crate::ScanReport;

/// A scan held against its nominal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComparisonReport {
    /// Whether nothing lies significantly beyond the limits.
    pub passed: bool,
    /// Where the samples came from.
    pub scan: ScanReport,
    /// What they were held against.
    pub nominal: NominalReport,
    /// Deviations allowed; `null` where nothing was said.
    pub tolerance: Option<ToleranceReport>,
    /// How the scan was brought onto the nominal.
    pub alignment: AlignmentReport,
    /// The grid on which deviations are told.
    pub grid: GridReport,
    /// Standard deviation of single samples about their surface.
    pub noise_mm: f64,
    /// Points farther than this from the nominal belong to something else.
    pub limit_mm: f64,
    /// What the nodes are to the nominal.
    pub nodes: NodesReport,
    /// What the scan covers.
    pub coverage: CoverageReport,
    /// Deviations of the nodes compared.
    pub deviation: DeviationReport,
    /// The same in bins.
    pub histogram: HistogramReport,
    /// How significance was decided.
    pub decision: DecisionReport,
    /// What lies significantly beyond the limits, the worst first.
    pub regions: Vec<RegionOutReport>,
    /// What the user should know, in plain sentences.
    pub warnings: Vec<String>,
}

/// The nominal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NominalReport {
    /// Its file.
    pub source: String,
    /// Facets with an area.
    pub facets: usize,
    /// Lower corner of the box around it.
    pub low_mm: [f64; 3],
    /// Upper corner.
    pub high_mm: [f64; 3],
}

/// Least and greatest deviation allowed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ToleranceReport {
    /// Least.
    pub lower_mm: f64,
    /// Greatest.
    pub upper_mm: f64,
}

/// How the scan was brought onto the nominal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AlignmentReport {
    /// `best-fit` or `as-placed`.
    pub method: String,
    /// Rows of the homogeneous matrix that takes the scan's coordinates to the nominal's.
    pub matrix: [[f64; 4]; 4],
    /// Where it takes the origin.
    pub translation_mm: [f64; 3],
    /// Axis of its turning times the angle.
    pub rotation_vector_deg: [f64; 3],
    /// Root mean square distance of the points that took part; `null` as placed.
    pub rms_mm: Option<f64>,
    /// Iterations.
    pub iterations: usize,
    /// Starts tried.
    pub starts: usize,
    /// Whether the last step was negligible.
    pub settled: bool,
    /// Share of the nodes that lie near the nominal, 0 to 1.
    pub near_share: f64,
    /// Standard uncertainty of the scan's centroid along the nominal's axes; `null` as placed.
    pub translation_uncertainty_mm: Option<[f64; 3]>,
    /// The same of turnings about its axes.
    pub rotation_uncertainty_deg: Option<[f64; 3]>,
    /// Motions that the measured surfaces leave free, which were left as placed.
    pub free: Vec<FreedomReport>,
}

/// A motion that is free, in the nominal's frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FreedomReport {
    /// `sliding` or `turning`.
    pub motion: String,
    /// Unit vector: where to, or the axis.
    pub direction: [f64; 3],
    /// A point of the axis; `null` for a sliding.
    pub through_mm: Option<[f64; 3]>,
}

/// The grid on which deviations are told: the range image's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GridReport {
    /// Columns.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Distance of neighbouring nodes.
    pub pitch_mm: f64,
}

/// What the nodes are to the nominal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NodesReport {
    /// Nodes with a value.
    pub measured: usize,
    /// Those with a deviation.
    pub compared: usize,
    /// Those at steps and ends of the nominal, which have none.
    pub at_edges: usize,
    /// Those that belong to something else.
    pub foreign: usize,
    /// Share of the last among all that lie on the nominal, seen along z, 0 to 1.
    pub foreign_on_nominal_share: f64,
}

/// What the scan covers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CoverageReport {
    /// Area of the nominal that is seen along z.
    pub seen_area_mm2: f64,
    /// Share of it with nodes near, 0 to 1.
    pub covered_share: f64,
}

/// Deviations, positive where there is more material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DeviationReport {
    /// Mean.
    pub mean_mm: f64,
    /// Root mean square.
    pub rms_mm: f64,
    /// Standard deviation about the mean.
    pub standard_deviation_mm: f64,
    /// Least.
    pub min_mm: f64,
    /// Greatest.
    pub max_mm: f64,
    /// The size that 95 % do not exceed.
    pub percentile_95_mm: f64,
    /// Share of nodes within the tolerance, 0 to 1; `null` without one.
    pub within_tolerance_share: Option<f64>,
}

/// How often deviations of which size occur.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HistogramReport {
    /// Limits of the bins; one more than there are.
    pub limits_mm: Vec<f64>,
    /// Nodes in each.
    pub counts: Vec<usize>,
    /// Nodes below the first limit.
    pub below: usize,
    /// Nodes at or above the last.
    pub above: usize,
}

/// How significance was decided.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecisionReport {
    /// Limits beyond which deviations are told.
    pub lower_mm: f64,
    /// The upper of them.
    pub upper_mm: f64,
    /// A local mean must lie beyond by this many of its standard errors.
    pub standard_errors: f64,
    /// Local means looked at.
    pub means: usize,
    /// Probability that anything is told of a part that meets the limits, at most.
    pub false_alarm: f64,
    /// The sizes of patches.
    pub patches: Vec<PatchReport>,
}

/// What local means of one size are worth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PatchReport {
    /// Diameter.
    pub diameter_mm: f64,
    /// Means of this size.
    pub means: usize,
    /// Median of their standard errors.
    pub standard_error_mm: f64,
    /// How much larger these are than those of independent samples.
    pub inflation: f64,
    /// A mean so far beyond a limit is told.
    pub told_mm: f64,
}

/// An area significantly beyond a limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RegionOutReport {
    /// Its middle in the scan's frame.
    pub centre_mm: [f64; 3],
    /// Its middle in the nominal's frame.
    pub nominal_centre_mm: [f64; 3],
    /// Extent in x and y of the scan's frame.
    pub size_mm: [f64; 2],
    /// Area along the surface.
    pub area_mm2: f64,
    /// The greatest local mean in it.
    pub deviation_mm: f64,
    /// Its standard error.
    pub standard_error_mm: f64,
    /// By how many standard errors a mean in it lies beyond the limit, at most.
    pub standard_errors: f64,
    /// Nodes in it.
    pub nodes: usize,
}

/// Above this share of nodes before or behind the nominal the user is told.
const FOREIGN_TOLD: f64 = 0.001;
/// Below this share of the nominal covered the user is told.
const COVERED_TOLD: f64 = 0.8;

impl ComparisonReport {
    /// Tells a comparison. `warnings` are what is to be known of the files.
    #[must_use]
    pub fn new(
        comparison: &Comparison,
        image: &RangeImage,
        settings: &CompareSettings,
        scan: ScanReport,
        (nominal_source, nominal): (String, &Nominal),
        mut warnings: Vec<String>,
    ) -> Self {
        let states = |is: fn(NodeState) -> bool| comparison.count(is);
        let (low_mm, high_mm) = nominal.extent_mm();
        warnings.extend(remarks(comparison, settings));
        let statistics = comparison.statistics;
        Self {
            passed: comparison.passed(),
            scan,
            nominal: NominalReport {
                source: nominal_source,
                facets: nominal.facets(),
                low_mm,
                high_mm,
            },
            tolerance: settings.tolerance.map(|tolerance| ToleranceReport {
                lower_mm: tolerance.lower_mm,
                upper_mm: tolerance.upper_mm,
            }),
            alignment: alignment(comparison, settings.alignment),
            grid: GridReport {
                columns: image.columns(),
                rows: image.rows(),
                pitch_mm: image.pitch_mm(),
            },
            noise_mm: comparison.noise_mm,
            limit_mm: comparison.limit_mm,
            nodes: NodesReport {
                measured: states(|s| s != NodeState::Masked),
                compared: states(|s| matches!(s, NodeState::Compared(_))),
                at_edges: states(|s| s == NodeState::AtEdge),
                foreign: states(|s| s == NodeState::Foreign),
                foreign_on_nominal_share: comparison.foreign_on_nominal_share,
            },
            coverage: CoverageReport {
                seen_area_mm2: comparison.seen_area_mm2,
                covered_share: comparison.covered_share,
            },
            deviation: DeviationReport {
                mean_mm: statistics.mean_mm,
                rms_mm: statistics.rms_mm,
                standard_deviation_mm: statistics.standard_deviation_mm,
                min_mm: statistics.min_mm,
                max_mm: statistics.max_mm,
                percentile_95_mm: statistics.percentile_95_mm,
                within_tolerance_share: comparison.within_share,
            },
            histogram: HistogramReport {
                limits_mm: comparison.histogram.limits_mm.clone(),
                counts: comparison.histogram.counts.clone(),
                below: comparison.histogram.below,
                above: comparison.histogram.above,
            },
            decision: decision(comparison),
            regions: comparison.regions.iter().map(region).collect(),
            warnings,
        }
    }
}

fn alignment(comparison: &Comparison, method: Alignment) -> AlignmentReport {
    let found = &comparison.registration;
    let pose = found.pose;
    let uncertainty = found.uncertainty;
    AlignmentReport {
        method: method.as_str().to_owned(),
        matrix: pose.matrix(),
        translation_mm: pose.translation_mm(),
        rotation_vector_deg: pose.rotation_vector_rad().map(f64::to_degrees),
        rms_mm: found.rms_mm,
        iterations: found.iterations,
        starts: found.starts,
        settled: found.is_settled,
        near_share: found.near_share,
        translation_uncertainty_mm: uncertainty.map(|u| u.translation_mm),
        rotation_uncertainty_deg: uncertainty.map(|u| u.rotation_rad.map(f64::to_degrees)),
        free: found.free.iter().map(freedom).collect(),
    }
}

fn freedom(freedom: &Freedom) -> FreedomReport {
    let (motion, direction, through_mm) = match *freedom {
        Freedom::Sliding { direction } => ("sliding", direction, None),
        Freedom::Turning {
            axis, through_mm, ..
        } => ("turning", axis, Some(through_mm)),
    };
    FreedomReport {
        motion: motion.to_owned(),
        direction,
        through_mm,
    }
}

fn decision(comparison: &Comparison) -> DecisionReport {
    let decision = &comparison.decision;
    let patches = decision.patches.iter().map(|patch| PatchReport {
        diameter_mm: patch.diameter_mm,
        means: patch.means,
        standard_error_mm: patch.standard_error_mm,
        inflation: patch.inflation,
        told_mm: patch.told_mm,
    });
    DecisionReport {
        lower_mm: decision.lower_mm,
        upper_mm: decision.upper_mm,
        standard_errors: decision.standard_errors,
        means: decision.means,
        false_alarm: decision.false_alarm,
        patches: patches.collect(),
    }
}

fn region(region: &Region) -> RegionOutReport {
    RegionOutReport {
        centre_mm: region.centre_mm,
        nominal_centre_mm: region.nominal_centre_mm,
        size_mm: region.size_mm,
        area_mm2: region.area_mm2,
        deviation_mm: region.deviation_mm,
        standard_error_mm: region.standard_error_mm,
        standard_errors: region.standard_errors,
        nodes: region.nodes,
    }
}

fn remarks(comparison: &Comparison, settings: &CompareSettings) -> Vec<String> {
    let mut remarks = Vec::new();
    if comparison.covered_share < COVERED_TOLD {
        remarks.push(format!(
            "the scan covers {:.0} % of what can be seen of the nominal; nothing is said of the rest",
            100.0 * comparison.covered_share
        ));
    }
    if comparison.foreign_on_nominal_share > FOREIGN_TOLD {
        remarks.push(format!(
            "{:.2} % of the nodes on the nominal lie more than {} mm from it and were left out; \
             if they are the part's, choose a larger --limit-mm",
            100.0 * comparison.foreign_on_nominal_share,
            comparison.limit_mm
        ));
    }
    if !comparison.registration.is_settled {
        remarks.push("the registration had not come to rest after its last iteration".to_owned());
    }
    let finest = comparison.decision.patches.first();
    if let (Some(tolerance), Some(patch)) = (settings.tolerance, finest)
        && patch.told_mm > (tolerance.upper_mm - tolerance.lower_mm) / 2.0
    {
        remarks.push(format!(
            "the noise is large for the tolerance: over {:.1} mm a deviation is told once it is \
             {:.3} mm beyond it",
            patch.diameter_mm, patch.told_mm
        ));
    }
    remarks
}
