//! A column: all samples taken at one position of the slide table.

use core::cmp::Ordering;

/// One sample of a column, in the part frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Height in the column, millimetres.
    pub y_mm: f64,
    /// Towards the camera, millimetres.
    pub z_mm: f64,
    /// Strength of the returned light, 0 to 255; 255 where the source gives none.
    pub intensity: u8,
}

/// All samples taken at one position of the slide table, in ascending y.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    x_mm: f64,
    samples: Vec<Sample>,
}

impl Column {
    /// Sorts the samples by y, then z, then intensity, so that the order in which they
    /// arrived leaves no trace. Samples with a coordinate that is not finite are dropped.
    #[must_use]
    pub fn new(x_mm: f64, mut samples: Vec<Sample>) -> Self {
        samples.retain(|s| s.y_mm.is_finite() && s.z_mm.is_finite());
        samples.sort_by(|a, b| {
            a.y_mm
                .total_cmp(&b.y_mm)
                .then(a.z_mm.total_cmp(&b.z_mm))
                .then(a.intensity.cmp(&b.intensity))
        });
        Self { x_mm, samples }
    }

    /// Position of the slide table, millimetres in the part frame.
    #[must_use]
    pub fn x_mm(&self) -> f64 {
        self.x_mm
    }

    /// The samples in ascending y.
    #[must_use]
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Lower and upper y of the samples in millimetres; `None` for an empty column.
    #[must_use]
    pub fn y_extent_mm(&self) -> Option<(f64, f64)> {
        Some((self.samples.first()?.y_mm, self.samples.last()?.y_mm))
    }

    /// Orders columns along the table.
    #[must_use]
    pub fn compare_x(&self, other: &Self) -> Ordering {
        self.x_mm.total_cmp(&other.x_mm)
    }
}
