//! The regions of a range image, with a label for every node.
//!
//! Nodes without a value are no region of their own where something lower lies beside them: they
//! are what its walls hide from laser or sensor. Where nothing lower does, they are a hollow whose
//! floor is not seen.

mod bottoms;
mod crumbs;
mod fill;
mod hidden;
mod margin;
mod pieces;
mod slivers;
mod strays;
mod surface;
mod table;

use range_image::{Column, Monitor, RangeImage};
use segment::{SegmentError, SegmentSettings, View};

use crate::field::Field;
use crate::plane::Plane;
pub use surface::Surface;

/// What a label stands for.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// A surface of the part.
    Part(Surface),
    /// What surrounds the part: the table it stands on, if one is seen.
    Outside(Option<Plane>),
    /// A hollow of which no floor is seen.
    Void,
}

/// Every node with its region.
#[derive(Debug, Clone)]
pub struct Regions {
    /// Columns of the grid.
    pub columns: usize,
    /// Rows of the grid.
    pub rows: usize,
    /// Index into `regions`, column by column.
    pub labels: Vec<u16>,
    /// Regions; the first is the outside.
    pub regions: Vec<Region>,
    /// What is not known of the surroundings, for the user.
    pub notes: Vec<String>,
}

/// The index of the outside.
pub const OUTSIDE: u16 = 0;
/// Nodes of the margin, on each side.
pub(crate) const MARGIN: usize = 6;
/// What is not known lies below all that is, millimetres.
const UNKNOWN_MM: f64 = f64::NEG_INFINITY;
/// No label yet.
const NONE: u16 = u16::MAX;
/// A step of z between regions is at least so many deviations of single samples ...
const STEP_DEVIATIONS: f64 = 3.0;
/// ... and this share of the pitch.
const STEP_PITCHES: f64 = 0.5;

/// Least difference of z that is a step between neighbours, millimetres.
#[must_use]
pub fn least_step_mm(field: &Field) -> f64 {
    (STEP_DEVIATIONS * field.noise_mm).max(STEP_PITCHES * field.image.pitch_mm())
}

/// Divides the image and gives every node a region. The columns are those of the field, whose image
/// gets a margin of a few nodes.
///
/// # Errors
/// The segmentation's.
pub fn regions(
    field: &mut Field,
    columns: &[Column],
    monitor: &dyn Monitor,
) -> Result<Regions, SegmentError> {
    let step_mm = least_step_mm(field);
    let image = &field.image;
    let settings = SegmentSettings::default();
    let map = segment::segment(image, &settings, monitor)?;
    let x_mm = columns
        .first()
        .zip(columns.last())
        .map(|(first, last)| (first.x_mm(), last.x_mm()));
    let background = segment::background(image, &map, &View { x_mm, y_mm: None });
    let mut known = background.regions.iter();
    let table_label = match !known.any(|region| table::surrounds(&map, region.label)) {
        true => table::table(image, &map),
        false => None,
    };
    let is_outside: Vec<bool> = (0..=map.regions())
        .map(|label| {
            let known = background.region(label).is_some() && table::surrounds(&map, label);
            known || table_label == Some(label)
        })
        .collect();
    // Labels of the part follow the outside's.
    let mut next = OUTSIDE;
    let renamed: Vec<u16> = (0..=map.regions())
        .map(|label| match label {
            0 => NONE,
            label if is_outside[usize::from(label)] => OUTSIDE,
            _ => {
                next += 1;
                next
            }
        })
        .collect();
    let mut labels: Vec<u16> = map
        .raw_labels()
        .iter()
        .map(|label| renamed[usize::from(*label)])
        .collect();
    scraps_outside(image, &background, &mut labels, field.noise_mm);
    crumbs::kept(image, &mut labels, &mut next, step_mm);
    monitor.check()?;
    let (mut surfaces, mut table) = surface::surfaces(field, columns, &labels, usize::from(next));
    let any = slivers::joined(image, &mut labels, &surfaces, field.noise_mm);
    if any {
        (surfaces, table) = surface::surfaces(field, columns, &labels, usize::from(next));
    }
    if strays::unlabel(image, &mut labels, &surfaces, field.noise_mm) {
        crumbs::kept(image, &mut labels, &mut next, step_mm);
        (surfaces, table) = surface::surfaces(field, columns, &labels, usize::from(next));
    }
    monitor.check()?;
    let mut regions = vec![Region::Outside(table)];
    regions.extend(surfaces.into_iter().map(Region::Part));
    let (padded, labels) = margin::with_margin(image, &labels);
    let mut divided = Regions {
        columns: padded.columns(),
        rows: padded.rows(),
        labels,
        regions,
        // What it says of faces that it keeps is not so of the one that is the table.
        notes: match table_label {
            Some(_) => Vec::new(),
            None => background.notes,
        },
    };
    hidden::hidden(&padded, &mut divided, step_mm);
    fill::fill(&padded, &mut divided, step_mm);
    bottoms::bottoms(&mut divided, field.noise_mm);
    field.image = padded;
    Ok(divided)
}

