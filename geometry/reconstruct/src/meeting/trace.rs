//! The line in which two surfaces intersect or touch, as a path between two vertices.

use nurbs::PiecewiseCubic;

use super::gap::{Gap, Reach};
use crate::border::path::hermite;
use crate::polygon::{cross, dot, minus, norm};

/// Places of a piece at which the gap of the surfaces is looked at.
const PROBES: usize = 8;

/// Pieces are not made shorter than this, pitches.
const SHORTEST: f64 = 0.05;

/// Towards an end where surfaces lie on each other they bend less and less: this share of what they
/// must elsewhere tells there where they meet.
const BLUNT_BEND: f64 = 0.1;

/// Cosine of the angle (60 degrees) that the ends of a piece may turn from its chord.
const LEAST_TURN_COSINE: f64 = 0.5;

/// A piece is begun for each so much by which the guide turns, radians, ...
const TURN_RAD: f64 = core::f64::consts::FRAC_PI_4;

/// ... but so many at most, and four at least where it closes in itself.
const MOST_PARTS: usize = 16;
const CLOSED_PARTS: usize = 4;

/// Places at which the turn of a guide is taken.
const TURNS: usize = 32;

/// Shortest part, pitches.
const ROOM: f64 = 4.0;

/// Most times a piece is halved.
const MAX_DEPTH: usize = 16;

/// Rounds in which a piece gets its own length for parameter.
const LENGTHS: usize = 2;

/// A place on the intersection with the unit vector along it.
#[derive(Debug, Clone, Copy)]
struct Stop {
    place: [f64; 2],
    along: [f64; 2],
    /// Where the guide is beside it.
    at: f64,
}

/// What is followed, along what.
struct Course<'a> {
    gap: &'a Gap<'a>,
    guide: &'a PiecewiseCubic<2>,
    reach: Reach,
}

/// The line of two surfaces from one vertex to another, beside a path that is known to be near to
/// it. Its pieces are cubics with the directions of the line at their ends, as many as it takes to
/// be on it to [`Gap::tolerance_mm`] all along; a straight line is one. `None` where that cannot be
/// had.
pub(crate) fn trace(
    gap: &Gap<'_>,
    guide: &PiecewiseCubic<2>,
    [start, end]: [[f64; 2]; 2],
    reach: Reach,
) -> Option<PiecewiseCubic<2>> {
    let (first, last) = guide.domain();
    let is_closed = start == end;
    if !is_closed && is_met(gap, |share| between(start, end, share)) {
        return PiecewiseCubic::line(start, end, norm(minus(end, start))).ok();
    }
    let is_blunt = [start, end].map(|place| gap.is_blunt(place, reach));
    let share = if is_blunt.contains(&true) {
        BLUNT_BEND
    } else {
        1.0
    };
    let reach = Reach {
        least_bend: share * reach.least_bend,
        ..reach
    };
    let course = Course { gap, guide, reach };
    let parts = parts(guide).max(if is_closed { CLOSED_PARTS } else { 1 });
    let mut stops = Vec::with_capacity(parts + 1);
    for k in 0..=parts {
        let at = first + (last - first) * k as f64 / parts as f64;
        let place = match k {
            0 => Some(start),
            k if k == parts => Some(end),
            _ => gap.nearest(guide.evaluate(at), reach),
        };
        // Where the guide is too far off there is another way between the stops beside it.
        if let Some(place) = place {
            let towards = guide.derivative(at, 1);
            let is_blunt = k == 0 && is_blunt[0] || k == parts && is_blunt[1];
            stops.push(if is_blunt {
                drawn(place, towards, at)?
            } else {
                course.stop(place, towards, at)?
            });
        }
    }
    if is_closed {
        // One vertex, one direction.
        let along = stops[0].along;
        stops.last_mut()?.along = along;
    }
    let mut pieces = Vec::new();
    for pair in stops.windows(2) {
        course.follow([pair[0], pair[1]], MAX_DEPTH, &mut pieces)?;
    }
    let mut breaks = vec![0.0];
    let mut coefficients = Vec::with_capacity(pieces.len());
    for (piece, length) in pieces {
        breaks.push(breaks[breaks.len() - 1] + length);
        coefficients.push(piece);
    }
    PiecewiseCubic::new(breaks, coefficients).ok()
}

