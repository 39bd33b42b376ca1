//! The report's figures, taken from an outcome.

use std::collections::BTreeMap;

use pipeline::{NodeRole, Outcome, Settings};
use reconstruct::{Edge, EdgeKind, EdgeOrigin, Face, Model, Surface};

use crate::deviations::Deviations;
use crate::export::CadOptions;
use crate::regular::{regularities, round_name, tangent};
use crate::report::{
    BackgroundRegionReport, BackgroundReport, CrumbReport, CrumbsReport, EdgeLengthsReport,
    FreedomReport, ModelReport, OriginLengthsReport, RangeImageReport, RegionReport, RegionsReport,
    Report, SettingsReport,
};
use crate::shape::shape;
use crate::write::Inputs;

impl Report {
    /// The report of an outcome; `timings_s` as the stopwatch read.
    #[must_use]
    pub fn new(inputs: &Inputs<'_>, timings_s: BTreeMap<String, f64>) -> Self {
        let reconstruction = &inputs.outcome.reconstruction;
        let mut warnings = inputs.warnings.clone();
        warnings.extend(inputs.outcome.background.notes.iter().cloned());
        warnings.extend(reconstruction.warnings.iter().cloned());
        let mut versions = inputs.versions.clone();
        versions.insert("relief".into(), env!("CARGO_PKG_VERSION").into());
        Self {
            name: inputs.name.to_owned(),
            timestamp: inputs.timestamp.to_string(),
            scan: inputs.scan.clone(),
            settings: settings(inputs.settings, inputs.cad),
            range_image: range_image(inputs),
            regions: regions(inputs.outcome),
            tangent: tangent(&inputs.outcome.tangent),
            regularities: inputs.outcome.regularities.as_ref().map(regularities),
            background: background(inputs.outcome),
            crumbs: crumbs(inputs.outcome),
            fill: inputs.outcome.filling.as_ref().map(Into::into),
            model: model(&reconstruction.model),
            mesh: None,
            surface: None,
            skin: None,
            toolpath: None,
            deviations: Some(Deviations::of(inputs.image, inputs.outcome).report()),
            snr_db: finite(reconstruction.metrics.snr_db),
            lost_nodes: reconstruction.metrics.lost_nodes,
            invented_nodes: reconstruction.metrics.invented_nodes,
            timings_s,
            warnings,
            versions,
        }
    }
}

/// The number, if it is one that JSON can carry.
fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

pub(crate) fn settings(settings: &Settings, cad: &CadOptions) -> SettingsReport {
    SettingsReport {
        method: settings.method().as_str().to_owned(),
        seed: settings.regrid.seed,
        pitch_mm: settings.regrid.pitch_mm,
        neighbours: settings.regrid.neighbours,
        draws: settings.regrid.draws,
        reach_columns: settings.regrid.reach_columns,
        estimator: settings.regrid.estimator.as_str().to_owned(),
        clusters: settings.segment.clusters,
        crease_angle_rad: settings.segment.crease_angle_rad,
        step_factor: settings.segment.step_factor,
        minimum_nodes: settings.segment.minimum_nodes,
        minimum_area_mm2: settings.segment.minimum_area_mm2,
        background: settings.background.as_str().to_owned(),
        smooth_joins: settings.smooth_joins.as_str().to_owned(),
        fill: settings.fill.mode.as_str().to_owned(),
        fill_max_size_mm: settings.fill.max_size_mm,
        roi_x_mm: limits(settings.regrid.roi.x_mm),
        roi_y_mm: limits(settings.regrid.roi.y_mm),
        roi_z_mm: limits(settings.regrid.roi.z_mm),
        kinds: settings.kinds.as_str().to_owned(),
        regularize: settings.regularize.bound(),
        regularize_units: round_name(&settings.regularize),
        tolerance_mm: settings.reconstruct.tolerance_mm,
        iges_entities: cad.entity_number(),
        step: cad.step_name().to_owned(),
        step_units: cad.step_units_name().to_owned(),
        meshes: names(cad.meshes.meshes.iter().map(|format| format.ending())),
        mesh_tolerance_mm: cad.meshes.tolerance_mm,
        points: names(cad.meshes.points.iter().map(|format| format.ending())),
        surface: cad.further.surface_settings(),
        skin: cad.further.skin_settings(),
        toolpath: cad.further.toolpath_settings(),
    }
}

fn names<'a>(endings: impl Iterator<Item = &'a str>) -> Vec<String> {
    endings.map(str::to_owned).collect()
}

fn limits((low, high): (f64, f64)) -> [Option<f64>; 2] {
    [finite(low), finite(high)]
}

fn range_image(inputs: &Inputs<'_>) -> RangeImageReport {
    let image = inputs.image;
    let extent = image.z_extent_mm();
    let settled = inputs.outcome.settled.as_ref();
    RangeImageReport {
        pitch_mm: image.pitch_mm(),
        columns: image.columns(),
        rows: image.rows(),
        nodes: image.valid_nodes(),
        z_min_mm: extent.map(|(low, _)| low),
        z_max_mm: extent.map(|(_, high)| high),
        inlier_share: image.inlier_share(),
        noise_mm: image.noise_mm(),
        claimed_nodes: inputs.outcome.claimed_nodes,
        dropped_nodes: settled.map_or(0, |settled| settled.dropped),
        filled_nodes: settled.map_or(0, |settled| settled.filled),
    }
}

