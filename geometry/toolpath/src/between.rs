//! The cusp that two passes of a ball cutter leave where it is highest: as far from one as from the
//! other.
//!
//! A pass amid the two would touch the surface at `P = M - R n`, with its centre at `M` and the
//! surface's normal `n`. A ball of one of the passes with its centre at `M + w` leaves, on the normal
//! through `P`, `R + n.w - sqrt(R^2 - w^2 + (n.w)^2)`.

use crate::field::Field;
use crate::parallel::STEEP;
use crate::scallop::{Place, nearest};

/// Rounds of halving for the place as far from both passes.
const ROUNDS: usize = 10;
/// Share of the radius between heights that slopes are told from.
const APART: f64 = 0.02;

/// Two neighbouring passes.
pub(crate) struct Between<'a> {
    pub(crate) field: &'a Field<'a>,
    pub(crate) passes: [&'a [Place]; 2],
    /// Stations to both sides in which the nearest place is sought.
    pub(crate) window: usize,
}

impl Between<'_> {
    /// Height of the cusp at a station, along the normal, millimetres; `None` where there are not
    /// both passes, or the surface is too steep.
    pub(crate) fn cusp_mm(&self, station: usize) -> Option<f64> {
        let [a, b] = self.passes.map(|pass| pass.get(station).copied());
        let (a, b) = (a?, b?);
        let (za, zb) = (a.tip?, b.tip?);
        let near = self.passes.map(|pass| {
            let from = station.saturating_sub(self.window);
            &pass[from..(station + self.window + 1).min(pass.len())]
        });
        let amid = |share: f64| [a.s, a.t + share * (b.t - a.t), za + share * (zb - za)];
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..ROUNDS {
            let share = f64::midpoint(low, high);
            let [p, q] = near.map(|pass| nearest(pass, amid(share)));
            if p?.0 < q?.0 {
                low = share;
            } else {
                high = share;
            }
        }
        let [s, t, _] = amid(f64::midpoint(low, high));
        let middle = [s, t, self.field.tip_at(s, t)?];
        let normal = self.normal(s, t)?;
        let leaves = |pass: &[Place]| {
            let (square, foot, _) = nearest(pass, middle)?;
            let radius = self.field.cutter.radius_mm();
            let along: f64 = (0..3).map(|k| normal[k] * (foot[k] - middle[k])).sum();
            let root = radius * radius - square + along * along;
            (root > 0.0).then(|| radius + along - root.sqrt())
        };
        // An error of the normal adds to the one what it takes from the other.
        let [p, q] = near.map(leaves);
        Some(f64::midpoint(p?, q?))
    }

    fn normal(&self, s: f64, t: f64) -> Option<[f64; 3]> {
        let apart = APART * self.field.cutter.radius_mm();
        let slope = |ds: f64, dt: f64| {
            let ahead = self.field.tip_at(s + ds, t + dt)?;
            let behind = self.field.tip_at(s - ds, t - dt)?;
            Some((ahead - behind) / (2.0 * apart))
        };
        let (gs, gt) = (slope(apart, 0.0)?, slope(0.0, apart)?);
        let nz = 1.0 / (1.0 + gs * gs + gt * gt).sqrt();
        (nz >= STEEP).then_some([-gs * nz, -gt * nz, nz])
    }
}
