//! A profile cut into straight lines and circular arcs, in the best of all ways.
//!
//! The cost of a chain is the sum of those of its pieces, so the best chain up to a station is a
//! last piece and the best chain up to where that begins (Bellman 1961, "On the approximation of
//! curves by line segments using dynamic programming").

use super::chain::{middle, moved};
use super::curve::Moments;
use super::stations::Station;

/// A piece of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cut {
    /// Its first station.
    pub(super) first: usize,
    pub(super) is_arc: bool,
}

/// The best pieces, of this width at least. Each number that they need has a price, as has the
/// place of each break.
pub(super) fn cuts(stations: &[Station], least_mm: f64, price: f64) -> Vec<Cut> {
    let middle = middle(stations);
    let own: Vec<Station> = stations.iter().map(|s| moved(s, middle)).collect();
    let mut sums = vec![Moments::default()];
    for station in &own {
        sums.push(sums[sums.len() - 1].with(station));
    }
    let mut best = vec![
        (
            f64::INFINITY,
            Cut {
                first: 0,
                is_arc: false
            }
        );
        own.len() + 1
    ];
    best[0].0 = 0.0;
    for end in 1..=own.len() {
        for first in (0..end).rev() {
            let (low, high) = (own[first].s_mm, own[end - 1].s_mm);
            let before = best[first].0 + if first > 0 { price } else { 0.0 };
            if high - low < least_mm || before + 2.0 * price >= best[end].0 {
                continue;
            }
            let moments = sums[end].without(&sums[first]);
            let (_, left) = moments.line();
            let line = before + 2.0 * price + left;
            if line < best[end].0 {
                best[end] = (
                    line,
                    Cut {
                        first,
                        is_arc: false,
                    },
                );
            }
            // An arc has one number more.
            if left > price
                && before + 3.0 * price < best[end].0
                && let Some((_, left)) = moments.arc(low, high)
                && before + 3.0 * price + left < best[end].0
            {
                best[end] = (
                    before + 3.0 * price + left,
                    Cut {
                        first,
                        is_arc: true,
                    },
                );
            }
        }
    }
    let mut cuts = Vec::new();
    let mut end = own.len();
    while end > 0 && best[end].0.is_finite() {
        cuts.push(best[end].1);
        end = best[end].1.first;
    }
    cuts.reverse();
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_an_arc_and_a_line_are_three_pieces() {
        // A fillet of 5 mm that turns by 0.6 and touches both lines.
        let t_mm = |s: f64| {
            let end = 5.0 * libm::sin(0.3);
            let on = s.clamp(-end, end);
            libm::sqrt(25.0 - on * on) - (s - on).abs() * libm::tan(0.3)
        };
        let stations: Vec<Station> = (-100..100)
            .map(|k| Station {
                s_mm: 0.2 * f64::from(k) + 0.1,
                t_mm: t_mm(0.2 * f64::from(k) + 0.1) + 0.004 * f64::from(k * k % 7 - 3) / 2.0,
                slope: 0.0,
                weight: 1.0 / (0.004 * 0.004),
            })
            .collect();
        let cuts = cuts(&stations, 1.0, 14.0);
        let kinds: Vec<bool> = cuts.iter().map(|cut| cut.is_arc).collect();
        assert_eq!(kinds, [false, true, false]);
        assert!(
            cuts[1].first.abs_diff(92) <= 2 && cuts[2].first.abs_diff(108) <= 2,
            "{cuts:?}"
        );
    }
}
