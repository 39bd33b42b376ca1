//! Growing pieces from seeds (Besl & Jain 1988, *Segmentation through variable-order surface
//! fitting*).

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::piece::Pieces;
use super::surface::Surface;
use super::windows::{WindowPlane, best_windows, planes};
use crate::grid::Grid;
use crate::scene::{NONE, Scene};
use range_image::{Cancelled, Monitor};

/// Half the sides of the windows that seeds are taken from, the widest first, so that large
/// faces are found before parts of them can be taken for something else; and how many noises
/// the window's plane may leave. Coarse depths make wide terraces on faces that are seen
/// squarely, which narrow windows would take for faces.
const SEEDS: [(usize, f64); 6] = [
    (12, CLEAN),
    (6, CLEAN),
    (12, ROUGH),
    (6, ROUGH),
    (3, CLEAN),
    (2, CLEAN),
];
/// Half the sides of the windows that what is left is looked through with in the end, for
/// seeds of faces too bent for any plane: rounds and ridges that are only so many nodes wide.
const BENT_SEEDS: [usize; 2] = [6, 3];
const CLEAN: f64 = 1.3;
const ROUGH: f64 = 4.0;
/// A rough window is flat when a quadric leaves no less than this share of what its plane does.
const FLAT: f64 = 0.8;
/// Half the side of the windows that give a node's direction.
const REACH: usize = 3;
/// A node lies on a surface when it misses it by less than this many noises.
pub(super) const MISS_NOISES: f64 = 3.0;
/// A window whose plane leaves more than this many noises tells no direction.
const CLEAR_NOISES: f64 = 2.0;
/// A node's direction may differ from its surface's by this many standard errors,
const TURN_ERRORS: f64 = 4.0;
/// and by this share of a crease.
const TURN_SHARE: f64 = 0.5;
/// Growth that has not settled after so many rounds wanders.
const ROUNDS: usize = 30;
/// Nodes that are looked at by one thread at least.
const AT_ONCE: usize = 512;
/// Smaller pieces are none.
const LEAST_NODES: usize = 12;

/// Grows pieces until no seed is left, of bent ones only if `bent_seeds`. What no piece explains
/// stays unlabelled.
pub(crate) fn pieces(
    scene: &Scene<'_>,
    bent_seeds: bool,
    monitor: &dyn Monitor,
) -> Result<Pieces, Cancelled> {
    let grid = &scene.grid;
    let directions = planes(grid, REACH);
    let mut grower = Grower {
        scene,
        windows: best_windows(grid, &directions, REACH, scene.noise.deviation_mm),
        directions,
        pieces: Pieces {
            labels: vec![NONE; grid.nodes()],
            surfaces: vec![None],
        },
        seen: vec![0; grid.nodes()],
        stamp: 0,
    };
    // Nodes by the last kind of seed that came to nothing there.
    let mut vain = vec![0_u8; grid.nodes()];
    let mut known = BTreeMap::new();
    for ((reach, noises), k) in SEEDS.into_iter().zip(0_u8..) {
        monitor.check()?;
        let left = known.entry(reach).or_insert_with(|| match reach {
            REACH => left(scene, &grower.directions),
            _ => left(scene, &planes(grid, reach)),
        });
        // Those that are taken by now would be passed over one by one.
        let seeds = seeds(left, noises, &|node| {
            vain[node] <= k && grower.is_open(node, reach)
        });
        for (roughness, seed) in seeds {
            if vain[seed] <= k && grower.is_open(seed, reach) {
                monitor.check()?;
                if !grower.grow(seed, reach, roughness) {
                    // Seeds close by would fare no better.
                    let (columns, rows) = grid.window(seed, reach / 3);
                    for column in columns {
                        let first = column * grid.rows;
                        vain[first + rows.start..first + rows.end].fill(k + 1);
                    }
                }
            }
        }
        monitor.progress(0.05 + 0.3 * f64::from(k + 1) / SEEDS.len() as f64);
    }
    for (k, reach) in BENT_SEEDS.into_iter().enumerate().filter(|_| bent_seeds) {
        monitor.check()?;
        for seed in grower.bent_seeds(reach) {
            if grower.is_open(seed, reach) {
                monitor.check()?;
                grower.grow(seed, reach, 1.0);
            }
        }
        monitor.progress(0.35 + 0.05 * (k + 1) as f64 / BENT_SEEDS.len() as f64);
    }
    Ok(grower.pieces)
}

