//! Points thinned: dense where the surface is wanted, sparse far from there.

use glam::DVec3;

use super::Sample;

/// Distance to which points count as near, of the region's size.
const NEAR: f64 = 0.25;
/// Halvings of the interval in which the spread lies.
const HALVINGS: usize = 14;

/// Spreads numbers over all bits: the order in which points are looked at must have nothing to do
/// with where they are.
fn mixed(k: u64) -> u64 {
    let mut x = k.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Indices of at most `most` samples, about evenly spread for their reach; in an order whose every
/// beginning is spread as well.
pub(super) fn thinned(samples: &[Sample], unit_mm: f64, most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by_key(|&k| mixed(k as u64));
    if samples.len() <= most {
        return order;
    }
    let spread = |k: usize| samples[k].reach_mm + NEAR * unit_mm;
    // As many as are looked at to find the spread; all of them are then gone through with it.
    let (mut narrow, mut wide) = (0.0_f64, 1.0_f64);
    let mut best = Vec::new();
    for _ in 0..HALVINGS {
        let by = 0.5 * (narrow + wide);
        let kept = spread_out(samples, &order, most, |k| by * spread(k));
        match kept {
            Some(kept) => {
                wide = by;
                let is_enough = kept.len() * 20 >= most * 19;
                best = kept;
                if is_enough {
                    break;
                }
            }
            None => narrow = by,
        }
    }
    if best.is_empty() {
        order.truncate(most);
        return order;
    }
    best
}

/// Samples of which none is nearer to one before it than its distance; `None` where these are more
/// than `most`.
fn spread_out(
    samples: &[Sample],
    order: &[usize],
    most: usize,
    distance: impl Fn(usize) -> f64,
) -> Option<Vec<usize>> {
    let mut kept: Vec<usize> = Vec::with_capacity(most);
    let mut places: Vec<DVec3> = Vec::with_capacity(most);
    for &k in order {
        let (own, least) = (samples[k].place_mm, distance(k));
        let least = least * least;
        if places.iter().any(|p| p.distance_squared(own) < least) {
            continue;
        }
        if kept.len() == most {
            return None;
        }
        kept.push(k);
        places.push(own);
    }
    Some(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_points_are_kept_and_far_ones_thinned() {
        let samples: Vec<Sample> = (0..4000)
            .map(|k| {
                let (x, y) = (f64::from(k % 200), f64::from(k / 200));
                Sample {
                    place_mm: DVec3::new(x, y, 0.0),
                    normal: DVec3::Z,
                    reach_mm: x,
                }
            })
            .collect();
        let kept = thinned(&samples, 20.0, 300);
        assert!((270..=300).contains(&kept.len()), "{}", kept.len());
        let near = kept.iter().filter(|&&k| samples[k].reach_mm < 50.0).count();
        let far = kept
            .iter()
            .filter(|&&k| samples[k].reach_mm >= 150.0)
            .count();
        assert!(near > 4 * far, "{near} {far}");
        assert_eq!(thinned(&samples[..50], 20.0, 300).len(), 50);
    }
}
