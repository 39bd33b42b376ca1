//! Corners between two sets of samples: two lines that meet.

use super::posterior::Posterior;
use super::side::{BESIDE, LANE, Labelled, Line, SLACK, TURNS, is_followed};

/// Where along the known line the corner is sought first, spacings.
const CORNERS: [f64; 5] = [-8.0, -4.0, 0.0, 4.0, 8.0];
/// Fewest samples that tell of each line.
const FEWEST: usize = 6;
/// Logarithm of the odds by which a corner must be better than a line: it is of three
/// parameters more.
const BETTER: f64 = 12.0;

/// Two lines. Of a set that fills an angle of less than half a turn every sample lies above
/// both, of the other set below one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wedge {
    lines: [Line; 2],
    /// 1 where the first set fills the angle, -1 where the second does.
    filling: f64,
}

impl Wedge {
    /// Signed distance of the node from the nearer line, in local spacings.
    pub(crate) fn distance(&self) -> f64 {
        let [a, b] = self.lines.map(|line| self.filling * line.distance());
        self.filling * a.min(b)
    }

    fn to(&self, s: &Labelled) -> f64 {
        let [a, b] = self.lines.map(|line| self.filling * line.to(s));
        self.filling * a.min(b)
    }

    /// The line that a sample of the set outside of the angle tells of.
    fn owner(&self, s: &Labelled) -> usize {
        let [a, b] = self.lines.map(|line| self.filling * line.to(s));
        usize::from(b < a)
    }

    /// The corner between these samples, where it explains them much better than the line
    /// does. Of the second set this share may be no evidence at all.
    pub(crate) fn find(
        line: &Line,
        doubtful: f64,
        samples: &[Labelled],
        lane: &mut Vec<Labelled>,
        posterior: &mut Posterior,
    ) -> Option<Self> {
        let mut best = (cost(samples, |s| line.to(s)) - BETTER, None);
        for filling in [1.0, -1.0] {
            for corner in CORNERS {
                let found = Self::near(line, corner, filling, samples, lane, posterior);
                let Some(wedge) = found else { continue };
                let cost = cost(samples, |s| wedge.to(s));
                if cost < best.0 {
                    best = (cost, Some(wedge));
                }
            }
        }
        let wedge = best.1?;
        lane.clear();
        lane.extend(samples.iter().filter(|s| wedge.to(s).abs() < LANE));
        let right = |s: &Labelled| s.label * wedge.to(s) > -SLACK;
        is_followed(lane, doubtful, right).then_some(wedge)
    }

    /// The corner sought from one at this place of the line.
    fn near(
        line: &Line,
        corner: f64,
        filling: f64,
        samples: &[Labelled],
        lane: &mut Vec<Labelled>,
        posterior: &mut Posterior,
    ) -> Option<Self> {
        let mut wedge = Self {
            lines: [*line; 2],
            filling,
        };
        for turn in 0..=TURNS {
            let before = wedge;
            for k in 0..2 {
                lane.clear();
                let mut own = 0;
                for s in samples {
                    let distance = s.label * before.lines[k].to(s);
                    let outside = s.label != filling;
                    let owner = if turn == 0 {
                        usize::from(line.along(s) > corner)
                    } else {
                        before.owner(s)
                    };
                    // Far on the wrong side it is no fault of the line's.
                    let within = turn == 0 || (-BESIDE..LANE).contains(&distance);
                    if (outside && owner != k) || !within {
                        continue;
                    }
                    own += usize::from(outside);
                    lane.push(*s);
                }
                if own < FEWEST {
                    return None;
                }
                wedge.lines[k] = if turn == 0 {
                    Line::among(lane)?
                } else {
                    before.lines[k].again(lane)?
                };
                if turn == TURNS {
                    wedge.lines[k] = wedge.lines[k].mean(lane, posterior);
                }
            }
        }
        Some(wedge)
    }
}

/// What the samples on the wrong side have against an edge.
fn cost(samples: &[Labelled], to: impl Fn(&Labelled) -> f64) -> f64 {
    let wrong = samples.iter().filter(|s| s.label * to(s) < -SLACK);
    wrong.map(|s| s.trust).sum()
}

#[cfg(test)]
mod tests {
    use super::super::side::tests::grid;
    use super::*;

    #[test]
    fn a_corner_is_found_where_no_line_is() {
        for (sign, name) in [(1.0, "convex"), (-1.0, "concave")] {
            let (mut squares, mut tried) = (0.0, 0);
            for k in 0..12 {
                let offset = 0.08 * f64::from(k) - 0.5;
                let edge = |v: f64| offset + 0.3 * v + sign * 0.9 * (v - 3.0).max(0.0);
                let samples = grid(14.0, edge);
                let line = Line::of([1.0, -0.3, -offset]).unwrap();
                let found = Wedge::find(
                    &line,
                    0.0,
                    &samples,
                    &mut Vec::new(),
                    &mut Posterior::default(),
                );
                let truth = -offset / libm::hypot(1.0, 0.3);
                let wedge = found.unwrap_or_else(|| panic!("{name} {k}"));
                squares += (wedge.distance() - truth).powi(2);
                tried += 1;
            }
            let rms = (squares / f64::from(tried)).sqrt();
            assert!(rms < 0.08, "{name} {rms}");
        }
    }

    #[test]
    fn a_line_is_no_corner() {
        let edge = |v: f64| 0.2 + 0.3 * v;
        let samples = grid(14.0, edge);
        let line = Line::of([1.0, -0.3, -0.2]).unwrap();
        let found = Wedge::find(
            &line,
            0.0,
            &samples,
            &mut Vec::new(),
            &mut Posterior::default(),
        );
        assert!(found.is_none());
    }
}
