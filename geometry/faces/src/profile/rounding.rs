//! Arcs that round off the edge of two lines.
//!
//! An arc that touches the lines beside it has one free number, its radius. By itself it has three,
//! and each of its ends one more: so a narrow fillet is told from less with its lines than without.

use super::chain::{Chain, square};
use super::curve::{Curve, Moments};
use super::stations::Station;
use crate::search::least;

/// Widths looked at, and halvings between the best two.
const FIRST: u32 = 31;
const HALVINGS: u32 = 12;
/// Numbers that an arc between lines has less where it touches both.
const SPARED: f64 = 4.0;
/// Rounds of fitting the lines to what the arc leaves them.
const ROUNDS: usize = 2;

/// The chain with arcs that touch both lines beside them wherever these cost less, be it than what
/// is between two lines, or than their crease. Pieces are no narrower than `least_mm`.
pub(super) fn rounded(mut chain: Chain, stations: &[Station], price: f64, least_mm: f64) -> Chain {
    let own = chain.seen(stations);
    for k in (1..chain.curves.len().saturating_sub(1)).rev() {
        // Its own numbers, and the places of its ends, but for the radius.
        let spared = price * (chain.curves[k].freedom() + 1.0);
        round(&mut chain, &own, [k - 1, k + 1], spared, least_mm);
    }
    for k in (0..chain.curves.len() - 1).rev() {
        // Two lines have their crease where they meet, which has no number of its own.
        round(&mut chain, &own, [k, k + 1], -price, least_mm);
    }
    chain
}

/// Puts an arc between two lines of a chain if it leaves less than what is there, with what is
/// spared.
fn round(
    chain: &mut Chain,
    stations: &[Station],
    [first, second]: [usize; 2],
    spared: f64,
    least_mm: f64,
) -> Option<()> {
    let start = first.checked_sub(1).and_then(|k| chain.breaks_mm.get(k));
    let start = start.copied().unwrap_or(f64::NEG_INFINITY);
    let end = chain.breaks_mm.get(second).copied();
    let end = end.unwrap_or(f64::INFINITY);
    let is_own = |s: &&Station| s.s_mm >= start && s.s_mm < end;
    let own: Vec<Station> = stations.iter().filter(is_own).copied().collect();
    let mut lines = [*chain.curves.get(first)?, *chain.curves.get(second)?];
    let mut arc = None;
    for _ in 0..ROUNDS {
        let edge = Edge::of(lines, &own)?;
        let found = edge.best(&own, least_mm)?;
        let line = |is_in: &dyn Fn(f64) -> bool| {
            let own = own.iter().filter(|s| is_in(s.s_mm));
            let moments = own.fold(Moments::default(), |sum, s| sum.with(s));
            moments.line().0
        };
        lines = [
            line(&|s| s < found.ends_mm[0]),
            line(&|s| s >= found.ends_mm[1]),
        ];
        arc = Some(found);
    }
    let arc = Edge::of(lines, &own)?.with_width(arc?.width_mm());
    let before = chain.left_seen(&own);
    if arc.left(&lines, &own) >= before + spared {
        return None;
    }
    chain
        .curves
        .splice(first..=second, [lines[0], arc.curve, lines[1]]);
    chain.breaks_mm.splice(first..second, arc.ends_mm);
    chain.spared += SPARED;
    Some(())
}

/// An arc that touches two lines, and where.
#[derive(Debug, Clone, Copy)]
struct Touching {
    curve: Curve,
    ends_mm: [f64; 2],
}

impl Touching {
    fn width_mm(&self) -> f64 {
        self.ends_mm[1] - self.ends_mm[0]
    }

    /// What stations leave of the arc and the lines beside it.
    fn left(&self, lines: &[Curve; 2], stations: &[Station]) -> f64 {
        let curve = |s: &Station| match s.s_mm {
            s_mm if s_mm < self.ends_mm[0] => &lines[0],
            s_mm if s_mm < self.ends_mm[1] => &self.curve,
            _ => &lines[1],
        };
        stations.iter().map(|s| square(curve(s), s)).sum()
    }
}

/// The edge of two lines.
struct Edge {
    lines: [Curve; 2],
    normals: [[f64; 2]; 2],
    corner: [f64; 2],
    /// 1 where it stands out, -1 where it lies deep.
    side: f64,
    /// How far the arc reaches to either side of the corner, of its radius.
    reach: [f64; 2],
    /// First and last station.
    low_mm: f64,
    high_mm: f64,
}