/// Nodes of no region that lie in the table's plane are outside.
fn scraps_outside(
    image: &RangeImage,
    background: &segment::Background,
    labels: &mut [u16],
    noise_mm: f64,
) {
    let rows = image.rows();
    for (node, label) in labels.iter_mut().enumerate() {
        if *label != NONE {
            continue;
        }
        let (column, row) = (node / rows, node % rows);
        if let Some(z_mm) = image.z_mm(column, row)
            && background.holds(image.x_mm(column), image.y_mm(row), z_mm, 4.0 * noise_mm)
        {
            *label = OUTSIDE;
        }
    }
}

impl Regions {
    /// The node of a place, nearest; `None` outside of the grid.
    #[must_use]
    pub fn node(&self, image: &RangeImage, x_mm: f64, y_mm: f64) -> Option<usize> {
        let (i, j) = image.origin();
        let index = |value: f64, first: i64, count: usize| {
            let at = (value / image.pitch_mm()).round() - first as f64;
            (at >= 0.0 && at < count as f64).then_some(at as usize)
        };
        let column = index(x_mm, i, self.columns)?;
        let row = index(y_mm, j, self.rows)?;
        Some(column * self.rows + row)
    }

    /// Neighbours of a node along columns and rows.
    pub fn neighbours(&self, node: usize) -> impl Iterator<Item = usize> + use<> {
        pieces::neighbours(self.columns, self.rows, node)
    }

    /// Height at a node, millimetres: as measured, else of its region's plane; `None` where nothing
    /// is known of it.
    #[must_use]
    pub fn height_mm(&self, image: &RangeImage, node: usize) -> Option<f64> {
        let z_mm = image.raw_z_mm()[node];
        let (column, row) = (node / self.rows, node % self.rows);
        let at = |plane: &Plane| plane.z_mm(image.x_mm(column), image.y_mm(row));
        match self.regions.get(usize::from(self.labels[node]))? {
            Region::Void => None,
            _ if !z_mm.is_nan() => Some(z_mm),
            Region::Part(surface) => Some(at(&surface.plane)),
            Region::Outside(plane) => plane.as_ref().map(at),
        }
    }

    /// Whether a node lies where the scan ends, or beyond.
    #[must_use]
    pub fn at_frame(&self, node: usize) -> bool {
        let (column, row) = (node / self.rows, node % self.rows);
        column <= MARGIN
            || row <= MARGIN
            || column + 1 + MARGIN >= self.columns
            || row + 1 + MARGIN >= self.rows
    }

    /// The surface of a region of the part.
    #[must_use]
    pub fn surface(&self, region: u16) -> Option<&Surface> {
        match self.regions.get(usize::from(region)) {
            Some(Region::Part(surface)) => Some(surface),
            _ => None,
        }
    }
}
