//! Triangles that know their neighbours: sides flipped, triangles and sides divided.

use std::collections::{BTreeMap, BTreeSet};

use crate::vector::{Point3, least_angle, turn};

/// In the place of a neighbour where there is none.
pub(crate) const NONE: u32 = u32::MAX;

/// Triangles made here are at least this high in the x-y plane, millimetres: single precision,
/// which most formats keep, must not turn them over.
const LEAST_HEIGHT_MM: f64 = 1e-4;

/// A flip must widen the least angle by this, radians, so that flips come to an end.
const LEAST_GAIN_RAD: f64 = 1e-6;

/// Most triangles gone through on the way to a place. Where no other point lies in a triangle's
/// circle there are few on the way to its centre; where many do, a point there helps nobody.
const FARTHEST: usize = 200;

/// Triangles of points in space, none of them turned over in the x-y plane.
///
/// Side `k` of a triangle lies across from its corner `k`.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Net {
    pub(crate) points: Vec<Point3>,
    /// Indices of points, counter-clockwise.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The triangle behind each side; [`NONE`] behind a side of the border.
    pub(crate) beyond: Vec<[u32; 3]>,
}

/// Where a walk ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Walk {
    /// In this triangle.
    In(usize),
    /// At a side of the border, or too far away.
    Blocked,
}

