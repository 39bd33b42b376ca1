//! The plane of a surface's parameters, unrolled, and the loops of a face in it.

use std::collections::BTreeMap;

use crate::division::Division;
use crate::inverse::{Inverse, Place};
use crate::{Body, BodyError, EdgeUse, Face, wrapped};

/// How far, millimetres, edges may leave their faces: files of coarse tolerances have 0.01.
const OFF_MM: f64 = 0.05;
/// Share of a period that the ends of a chord lie apart at most, and halvings until they do.
const APART: f64 = 0.2;
const HALVINGS: usize = 12;
/// Share of a period within which a point lies on the cut, and halvings to put one there.
const ON_CUT: f64 = 1e-7;
const ROUNDS: usize = 60;
/// Share of a period that a gap in the loops must have for the cut to lie there.
const GAP: f64 = 1e-3;
/// Room around loops, as a share of their extent.
const MARGIN: f64 = 0.02;

/// Where a parameter that comes back to where it was is cut open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    pub(crate) at: f64,
    pub(crate) period: f64,
}

impl Cut {
    fn unrolled(&self, value: f64) -> f64 {
        wrapped(value, self.at, self.period)
    }

    fn is_on(&self, value: f64) -> bool {
        let from = self.unrolled(value) - self.at;
        from.min(self.period - from) <= ON_CUT * self.period
    }

    /// The shorter way from one value to another.
    fn way(period: f64, from: f64, to: f64) -> f64 {
        let way = libm::fmod(to - from, period);
        if way > period / 2.0 {
            way - period
        } else if way <= -period / 2.0 {
            way + period
        } else {
            way
        }
    }
}

/// A chord of an edge, as a loop runs along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// Indices of points.
    pub(crate) points: [usize; 2],
    /// Their parameters.
    pub(crate) places: [[f64; 2]; 2],
}

/// A face in the plane.
#[derive(Debug)]
pub(crate) struct Chart {
    pub(crate) cuts: [Option<Cut>; 2],
    pub(crate) sides: Vec<Side>,
    /// Corners of a rectangle around the face.
    pub(crate) low: [f64; 2],
    pub(crate) high: [f64; 2],
}

/// Chords of a face as pairs of an edge and the index of the link where each begins along it.
type Chords = Vec<(EdgeUse, usize)>;

/// Finds the parameters of a face's points.
struct Located<'a> {
    face: &'a Face,
    inverse: Inverse<'a>,
    periods: [Option<f64>; 2],
    places: BTreeMap<usize, Place>,
}

impl<'a> Located<'a> {
    fn new(face: &'a Face) -> Self {
        Self {
            face,
            inverse: Inverse::new(&face.surface),
            periods: face.surface.periods(),
            places: BTreeMap::new(),
        }
    }

    fn place(&mut self, division: &Division, point: usize) -> Result<Place, BodyError> {
        if let Some(place) = self.places.get(&point) {
            return Ok(*place);
        }
        let at_mm = division.points_mm[point];
        let place = self.inverse.place(&at_mm);
        let off_mm = (self.face.surface.at(place.at).0 - at_mm).norm();
        if off_mm.is_nan() || off_mm > OFF_MM {
            return Err(BodyError::OffSurface {
                face: self.face.name.clone(),
                off_mm,
                at_mm: at_mm.into(),
            });
        }
        self.places.insert(point, place);
        Ok(place)
    }

    /// Parameters of both ends of a chord, the second as near to the first as can be; `None` where
    /// a parameter is free at both.
    fn ends(
        &mut self,
        division: &Division,
        points: [usize; 2],
    ) -> Result<Option<[[f64; 2]; 2]>, BodyError> {
        let [a, b] = [
            self.place(division, points[0])?,
            self.place(division, points[1])?,
        ];
        let [mut from, mut to] = [a.at, b.at];
        for axis in 0..2 {
            match [a.is_free[axis], b.is_free[axis]] {
                [true, true] => return Ok(None),
                [true, false] => from[axis] = to[axis],
                [false, true] => to[axis] = from[axis],
                [false, false] => {
                    if let Some(period) = self.periods[axis] {
                        to[axis] = from[axis] + Cut::way(period, from[axis], to[axis]);
                    }
                }
            }
        }
        Ok(Some([from, to]))
    }

