//! Bent lines between two sets of samples.

use super::logistic::logistic;
use super::posterior::Posterior;
use super::side::{BESIDE, LANE, Labelled, Line, SLACK, STEEPNESS, STRAIGHT, TURNS, is_followed};

/// A parabola between two sets of samples, along a straight line through the node's
/// surroundings: a sample `across` that line and `along` it lies
/// `across + offset + slope along + bend along^2` from the parabola, measured across, on
/// the side of the first set where that is positive. Local spacings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arc {
    direction: [f64; 2],
    offset: f64,
    slope: f64,
    bend: f64,
}

impl Arc {
    /// The line itself.
    pub(crate) fn of(line: &Line) -> Self {
        let [g, h, offset] = line.coefficients();
        Self {
            direction: [g, h],
            offset,
            slope: 0.0,
            bend: 0.0,
        }
    }

    /// Signed distance of the node, in local spacings.
    pub(crate) fn distance(&self) -> f64 {
        self.offset / (1.0 + self.slope * self.slope).sqrt()
    }

    /// Where a sample is along the line, and across it.
    fn place(&self, s: &Labelled) -> (f64, f64) {
        let [g, h] = self.direction;
        (h * s.u - g * s.v, g * s.u + h * s.v)
    }

    fn at(&self, s: &Labelled) -> f64 {
        let (along, across) = self.place(s);
        across + self.offset + along * (self.slope + along * self.bend)
    }

    /// The best parabola between these samples, sought from this one.
    fn again(&self, samples: &[Labelled]) -> Option<Self> {
        let weights = [1.0, self.slope, self.bend, self.offset].map(|w| STEEPNESS * w);
        let [steepness, slope, bend, offset] = logistic(samples, weights, |s| {
            let (along, across) = self.place(s);
            [across, along, along * along, 1.0]
        })?;
        (steepness > 0.0).then(|| Self {
            slope: slope / steepness,
            bend: bend / steepness,
            offset: offset / steepness,
            ..*self
        })
    }

    /// The mean of the parabolas near this one, as these samples have it.
    fn mean(self, samples: &[Labelled], posterior: &mut Posterior) -> Self {
        posterior.begin();
        for s in samples {
            posterior.weigh(s, self.place(s).0, self.at(s));
        }
        let [offset, slope, bend] = posterior.parabola();
        Self {
            offset: self.offset - offset,
            slope: self.slope - slope,
            bend: self.bend - bend,
            ..self
        }
    }

    /// The parabola between these samples, along this one or the line that it is. `None`
    /// where they do not lie apart so. Of the second set this share may be no evidence at all.
    pub(crate) fn follow(
        mut self,
        doubtful: f64,
        samples: &[Labelled],
        lane: &mut Vec<Labelled>,
        posterior: &mut Posterior,
    ) -> Option<Self> {
        for _ in 0..TURNS {
            let mut wrong = 0;
            lane.clear();
            for s in samples {
                let distance = s.label * self.at(s);
                if distance < -BESIDE {
                    wrong += 1;
                } else if distance < LANE {
                    lane.push(*s);
                }
            }
            if wrong as f64 > STRAIGHT * samples.len() as f64 {
                return None;
            }
            self = self.again(lane)?;
        }
        let mean = self.mean(lane, posterior);
        let right = |s: &Labelled| s.label * mean.at(s) > -SLACK;
        is_followed(lane, doubtful, right).then_some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_is_followed_where_a_line_cuts_it() {
        let (mut squares, mut squares_straight) = (0.0, 0.0);
        for k in 0..20 {
            let offset = 0.05 * f64::from(k) - 0.5;
            let edge = |v: f64| offset + 0.2 * v - v * v / 120.0;
            let samples = crate::consensus::side::tests::grid(11.0, edge);
            let line = Line::of([1.0, -0.2, -offset]).unwrap();
            let arc = Arc::of(&line)
                .follow(0.0, &samples, &mut Vec::new(), &mut Posterior::default())
                .unwrap();
            let truth = -offset / libm::hypot(1.0, 0.2);
            squares += (arc.distance() - truth).powi(2);
            let mut samples = samples;
            let straight =
                crate::consensus::side::separate(&mut samples, &mut Posterior::default()).unwrap();
            squares_straight += (straight.distance() - truth).powi(2);
        }
        let rms = |squares: f64| (squares / 20.0).sqrt();
        assert!(rms(squares) < 0.08, "{}", rms(squares));
        assert!(rms(squares) < 0.5 * rms(squares_straight));
    }
}
