//! Splines kept within bounds where nothing tells of them.
//!
//! A spline is made over a whole rectangle, its observations fill a part of it. Far from them the
//! outermost polynomials go on, and may go anywhere; programs that take a box around the poles
//! then show a part as a speck in it. A spline lies between the least and the greatest of its
//! coefficients, so bounding them bounds it.

use super::{Axis, Parameter, UniformSpline};
use crate::fit::Observation;

/// Spans may be so wide, in margins: functions reach over four of them.
const SPANS_OF_MARGIN: f64 = 1.5;

impl UniformSpline {
    /// Puts coefficients between two bounds whose functions vanish within `margin` of every
    /// observation, along u and v. Their knots are in use from now on. Where any are beyond the
    /// bounds, wide spans are halved first: every wide function is near some observation.
    pub fn bound_far(
        &mut self,
        observations: &[Observation],
        margin: f64,
        (low, high): (f64, f64),
    ) {
        let is_within = |c: &f64| (low..=high).contains(c);
        for along in [Parameter::U, Parameter::V] {
            while self.span(along) > SPANS_OF_MARGIN * margin {
                if self.coefficients.iter().all(is_within) {
                    return;
                }
                *self = self.halved(along);
            }
        }
        if self.coefficients.iter().all(is_within) {
            return;
        }
        let near = self.near(observations, margin);
        let rows = self.v.functions();
        for (k, c) in self.coefficients.iter_mut().enumerate() {
            if !near[k] && !is_within(c) {
                *c = c.clamp(low, high);
                self.u.use_function(k / rows);
                self.v.use_function(k % rows);
            }
        }
    }

    /// Of which functions something is seen within `margin` of an observation.
    fn near(&self, observations: &[Observation], margin: f64) -> Vec<bool> {
        let rows = self.v.functions();
        let mut near = vec![false; self.coefficients.len()];
        for o in observations {
            let functions =
                |axis: &Axis, at: f64| axis.basis(at - margin).0..axis.basis(at + margin).0 + 4;
            let along = functions(&self.v, o.v);
            for i in functions(&self.u, o.u) {
                near[i * rows..][along.clone()].fill(true);
            }
        }
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uniform::Lines;

    const MARGIN: f64 = 2.0;

    /// A steep spline over 0 to 32 both ways, on spans of 1, that was fitted along the diagonal.
    fn diagonal() -> (UniformSpline, Vec<Observation>) {
        let observations: Vec<Observation> = (0..=64)
            .flat_map(|i| (0..3).map(move |j| (0.5 * f64::from(i), 0.3 * f64::from(j))))
            .map(|(u, aside)| Observation {
                u,
                v: (u + aside).min(32.0),
                value: libm::sin(u),
                weight: 1.0,
            })
            .collect();
        let terms = [(0, 0), (1, 0), (0, 1)];
        let domain = (0.0, 32.0);
        let mut spline =
            UniformSpline::fit_polynomial(domain, domain, &terms, &observations, 1e-7).unwrap();
        for _ in 0..5 {
            spline = spline.halved(Parameter::U).halved(Parameter::V);
        }
        for (k, c) in spline.coefficients.iter_mut().enumerate() {
            let (i, j) = ((k / 35) as f64, (k % 35) as f64);
            *c += 3.0 * (i - j);
        }
        (spline, observations)
    }

    #[test]
    fn far_from_data_a_spline_stays_within_bounds_and_near_them_as_it_is() {
        let (before, observations) = diagonal();
        let mut after = before.clone();
        after.bound_far(&observations, MARGIN, (-12.0, 12.0));
        let mut farthest = [0.0_f64; 2];
        for i in 0..=64 {
            for j in 0..=64 {
                let (u, v) = (0.5 * f64::from(i), 0.5 * f64::from(j));
                let is_near = observations
                    .iter()
                    .any(|o| (o.u - u).abs() <= MARGIN && (o.v - v).abs() <= MARGIN);
                if is_near {
                    assert_eq!(after.value(u, v).to_bits(), before.value(u, v).to_bits());
                } else {
                    farthest[0] = farthest[0].max(before.value(u, v).abs());
                    farthest[1] = farthest[1].max(after.value(u, v).abs());
                }
            }
        }
        // Functions that reach over the margin keep what they had.
        assert!(farthest[0] > 80.0 && farthest[1] <= 25.0, "{farthest:?}");
    }

    #[test]
    fn patches_are_the_bounded_spline() {
        let (mut spline, observations) = diagonal();
        spline.bound_far(&observations, MARGIN, (-12.0, 12.0));
        let patches = spline.to_patches().unwrap();
        for (u, v) in [(0.3, 31.7), (30.2, 0.9), (12.4, 12.9), (3.1, 17.8)] {
            assert!(
                (patches.z(u, v) - spline.value(u, v)).abs() < 1e-9,
                "{u} {v}"
            );
        }
    }

    #[test]
    fn wide_spans_are_halved_to_tell_far_from_near() {
        let (_, observations) = diagonal();
        let corner = |u: f64, v: f64| 0.02 * (u - v) * (u - v) * (u - v);
        let all: Vec<Observation> = (0..33 * 33)
            .map(|k| (f64::from(k / 33), f64::from(k % 33)))
            .map(|(u, v)| Observation {
                u,
                v,
                value: corner(u, v),
                weight: 1.0,
            })
            .collect();
        let terms: Vec<_> = (0..16).map(|k| (k / 4, k % 4)).collect();
        let domain = (0.0, 32.0);
        let before = UniformSpline::fit_polynomial(domain, domain, &terms, &all, 0.0).unwrap();
        let mut after = before.clone();
        after.bound_far(&observations, MARGIN, (-12.0, 12.0));
        assert!(before.value(32.0, 0.0) > 600.0 && before.value(0.0, 32.0) < -600.0);
        let farthest = after
            .coefficients
            .iter()
            .fold(0.0_f64, |most, c| most.max(c.abs()));
        assert!(farthest < 40.0, "{farthest}");
        for o in &observations {
            assert!((after.value(o.u, o.v) - before.value(o.u, o.v)).abs() < 1e-9);
        }
    }

    #[test]
    fn what_keeps_within_its_bounds_gets_no_knots() {
        let (spline, observations) = diagonal();
        let mut wide = spline.clone();
        wide.bound_far(&observations, MARGIN, (-200.0, 200.0));
        assert_eq!(wide, spline);
        let lines = Lines::new(&observations);
        assert_eq!(wide.residuals(&lines), spline.residuals(&lines));
    }
}