/// What the planes of windows leave, in squared noises, those of the window's slope; infinite where
/// there is none.
fn left(scene: &Scene<'_>, planes: &[WindowPlane]) -> Vec<f32> {
    let left = |plane: &WindowPlane| {
        let rise_mm = plane.rise_mm.map(f64::from);
        let noise_mm = scene.noise.on_slope_mm(rise_mm, scene.grid.pitch_mm);
        plane.variance_mm2 / (noise_mm * noise_mm) as f32
    };
    planes.par_iter().map(left).collect()
}

/// The middles of windows that leave less than so many noises, of those that may be seeds, the
/// flattest first, with their roughness.
fn seeds(
    left: &[f32],
    noises: f64,
    may: &dyn Fn(usize) -> bool,
) -> impl Iterator<Item = (f64, usize)> + use<> {
    let most = (noises * noises) as f32;
    let flat = left.iter().zip(0_u32..);
    let mut keys: Vec<u64> = flat
        .filter(|(left, node)| **left < most && may(*node as usize))
        .map(|(left, node)| u64::from(left.to_bits()) << 32 | u64::from(node))
        .collect();
    // What is left is nowhere below 0, so that its bits are in its order.
    keys.par_sort_unstable();
    keys.into_iter().map(|key| {
        let left = libm::sqrt(f64::from(f32::from_bits((key >> 32) as u32)));
        let roughness = if left < CLEAN { 1.0 } else { left };
        (roughness, key as u32 as usize)
    })
}

struct Grower<'a> {
    scene: &'a Scene<'a>,
    /// Planes of all windows of [`REACH`].
    directions: Vec<WindowPlane>,
    /// The window that each node is judged by.
    windows: Vec<u32>,
    pieces: Pieces,
    /// Nodes marked in the round that bears the stamp.
    seen: Vec<u32>,
    stamp: u32,
}

