//! The stages in their order.

use faces::{Divided, Observations};
use range_image::{Cancelled, Column, RangeImage, RegionMap};
use reconstruct::metrics::compare;
use reconstruct::{Evidence, Fitted, Known, Method, ReconstructError, Reconstruction};
use regrid::RegridError;
use segment::SegmentError;

use crate::claims;
use crate::columns::{Columns, InMemory, ReadAgainError, Within};
use crate::filling::{Filling, fill};
use crate::kinds::samples::{OnRegion, of_regions};
use crate::kinds::{RegionKind, kinds};
use crate::outlines::{self, Removed, SettledNodes, settle_nodes};
use crate::part::divide;
use crate::regular::{self, Regularities, Tangent};
use crate::{Background, Crumb, Kinds, NodeRole, View};
use crate::{Observer, Settings, SettingsError, SmoothJoins, Stage};

/// What became of a range image.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The regions of the part; those of the background have label 0.
    pub regions: RegionMap,
    /// What was recognised as background and removed. Its labels are those before the
    /// removal; what they lay at is told by `roles`.
    pub background: Background,
    /// What each node counts as, column by column as [`RangeImage::raw_z_mm`].
    pub roles: Vec<NodeRole>,
    /// Connected nodes that belong to no region, the largest first.
    pub crumbs: Vec<Crumb>,
    /// What kind of surface each region of the part is, in the order of their labels.
    pub kinds: Vec<RegionKind>,
    /// The neighbours that were made to touch along a line.
    pub tangent: Tangent,
    /// The regularities that their shapes were given; `None` where none were looked for.
    pub regularities: Option<Regularities>,
    /// The model made of them, and how well it fits.
    pub reconstruction: Reconstruction,
    /// Nodes beside borders that the samples around them gave to another region than the segmentation
    /// did, with their height on its surface: where faces run out in tips, most of all.
    pub claimed_nodes: usize,
    /// What became of its holes; `None` where none were to be closed.
    pub filling: Option<Filling>,
    /// The part's range image with the nodes beside its borders and outlines decided anew. The
    /// reconstruction's metrics are against it. `None` where there were no samples to decide them by:
    /// then they are against the range image as it was.
    pub settled: Option<SettledNodes>,
    /// The stages that ran, in order.
    pub stages: Vec<Stage>,
}

/// Why there is no model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// The caller asked for an end.
    #[error("cancelled")]
    Cancelled,
    /// A setting lies outside its limits.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// No node of the grid has a value.
    #[error("nothing was measured: no node of the grid has a value")]
    NothingMeasured,
    /// No node of the grid lies in the region of interest.
    #[error("nothing was measured in the region of interest: {roi}")]
    NothingInRoi {
        /// Its limits.
        roi: String,
    },
    /// The grid has values, but no surface.
    #[error("no surface was found among the {nodes} nodes measured, at a pitch of {pitch_mm} mm")]
    NoSurface {
        /// Nodes with a value.
        nodes: usize,
        /// Distance of the nodes.
        pitch_mm: f64,
    },
    /// Surfaces were found, but none could be made into a trimmed face.
    #[error("none of the {regions} regions found could be made into a trimmed face")]
    NoFace {
        /// Regions found.
        regions: usize,
    },
    /// The columns could not be gone through a second time.
    #[error("the samples could not be read again: {0}")]
    ReadAgain(ReadAgainError),
    /// The columns could not be regridded.
    #[error("regridding failed: {0}")]
    Regrid(RegridError),
    /// The range image could not be segmented.
    #[error("segmentation failed: {0}")]
    Segment(SegmentError),
    /// The regions could not be reconstructed.
    #[error("reconstruction failed: {0}")]
    Reconstruct(ReconstructError),
}

impl PipelineError {
    /// What the user can do about it, in plain language; `None` where there is nothing
    /// to add to the message.
    #[must_use]
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::NothingMeasured => Some(
                "check that the part stands in view and that the laser reaches it; if samples \
                 are there, choose a larger pitch",
            ),
            Self::NothingInRoi { .. } => Some(
                "the limits are millimetres in the part frame (x along the table, y up, z towards \
                 the camera); widen them, or leave them out to see where the part lies",
            ),
            Self::NoSurface { .. } => Some(
                "what was measured is too scattered or too small; choose a larger pitch or a \
                 smaller minimum region, or scan with a finer column pitch",
            ),
            Self::NoFace { .. } => Some(
                "the regions are too narrow for their borders to be followed; scan with a finer \
                 column pitch or choose a smaller grid pitch",
            ),
            Self::Regrid(RegridError::NotMonotone { .. }) => Some(
                "the table went back or stood still while columns were taken: check its drive, \
                 and scan again",
            ),
            Self::Regrid(RegridError::TooManyNodes { .. }) => Some(
                "if the part is not that large, single samples far from it or a wrong calibration \
                 are the cause",
            ),
            _ => None,
        }
    }
}

