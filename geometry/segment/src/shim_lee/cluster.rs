//! Squared-error clustering (Dubes & Jain 1976): patterns are moved to the nearest centre
//! and centres to the mean of their patterns, from several random starts; the partition
//! with the least squared error is kept.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::SplitMix64;
use range_image::{Cancelled, Monitor};

/// A pattern: features of like variance.
pub(crate) type Pattern = [f64; 6];

/// Starts from which the best is taken.
const STARTS: usize = 3;
/// The starts work on no more patterns than this, spread evenly; the winner on all.
const SAMPLE: usize = 6000;
const SAMPLE_PASSES: usize = 20;
const FULL_PASSES: usize = 3;

/// The cluster of each pattern, below `clusters`.
pub(crate) fn cluster(
    patterns: &[Pattern],
    clusters: usize,
    seed: u64,
    monitor: &dyn Monitor,
) -> Result<Vec<u16>, Cancelled> {
    let every = patterns.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<Pattern> = patterns.iter().step_by(every).copied().collect();
    let mut best: Option<(f64, Vec<Pattern>)> = None;
    for start in 0..STARTS {
        let mut random = SplitMix64::seed_from_u64(seed.wrapping_add(start as u64));
        let mut centres = scatter(&sample, clusters, &mut random);
        let mut nearest = vec![0; sample.len()];
        let mut error = f64::INFINITY;
        for _ in 0..SAMPLE_PASSES {
            monitor.check()?;
            let now = assign(&sample, &centres, &mut nearest);
            let settled = now >= error * (1.0 - 1e-4);
            error = now;
            if settled {
                break;
            }
            recentre(&sample, &nearest, &mut centres);
        }
        if best.as_ref().is_none_or(|(least, _)| error < *least) {
            best = Some((error, centres));
        }
    }
    let mut centres = best.map(|(_, centres)| centres).unwrap_or_default();
    let mut nearest = vec![0; patterns.len()];
    for pass in 0..FULL_PASSES {
        monitor.check()?;
        assign(patterns, &centres, &mut nearest);
        if pass + 1 < FULL_PASSES {
            recentre(patterns, &nearest, &mut centres);
        }
    }
    Ok(nearest)
}

/// First centres: patterns drawn one after the other, each with a chance in proportion to
/// its squared distance from those already drawn.
fn scatter(patterns: &[Pattern], clusters: usize, random: &mut SplitMix64) -> Vec<Pattern> {
    let mut centres = Vec::with_capacity(clusters);
    let Some(&first) = patterns.get(
        (unit(random) * patterns.len() as f64).min(patterns.len().saturating_sub(1) as f64)
            as usize,
    ) else {
        return centres;
    };
    centres.push(first);
    let mut distances: Vec<f64> = patterns.iter().map(|p| squared(p, &first)).collect();
    while centres.len() < clusters {
        let total: f64 = distances.iter().sum();
        if total <= 0.0 {
            break;
        }
        let target = unit(random) * total;
        let mut sum = 0.0;
        let drawn = distances
            .iter()
            .position(|d| {
                sum += d;
                sum > target
            })
            .unwrap_or(patterns.len() - 1);
        let centre = patterns[drawn];
        centres.push(centre);
        for (distance, pattern) in distances.iter_mut().zip(patterns) {
            *distance = distance.min(squared(pattern, &centre));
        }
    }
    centres
}

/// Uniform in [0, 1).
fn unit(random: &mut SplitMix64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn squared(a: &Pattern, b: &Pattern) -> f64 {
    let mut sum = 0.0;
    for k in 0..a.len() {
        let d = a[k] - b[k];
        sum += d * d;
    }
    sum
}

/// Finds each pattern's nearest centre, the first of equals; returns the squared error.
fn assign(patterns: &[Pattern], centres: &[Pattern], nearest: &mut [u16]) -> f64 {
    let mut error = 0.0;
    for (pattern, nearest) in patterns.iter().zip(nearest) {
        let mut least = f64::INFINITY;
        for (k, centre) in centres.iter().enumerate() {
            let distance = squared(pattern, centre);
            if distance < least {
                least = distance;
                *nearest = k as u16;
            }
        }
        error += least;
    }
    error
}

/// Moves each centre to the mean of its patterns; a centre without patterns stays.
fn recentre(patterns: &[Pattern], nearest: &[u16], centres: &mut [Pattern]) {
    let mut sums = vec![([0.0; 6], 0_usize); centres.len()];
    for (pattern, &nearest) in patterns.iter().zip(nearest) {
        if let Some((sum, count)) = sums.get_mut(usize::from(nearest)) {
            for (sum, value) in sum.iter_mut().zip(pattern) {
                *sum += value;
            }
            *count += 1;
        }
    }
    for (centre, (sum, count)) in centres.iter_mut().zip(sums) {
        if count > 0 {
            *centre = sum.map(|s| s / count as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Unmonitored;

    fn blobs() -> Vec<Pattern> {
        let mut random = SplitMix64::seed_from_u64(1);
        (0..3000)
            .map(|k| {
                let mut pattern = [0.0; 6];
                pattern[k % 5] = 10.0;
                pattern.map(|v| v + unit(&mut random))
            })
            .collect()
    }

    #[test]
    fn separate_blobs_become_separate_clusters() {
        for seed in 0..10 {
            let nearest = cluster(&blobs(), 5, seed, &Unmonitored).unwrap();
            for (k, label) in nearest.iter().enumerate() {
                assert_eq!(*label, nearest[k % 5], "pattern {k}, seed {seed}");
            }
            let mut kinds = nearest[..5].to_vec();
            kinds.sort_unstable();
            assert_eq!(kinds, [0, 1, 2, 3, 4]);
        }
    }

    #[test]
    fn fewer_patterns_than_clusters_are_fine() {
        assert!(cluster(&[], 20, 0, &Unmonitored).unwrap().is_empty());
        assert_eq!(
            cluster(&[[1.0; 6]; 7], 20, 0, &Unmonitored).unwrap(),
            [0; 7]
        );
    }
}
