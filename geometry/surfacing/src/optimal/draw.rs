//! Fewer knots than least squares within the tolerance allow: with some taken away, the others
//! moved to make up for them, the surface is drawn within the tolerance ([`crate::within`]).

use range_image::Cancelled;

use super::polish::{Polish, State, TRIED, without};
use crate::knots::Knots;
use crate::within::{STEP_FITS, fit_within};

/// Where least squares are farther off than this many tolerances after a knot is lost, moving
/// the others will not do.
const HOPELESS: f64 = 6.0;

impl Polish<'_, '_> {
    /// Takes away knots as long as a surface can be drawn within the tolerance.
    pub(super) fn draw(&mut self, knots: Knots) -> Result<Knots, Cancelled> {
        let Some(mut state) = self.state(knots.clone()) else {
            return Ok(knots);
        };
        while self.fits_left > 0 && self.draw_fewer(&mut state)? {}
        Ok(state.knots)
    }

    fn draw_fewer(&mut self, state: &mut State) -> Result<bool, Cancelled> {
        let losses = self.losses(state)?;
        for (score, along, index) in losses.into_iter().take(TRIED) {
            if score.max > HOPELESS * self.problem.tolerance {
                continue;
            }
            let Some(mut fewer) = self.state(without(&state.knots, along, index)) else {
                continue;
            };
            self.move_all(&mut fewer, |score| score.gentle)?;
            if !self.is_within(&fewer)? {
                self.move_all(&mut fewer, |score| score.soft)?;
                if !self.is_within(&fewer)? {
                    continue;
                }
            }
            *state = fewer;
            return Ok(true);
        }
        Ok(false)
    }

    /// Whether a surface with these knots can be drawn within the tolerance.
    fn is_within(&mut self, state: &State) -> Result<bool, Cancelled> {
        let drawn = fit_within(self.problem, &state.u, &state.v, self.monitor)?;
        self.fits_left = self.fits_left.saturating_sub(1 + drawn.steps * STEP_FITS);
        Ok(drawn.fit.score.max <= self.problem.tolerance)
    }
}
