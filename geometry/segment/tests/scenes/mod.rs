//! Closed-form scenes with the true face of each node, noise like a regridder's, dropouts
//! and ragged outlines; and how near a segmentation comes to the truth.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::SplitMix64;
use range_image::{Lattice, RangeImage, RegionMap};

pub(crate) const PITCH_MM: f64 = 0.42;
pub(crate) const COLUMNS: usize = 240;
pub(crate) const ROWS: usize = 256;

type Vec3 = [f64; 3];

/// z and the face seen at (x, y), both in millimetres from the image's middle.
pub(crate) type Surface<'a> = &'a dyn Fn(f64, f64) -> Option<(f64, u16)>;

pub(crate) struct Scene {
    pub(crate) image: RangeImage,
    pub(crate) truth: Vec<u16>,
}

#[derive(Clone, Copy)]
pub(crate) struct Spoil {
    pub(crate) noise_mm: f64,
    /// Share of masked nodes.
    pub(crate) dropouts: f64,
    /// The outline is eaten up to so many nodes deep, at random.
    pub(crate) ragged: usize,
}

impl Scene {
    pub(crate) fn new(surface: Surface<'_>, spoil: Spoil, seed: u64) -> Self {
        let mut random = SplitMix64::seed_from_u64(seed);
        let lattice = Lattice { pitch_mm: PITCH_MM };
        let mut image = RangeImage::masked(lattice, -120, -128, COLUMNS, ROWS);
        let mut truth = vec![0; COLUMNS * ROWS];
        let noise = correlated_noise(&mut random);
        for column in 0..COLUMNS {
            for row in 0..ROWS {
                if let Some((z, face)) = surface(image.x_mm(column), image.y_mm(row)) {
                    let node = column * ROWS + row;
                    truth[node] = face;
                    image.set_z_mm(column, row, Some(z + spoil.noise_mm * noise[node]));
                }
            }
        }
        let mut scene = Self { image, truth };
        for _ in 0..spoil.ragged {
            scene.nibble(&mut random);
        }
        for node in 0..scene.truth.len() {
            if unit(&mut random) < spoil.dropouts {
                scene.mask(node);
            }
        }
        scene
    }

    fn mask(&mut self, node: usize) {
        self.image.set_z_mm(node / ROWS, node % ROWS, None);
        self.truth[node] = 0;
    }

    /// Masks half of the nodes on the outline.
    fn nibble(&mut self, random: &mut SplitMix64) {
        let edge: Vec<usize> = (0..self.truth.len())
            .filter(|&n| self.truth[n] != 0 && neighbours(n).any(|m| self.truth[m] == 0))
            .collect();
        for node in edge {
            if unit(random) < 0.5 {
                self.mask(node);
            }
        }
    }

    pub(crate) fn judge(&self, map: &RegionMap) -> Verdict {
        let faces = usize::from(self.truth.iter().copied().max().unwrap_or(0));
        let regions = usize::from(map.regions());
        let mut overlap = vec![0_usize; (regions + 1) * (faces + 1)];
        for (&label, &face) in map.raw_labels().iter().zip(&self.truth) {
            overlap[usize::from(label) * (faces + 1) + usize::from(face)] += 1;
        }
        // Each region stands for the face most of it lies on.
        let stands_for: Vec<u16> = (0..=regions)
            .map(|r| {
                let row = &overlap[r * (faces + 1)..(r + 1) * (faces + 1)];
                let best = (1..=faces).max_by_key(|&f| (row[f], faces - f));
                if r == 0 { 0 } else { best.unwrap_or(0) as u16 }
            })
            .collect();
        let found: Vec<u16> = map
            .raw_labels()
            .iter()
            .map(|&l| stands_for[usize::from(l)])
            .collect();
        let seen = self.truth.iter().filter(|&&f| f != 0).count();
        let right = found
            .iter()
            .zip(&self.truth)
            .filter(|(a, b)| a == b && **b != 0)
            .count();
        Verdict {
            regions,
            right: right as f64 / seen.max(1) as f64,
            misplacement_nodes: misplacement(&found, &self.truth),
        }
    }
}

#[derive(Debug)]
pub(crate) struct Verdict {
    pub(crate) regions: usize,
    /// Share of the nodes with the label of their face.
    pub(crate) right: f64,
    /// 95 of 100 places on the found borders lie no further from the true ones.
    pub(crate) misplacement_nodes: f64,
}

/// Midpoints between 4-neighbours on two faces, in half nodes.
fn border_places(faces: &[u16]) -> Vec<(i32, i32)> {
    let mut places = Vec::new();
    for node in 0..faces.len() {
        let (c, r) = ((node / ROWS) as i32, (node % ROWS) as i32);
        let differs =
            |other: usize| faces[node] != 0 && faces[other] != 0 && faces[node] != faces[other];
        if (r as usize) + 1 < ROWS && differs(node + 1) {
            places.push((2 * c, 2 * r + 1));
        }
        if (c as usize) + 1 < COLUMNS && differs(node + ROWS) {
            places.push((2 * c + 1, 2 * r));
        }
    }
    places
}