/// Into how many parts a guide is cut, each of which turns little. A guide hardly longer than what
/// vertices move is not cut.
fn parts(guide: &PiecewiseCubic<2>) -> usize {
    let (first, last) = guide.domain();
    let place = |k: usize| guide.evaluate(first + (last - first) * k as f64 / TURNS as f64);
    let chords: Vec<[f64; 2]> = (0..TURNS).map(|k| minus(place(k + 1), place(k))).collect();
    let turns = chords
        .windows(2)
        .map(|pair| libm::atan2(cross(pair[0], pair[1]), dot(pair[0], pair[1])).abs());
    let turn = turns.sum::<f64>() / TURN_RAD;
    let room = (last - first) / ROOM;
    (turn.min(room).ceil() as usize).clamp(1, MOST_PARTS)
}

impl Course<'_> {
    /// The direction of the intersection at a place of it, on the side of another direction.
    fn stop(&self, place: [f64; 2], towards: [f64; 2], at: f64) -> Option<Stop> {
        let slope = self.gap.at(place).1;
        let bend = norm(slope);
        if bend.is_nan() || bend < self.reach.least_bend {
            return None;
        }
        let along = [-slope[1] / bend, slope[0] / bend];
        let sense = dot(along, towards);
        if sense == 0.0 || sense.is_nan() {
            return None;
        }
        let sign = 1.0_f64.copysign(sense);
        Some(Stop {
            place,
            along: along.map(|c| sign * c),
            at,
        })
    }

    /// Adds the pieces between two stops, with their lengths.
    fn follow(
        &self,
        [from, to]: [Stop; 2],
        depth: usize,
        pieces: &mut Vec<([[f64; 4]; 2], f64)>,
    ) -> Option<()> {
        let chord = minus(to.place, from.place);
        let distance = norm(chord);
        let is_long = distance > SHORTEST;
        let turns_little = [from, to]
            .iter()
            .all(|stop| dot(stop.along, chord) > LEAST_TURN_COSINE * distance);
        let (piece, length) = piece(from, to, distance);
        let at = |share: f64| place(&piece, share * length);
        if turns_little && is_met(self.gap, at) {
            pieces.push((piece, length));
            return Some(());
        }
        let depth = depth.checked_sub(1).filter(|_| is_long)?;
        let (guess, towards) = if turns_little {
            (at(0.5), chord)
        } else {
            let towards = [0, 1].map(|d| from.along[d] + to.along[d]);
            (between(from.place, to.place, 0.5), towards)
        };
        // What does not lie between the two would fold the path back.
        let is_between = |place: &[f64; 2]| {
            let share = dot(minus(*place, from.place), chord) / (distance * distance);
            (0.1..0.9).contains(&share)
        };
        let beside = (from.at + to.at) / 2.0;
        let guided = self.gap.nearest(self.guide.evaluate(beside), self.reach);
        let place = guided.filter(is_between).or_else(|| {
            let found = self.gap.nearest(guess, wide(self.reach, distance));
            found.filter(is_between)
        })?;
        let middle = self.stop(place, towards, beside)?;
        self.follow([from, middle], depth, pieces)?;
        self.follow([middle, to], depth, pieces)
    }
}

/// Where the surfaces do not bend which way the line leads is not seen, but drawn.
fn drawn(place: [f64; 2], towards: [f64; 2], at: f64) -> Option<Stop> {
    let length = norm(towards);
    (length > 0.0).then(|| Stop {
        place,
        along: towards.map(|c| c / length),
        at,
    })
}

/// Long pieces may bulge from their chords by more than a border is moved.
fn wide(reach: Reach, distance: f64) -> Reach {
    Reach {
        farthest: reach.farthest.max(distance / 2.0),
        ..reach
    }
}

