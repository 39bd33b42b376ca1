//! What the pieces' own surfaces say of the borders between them.

use super::piece::Pieces;
use super::surface::{LEAST_QUARTIC_NODES, Surface};
use crate::merge::{Border, Pair, borders};
use crate::scene::Scene;
use std::collections::BTreeMap;

/// At most so many nodes of a piece are asked.
const SAMPLE: usize = 4000;
/// A surface that is to explain both pieces may leave more than two planes by so many squared
/// noises for each node's worth of noise.
const EXCESS: f64 = 100.0;
/// Planes that turn and part by less than this share of a crease and a step are one, whatever
/// a few nodes of another face in either say.
const ALIKE: f64 = 0.4;
/// Share of a border that must run between two planes that are apart.
const LEAST_SHARE: f64 = 0.3;
/// Share of its region that a plane must make up to be the region's surface.
const LEAST_PART: f64 = 0.3;
/// Surfaces are less certain at their ends than fits about the border, so they may turn by so
/// many crease angles.
const ALLOWANCE: f64 = 2.0;
/// Surfaces whose normal's z is below this (60 degrees of incidence) may turn by more, in
/// proportion.
const STEEP: f64 = 0.5;

/// Fewer pairs are no ground to go by.
const LEAST_PAIRS: usize = 3;

/// What two planes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Planes {
    /// Two faces.
    Apart,
    /// Parts of one face.
    Together,
}

/// The pieces and what is known of their pairs.
#[derive(Debug)]
pub(crate) struct Models<'a> {
    pieces: &'a Pieces,
    /// Nodes of each piece.
    sizes: Vec<usize>,
    planes: BTreeMap<(u32, u32), Planes>,
}

/// How two surfaces lie to each other along a border.
struct Meeting {
    /// Angle between their normals, radians.
    turn_rad: f64,
    /// Distance square to them, millimetres.
    gap_mm: f64,
    /// z of the normal that faces the camera less.
    facing: f64,
}

impl<'a> Models<'a> {
    /// Looks at all pairs of pieces that have nodes beside each other.
    pub(crate) fn new(scene: &Scene<'_>, pieces: &'a Pieces) -> Self {
        let members = pieces.members();
        let sizes = members.iter().map(Vec::len).collect();
        let samples: Vec<Vec<u32>> = members
            .into_iter()
            .map(|nodes| {
                let every = nodes.len().div_ceil(SAMPLE).max(1);
                nodes.into_iter().step_by(every).collect()
            })
            .collect();
        let planes = borders(scene, &pieces.labels)
            .into_iter()
            .filter_map(|border| Some((border.regions, planes(scene, pieces, &samples, &border)?)))
            .collect();
        Self {
            pieces,
            sizes,
            planes,
        }
    }

    /// What a border divides, if enough of it runs between planes that make up much of their
    /// regions, whose nodes are given.
    pub(crate) fn planes(
        &self,
        scene: &Scene<'_>,
        labels: &[u32],
        border: &Border,
        sizes: [usize; 2],
    ) -> Option<Planes> {
        let pairs = &border.pairs;
        let (mut apart, mut together) = (0, 0);
        for pair in pairs {
            let pieces = ends(scene, &self.pieces.labels, *pair);
            let regions = ends(scene, labels, *pair);
            let (a, b) = (pieces.0.min(pieces.1), pieces.0.max(pieces.1));
            let much = |piece: u32, region: u32| {
                self.is_much(piece, sizes[usize::from(region == border.regions.1)])
            };
            match self.planes.get(&(a, b)) {
                Some(Planes::Apart) if much(pieces.0, regions.0) && much(pieces.1, regions.1) => {
                    apart += 1;
                }
                Some(Planes::Together) => together += 1,
                _ => {}
            }
        }
        let enough = LEAST_SHARE * pairs.len() as f64;
        if f64::from(apart) >= enough {
            return Some(Planes::Apart);
        }
        (f64::from(together) >= enough).then_some(Planes::Together)
    }

    /// Whether enough of a border runs beside a plane that makes up much of its region.
    pub(crate) fn beside_plane(
        &self,
        scene: &Scene<'_>,
        labels: &[u32],
        border: &Border,
        sizes: [usize; 2],
    ) -> bool {
        let beside = border.pairs.iter().filter(|pair| {
            let pieces = ends(scene, &self.pieces.labels, **pair);
            let regions = ends(scene, labels, **pair);
            [(pieces.0, regions.0), (pieces.1, regions.1)]
                .into_iter()
                .any(|(piece, region)| {
                    let size = sizes[usize::from(region == border.regions.1)];
                    let surface = self.pieces.surfaces[piece as usize].as_ref();
                    surface.is_some_and(Surface::is_plane) && self.is_much(piece, size)
                })
        });
        beside.count() as f64 >= LEAST_SHARE * border.pairs.len() as f64
    }

