//! A filling that nothing sees whole, as several trimmed surfaces.
//!
//! Its triangles are gathered by the normals of the implicit surface, each with the nearest of a few
//! directions, so that each region is seen whole from its own. Regions share the edges of triangles
//! between them: these are brought onto the surface finely enough that straight lines in the parameter
//! planes on both sides mean the same curves in space.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::base::{Throw, Unseen, base};
use super::trim::{TrimmedPatch, trim};
use crate::implicit::Implicit;

/// Farthest that normals may be from the direction of their region, degrees: the widest first, which
/// makes the fewest regions.
const CONES_DEG: [f64; 4] = [50.0, 38.0, 27.0, 18.0];
/// Rounds in which directions become the means of what is theirs, and teeth are taken off regions.
const ROUNDS: usize = 12;
/// Most regions.
const MOST: usize = 64;
/// Pieces of an edge between regions.
const PIECES: usize = 4;

const NONE: u32 = u32::MAX;

/// Triangles of a filling with their places on an implicit surface.
pub(crate) struct Elements<'a> {
    pub(crate) surface: &'a Implicit,
    pub(crate) places: &'a [DVec3],
    pub(crate) triangles: &'a [[u32; 3]],
}

/// Trimmed surfaces that make a filling together.
pub(crate) fn parts(
    own: &Elements<'_>,
    hole: usize,
    edge_mm: f64,
) -> Result<Vec<TrimmedPatch>, Unseen> {
    let mut trouble = Unseen::Missed;
    for cone_deg in CONES_DEG {
        match own.parted(hole, edge_mm, libm::cos(cone_deg.to_radians())) {
            Ok(found) => return Ok(found),
            Err(other) => trouble = other,
        }
    }
    Err(trouble)
}

impl Elements<'_> {
    fn parted(&self, hole: usize, edge_mm: f64, least: f64) -> Result<Vec<TrimmedPatch>, Unseen> {
        let normals = self.normals();
        let beside = self.beside();
        let mut region = gathered(&normals, least).ok_or(Unseen::Missed)?;
        connect(&mut region, &beside);
        smooth(&mut region, &beside, &normals);
        connect(&mut region, &beside);
        let count = region.iter().max().map_or(0, |most| most + 1);
        let mut found = Vec::new();
        for number in 0..count {
            let normal: DVec3 = normals
                .iter()
                .zip(&region)
                .filter(|(_, own)| **own == number)
                .map(|(normal, _)| *normal)
                .sum();
            let normal = normal.normalize_or_zero();
            let mut rings = self.rings(&region, &beside, number)?;
            // The outer one first: seen from the normal it is the one that runs counter-clockwise.
            let area = |ring: &[DVec3]| -> f64 {
                let first = ring.first().copied().unwrap_or_default();
                let pairs = ring.windows(2);
                pairs
                    .map(|p| (p[0] - first).cross(p[1] - first).dot(normal))
                    .sum()
            };
            rings.sort_by(|a, b| area(b).total_cmp(&area(a)));
            if rings.iter().filter(|own| area(own) > 0.0).count() != 1 {
                return Err(Unseen::Crossed);
            }
            let base = base(self.surface, &rings, normal, edge_mm, Throw::PART)?;
            let patch = trim(&base, &rings)?.patch(hole, &base);
            found.push(patch.ok_or(Unseen::NoElements)?);
        }
        Ok(found)
    }

    /// Normals of the surface at triangles, times their areas.
    fn normals(&self) -> Vec<DVec3> {
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.places[v as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            area * self.surface.at((a + b + c) / 3.0).1.normalize_or_zero()
        };
        self.triangles.iter().map(normal).collect()
    }

    /// The triangle behind each side, from a corner to the next one.
    fn beside(&self) -> Vec<[u32; 3]> {
        let mut of: HashMap<(u32, u32), u32> = HashMap::new();
        for (k, t) in self.triangles.iter().enumerate() {
            for i in 0..3 {
                of.insert((t[i], t[(i + 1) % 3]), k as u32);
            }
        }
        let behind = |t: &[u32; 3]| {
            [0, 1, 2].map(|i| of.get(&(t[(i + 1) % 3], t[i])).copied().unwrap_or(NONE))
        };
        self.triangles.iter().map(behind).collect()
    }

    /// The border of a region as closed rings, with it on their left.
    fn rings(
        &self,
        region: &[u32],
        beside: &[[u32; 3]],
        number: u32,
    ) -> Result<Vec<Vec<DVec3>>, Unseen> {
        // By their first vertices: to where, and whether another region is behind.
        let mut sides: BTreeMap<u32, (u32, bool)> = BTreeMap::new();
        for (k, t) in self.triangles.iter().enumerate() {
            if region[k] != number {
                continue;
            }
            for i in 0..3 {
                let behind = beside[k][i];
                if behind != NONE && region[behind as usize] == number {
                    continue;
                }
                // Rings that touch are none that CAD programs take.
                if sides
                    .insert(t[i], (t[(i + 1) % 3], behind != NONE))
                    .is_some()
                {
                    return Err(Unseen::Crossed);
                }
            }
        }
        let mut rings = Vec::new();
        while let Some((&first, _)) = sides.first_key_value() {
            let mut ring = Vec::new();
            let mut at = first;
            while let Some((next, is_shared)) = sides.remove(&at) {
                ring.push(self.places[at as usize]);
                if is_shared {
                    ring.extend(self.between(at, next));
                }
                at = next;
            }
            rings.push(ring);
        }
        Ok(rings)
    }

    /// Places on the surface along an edge, the same ones from both sides.
    fn between(&self, from: u32, to: u32) -> Vec<DVec3> {
        let (a, b) = (
            self.places[from.min(to) as usize],
            self.places[from.max(to) as usize],
        );
        let on = |k: usize| {
            let at = a.lerp(b, k as f64 / PIECES as f64);
            self.surface.foot(at, a.distance(b)).unwrap_or(at)
        };
        let mut found: Vec<DVec3> = (1..PIECES).map(on).collect();
        if from > to {
            found.reverse();
        }
        found
    }
}

