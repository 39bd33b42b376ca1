//! Short passes where cusps are too high.
//!
//! Passes that are planned from their neighbours leave higher cusps where they bend sharply, in
//! creases that they cross askew, and, parallel ones, on slopes across them. Once all passes are drawn
//! their cusps are measured as they will be milled. Along ridges that are too high another pass is
//! drawn, amid the two that leave them (for parallel passes: Ding et al. 2003, adaptive iso-planar
//! paths). In a crease that two passes cross, all of the ridge is reached from one place; there the
//! short pass follows the crease from one to the other. This is repeated until no cusp is too high.

use std::collections::{BTreeMap, BTreeSet};

use range_image::Monitor;
use rayon::prelude::*;

use crate::error::ToolpathError;
use crate::field::Field;
use crate::motion::Move;
use crate::quantize::quantized;
use crate::ridge::{Lines, Ridge};
use crate::simplify::simplified;
use crate::strand::{Drawing, Strand, along};
use crate::ways::Ways;

/// Rounds in which short passes are added.
const ROUNDS: usize = 6;
/// Cusps above this share of what was asked for are mended. Passes are planned for a little less than
/// was asked for, and a mend takes three quarters of a cusp away: those that are nearly right are left.
const TOO_HIGH: f64 = 1.04;
/// Lines within the cutter's radius, lines for the step on a slope, and places on a line for that.
const LINES: f64 = 16.0;
const LINES_OF_STEP: f64 = 6.0;
const PLACES: f64 = 8.0;
/// Tips that are apart by this share of that distance are on different passes.
const JUMP: f64 = 0.3;
/// Places that are looked at in each direction, at most: it takes minutes. There are fewer lines then,
/// and that is told.
const MOST_PLACES: f64 = 4e6;
/// How often a place near the outline is mended: nothing may come of it there.
const MOST_TRIES: u32 = 2;
/// Nearer to the outline than this, for the cutter's radius, nothing is told.
const INNER: f64 = 1.0;
/// How far chords may lie off arcs.
const CHORD_MM: f64 = 2e-5;
/// How far a short pass goes on beyond where it is needed, for the distance of the passes beside it.
const BEYOND: f64 = 0.5;
/// How far corners of a short pass may be off it, as a share of the step on a slope.
const SMOOTH: f64 = 0.02;

/// What is needed to add short passes.
pub(crate) struct Mend<'a> {
    pub(crate) field: &'a Field<'a>,
    pub(crate) drawing: Drawing,
    pub(crate) scallop_mm: f64,
    /// The step-over on a level plane, and that on a slope, which the corner alone mills.
    pub(crate) level_mm: f64,
    pub(crate) slope_mm: f64,
    pub(crate) decimals: u8,
    /// Least height of the tip, for rounding.
    pub(crate) tip: &'a (dyn Fn([f64; 2]) -> Option<f64> + Sync),
}

/// A cusp, and where.
pub(crate) type LeftOver = (f64, [f64; 2]);

/// What was added.
pub(crate) struct Mended {
    pub(crate) strands: Vec<Strand>,
    /// The highest cusp that is left, and where, if it is higher than asked for; at the outline passes
    /// end, and none is told.
    pub(crate) left_mm: Option<LeftOver>,
    /// The distance of the lines on which cusps were sought, and the one wanted, if it is smaller.
    pub(crate) coarse_mm: Option<[f64; 2]>,
}

