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
