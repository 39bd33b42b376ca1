//! Edges divided into straight sides, each once for all faces that it bounds.

use nurbs::{PatchSurface, PiecewiseCubic};

use crate::settings::TessellateSettings;
use crate::vector::{Point2, Point3, distance, dot, norm, off_line};

/// Part of the tolerance that a side may lie off its edge. The rest is left to the triangles on
/// it, which are to keep the tolerance without dividing the side again.
const EDGE_PART: f64 = 0.5;

/// Places of each piece of a path that are looked at.
const PROBES: usize = 8;

/// A path that turns more than this at a joint of its pieces, radians, is divided there.
const KINK_RAD: f64 = 0.02;

/// A side is at most this many times as long as triangles are wide where the surface bends most:
/// a straight side along a cylinder would else have slivers all along it.
const LONGEST: f64 = 6.0;

/// Most halvings of one stretch of a path.
const MAX_DEPTH: usize = 16;

/// Parameters at which an edge is divided, its ends included.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Division(Vec<f64>);

impl Division {
    /// As coarse as the tolerance allows for the curves that all the surfaces make of the path.
    pub(crate) fn of(
        path: &PiecewiseCubic<2>,
        surfaces: &[&PatchSurface],
        settings: &TessellateSettings,
    ) -> Self {
        let strand = Strand {
            path,
            surfaces,
            settings,
        };
        let (first, last) = path.domain();
        let mut stops = vec![first];
        for k in 1..path.pieces.len() {
            if strand.has_kink(k) {
                stops.push(path.breaks[k]);
            }
        }
        stops.push(last);
        let mut parameters = vec![first];
        for pair in stops.windows(2) {
            strand.follow(&mut parameters, (pair[0], pair[1]), MAX_DEPTH);
        }
        Self(parameters)
    }

    /// How many sides there are.
    pub(crate) fn sides(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    /// Where inner points lie on the path, in its own sense.
    pub(crate) fn inner(&self, path: &PiecewiseCubic<2>) -> Vec<Point2> {
        let inner = self.0.get(1..self.sides()).unwrap_or(&[]);
        inner.iter().map(|&t| path.evaluate(t)).collect()
    }

    /// Halves some sides, by their numbers in ascending order; false where none could be.
    pub(crate) fn halve(&mut self, sides: &[usize]) -> bool {
        let before = self.0.len();
        for &side in sides.iter().rev() {
            let (Some(&a), Some(&b)) = (self.0.get(side), self.0.get(side + 1)) else {
                continue;
            };
            let middle = a + (b - a) / 2.0;
            if a < middle && middle < b {
                self.0.insert(side + 1, middle);
            }
        }
        self.0.len() > before
    }
}

struct Strand<'a> {
    path: &'a PiecewiseCubic<2>,
    surfaces: &'a [&'a PatchSurface],
    settings: &'a TessellateSettings,
}