impl Mend<'_> {
    /// Short passes for what other strands leave too high.
    pub(crate) fn mended(
        &self,
        strands: &[Strand],
        monitor: &dyn Monitor,
    ) -> Result<Mended, ToolpathError> {
        let field = self.field;
        let [low, high] = field.surface.bounds_mm();
        let reach = field.cutter.radius_mm();
        let grown = [
            [low[0] - reach, low[1] - reach],
            [high[0] + reach, high[1] + reach],
        ];
        let mut ways = Ways::new(field.cutter, grown[0], grown[1]);
        let mut count = 0;
        let mut add = |ways: &mut Ways, strands: &[Strand]| {
            let written: Vec<Vec<[f64; 3]>> = strands
                .par_iter()
                .map(|strand| self.written(strand))
                .collect();
            for points in &written {
                ways.add(points, count);
                count += 1;
            }
            written
        };
        add(&mut ways, strands);
        let (lines, wanted_mm) = self.lines();
        let mut dirty = Dirty::new(grown, reach / 2.0);
        let mut tries = BTreeMap::new();
        let mut mended = Mended {
            strands: Vec::new(),
            left_mm: None,
            coarse_mm: (lines.apart_mm > wanted_mm).then_some([lines.apart_mm, wanted_mm]),
        };
        for round in 0..=ROUNDS {
            monitor.check()?;
            monitor.progress(round as f64 / ROUNDS as f64);
            let ridges = lines.ridges(&ways, &|at| dirty.holds(at), monitor)?;
            let inner = ridges.iter().filter(|ridge| self.is_inner(ridge.at));
            let worst = inner.max_by(|a, b| a.cusp_mm.total_cmp(&b.cusp_mm));
            mended.left_mm = worst.map(|ridge| (ridge.cusp_mm, ridge.at));
            if ridges.is_empty() || round == ROUNDS {
                break;
            }
            let corners = self.corners(&ridges, lines.apart_mm, &mut tries);
            let tip = |at: [f64; 2]| field.tip(at);
            let drawn: Result<Vec<Vec<Strand>>, ToolpathError> = corners
                .par_iter()
                .map(|corners| {
                    monitor.check()?;
                    Ok(along(corners, &self.drawing, &tip))
                })
                .collect();
            let drawn: Vec<Strand> = drawn?.into_iter().flatten().collect();
            if drawn.is_empty() {
                break;
            }
            // What is far from all that changes stays as it is.
            dirty.clear();
            for points in add(&mut ways, &drawn) {
                for point in points {
                    dirty.mark([point[0], point[1]], reach + 2.0 * self.level_mm);
                }
            }
            for ridge in &ridges {
                dirty.mark(ridge.at, self.level_mm);
            }
            mended.strands.extend(drawn);
        }
        mended.strands = in_order(mended.strands, strands.last().map(Strand::end));
        Ok(mended)
    }

    /// The lines on which cusps are sought, and their distance if there could be any number of them.
    fn lines(&self) -> (Lines<'_>, f64) {
        let field = self.field;
        let [x, y] = field.along;
        let limits = [field.t, field.s];
        let step_mm = self.slope_mm / PLACES;
        let area = limits.iter().map(|[low, high]| high - low).product::<f64>();
        let apart_mm = (field.cutter.radius_mm() / LINES).min(self.slope_mm / LINES_OF_STEP);
        let lines = Lines {
            field,
            along: [[-y, x], [x, y]],
            limits,
            apart_mm: apart_mm.max(area / step_mm / MOST_PLACES),
            step_mm,
            jump_mm: JUMP * self.slope_mm,
            limit_mm: TOO_HIGH * self.scallop_mm,
        };
        (lines, apart_mm)
    }

    /// Whether there is surface all around a place.
    fn is_inner(&self, at: [f64; 2]) -> bool {
        let around = INNER * self.field.cutter.radius_mm();
        [[around, 0.0], [-around, 0.0], [0.0, around], [0.0, -around]]
            .iter()
            .all(|[x, y]| {
                self.field
                    .surface
                    .height_mm([at[0] + x, at[1] + y])
                    .is_some()
            })
    }

    /// The points of a strand as they are written, arcs as chords.
    fn written(&self, strand: &Strand) -> Vec<[f64; 3]> {
        let mut moves = vec![Move::line(strand.start, 1.0)];
        moves.extend(strand.moves([1.0; 2]));
        let moves = quantized(&moves, self.decimals, &|at| (self.tip)(at));
        let mut points: Vec<[f64; 3]> = Vec::new();
        for step in &moves {
            match points.last() {
                Some(from) => points.extend(step.points_mm(*from, CHORD_MM)),
                None => points.push(step.to_mm),
            }
        }
        points
    }

    /// Corners of the short passes that these ridges ask for.
    /// `tries` counts by place how often that was tried.
    fn corners(
        &self,
        ridges: &[Ridge],
        apart_mm: f64,
        tries: &mut BTreeMap<(i64, i64), u32>,
    ) -> Vec<Vec<[f64; 2]>> {
        let mut chains = chained(ridges, apart_mm);
        // Lines in both directions cross most ridges: what is drawn for one is not for the other.
        chains.sort_by_key(|chain| std::cmp::Reverse(chain.len()));
        let cell = 0.25 * self.slope_mm;
        let mut taken = BTreeSet::new();
        let mut fresh_places = BTreeSet::new();
        let mut corners = Vec::new();
        for chain in chains {
            let key = |at: [f64; 2], i: i64, j: i64| {
                (
                    (at[0] / cell).floor() as i64 + i,
                    (at[1] / cell).floor() as i64 + j,
                )
            };
            let is_taken = |ridge: &Ridge| {
                let place = key(ridge.wanted, 0, 0);
                taken.contains(&place)
                    || !self.is_inner(ridge.at)
                        && tries.get(&place).is_some_and(|tries| *tries >= MOST_TRIES)
            };
            let fresh: Vec<Vec<Ridge>> = chain
                .chunk_by(|a, b| is_taken(a) == is_taken(b))
                .filter(|part| !part.first().is_none_or(is_taken))
                .map(<[Ridge]>::to_vec)
                .collect();
            for part in fresh {
                for ridge in &part {
                    fresh_places.insert(key(ridge.wanted, 0, 0));
                    for i in -1..=1 {
                        for j in -1..=1 {
                            taken.insert(key(ridge.wanted, i, j));
                        }
                    }
                }
                corners.push(self.pass(&part));
            }
        }
        for place in fresh_places {
            *tries.entry(place).or_insert(0) += 1;
        }
        corners
    }

    /// The corners of a short pass along a ridge.
    fn pass(&self, chain: &[Ridge]) -> Vec<[f64; 2]> {
        let (Some(first), Some(last)) = (chain.first(), chain.last()) else {
            return Vec::new();
        };
        let worst = chain
            .iter()
            .fold(first, |a, b| if b.cusp_mm > a.cusp_mm { b } else { a });
        let [a, b] = worst.tips;
        let between = apart(a, b);
        let around = apart(a, worst.wanted) + apart(worst.wanted, b);
        if apart(first.wanted, last.wanted) < BEYOND * around && !worst.is_reached {
            return self.along_crease(chain, worst);
        }
        let mut corners: Vec<[f64; 2]> = chain.iter().map(|ridge| ridge.wanted).collect();
        let least = 0.1 * self.slope_mm;
        let mut kept = vec![first.wanted];
        for corner in corners.drain(..) {
            if let Some(end) = kept.last()
                && apart(corner, *end) >= least
            {
                kept.push(corner);
            }
        }
        let mut kept = simplified(&kept, SMOOTH * self.slope_mm);
        let beyond = BEYOND * between;
        if let [only] = kept[..] {
            if between < least {
                // It moves steadily there, from one tip to another hardly beside it.
                return vec![a, only, b];
            }
            // Along the ridge, that is across what leads from one pass to the other.
            let across = [-(b[1] - a[1]), b[0] - a[0]];
            let share = beyond / between;
            let ends = [-share, share].map(|k| [0, 1].map(|i| only[i] + k * across[i]));
            return vec![ends[0], only, ends[1]];
        }
        let extended = |from: [f64; 2], to: [f64; 2]| {
            let length = apart(from, to).max(1e-9);
            [0, 1].map(|i| to[i] + beyond * (to[i] - from[i]) / length)
        };
        if let [first, second, ..] = kept[..] {
            kept.insert(0, extended(second, first));
        }
        if let [.., before, last] = kept[..] {
            kept.push(extended(before, last));
        }
        kept
    }

    /// The corners of a short pass along a crease, from one of the passes beside a ridge to the other.
    fn along_crease(&self, chain: &[Ridge], worst: &Ridge) -> Vec<[f64; 2]> {
        let [a, b] = worst.tips;
        if self.field.cutter.corner_mm() > 0.0 {
            return vec![a, worst.wanted, b];
        }
        // The rim of a flat end stands at the crease: a step to either side of a place in it, that place
        // is reached from another tip.
        let mut corners = vec![a];
        corners.extend(chain.iter().map(|ridge| ridge.wanted));
        corners.push(b);
        if let [_, first, .., last, _] = corners[..]
            && apart(a, last) + apart(first, b) < apart(a, first) + apart(last, b)
        {
            let inner = 1..corners.len() - 1;
            corners[inner].reverse();
        }
        simplified(&corners, SMOOTH * self.slope_mm)
    }
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Ridges between the same passes from line to line.
fn chained(ridges: &[Ridge], apart_mm: f64) -> Vec<Vec<Ridge>> {
    let mut by_strands: BTreeMap<(usize, [usize; 2]), Vec<Vec<Ridge>>> = BTreeMap::new();
    for ridge in ridges {
        let chains = by_strands.entry((ridge.line.0, ridge.strands)).or_default();
        let goes_on = |chain: &&mut Vec<Ridge>| {
            chain.last().is_some_and(|last| {
                let lines = ridge.line.1 - last.line.1;
                (1..=2).contains(&lines) && apart(ridge.wanted, last.wanted) <= 6.0 * apart_mm
            })
        };
        match chains.iter_mut().rev().find(goes_on) {
            Some(chain) => chain.push(*ridge),
            None => chains.push(vec![*ridge]),
        }
    }
    by_strands.into_values().flatten().collect()
}

