//! How much samples stray, told by the samples alone.

use range_image::Column;
use rayon::prelude::*;

use super::median;

/// Root of the sum of the squared weights of a second difference: 1, -2, 1.
const OF_SECOND_DIFFERENCE: f64 = 2.449_489_742_783_178;
/// The median of |x| of a normal distribution, in its deviations.
const OF_MEDIAN: f64 = 0.674_489_750_196_082;

/// Standard deviation of z about the surface, millimetres: from the median of second differences
/// along columns, to which steps, creases and outliers are few. Each difference is taken of its
/// place between its neighbours, since samples are not evenly spaced.
#[must_use]
pub fn noise_mm(columns: &[Column]) -> f64 {
    let mut all: Vec<f64> = columns
        .par_iter()
        .flat_map_iter(|column| {
            column.samples().windows(3).filter_map(|three| {
                let [a, b, c] = [three[0], three[1], three[2]];
                let span = c.y_mm - a.y_mm;
                if span <= 0.0 {
                    return None;
                }
                let share = (b.y_mm - a.y_mm) / span;
                let between = a.z_mm + share * (c.z_mm - a.z_mm);
                let spread = (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt();
                Some((b.z_mm - between).abs() * OF_SECOND_DIFFERENCE / spread)
            })
        })
        .collect();
    median(&mut all).unwrap_or(0.0) / (OF_MEDIAN * OF_SECOND_DIFFERENCE)
}
