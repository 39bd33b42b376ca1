//! How far the curves that two faces make of a crease meet.
//!
//! Each lies over the same path in the x-y plane, so what parts them is seen along z; how far one is
//! from the other's face is that times the cosine between z and the normal there.

use nurbs::PiecewiseCubic;
use reconstruct::{Face, Surface};

use super::bend::{apart, mean};
use super::onto;
use super::support::Support;
use super::topology::Place;

/// Places of each piece of a curve at which it is compared with another.
const PROBES: usize = 4;

/// A crease is shared if its curves meet along this part of it at least.
const LEAST_PART: f64 = 0.5;

/// Where a crease is cut, what is left has at least this length, in units of the distance
/// that is shared gladly; edges that are hardly longer than the uncertainty trouble readers.
const LEAST_REST: f64 = 20.0;

/// Where faces do not meet beside a crease either, curves may be so many times as far apart: an edge
/// that is a little off is less trouble than a gap.
const FAR: f64 = 3.0;

/// How near curves are to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearness {
    most_mm: f64,
    rest_mm: f64,
}

impl Nearness {
    /// So near as is shared gladly.
    pub(super) fn of(sharing_mm: f64) -> Self {
        Self {
            most_mm: sharing_mm,
            rest_mm: LEAST_REST * sharing_mm,
        }
    }

    /// So near as is better than a gap.
    pub(super) fn at_most(sharing_mm: f64) -> Self {
        Self {
            most_mm: FAR * sharing_mm,
            ..Self::of(sharing_mm)
        }
    }
}

/// How far an edge of two faces may lie off each at most.
pub(super) fn most_off_mm(sharing_mm: f64) -> f64 {
    Nearness::at_most(sharing_mm).most_mm / 2.0
}

/// How far a crease may run from where its faces meet, millimetres. Moved farther, the sides of what
/// is narrow cross each other.
const MOVED_MM: f64 = 0.15;

/// Halvings of the interval in which two curves part.
const HALVINGS: usize = 40;

/// A stretch of a crease that is one edge of two faces.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seam {
    /// The second use.
    pub(super) other: Place,
    /// The stretch, in parameters of the first use; its ends are equal to those of the
    /// curve where it reaches them.
    pub(super) range: (f64, f64),
    /// Half way between the two, in the first use's sense of travel.
    pub(super) curve: PiecewiseCubic<3>,
    whole: bool,
}

impl Seam {
    /// The longest stretch on which the curve of a first use and that of a second, which
    /// runs the other way, are as near as this to each other's face; `None` where it is too short.
    /// `facing` is the greater of the cosines of both faces at a place.
    pub(super) fn between(
        first: &PiecewiseCubic<3>,
        second: &PiecewiseCubic<3>,
        facing: impl Fn([f64; 3]) -> f64,
        other: Place,
        nearness: Nearness,
    ) -> Option<Self> {
        let second = second.reversed();
        let (from, to) = first.domain();
        if !same_domain(first, &second) {
            return None;
        }
        let near = |t: f64| {
            let (a, b) = (first.evaluate(t), second.evaluate(t));
            apart(a, b) * facing(a) <= nearness.most_mm
        };
        let (mut low, mut high) = longest_run(&places(first, &second), near)?;
        let rest = nearness.rest_mm;
        if low > from {
            low = low.max(from + rest);
        }
        if high < to {
            high = high.min(to - rest);
        }
        if high.is_nan() || high - low < LEAST_PART * (to - from) {
            return None;
        }
        let sides = [first.restricted(low, high)?, second.restricted(low, high)?];
        Some(Self {
            other,
            range: (low, high),
            curve: mean(&sides[0], &sides[1]),
            whole: low == from && high == to,
        })
    }

    /// All of a crease where its curves are farther apart than what is shared, but the faces meet near
    /// it all along: so it is before corners, which are drawn where they seem to be. `None` where they
    /// do not.
    pub(super) fn where_they_meet(
        first: &PiecewiseCubic<3>,
        second: &PiecewiseCubic<3>,
        faces: &[Support<'_>; 2],
        other: Place,
    ) -> Option<Self> {
        let second = second.reversed();
        if !same_domain(first, &second) {
            return None;
        }
        let between = mean(first, &second);
        let met = onto::curve(&between, faces)?;
        let moved = places(&between, &met)
            .into_iter()
            .map(|t| apart(between.evaluate(t), met.evaluate(t)))
            .fold(0.0, f64::max);
        (moved <= MOVED_MM).then(|| Self {
            other,
            range: first.domain(),
            curve: met,
            whole: true,
        })
    }

    /// The crease is shared from end to end.
    pub(super) fn is_whole(&self) -> bool {
        self.whole
    }
}

/// Parameters at which two curves are compared, ascending, both ends included.
fn places(a: &PiecewiseCubic<3>, b: &PiecewiseCubic<3>) -> Vec<f64> {
    let (first, last) = a.domain();
    let mut places: Vec<f64> = [a, b]
        .iter()
        .flat_map(|curve| curve.breaks.windows(2))
        .flat_map(|pair| {
            (0..PROBES).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / PROBES as f64)
        })
        .filter(|&t| t > first && t < last)
        .chain([first, last])
        .collect();
    places.sort_by(f64::total_cmp);
    places
}

