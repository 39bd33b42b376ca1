//! Surfaces and machines for tests and judges, drawn from seeds.
#![allow(dead_code, reason = "each user uses its own part")]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use toolpath::{Cuboid, Cutter, Dialect, Feed, Machine, Speed, Surface, Tool};

/// Vertices and triangles.
pub(crate) type Facets = (Vec<[f64; 3]>, Vec<[usize; 3]>);

/// Numbers from a seed.
pub(crate) struct Draw(Xoshiro256PlusPlus);

impl Draw {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        let share = (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        low + share * (high - low)
    }
}

/// A grid of heights over a rectangle, as triangles. Coordinates are those of STL files, which have
/// 24 bits.
pub(crate) fn graph(size_mm: [f64; 2], pitch_mm: f64, height: impl Fn(f64, f64) -> f64) -> Facets {
    let count = size_mm.map(|side| (side / pitch_mm).round() as usize);
    let mut vertices = Vec::new();
    for i in 0..=count[0] {
        for j in 0..=count[1] {
            let x = size_mm[0] * i as f64 / count[0] as f64;
            let y = size_mm[1] * j as f64 / count[1] as f64;
            vertices.push([x, y, height(x, y)].map(|c| f64::from(c as f32)));
        }
    }
    let rows = count[1] + 1;
    let mut triangles = Vec::new();
    for i in 0..count[0] {
        for j in 0..count[1] {
            let a = i * rows + j;
            let [b, c, d] = [a + rows, a + rows + 1, a + 1];
            // Diagonals alternate.
            if (i + j) % 2 == 0 {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    (vertices, triangles)
}

/// Hills and hollows, a ridge, and on some seeds a step; 0 to about 8 mm high.
pub(crate) fn relief(seed: u64, size_mm: [f64; 2], pitch_mm: f64) -> Facets {
    let mut draw = Draw::new(seed);
    let hills: Vec<[f64; 4]> = (0..8)
        .map(|_| {
            [
                draw.between(0.0, size_mm[0]),
                draw.between(0.0, size_mm[1]),
                draw.between(-2.0, 2.5),
                draw.between(2.5, 7.0),
            ]
        })
        .collect();
    let ridge = [draw.between(0.0, 3.2), draw.between(0.3, 1.0)];
    let step = if seed % 4 == 3 { 1.5 } else { 0.0 };
    graph(size_mm, pitch_mm, |x, y| {
        let hills: f64 = hills
            .iter()
            .map(|[cx, cy, high, wide]| {
                let (dx, dy) = ((x - cx) / wide, (y - cy) / wide);
                high * libm::exp(-dx * dx - dy * dy)
            })
            .sum();
        let (sine, cosine) = libm::sincos(ridge[0]);
        let across = (x - size_mm[0] / 2.0) * sine - (y - size_mm[1] / 2.0) * cosine;
        let roof = (1.5 - ridge[1] * across.abs()).max(0.0);
        let wall = if x > 0.62 * size_mm[0] { step } else { 0.0 };
        4.0 + hills + roof + wall
    })
}

pub(crate) fn surface((vertices, triangles): &Facets) -> Surface {
    Surface::new(vertices, triangles).unwrap()
}

/// A machine with stock around a surface, and with these tools.
pub(crate) fn machine(surface: &Surface, cutters: &[&str]) -> Machine {
    let [low, high] = surface.bounds_mm();
    let tools = cutters
        .iter()
        .zip(1..)
        .map(|(cutter, number)| {
            let cutter: Cutter = cutter.parse().unwrap();
            let [step_down_mm, step_over_mm] = Tool::usual_steps_mm(&cutter);
            Tool {
                number,
                cutter,
                flutes: 2,
                speed: Speed::Rpm(12_000.0),
                feed: Feed::PerMinute(1200.0),
                plunge_mm_per_min: 300.0,
                step_down_mm,
                step_over_mm,
                cutting_length_mm: None,
                reach_mm: None,
            }
        })
        .collect();
    Machine {
        dialect: Dialect::LinuxCnc,
        program: 1,
        decimals: 4,
        travel: Cuboid {
            x_mm: [0.0, 400.0],
            y_mm: [0.0, 300.0],
            z_mm: [-150.0, 0.0],
        },
        work_offset_mm: [100.0, 100.0, -120.0],
        work_offset_code: 54,
        rapid_mm_per_min: 5000.0,
        max_feed_mm_per_min: 3000.0,
        acceleration_mm_per_s2: Some(500.0),
        spindle_rpm: [1000.0, 24_000.0],
        coolant: false,
        safe_z_mm: high[2] + 15.0,
        stock: Cuboid {
            x_mm: [low[0] - 2.0, high[0] + 2.0],
            y_mm: [low[1] - 2.0, high[1] + 2.0],
            z_mm: [low[2] - 10.0, high[2] + 1.0],
        },
        fixtures: Vec::new(),
        tools,
    }
}

/// A file in binary STL.
pub(crate) fn stl((vertices, triangles): &Facets) -> Vec<u8> {
    let mut file = vec![0; 80];
    file.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        file.extend([0; 12]);
        for &vertex in triangle {
            for coordinate in vertices[vertex] {
                file.extend((coordinate as f32).to_le_bytes());
            }
        }
        file.extend([0; 2]);
    }
    file
}
