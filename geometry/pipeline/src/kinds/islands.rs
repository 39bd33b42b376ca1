//! Parts of a free form that something stands around, or that lie beyond it: too small to tell by
//! themselves what they are of.

use nalgebra::Vector3;
use shapes::{Sample, Verdict, is_part_of_free_form, spread};

use super::RegionKind;
use super::bearing::Bearing;

/// Samples of a region that are looked at, and of the free form around it times as many, no fewer.
const SAMPLES: usize = 1000;
const AROUND: usize = 3;
const LEAST_AROUND: usize = 600;

/// Which regions of a shape are parts of a free form that has more samples than they do.
pub(super) fn islands(decided: &[RegionKind], bearings: &[Bearing]) -> Vec<usize> {
    let is_free = |kind: &RegionKind| matches!(kind.evidence.verdict, Verdict::FreeForm);
    let both = || decided.iter().zip(bearings);
    let free: Vec<&Bearing> = both().filter(|(k, _)| is_free(k)).map(|(_, b)| b).collect();
    let each = both().enumerate();
    let found = each.filter(|(_, (kind, own))| {
        let Some(fit) = kind.evidence.fit() else {
            return false;
        };
        let samples = few(&own.samples);
        free.iter()
            .filter(|other| other.samples.len() > own.samples.len())
            .any(|other| {
                let around = nearest(&other.samples, &samples);
                around.len() >= LEAST_AROUND && is_part_of_free_form((fit, &samples), &around)
            })
    });
    found.map(|(index, _)| index).collect()
}

/// Of the samples of one region, those nearest to another's.
fn nearest(samples: &[Sample], to: &[Sample]) -> Vec<Sample> {
    let sum: Vector3<f64> = to.iter().map(|sample| sample.point_mm).sum();
    let middle = sum / to.len().max(1) as f64;
    let far = |sample: &Sample| (sample.point_mm - middle).xy().norm_squared();
    let most = (AROUND * to.len()).max(LEAST_AROUND);
    let mut near = samples.to_vec();
    if near.len() > most {
        near.select_nth_unstable_by(most, |a, b| far(a).total_cmp(&far(b)));
        near.truncate(most);
    }
    near
}

fn few(samples: &[Sample]) -> Vec<Sample> {
    let taken = spread(samples.len(), SAMPLES);
    taken.map(|index| samples[index]).collect()
}

#[cfg(test)]
mod tests {
    use range_image::{Lattice, RangeImage, RegionMap, Unmonitored};

    use super::*;
    use crate::kinds::samples::OnRegion;
    use crate::kinds::{SmoothJoins, kinds};

    const SIDE: usize = 80;
    const PITCH_MM: f64 = 0.4;

    /// Whether what lies in the middle of a ring on a wavy sheet, so much above that, is told as a
    /// free form as well.
    fn is_island(above_mm: f64) -> bool {
        let lattice = Lattice { pitch_mm: PITCH_MM };
        let mut image = RangeImage::masked(lattice, -40, -40, SIDE, SIDE);
        let sheet = |x: f64, y: f64| 2.0 * libm::sin(0.06 * x + 0.5) * libm::cos(0.05 * y);
        let (mut labels, mut samples) = (Vec::new(), Vec::new());
        for node in 0..SIDE * SIDE {
            let (column, row) = (node / SIDE, node % SIDE);
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            let label = match (x * x + y * y).sqrt() {
                out if out < 4.5 => 1,
                out if (9.0..15.0).contains(&out) => 2,
                _ => 0,
            };
            let z_mm = sheet(x, y) + if label == 1 { above_mm } else { 0.0 };
            image.set_z_mm(column, row, Some(z_mm));
            labels.push(label);
            let turned = (node as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mixed = (turned ^ (turned >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40;
            let noise = 0.05 * 1.73 * (mixed as f64 / f64::from(1 << 23) - 1.0);
            if label != 0 && column + 1 < SIDE && row + 1 < SIDE {
                samples.push(OnRegion {
                    cell: [column as u32, row as u32],
                    sample: Sample {
                        point_mm: Vector3::new(x, y, z_mm + noise),
                        ray: Vector3::z(),
                        sigma_mm: 0.05,
                    },
                });
            }
        }
        let regions = RegionMap::new(&image, labels);
        let smooth = SmoothJoins::Split;
        let decided = kinds(&image, &regions, Some(&samples), smooth, &Unmonitored).unwrap();
        let is_free = |column: usize| {
            let kind = &decided.kinds[usize::from(regions.label(column, SIDE / 2)) - 1];
            matches!(kind.evidence.verdict, Verdict::FreeForm)
        };
        assert!(is_free(SIDE / 2 + 28), "the sheet");
        is_free(SIDE / 2)
    }

    #[test]
    fn what_a_ring_stands_around_is_told_with_the_sheet_beyond() {
        assert!(is_island(0.0));
        assert!(!is_island(0.5));
    }
}