fn regions(outcome: &Outcome) -> RegionsReport {
    let faces = &outcome.reconstruction.model.faces;
    let list: Vec<RegionReport> = outcome
        .reconstruction
        .regions
        .iter()
        .map(|fit| {
            let own = || faces.iter().filter(|face| face.region == fit.label);
            let mut kinds = outcome.kinds.iter();
            let shape = kinds.find(|k| k.label.get() == fit.label).and_then(shape);
            // A face that is its shape follows the samples that this was fitted to.
            let numbers = shape.as_ref().and_then(|shape| shape.numbers.as_ref());
            let is_shape = own().next().is_some_and(|face| face.form.is_some());
            let samples = numbers.filter(|_| is_shape).map(|numbers| numbers.samples);
            RegionReport {
                label: fit.label,
                kind: own().next().map_or("none", kind).to_owned(),
                shape,
                faces: own().map(|face| face.name.clone()).collect(),
                patches: fit.patches,
                nodes: fit.nodes,
                area_mm2: finite(fit.area_mm2),
                rms_mm: finite(fit.rms_mm),
                max_mm: finite(fit.max_mm),
                psnr_db: finite(fit.psnr_db),
                freedom: (fit.faces > 0).then(|| FreedomReport {
                    parameters: fit.parameters,
                    independent: samples.unwrap_or(fit.independent),
                }),
            }
        })
        .collect();
    RegionsReport {
        count: usize::from(outcome.regions.regions()),
        list,
    }
}

fn background(outcome: &Outcome) -> BackgroundReport {
    let regions = &outcome.background.regions;
    let nodes = outcome.roles.iter();
    BackgroundReport {
        count: regions.len(),
        nodes: nodes.filter(|&&r| r == NodeRole::Background).count(),
        list: regions
            .iter()
            .map(|region| BackgroundRegionReport {
                kind: region.kind.as_str().to_owned(),
                nodes: region.nodes,
                normal: region.plane.map(|plane| plane.normal),
                offset_mm: region.plane.map(|plane| plane.offset_mm),
                rms_mm: region.plane.map(|plane| plane.rms_mm),
                why: region.why.clone(),
            })
            .collect(),
    }
}

fn crumbs(outcome: &Outcome) -> CrumbsReport {
    let crumbs = &outcome.crumbs;
    CrumbsReport {
        count: crumbs.len(),
        nodes: crumbs.iter().map(|crumb| crumb.nodes).sum(),
        list: crumbs
            .iter()
            .take(CrumbsReport::LISTED)
            .map(|crumb| CrumbReport {
                nodes: crumb.nodes,
                centre_mm: crumb.centre_mm,
            })
            .collect(),
    }
}

/// What a face is, in words.
pub(crate) fn kind(face: &Face) -> &'static str {
    match (&face.form, &face.surface) {
        (Some(form), _) => form.as_str(),
        (None, Surface::Patches(_)) => "bicubic patches",
    }
}

fn model(model: &Model) -> ModelReport {
    let mut uses = vec![0_usize; model.edges.len()];
    let loops = model
        .faces
        .iter()
        .flat_map(|face| std::iter::once(&face.outer).chain(&face.inner));
    for coedge in loops.flat_map(|l| &l.coedges) {
        if let Some(count) = uses.get_mut(coedge.edge.0) {
            *count += 1;
        }
    }
    ModelReport {
        faces: model.faces.len(),
        edges_shared: uses.iter().filter(|&&count| count > 1).count(),
        free_edges: uses.iter().filter(|&&count| count == 1).count(),
        edge_lengths: edge_lengths(model),
        edge_lengths_by_kind: [
            ("silhouette", EdgeKind::Silhouette),
            ("step", EdgeKind::Step),
            ("crease", EdgeKind::Crease),
        ]
        .into_iter()
        .map(|(name, kind)| (name.to_owned(), lengths(model, Some(kind))))
        .collect(),
    }
}

/// Lengths of the edges of one kind, or of all.
fn lengths(model: &Model, kind: Option<EdgeKind>) -> OriginLengthsReport {
    let of = |origin: EdgeOrigin| -> f64 {
        let is_asked =
            |edge: &&Edge| edge.origin == origin && kind.is_none_or(|kind| edge.kind == kind);
        let edges = model.edges.iter().filter(is_asked);
        // Not a sum, which would be -0 of none and be printed so.
        edges.fold(0.0, |sum, edge| sum + edge.path.arc_length())
    };
    OriginLengthsReport {
        measured_mm: of(EdgeOrigin::Measured),
        intersected_mm: of(EdgeOrigin::Intersected),
        assumed_mm: of(EdgeOrigin::Assumed),
    }
}

fn edge_lengths(model: &Model) -> EdgeLengthsReport {
    let OriginLengthsReport {
        measured_mm,
        intersected_mm,
        assumed_mm,
    } = lengths(model, None);
    let all_mm = measured_mm + intersected_mm + assumed_mm;
    EdgeLengthsReport {
        measured_mm,
        intersected_mm,
        assumed_mm,
        assumed_share: if all_mm > 0.0 {
            assumed_mm / all_mm
        } else {
            0.0
        },
    }
}
