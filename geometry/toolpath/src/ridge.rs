//! Cusps where they are: ridges at which the tip that leaves the height changes.
//!
//! Along lines over the surface the tip that leaves the height moves steadily, and jumps from one pass
//! to the next at the top of a cusp. The cusp is counted along the normal from the least that the cutter
//! could leave there, so that a crease which it does not fit is none.

use range_image::Monitor;
use rayon::prelude::*;

use crate::error::ToolpathError;
use crate::field::Field;
use crate::reach;
use crate::ways::{Left, Ways};

/// Rounds of halving for the place of a ridge.
const ROUNDS: usize = 14;
/// The cutter reaches the surface where it leaves no more than this share of what is asked for.
const REACHED: f64 = 0.003;
/// Last step of the search for what the cutter could leave, as a share of what is asked for, and how
/// much a search that has come to a step may still gain, for that step.
const SHORTEST: f64 = 0.02;
const GAIN: f64 = 2.0;
/// Steeper than this, z of the normal, cusps are not counted: 85 degrees.
const WALL: f64 = 0.087_156;

/// A ridge where a line crosses it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ridge {
    /// Direction of the line, 0 across the passes and 1 along them, and its number.
    pub(crate) line: (usize, usize),
    pub(crate) at: [f64; 2],
    /// The tips that leave it, and the strands that they are on, the lower one first.
    pub(crate) tips: [[f64; 2]; 2],
    pub(crate) strands: [usize; 2],
    /// The tip that would leave the least there.
    pub(crate) wanted: [f64; 2],
    /// Whether the cutter reaches the surface there.
    pub(crate) is_reached: bool,
    pub(crate) cusp_mm: f64,
}

/// Lines over a surface on which cusps are sought.
pub(crate) struct Lines<'a> {
    pub(crate) field: &'a Field<'a>,
    /// Unit directions, across and along the passes, and where lines in them begin and end.
    pub(crate) along: [[f64; 2]; 2],
    pub(crate) limits: [[f64; 2]; 2],
    /// Distance of lines, and of places on them.
    pub(crate) apart_mm: f64,
    pub(crate) step_mm: f64,
    /// Tips farther apart than this are on different passes.
    pub(crate) jump_mm: f64,
    /// Cusps that are no higher than this are left aside.
    pub(crate) limit_mm: f64,
}

/// Whether a place is looked at.
pub(crate) type Within<'a> = dyn Fn([f64; 2]) -> bool + Sync + 'a;

