//! Cusps where they are: ridges at which the tip that leaves the height changes.
//!
//! Along lines over the surface the tip that leaves the height moves steadily, and jumps from one pass
//! to the next at the top of a cusp. The cusp is counted along the normal from the least that the cutter
//! could leave there, so that a crease which it does not fit is none. Ridges are highest where three
//! passes meet, which no line needs to cross: along those that are nearly too high the peak is sought
//! halfway to the lines beside it.

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
/// Ridges that are higher than this share of the limit where a line crosses them may be too high beside
/// it: at a sixth of the step they were up to 4 % lower than at their peak.
const NEARLY: f64 = 0.92;
/// Rounds of the search for a peak by golden section, each to 0.618 of the one before.
const PEAK_ROUNDS: usize = 6;
const GOLDEN: f64 = 0.618_033_988_749_895;
/// How much nearer a tip is taken that has a ridge at its rim, as a share of the distance.
const HAIR: f64 = 1e-5;
/// Rounds of halving for the tip halfway up a step of a flat end.
const HALF_ROUNDS: usize = 12;
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
    /// The tip through which another pass takes most of it away.
    pub(crate) wanted: [f64; 2],
    /// Whether the cutter reaches the surface there.
    pub(crate) is_reached: bool,
    /// z of the normal, and the height along it.
    pub(crate) nz: f64,
    pub(crate) cusp_mm: f64,
}

/// A line over the surface.
struct Line {
    /// Its direction and number.
    name: (usize, usize),
    from: [f64; 2],
    ahead: [f64; 2],
    aside: [f64; 2],
}

impl Line {
    /// A place on it, or beside it.
    fn place(&self, ahead_mm: f64, aside_mm: f64) -> [f64; 2] {
        [0, 1].map(|k| self.from[k] + ahead_mm * self.ahead[k] + aside_mm * self.aside[k])
    }
}

