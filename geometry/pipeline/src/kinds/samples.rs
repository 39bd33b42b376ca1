//! The samples that tell of a region's surface.

use nalgebra::Vector3;
use range_image::{Column, Monitor, RangeImage, RegionMap};
use shapes::{Sample, is_in_share};

use crate::columns::Columns;
use crate::neighbourhood::rise;
use crate::process::PipelineError;

/// A region's samples are halved when they come to twice as many: its numbers are then known
/// to some thousandths of the noise.
const MOST: usize = 1 << 15;
/// How far from the nodes a sample may lie, in deviations of the samples there; what is a
/// little too far for noise is the fit's to judge.
const NEAR: f64 = 10.0;
/// And besides, in pitches, for surfaces that bend between nodes.
const BEND: f64 = 0.1;
/// Nodes to either side over which the deviation is averaged.
const AROUND: usize = 2;
/// Rays are taken to meet a slope at least so squarely: the cosine of their incidence, times the
/// slope's steepness.
const MOST_OBLIQUE: f64 = 0.1;
/// Deviation where an image tells none, of its pitch.
const UNTOLD: f64 = 1e-3;

/// A sample on a region.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OnRegion {
    /// The lowest of the four nodes around it, column and row.
    pub(crate) cell: [u32; 2],
    pub(crate) sample: Sample,
}

impl OnRegion {
    /// The node that it lies nearest to, column and row.
    pub(crate) fn nearest(&self, image: &RangeImage) -> [usize; 2] {
        let [column, row] = self.cell.map(|index| index as usize);
        let half_mm = 0.5 * image.pitch_mm();
        let point_mm = self.sample.point_mm;
        [
            column + usize::from(point_mm.x - image.x_mm(column) > half_mm),
            row + usize::from(point_mm.y - image.y_mm(row) > half_mm),
        ]
    }
}

/// The samples of the regions, region by region. A sample is a region's if all four nodes around
/// it are.
pub(crate) fn of_regions(
    image: &RangeImage,
    regions: &RegionMap,
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<Vec<OnRegion>, PipelineError> {
    let places = Places::new(image, regions, columns.camera_mm());
    let mut kept = vec![Thinned::default(); usize::from(regions.regions())];
    let mut go_on = Ok(());
    columns
        .visit(&mut |column| {
            places.of_column(column, |label, sample| {
                kept[usize::from(label) - 1].push(sample);
            });
            go_on = monitor.check();
            go_on.is_ok()
        })
        .map_err(PipelineError::ReadAgain)?;
    go_on?;
    let all = kept.into_iter().flat_map(|thinned| thinned.kept);
    Ok(all.map(|(_, sample)| sample).collect())
}

/// Samples: all of them, or a share that is as evenly spread.
#[derive(Clone, Default)]
struct Thinned {
    /// Each with the number of those before it.
    kept: Vec<(u64, OnRegion)>,
    seen: u64,
    /// One in two to the power of this is kept.
    halvings: u32,
}

impl Thinned {
    fn push(&mut self, sample: OnRegion) {
        if is_in_share(self.seen, self.halvings) {
            self.kept.push((self.seen, sample));
        }
        self.seen += 1;
        if self.kept.len() == 2 * MOST {
            self.halvings += 1;
            let halvings = self.halvings;
            self.kept.retain(|(index, _)| is_in_share(*index, halvings));
        }
    }
}

/// What the range image says of places between nodes.
struct Places<'a> {
    image: &'a RangeImage,
    regions: &'a RegionMap,
    /// Of each node, column by column.
    nodes: Vec<Node>,
    /// As [`Columns::camera_mm`].
    camera_mm: Option<[f64; 2]>,
}

/// What the range image says of the samples at a node.
#[derive(Clone, Copy)]
struct Node {
    /// Standard deviation of their z, millimetres.
    deviation_mm: f32,
    /// As [`rise`] has it.
    rise: [f32; 2],
}

impl<'a> Places<'a> {
    fn new(image: &'a RangeImage, regions: &'a RegionMap, camera_mm: Option<[f64; 2]>) -> Self {
        let each = (0..image.columns()).flat_map(|c| (0..image.rows()).map(move |r| (c, r)));
        let node = |(column, row)| Node {
            deviation_mm: deviation_mm(image, regions, column, row) as f32,
            rise: rise(image, regions, column, row).map(|rise| rise as f32),
        };
        Self {
            image,
            regions,
            nodes: each.map(node).collect(),
            camera_mm,
        }
    }

    /// Unit direction of the ray to a point.
    fn ray(&self, point_mm: &Vector3<f64>) -> Vector3<f64> {
        let Some([y_mm, z_mm]) = self.camera_mm else {
            return Vector3::z();
        };
        let towards = Vector3::new(0.0, y_mm - point_mm.y, z_mm - point_mm.z);
        towards
            .try_normalize(f64::MIN_POSITIVE)
            .unwrap_or_else(Vector3::z)
    }

