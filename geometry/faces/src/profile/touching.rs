//! Arcs that go on from a line smoothly.
//!
//! Such an arc has two free numbers, its radius and where it leaves the line; by itself it has
//! three, and the break one more. So a short arc, and where it begins, are told better with the
//! line.

use super::chain::{Chain, left};
use super::curve::{Curve, Moments};
use super::stations::Station;
use crate::search::least;

/// Places looked at where the arc may leave the line, and halvings between the best two.
const FIRST: u32 = 61;
const HALVINGS: u32 = 10;
/// Numbers that an arc has less where it touches a line.
const SPARED: f64 = 2.0;

/// The chain with arcs beside one line that touch it wherever that costs less. Pieces are no
/// narrower than `least_mm`.
pub(super) fn touching(mut chain: Chain, stations: &[Station], price: f64, least_mm: f64) -> Chain {
    let own = chain.seen(stations);
    let is_line = |curve: Option<&Curve>| matches!(curve, Some(Curve::Line { .. }));
    for k in 0..chain.curves.len() {
        let before = k.checked_sub(1).and_then(|k| chain.curves.get(k));
        let sides = [is_line(before), is_line(chain.curves.get(k + 1))];
        match (chain.curves[k], sides) {
            (Curve::Arc { .. }, [true, false]) => {
                touch(&mut chain, &own, (k - 1, k), price, least_mm);
            }
            (Curve::Arc { .. }, [false, true]) => {
                touch(&mut chain, &own, (k + 1, k), price, least_mm);
            }
            _ => {}
        }
    }
    chain
}

/// Makes an arc beside a line touch it, if that leaves hardly more.
fn touch(
    chain: &mut Chain,
    stations: &[Station],
    (line, arc): (usize, usize),
    price: f64,
    least_mm: f64,
) -> Option<()> {
    let first = line.min(arc);
    let start = first
        .checked_sub(1)
        .map_or(f64::NEG_INFINITY, |k| chain.breaks_mm[k]);
    let end = chain
        .breaks_mm
        .get(first + 1)
        .copied()
        .unwrap_or(f64::INFINITY);
    let is_own = |s: &&Station| s.s_mm >= start && s.s_mm < end;
    let own: Vec<Station> = stations.iter().filter(is_own).copied().collect();
    let (low, high) = (own.first()?.s_mm + least_mm, own.last()?.s_mm - least_mm);
    let of = |curve: &Curve, at_mm: f64| {
        // The line, the arc that leaves it there, and what they leave.
        let is_after = arc > line;
        let (of_arc, of_line): (Vec<Station>, Vec<Station>) =
            own.iter().partition(|s| (s.s_mm >= at_mm) == is_after);
        let found = leaving(curve, at_mm, &of_arc)?;
        let left = left(curve, &of_line) + left(&found, &of_arc);
        let moments = of_line
            .iter()
            .fold(Moments::default(), |sum, s| sum.with(s));
        Some((left, found, moments.line().0))
    };
    let best = |curve: &Curve| {
        let left = |at: f64| of(curve, at).map_or(f64::INFINITY, |(left, ..)| left);
        least((low, high), (FIRST, HALVINGS), left)
    };
    if high <= low {
        return None;
    }
    let (_, _, again) = of(&chain.curves[line], best(&chain.curves[line]))?;
    let at_mm = best(&again);
    let (left_now, found, _) = of(&again, at_mm)?;
    let before = chain.left_seen(&own);
    if left_now >= before + SPARED * price {
        return None;
    }
    chain.curves[line] = again;
    chain.curves[arc] = found;
    chain.breaks_mm[first] = at_mm;
    chain.spared += SPARED;
    Some(())
}

/// The arc through stations that leaves a line at s. With u along the line from there and v above
/// it, its points have curvature (u^2 + v^2) + 2 v = 0, and others are half of that off.
fn leaving(line: &Curve, at_mm: f64, stations: &[Station]) -> Option<Curve> {
    let Curve::Line { normal, .. } = line else {
        return None;
    };
    let from = [at_mm, line.height(at_mm)?];
    let (mut with, mut squares) = (0.0, 0.0);
    for station in stations {
        let (s, t) = (station.s_mm - from[0], station.t_mm - from[1]);
        let above = s * normal[0] + t * normal[1];
        let square = s * s + t * t;
        with -= 2.0 * station.weight * square * above;
        squares += station.weight * square * square;
    }
    let curvature = with / squares;
    let radius_mm = 1.0 / curvature.abs();
    let centre = [
        from[0] - normal[0] / curvature,
        from[1] - normal[1] / curvature,
    ];
    let reaches = |s: &Station| (s.s_mm - centre[0]).abs() < radius_mm;
    let is_arc = radius_mm.is_finite() && stations.iter().all(reaches);
    is_arc.then_some(Curve::Arc {
        centre,
        radius_mm,
        side: curvature.signum(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::cut::Cut;
    use super::*;

    #[test]
    fn an_arc_that_goes_on_from_a_line_begins_where_it_touches() {
        // A bar with a round end of 7 mm, of which 3.5 mm are seen.
        let t_mm = |s: f64| libm::sqrt(49.0 - s.max(0.0).powi(2));
        let station = |k: i32| {
            let s_mm = 0.2 * f64::from(k) + 0.05;
            let noise = 0.01 * (f64::from((k * k + 200).rem_euclid(7)) / 3.0 - 1.0);
            let weight = 1.0 / (0.008 * 0.008);
            Station {
                s_mm,
                t_mm: t_mm(s_mm) + noise,
                slope: 0.0,
                weight,
            }
        };
        let stations: Vec<Station> = (-80..17).map(station).collect();
        let cuts = [(0, false), (84, true)].map(|(first, is_arc)| Cut { first, is_arc });
        let chain = Chain::of(&stations, &cuts, 1.0).unwrap();
        let (before, freedom) = (chain.left(&stations), chain.freedom());
        let chain = touching(chain, &stations, 14.0, 1.0);
        assert!((freedom - chain.freedom() - 2.0).abs() < 1e-9);
        assert!(chain.left(&stations) < before + 28.0);
        let Curve::Arc { radius_mm, .. } = chain.curves[1] else {
            panic!("{chain:?}")
        };
        assert!((radius_mm - 7.0).abs() < 0.4, "{radius_mm}");
        assert_eq!((chain.at(-0.5), chain.at(0.5)), (0, 1));
    }

    #[test]
    fn an_arc_that_meets_a_line_in_a_crease_stays() {
        let t_mm = |s: f64| libm::sqrt(49.0 - s.max(0.0).powi(2)) - 0.2 * s.max(0.0);
        let station = |k: i32| {
            let s_mm = 0.2 * f64::from(k) + 0.05;
            Station {
                s_mm,
                t_mm: t_mm(s_mm),
                slope: 0.0,
                weight: 1e5,
            }
        };
        let stations: Vec<Station> = (-80..17).map(station).collect();
        let cuts = [(0, false), (80, true)].map(|(first, is_arc)| Cut { first, is_arc });
        let chain = Chain::of(&stations, &cuts, 1.0).unwrap();
        let freedom = chain.freedom();
        assert_eq!(touching(chain, &stations, 14.0, 1.0).freedom(), freedom);
    }
}
