//! How high the cusp is that two neighbouring passes leave between them.
//!
//! Near a place each pass is taken as straight, with its own slope along the feed. What it leaves
//! at a distance across is then the cutter on an endless edge upside down, for which there is a
//! closed form (see `edge`); the cusp is where both passes leave the same height. It is counted
//! from what a pass amid the two would leave there, along the normal: on a plane and a ball of
//! radius `R` that is `R - sqrt(R^2 - D^2 / 4)` with `D` the distance of the passes in space, and on
//! curved surfaces what is known of these, since the pass amid them follows the surface.

use crate::cutter::Cutter;
use crate::edge::highest;

/// The step-over of a flat end on slopes, as a share of its radius.
const FLAT_STEP: f64 = 0.2;
/// Rounds of halving for where the cusp is.
const ROUNDS: usize = 32;

/// A pass near a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// Where it runs, across the feed, millimetres.
    pub(crate) across: f64,
    /// Height of the tip, millimetres.
    pub(crate) tip: f64,
    /// Slope along the feed.
    pub(crate) slope: f64,
}

impl Near {
    /// What is left of the material at a place across.
    fn leaves(&self, cutter: &Cutter, across: f64) -> Option<f64> {
        let apart = (across - self.across).abs();
        highest(cutter, -self.slope, apart).map(|best| self.tip - best)
    }
}

/// Height of the cusp along the surface's normal, and z of that normal. It is infinite where the
/// passes are too far from each other to leave a common height.
pub(crate) fn height_mm(cutter: &Cutter, a: Near, b: Near, amid: Near) -> (f64, f64) {
    let across = (b.tip - a.tip) / (b.across - a.across);
    let along = amid.slope;
    let nz = 1.0 / (1.0 + across * across + along * along).sqrt();
    let above = |amid: Near| {
        let place = meeting(cutter, a, b)?;
        let cusp = a.leaves(cutter, place)?.max(b.leaves(cutter, place)?);
        Some(cusp - amid.leaves(cutter, place)?)
    };
    (above(amid).map_or(f64::INFINITY, |above| above * nz), nz)
}

/// Where two passes leave the same height.
fn meeting(cutter: &Cutter, a: Near, b: Near) -> Option<f64> {
    let radius = cutter.radius_mm();
    let (mut low, mut high) = (b.across - radius, a.across + radius);
    if low >= high {
        return None;
    }
    let above = |across: f64| {
        // Beyond the reach of a pass it leaves everything.
        match (a.leaves(cutter, across), b.leaves(cutter, across)) {
            (Some(p), Some(q)) => p - q,
            (Some(_), None) => f64::NEG_INFINITY,
            _ => f64::INFINITY,
        }
    };
    if above(low) > 0.0 || above(high) < 0.0 {
        return None;
    }
    for _ in 0..ROUNDS {
        let middle = f64::midpoint(low, high);
        if above(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(f64::midpoint(low, high))
}

/// The step-over that leaves cusps of this height on a level plane, millimetres.
pub(crate) fn level_step_mm(cutter: &Cutter, cusp_mm: f64) -> f64 {
    let r = cutter.corner_mm();
    let cusp = cusp_mm.min(r);
    2.0 * (cutter.disc_mm() + (cusp * (2.0 * r - cusp)).sqrt())
}

/// The step-over that is small for a slope, millimetres: that of the corner alone, and for a flat end,
/// whose steps on a slope have no other measure, a share of its radius.
pub(crate) fn slope_step_mm(cutter: &Cutter, cusp_mm: f64) -> f64 {
    let corner = level_step_mm(cutter, cusp_mm) - 2.0 * cutter.disc_mm();
    let step = if corner > 0.0 {
        corner
    } else {
        FLAT_STEP * cutter.radius_mm()
    };
    step.max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cusps_on_planes_are_those_of_the_formula() {
        let cutter = Cutter::ball(6.0).unwrap();
        for (across, along) in [(0.0, 0.0), (0.7, 0.0), (0.0, 0.7), (-1.2, 0.5), (2.0, 2.0)] {
            let step = 0.4;
            let at = |t: f64| Near {
                across: t,
                tip: across * t,
                slope: along,
            };
            let (cusp, _) = height_mm(&cutter, at(0.0), at(step), at(step / 2.0));
            let square = step * step * (1.0 + across * across / (1.0 + along * along));
            let formula = 3.0 - (9.0 - square / 4.0).sqrt();
            assert!(
                (cusp - formula).abs() < 5e-3 * formula,
                "{across} {along}: {cusp} {formula}"
            );
        }
    }

    #[test]
    fn on_a_level_plane_the_step_leaves_what_is_asked_for() {
        for cutter in ["ball:6", "bull:10:2"] {
            let cutter: Cutter = cutter.parse().unwrap();
            let step = level_step_mm(&cutter, 0.01);
            let at = |t: f64| Near {
                across: t,
                tip: 1.0,
                slope: 0.0,
            };
            let (cusp, nz) = height_mm(&cutter, at(0.0), at(step), at(step / 2.0));
            assert!((cusp - 0.01).abs() < 1e-9, "{cutter}: {cusp}");
            assert_eq!(nz, 1.0);
        }
    }
}
