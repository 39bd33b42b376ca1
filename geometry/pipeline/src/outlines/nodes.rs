//! Nodes beside outlines, decided anew once the outlines are settled.
//!
//! Whether a node has a surface was told by the samples around it alone. The outline beside it
//! is told by all samples along it, and so knows better: a node just beyond it has none, and one
//! just within has the face's, at the height of the samples there.

use range_image::{Monitor, RangeImage, RegionMap};
use reconstruct::{Face, Reconstruction, Surface};

use super::owner::Owners;
use crate::columns::Columns;
use crate::process::PipelineError;

/// Samples within so many pitches of a node tell its height: some are lost, and those at an
/// outline may be of neither side.
const NEAR: f64 = 2.5;

/// A node of no region beyond an outline is the face's that goes on so near to it, pitches.
const OWN: f64 = 1.0;

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
    let faces = &reconstruction.model.faces;
    let face_at = |column: usize, row: usize| {
        let face = reconstruction.face_at[column * image.rows() + row] as usize;
        face.checked_sub(1)
    };
    let mut open: Vec<Open> = Vec::new();
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            let label = regions.label(column, row);
            match face_at(column, row) {
                None => {
                    let Some(z_mm) = image.z_mm(column, row) else {
                        continue;
                    };
                    let goes_on = |face: &Face| {
                        let Surface::Patches(surface) = &face.surface;
                        let there_mm = surface.z(image.x_mm(column), image.y_mm(row));
                        (z_mm - there_mm).abs() <= OWN * image.pitch_mm()
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

/// Finds the samples near open nodes that are of their faces.
fn measure(
    open: &mut [Open],
    image: &RangeImage,
    regions: &RegionMap,
    reconstruction: &Reconstruction,
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<(), PipelineError> {
    let owners = Owners::new(image, regions);
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