/// The longest run of places for which a test holds, led on to where it fails.
fn longest_run(places: &[f64], holds: impl Fn(f64) -> bool) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    let mut index = 0;
    while index < places.len() {
        let run = places[index..].iter().take_while(|&&t| holds(t)).count();
        if run == 0 {
            index += 1;
            continue;
        }
        let edge = |inside: f64, outside: Option<&f64>| {
            outside.map_or(inside, |&outside| last_holding(inside, outside, &holds))
        };
        let before = index.checked_sub(1).and_then(|k| places.get(k));
        let low = edge(places[index], before);
        let high = edge(places[index + run - 1], places.get(index + run));
        if best.is_none_or(|(a, b)| high - low > b - a) {
            best = Some((low, high));
        }
        index += run;
    }
    best
}

/// Between a parameter for which a test holds and one for which it does not, one near the
/// change for which it holds.
fn last_holding(mut inside: f64, mut outside: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = inside + (outside - inside) / 2.0;
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

fn same_domain(a: &PiecewiseCubic<3>, b: &PiecewiseCubic<3>) -> bool {
    let ((from, to), (other_from, other_to)) = (a.domain(), b.domain());
    let allowed = 1e-9 * (to - from);
    (from - other_from).abs() <= allowed && (to - other_to).abs() <= allowed
}

/// The cosine between z and the normal of a face over a place.
pub(super) fn facing(face: &Face, [x, y, _]: [f64; 3]) -> f64 {
    let Surface::Patches(patches) = &face.surface;
    patches.normal(x, y)[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along x from 0 to 100, at a height that grows from 0 at `from` by `slope`.
    fn flared(from: f64, slope: f64) -> PiecewiseCubic<3> {
        let piece = |x: f64, slope: f64| [[x, 1.0, 0.0, 0.0], [0.0; 4], [0.0, slope, 0.0, 0.0]];
        let breaks = vec![0.0, from, 100.0];
        PiecewiseCubic::new(breaks, vec![piece(0.0, 0.0), piece(from, slope)]).unwrap()
    }

    fn line() -> PiecewiseCubic<3> {
        PiecewiseCubic::line([0.0; 3], [100.0, 0.0, 0.0], 100.0).unwrap()
    }

    #[test]
    fn a_crease_is_shared_as_far_as_its_curves_meet() {
        let seam = |a: &PiecewiseCubic<3>, b: &PiecewiseCubic<3>| {
            Seam::between(a, &b.reversed(), |_| 1.0, (1, 0, 0), Nearness::of(0.05))
        };
        let whole = seam(&line(), &flared(90.0, 0.004)).unwrap();
        assert!(whole.is_whole() && whole.range == (0.0, 100.0));
        assert!((whole.curve.end()[2] - 0.02).abs() < 1e-12);
        // Apart by 0.05 at 82.5.
        let cut = seam(&line(), &flared(80.0, 0.02)).unwrap();
        assert!(!cut.is_whole() && cut.range.0 == 0.0);
        assert!((cut.range.1 - 82.5).abs() < 1e-9, "{:?}", cut.range);
        assert!((cut.curve.end()[2] - 0.025).abs() < 1e-9);
        // Less than a millimetre would be left.
        let short = seam(&line(), &flared(99.0, 0.06)).unwrap();
        assert!((short.range.1 - 99.0).abs() < 1e-9, "{:?}", short.range);
        assert_eq!(seam(&line(), &flared(40.0, 0.02)), None);
    }

    #[test]
    fn what_is_better_than_a_gap_is_three_times_as_far() {
        let other = flared(70.0, 0.0045).reversed();
        let seam = |near| Seam::between(&line(), &other, |_| 1.0, (1, 0, 0), near).unwrap();
        // Apart by 0.135 at its end, and by 0.05 at 81.1.
        assert!(!seam(Nearness::of(0.05)).is_whole());
        assert!(seam(Nearness::at_most(0.05)).is_whole());
        assert!((most_off_mm(0.05) - 0.075).abs() < 1e-12);
        // Where that is cut, as little is left as elsewhere.
        let other = flared(98.5, 0.2).reversed();
        let near = Nearness::at_most(0.05);
        let cut = Seam::between(&line(), &other, |_| 1.0, (1, 0, 0), near).unwrap();
        assert!((cut.range.1 - 99.0).abs() < 1e-9, "{:?}", cut.range);
    }

    #[test]
    fn on_steep_faces_curves_are_nearer_than_they_are_high() {
        let apart = |facing: f64| {
            let other = flared(1.0, 0.0015).reversed();
            Seam::between(&line(), &other, |_| facing, (1, 0, 0), Nearness::of(0.05))
        };
        // 0.1485 at the end, where a wall of 72 degrees is 0.046 off.
        assert!(apart(0.309).unwrap().is_whole());
        assert!(!apart(1.0).is_some_and(|seam| seam.is_whole()));
    }

    #[test]
    fn curves_with_other_parameters_do_not_meet() {
        let longer = PiecewiseCubic::line([0.0; 3], [100.0, 0.0, 0.0], 101.0).unwrap();
        assert_eq!(
            Seam::between(
                &line(),
                &longer.reversed(),
                |_| 1.0,
                (1, 0, 0),
                Nearness::of(1.0)
            ),
            None
        );
    }
}