impl Strand<'_> {
    /// The path turns at the beginning of a piece.
    fn has_kink(&self, piece: usize) -> bool {
        let width = self.path.breaks[piece] - self.path.breaks[piece - 1];
        let (a, b) = (
            self.path.piece_value(piece - 1, width, 1),
            self.path.piece_value(piece, 0.0, 1),
        );
        angle([a[0], a[1], 0.0], [b[0], b[1], 0.0]) > KINK_RAD
    }

    /// Adds the points of a stretch behind its beginning.
    fn follow(&self, parameters: &mut Vec<f64>, (from, to): (f64, f64), depth: usize) {
        let middle = from + (to - from) / 2.0;
        let is_fine = depth == 0 || !(from < middle && middle < to);
        if is_fine || self.surfaces.iter().all(|s| self.is_straight(s, from, to)) {
            parameters.push(to);
            return;
        }
        self.follow(parameters, (from, middle), depth - 1);
        self.follow(parameters, (middle, to), depth - 1);
    }

    /// One side will do for this stretch of the path on a surface.
    fn is_straight(&self, surface: &PatchSurface, from: f64, to: f64) -> bool {
        let at = |t: f64| {
            let [x, y] = self.path.evaluate(t);
            surface.evaluate(x, y)
        };
        let (start, end) = (at(from), at(to));
        let most_mm = EDGE_PART * self.settings.tolerance_mm;
        let places = self.places(from, to);
        let places: Vec<Point3> = places.into_iter().map(at).collect();
        let length = distance(start, end);
        let is_near = |p: &Point3| {
            off_line(*p, start, end) <= most_mm
                && length * length * bend(surface, *p)
                    <= LONGEST * LONGEST * 8.0 * self.settings.tolerance_mm
        };
        if !places.iter().all(is_near) {
            return false;
        }
        // Over the first and last of its steps the curve hardly turns.
        let small = length <= TessellateSettings::SMALL * self.settings.tolerance_mm;
        let (Some(second), Some(last)) = (places.first(), places.last()) else {
            return true;
        };
        let step = |a: Point3, b: Point3| core::array::from_fn(|d| b[d] - a[d]);
        small || angle(step(start, *second), step(*last, end)) <= self.settings.angle_rad
    }

    /// Parameters inside of a stretch, as many as each of its pieces needs.
    fn places(&self, from: f64, to: f64) -> Vec<f64> {
        let breaks = &self.path.breaks;
        let last = self.path.pieces.len() - 1;
        let piece = |t: f64| breaks.partition_point(|b| *b <= t).saturating_sub(1);
        let (first, last) = (piece(from), piece(to).min(last));
        let mut places = Vec::new();
        for pair in breaks.windows(2).take(last + 1).skip(first) {
            let (a, b) = (pair[0].max(from), pair[1].min(to));
            places.extend((0..PROBES).map(|n| a + (b - a) * n as f64 / PROBES as f64));
        }
        places.retain(|t| from < *t && *t < to);
        places
    }
}

