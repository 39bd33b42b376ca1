//! Roughing: levels of lines to and fro, from the top of the stock down to the surface and what is
//! to be left on it.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::cutter::Cutter;
use crate::strand::{Drawing, Strand, along};
use crate::surface::Surface;
use crate::trace::Fineness;

/// What is left on the surface may come out so much thicker.
const LOOSE: f64 = 0.1;
/// A line belongs to a level where its tip is lower than the level above by more than this.
const SAME_MM: f64 = 1e-6;

/// A roughing cutter over a surface.
pub(crate) struct Rough<'a> {
    pub(crate) surface: &'a Surface,
    /// Grown by the allowance.
    pub(crate) grown: Cutter,
    pub(crate) allowance_mm: f64,
    pub(crate) step_down_mm: f64,
    pub(crate) step_over_mm: f64,
    pub(crate) top_mm: f64,
    pub(crate) arcs: bool,
}

/// A level of roughing.
pub(crate) struct Level {
    /// Height of the material above it.
    pub(crate) above_mm: f64,
    /// Its own height.
    pub(crate) height_mm: f64,
    /// In the order of their lines.
    pub(crate) strands: Vec<Strand>,
}

impl Rough<'_> {
    /// Lowest height of the tip at a place; `None` where the cutter does not reach the surface.
    /// Nothing below the surface's lowest point is cleared.
    pub(crate) fn tip(&self, at: [f64; 2]) -> Option<f64> {
        let contact = self.surface.drop_cutter(&self.grown, at)?;
        let [[_, _, bottom], _] = self.surface.bounds_mm();
        Some((contact.z_mm + self.allowance_mm).max(bottom))
    }

    pub(crate) fn drawing(&self) -> Drawing {
        let loose = LOOSE * self.allowance_mm;
        Drawing {
            fineness: Fineness::of(self.grown.corner_mm(), loose / 2.0, 1e-3),
            tolerance_mm: loose,
            arcs: self.arcs,
        }
    }

    /// How many lines there are to be looked at, on all levels.
    pub(crate) fn lines(&self) -> usize {
        let [low, high] = self.surface.bounds_mm();
        let across = high[1] - low[1] + 2.0 * self.grown.radius_mm();
        let depth = (self.top_mm - low[2]).max(self.step_down_mm);
        let count = |length: f64, step: f64| (length / step).ceil() as usize + 1;
        count(across, self.step_over_mm).saturating_mul(count(depth, self.step_down_mm))
    }

    /// All levels, the highest first.
    pub(crate) fn levels(&self, monitor: &dyn Monitor) -> Result<Vec<Level>, Cancelled> {
        let [low, high] = self.surface.bounds_mm();
        let reach = self.grown.radius_mm();
        let (y_from, y_to) = (low[1] - reach, high[1] + reach);
        let count = ((y_to - y_from) / self.step_over_mm).ceil().max(1.0) as usize;
        let depth = (self.top_mm - low[2]).max(self.step_down_mm);
        let most = (depth / self.step_down_mm).ceil() as usize + 1;
        let drawing = self.drawing();
        let mut levels = Vec::new();
        let mut above_mm = self.top_mm;
        for level in 1..=most {
            monitor.progress(level as f64 / most as f64);
            let height_mm = self.top_mm - level as f64 * self.step_down_mm;
            let tip = |at: [f64; 2]| {
                let z = self.tip(at)?.max(height_mm);
                (z < above_mm - SAME_MM).then_some(z)
            };
            let line = |k: usize| {
                monitor.check()?;
                let y = y_from + (y_to - y_from) * k as f64 / count as f64;
                let mut ends = [[low[0] - reach, y], [high[0] + reach, y]];
                if k % 2 == 1 {
                    ends.swap(0, 1);
                }
                Ok(along(&ends, &drawing, &tip))
            };
            let lines: Result<Vec<Vec<Strand>>, Cancelled> =
                (0..=count).into_par_iter().map(line).collect();
            let strands: Vec<Strand> = lines?.into_iter().flatten().collect();
            if strands.is_empty() {
                // The stock may stand higher than the surface's surroundings.
                if height_mm < low[2] {
                    break;
                }
            } else {
                levels.push(Level {
                    above_mm,
                    height_mm,
                    strands,
                });
            }
            above_mm = height_mm;
        }
        Ok(levels)
    }
}
