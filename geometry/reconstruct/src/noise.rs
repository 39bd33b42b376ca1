//! The noise of a range image, as a surface fitted to many nodes meets it.

use range_image::{NodeQuality, RangeImage};

/// Mean distance from a place to the nearest of samples strewn with one sample per unit
/// area: 0.38 on a square lattice, 0.5 at random.
const NEAREST: f64 = 0.45;

/// The quantile of the nodes' scales that is free of the surface's own shape: where it
/// bends within a window, samples lie off the plane for that alone.
const QUIET: f64 = 0.1;

/// The noise of the nodes and the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ImageNoise {
    /// Standard deviation of a node apart from what its neighbours share, millimetres.
    own_mm: f64,
    /// Samples for each node; `None` where the image does not tell.
    samples_per_node: Option<f64>,
}

impl ImageNoise {
    pub(crate) fn of(image: &RangeImage) -> Self {
        let known = image.qualities().filter(|q| q.inliers > 0);
        let mut nearest: Vec<f64> = known.map(|q| f64::from(q.nearest_mm)).collect();
        let samples_per_node = median(&mut nearest).filter(|n| *n > 0.0).map(|nearest| {
            let spacing = nearest / NEAREST;
            // Nodes may lie on samples, which then seem to be many.
            (image.pitch_mm() / spacing).powi(2).min(1.0)
        });
        Self {
            own_mm: own_noise_mm(image),
            samples_per_node,
        }
    }

    /// How many independent values so many nodes are worth: as many as they are, or as the samples
    /// that they rest on, where those are fewer. More samples than nodes make nodes better and not
    /// more.
    pub(crate) fn independent(&self, nodes: usize) -> usize {
        let share = self.samples_per_node.unwrap_or(1.0);
        ((nodes as f64 * share).round() as usize).clamp(nodes.min(1), nodes)
    }

    /// Variance of the mean over many nodes times their number, square millimetres, where
    /// the nodes have these qualities. Neighbouring nodes rest on common samples, so that
    /// the mean over many is no better than that of the samples themselves.
    pub(crate) fn density_mm2(&self, nodes: impl Iterator<Item = NodeQuality>) -> f64 {
        let own = self.own_mm * self.own_mm;
        let known = nodes.filter(|q| q.inliers > 0);
        let mut scales: Vec<f64> = known.map(|q| f64::from(q.scale_mm)).collect();
        match (quantile(&mut scales, QUIET), self.samples_per_node) {
            (Some(scale), Some(samples)) => own.max(scale * scale / samples),
            _ => own,
        }
    }
}

/// From third differences of neighbouring nodes, which no quadratic surface disturbs; the
/// median leaves creases and steps out.
fn own_noise_mm(image: &RangeImage) -> f64 {
    let (columns, rows) = (image.columns(), image.rows());
    let z = image.raw_z_mm();
    let mut sizes = Vec::with_capacity(2 * z.len());
    for column in 0..columns {
        for row in 0..rows {
            let mut take = |stride: usize| {
                let at = |k: usize| z[column * rows + row + k * stride];
                let difference = at(3) - at(0) + 3.0 * (at(1) - at(2));
                if difference.is_finite() {
                    sizes.push(difference.abs());
                }
            };
            if row + 3 < rows {
                take(1);
            }
            if column + 3 < columns {
                take(rows);
            }
        }
    }
    // 1.4826: median of sizes to standard deviation; sqrt(1 + 9 + 9 + 1) of the weights.
    median(&mut sizes).map_or(0.0, |m| 1.4826 * m / 20.0_f64.sqrt())
}

fn median(values: &mut [f64]) -> Option<f64> {
    quantile(values, 0.5)
}

fn quantile(values: &mut [f64], part: f64) -> Option<f64> {
    let at = (part * values.len() as f64) as usize;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::image::Lattice;

    fn image(scale_mm: Option<f32>) -> RangeImage {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 0, 0, 40, 30);
        for column in 0..40 {
            for row in 0..30 {
                // Half of 0.01 to either side, in turns: third differences of 8 halves.
                let z = 0.1 * column as f64 + 0.01 * ((column + row) % 2) as f64;
                image.set_z_mm(column, row, Some(z));
                if let Some(scale_mm) = scale_mm {
                    let quality = NodeQuality {
                        inliers: 30,
                        samples: 32,
                        scale_mm,
                        nearest_mm: 0.45,
                    };
                    image.set_quality(column, row, quality);
                }
            }
        }
        image
    }

    #[test]
    fn the_density_is_that_of_the_samples_or_of_the_nodes_own_noise() {
        // One sample for each millimetre square, so a quarter for each node.
        let known = image(Some(0.05));
        let density = ImageNoise::of(&known).density_mm2(known.qualities());
        assert!((density - 0.0025 / 0.25).abs() < 1e-6, "{density}");
        let unknown = image(None);
        let density = ImageNoise::of(&unknown).density_mm2(unknown.qualities());
        let own = 1.4826 * 0.04 / 20.0_f64.sqrt();
        assert!((density - own * own).abs() < 1e-9, "{density}");
        // Of 1000 nodes a quarter.
        assert_eq!(ImageNoise::of(&known).independent(1000), 250);
        assert_eq!(ImageNoise::of(&unknown).independent(1000), 1000);
    }
}