    /// A parameter of both ends as each end has it alone, but for what is free there.
    fn own(&self, points: [usize; 2], axis: usize, ends: [f64; 2]) -> [f64; 2] {
        let of = |point: usize| {
            let place = self.places.get(&point)?;
            (!place.is_free[axis]).then_some(place.at[axis])
        };
        match points.map(of) {
            [Some(a), Some(b)] => [a, b],
            [Some(one), None] | [None, Some(one)] => [one; 2],
            [None, None] => ends,
        }
    }
}

fn links(division: &Division, (use_, k): (EdgeUse, usize)) -> [usize; 2] {
    let chain = &division.chains[use_.edge];
    let [a, b] = [chain[k].point, chain[k + 1].point];
    if use_.is_reversed { [b, a] } else { [a, b] }
}

fn chords(division: &Division, face: &Face) -> Result<Chords, BodyError> {
    let mut chords = Vec::new();
    for use_ in face.loops.iter().flatten() {
        let what = "edge";
        let index = use_.edge;
        let chain = division
            .chains
            .get(index)
            .ok_or(BodyError::Missing { what, index })?;
        chords.extend((0..chain.len() - 1).map(|k| (*use_, k)));
    }
    Ok(chords)
}

/// Divides edges so far that each chord of a face has a place in its plane, and chooses the cuts:
/// what crosses one has a point there.
pub(crate) fn prepare(
    body: &Body,
    division: &mut Division,
    face: &Face,
) -> Result<[Option<Cut>; 2], BodyError> {
    let mut located = Located::new(face);
    for _ in 0..HALVINGS {
        let mut wide = Vec::new();
        for chord in chords(division, face)? {
            let Some([a, b]) = located.ends(division, links(division, chord))? else {
                continue;
            };
            let is_wide = (0..2).any(|axis| {
                let period = located.periods[axis];
                period.is_some_and(|period| (b[axis] - a[axis]).abs() > APART * period)
            });
            if is_wide {
                wide.push((chord.0.edge, chord.1));
            }
        }
        if wide.is_empty() {
            break;
        }
        wide.sort_unstable();
        wide.dedup();
        // From behind, so that the places before stay what they are.
        for (edge, k) in wide.into_iter().rev() {
            let chain = &division.chains[edge];
            let middle = (chain[k].parameter + chain[k + 1].parameter) / 2.0;
            division.insert(body, edge, k + 1, middle);
        }
    }
    let mut cuts = [None; 2];
    for (axis, made) in cuts.iter_mut().enumerate() {
        if let Some(period) = located.periods[axis] {
            let cut = choose(&mut located, division, axis, period)?;
            cross(&mut located, body, division, axis, cut)?;
            *made = Some(cut);
        }
    }
    Ok(cuts)
}

/// Amid the widest gap that loops leave, so that none needs a point there; else where some chord
/// begins.
fn choose(
    located: &mut Located<'_>,
    division: &Division,
    axis: usize,
    period: f64,
) -> Result<Cut, BodyError> {
    let mut covered = Vec::new();
    let from = Cut { at: 0.0, period };
    for chord in chords(division, located.face)? {
        let Some([a, b]) = located.ends(division, links(division, chord))? else {
            continue;
        };
        let (low, high) = (a[axis].min(b[axis]), a[axis].max(b[axis]));
        let start = from.unrolled(low);
        covered.push((start, start + (high - low)));
    }
    covered.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(first, _)) = covered.first() else {
        return Ok(from);
    };
    let mut widest = (0.0, first);
    // What runs over the end covers the beginning, too.
    let mut reach = covered
        .iter()
        .map(|c| c.1 - period)
        .fold(f64::NEG_INFINITY, f64::max);
    let again = (first + period, first + period);
    for &(start, end) in covered.iter().chain([&again]) {
        if reach.is_finite() && start - reach > widest.0 {
            widest = (start - reach, (start + reach) / 2.0);
        }
        reach = reach.max(end);
    }
    let at = if widest.0 > GAP * period {
        widest.1
    } else {
        first
    };
    Ok(Cut { at, period })
}

