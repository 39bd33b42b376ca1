//! Points added inside of a face where its triangles lie too far off, or are too slim.

use std::collections::{BTreeSet, VecDeque};

use nurbs::PatchSurface;
use range_image::{Cancelled, Monitor};

use crate::net::{NONE, Net, Walk};
use crate::settings::TessellateSettings;
use crate::vector::{Point3, between, cross, distance, dot, least_angle, minus};

/// Most triangles of one face.
pub(crate) const MOST: usize = 2_000_000;

/// Triangles with a lesser angle, about 20 degrees, are divided where that helps: as low as
/// division by centres of circles is known to come to an end.
const SLIM_RAD: f64 = 0.35;

/// A triangle whose sides are all shorter than this many tolerances is left as it is: what is
/// rougher than that has no surface to come near to.
const LEAST_SIDE: f64 = 2.0;

/// How near to the border, in radii of the triangle's circle, its centre may be added.
const CLEAR: f64 = 0.35;

/// A point that is added for the sake of shape sees no side of the border at a wider angle than
/// 135 degrees, whose cosine this is but for the sign.
const WIDEST_COS: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// Triangles between two questions of whether to go on.
const PATIENCE: usize = 4096;

/// Shares of the three corners at the places of a triangle that are looked at.
const PLACES: [[f64; 3]; 7] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// What ends the work on a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stop {
    Cancelled,
    TooMany,
}

impl From<Cancelled> for Stop {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// The triangles of one face.
pub(crate) struct Patch<'a> {
    pub(crate) net: Net,
    /// Unit normals of the surface at the points.
    pub(crate) normals: Vec<Point3>,
    /// How far points lie over the surface, along z: those of seams do.
    lifts: Vec<f64>,
    surface: &'a PatchSurface,
    settings: &'a TessellateSettings,
}

/// What a triangle lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lack {
    /// It lies too far off the surface, or that turns too much in it.
    Nearness,
    /// It is slim.
    Shape,
}

impl<'a> Patch<'a> {
    /// Of points of the border, and triangles between them.
    pub(crate) fn new(
        points: Vec<Point3>,
        triangles: Vec<[u32; 3]>,
        border: &BTreeSet<[u32; 2]>,
        surface: &'a PatchSurface,
        settings: &'a TessellateSettings,
    ) -> Self {
        let normals = points.iter().map(|p| surface.normal(p[0], p[1])).collect();
        let lifts = points
            .iter()
            .map(|p| p[2] - surface.z(p[0], p[1]))
            .collect();
        Self {
            net: Net::new(points, triangles, border),
            normals,
            lifts,
            surface,
            settings,
        }
    }

    /// Adds points until every triangle keeps the tolerance and none is slim that need not be.
    pub(crate) fn refine(&mut self, monitor: &dyn Monitor) -> Result<(), Stop> {
        let all: Vec<usize> = (0..self.net.triangles.len()).collect();
        self.net.settle(&all);
        let mut waiting: VecDeque<usize> = all.into();
        let mut seen = 0_usize;
        while let Some(t) = waiting.pop_front() {
            seen += 1;
            if seen.is_multiple_of(PATIENCE) {
                monitor.check()?;
            }
            let Some(lack) = self.lack(t) else {
                continue;
            };
            let Some(made) = self.divide(t, lack) else {
                continue;
            };
            if self.net.triangles.len() > MOST {
                return Err(Stop::TooMany);
            }
            waiting.extend(self.net.settle(&made));
        }
        Ok(())
    }

    /// Farthest that a triangle lies off the surface.
    pub(crate) fn deviation_mm(&self) -> f64 {
        let all = 0..self.net.triangles.len();
        all.map(|t| self.off_mm(t)).fold(0.0, f64::max)
    }

    /// How far a triangle lies off the surface between its corners.
    fn off_mm(&self, t: usize) -> f64 {
        let corners = self.net.corners(t);
        let lifts = self.net.triangles[t].map(|p| self.lifts[p as usize]);
        let mut farthest = 0.0_f64;
        for shares in PLACES {
            let mut place = [0.0; 3];
            for (corner, (share, lift)) in corners.iter().zip(shares.iter().zip(lifts)) {
                place[0] += share * corner[0];
                place[1] += share * corner[1];
                place[2] += share * (corner[2] - lift);
            }
            let [x, y, z] = place;
            let off = (self.surface.z(x, y) - z).abs();
            if off > farthest {
                farthest = farthest.max(off * self.surface.normal(x, y)[2]);
            }
        }
        farthest
    }

    fn lack(&self, t: usize) -> Option<Lack> {
        let corners = self.net.corners(t);
        let longest = (0..3)
            .map(|k| distance(corners[k], corners[(k + 1) % 3]))
            .fold(0.0, f64::max);
        let tolerance_mm = self.settings.tolerance_mm;
        if longest < LEAST_SIDE * tolerance_mm {
            return None;
        }
        if self.off_mm(t) > tolerance_mm {
            return Some(Lack::Nearness);
        }
        if longest > TessellateSettings::SMALL * tolerance_mm {
            let normals = self.net.triangles[t].map(|p| self.normals[p as usize]);
            let least = libm::cos(self.settings.angle_rad);
            let turns = |k: usize| dot(normals[k], normals[(k + 1) % 3]) < least;
            if (0..3).any(turns) {
                return Some(Lack::Nearness);
            }
        }
        let (angle, corner) = least_angle(corners);
        // An angle of the border itself stays.
        let of_border = |k: usize| self.net.beyond[t][(corner + k) % 3] == NONE;
        (angle < SLIM_RAD && !(of_border(1) && of_border(2))).then_some(Lack::Shape)
    }

