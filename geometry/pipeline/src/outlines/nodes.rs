//! Nodes beside outlines, decided anew once the outlines are settled.
//!
//! Whether a node has a surface was told by the samples around it alone. The outline beside it
//! is told by all samples along it, and so knows better: a node just beyond it has none, and one
//! just within has the face's, at the height of the samples there.

use range_image::{Monitor, RangeImage, RegionMap};
use reconstruct::{EdgeKind, EdgeOrigin, Face, Reconstruction, Surface};

use super::owner::Owners;
use crate::columns::Columns;
use crate::process::PipelineError;

/// Samples within so many pitches of a node tell its height: some are lost, and those at an
/// outline may be of neither side.
const NEAR: f64 = 2.5;

/// A node of no region beyond an outline is the face's that goes on so near to it, pitches.
const OWN: f64 = 1.0;

/// Nodes beside an outline lie so near to it, and places of it that are looked at so near to each
/// other, pitches.
const BESIDE: f64 = 2.0;
const STEP: f64 = 0.25;

/// A range image whose nodes beside outlines have been decided anew.
#[derive(Debug, Clone)]
pub struct SettledNodes {
    /// The image.
    pub image: RangeImage,
    /// Nodes that lost their value: they lie just beyond an outline.
    pub dropped: usize,
    /// Nodes that have got one: they lie just within.
    pub filled: usize,
}

/// A node within a face that has no value, or one that is of no region.
struct Open {
    column: usize,
    row: usize,
    face: usize,
    /// How far the samples near it lie before the face, millimetres.
    off_mm: Vec<f64>,
}

/// Decides the nodes beside the outlines of `reconstruction`. What is farther from them than a
/// node, or has no sample near, stays as it is.
///
/// # Errors
/// Cancelled, or the columns cannot be read again.
pub(crate) fn settle_nodes(
    image: &RangeImage,
    regions: &RegionMap,
    reconstruction: &Reconstruction,
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<SettledNodes, PipelineError> {
    let mut settled = SettledNodes {
        image: image.clone(),
        dropped: 0,
        filled: 0,
    };
    let is_told_of = beside_settled(image, reconstruction);
    let faces = &reconstruction.model.faces;
    let face_at = |column: usize, row: usize| {
        let face = reconstruction.face_at[column * image.rows() + row] as usize;
        face.checked_sub(1)
    };
    let mut open: Vec<Open> = Vec::new();
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            if !is_told_of[column * image.rows() + row] {
                continue;
            }
            let label = regions.label(column, row);
            match face_at(column, row) {
                None => {
                    let Some(z_mm) = image.z_mm(column, row) else {
                        continue;
                    };
                    let goes_on = |face: &Face| {
                        let Surface::Patches(surface) = &face.surface;
                        let (x_mm, y_mm) = (image.x_mm(column), image.y_mm(row));
                        let above_mm = z_mm - surface.z(x_mm, y_mm);
                        // Next to its silhouette a face is so steep that above is not away.
                        let away_mm = above_mm * surface.normal(x_mm, y_mm)[2];
                        away_mm.abs() <= OWN * image.pitch_mm()
                    };
                    let is_next = around(image, column, row)
                        .filter_map(|(column, row)| face_at(column, row))
                        .map(|face| &faces[face])
                        .any(|face| face.region == label || (label == 0 && goes_on(face)));
                    if is_next {
                        settled.image.set_z_mm(column, row, None);
                        settled.dropped += 1;
                    }
                }
                Some(face) if label == 0 => {
                    let is_next = around(image, column, row)
                        .any(|(column, row)| regions.label(column, row) == faces[face].region);
                    if is_next {
                        open.push(Open {
                            column,
                            row,
                            face,
                            off_mm: Vec::new(),
                        });
                    }
                }
                _ => {}
            }
        }
    }
    measure(&mut open, image, regions, reconstruction, columns, monitor)?;
    for node in &mut open {
        let Some(off_mm) = median(&mut node.off_mm) else {
            continue;
        };
        let Some(face_mm) = reconstruction.restored.z_mm(node.column, node.row) else {
            continue;
        };
        let is_new = image.z_mm(node.column, node.row).is_none();
        settled.filled += usize::from(is_new);
        let z_mm = Some(face_mm + off_mm);
        settled.image.set_z_mm(node.column, node.row, z_mm);
    }
    Ok(settled)
}