/// Strands in an order that goes from each to the nearest, beginning near a place.
fn in_order(mut strands: Vec<Strand>, from: Option<[f64; 3]>) -> Vec<Strand> {
    let mut here = from.unwrap_or_default();
    let mut ordered = Vec::with_capacity(strands.len());
    let square = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
    while !strands.is_empty() {
        let away = |strand: &Strand| -> f64 { square(strand.start, here) };
        let nearest =
            (0..strands.len()).min_by(|a, b| away(&strands[*a]).total_cmp(&away(&strands[*b])));
        let strand = strands.swap_remove(nearest.unwrap_or(0));
        here = strand.end();
        ordered.push(strand);
    }
    ordered
}

/// Places that are looked at again.
struct Dirty {
    low: [f64; 2],
    cell_mm: f64,
    shape: [usize; 2],
    cells: Vec<bool>,
}

impl Dirty {
    /// All of a rectangle.
    fn new([low, high]: [[f64; 2]; 2], cell_mm: f64) -> Self {
        let shape = [0, 1].map(|k| ((high[k] - low[k]) / cell_mm) as usize + 1);
        Self {
            low,
            cell_mm,
            shape,
            cells: vec![true; shape[0] * shape[1]],
        }
    }

    fn clear(&mut self) {
        self.cells.fill(false);
    }