    /// Adds a point for a triangle; nothing where none helps.
    fn divide(&mut self, t: usize, lack: Lack) -> Option<Vec<usize>> {
        let centre = circle(self.net.corners(t));
        let mut made = centre.and_then(|(place, radius)| self.add(t, place, radius, lack));
        if made.is_none() {
            made = match lack {
                Lack::Nearness => self.add_by_halving(t),
                Lack::Shape => self.add_on_longest(t),
            };
        }
        let point = self.net.points.last().copied()?;
        if made.is_some() {
            self.normals.push(self.surface.normal(point[0], point[1]));
            self.lifts.push(0.0);
        }
        made
    }

    /// Adds the centre of the triangle's circle, where that lies inside, and clear of the border.
    fn add(&mut self, t: usize, [x, y, _]: Point3, radius: f64, lack: Lack) -> Option<Vec<usize>> {
        let Walk::In(at) = self.net.walk(t, [x, y]) else {
            return None;
        };
        let place = self.surface.evaluate(x, y);
        let corners = self.net.corners(at);
        // No nearer to other points than those of a good triangle are to each other.
        let mut sides = (0..3).map(|k| {
            let corners = self.net.corners(t);
            distance(corners[k], corners[(k + 1) % 3])
        });
        let shortest = sides.next()?.min(sides.next()?).min(sides.next()?);
        if corners.iter().any(|c| distance(*c, place) < 0.9 * shortest) {
            return None;
        }
        let mut near = vec![at];
        near.extend(
            self.net.beyond[at]
                .iter()
                .filter(|u| **u != NONE)
                .map(|u| *u as usize),
        );
        for u in near {
            let corners = self.net.corners(u);
            for k in 0..3 {
                if self.net.beyond[u][k] != NONE {
                    continue;
                }
                let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
                let is_near = match lack {
                    // So near to a long side it would make a triangle that is slim in turn.
                    Lack::Shape => {
                        let (u, v) = (minus(a, place), minus(b, place));
                        dot(u, v) < -WIDEST_COS * (dot(u, u) * dot(v, v)).sqrt()
                    }
                    Lack::Nearness => crate::vector::off_line(place, a, b) < CLEAR * radius,
                };
                if is_near {
                    return None;
                }
            }
        }
        self.net.insert(at, place)
    }

    /// Adds the middle of the longest side, if that brings no two points nearer than they are.
    fn add_on_longest(&mut self, t: usize) -> Option<Vec<usize>> {
        let corners = self.net.corners(t);
        let length = |k: usize| distance(corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let longest = (0..3).max_by(|&k, &n| length(k).total_cmp(&length(n)))?;
        let shortest = length(0).min(length(1)).min(length(2));
        let (a, b) = (corners[(longest + 1) % 3], corners[(longest + 2) % 3]);
        let [x, y, _] = between(a, b, 0.5);
        let place = self.surface.evaluate(x, y);
        let across = self.net.beyond[t][longest];
        if across == NONE {
            return None;
        }
        let around = corners.into_iter().chain(self.net.corners(across as usize));
        let nearest = around
            .map(|p| distance(p, place))
            .fold(f64::INFINITY, f64::min);
        if nearest < shortest {
            return None;
        }
        self.net.insert_on_side(t, longest, place)
    }

    /// Adds the middle of the longest side, or that of the triangle where this is of the border.
    fn add_by_halving(&mut self, t: usize) -> Option<Vec<usize>> {
        let corners = self.net.corners(t);
        let length = |k: usize| distance(corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let longest = (0..3).max_by(|&k, &n| length(k).total_cmp(&length(n)))?;
        if self.net.beyond[t][longest] != NONE {
            let (a, b) = (corners[(longest + 1) % 3], corners[(longest + 2) % 3]);
            let [x, y, _] = between(a, b, 0.5);
            let place = self.surface.evaluate(x, y);
            if let Some(made) = self.net.insert_on_side(t, longest, place) {
                return Some(made);
            }
        }
        let middle = |d: usize| (corners[0][d] + corners[1][d] + corners[2][d]) / 3.0;
        let place = self.surface.evaluate(middle(0), middle(1));
        self.net.insert(t, place)
    }
}

/// The centre of the circle through three points of space, and its radius.
fn circle([a, b, c]: [Point3; 3]) -> Option<(Point3, f64)> {
    let (u, v) = (minus(b, a), minus(c, a));
    let normal = cross(u, v);
    let twice = 2.0 * dot(normal, normal);
    if twice <= 0.0 {
        return None;
    }
    let (uu, vv) = (dot(u, u), dot(v, v));
    let (p, q) = (cross(v, normal), cross(normal, u));
    let out: Point3 = core::array::from_fn(|d| (uu * p[d] + vv * q[d]) / twice);
    let centre = core::array::from_fn(|d| a[d] + out[d]);
    Some((centre, dot(out, out).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centre_of_a_circle_is_as_far_from_all_three() {
        let corners = [[1.0, 2.0, 0.5], [4.0, 0.0, 1.0], [2.0, 5.0, -3.0]];
        let (centre, radius) = circle(corners).unwrap();
        for corner in corners {
            assert!((distance(centre, corner) - radius).abs() < 1e-12);
        }
        // In their plane.
        let normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
        assert!(dot(minus(centre, corners[0]), normal).abs() < 1e-9);
        let line = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
        assert_eq!(circle(line), None);
    }
}