/// The cubic between two stops over a parameter of its own length.
fn piece(from: Stop, to: Stop, distance: f64) -> ([[f64; 4]; 2], f64) {
    let mut length = distance;
    let mut piece = hermite(from.place, from.along, to.place, to.along, length);
    for _ in 0..LENGTHS {
        let curve = PiecewiseCubic {
            breaks: vec![0.0, length],
            pieces: vec![piece],
        };
        length = curve.arc_length();
        piece = hermite(from.place, from.along, to.place, to.along, length);
    }
    (piece, length)
}

fn place(piece: &[[f64; 4]; 2], s: f64) -> [f64; 2] {
    piece.map(|c| c[0] + s * (c[1] + s * (c[2] + s * c[3])))
}

fn between(a: [f64; 2], b: [f64; 2], share: f64) -> [f64; 2] {
    [0, 1].map(|d| a[d] + share * (b[d] - a[d]))
}

/// Whether a curve, given by shares of it, runs along the line.
fn is_met(gap: &Gap<'_>, at: impl Fn(f64) -> [f64; 2]) -> bool {
    (1..PROBES).all(|k| {
        let (gap_mm, _) = gap.at(at(k as f64 / PROBES as f64));
        // Probing may miss the worst place, hence the half.
        gap_mm.abs() <= gap.tolerance_mm() / 2.0
    })
}

#[cfg(test)]
mod tests {
    use super::super::gap::Line;
    use super::super::testing::{PLACEMENT, graph, plane};
    use super::*;
    use crate::border::path::polyline;
    use crate::model::SPACE_CURVE_TOLERANCE_MM;
    use nurbs::PatchSurface;

    const REACH: Reach = Reach {
        farthest: 0.75,
        least_bend: 0.05,
    };