/// The nearest of as few directions as have every normal within an angle of whose cosine this is the
/// least.
fn gathered(normals: &[DVec3], least: f64) -> Option<Vec<u32>> {
    let sum: DVec3 = normals.iter().sum();
    let first = normals.first()?.normalize_or_zero();
    let mut directions = vec![if sum == DVec3::ZERO {
        first
    } else {
        sum.normalize()
    }];
    loop {
        let mut region = nearest(normals, &directions);
        for _ in 0..ROUNDS {
            let mut sums = vec![DVec3::ZERO; directions.len()];
            for (normal, own) in normals.iter().zip(&region) {
                sums[*own as usize] += *normal;
            }
            for (direction, sum) in directions.iter_mut().zip(sums) {
                if sum != DVec3::ZERO {
                    *direction = sum.normalize();
                }
            }
            region = nearest(normals, &directions);
        }
        let along = |k: usize| {
            normals[k]
                .normalize_or_zero()
                .dot(directions[region[k] as usize])
        };
        let worst = (0..normals.len()).min_by(|a, b| along(*a).total_cmp(&along(*b)))?;
        if along(worst) >= least {
            return Some(region);
        }
        if directions.len() == MOST {
            return None;
        }
        directions.push(normals[worst].normalize_or_zero());
    }
}

fn nearest(normals: &[DVec3], directions: &[DVec3]) -> Vec<u32> {
    let of = |normal: &DVec3| {
        let along = |k: &usize| directions[*k].dot(*normal);
        let best = (0..directions.len()).max_by(|a, b| along(a).total_cmp(&along(b)));
        best.unwrap_or_default() as u32
    };
    normals.iter().map(of).collect()
}

/// Numbers regions anew, each of one piece.
fn connect(region: &mut [u32], beside: &[[u32; 3]]) {
    let old = region.to_vec();
    region.fill(NONE);
    let mut next = 0;
    for start in 0..old.len() {
        if region[start] != NONE {
            continue;
        }
        let mut queue = vec![start];
        region[start] = next;
        while let Some(at) = queue.pop() {
            for other in beside[at].map(|k| k as usize) {
                if other < old.len() && region[other] == NONE && old[other] == old[start] {
                    region[other] = next;
                    queue.push(other);
                }
            }
        }
        next += 1;
    }
}

/// Gives pieces that are too small for a surface of their own, and teeth, to a neighbour.
fn smooth(region: &mut [u32], beside: &[[u32; 3]], normals: &[DVec3]) {
    const SMALL: f64 = 0.04;
    let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
    for (own, normal) in region.iter().zip(normals) {
        *areas.entry(*own).or_default() += normal.length();
    }
    let whole: f64 = areas.values().sum();
    let is_small = |own: u32| areas.get(&own).is_some_and(|area| *area < SMALL * whole);
    for _ in 0..ROUNDS {
        let mut is_same = true;
        for k in 0..region.len() {
            let own = region[k];
            let others = beside[k].map(|t| region.get(t as usize).copied());
            let count = |of: u32| others.iter().filter(|other| **other == Some(of)).count();
            let best = others
                .iter()
                .flatten()
                .copied()
                .max_by_key(|of| (count(*of), *of));
            let Some(best) = best.filter(|best| *best != own) else {
                continue;
            };
            if count(best) >= 2 || is_small(own) && !is_small(best) {
                region[k] = best;
                is_same = false;
            }
        }
        if is_same {
            break;
        }
    }
}