/// Puts points where edges cross a cut.
fn cross(
    located: &mut Located<'_>,
    body: &Body,
    division: &mut Division,
    axis: usize,
    cut: Cut,
) -> Result<(), BodyError> {
    let mut crossed = Vec::new();
    for chord in chords(division, located.face)? {
        let Some(ends) = located.ends(division, links(division, chord))? else {
            continue;
        };
        if ends.iter().any(|end| cut.is_on(end[axis])) {
            continue;
        }
        let turns = ends.map(|end| libm::floor((end[axis] - cut.at) / cut.period));
        if turns[0] != turns[1] {
            crossed.push((chord.0.edge, chord.1));
        }
    }
    crossed.sort_unstable();
    crossed.dedup();
    for (edge, k) in crossed.into_iter().rev() {
        let chain = &division.chains[edge];
        let (mut from, mut to) = (chain[k].parameter, chain[k + 1].parameter);
        let start = located.place(division, chain[k].point)?.at[axis];
        let side = |value: f64| {
            let way = Cut::way(cut.period, cut.at, value);
            way > 0.0
        };
        let begins = side(start);
        for _ in 0..ROUNDS {
            let middle = (from + to) / 2.0;
            let at_mm = body.edges[edge].curve.at(middle).0;
            if side(located.inverse.place(&at_mm).at[axis]) == begins {
                from = middle;
            } else {
                to = middle;
            }
        }
        division.insert(body, edge, k + 1, (from + to) / 2.0);
    }
    Ok(())
}

impl Chart {
    /// The sides of a face in its plane.
    pub(crate) fn new(
        division: &Division,
        face: &Face,
        cuts: [Option<Cut>; 2],
    ) -> Result<Self, BodyError> {
        let mut located = Located::new(face);
        let mut sides = Vec::new();
        let mut winding = [0.0; 2];
        for chord in chords(division, face)? {
            let points = links(division, chord);
            let Some([a, b]) = located.ends(division, points)? else {
                continue;
            };
            let mut of_axes = [Vec::new(), Vec::new()];
            for axis in 0..2 {
                let own = located.own(points, axis, [a[axis], b[axis]]);
                of_axes[axis] = match cuts[axis] {
                    None => vec![own],
                    Some(cut) => {
                        winding[axis] += (b[axis] - a[axis]) / cut.period;
                        unrolled(cut, own, b[axis] - a[axis])
                    }
                };
            }
            for u in &of_axes[0] {
                for v in &of_axes[1] {
                    sides.push(Side {
                        points,
                        places: [[u[0], v[0]], [u[1], v[1]]],
                    });
                }
            }
        }
        let (mut low, mut high) = ([0.0; 2], [0.0; 2]);
        let domain = face.surface.domain();
        for axis in 0..2 {
            let of_sides = sides
                .iter()
                .flat_map(|side| side.places)
                .map(|place| place[axis]);
            let (least, most) = of_sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| {
                (l.min(v), m.max(v))
            });
            let ends = domain[axis].unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            (low[axis], high[axis]) = if let Some(cut) = cuts[axis] {
                (cut.at, cut.at + cut.period)
            } else {
                let winds = winding[1 - axis].abs() > 0.5 || sides.is_empty();
                // Loops leave a gap at a pole that they touch, and none anywhere else.
                let touches = |end: f64| {
                    let mut places = located.places.values();
                    places.any(|place| place.is_free[1 - axis] && place.at[axis] == end)
                };
                let margin = MARGIN * (most - least);
                let pick = |end: f64, with_margin: f64| {
                    if end.is_finite() && (winds || touches(end)) {
                        end
                    } else {
                        with_margin
                    }
                };
                (pick(ends.0, least - margin), pick(ends.1, most + margin))
            };
        }
        let is_sound = (0..2)
            .all(|axis| low[axis].is_finite() && high[axis].is_finite() && low[axis] < high[axis]);
        if !is_sound {
            return Err(BodyError::Loops {
                face: face.name.clone(),
                reason: "its loops enclose nothing",
            });
        }
        Ok(Self {
            cuts,
            sides,
            low,
            high,
        })
    }
}

/// Where the ends of a chord come to lie: in both borders of the plane where it runs along the cut.
/// A point must lie in one place whichever chord it is of, so it goes by its own parameters, and
/// the way to the other end tells borders apart.
fn unrolled(cut: Cut, own: [f64; 2], way: f64) -> Vec<[f64; 2]> {
    let (first, last) = (cut.at, cut.at + cut.period);
    let border = |is_last: bool| if is_last { last } else { first };
    let [from, to] = own.map(|value| cut.unrolled(value));
    match own.map(|value| cut.is_on(value)) {
        [true, true] => vec![[first; 2], [last; 2]],
        [true, false] => vec![[border(way < 0.0), to]],
        [false, true] => vec![[from, border(way > 0.0)]],
        [false, false] => vec![[from, to]],
    }
}
