//! Colour bars: what a colour means in numbers.

use super::canvas::{Rgb, TEXT_HEIGHT, Weight};
use super::plot::{FAINT, INK, Plot, ticks};

const GAP: usize = 24;
const WIDTH: usize = 22;
/// Width to leave beside a plot for a bar and its numbers, pixels.
pub(super) const ROOM: usize = 140;
/// A bar beside a low plot is at least this high, pixels.
const LEAST_HEIGHT: usize = 150;
/// Height to leave for a plot with a bar, pixels.
pub(super) const LEAST_PLOT: usize = LEAST_HEIGHT;

/// A colour bar to be.
pub(super) struct Scale<'a> {
    /// What is shown, with its unit.
    pub(super) heading: &'a str,
    /// Value at the lower end.
    pub(super) low: f64,
    /// Value at the upper end.
    pub(super) high: f64,
    /// Whether values beyond the ends are shown in the colours of the ends.
    pub(super) open: bool,
    /// The colour of a share of the way from low to high.
    pub(super) colour: &'a dyn Fn(f64) -> Rgb,
}

impl Scale<'_> {
    /// The colour of a value.
    pub(super) fn of(&self, value: f64) -> Rgb {
        (self.colour)(self.share(value))
    }

    fn share(&self, value: f64) -> f64 {
        if self.high > self.low {
            ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
        } else {
            0.5
        }
    }

    /// Left end, y and width of the line across the bar at a value; `None` beyond its ends.
    pub(super) fn place(&self, plot: &Plot, value: f64) -> Option<(usize, usize, usize)> {
        let span = plot.height().max(LEAST_HEIGHT).saturating_sub(1).max(1) as f64;
        let y = plot.top() + ((1.0 - self.share(value)) * span).round() as usize;
        (self.low..=self.high)
            .contains(&value)
            .then_some((plot.right() + GAP, y, WIDTH))
    }

    /// Draws the bar to the right of the plot.
    pub(super) fn draw(&self, plot: &mut Plot) {
        let (left, top) = (plot.right() + GAP, plot.top());
        let height = plot.height().max(LEAST_HEIGHT);
        let span = height.saturating_sub(1).max(1) as f64;
        for y in 0..height {
            let colour = (self.colour)(1.0 - y as f64 / span);
            plot.canvas.fill(left, top + y, WIDTH, 1, colour);
        }
        plot.canvas.frame(left, top, WIDTH, height, FAINT);
        plot.canvas
            .text(left, top - 26, self.heading, Weight::Regular, FAINT);
        for tick in ticks(self.low, self.high, height / 60) {
            let share = self.share(tick.value);
            let y = top + ((1.0 - share) * span).round() as usize;
            plot.canvas.fill(left + WIDTH, y, 5, 1, FAINT);
            let sign = match share {
                _ if !self.open => "",
                1.0 => ">",
                0.0 => "<",
                _ => "",
            };
            plot.canvas.text(
                left + WIDTH + 10,
                y.saturating_sub(TEXT_HEIGHT / 2),
                &format!("{sign}{}", tick.text),
                Weight::Regular,
                INK,
            );
        }
    }
}