/// The greater of a surface's two curvatures, 1/mm. A chord of length l lies l2 / 8 times as much
/// off an arc.
fn bend(surface: &PatchSurface, [x, y, _]: Point3) -> f64 {
    let d = |i: usize, j: usize| surface.z_partial(x, y, i, j);
    let (p, q) = (d(1, 0), d(0, 1));
    let (r, s, t) = (d(2, 0), d(1, 1), d(0, 2));
    let w2 = 1.0 + p * p + q * q;
    let gauss = (r * t - s * s) / (w2 * w2);
    let mean = ((1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t) / (2.0 * w2 * w2.sqrt());
    mean.abs() + (mean * mean - gauss).max(0.0).sqrt()
}

/// Angle between two vectors, radians; 0 where one is none.
fn angle(a: Point3, b: Point3) -> f64 {
    let lengths = norm(a) * norm(b);
    if lengths <= 0.0 {
        return 0.0;
    }
    libm::acos((dot(a, b) / lengths).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat() -> PatchSurface {
        PatchSurface::through_thirds(vec![-50.0, 50.0], vec![-50.0, 50.0], |_, _| 0.0).unwrap()
    }

    fn circle(radius: f64, pieces: usize) -> PiecewiseCubic<2> {
        let turn = core::f64::consts::TAU / pieces as f64;
        let width = radius * turn;
        let pieces_of: Vec<_> = (0..pieces)
            .map(|k| {
                let at = |third: usize| {
                    let (sin, cos) = libm::sincos(turn * (k as f64 + third as f64 / 3.0));
                    [radius * cos, radius * sin]
                };
                let points = [at(0), at(1), at(2), at(3)];
                let piece = PiecewiseCubic::through_thirds(0.0, width, &points).unwrap();
                piece.pieces[0]
            })
            .collect();
        let breaks = (0..=pieces).map(|k| width * k as f64).collect();
        PiecewiseCubic::new(breaks, pieces_of).unwrap()
    }

    #[test]
    fn a_straight_path_of_many_pieces_is_one_side() {
        let line = |x: f64| [[x, 1.0, 0.0, 0.0], [0.5 * x, 0.5, 0.0, 0.0]];
        let breaks = vec![0.0, 1.0, 4.0, 9.0];
        let path = PiecewiseCubic::new(breaks, vec![line(0.0), line(1.0), line(4.0)]).unwrap();
        let division = Division::of(&path, &[&flat()], &TessellateSettings::default());
        assert_eq!(division, Division(vec![0.0, 9.0]));
    }

    #[test]
    fn a_circle_keeps_the_tolerance_with_few_sides() {
        let path = circle(20.0, 16);
        for tolerance_mm in [0.1, 0.01, 0.001] {
            let settings = TessellateSettings {
                tolerance_mm,
                ..TessellateSettings::default()
            };
            let division = Division::of(&path, &[&flat()], &settings);
            // The sagitta of a side of angle a is r (1 - cos a / 2).
            let angle = 2.0 * libm::acos(1.0 - EDGE_PART * tolerance_mm / 20.0);
            let least = core::f64::consts::TAU / angle.min(settings.angle_rad);
            let sides = division.sides() as f64;
            assert!(
                sides >= least && sides <= 2.0 * least + 1.0,
                "{sides} {least}"
            );
        }
    }

    #[test]
    fn small_circles_are_divided_for_their_angle() {
        let settings = TessellateSettings::default();
        let sides = Division::of(&circle(0.5, 8), &[&flat()], &settings).sides();
        assert!((24..=48).contains(&sides), "{sides}");
    }

    #[test]
    fn kinks_are_kept() {
        let corner = vec![
            [[0.0, 1.0, 0.0, 0.0], [0.0; 4]],
            [[3.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]],
        ];
        let path = PiecewiseCubic::new(vec![0.0, 3.0, 10.0], corner).unwrap();
        let division = Division::of(&path, &[&flat()], &TessellateSettings::default());
        assert_eq!(division, Division(vec![0.0, 3.0, 10.0]));
    }

    #[test]
    fn the_surface_divides_where_the_path_does_not() {
        let bent = PatchSurface::through_thirds(vec![0.0, 30.0], vec![-1.0, 1.0], |i, _| {
            0.01 * (10 * i) as f64 * (10 * i) as f64
        })
        .unwrap();
        let path = PiecewiseCubic::line([0.0, 0.0], [30.0, 0.0], 30.0).unwrap();
        let settings = TessellateSettings::default();
        let sides = Division::of(&path, &[&flat(), &bent], &settings).sides();
        assert!(sides >= 16, "{sides}");
        assert_eq!(Division::of(&path, &[&flat()], &settings).sides(), 1);
    }

    #[test]
    fn straight_sides_of_bent_surfaces_are_not_endless() {
        // A cylinder of 20 mm about y, near its top and on its flank.
        let cylinder = PatchSurface::through_thirds(
            (0..=36).map(|k| 0.5 * f64::from(k)).collect(),
            vec![-50.0, 50.0],
            |i, _| (400.0 - (i as f64 / 6.0) * (i as f64 / 6.0)).sqrt(),
        )
        .unwrap();
        for x in [1.0, 16.0] {
            let at = [x, 0.0, 0.0];
            assert!(
                (bend(&cylinder, at) - 0.05).abs() < 1e-3,
                "{}",
                bend(&cylinder, at)
            );
            let path = PiecewiseCubic::line([x, -50.0], [x, 50.0], 100.0).unwrap();
            let settings = TessellateSettings::default();
            let sides = Division::of(&path, &[&cylinder], &settings).sides();
            // Six times the root of 8 * 0.01 / 0.05, so at least 13.2.
            assert_eq!(sides, 16);
        }
        let saddle = PatchSurface::through_thirds(vec![-3.0, 3.0], vec![-3.0, 3.0], |i, j| {
            0.1 * (2.0 * i as f64 - 3.0) * (2.0 * j as f64 - 3.0)
        });
        assert!((bend(&saddle.unwrap(), [0.0; 3]) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn sides_are_halved() {
        let mut division = Division(vec![0.0, 1.0, 2.0, 4.0]);
        assert!(division.halve(&[0, 2]));
        assert_eq!(division.0, [0.0, 0.5, 1.0, 2.0, 3.0, 4.0]);
        assert!(!division.halve(&[9]));
    }
}