impl From<RegridError> for PipelineError {
    fn from(error: RegridError) -> Self {
        match error {
            RegridError::Cancelled(_) => Self::Cancelled,
            other => Self::Regrid(other),
        }
    }
}

impl From<SegmentError> for PipelineError {
    fn from(error: SegmentError) -> Self {
        match error {
            SegmentError::Cancelled(_) => Self::Cancelled,
            other => Self::Segment(other),
        }
    }
}

impl From<ReconstructError> for PipelineError {
    fn from(error: ReconstructError) -> Self {
        match error {
            ReconstructError::Cancelled(_) => Self::Cancelled,
            ReconstructError::NoFaces { regions, .. } => Self::NoFace { regions },
            other => Self::Reconstruct(other),
        }
    }
}

impl From<Cancelled> for PipelineError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// As [`process_scan`], of a camera that is not known.
///
/// # Errors
/// As [`process_scan`].
pub fn process_columns(
    columns: &[Column],
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(RangeImage, Outcome), PipelineError> {
    let scan = InMemory {
        columns,
        camera_mm: None,
    };
    process_scan(&scan, settings, observer)
}

/// From columns to a model: [`regrid::regrid`], then [`process_in_view`].
///
/// # Errors
/// As [`process_in_view`], and [`PipelineError::Regrid`].
pub fn process_scan(
    scan: &InMemory<'_>,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(RangeImage, Outcome), PipelineError> {
    settings.validate()?;
    observer.stage(Stage::Regrid);
    let mut x_mm: Option<(f64, f64)> = None;
    let each = scan.columns.iter().cloned().inspect(|column| {
        let x = column.x_mm();
        let (low, high) = x_mm.unwrap_or((x, x));
        x_mm = Some((low.min(x), high.max(x)));
    });
    let image = regrid::regrid(each, &settings.regrid, observer)?;
    let view = View { x_mm, y_mm: None };
    let mut outcome = process_in_view(&image, Some(scan), &view, settings, observer)?;
    outcome.stages.insert(0, Stage::Regrid);
    Ok((image, outcome))
}

/// From a range image alone to a model. The image need not come from `settings.regrid`; only its
/// region of interest and its threads are asked for.
///
/// # Errors
/// As [`process_in_view`].
pub fn process(
    image: &RangeImage,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Outcome, PipelineError> {
    process_in_view(image, None, &View::default(), settings, observer)
}

/// As [`process`], with the columns that the image was made of, and told what the scanner
/// looked at: a plane that ends before the view does is not cut off by it, so it is no table.
///
/// # Errors
/// Any [`PipelineError`], of [`PipelineError::Regrid`] only that the threads cannot be had.
/// [`PipelineError::hint`] says what to do.
pub fn process_in_view(
    image: &RangeImage,
    columns: Option<&dyn Columns>,
    view: &View,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Outcome, PipelineError> {
    settings.validate()?;
    observer.check()?;
    regrid::with_threads(settings.regrid.threads, || {
        in_view(image, columns, view, settings, observer)
    })?
}

fn in_view(
    image: &RangeImage,
    columns: Option<&dyn Columns>,
    view: &View,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Outcome, PipelineError> {
    let nodes = image.valid_nodes();
    let roi = settings.regrid.roi;
    if nodes == 0 {
        return Err(if roi == regrid::Roi::default() {
            PipelineError::NothingMeasured
        } else {
            let roi = roi.to_string();
            PipelineError::NothingInRoi { roi }
        });
    }

    let within = columns.map(|columns| Within { columns, roi });
    let columns = within.as_ref().map(|within| within as &dyn Columns);
    let view = view.within(roi.x_mm, roi.y_mm);
    let mut part = divide(image, &view, settings, observer)?;
    let mut warnings = Vec::new();
    let filling = fill(image, &mut part, columns, settings, &mut warnings, observer)?;
    let mut unlabelled = 0;
    let part_image = part.image.as_ref().unwrap_or(image);
    let is_relief = settings.reconstruct.method == Method::Relief;
    let has_kinds = settings.kinds == Kinds::Auto && is_relief;
    let samples = columns
        .map(|columns| of_regions(part_image, &part.regions, columns, observer))
        .transpose()?;
    if has_kinds
        && settings.smooth_joins == SmoothJoins::Split
        && let Some(samples) = &samples
    {
        let faces = faces(part_image, &part.regions, samples, observer)?;
        (part.regions, unlabelled) = (faces.regions, faces.unlabelled);
    }

    observer.stage(Stage::Reconstruct);
    let decided = kinds(
        part_image,
        &part.regions,
        samples.as_deref(),
        settings.smooth_joins,
        observer,
    )?;
    let tied = regular::tie(decided, has_kinds, settings)?;
    let mut claimed = None;
    if let Some(columns) = columns.filter(|_| has_kinds) {
        claimed = claims::claimed(part_image, &part.regions, &tied.kinds, columns, observer)?;
    }
    let mut claimed_image = None;
    let mut claimed_nodes = 0;
    if let Some(claimed) = claimed {
        part.regions = claimed.regions;
        claimed_nodes = claimed.nodes;
        claimed_image = Some(claimed.image);
    }
    let part_image = claimed_image.as_ref().unwrap_or(part_image);
    let of_outlines = || {
        let removed = part.image.is_some().then_some(Removed {
            image,
            roles: &part.roles,
        });
        let beside = match columns {
            Some(columns) if is_relief => {
                outlines::samples(part_image, &part.regions, removed, columns, observer)?
            }
            _ => Some(Vec::new()),
        };
        Ok::<_, PipelineError>(beside)
    };
    let fit = || Fitted::of(part_image, &part.regions, &settings.reconstruct, observer);
    let (fitted, beside) = rayon::join(fit, of_outlines);
    let (fitted, beside) = (fitted?, beside?);
    let are_too_many = beside.is_none();
    let beside = beside.unwrap_or_default();
    let mut forms: Vec<Option<Known>> = Vec::new();
    if has_kinds {
        forms.extend(tied.kinds.iter().map(RegionKind::known));
    }
    let evidence = Evidence {
        forms: &forms,
        outline_samples: &beside,
    };
    let mut reconstruction = fitted.reconstruct(evidence, observer)?;
    if are_too_many {
        let told = "there are too many samples beside outlines to look at all of them: outlines run \
                    by the nodes, half a pitch less sharp";
        reconstruction.warnings.push(told.to_owned());
    }
    reconstruction.warnings.extend(warnings);
    let notes = tied.regularities.iter().flat_map(|own| &own.notes);
    reconstruction.warnings.extend(notes.cloned());
    if unlabelled > 0 {
        reconstruction.warnings.push(format!(
            "{unlabelled} regions of several surfaces stay one face each: there are more faces \
             than 65535; choose a larger pitch or a larger minimum region"
        ));
    }
    let mut settled = None;
    if let Some(columns) = columns.filter(|_| !beside.is_empty()) {
        let nodes = settle_nodes(
            part_image,
            &part.regions,
            &reconstruction,
            columns,
            observer,
        )?;
        reconstruction.metrics = compare(&nodes.image, &reconstruction.restored);
        settled = Some(nodes);
    } else if let Some(image) = claimed_image {
        settled = Some(SettledNodes {
            image,
            dropped: 0,
            filled: 0,
        });
    }
    Ok(Outcome {
        regions: part.regions,
        background: part.background,
        roles: part.roles,
        crumbs: part.crumbs,
        kinds: tied.kinds,
        tangent: tied.tangent,
        regularities: tied.regularities,
        reconstruction,
        claimed_nodes,
        filling,
        settled,
        stages: vec![Stage::Segment, Stage::Reconstruct],
    })
}

/// The regions, each of one surface as far as that is one of a kind.
fn faces(
    image: &RangeImage,
    regions: &RegionMap,
    samples: &[OnRegion],
    observer: &dyn Observer,
) -> Result<Divided, Cancelled> {
    let at_node = |on: &OnRegion| {
        let [column, row] = on.nearest(image);
        (column * image.rows() + row, on.sample)
    };
    let at_nodes: Vec<_> = samples.iter().map(at_node).collect();
    let observations = Observations::new(image.raw_z_mm().len(), &at_nodes, 1.0);
    faces::divide(image, regions, &observations, observer)
}