    /// Whether a piece makes up much of a region of so many nodes.
    fn is_much(&self, piece: u32, region_nodes: usize) -> bool {
        self.sizes[piece as usize] as f64 >= LEAST_PART * region_nodes as f64
    }

    /// How much of a crease or step the surfaces make of a border; 1 is the least that counts.
    pub(crate) fn strength(&self, scene: &Scene<'_>, pairs: &[Pair]) -> Option<f64> {
        let strength = |meeting: Meeting| {
            let allowed = ALLOWANCE * scene.crease_rad * (STEEP / meeting.facing).max(1.0);
            (meeting.turn_rad / allowed).max(meeting.gap_mm / scene.step_mm)
        };
        let meetings = self.meetings(scene, pairs, 0);
        median(meetings.into_iter().map(|(_, m)| strength(m)).collect())
    }

    /// The same of large regions, by curved surfaces alone that rest on many nodes, and without
    /// allowance: these are carried on for certain, while a border may be a narrow passage
    /// between steps, or bend as no quadric does. `None` where most of it runs otherwise.
    pub(crate) fn strength_of_large(&self, scene: &Scene<'_>, pairs: &[Pair]) -> Option<f64> {
        let mut meetings = self.meetings(scene, pairs, LEAST_QUARTIC_NODES);
        meetings.retain(|(are_planes, _)| !are_planes);
        if meetings.len() < LEAST_PAIRS || 2 * meetings.len() < pairs.len() {
            return None;
        }
        let turn_rad = median(meetings.iter().map(|(_, m)| m.turn_rad).collect())?;
        let gap_mm = median(meetings.iter().map(|(_, m)| m.gap_mm).collect())?;
        Some((turn_rad / scene.crease_rad).max(gap_mm / scene.step_mm))
    }

    /// How the pieces of at least so many nodes lie to each other along a border, and whether
    /// both are planes.
    fn meetings(
        &self,
        scene: &Scene<'_>,
        pairs: &[Pair],
        least_nodes: usize,
    ) -> Vec<(bool, Meeting)> {
        let surface = |piece: u32| {
            let is_enough = self.sizes[piece as usize] >= least_nodes;
            let surface = self.pieces.surfaces[piece as usize].as_ref();
            surface.filter(|_| is_enough)
        };
        let meetings = pairs.iter().filter_map(|pair| {
            let (a, b) = ends(scene, &self.pieces.labels, *pair);
            let (one, other) = (surface(a)?, surface(b)?);
            let are_planes = one.is_plane() && other.is_plane();
            Some((are_planes, meet(scene, one, other, *pair)))
        });
        meetings.collect()
    }
}

/// The greater of the two in the middle.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn ends(scene: &Scene<'_>, labels: &[u32], pair: Pair) -> (u32, u32) {
    let first = pair.first as usize;
    let other = first
        + if pair.to_the_right {
            scene.grid.rows
        } else {
            1
        };
    (labels[first], labels[other])
}

fn meet(scene: &Scene<'_>, one: &Surface, other: &Surface, pair: Pair) -> Meeting {
    let (c, r) = scene.grid.column_row(pair.first as usize);
    let (mut c, mut r) = (c as f64, r as f64);
    if pair.to_the_right {
        c += 0.5;
    } else {
        r += 0.5;
    }
    let normal = |surface: &Surface| {
        let [p, q] = surface.rise_mm(c, r).map(|rise| rise / scene.grid.pitch_mm);
        let length = libm::sqrt(1.0 + p * p + q * q);
        [-p / length, -q / length, 1.0 / length]
    };
    let (m, n) = (normal(one), normal(other));
    let chord = libm::sqrt((0..3).map(|k| (m[k] - n[k]) * (m[k] - n[k])).sum::<f64>());
    let facing = m[2].min(n[2]);
    Meeting {
        turn_rad: 2.0 * libm::asin((0.5 * chord).min(1.0)),
        gap_mm: (one.z_mm(c, r) - other.z_mm(c, r)).abs() * facing,
        facing,
    }
}