fn misplacement(found: &[u16], truth: &[u16]) -> f64 {
    let truth = border_places(truth);
    let mut misses: Vec<f64> = border_places(found)
        .iter()
        .map(|&(c, r)| {
            let squared = truth
                .iter()
                .map(|&(tc, tr)| (tc - c) * (tc - c) + (tr - r) * (tr - r))
                .min();
            squared.map_or(f64::INFINITY, |s| 0.5 * f64::from(s).sqrt())
        })
        .collect();
    misses.sort_by(f64::total_cmp);
    let last = misses.len().saturating_sub(1);
    misses.get(last * 95 / 100).copied().unwrap_or(0.0)
}

fn neighbours(node: usize) -> impl Iterator<Item = usize> {
    let (c, r) = (node / ROWS, node % ROWS);
    [
        (r > 0).then(|| node - 1),
        (r + 1 < ROWS).then(|| node + 1),
        (c > 0).then(|| node - ROWS),
        (c + 1 < COLUMNS).then(|| node + ROWS),
    ]
    .into_iter()
    .flatten()
}

fn unit(random: &mut SplitMix64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Unit variance, correlation 0.56 between neighbours.
fn correlated_noise(random: &mut SplitMix64) -> Vec<f64> {
    let (wide, high) = (COLUMNS + 2, ROWS + 2);
    let white: Vec<f64> = (0..wide * high)
        .map(|_| (0..12).map(|_| unit(random)).sum::<f64>() - 6.0)
        .collect();
    let weights = [0.35, 1.0, 0.35];
    let gain: f64 = weights.iter().map(|w| w * w).sum();
    let mut noise = vec![0.0; COLUMNS * ROWS];
    for c in 0..COLUMNS {
        for r in 0..ROWS {
            let mut sum = 0.0;
            for (i, wi) in weights.iter().enumerate() {
                for (j, wj) in weights.iter().enumerate() {
                    sum += wi * wj * white[(c + i) * high + r + j];
                }
            }
            noise[c * ROWS + r] = sum / gain;
        }
    }
    noise
}

/// Turns about x, then y, then z, by so many degrees.
#[derive(Clone, Copy)]
pub(crate) struct Pose([Vec3; 3]);

impl Pose {
    pub(crate) fn new(x: f64, y: f64, z: f64) -> Self {
        let turn = |degrees: f64| libm::sincos(degrees.to_radians());
        let ((sx, cx), (sy, cy), (sz, cz)) = (turn(x), turn(y), turn(z));
        Self([
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ])
    }

    fn apply(&self, v: Vec3) -> Vec3 {
        self.0.map(|row| dot(row, v))
    }
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A convex body: half-spaces `normal . p <= offset`. Each is a face of its own.
pub(crate) fn convex(
    pose: Pose,
    sides: &[(Vec3, f64)],
) -> impl Fn(f64, f64) -> Option<(f64, u16)> + use<> {
    let sides: Vec<(Vec3, f64)> = sides
        .iter()
        .map(|&(n, d)| {
            let length = dot(n, n).sqrt();
            (pose.apply(n.map(|v| v / length)), d / length)
        })
        .collect();
    move |x, y| {
        let (mut top, mut face, mut bottom) = (f64::INFINITY, 0, f64::NEG_INFINITY);
        for (k, (n, d)) in sides.iter().enumerate() {
            let rest = d - n[0] * x - n[1] * y;
            if n[2] > 1e-9 {
                if rest / n[2] < top {
                    (top, face) = (rest / n[2], k as u16 + 1);
                }
            } else if n[2] < -1e-9 {
                bottom = bottom.max(rest / n[2]);
            } else if rest < 0.0 {
                return None;
            }
        }
        (top >= bottom).then_some((top, face))
    }
}

/// A house with a gable roof of this slope, 56 x 44 mm, walls 30 mm high, y its up.
pub(crate) fn house(pose: Pose, roof_degrees: f64) -> impl Fn(f64, f64) -> Option<(f64, u16)> {
    let (s, c) = libm::sincos(roof_degrees.to_radians());
    let eaves = 15.0 * c + 22.0 * s;
    convex(
        pose,
        &[
            ([1.0, 0.0, 0.0], 28.0),
            ([-1.0, 0.0, 0.0], 28.0),
            ([0.0, 0.0, 1.0], 22.0),
            ([0.0, 0.0, -1.0], 22.0),
            ([0.0, c, s], eaves),
            ([0.0, c, -s], eaves),
            ([0.0, -1.0, 0.0], 15.0),
        ],
    )
}

/// An upright cylinder, y its axis; face 1 the disc, 2 the side.
pub(crate) fn cylinder(
    pose: Pose,
    radius: f64,
    height: f64,
) -> impl Fn(f64, f64) -> Option<(f64, u16)> {
    let axis = pose.apply([0.0, 1.0, 0.0]);
    move |x, y| {
        // |p|^2 - (p . axis)^2 = radius^2, the greater root.
        let flat = axis[0] * x + axis[1] * y;
        let a = 1.0 - axis[2] * axis[2];
        let b = -flat * axis[2];
        let c = x * x + y * y - flat * flat - radius * radius;
        let root = b * b - a * c;
        if root < 0.0 {
            return None;
        }
        let (front, back) = ((-b + root.sqrt()) / a, (-b - root.sqrt()) / a);
        let (lid, base) = (
            (0.5 * height - flat) / axis[2],
            (-0.5 * height - flat) / axis[2],
        );
        let top = front.min(lid);
        (top >= back.max(base)).then_some((top, if lid < front { 1 } else { 2 }))
    }
}
