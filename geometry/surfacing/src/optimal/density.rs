//! How many knots go where, for one direction by itself.

use range_image::{Cancelled, Monitor};

use crate::axis::{Axis, Breaks};
use crate::optimal::worst_within;

/// Spans at the beginning.
const FIRST_SPANS: f64 = 6.0;
/// Rounds for the first tolerance, and for each that follows.
const FIRST_ROUNDS: usize = 16;
const NEXT_ROUNDS: usize = 8;
/// A span's change in a round, at most.
const LEAST_CHANGE: f64 = 0.5;
const GREATEST_CHANGE: f64 = 2.0;

/// Knots per node along a direction, from round to round.
pub(super) struct Direction {
    nodes: usize,
    /// Knots that character lines ask for, repeated ones as often as they count.
    fixed: Vec<f64>,
    /// Spans per cell between two nodes.
    density: Vec<f64>,
    is_first: bool,
}

impl Direction {
    pub(super) fn new(nodes: usize, fixed: Vec<f64>) -> Self {
        let cells = nodes.saturating_sub(1).max(1);
        Self {
            nodes,
            fixed,
            density: vec![FIRST_SPANS / cells as f64; cells],
            is_first: true,
        }
    }

    /// The fewest knots found with which no node is farther off than the target; else the
    /// last ones tried. A span's deviation grows with the fourth power of its width.
    ///
    /// # Errors
    /// [`Cancelled`] at the monitor's wish.
    pub(super) fn spread(
        &mut self,
        target: f64,
        off: impl Fn(&Axis) -> Vec<f64>,
        monitor: &dyn Monitor,
    ) -> Result<Breaks, Cancelled> {
        let rounds = if self.is_first {
            FIRST_ROUNDS
        } else {
            NEXT_ROUNDS
        };
        self.is_first = false;
        let mut best: Option<Breaks> = None;
        let mut last = Breaks::none(self.nodes);
        for _ in 0..rounds {
            monitor.check()?;
            let breaks = self.breaks().solvable();
            let Some(axis) = Axis::new(&breaks) else {
                break;
            };
            let off = off(&axis);
            let worst = off.iter().copied().fold(0.0, f64::max);
            let is_fewer = best
                .as_ref()
                .is_none_or(|best| breaks.inner.len() < best.inner.len());
            if worst <= target && is_fewer {
                best = Some(breaks.clone());
            }
            self.adapt(&breaks, &off, target);
            last = breaks;
        }
        Ok(best.unwrap_or(last))
    }

    /// Spans that hold equal parts of the density, and the fixed knots.
    fn breaks(&self) -> Breaks {
        let total: f64 = self.density.iter().sum();
        let spans = total.ceil().max(1.0);
        let part = total / spans;
        let mut inner = self.fixed.clone();
        let (mut sum, mut next) = (0.0, part);
        for (cell, density) in self.density.iter().enumerate() {
            while next <= sum + density && next < total - 0.5 * part {
                let at = cell as f64 + (next - sum) / density;
                // Those knots do what more beside them would.
                if self.fixed.iter().all(|f| (f - at).abs() > 0.75) {
                    inner.push(at);
                }
                next += part;
            }
            sum += density;
        }
        Breaks::new(self.nodes, inner)
    }

    fn adapt(&mut self, breaks: &Breaks, off: &[f64], target: f64) {
        for span in breaks.edges().windows(2) {
            let &[low, high] = span else { continue };
            let share = worst_within(off, low, high) / target;
            let change = share.sqrt().sqrt().clamp(LEAST_CHANGE, GREATEST_CHANGE);
            // What the span really has, not what it was to have before it was rounded up.
            let had = 1.0 / (high - low);
            let (from, to) = (low.floor() as usize, high.ceil() as usize);
            for cell in from..to.min(self.density.len()) {
                let overlap = (high.min(cell as f64 + 1.0) - low.max(cell as f64)).max(0.0);
                let kept = self.density[cell] * (1.0 - overlap);
                self.density[cell] = (kept + overlap * had * change).min(1.0);
            }
        }
        let before = self.density.clone();
        for cell in 1..before.len().saturating_sub(1) {
            self.density[cell] =
                0.25 * before[cell - 1] + 0.5 * before[cell] + 0.25 * before[cell + 1];
        }
    }
}