fn planes(
    scene: &Scene<'_>,
    pieces: &Pieces,
    samples: &[Vec<u32>],
    border: &Border,
) -> Option<Planes> {
    let (a, b) = border.regions;
    let one = pieces.surfaces[a as usize].as_ref()?;
    let other = pieces.surfaces[b as usize].as_ref()?;
    if !(one.is_plane() && other.is_plane()) {
        return None;
    }
    let meetings: Vec<Meeting> = border
        .pairs
        .iter()
        .map(|pair| meet(scene, one, other, *pair))
        .collect();
    let gap_mm = meetings.iter().map(|m| m.gap_mm).sum::<f64>() / meetings.len().max(1) as f64;
    let turn_rad = meetings.first()?.turn_rad;
    if turn_rad < ALIKE * scene.crease_rad && gap_mm < ALIKE * scene.step_mm {
        return Some(Planes::Together);
    }
    // One gently curved surface may have come out as two planes.
    let roughness = one.roughness.max(other.roughness);
    let (a, b) = (&samples[a as usize], &samples[b as usize]);
    let fit = |nodes: &[u32]| Surface::fit(scene, nodes, roughness);
    let both: Vec<u32> = a.iter().chain(b).copied().collect();
    let (one, other, joint) = (fit(a)?, fit(b)?, fit(&both)?);
    let noise_mm = roughness * joint.noise_mm(scene);
    let unit = noise_mm * noise_mm * scene.noise.area_nodes;
    let excess = joint.error_mm2 - one.error_mm2 - other.error_mm2;
    if excess < EXCESS * unit {
        (turn_rad < ALLOWANCE * scene.crease_rad && gap_mm < scene.step_mm)
            .then_some(Planes::Together)
    } else {
        (turn_rad >= scene.crease_rad || gap_mm >= scene.step_mm).then_some(Planes::Apart)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Grid, Links};
    use crate::noise::noise;
    use range_image::{Lattice, RangeImage};

    const SIDE: usize = 60;
    const PITCH_MM: f64 = 0.42;

    /// What `found` makes of the border between an image's halves, with z by column and row.
    fn parts<T>(
        z_mm: impl Fn(f64, f64) -> f64,
        found: impl Fn(&Scene<'_>, &Models<'_>, &Border) -> T,
    ) -> T {
        let mut image = RangeImage::masked(Lattice { pitch_mm: PITCH_MM }, 0, 0, SIDE, SIDE);
        for column in 0..SIDE {
            for row in 0..SIDE {
                let stray = ((column * 7 + row * 13 + column * row) % 11) as f64 - 5.0;
                let z_mm = z_mm(column as f64, row as f64);
                image.set_z_mm(column, row, Some(z_mm + 0.001 * stray));
            }
        }
        let grid = Grid::new(&image);
        let scene = Scene {
            grid,
            links: Links::new(&grid, PITCH_MM),
            noise: noise(&image, &grid),
            step_mm: PITCH_MM,
            crease_rad: 0.1,
        };
        let mut pieces = Pieces {
            labels: (0..SIDE * SIDE)
                .map(|node| if node < SIDE * SIDE / 2 { 1 } else { 2 })
                .collect(),
            surfaces: vec![None, None, None],
        };
        let members = pieces.members();
        for label in [1, 2] {
            pieces.surfaces[label] = Surface::fit(&scene, &members[label], 1.0);
        }
        let border = &borders(&scene, &pieces.labels)[0];
        found(&scene, &Models::new(&scene, &pieces), border)
    }

    /// What is found of a plane's two halves, of which the right one turns by so many radians
    /// and lies so much higher.
    fn halves(turn_rad: f64, rise_mm: f64) -> Option<Planes> {
        let z_mm = |column: f64, row: f64| {
            let right = column - (SIDE / 2) as f64;
            let rise_mm = if right < 0.0 { 0.0 } else { rise_mm };
            let right = right.max(0.0) * PITCH_MM;
            0.05 * row + libm::tan(turn_rad) * right + rise_mm
        };
        parts(z_mm, |_, models, border| {
            models.planes.get(&border.regions).copied()
        })
    }

    #[test]
    fn planes_are_told_apart_by_creases_and_not_by_little() {
        assert_eq!(halves(0.0, 0.0), Some(Planes::Together));
        assert_eq!(halves(0.02, 0.05), Some(Planes::Together));
        assert_eq!(halves(0.15, 0.0), Some(Planes::Apart));
        assert_eq!(halves(0.08, 0.0), None, "its border has to tell");
        assert_eq!(halves(0.0, 0.3), None, "its border has to tell");
    }

    #[test]
    fn curved_surfaces_that_go_on_in_each_other_make_no_border() {
        let strength = |kink: f64, bend: f64, rise_mm: f64| {
            let z_mm = |column: f64, row: f64| {
                let right = (column - (SIDE / 2) as f64) * PITCH_MM;
                let rise_mm = if right < 0.0 { 0.0 } else { rise_mm };
                bend * (right * right + 0.1 * row * row) + kink * right.max(0.0) + rise_mm
            };
            parts(z_mm, |scene, models, border| {
                models.strength_of_large(scene, &border.pairs)
            })
        };
        assert!(strength(0.0, 0.02, 0.0).unwrap() < 0.2);
        assert!(strength(0.15, 0.02, 0.0).unwrap() > 1.0);
        assert!(strength(0.0, 0.02, 0.35).unwrap() > 0.6);
        assert_eq!(strength(0.0, 0.0, 0.0), None, "planes are judged otherwise");
    }
}