impl Grower<'_> {
    /// Whether a seed's middle, corners and sides are not taken by any piece yet.
    fn is_open(&self, seed: usize, reach: usize) -> bool {
        let grid = &self.scene.grid;
        let reach = reach as isize;
        [-reach, 0, reach].into_iter().all(|c| {
            [-reach, 0, reach].into_iter().all(|r| {
                grid.offset(seed, c, r)
                    .is_none_or(|n| self.pieces.labels[n] == NONE)
            })
        })
    }

    /// The middles of windows that are open for the most part and that a quadric fits, the
    /// best fitted first.
    fn bent_seeds(&self, reach: usize) -> Vec<usize> {
        let side = 2 * reach + 1;
        let mut seeds: Vec<(f64, usize)> = (0..self.pieces.labels.len())
            .into_par_iter()
            .filter(|&node| {
                self.pieces.labels[node] == NONE
                    && self.scene.grid.is_valid(node)
                    && self.is_open(node, reach)
            })
            .filter_map(|node| {
                let nodes = self.window_nodes(node, reach);
                if 2 * nodes.len() < side * side {
                    return None;
                }
                let left = Surface::left_by_quadric(self.scene, &nodes)?;
                (left < CLEAN).then_some((left, node))
            })
            .collect();
        seeds.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        seeds.into_iter().map(|(_, node)| node).collect()
    }

    /// Grows a piece from a seed; whether any came of it.
    fn grow(&mut self, seed: usize, reach: usize, roughness: f64) -> bool {
        let Some((surface, nodes)) = self.settled(seed, reach, roughness) else {
            return false;
        };
        let nodes = self.solid(&nodes);
        if nodes.len() < LEAST_NODES {
            return false;
        }
        let label = self.pieces.surfaces.len() as u32;
        for &node in &nodes {
            self.pieces.labels[node as usize] = label;
        }
        let surface = Surface::fit(self.scene, &nodes, roughness).unwrap_or(surface);
        self.pieces.surfaces.push(Some(surface));
        true
    }

    /// Lets the nodes of a seed's window grow along the surface that fits them, until it takes
    /// no more.
    fn settled(
        &mut self,
        seed: usize,
        reach: usize,
        roughness: f64,
    ) -> Option<(Surface, Vec<u32>)> {
        let mut nodes = self.window_nodes(seed, reach);
        if roughness > 1.0 && !Surface::is_flat(self.scene, &nodes, FLAT) {
            return None;
        }
        let mut surface = Surface::fit(self.scene, &nodes, roughness)?;
        for _ in 0..ROUNDS {
            // Surfaces are carried on in proportion to what they rest on.
            let layers = if surface.is_quartic() {
                2
            } else {
                2 + libm::sqrt(nodes.len() as f64) as usize / 3
            };
            let grown = self.flood(&nodes, &surface, layers);
            if grown.len() < LEAST_NODES {
                return None;
            }
            let settled = grown.len().abs_diff(nodes.len()) * 200 <= nodes.len();
            nodes = grown;
            surface = Surface::fit(self.scene, &nodes, roughness)?;
            if settled {
                break;
            }
        }
        Some((surface, nodes))
    }

    /// Open nodes in a seed's window.
    fn window_nodes(&self, seed: usize, reach: usize) -> Vec<u32> {
        let grid = &self.scene.grid;
        let (columns, rows) = grid.window(seed, reach);
        columns
            .flat_map(|c| rows.clone().map(move |r| c * grid.rows + r))
            .filter(|&n| grid.is_valid(n) && self.pieces.labels[n] == NONE)
            .map(|n| n as u32)
            .collect()
    }

    /// Those of the nodes that lie on the surface, and those within so many links of them.
    fn flood(&mut self, nodes: &[u32], surface: &Surface, layers: usize) -> Vec<u32> {
        self.stamp += 1;
        let mut found: Vec<u32> = Vec::with_capacity(2 * nodes.len());
        let lying = nodes.par_iter().with_min_len(AT_ONCE).copied();
        found.par_extend(lying.filter(|&node| self.lies_on(node as usize, surface)));
        for &node in &found {
            self.seen[node as usize] = self.stamp;
        }
        let mut from = 0;
        for _ in 0..layers {
            let to = found.len();
            for k in from..to {
                for next in self.scene.links.linked(found[k] as usize) {
                    if self.seen[next] != self.stamp
                        && self.pieces.labels[next] == NONE
                        && self.lies_on(next, surface)
                    {
                        self.seen[next] = self.stamp;
                        found.push(next as u32);
                    }
                }
            }
            from = to;
        }
        found
    }

    /// Whether a node's z and direction are the surface's but for noise.
    fn lies_on(&self, node: usize, surface: &Surface) -> bool {
        let grid = &self.scene.grid;
        let noise = &self.scene.noise;
        let miss = surface.miss(self.scene, node);
        if miss.is_nan() || miss > MISS_NOISES {
            return false;
        }
        let window = self.windows[node] as usize;
        let plane = &self.directions[window];
        let (c, r) = grid.column_row(window);
        let rise_mm = surface.rise_mm(c as f64, r as f64);
        let noise_mm = surface.roughness * noise.on_slope_mm(rise_mm, grid.pitch_mm);
        let clear = CLEAR_NOISES * noise_mm;
        if f64::from(plane.variance_mm2) > clear * clear {
            return miss <= 0.5 * MISS_NOISES;
        }
        let turn = Turn::of(grid, plane, rise_mm);
        // The standard error of a full window's slope: its sum of u u is a third of
        // n reach (reach + 1).
        let reach = REACH as f64;
        let side = 2.0 * reach + 1.0;
        let error = noise_mm / grid.pitch_mm
            * libm::sqrt(3.0 * noise.area_nodes / (side * side * reach * (reach + 1.0)));
        turn.is_within((TURN_SHARE * self.scene.crease_rad).max(TURN_ERRORS * error * turn.facing))
    }

    /// Nodes without what hangs on by fewer than three nodes side by side, the largest
    /// connected part of it.
    fn solid(&mut self, nodes: &[u32]) -> Vec<u32> {
        let grid = &self.scene.grid;
        self.stamp += 1;
        let member = self.stamp;
        for &node in nodes {
            self.seen[node as usize] = member;
        }
        let around = |node: usize| {
            let (columns, rows) = grid.window(node, 1);
            columns.flat_map(move |c| rows.clone().map(move |r| c * grid.rows + r))
        };
        let cores: Vec<usize> = nodes
            .iter()
            .map(|&n| n as usize)
            .filter(|&n| {
                let foreign = around(n).filter(|&k| grid.is_valid(k) && self.seen[k] < member);
                foreign.count() <= 2
            })
            .collect();
        self.stamp += 1;
        let kept = self.stamp;
        for core in cores {
            for node in around(core) {
                if self.seen[node] == member {
                    self.seen[node] = kept;
                }
            }
        }
        self.stamp += 1;
        let mut largest = Vec::new();
        for &start in nodes {
            if self.seen[start as usize] != kept {
                continue;
            }
            let mut part = vec![start];
            self.seen[start as usize] = self.stamp;
            let mut next = 0;
            while let Some(&node) = part.get(next) {
                next += 1;
                for n in self.scene.links.linked(node as usize) {
                    if self.seen[n] == kept {
                        self.seen[n] = self.stamp;
                        part.push(n as u32);
                    }
                }
            }
            if part.len() > largest.len() {
                largest = part;
            }
        }
        largest
    }
}

