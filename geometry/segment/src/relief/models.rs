//! What the pieces' own surfaces say of the borders between them.

use super::piece::Pieces;
use super::surface::Surface;
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
        let mut strengths: Vec<f64> = pairs
            .iter()
            .filter_map(|pair| {
                let (a, b) = ends(scene, &self.pieces.labels, *pair);
                let one = self.pieces.surfaces[a as usize].as_ref()?;
                let other = self.pieces.surfaces[b as usize].as_ref()?;
                let meeting = meet(scene, one, other, *pair);
                let allowed = ALLOWANCE * scene.crease_rad * (STEEP / meeting.facing).max(1.0);
                Some((meeting.turn_rad / allowed).max(meeting.gap_mm / scene.step_mm))
            })
            .collect();
        strengths.sort_by(f64::total_cmp);
        strengths.get(strengths.len() / 2).copied()
    }
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

    /// What is found of a plane's two halves, of which the right one turns by so many radians
    /// and lies so much higher.
    fn halves(turn_rad: f64, rise_mm: f64) -> Option<Planes> {
        let mut image = RangeImage::masked(Lattice { pitch_mm: PITCH_MM }, 0, 0, SIDE, SIDE);
        for column in 0..SIDE {
            for row in 0..SIDE {
                let stray = ((column * 7 + row * 13 + column * row) % 11) as f64 - 5.0;
                let right = column.saturating_sub(SIDE / 2) as f64 * PITCH_MM;
                let rise_mm = if column < SIDE / 2 { 0.0 } else { rise_mm };
                let z_mm = 0.05 * row as f64 + libm::tan(turn_rad) * right + rise_mm;
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
        let samples = pieces.members();
        for label in [1, 2] {
            pieces.surfaces[label] = Surface::fit(&scene, &samples[label], 1.0);
        }
        let border = &borders(&scene, &pieces.labels)[0];
        planes(&scene, &pieces, &samples, border)
    }

    #[test]
    fn planes_are_told_apart_by_creases_and_not_by_little() {
        assert_eq!(halves(0.0, 0.0), Some(Planes::Together));
        assert_eq!(halves(0.02, 0.05), Some(Planes::Together));
        assert_eq!(halves(0.15, 0.0), Some(Planes::Apart));
        assert_eq!(halves(0.08, 0.0), None, "its border has to tell");
        assert_eq!(halves(0.0, 0.3), None, "its border has to tell");
    }
}