impl Edge {
    /// `None` where they are no lines, or run side by side.
    fn of(lines: [Curve; 2], stations: &[Station]) -> Option<Self> {
        let [
            Curve::Line {
                through: p,
                normal: n,
            },
            Curve::Line {
                through: q,
                normal: m,
            },
        ] = lines
        else {
            return None;
        };
        let sine = n[0] * m[1] - n[1] * m[0];
        let (along_n, along_m) = (p[0] * n[0] + p[1] * n[1], q[0] * m[0] + q[1] * m[1]);
        let corner = [
            (along_n * m[1] - along_m * n[1]) / sine,
            (along_m * n[0] - along_n * m[0]) / sine,
        ];
        let cosine = n[0] * m[0] + n[1] * m[1];
        let half_tangent = sine.abs() / (1.0 + cosine);
        (corner[0].is_finite() && half_tangent > 0.0).then_some(Self {
            lines,
            normals: [n, m],
            corner,
            // The normal turns towards s where the slope becomes less.
            side: -sine.signum(),
            reach: [half_tangent * n[1], half_tangent * m[1]],
            low_mm: stations.first()?.s_mm,
            high_mm: stations.last()?.s_mm,
        })
    }

    fn with_width(&self, width_mm: f64) -> Touching {
        let radius_mm = width_mm / (self.reach[0] + self.reach[1]);
        let ends_mm = [
            self.corner[0] - radius_mm * self.reach[0],
            self.corner[0] + radius_mm * self.reach[1],
        ];
        let [n, _] = self.normals;
        let touched = self.lines[0].height(ends_mm[0]).unwrap_or(self.corner[1]);
        let curve = Curve::Arc {
            centre: [
                ends_mm[0] - self.side * radius_mm * n[0],
                touched - self.side * radius_mm * n[1],
            ],
            radius_mm,
            side: self.side,
        };
        Touching { curve, ends_mm }
    }

    /// The arc that leaves the least, as wide as pieces are, and with lines as wide beside it.
    fn best(&self, stations: &[Station], least_mm: f64) -> Option<Touching> {
        let all = self.reach[0] + self.reach[1];
        let rooms = [
            (self.corner[0] - self.low_mm - least_mm) / self.reach[0],
            (self.high_mm - self.corner[0] - least_mm) / self.reach[1],
        ];
        let most_mm = all * rooms[0].min(rooms[1]);
        if most_mm.is_nan() || most_mm < least_mm {
            return None;
        }
        let left = |at: f64| self.with_width(libm::exp(at)).left(&self.lines, stations);
        let range = (libm::log(least_mm), libm::log(most_mm));
        let width_mm = libm::exp(least(range, (FIRST, HALVINGS), left));
        Some(self.with_width(width_mm))
    }
}

#[cfg(test)]
mod tests {
    use super::super::cut::Cut;
    use super::*;

    /// Slopes of 0.4 and -0.2 with an edge of this radius, or a sharp one.
    fn stations(radius_mm: f64) -> Vec<Station> {
        let (turn_a, turn_b) = (libm::atan(0.4), libm::atan(0.2));
        let ends = [
            -radius_mm * libm::sin(turn_a),
            radius_mm * libm::sin(turn_b),
        ];
        let t_mm = |s: f64| {
            let on = s.clamp(ends[0], ends[1]);
            let over = (s - on) * if s < on { 0.4 } else { -0.2 };
            libm::sqrt(radius_mm * radius_mm - on * on) + over
        };
        let station = |k: i32| {
            let s_mm = 0.2 * f64::from(k) + 0.05;
            let noise = 0.008 * (f64::from((k * k + 100).rem_euclid(7)) / 3.0 - 1.0);
            Station {
                s_mm,
                t_mm: t_mm(s_mm) + noise,
                slope: 0.0,
                weight: 1.0 / (0.005 * 0.005),
            }
        };
        (-80..80).map(station).collect()
    }

    fn creased(stations: &[Station]) -> Chain {
        let cuts = [0, 80].map(|first| Cut {
            first,
            is_arc: false,
        });
        Chain::of(stations, &cuts, 1.0).unwrap()
    }

    #[test]
    fn a_round_edge_is_found_and_a_sharp_one_stays() {
        let round = stations(3.0);
        let chain = rounded(creased(&round), &round, 14.0, 1.0);
        let [
            _,
            Curve::Arc {
                radius_mm, side, ..
            },
            _,
        ] = chain.curves[..]
        else {
            panic!("{chain:?}")
        };
        assert!((radius_mm - 3.0).abs() < 0.4 && side > 0.0, "{chain:?}");
        // Two lines and a radius.
        assert!((chain.freedom() - 5.0).abs() < 1e-9);
        let sharp = stations(0.0);
        assert_eq!(rounded(creased(&sharp), &sharp, 14.0, 1.0).curves.len(), 2);
    }
}
