//! How far the measured nodes lie off the trimmed faces, along the normals of these.

use pipeline::Outcome;
use range_image::RangeImage;
use reconstruct::{Face, Reconstruction, Surface};

use crate::comparison::HistogramReport;
use crate::report::{DeviationsReport, WorstReport};

/// Share of the deviations that a scale tells apart; the rest is beyond it.
const TOLD_APART: f64 = 0.98;
/// Bars of the histogram.
const BARS: usize = 40;
/// Two of the worst places are at least so many nodes apart, along x or along y.
const APART: usize = 8;

/// Signed distances of nodes from faces, millimetres; positive towards the camera.
pub(crate) struct Deviations<'a> {
    image: &'a RangeImage,
    reconstruction: &'a Reconstruction,
    /// Of each node, column by column; not a number where it has no value, or lies under no face of
    /// its region.
    off_mm: Vec<f64>,
    /// Nodes under faces of regions that they do not belong to.
    elsewhere: usize,
    /// Sizes, the least first.
    sizes: Vec<f64>,
}

impl<'a> Deviations<'a> {
    /// Those of the nodes as outlines have settled them, where there were samples to do so.
    pub(crate) fn of(image: &'a RangeImage, outcome: &'a Outcome) -> Self {
        let settled = outcome.settled.as_ref();
        let image = settled.map_or(image, |settled| &settled.image);
        let (reconstruction, labels) = (&outcome.reconstruction, outcome.regions.raw_labels());
        let mut elsewhere = 0;
        let faces = &reconstruction.model.faces;
        let rows = image.rows();
        let places =
            (0..image.columns()).flat_map(|column| (0..rows).map(move |row| (column, row)));
        let off_mm: Vec<f64> = places
            .map(|(column, row)| {
                let number = reconstruction.face_at.get(column * rows + row).copied();
                let face = number.and_then(|number| faces.get((number as usize).checked_sub(1)?));
                let label = labels.get(column * rows + row).copied();
                match (face, image.z_mm(column, row)) {
                    // What lies beyond a step is no deviation of the face before it.
                    (Some(face), Some(_)) if label != Some(face.region) => {
                        elsewhere += 1;
                        f64::NAN
                    }
                    (Some(face), Some(z_mm)) => {
                        off(face, [image.x_mm(column), image.y_mm(row), z_mm])
                    }
                    _ => f64::NAN,
                }
            })
            .collect();
        let told = off_mm.iter().filter(|off| off.is_finite());
        let mut sizes: Vec<f64> = told.map(|off| off.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        Self {
            image,
            reconstruction,
            off_mm,
            elsewhere,
            sizes,
        }
    }

    /// The nodes as outlines have settled them.
    pub(crate) fn image(&self) -> &'a RangeImage {
        self.image
    }

    /// That of a node; `None` where it has none.
    pub(crate) fn at(&self, column: usize, row: usize) -> Option<f64> {
        let off = self.off_mm.get(column * self.image.rows() + row).copied();
        off.filter(|off| off.is_finite())
    }

    /// Nodes that have one.
    pub(crate) fn nodes(&self) -> usize {
        self.sizes.len()
    }

    /// Root mean square.
    pub(crate) fn rms_mm(&self) -> Option<f64> {
        let squares: f64 = self.sizes.iter().map(|size| size * size).sum();
        (!self.sizes.is_empty()).then(|| (squares / self.sizes.len() as f64).sqrt())
    }

    /// The size that this share does not exceed.
    pub(crate) fn quantile_mm(&self, share: f64) -> Option<f64> {
        let rank = (self.sizes.len().saturating_sub(1) as f64 * share).round() as usize;
        self.sizes.get(rank).copied()
    }

    /// A round limit to either side, within which nearly all lie.
    pub(crate) fn limit_mm(&self) -> f64 {
        round_up(self.quantile_mm(TOLD_APART).unwrap_or(0.0))
    }