impl Lines<'_> {
    /// Ridges that are higher than the limit, in the order of the lines.
    pub(crate) fn ridges(
        &self,
        ways: &Ways,
        within: &Within<'_>,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Ridge>, ToolpathError> {
        let count = |[low, high]: [f64; 2], step: f64| ((high - low) / step).ceil() as usize;
        let mut found = Vec::new();
        for direction in 0..2 {
            let across = 1 - direction;
            let lines = count(self.limits[across], self.apart_mm);
            let steps = count(self.limits[direction], self.step_mm);
            let [u, v] = [self.along[direction], self.along[across]];
            let of = |number: usize| {
                monitor.check()?;
                let aside = self.limits[across][0] + (number as f64 + 0.5) * self.apart_mm;
                let place = |step: f64| {
                    let ahead = self.limits[direction][0] + step * self.step_mm;
                    [0, 1].map(|k| ahead * u[k] + aside * v[k])
                };
                Ok(self.on_line(ways, within, (direction, number), steps, &place))
            };
            let lines: Result<Vec<Vec<Ridge>>, ToolpathError> =
                (0..lines).into_par_iter().map(of).collect();
            found.extend(lines?.into_iter().flatten());
        }
        Ok(found)
    }

    fn on_line(
        &self,
        ways: &Ways,
        within: &Within<'_>,
        line: (usize, usize),
        steps: usize,
        place: &dyn Fn(f64) -> [f64; 2],
    ) -> Vec<Ridge> {
        let mut ridges = Vec::new();
        let mut last: Option<Left> = None;
        for k in 0..=steps {
            let at = place(k as f64);
            let left = within(at).then(|| ways.left(at, last.as_ref()));
            let left = left.flatten();
            if let (Some(a), Some(b)) = (last, left)
                && (a.strand != b.strand || apart(a.tip_mm, b.tip_mm) > self.jump_mm)
            {
                let from = k as f64 - 1.0;
                ridges.extend(self.between(ways, line, (from, a), (from + 1.0, b), place));
            }
            last = left;
        }
        ridges
    }

    /// The ridge between two places of a line, if it is too high.
    fn between(
        &self,
        ways: &Ways,
        line: (usize, usize),
        (mut low, mut a): (f64, Left),
        (mut high, mut b): (f64, Left),
        place: &dyn Fn(f64) -> [f64; 2],
    ) -> Option<Ridge> {
        for _ in 0..ROUNDS {
            let middle = f64::midpoint(low, high);
            let left = ways.left(place(middle), Some(&a))?;
            if apart(left.tip_mm, a.tip_mm) < apart(left.tip_mm, b.tip_mm) {
                (low, a) = (middle, left);
            } else {
                (high, b) = (middle, left);
            }
        }
        let at = place(f64::midpoint(low, high));
        let height_mm = a.height_mm.max(b.height_mm);
        let surface_mm = self.field.surface.height_mm(at)?;
        let tips = [a.tip_mm, b.tip_mm].map(|[x, y, _]| [x, y]);
        let is_flat = self.field.cutter.corner_mm() == 0.0;
        let flatness = |tip: [f64; 2]| {
            if is_flat {
                self.flatness(at)
            } else {
                Some(self.end_flatness(tip, at))
            }
        };
        // What the cutter does not reach counts no cusp: there is none higher than this.
        let nz = flatness(tips[0])?.max(flatness(tips[1])?);
        if (height_mm - surface_mm) * nz <= self.limit_mm {
            return None;
        }
        let amid = [0, 1].map(|k| f64::midpoint(tips[0][k], tips[1][k]));
        let steps_mm = [apart(a.tip_mm, b.tip_mm) / 4.0, SHORTEST * self.limit_mm];
        let reached_mm = surface_mm + REACHED * self.limit_mm;
        // Either there is no less, or what may still be found cannot make a cusp too high.
        let enough = |reach: &reach::Reach, step_mm: f64| {
            let above = (height_mm - reach.height_mm) * nz;
            reach.height_mm <= reached_mm || above + GAIN * step_mm <= self.limit_mm
        };
        let reach = reach::least(
            &|tip, below_mm| self.field.tip_below(tip, below_mm),
            &self.field.cutter,
            at,
            amid,
            steps_mm,
            &enough,
        )?;
        let nz = flatness(reach.tip_mm)?;
        let cusp_mm = (height_mm - reach.height_mm) * nz;
        let order = usize::from(a.strand > b.strand);
        (nz >= WALL && cusp_mm > self.limit_mm).then(|| Ridge {
            line,
            at,
            tips: [tips[order], tips[1 - order]],
            strands: [a.strand.min(b.strand), a.strand.max(b.strand)],
            wanted: reach.tip_mm,
            is_reached: (reach.height_mm - surface_mm) * nz <= 2.0 * REACHED * self.limit_mm,
            cusp_mm,
        })
    }

    /// z of the normal of the cutter's end at a place.
    fn end_flatness(&self, tip: [f64; 2], at: [f64; 2]) -> f64 {
        let rho = libm::hypot(tip[0] - at[0], tip[1] - at[1]);
        let lean = (rho - self.field.cutter.disc_mm()).max(0.0) / self.field.cutter.corner_mm();
        ((1.0 - lean) * (1.0 + lean)).max(0.0).sqrt()
    }

    /// z of the surface's normal at a place.
    fn flatness(&self, at: [f64; 2]) -> Option<f64> {
        let probe = 1e-4;
        let slope = |axis: usize| {
            let beside = |sign: f64| {
                let mut place = at;
                place[axis] += sign * probe;
                self.field.surface.height_mm(place)
            };
            Some((beside(1.0)? - beside(-1.0)?) / (2.0 * probe))
        };
        let (gx, gy) = (slope(0)?, slope(1)?);
        Some(1.0 / (1.0 + gx * gx + gy * gy).sqrt())
    }
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}
