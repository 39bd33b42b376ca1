//! A block with sloping sides and a boss, as a mesh and as the simulated scanner sees it.

#![allow(dead_code, reason = "each test file uses its own part")]

use std::sync::LazyLock;

use compare::{Alignment, CompareSettings, Comparison, Nominal, Tolerance, compare};
use range_image::{Column, RangeImage, Sample, Unmonitored};
use regrid::RegridSettings;
use sim_scanner::Vec3;
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scene::{Body, Material, Mesh, Scene};

/// Vertices and facets.
pub(crate) type Facets = (Vec<[f64; 3]>, Vec<[usize; 3]>);

/// What is wrong with a part: a place, a width and a depth (negative) or height, in mm. Smooth as
/// a wave of a cosine, or flat with sides that rise over a tenth of the width.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dent {
    pub(crate) at_mm: [f64; 2],
    pub(crate) width_mm: f64,
    pub(crate) height_mm: f64,
    pub(crate) is_flat: bool,
}

impl Dent {
    fn height_mm(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.at_mm[0], y - self.at_mm[1]);
        let share = (dx * dx + dy * dy).sqrt() / (self.width_mm / 2.0);
        if share >= 1.0 {
            0.0
        } else if self.is_flat {
            self.height_mm * ((1.0 - share) * 5.0).min(1.0)
        } else {
            self.height_mm * (1.0 + libm::cos(core::f64::consts::PI * share)) / 2.0
        }
    }
}

/// The upper surface: a roof with hips of unequal slopes on a step of 10 mm, and a boss with a
/// rounded top. No symmetry.
pub(crate) fn top_mm(x: f64, y: f64) -> f64 {
    let roof = (0.35 * (x + 50.0))
        .min(0.5 * (50.0 - x))
        .min(0.6 * (y + 50.0))
        .min(12.0);
    let step = if y > 25.0 && x < 20.0 { -10.0 } else { 0.0 };
    let (dx, dy) = (x + 15.0, y + 10.0);
    let boss = 8.0 - (dx * dx + dy * dy) / 40.0;
    roof.max(0.0) + step + boss.max(0.0)
}

/// A closed mesh between the surface and z = -20 over 100 x 100 mm, nodes a half millimetre apart.
pub(crate) fn block(dents: &[Dent]) -> Facets {
    const NODES: usize = 201;
    let at = |i: usize| -50.0 + 100.0 * i as f64 / (NODES - 1) as f64;
    let mut vertices = Vec::new();
    for i in 0..NODES {
        for j in 0..NODES {
            let (x, y) = (at(i), at(j));
            let z = top_mm(x, y) + dents.iter().map(|d| d.height_mm(x, y)).sum::<f64>();
            vertices.push([x, y, z]);
        }
    }
    let top = |i: usize, j: usize| i * NODES + j;
    let mut facets = Vec::new();
    for i in 0..NODES - 1 {
        for j in 0..NODES - 1 {
            let [a, b, c, d] = [top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1)];
            facets.push([a, b, c]);
            facets.push([a, c, d]);
        }
    }
    // The rim, counter-clockwise from above, each node with its foot.
    let last = NODES - 1;
    let mut rim: Vec<usize> = (0..last).map(|i| top(i, 0)).collect();
    rim.extend((0..last).map(|j| top(last, j)));
    rim.extend((0..last).map(|i| top(last - i, last)));
    rim.extend((0..last).map(|j| top(0, last - j)));
    let feet = vertices.len();
    for &node in &rim {
        let [x, y, _] = vertices[node];
        vertices.push([x, y, -20.0]);
    }
    let middle = vertices.len();
    vertices.push([0.0, 0.0, -20.0]);
    for k in 0..rim.len() {
        let next = (k + 1) % rim.len();
        facets.push([rim[k], feet + k, feet + next]);
        facets.push([rim[k], feet + next, rim[next]]);
        facets.push([feet + next, feet + k, middle]);
    }
    (vertices, facets)
}

/// The noise of the acceptance test.
pub(crate) fn noise() -> Overrides {
    Overrides {
        noise_mm: Some(0.05),
        outliers: Some(0.02),
        mixed: Some(0.1),
        dropouts: Some(0.01),
        ..Overrides::default()
    }
}

/// Columns of a simulated scan of a part.
pub(crate) fn scan((vertices, facets): &Facets, overrides: &Overrides, seed: u64) -> Vec<Column> {
    let vertices = vertices.iter().map(|&v| Vec3::from_array(v)).collect();
    let mesh = Mesh::one_face(vertices, facets.iter().copied()).expect("a mesh");
    let scene = Scene::new(vec![Body::Mesh(Box::new(mesh))], Material::PLASTER);
    let (scanner, sweep) = Preset::Paper
        .set_up(scene, overrides, seed)
        .expect("it is in view");
    let columns = (0..sweep.columns).map(|index| {
        let column = scanner.column(&sweep, 0, index);
        let samples = column.samples.iter().filter(|sample| !sample.no_return);
        let samples = samples.map(|sample| {
            let point = scanner.reported_point_mm(&column, sample);
            Sample {
                y_mm: point.y,
                z_mm: point.z,
                intensity: sample.intensity,
            }
        });
        Column::new(scanner.x_mm(column.table_counts), samples.collect())
    });
    columns.collect()
}

/// The range image of a scan.
pub(crate) fn regridded(columns: &[Column]) -> RangeImage {
    let settings = RegridSettings::with_pitch(0.5);
    regrid::regrid(columns.iter().cloned(), &settings, &Unmonitored).expect("columns in order")
}

/// The same part, elsewhere.
pub(crate) fn moved((vertices, facets): &Facets, pose: &compare::Pose) -> Facets {
    let vertices = vertices.iter().map(|&vertex| pose.apply(vertex));
    (vertices.collect(), facets.clone())
}

/// A dent of twice the noise.
pub(crate) const DENT: Dent = Dent {
    at_mm: [12.0, -14.0],
    width_mm: 5.0,
    height_mm: -0.1,
    is_flat: true,
};

/// The block without a dent.
pub(crate) fn nominal() -> &'static Nominal {
    static NOMINAL: LazyLock<Nominal> = LazyLock::new(|| {
        let (vertices, facets) = block(&[]);
        Nominal::new(&vertices, &facets).expect("a closed mesh")
    });
    &NOMINAL
}

/// A scan of the block, regridded and as it was taken.
pub(crate) fn taken(dents: &[Dent], seed: u64) -> (RangeImage, Vec<Column>) {
    let columns = scan(&block(dents), &noise(), seed);
    (regridded(&columns), columns)
}

/// A scan held against the block.
pub(crate) fn held(
    (image, columns): &(RangeImage, Vec<Column>),
    alignment: Alignment,
    tolerance: Option<Tolerance>,
) -> Comparison {
    let settings = CompareSettings {
        alignment,
        tolerance,
        ..CompareSettings::default()
    };
    compare(image, columns, nominal(), &settings, &Unmonitored).expect("they fit")
}