/// Where a line, or one beside it, crosses a ridge.
#[derive(Clone, Copy)]
struct Crossing {
    ahead_mm: f64,
    aside_mm: f64,
    at: [f64; 2],
    lefts: [Left; 2],
    height_mm: f64,
    surface_mm: f64,
    /// z of the normal of the flatter of both tips, and how high the ridge is above the surface along
    /// it, no less than its cusp.
    nz: f64,
    above_mm: f64,
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
                let ahead = self.limits[direction][0];
                let line = Line {
                    name: (direction, number),
                    from: [0, 1].map(|k| ahead * u[k] + aside * v[k]),
                    ahead: u,
                    aside: v,
                };
                Ok(self.on_line(ways, within, &line, steps))
            };
            let lines: Result<Vec<Vec<Ridge>>, ToolpathError> =
                (0..lines).into_par_iter().map(of).collect();
            found.extend(lines?.into_iter().flatten());
        }
        Ok(found)
    }

    fn on_line(&self, ways: &Ways, within: &Within<'_>, line: &Line, steps: usize) -> Vec<Ridge> {
        let mut ridges = Vec::new();
        let mut last: Option<Left> = None;
        for k in 0..=steps {
            let ahead_mm = k as f64 * self.step_mm;
            let at = line.place(ahead_mm, 0.0);
            let left = within(at).then(|| ways.left(at, last.as_ref()));
            let left = left.flatten();
            if let (Some(a), Some(b)) = (last, left)
                && self.are_apart(&a, &b)
            {
                let from_mm = ahead_mm - self.step_mm;
                ridges.extend(self.ridge(ways, line, [(from_mm, a), (ahead_mm, b)]));
            }
            last = left;
        }
        ridges
    }

    fn are_apart(&self, a: &Left, b: &Left) -> bool {
        a.strand != b.strand || apart(a.tip_mm, b.tip_mm) > self.jump_mm
    }

    /// The ridge between two places of a line, if it is too high there or halfway to the lines beside.
    fn ridge(&self, ways: &Ways, line: &Line, ends: [(f64, Left); 2]) -> Option<Ridge> {
        let nearly_mm = NEARLY * self.limit_mm;
        let here = self.crossing(ways, line, 0.0, ends)?;
        if here.above_mm <= nearly_mm {
            return None;
        }
        let mut cusp_mm = here.above_mm;
        if here.above_mm > self.limit_mm {
            let ridge = self.measured(line, &here)?;
            if ridge.cusp_mm > self.limit_mm {
                return (ridge.nz >= WALL).then_some(ridge);
            }
            cusp_mm = ridge.cusp_mm;
        }
        if cusp_mm <= nearly_mm {
            return None;
        }
        // What the cutter does not reach is taken to be as much all along.
        let unreached_mm = here.above_mm - cusp_mm;
        let peak = self.peak(ways, line, here, self.limit_mm + unreached_mm)?;
        let ridge = self.measured(line, &peak)?;
        (ridge.nz >= WALL && ridge.cusp_mm > self.limit_mm).then_some(ridge)
    }

    /// Where a ridge stands highest above the surface, halfway to the lines beside this one, if that is
    /// above `limit_mm`.
    fn peak(&self, ways: &Ways, line: &Line, here: Crossing, limit_mm: f64) -> Option<Crossing> {
        let half_mm = 0.5 * self.apart_mm;
        let at = |aside_mm: f64| self.beside(ways, line, &here, aside_mm);
        let above =
            |crossing: &Option<Crossing>| crossing.map_or(f64::NEG_INFINITY, |c| c.above_mm);
        let sides = [-half_mm, half_mm].map(at);
        let known = sides.iter().flatten().chain([&here]);
        let highest = known.fold(here, |a, b| if b.above_mm > a.above_mm { *b } else { a });
        // A ridge rises no more steeply between these than it does from one to the other.
        let rise_mm = sides
            .iter()
            .flatten()
            .map(|side| (side.above_mm - here.above_mm).abs())
            .fold(0.0, f64::max);
        if highest.above_mm + rise_mm <= limit_mm {
            return None;
        }
        let [mut low, mut high] = [-half_mm, half_mm];
        if highest.aside_mm < 0.0 {
            high = 0.0;
        } else if highest.aside_mm > 0.0 {
            low = 0.0;
        }
        let mut best = highest;
        let inner = |low: f64, high: f64| high - GOLDEN * (high - low);
        let (mut p, mut q) = (inner(low, high), inner(high, low));
        let (mut a, mut b) = (at(p), at(q));
        for _ in 0..PEAK_ROUNDS {
            for crossing in [a, b].into_iter().flatten() {
                if crossing.above_mm > best.above_mm {
                    best = crossing;
                }
            }
            if above(&a) > above(&b) {
                (high, q, b) = (q, p, a);
                p = inner(low, high);
                a = at(p);
            } else {
                (low, p, a) = (p, q, b);
                q = inner(high, low);
                b = at(q);
            }
        }
        (best.above_mm > limit_mm).then_some(best)
    }

    /// Where a line beside another one crosses the ridge that the other one crosses.
    fn beside(&self, ways: &Ways, line: &Line, here: &Crossing, aside_mm: f64) -> Option<Crossing> {
        // Ridges that lie more askew are crossed by lines in the other direction.
        let around_mm = 0.5 * self.step_mm + aside_mm.abs();
        let [(low, a), (high, b)] =
            [(-1.0, here.lefts[0]), (1.0, here.lefts[1])].map(|(side, guess): (f64, Left)| {
                let ahead_mm = here.ahead_mm + side * around_mm;
                let left = ways.left(line.place(ahead_mm, aside_mm), Some(&guess));
                (ahead_mm, left)
            });
        let (a, b) = (a?, b?);
        self.are_apart(&a, &b)
            .then(|| self.crossing(ways, line, aside_mm, [(low, a), (high, b)]))?
    }

    /// Where the tip jumps between two places of a line, or of one beside it.
    fn crossing(
        &self,
        ways: &Ways,
        line: &Line,
        aside_mm: f64,
        [(mut low, mut a), (mut high, mut b)]: [(f64, Left); 2],
    ) -> Option<Crossing> {
        for _ in 0..ROUNDS {
            let middle = f64::midpoint(low, high);
            let left = ways.left(line.place(middle, aside_mm), Some(&a))?;
            if apart(left.tip_mm, a.tip_mm) < apart(left.tip_mm, b.tip_mm) {
                (low, a) = (middle, left);
            } else {
                (high, b) = (middle, left);
            }
        }
        let ahead_mm = f64::midpoint(low, high);
        let at = line.place(ahead_mm, aside_mm);
        let height_mm = a.height_mm.max(b.height_mm);
        let surface_mm = self.field.surface.height_mm(at)?;
        let flatness = |left: Left| self.flatness([left.tip_mm[0], left.tip_mm[1]], at);
        let nz = flatness(a)?.max(flatness(b)?);
        Some(Crossing {
            ahead_mm,
            aside_mm,
            at,
            lefts: [a, b],
            height_mm,
            surface_mm,
            nz,
            above_mm: (height_mm - surface_mm) * nz,
        })
    }

    /// A ridge, counted from the least that the cutter could leave; when it is found to be no higher
    /// than the limit it may be lower still.
    fn measured(&self, line: &Line, crossing: &Crossing) -> Option<Ridge> {
        let &Crossing {
            at,
            lefts: [a, b],
            height_mm,
            surface_mm,
            nz,
            ..
        } = crossing;
        let tips = [a.tip_mm, b.tip_mm].map(|[x, y, _]| [x, y]);
        let amid = [0, 1].map(|k| f64::midpoint(tips[0][k], tips[1][k]));
        // The ridge is at the rim of a tip that leaves it: a hair nearer that reaches it.
        let nearer = |tip: [f64; 2]| [0, 1].map(|k| tip[k] + HAIR * (at[k] - tip[k]));
        let starts = [amid, nearer(tips[0]), nearer(tips[1])];
        let steps_mm = [apart(a.tip_mm, b.tip_mm) / 4.0, SHORTEST * self.limit_mm];
        let reached_mm = surface_mm + REACHED * self.limit_mm;
        let is_flat = self.field.cutter.corner_mm() == 0.0;
        // Either there is no less, or what may still be found cannot make a cusp too high. At walls what a
        // flat end gains for a step has no bound.
        let gain = if is_flat { f64::INFINITY } else { GAIN };
        let enough = |reach: &reach::Reach, step_mm: f64| {
            let above = (height_mm - reach.height_mm) * nz;
            reach.height_mm <= reached_mm || above + gain * step_mm <= self.limit_mm
        };
        let search = |starts: &[[f64; 2]]| {
            reach::least(
                &|tip, below_mm| self.field.tip_below(tip, below_mm),
                &self.field.cutter,
                at,
                starts,
                steps_mm,
                &enough,
            )
        };
        // A flat end that has the place at its rim finds its way from some tips only.
        let reach = if is_flat {
            let mut found = starts.iter().filter_map(|start| search(&[*start]));
            let mut best = found.next()?;
            while best.height_mm > reached_mm
                && let Some(next) = found.next()
            {
                if next.height_mm < best.height_mm {
                    best = next;
                }
            }
            best
        } else {
            search(&starts)?
        };
        let nz = self.flatness(reach.tip_mm, at)?;
        let order = usize::from(a.strand > b.strand);
        Some(Ridge {
            line: line.name,
            at,
            tips: [tips[order], tips[1 - order]],
            strands: [a.strand.min(b.strand), a.strand.max(b.strand)],
            wanted: self.wanted(&reach, if a.height_mm > b.height_mm { a } else { b }),
            is_reached: (reach.height_mm - surface_mm) * nz <= 2.0 * REACHED * self.limit_mm,
            nz,
            cusp_mm: (height_mm - reach.height_mm) * nz,
        })
    }

    /// The tip through which another pass takes most of a ridge away.
    ///
    /// For a cutter with a corner that is the one that leaves the least. A flat end that leaves the least
    /// has the ridge right at its rim, and leaves all that is beyond as it was: the next search would find
    /// the same ridge a hair farther on. Halfway up to the tip that leaves what is beyond, the ridge becomes
    /// two of half the height.
    fn wanted(&self, reach: &reach::Reach, beyond: Left) -> [f64; 2] {
        let mut low = reach.tip_mm;
        if self.field.cutter.corner_mm() > 0.0 {
            return low;
        }
        let half_mm = f64::midpoint(reach.height_mm, beyond.height_mm);
        let mut high = [beyond.tip_mm[0], beyond.tip_mm[1]];
        for _ in 0..HALF_ROUNDS {
            let middle = [0, 1].map(|k| f64::midpoint(low[k], high[k]));
            if self.field.tip_below(middle, half_mm).is_some() {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// z of the normal that counts at a place: that of the cutter's end, of a flat one the surface's.
    fn flatness(&self, tip: [f64; 2], at: [f64; 2]) -> Option<f64> {
        if self.field.cutter.corner_mm() == 0.0 {
            self.surface_flatness(at)
        } else {
            Some(self.end_flatness(tip, at))
        }
    }

    /// z of the normal of the cutter's end at a place.
    fn end_flatness(&self, tip: [f64; 2], at: [f64; 2]) -> f64 {
        let rho = libm::hypot(tip[0] - at[0], tip[1] - at[1]);
        let lean = (rho - self.field.cutter.disc_mm()).max(0.0) / self.field.cutter.corner_mm();
        ((1.0 - lean) * (1.0 + lean)).max(0.0).sqrt()
    }

    /// z of the surface's normal at a place.
    fn surface_flatness(&self, at: [f64; 2]) -> Option<f64> {
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

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::cutter::Cutter;
    use crate::surface::Surface;

    #[test]
    fn peaks_between_lines_are_found() {
        let vertices = [
            [-9.0, -9.0, 0.0],
            [9.0, -9.0, 0.0],
            [-9.0, 9.0, 0.0],
            [9.0, 9.0, 0.0],
        ];
        let surface = Surface::new(&vertices, &[[0, 1, 2], [1, 3, 2]]).unwrap();
        let cutter = Cutter::ball(6.0).unwrap();
        let field = Field::new(&surface, cutter, 0.0);
        // A straight pass, and one that comes nearer to both sides of x = 0.
        let mut ways = Ways::new(cutter, [-12.0; 2], [12.0; 2]);
        ways.add(&[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0);
        ways.add(&[[-1.0, 0.3, 0.0], [0.0, 0.8, 0.0], [1.0, 0.3, 0.0]], 1);
        let ridges = |limit_mm: f64, apart_mm: f64| {
            let lines = Lines {
                field: &field,
                along: [[0.0, 1.0], [1.0, 0.0]],
                // Two lines across the passes, x = 0 halfway between them, and none along.
                limits: [[0.0, 0.8], [-apart_mm, apart_mm]],
                apart_mm,
                step_mm: 0.1,
                jump_mm: 0.2,
                limit_mm,
            };
            let found = lines.ridges(&ways, &|_| true, &Unmonitored).unwrap();
            let across = found.into_iter().filter(|ridge| ridge.line.0 == 0);
            across.collect::<Vec<_>>()
        };
        // As far from the one pass as from both arms of the other.
        let lean = 1.0 / 1.25_f64.sqrt();
        let aside = |way: f64| way * lean / (1.0 + lean);
        let height = |aside: f64| 3.0 - (9.0 - aside * aside).sqrt();
        let (on_line, peak) = (height(aside(0.8 - 0.5 * 0.04)), height(aside(0.8)));
        assert!(on_line < 0.96 * peak);

        let found = ridges(0.98 * peak, 0.08);
        assert_eq!(found.len(), 2);
        for ridge in found {
            let off = ridge.cusp_mm / peak - 1.0;
            assert!((-5e-3..1e-3).contains(&off), "{off}");
            assert!(ridge.at[0].abs() < 5e-3, "{:?}", ridge.at);
        }
        assert_eq!(ridges(1.001 * peak, 0.08).len(), 0);
        // What is too high on the line is told where the line is.
        let found = ridges(0.9 * on_line, 0.08);
        assert_eq!(found.len(), 2);
        for ridge in found {
            assert!((ridge.cusp_mm / on_line - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn steps_of_a_flat_end_are_halved() {
        // A slope across two passes.
        let slope = 0.8;
        let vertices =
            [[-9.0, -9.0], [9.0, -9.0], [-9.0, 9.0], [9.0, 9.0]].map(|[x, y]| [x, y, slope * y]);
        let surface = Surface::new(&vertices, &[[0, 1, 2], [1, 3, 2]]).unwrap();
        let cutter = Cutter::flat(4.0).unwrap();
        let field = Field::new(&surface, cutter, 0.0);
        let mut ways = Ways::new(cutter, [-12.0; 2], [12.0; 2]);
        for (strand, y) in [-0.4, 0.4].into_iter().enumerate() {
            let [a, b] = [-9.0, 9.0].map(|x| [x, y, slope * (y + 2.0)]);
            ways.add(&[a, b], strand);
        }
        let lines = Lines {
            field: &field,
            along: [[0.0, 1.0], [1.0, 0.0]],
            limits: [[0.0, 3.0], [-0.5, 0.5]],
            apart_mm: 0.5,
            step_mm: 0.05,
            jump_mm: 0.1,
            limit_mm: 0.25,
        };
        let found = lines.ridges(&ways, &|_| true, &Unmonitored).unwrap();
        let steps: Vec<&Ridge> = found.iter().filter(|r| r.strands == [0, 1]).collect();
        assert!(steps.len() >= 2);
        let cusp_mm = slope * 0.8 / (1.0 + slope * slope).sqrt();
        for ridge in steps {
            assert!((ridge.cusp_mm / cusp_mm - 1.0).abs() < 0.05, "{ridge:?}");
            assert!((ridge.at[1] - 1.6).abs() < 0.01, "{ridge:?}");
            // Amid the two, not where the lower one is.
            assert!(ridge.wanted[1].abs() < 0.1, "{ridge:?}");
        }
    }
}