    fn cell(&self, axis: usize, at: f64) -> usize {
        let cell = ((at - self.low[axis]) / self.cell_mm).max(0.0) as usize;
        cell.min(self.shape[axis] - 1)
    }

    fn mark(&mut self, at: [f64; 2], around_mm: f64) {
        let range = |k: usize| self.cell(k, at[k] - around_mm)..=self.cell(k, at[k] + around_mm);
        let (columns, rows) = (range(0), range(1));
        for column in columns {
            for row in rows.clone() {
                self.cells[column * self.shape[1] + row] = true;
            }
        }
    }

    fn holds(&self, at: [f64; 2]) -> bool {
        self.cells[self.cell(0, at[0]) * self.shape[1] + self.cell(1, at[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cutter::Cutter;
    use crate::surface::Surface;
    use crate::trace::Fineness;

    fn mend<'a>(field: &'a Field<'a>, scallop_mm: f64) -> Mend<'a> {
        let step_mm = crate::cusp::slope_step_mm(&field.cutter, scallop_mm);
        Mend {
            field,
            drawing: Drawing {
                fineness: Fineness::of(field.cutter.corner_mm(), 2e-4, 1e-4),
                tolerance_mm: 0.005,
                arcs: true,
            },
            scallop_mm,
            level_mm: step_mm,
            slope_mm: step_mm,
            decimals: 4,
            tip: &|_| None,
        }
    }

    #[test]
    fn lines_that_would_be_too_many_are_fewer_and_that_is_known() {
        let corners = [[0.0; 3], [400.0, 0.0, 0.0], [0.0, 300.0, 0.0]];
        let surface = Surface::new(&corners, &[[0, 1, 2]]).unwrap();
        let cutter = Cutter::ball(6.0).unwrap();
        let field = Field::new(&surface, cutter, 0.0);
        let apart = |scallop_mm: f64| {
            let mend = mend(&field, scallop_mm);
            let (lines, wanted_mm) = mend.lines();
            let [places, beside] = lines.limits.map(|[low, high]| high - low);
            assert!(places / lines.step_mm * beside / lines.apart_mm <= 1.01 * MOST_PLACES);
            (lines.apart_mm, wanted_mm)
        };
        let (coarse, wanted) = apart(0.001);
        assert!(coarse > 2.0 * wanted, "{coarse} {wanted}");
        let (fine, wanted) = apart(0.2);
        assert_eq!(fine, wanted);
    }

    #[test]
    fn every_short_pass_goes_through_what_is_wanted() {
        let corners = [[0.0; 3], [40.0, 0.0, 0.0], [0.0, 30.0, 0.0]];
        let surface = Surface::new(&corners, &[[0, 1, 2]]).unwrap();
        let ridge =
            |number: usize, tips: [[f64; 2]; 2], wanted: [f64; 2], is_reached: bool| Ridge {
                line: (0, number),
                at: [10.0, 10.0],
                tips,
                strands: [0, 1],
                wanted,
                is_reached,
                nz: 1.0,
                cusp_mm: 0.3,
            };
        for cutter in ["flat:4", "bull:8:2.5", "ball:6"] {
            let field = Field::new(&surface, cutter.parse().unwrap(), 0.0);
            let mend = mend(&field, 0.25);
            let wanted = [10.0, 10.0];
            // Between two tips, and where both are one, as where the tip moves steadily.
            for tips in [[[10.0, 9.0], [10.2, 11.0]], [[10.3, 10.2]; 2]] {
                for is_reached in [false, true] {
                    let corners = mend.pass(&[ridge(0, tips, wanted, is_reached)]);
                    assert!(corners.contains(&wanted), "{cutter}: {corners:?}");
                    assert!(corners.iter().any(|corner| apart(*corner, wanted) > 0.1));
                }
            }
        }
        // In a crease the rim of a flat end needs a way through all of it, from one pass to the other.
        let field = Field::new(&surface, Cutter::flat(4.0).unwrap(), 0.0);
        let tips = [[10.0, 9.0], [10.0, 11.0]];
        let chain = [[9.8, 10.2], [10.0, 10.0], [10.2, 9.9]].map(|w| ridge(0, tips, w, false));
        let corners = mend(&field, 0.25).pass(&chain);
        let expected = [
            [10.0, 9.0],
            [10.2, 9.9],
            [10.0, 10.0],
            [9.8, 10.2],
            [10.0, 11.0],
        ];
        assert_eq!(corners, expected);
    }
}
