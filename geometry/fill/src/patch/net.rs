//! Triangles that are still being made.

use std::collections::HashSet;

use glam::DVec3;

use crate::mesh::{Edges, NONE, ends};

/// Triangles over the vertices of a hole's border, which come first and stay, and new ones.
#[derive(Debug, Clone)]
pub(crate) struct Net {
    pub(crate) places: Vec<DVec3>,
    /// Wanted length of edges at each vertex.
    pub(crate) sizes: Vec<f64>,
    /// Unit normal of the surface at each vertex; zero where it is not known.
    pub(crate) normals: Vec<DVec3>,
    /// Vertices of the border.
    pub(crate) fixed: usize,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// An edge is split where it is longer than this, of what is wanted, and collapsed where shorter.
const LONG: f64 = 4.0 / 3.0;
const SHORT: f64 = 0.55;
/// Passes of flips.
const MOST_FLIPS: usize = 12;

/// Twice the area of a triangle that has none, of its longest side's square.
const SLIVER: f64 = 1e-4;

type Edge = (u32, u32);

/// A place on the surface, and the unit normal there.
pub(crate) type Placed = (DVec3, DVec3);

fn sorted(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

impl Net {
    pub(crate) fn doubled_area(&self, [a, b, c]: [u32; 3]) -> DVec3 {
        let [a, b, c] = [a, b, c].map(|v| self.places[v as usize]);
        (b - a).cross(c - a)
    }

    /// The side across each side, [`NONE`] at the border.
    pub(crate) fn opposite(&self) -> Vec<u32> {
        Edges::of(&self.triangles).opposite()
    }

    fn edges(&self) -> HashSet<Edge> {
        let sides = self.triangles.iter();
        sides
            .flat_map(|&[a, b, c]| [sorted(a, b), sorted(b, c), sorted(c, a)])
            .collect()
    }

    /// Whether every edge has two triangles, or is one of the border and has one.
    pub(crate) fn is_manifold(&self) -> bool {
        let edges = Edges::of(&self.triangles);
        let fixed = self.fixed as u32;
        edges.groups().all(|group| match group {
            [own] => own.0 < fixed && own.1 < fixed,
            [a, b] => (a.2 >> 31) != (b.2 >> 31),
            _ => false,
        })
    }

    /// Whether a triangle does not look the way that a normal does, or has no area.
    pub(crate) fn faces_away(&self, triangle: [u32; 3], normal: DVec3) -> bool {
        let [a, b, c] = triangle.map(|v| self.places[v as usize]);
        let longest = a
            .distance_squared(b)
            .max(b.distance_squared(c))
            .max(c.distance_squared(a));
        let length = normal.length();
        length > 0.0 && self.doubled_area(triangle).dot(normal) <= SLIVER * longest * length
    }

    /// The surface's normal at a triangle; its own where that is not known.
    pub(crate) fn normal_at(&self, triangle: [u32; 3]) -> DVec3 {
        let sum: DVec3 = triangle.map(|v| self.normals[v as usize]).into_iter().sum();
        if sum == DVec3::ZERO {
            self.doubled_area(triangle)
        } else {
            sum
        }
    }

    /// Triangles that do not look the way that the surface does.
    pub(crate) fn folds(&self) -> Vec<usize> {
        let is_folded = |t: &usize| {
            let own = self.triangles[*t];
            self.faces_away(own, self.normal_at(own))
        };
        (0..self.triangles.len()).filter(is_folded).collect()
    }

    fn ratio(&self, a: u32, b: u32) -> f64 {
        let wanted = 0.5 * (self.sizes[a as usize] + self.sizes[b as usize]);
        self.places[a as usize].distance(self.places[b as usize]) / wanted
    }

    /// Splits inner edges that are too long, longest first, none twice beside another; how many.
    /// `place` puts the middle of an edge where the surface is.
    pub(crate) fn split(&mut self, place: &(impl Fn(DVec3, f64) -> Placed + Sync)) -> usize {
        use rayon::prelude::*;
        let opposite = self.opposite();
        let mut long: Vec<(f64, u32)> = (0..opposite.len() as u32)
            .filter(|&side| opposite[side as usize] != NONE && side < opposite[side as usize])
            .map(|side| {
                let (a, b) = ends(&self.triangles, side);
                (self.ratio(a, b), side)
            })
            .filter(|own| own.0 > LONG)
            .collect();
        long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut is_touched = vec![false; self.triangles.len()];
        long.retain(|&(_, side)| {
            let pair = [side, opposite[side as usize]].map(|s| s as usize / 3);
            let is_free = pair.iter().all(|&t| !is_touched[t]);
            if is_free {
                pair.iter().for_each(|&t| is_touched[t] = true);
            }
            is_free
        });
        let middle = |&(_, side): &(f64, u32)| {
            let (a, b) = ends(&self.triangles, side);
            let (p, q) = (self.places[a as usize], self.places[b as usize]);
            place(0.5 * (p + q), p.distance(q))
        };
        let middles: Vec<Placed> = long.par_iter().with_min_len(8).map(middle).collect();
        for (&(_, side), (at, normal)) in long.iter().zip(middles) {
            let across = opposite[side as usize];
            let (a, b) = ends(&self.triangles, side);
            let corner = |s: u32| self.triangles[s as usize / 3][(s as usize % 3 + 2) % 3];
            let (c, d) = (corner(side), corner(across));
            let m = self.places.len() as u32;
            self.places.push(at);
            self.normals.push(normal);
            self.sizes
                .push(0.5 * (self.sizes[a as usize] + self.sizes[b as usize]));
            self.triangles[side as usize / 3] = [a, m, c];
            self.triangles[across as usize / 3] = [b, m, d];
            self.triangles.push([m, b, c]);
            self.triangles.push([m, a, d]);
        }
        long.len()
    }

    /// Flips inner edges until none would make two triangles rounder; `is_forbidden` says between which
    /// vertices of the border there must be no edge.
    pub(crate) fn flip(&mut self, is_forbidden: &impl Fn(u32, u32) -> bool) {
        let mut edges = self.edges();
        for _ in 0..MOST_FLIPS {
            let opposite = self.opposite();
            let mut is_touched = vec![false; self.triangles.len()];
            let mut flipped = 0;
            for side in 0..opposite.len() as u32 {
                let across = opposite[side as usize];
                if across == NONE || across < side {
                    continue;
                }
                let (own, other) = (side as usize / 3, across as usize / 3);
                if is_touched[own] || is_touched[other] {
                    continue;
                }
                let (a, b) = ends(&self.triangles, side);
                let c = self.triangles[own][(side as usize % 3 + 2) % 3];
                let d = self.triangles[other][(across as usize % 3 + 2) % 3];
                if c == d || edges.contains(&sorted(c, d)) || !self.is_better(a, b, c, d) {
                    continue;
                }
                let both_fixed = (c as usize) < self.fixed && (d as usize) < self.fixed;
                if both_fixed && is_forbidden(c, d) {
                    continue;
                }
                self.triangles[own] = [a, d, c];
                self.triangles[other] = [d, b, c];
                is_touched[own] = true;
                is_touched[other] = true;
                edges.remove(&sorted(a, b));
                edges.insert(sorted(c, d));
                flipped += 1;
            }
            if flipped == 0 {
                return;
            }
        }
    }

    /// Whether an edge c-d is better than a-b between triangles abc and bad.
    fn is_better(&self, a: u32, b: u32, c: u32, d: u32) -> bool {
        let sum: DVec3 = [a, b, c, d]
            .map(|v| self.normals[v as usize])
            .into_iter()
            .sum();
        let old = [[a, b, c], [b, a, d]];
        let normal = if sum == DVec3::ZERO {
            old.map(|t| self.doubled_area(t)).into_iter().sum()
        } else {
            sum
        };
        let folded = |pair: [[u32; 3]; 2]| {
            let own = pair.into_iter().filter(|&t| self.faces_away(t, normal));
            own.count()
        };
        let (before, after) = (folded(old), folded([[a, d, c], [d, b, c]]));
        if before != after {
            return after < before;
        }
        if after > 0 {
            return false;
        }
        let at = |v: u32| self.places[v as usize];
        let angle = |apex: u32| {
            let (u, v) = (at(a) - at(apex), at(b) - at(apex));
            libm::atan2(u.cross(v).length(), u.dot(v))
        };
        angle(c) + angle(d) > std::f64::consts::PI + 1e-6
    }

    /// Collapses short inner edges onto one of their ends where no neighbour folds; how many.
    pub(crate) fn collapse(&mut self, is_forbidden: &impl Fn(u32, u32) -> bool) -> usize {
        let fixed = self.fixed as u32;
        let stars = self.stars();
        let mut short: Vec<(f64, u32, u32)> = Vec::new();
        for &[a, b, c] in &self.triangles {
            for (u, v) in [(a, b), (b, c), (c, a)] {
                // Each once, from the new vertex of the two.
                let (u, v) = (u.max(v), u.min(v));
                let ratio = self.ratio(u, v);
                if u >= fixed && ratio < SHORT {
                    short.push((ratio, u, v));
                }
            }
        }
        short.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        short.dedup();
        let mut is_touched = vec![false; self.places.len()];
        let mut target: Vec<u32> = (0..self.places.len() as u32).collect();
        let mut count = 0;
        for (_, u, v) in short {
            let around = |w: u32| -> HashSet<u32> {
                let own = stars[w as usize].iter();
                own.flat_map(|&t| self.triangles[t as usize])
                    .filter(|&x| x != w)
                    .collect()
            };
            let (of_u, of_v) = (around(u), around(v));
            let is_free = |w: &u32| !is_touched[*w as usize];
            if !(is_free(&u) && is_free(&v) && of_u.iter().all(is_free)) {
                continue;
            }
            let joins = |w: &&u32| **w != v && v < fixed && **w < fixed && is_forbidden(v, **w);
            if of_u.intersection(&of_v).count() != 2 || of_u.iter().any(|w| joins(&w)) {
                continue;
            }
            let moved = |w: u32| if w == u { v } else { w };
            let holds = stars[u as usize].iter().all(|&t| {
                let own = self.triangles[t as usize];
                let new = own.map(moved);
                let is_gone = new[0] == new[1] || new[1] == new[2] || new[2] == new[0];
                let (before, after) = (self.doubled_area(own), self.doubled_area(new));
                let turns = after.dot(before) <= 0.5 * after.length() * before.length();
                is_gone || !(turns || self.faces_away(new, self.normal_at(new)))
            });
            let too_long = of_u.iter().any(|&w| w != v && self.ratio(v, w) > LONG);
            if !holds || too_long {
                continue;
            }
            target[u as usize] = v;
            for &w in of_u.iter().chain(&of_v) {
                is_touched[w as usize] = true;
            }
            is_touched[u as usize] = true;
            is_touched[v as usize] = true;
            count += 1;
        }
        if count > 0 {
            for corner in self.triangles.as_flattened_mut() {
                *corner = target[*corner as usize];
            }
            self.triangles
                .retain(|&[a, b, c]| a != b && b != c && c != a);
            self.compact();
        }
        count
    }

    /// Leaves out new vertices that no triangle has.
    pub(crate) fn compact(&mut self) {
        let mut is_used = vec![false; self.places.len()];
        is_used[..self.fixed].fill(true);
        for &corner in self.triangles.as_flattened() {
            is_used[corner as usize] = true;
        }
        let mut new_of = vec![0_u32; self.places.len()];
        let mut count = 0;
        for v in 0..self.places.len() {
            if is_used[v] {
                new_of[v] = count as u32;
                self.places[count] = self.places[v];
                self.sizes[count] = self.sizes[v];
                self.normals[count] = self.normals[v];
                count += 1;
            }
        }
        self.places.truncate(count);
        self.sizes.truncate(count);
        self.normals.truncate(count);
        for corner in self.triangles.as_flattened_mut() {
            *corner = new_of[*corner as usize];
        }
    }

    /// Triangles by vertex.
    pub(crate) fn stars(&self) -> Vec<Vec<u32>> {
        let mut stars = vec![Vec::new(); self.places.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            for &v in triangle {
                stars[v as usize].push(t as u32);
            }
        }
        stars
    }
}