/// Which nodes lie beside an outline that samples have settled, and no other is nearer: where one
/// runs that is only drawn between nodes, those know better.
fn beside_settled(image: &RangeImage, reconstruction: &Reconstruction) -> Vec<bool> {
    let mut nearest = vec![(f64::INFINITY, false); image.columns() * image.rows()];
    for edge in &reconstruction.model.edges {
        if edge.kind != EdgeKind::Silhouette {
            continue;
        }
        let is_settled = edge.origin == EdgeOrigin::Measured;
        let (first, last) = edge.path.domain();
        let steps = ((last - first) / (STEP * image.pitch_mm())).ceil().max(1.0) as usize;
        for place_mm in edge.path.sampled(steps) {
            let place = [
                (place_mm[0] - image.x_mm(0)) / image.pitch_mm(),
                (place_mm[1] - image.y_mm(0)) / image.pitch_mm(),
            ];
            let counts = [image.columns(), image.rows()];
            let around = |d: usize| {
                let low = (place[d] - BESIDE).ceil().max(0.0) as usize;
                let high = (place[d] + BESIDE + 1.0).clamp(0.0, counts[d] as f64) as usize;
                low..high
            };
            for (column, row) in around(0).flat_map(|c| around(1).map(move |r| (c, r))) {
                let off = [place[0] - column as f64, place[1] - row as f64];
                let distance2 = off[0] * off[0] + off[1] * off[1];
                let node = &mut nearest[column * image.rows() + row];
                if distance2 < node.0 {
                    *node = (distance2, is_settled);
                }
            }
        }
    }
    nearest.iter().map(|(_, is_settled)| *is_settled).collect()
}

/// Finds the samples near open nodes that are of their faces.
fn measure(
    open: &mut [Open],
    image: &RangeImage,
    regions: &RegionMap,
    reconstruction: &Reconstruction,
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<(), PipelineError> {
    // What was left out tells of no node of a face.
    let owners = Owners::new(image, regions, None);
    let near_mm = NEAR * image.pitch_mm();
    let mut go_on = Ok(());
    columns
        .visit(&mut |column| {
            let x_mm = column.x_mm();
            // They are in the order of their columns.
            let first = open.partition_point(|node| image.x_mm(node.column) < x_mm - near_mm);
            let last = open.partition_point(|node| image.x_mm(node.column) <= x_mm + near_mm);
            let open = &mut open[first..last];
            let mut by_row: Vec<usize> = (0..open.len()).collect();
            by_row.sort_by_key(|k| open[*k].row);
            for sample in column.samples() {
                let row_mm = |k: &usize| image.y_mm(open[*k].row);
                let from = by_row.partition_point(|k| row_mm(k) < sample.y_mm - near_mm);
                let to = by_row.partition_point(|k| row_mm(k) <= sample.y_mm + near_mm);
                let mut owner = None;
                for &k in &by_row[from..to.max(from)] {
                    let node = &mut open[k];
                    let dx_mm = image.x_mm(node.column) - x_mm;
                    let dy_mm = image.y_mm(node.row) - sample.y_mm;
                    if dx_mm * dx_mm + dy_mm * dy_mm > near_mm * near_mm {
                        continue;
                    }
                    let owner =
                        owner.get_or_insert_with(|| owners.of(x_mm, sample.y_mm, sample.z_mm));
                    let face = &reconstruction.model.faces[node.face];
                    if owner.region == face.region {
                        let Surface::Patches(surface) = &face.surface;
                        node.off_mm.push(sample.z_mm - surface.z(x_mm, sample.y_mm));
                    }
                }
            }
            go_on = monitor.check();
            go_on.is_ok()
        })
        .map_err(PipelineError::ReadAgain)?;
    Ok(go_on?)
}

/// The nodes next to a node, the diagonal ones with them.
fn around(image: &RangeImage, column: usize, row: usize) -> impl Iterator<Item = (usize, usize)> {
    let columns = column.saturating_sub(1)..(column + 2).min(image.columns());
    let rows = row.saturating_sub(1)..(row + 2).min(image.rows());
    columns
        .flat_map(move |c| rows.clone().map(move |r| (c, r)))
        .filter(move |place| *place != (column, row))
}

/// The lower median.
fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