/// A turn between normals, and how squarely they face the camera: slopes' errors shrink by this in
/// angles.
struct Turn {
    sine: f64,
    cosine: f64,
    facing: f64,
}

impl Turn {
    fn of(grid: &Grid<'_>, plane: &WindowPlane, rise_mm: [f64; 2]) -> Self {
        let [p, q] = rise_mm.map(|r| r / grid.pitch_mm);
        let [a, b] = plane.rise_mm.map(|r| f64::from(r) / grid.pitch_mm);
        // Cross product of (-p, -q, 1) and (-a, -b, 1), and the squares of their lengths.
        let cross = [b - q, p - a, p * b - q * a];
        let squares = (1.0 + p * p + q * q) * (1.0 + a * a + b * b);
        let root = libm::sqrt(squares);
        Self {
            sine: libm::sqrt(cross.iter().map(|c| c * c).sum::<f64>() / squares),
            cosine: (p * a + q * b + 1.0) / root,
            facing: 1.0 / root,
        }
    }

    /// Whether the angle is no greater. It is worked out only where its sine does not tell: that is
    /// less than the angle, by a sixth of the angle's cube at most.
    fn is_within(&self, angle: f64) -> bool {
        let least_sine = angle - angle * angle * angle / 6.0;
        if self.cosine > 0.0 && self.sine <= (1.0 - ROUNDING) * least_sine {
            return true;
        }
        self.sine <= (1.0 + ROUNDING) * angle && libm::atan2(self.sine, self.cosine) <= angle
    }
}

/// More than rounding does to an angle or its sine, of these.
const ROUNDING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_within_an_angle_as_its_own_angle_is() {
        for k in 0..2_000_000 {
            let own = f64::from(k) * 1.7e-6;
            let turn = Turn {
                sine: libm::sin(own).abs(),
                cosine: libm::cos(own),
                facing: 1.0,
            };
            for limit in [0.05, 0.3, 1.2, core::f64::consts::FRAC_PI_2, 2.0] {
                let close = own * (1.0 + f64::from(k % 7 - 3) * 2e-16);
                for angle in [limit, close] {
                    let exact = libm::atan2(turn.sine, turn.cosine) <= angle;
                    assert_eq!(turn.is_within(angle), exact, "{own} {angle}");
                }
            }
        }
    }
}