    pub(crate) fn report(&self) -> DeviationsReport {
        let told = || self.off_mm.iter().filter(|off| off.is_finite());
        let mean = told().sum::<f64>() / self.sizes.len() as f64;
        DeviationsReport {
            nodes: self.nodes(),
            elsewhere: self.elsewhere,
            mean_mm: mean.is_finite().then_some(mean),
            rms_mm: self.rms_mm(),
            percentile_95_mm: self.quantile_mm(0.95),
            max_mm: self.sizes.last().copied(),
            histogram: self.histogram(),
            worst: self.worst(),
        }
    }

    fn histogram(&self) -> HistogramReport {
        let limit_mm = self.limit_mm();
        let limits_mm: Vec<f64> = (0..=BARS)
            .map(|bar| limit_mm * (2.0 * bar as f64 / BARS as f64 - 1.0))
            .collect();
        let (mut counts, mut below, mut above) = (vec![0; BARS], 0, 0);
        for off in self.off_mm.iter().filter(|off| off.is_finite()) {
            let bar = ((off + limit_mm) / (2.0 * limit_mm) * BARS as f64).floor();
            if bar < 0.0 {
                below += 1;
            } else if let Some(count) = counts.get_mut(bar as usize) {
                *count += 1;
            } else {
                above += 1;
            }
        }
        HistogramReport {
            limits_mm,
            counts,
            below,
            above,
        }
    }

    /// The largest, none of them beside a larger one.
    fn worst(&self) -> Vec<WorstReport> {
        let rows = self.image.rows();
        let size = |node: &usize| self.off_mm.get(*node).map_or(0.0, |off| off.abs());
        // What most of them do not exceed is none of the worst.
        let least = self.quantile_mm(0.95).unwrap_or(0.0);
        let mut order: Vec<usize> = (0..self.off_mm.len())
            .filter(|node| size(node) >= least && size(node) > 0.0)
            .collect();
        order.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
        let mut chosen: Vec<[usize; 2]> = Vec::new();
        let mut worst = Vec::new();
        for node in order {
            let [column, row] = [node / rows, node % rows];
            let is_beside =
                |[c, r]: &[usize; 2]| c.abs_diff(column) < APART && r.abs_diff(row) < APART;
            if chosen.iter().any(is_beside) {
                continue;
            }
            let number = self.reconstruction.face_at.get(node).copied().unwrap_or(0);
            let face = (number as usize).checked_sub(1);
            let faces = &self.reconstruction.model.faces;
            let (Some(face), Some(z_mm), Some(deviation_mm)) = (
                face.and_then(|face| faces.get(face)),
                self.image.z_mm(column, row),
                self.at(column, row),
            ) else {
                continue;
            };
            chosen.push([column, row]);
            worst.push(WorstReport {
                place_mm: [self.image.x_mm(column), self.image.y_mm(row), z_mm],
                region: face.region,
                deviation_mm,
            });
            if worst.len() == DeviationsReport::WORST {
                break;
            }
        }
        worst
    }
}

/// Distance of a point from a face along its normal: that from the form where one is known, else
/// from the plane that touches the free form below the point.
fn off(face: &Face, [x_mm, y_mm, z_mm]: [f64; 3]) -> f64 {
    if let Some(form) = &face.form {
        // Positive on the side that was seen, which is that of the camera.
        return form.distance_mm(&[x_mm, y_mm, z_mm].into());
    }
    let Surface::Patches(surface) = &face.surface;
    let [p, q] = [(1, 0), (0, 1)].map(|(u, v)| surface.z_partial(x_mm, y_mm, u, v));
    (z_mm - surface.z(x_mm, y_mm)) / (1.0 + p * p + q * q).sqrt()
}

/// The next 1, 2 or 5 times a power of ten, at least a micrometre.
fn round_up(value: f64) -> f64 {
    let value = if value.is_finite() {
        value.max(1e-3)
    } else {
        1.0
    };
    let decade = libm::pow(10.0, libm::floor(libm::log10(value)));
    let step = [1.0, 2.0, 5.0].into_iter().find(|m| m * decade >= value);
    step.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_round() {
        for (value, limit) in [
            (0.0, 0.001),
            (0.0432, 0.05),
            (0.05, 0.05),
            (0.0501, 0.1),
            (1.3, 2.0),
            (f64::NAN, 1.0),
        ] {
            assert!((round_up(value) - limit).abs() < 1e-12, "{value}");
        }
    }
}
