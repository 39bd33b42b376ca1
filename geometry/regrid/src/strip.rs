//! A column as the regridder keeps it.

use range_image::Column;

use crate::error::RegridError;
use crate::settings::Roi;

/// Greatest coordinate accepted, millimetres. Scanners do not reach so far; a stray number
/// beyond would only make a grid that nobody wants to pay for.
pub(crate) const COORDINATE_LIMIT_MM: f64 = 25_000.0;

/// The samples of a column within the region of interest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Strip {
    pub(crate) x_mm: f64,
    /// y and z of the samples, by ascending y, then z.
    pub(crate) samples: Vec<(f64, f64)>,
}

impl Strip {
    /// The column cut to the region of interest; `index` is its place in the scan.
    pub(crate) fn new(column: &Column, roi: &Roi, index: usize) -> Result<Self, RegridError> {
        let within = |value: f64, (low, high): (f64, f64)| low <= value && value <= high;
        let reachable = |value_mm: f64| {
            if value_mm.abs() <= COORDINATE_LIMIT_MM {
                Ok(())
            } else {
                Err(RegridError::TooFar {
                    index,
                    value_mm,
                    limit_mm: COORDINATE_LIMIT_MM,
                })
            }
        };
        let x_mm = column.x_mm();
        reachable(x_mm)?;
        let mut samples = Vec::new();
        if within(x_mm, roi.x_mm) {
            for sample in column.samples() {
                if within(sample.y_mm, roi.y_mm) && within(sample.z_mm, roi.z_mm) {
                    reachable(sample.y_mm)?;
                    reachable(sample.z_mm)?;
                    samples.push((sample.y_mm, sample.z_mm));
                }
            }
        }
        Ok(Self { x_mm, samples })
    }

    /// Distances in y from a sample to the samples next to it, where they differ in y.
    pub(crate) fn gaps(&self, index: usize) -> impl Iterator<Item = f64> {
        let y = |k: usize| self.samples.get(k).map(|s| s.0);
        let own = y(index);
        let below = index.checked_sub(1).and_then(y);
        [(below, own), (own, y(index + 1))]
            .into_iter()
            .filter_map(|(low, high)| Some(high? - low?))
            .filter(|gap| *gap > 0.0)
    }
}

/// The lower median, by selection; `None` of nothing.
pub(crate) fn lower_median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = (values.len() - 1) / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