    /// Tells of the samples of a column that lie on regions, and of which.
    fn of_column(&self, column: &Column, mut tell: impl FnMut(u16, OnRegion)) {
        let (image, pitch_mm) = (self.image, self.image.pitch_mm());
        let cell = |at_mm: f64, first_mm: f64, nodes: usize| {
            let at = (at_mm - first_mm) / pitch_mm;
            let index = at.floor();
            (index >= 0.0 && index + 1.0 < nodes as f64).then_some((index as usize, at - index))
        };
        if image.columns() == 0 || image.rows() == 0 {
            return;
        }
        let x_mm = column.x_mm();
        let Some((c, u)) = cell(x_mm, image.x_mm(0), image.columns()) else {
            return;
        };
        for sample in column.samples() {
            let Some((r, v)) = cell(sample.y_mm, image.y_mm(0), image.rows()) else {
                continue;
            };
            let label = self.regions.label(c, r);
            let corners = [(c, r), (c + 1, r), (c, r + 1), (c + 1, r + 1)];
            if label == 0
                || corners
                    .iter()
                    .any(|&(c, r)| self.regions.label(c, r) != label)
            {
                continue;
            }
            let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            let mut z_mm = 0.0;
            let mut here = Node {
                deviation_mm: 0.0,
                rise: [0.0; 2],
            };
            for ((c, r), share) in corners.into_iter().zip(shares) {
                let node = &self.nodes[c * image.rows() + r];
                z_mm += share * image.z_mm(c, r).unwrap_or(f64::NAN);
                here.deviation_mm += share as f32 * node.deviation_mm;
                for (sum, rise) in here.rise.iter_mut().zip(node.rise) {
                    *sum += share as f32 * rise;
                }
            }
            let [along, up] = here.rise.map(f64::from);
            let deviation_mm = f64::from(here.deviation_mm).max(UNTOLD * pitch_mm);
            let steepness = (1.0 + along * along + up * up).sqrt();
            let far_mm = NEAR * deviation_mm + BEND * pitch_mm * steepness;
            // Not a number where a node has no value.
            if (sample.z_mm - z_mm).abs() <= far_mm {
                let point_mm = Vector3::new(x_mm, sample.y_mm, sample.z_mm);
                let ray = self.ray(&point_mm);
                // What is a deviation of z is less along a ray that meets the slope more
                // squarely.
                let covered = ray.z - along * ray.x - up * ray.y;
                let sample = Sample {
                    point_mm,
                    ray,
                    sigma_mm: deviation_mm / covered.abs().max(MOST_OBLIQUE),
                };
                let cell = [c as u32, r as u32];
                tell(label, OnRegion { cell, sample });
            }
        }
    }
}

/// Standard deviation of the z of samples around a node, on its own region, millimetres; 0
/// where the image does not tell.
fn deviation_mm(image: &RangeImage, regions: &RegionMap, column: usize, row: usize) -> f64 {
    let label = regions.label(column, row);
    if label == 0 {
        return 0.0;
    }
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for c in column.saturating_sub(AROUND)..(column + AROUND + 1).min(image.columns()) {
        for r in row.saturating_sub(AROUND)..(row + AROUND + 1).min(image.rows()) {
            let quality = image.quality(c, r).filter(|quality| quality.inliers > 0);
            if let Some(quality) = quality.filter(|_| regions.label(c, r) == label) {
                sum += f64::from(quality.scale_mm);
                count += 1.0;
            }
        }
    }
    sum / count.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_many_samples_is_evenly_spread() {
        let mut thinned = Thinned::default();
        let count = 9 * MOST as u64;
        for x in 0..count {
            let sample = Sample {
                point_mm: Vector3::new(x as f64, 0.0, 0.0),
                ray: Vector3::z(),
                sigma_mm: 1.0,
            };
            let cell = [0, 0];
            thinned.push(OnRegion { cell, sample });
        }
        assert_eq!(thinned.seen, count);
        assert!((MOST..2 * MOST).contains(&thinned.kept.len()));
        assert!(
            thinned
                .kept
                .iter()
                .all(|(x, on)| on.sample.point_mm.x == *x as f64)
        );
        // From the first to the last, and of every row of 256.
        let gaps = thinned.kept.windows(2).map(|pair| pair[1].0 - pair[0].0);
        assert!(gaps.max() < Some(40));
        let mut of_row = [0; 256];
        for (index, _) in &thinned.kept {
            of_row[(index % 256) as usize] += 1;
        }
        let even = thinned.kept.len() / 256;
        assert!(
            of_row
                .iter()
                .all(|count| (even / 2..2 * even).contains(count))
        );
    }
}