impl Net {
    /// `border` has the sides that are never flipped or divided, the lesser point first.
    pub(crate) fn new(
        points: Vec<Point3>,
        triangles: Vec<[u32; 3]>,
        border: &BTreeSet<[u32; 2]>,
    ) -> Self {
        let mut beyond = vec![[NONE; 3]; triangles.len()];
        let mut open: BTreeMap<[u32; 2], (usize, usize)> = BTreeMap::new();
        for (t, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
                let key = [a.min(b), a.max(b)];
                if border.contains(&key) {
                    continue;
                }
                match open.remove(&key) {
                    Some((u, j)) => {
                        beyond[t][k] = u as u32;
                        beyond[u][j] = t as u32;
                    }
                    None => {
                        open.insert(key, (t, k));
                    }
                }
            }
        }
        Self {
            points,
            triangles,
            beyond,
        }
    }

    pub(crate) fn corners(&self, t: usize) -> [Point3; 3] {
        self.triangles[t].map(|p| self.points[p as usize])
    }

    fn flat(&self, point: u32) -> [f64; 2] {
        let [x, y, _] = self.points[point as usize];
        [x, y]
    }

    /// Height of a triangle of these points over its longest side in the plane; negative where
    /// they turn clockwise.
    fn height(&self, a: u32, b: u32, c: u32) -> f64 {
        let [a, b, c] = [a, b, c].map(|p| self.flat(p));
        let length = |p: [f64; 2], q: [f64; 2]| {
            ((q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1])).sqrt()
        };
        let longest = length(a, b).max(length(b, c)).max(length(c, a));
        if longest > 0.0 {
            turn(a, b, c) / longest
        } else {
            0.0
        }
    }

    fn angle(&self, a: u32, b: u32, c: u32) -> f64 {
        least_angle([a, b, c].map(|p| self.points[p as usize])).0
    }

    /// The triangle behind a side, and which of its corners lies across.
    fn across(&self, t: usize, k: usize) -> Option<(usize, usize)> {
        let u = self.beyond[t][k];
        if u == NONE {
            return None;
        }
        let u = u as usize;
        let ends = [
            self.triangles[t][(k + 1) % 3],
            self.triangles[t][(k + 2) % 3],
        ];
        let j = (0..3).find(|&j| !ends.contains(&self.triangles[u][j]))?;
        Some((u, j))
    }

    fn relink(&mut self, t: u32, from: usize, to: usize) {
        if t == NONE {
            return;
        }
        for side in &mut self.beyond[t as usize] {
            if *side == from as u32 {
                *side = to as u32;
                return;
            }
        }
    }

    /// Flips the side where that widens the least angle, in space, of the triangles on it; gives
    /// both.
    fn flip(&mut self, t: usize, i: usize) -> Option<[usize; 2]> {
        let (u, j) = self.across(t, i)?;
        let [a, b, c] = [0, 1, 2].map(|n| self.triangles[t][(i + n) % 3]);
        let d = self.triangles[u][j];
        let least = self.height(a, b, d).min(self.height(a, d, c));
        if least <= LEAST_HEIGHT_MM && least <= self.height(a, b, c).min(self.height(d, c, b)) {
            return None;
        }
        if least <= 0.0 {
            return None;
        }
        let before = self.angle(a, b, c).min(self.angle(d, c, b));
        let after = self.angle(a, b, d).min(self.angle(a, d, c));
        if after.is_nan() || after <= before + LEAST_GAIN_RAD {
            return None;
        }
        let [to_ca, to_ab] = [1, 2].map(|n| self.beyond[t][(i + n) % 3]);
        let [to_bd, to_dc] = [1, 2].map(|n| self.beyond[u][(j + n) % 3]);
        self.triangles[t] = [a, b, d];
        self.beyond[t] = [to_bd, u as u32, to_ab];
        self.triangles[u] = [a, d, c];
        self.beyond[u] = [to_dc, to_ca, t as u32];
        self.relink(to_bd, u, t);
        self.relink(to_ca, t, u);
        Some([t, u])
    }

    /// Flips sides, those of these triangles first, until none is better flipped; gives all
    /// triangles that were touched.
    pub(crate) fn settle(&mut self, triangles: &[usize]) -> Vec<usize> {
        let mut touched = triangles.to_vec();
        let mut waiting: Vec<usize> = triangles.iter().rev().copied().collect();
        while let Some(t) = waiting.pop() {
            for k in 0..3 {
                if let Some(flipped) = self.flip(t, k) {
                    waiting.extend(flipped);
                    touched.extend(flipped);
                    break;
                }
            }
        }
        touched.sort_unstable();
        touched.dedup();
        touched
    }

    /// The triangle that has a place of the plane, sought from another.
    pub(crate) fn walk(&self, from: usize, place: [f64; 2]) -> Walk {
        let mut t = from;
        for _ in 0..FARTHEST {
            let triangle = self.triangles[t];
            let turns = [0, 1, 2].map(|k| {
                let [a, b] = [1, 2].map(|n| self.flat(triangle[(k + n) % 3]));
                turn(a, b, place)
            });
            let Some(k) = (0..3)
                .filter(|&k| turns[k] < 0.0)
                .min_by(|&k, &n| turns[k].total_cmp(&turns[n]))
            else {
                return Walk::In(t);
            };
            match self.beyond[t][k] {
                NONE => return Walk::Blocked,
                next => t = next as usize,
            }
        }
        Walk::Blocked
    }

    /// Adds a point inside of a triangle, or on the side of it that is very near; gives the
    /// triangles around it, or nothing where these would be too flat.
    pub(crate) fn insert(&mut self, t: usize, point: Point3) -> Option<Vec<usize>> {
        let p = self.points.len() as u32;
        self.points.push(point);
        let [a, b, c] = self.triangles[t];
        let heights = [
            self.height(b, c, p),
            self.height(c, a, p),
            self.height(a, b, p),
        ];
        let lowest = (0..3).min_by(|&k, &n| heights[k].total_cmp(&heights[n]));
        // Slim triangles beside a side are better made on it.
        let slim = |k: usize| heights[k] < self.height(a, b, c) * 0.02;
        let made = match lowest {
            Some(k) if heights[k] <= LEAST_HEIGHT_MM || slim(k) => self.divide_side(t, k, p),
            Some(_) => Some(self.divide_triangle(t, p)),
            None => None,
        };
        if made.is_none() {
            self.points.pop();
        }
        made
    }

    /// Adds a point on a side that two triangles share; nothing where it is of the border, or the
    /// triangles would be too flat.
    pub(crate) fn insert_on_side(
        &mut self,
        t: usize,
        k: usize,
        point: Point3,
    ) -> Option<Vec<usize>> {
        let p = self.points.len() as u32;
        self.points.push(point);
        let made = self.divide_side(t, k, p);
        if made.is_none() {
            self.points.pop();
        }
        made
    }

    fn divide_triangle(&mut self, t: usize, p: u32) -> Vec<usize> {
        let [a, b, c] = self.triangles[t];
        let [to_bc, to_ca, to_ab] = self.beyond[t];
        let (t1, t2) = (self.triangles.len(), self.triangles.len() + 1);
        let links = |one: usize, other: usize, out: u32| [one as u32, other as u32, out];
        self.triangles[t] = [a, b, p];
        self.beyond[t] = links(t1, t2, to_ab);
        self.triangles.push([b, c, p]);
        self.beyond.push(links(t2, t, to_bc));
        self.triangles.push([c, a, p]);
        self.beyond.push(links(t, t1, to_ca));
        self.relink(to_bc, t, t1);
        self.relink(to_ca, t, t2);
        vec![t, t1, t2]
    }

    fn divide_side(&mut self, t: usize, i: usize, p: u32) -> Option<Vec<usize>> {
        let (u, j) = self.across(t, i)?;
        let [a, b, c] = [0, 1, 2].map(|n| self.triangles[t][(i + n) % 3]);
        let d = self.triangles[u][j];
        let parts = [[a, b, p], [a, p, c], [d, c, p], [d, p, b]];
        let is_flat = |[a, b, c]: &[u32; 3]| self.height(*a, *b, *c) <= LEAST_HEIGHT_MM;
        if parts.iter().any(is_flat) {
            return None;
        }
        let [to_ca, to_ab] = [1, 2].map(|n| self.beyond[t][(i + n) % 3]);
        let [to_bd, to_dc] = [1, 2].map(|n| self.beyond[u][(j + n) % 3]);
        let (t1, u1) = (self.triangles.len(), self.triangles.len() + 1);
        let links = |one: usize, other: usize, out: u32| [one as u32, other as u32, out];
        // Sides across from a, b, p; and so on.
        self.triangles[t] = parts[0];
        self.beyond[t] = links(u1, t1, to_ab);
        self.triangles[u] = parts[2];
        self.beyond[u] = links(t1, u1, to_dc);
        self.triangles.push(parts[1]);
        self.beyond.push([u as u32, to_ca, t as u32]);
        self.triangles.push(parts[3]);
        self.beyond.push([t as u32, to_bd, u as u32]);
        self.relink(to_ca, t, t1);
        self.relink(to_bd, u, u1);
        Some(vec![t, t1, u, u1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles, its border fixed.
    fn square() -> Net {
        let points = vec![
            [0.0, 0.0, 0.0],
            [4.0, 0.0, 0.0],
            [4.0, 4.0, 0.0],
            [0.0, 4.0, 0.0],
        ];
        let border = [[0, 1], [1, 2], [2, 3], [0, 3]].into_iter().collect();
        Net::new(points, vec![[0, 1, 2], [0, 2, 3]], &border)
    }

    /// Neighbours name each other across the same two points, and everything turns left.
    fn check(net: &Net, area: f64) {
        let mut found = 0.0;
        for (t, triangle) in net.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|p| net.flat(p));
            assert!(turn(a, b, c) > 0.0);
            found += turn(a, b, c) / 2.0;
            for k in 0..3 {
                let Some((u, j)) = net.across(t, k) else {
                    continue;
                };
                assert_eq!(net.beyond[u][j], t as u32);
                assert_eq!(triangle[(k + 1) % 3], net.triangles[u][(j + 2) % 3]);
                assert_eq!(triangle[(k + 2) % 3], net.triangles[u][(j + 1) % 3]);
            }
        }
        assert!((found - area).abs() < 1e-12);
    }

    #[test]
    fn triangles_and_sides_are_divided() {
        let mut net = square();
        assert_eq!(net.insert(0, [3.0, 1.0, 0.0]), Some(vec![0, 2, 3]));
        check(&net, 16.0);
        // On the diagonal, in both triangles of it.
        let Walk::In(t) = net.walk(2, [2.0, 2.0]) else {
            panic!("it lies inside");
        };
        assert_eq!(net.insert(t, [2.0, 2.0, 0.0]).unwrap().len(), 4);
        check(&net, 16.0);
        let touched = net.settle(&[0, 1, 2, 3, 4, 5]);
        assert!(touched.len() >= 6);
        check(&net, 16.0);
        assert_eq!(net.walk(0, [5.0, 2.0]), Walk::Blocked);
        // The border stays as it is.
        let before = net.clone();
        assert_eq!(net.insert(net.triangles.len() - 1, [2.0, -1.0, 0.0]), None);
        assert_eq!(net, before);
    }

    #[test]
    fn sides_are_flipped_as_they_are_seen_in_space() {
        // A strip along y on a slope: seen along z the points lie near each other in x.
        let slope = |x: f64, y: f64| [x, y, 8.0 * x];
        let points = vec![
            slope(0.0, 0.0),
            slope(1.0, -1.0),
            slope(2.0, 0.0),
            slope(1.0, 1.0),
        ];
        let border = [[0, 1], [1, 2], [2, 3], [0, 3]].into_iter().collect();
        // In the plane a square; in space far longer along x than along y.
        let mut net = Net::new(points, vec![[0, 1, 2], [0, 2, 3]], &border);
        net.settle(&[0, 1]);
        let diagonal = net
            .triangles
            .iter()
            .all(|t| t.contains(&1) && t.contains(&3));
        assert!(diagonal, "{:?}", net.triangles);
        check(&net, 2.0);
    }
}