    fn gap(sides: [&PatchSurface; 2]) -> Gap<'_> {
        Gap {
            sides,
            placement: PLACEMENT,
            line: Line::Intersection,
        }
    }

    /// They meet in the circle of radius 8 about the origin, which is column and row 20.
    fn bowl_and_plane() -> (PatchSurface, PatchSurface) {
        let bowl = graph(5.0, |x, y| (x * x + y * y) / 20.0);
        (bowl, plane(3.2, 0.0, 0.0))
    }

    /// A place so far off that circle, pitches, at so many 48ths of it.
    fn around(k: u8, off: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(f64::from(k) * core::f64::consts::PI / 24.0);
        [20.0 + (16.0 + off) * cos, 20.0 + (16.0 + off) * sin]
    }

    #[test]
    fn planes_meet_in_a_line() {
        // y = x / 4 + 1, that is row = column / 4 + 17.
        let (a, b) = (plane(1.0, 0.25, 0.0), plane(0.0, 0.0, 1.0));
        let gap = gap([&a, &b]);
        let guide = PiecewiseCubic::line([0.0, 17.4], [40.0, 26.7], 41.0).unwrap();
        let path = trace(&gap, &guide, [[0.0, 17.0], [40.0, 27.0]], REACH).unwrap();
        assert_eq!(path.pieces.len(), 1);
        assert!(path.pieces[0].iter().all(|c| c[2] == 0.0 && c[3] == 0.0));
    }

    #[test]
    fn a_bowl_and_a_plane_meet_in_a_circle_of_few_pieces() {
        let (bowl, flat) = bowl_and_plane();
        let gap = gap([&bowl, &flat]);
        let places: Vec<_> = (0..=48).map(|k| around(k % 48, 0.3)).collect();
        let guide = polyline(&places).unwrap();
        let vertex = around(0, 0.0);
        let path = trace(&gap, &guide, [vertex, vertex], REACH).unwrap();
        assert!(
            (4..=32).contains(&path.pieces.len()),
            "{}",
            path.pieces.len()
        );
        let (first, last) = path.domain();
        assert!((last - first - 32.0 * core::f64::consts::PI).abs() < 1e-3);
        for k in 0..=1000 {
            let at = first + (last - first) * f64::from(k) / 1000.0;
            let off = norm(minus(path.evaluate(at), [20.0, 20.0])) - 16.0;
            // 1e-4 mm in height where the bowl rises by 0.8.
            assert!(
                off.abs() * 0.5 * 0.8 < SPACE_CURVE_TOLERANCE_MM,
                "{k}: {off}"
            );
            assert!((norm(path.derivative(at, 1)) - 1.0).abs() < 1e-2);
        }
        // No kinks, not even where it closes.
        for (k, at) in path.breaks.iter().enumerate() {
            let next = path.derivative(*at, 1);
            let before = match k {
                0 => path.derivative(last - 1e-9, 1),
                _ => path.derivative(at - 1e-9, 1),
            };
            let next = if k + 1 == path.breaks.len() {
                path.derivative(first, 1)
            } else {
                next
            };
            assert!(dot(before, next) > 1.0 - 1e-6, "{before:?} {next:?}");
        }
    }

    #[test]
    fn a_guide_may_be_too_far_off_in_a_place() {
        let (bowl, flat) = bowl_and_plane();
        let gap = gap([&bowl, &flat]);
        let far = |k: u8| if (21..=27).contains(&k) { 2.0 } else { 0.3 };
        let places: Vec<_> = (0..=48).map(|k| around(k % 48, far(k % 48))).collect();
        let guide = polyline(&places).unwrap();
        let vertex = around(0, 0.0);
        let path = trace(&gap, &guide, [vertex, vertex], REACH).unwrap();
        for place in path.sampled(16) {
            let off = norm(minus(place, [20.0, 20.0])) - 16.0;
            assert!(off.abs() < 1e-3, "{place:?} {off}");
        }
    }

    /// Five sixths of the circle: the middle of its chord is nearer to its other side.
    #[test]
    fn a_long_arc_is_followed_along_its_guide() {
        let (bowl, flat) = bowl_and_plane();
        let gap = gap([&bowl, &flat]);
        let places: Vec<_> = (0..=40).map(|k| around(k, 0.3)).collect();
        let guide = polyline(&places).unwrap();
        let path = trace(&gap, &guide, [around(0, 0.0), around(40, 0.0)], REACH).unwrap();
        let (first, last) = path.domain();
        let length = 16.0 * 40.0 * core::f64::consts::PI / 24.0;
        assert!((last - first - length).abs() < 1e-3, "{}", last - first);
    }

    /// Two fillets run out into the plane z = 0, which they touch along x = 0 and y = 0.
    #[test]
    fn a_line_that_runs_out_where_surfaces_touch_is_followed_to_its_end() {
        let a = graph(5.0, |x, _| -x * x / 6.0);
        let b = graph(5.0, |_, y| -y * y / 6.0 - y * y * y / 60.0);
        let gap = gap([&a, &b]);
        let on = |y: f64| [20.0 + 2.0 * y * (1.0 + y / 10.0).sqrt(), 20.0 + 2.0 * y];
        let ends = [on(0.0), on(4.0)];
        for ends in [ends, [ends[1], ends[0]]] {
            let aside = [0.1, -0.15, -0.4, -0.3, 0.2];
            let mut places: Vec<_> = (0..=4).map(|k| on(f64::from(k))).collect();
            for (place, aside) in places.iter_mut().zip(aside) {
                place[0] += aside;
            }
            if ends[0] != on(0.0) {
                places.reverse();
            }
            let guide = polyline(&places).unwrap();
            let path = trace(&gap, &guide, ends, REACH).expect("it leads there");
            for place in path.sampled(16) {
                assert!(
                    gap.height(place).0.abs() < SPACE_CURVE_TOLERANCE_MM,
                    "{place:?}"
                );
            }
        }
        // Surfaces that are apart at the end do not run out there.
        let low = graph(5.0, |x, _| -x * x / 6.0 - 0.003);
        let gap = self::gap([&low, &b]);
        let guide = polyline(&[on(0.0), on(4.0)]).unwrap();
        assert_eq!(trace(&gap, &guide, ends, REACH), None);
    }

    #[test]
    fn what_does_not_meet_is_not_traced() {
        let (a, b) = (plane(1.0, 0.01, 0.0), plane(0.0, 0.0, 0.0));
        let gap = gap([&a, &b]);
        let guide = PiecewiseCubic::line([0.0, 17.0], [40.0, 27.0], 41.0).unwrap();
        assert_eq!(
            trace(&gap, &guide, [[0.0, 17.0], [40.0, 27.0]], REACH),
            None
        );
    }
}
