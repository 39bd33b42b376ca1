//! From the samples of a scan to a range image whose regions can be found in a second.
//!
//! The regridder proper weighs every node; features need nodes only to be told apart, since what
//! is measured is measured on the samples. So single samples that nothing around them bears out
//! are left out (`support`), and a node has the mean of those around it that agree (`grid`).

mod grid;
mod noise;
mod support;

use range_image::{Cancelled, Column, Monitor, RangeImage};

pub use noise::noise_mm;

/// The columns of a scan, and what their samples say of it as a whole.
#[derive(Debug, Clone)]
pub struct Field {
    /// The range image.
    pub image: RangeImage,
    /// Standard deviation of z of single samples, millimetres.
    pub noise_mm: f64,
    /// Distance of columns, millimetres, the median.
    pub column_pitch_mm: f64,
    /// Distance of samples along a column, millimetres, the median.
    pub sample_pitch_mm: f64,
    /// The least and the greatest of all rays that came back with something, see [`crate::ray`].
    pub rays: [f64; 2],
    /// Usual step from ray to ray.
    pub ray_step: f64,
    /// Median height of what is borne out, millimetres.
    pub middle_z_mm: f64,
    /// For each sample of each column, whether samples around it bear it out.
    pub supported: Vec<Vec<bool>>,
}

impl Field {
    /// The greater of the distances of columns and of samples along them, millimetres.
    #[must_use]
    pub fn pitch_mm(&self) -> f64 {
        self.column_pitch_mm.max(self.sample_pitch_mm)
    }
}

/// Columns that make no range image.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// Too few columns or samples.
    #[error(
        "{columns} columns with {samples} samples are too few to have features: at least 8 of \
         8 samples are needed"
    )]
    TooFew {
        /// Columns with samples.
        columns: usize,
        /// Samples in all.
        samples: usize,
    },
    /// No two columns, or no two samples, lie apart.
    #[error("all columns, or all samples of each, lie at the same place")]
    OnePlace,
    /// The caller gave up.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Fewest columns, and fewest samples in one for it to count.
const FEWEST: usize = 8;

/// Makes the range image of columns that are in the order of their x. Their rays come from
/// `camera_mm`, y and z, or run along z. The image takes in all columns and rays, whether they came
/// back with something or not.
///
/// # Errors
/// Too few samples, or cancelled.
pub fn field(
    columns: &[Column],
    camera_mm: Option<[f64; 2]>,
    monitor: &dyn Monitor,
) -> Result<Field, FieldError> {
    let filled = columns.iter().filter(|c| c.samples().len() >= FEWEST);
    let samples = columns.iter().map(|c| c.samples().len()).sum();
    if filled.clone().count() < FEWEST {
        return Err(FieldError::TooFew {
            columns: filled.count(),
            samples,
        });
    }
    let column_pitch_mm = median_step(columns.iter().map(Column::x_mm)).unwrap_or(0.0);
    let mut steps: Vec<f64> = filled
        .filter_map(|c| median_step(c.samples().iter().map(|s| s.y_mm)))
        .collect();
    let sample_pitch_mm = median(&mut steps).unwrap_or(0.0);
    if !(column_pitch_mm > 0.0 && sample_pitch_mm > 0.0) {
        return Err(FieldError::OnePlace);
    }
    let noise_mm = noise_mm(columns);
    monitor.check()?;
    let supported = support::supported(columns, noise_mm);
    monitor.check()?;
    let (rays, ray_step) = rays(columns, camera_mm);
    let middle_z_mm = middle(columns, &supported);
    let y_mm = rays.map(|own| crate::ray::passes(camera_mm, own, middle_z_mm));
    let image = grid::image(
        columns,
        &supported,
        y_mm,
        [column_pitch_mm, sample_pitch_mm],
        noise_mm,
    );
    Ok(Field {
        image,
        noise_mm,
        column_pitch_mm,
        sample_pitch_mm,
        rays,
        ray_step,
        middle_z_mm,
        supported,
    })
}

/// The least and the greatest ray, and the usual step between two.
fn rays(columns: &[Column], camera_mm: Option<[f64; 2]>) -> ([f64; 2], f64) {
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    let mut steps = Vec::with_capacity(columns.len());
    for column in columns {
        let samples = column.samples().iter();
        let mut own: Vec<f64> = samples
            .map(|s| crate::ray::ray(camera_mm, s.y_mm, s.z_mm))
            .filter(|ray| ray.is_finite())
            .collect();
        own.sort_by(f64::total_cmp);
        if let (Some(first), Some(last)) = (own.first(), own.last()) {
            ends = [ends[0].min(*first), ends[1].max(*last)];
        }
        steps.extend(median_step(own.into_iter()));
    }
    (ends, median(&mut steps).unwrap_or(1.0))
}

/// Median height of what is borne out.
fn middle(columns: &[Column], supported: &[Vec<bool>]) -> f64 {
    let pairs = columns.iter().zip(supported);
    let mut heights: Vec<f64> = pairs
        .flat_map(|(column, kept)| {
            let samples = column.samples().iter().zip(kept);
            samples.filter(|(_, k)| **k).map(|(s, _)| s.z_mm)
        })
        .collect();
    median(&mut heights).unwrap_or(0.0)
}

/// Median of the positive steps of a sequence.
fn median_step(places: impl Iterator<Item = f64>) -> Option<f64> {
    let mut previous: Option<f64> = None;
    let mut steps = Vec::new();
    for place in places {
        let step = previous.map_or(0.0, |before| place - before);
        if step > 0.0 {
            steps.push(step);
        }
        previous = Some(place);
    }
    median(&mut steps)
}

/// The median, the upper of two; `None` of nothing.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*value)
}
