//! A report told to people.

use std::collections::BTreeSet;

use deliverables::Report;
use deliverables::report::{Quantity, RegionReport};

use crate::output;

/// Regions listed one by one; a part with more is summed up.
const MOST_REGIONS: usize = 24;

/// The report in lines: a table of regions, the whole, the stages, what to know.
pub(crate) fn lines(report: &Report) -> Vec<String> {
    let mut lines = vec![String::new(), regions(report)];
    let hidden = report.regions.list.len().saturating_sub(MOST_REGIONS);
    if hidden > 0 {
        lines.push(format!("... and {hidden} smaller ones"));
    }
    let image = &report.range_image;
    let model = &report.model;
    lines.push(String::new());
    lines.push(format!(
        "range image  {} x {} nodes at {} mm, {} with a value, from {} samples in {} columns",
        image.columns,
        image.rows,
        image.pitch_mm,
        image.nodes,
        report.scan.samples,
        report.scan.columns
    ));
    lines.push(format!(
        "model        {}, {} shared, {} free",
        output::counted(model.faces, "face"),
        output::counted(model.edges_shared, "edge"),
        model.free_edges
    ));
    // Reports of earlier versions do not tell.
    let lengths = &model.edge_lengths;
    if lengths.measured_mm + lengths.intersected_mm + lengths.assumed_mm > 0.0 {
        lines.push(format!(
            "edges        {:.0} mm told by samples, {:.0} mm where faces intersect, {:.0} mm \
             assumed ({:.0} %)",
            lengths.measured_mm,
            lengths.intersected_mm,
            lengths.assumed_mm,
            100.0 * lengths.assumed_share
        ));
    }
    lines.push(format!(
        "part         {} regions of at least {} nodes, {}",
        report.regions.count,
        report.settings.minimum_nodes,
        crumbs(report)
    ));
    if !report.tangent.accepted.is_empty() {
        let joins = output::counted(report.tangent.accepted.len(), "smooth join");
        lines.push(format!("tangent      {joins}"));
    }
    lines.extend(regularities(report));
    lines.extend(report.background.list.iter().map(|region| {
        format!(
            "left out     {} of {} nodes: {}",
            region.kind, region.nodes, region.why
        )
    }));
    lines.push(format!(
        "agreement    SNR {} dB, {} lost, {} invented",
        decibels(report.snr_db),
        output::counted(report.lost_nodes, "node"),
        report.invented_nodes
    ));
    let mut stages: Vec<(&String, &f64)> = report.timings_s.iter().collect();
    stages.sort_by_key(|(name, _)| order(name));
    let stages: Vec<String> = stages
        .iter()
        .map(|(name, seconds)| format!("{name} {seconds:.2} s"))
        .collect();
    lines.push(format!("time         {}", stages.join(", ")));
    lines.extend(
        report
            .warnings
            .iter()
            .map(|warning| format!("note         {warning}")),
    );
    lines
}

/// Stages in the order in which they run; others after them.
fn order(name: &str) -> usize {
    let stages = pipeline::Stage::ALL;
    stages
        .iter()
        .position(|stage| stage.as_str() == name)
        .unwrap_or(stages.len())
}

fn regions(report: &Report) -> String {
    let mut largest: Vec<&RegionReport> = report.regions.list.iter().collect();
    if largest.len() > MOST_REGIONS {
        largest.sort_by_key(|region| std::cmp::Reverse(region.nodes));
        largest.truncate(MOST_REGIONS);
    }
    output::table(
        &[
            "REGION", "SHAPE", "NODES", "AREA MM2", "RMS MM", "MAX MM", "PSNR DB",
        ],
        &[0, 2, 3, 4, 5, 6],
        largest.into_iter().map(|region| {
            vec![
                region.label.to_string(),
                shape(region),
                region.nodes.to_string(),
                region
                    .area_mm2
                    .map_or_else(|| "-".into(), |area| format!("{area:.1}")),
                millimetres(region.rms_mm),
                millimetres(region.max_mm),
                decibels(region.psnr_db),
            ]
        }),
    )
}

/// The shape of a region and its size; of one without a face, that.
fn shape(region: &RegionReport) -> String {
    let Some(shape) = &region.shape else {
        return "-".into();
    };
    if region.faces.is_empty() {
        return "no face".into();
    }
    let hollow = if shape.hollow == Some(true) {
        "hollow "
    } else {
        ""
    };
    let sizes = shape.numbers.as_ref().map(|numbers| {
        [
            ("R", numbers.radius_mm, ""),
            ("r", numbers.tube_radius_mm, ""),
            ("half angle", numbers.half_angle_deg, " deg"),
        ]
        .into_iter()
        .filter_map(|(name, size, unit)| Some(format!(" {name} {}{unit}", quantity(size?))))
        .collect::<String>()
    });
    format!("{hollow}{}{}", shape.family, sizes.unwrap_or_default())
}

/// A quantity to the digits that mean something, its standard uncertainty to two.
fn quantity(quantity: Quantity) -> String {
    let leading = quantity.uncertainty.log10().floor();
    let decimals = (1.0 - leading).clamp(0.0, 6.0) as usize;
    let Quantity { value, uncertainty } = quantity;
    format!("{value:.decimals$} +- {uncertainty:.decimals$}")
}

/// How many regularities there are, where they were looked for.
fn regularities(report: &Report) -> Option<String> {
    let found = report.regularities.as_ref()?;
    let tied: BTreeSet<u16> = found
        .accepted
        .iter()
        .flat_map(|own| own.regions.iter().copied())
        .collect();
    Some(match found.accepted.len() {
        0 => format!(
            "regular      no regularities, {} nearly",
            found.refused.len()
        ),
        1 => format!(
            "regular      1 regularity of {} regions, {} more refused",
            tied.len(),
            found.refused.len()
        ),
        count => format!(
            "regular      {count} regularities of {} regions, {} more refused",
            tied.len(),
            found.refused.len()
        ),
    })
}

/// What belongs to no region.
fn crumbs(report: &Report) -> String {
    match report.crumbs.count {
        0 => "no crumbs".into(),
        1 => format!("1 crumb of {} nodes", report.crumbs.nodes),
        count => format!("{count} crumbs of {} nodes in all", report.crumbs.nodes),
    }
}

fn millimetres(length_mm: Option<f64>) -> String {
    length_mm.map_or_else(|| "-".into(), |length| format!("{length:.4}"))
}

fn decibels(ratio_db: Option<f64>) -> String {
    ratio_db.map_or_else(|| "-".into(), |ratio| format!("{ratio:.1}"))
}
