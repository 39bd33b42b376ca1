//! Whatever the labels of a range image, the triangles of its model are sound.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

mod common;

use common::sound;
use range_image::image::{Lattice, RangeImage};
use range_image::{RegionMap, Unmonitored};
use reconstruct::{Method, Model, ReconstructError, ReconstructSettings, Surface, reconstruct};
use tessellate::{Mesh, TessellateSettings, tessellate};

/// Noise that depends on the node alone: about normal, standard deviation 1.
fn noise(column: usize, row: usize, seed: u64) -> f64 {
    let mut state = seed ^ ((column as u64) << 32) ^ row as u64;
    let mut sum = 0.0;
    for _ in 0..12 {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        sum += ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
    }
    sum - 6.0
}

/// Blobs of labels on a wavy surface, with a share of nodes thrown at random.
fn model(seed: u64, method: Method) -> Option<Model> {
    let (columns, rows) = (30 + seed as usize % 17, 36);
    let labels = 1 + (seed % 5) as u16;
    let salt = [0.0, 0.0, 0.05, 0.3][seed as usize % 4];
    let seed = seed * 1000 + 17;
    let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -7, 3, columns, rows);
    let wave = |c: usize, r: usize, s: u64| {
        let (a, b) = (noise(1, 1, seed + s) * 0.3, noise(2, 2, seed + s) * 0.3);
        libm::sin(a * c as f64 + b * r as f64 + noise(3, 3, seed + s) * 3.0)
    };
    let mut all = Vec::new();
    for c in 0..columns {
        for r in 0..rows {
            let height = wave(c, r, 10) + wave(c, r, 20) + wave(c, r, 30);
            let mut label = ((height + 3.0) / 6.0 * f64::from(labels + 1)).floor() as u16;
            if noise(c, r, seed + 40).abs() < salt {
                label = (noise(c, r, seed + 50).abs() * 1000.0) as u16 % (labels + 1);
            }
            if label > 0 {
                image.set_z_mm(c, r, Some(height + 0.05 * noise(c, r, seed + 60)));
            }
            all.push(label);
        }
    }
    let map = RegionMap::new(&image, all);
    let settings = ReconstructSettings {
        method,
        ..Default::default()
    };
    match reconstruct(&image, &map, &settings, &Unmonitored) {
        Ok(done) => Some(done.model),
        Err(ReconstructError::NoFaces { .. } | ReconstructError::NoRegions) => None,
        Err(error) => panic!("{error}"),
    }
}

/// Area of a face as the camera sees it, by the integral of x dy along its borders.
fn seen_area_mm2(face: &reconstruct::Face) -> f64 {
    let loops = core::iter::once(&face.outer).chain(&face.inner);
    let curves = loops.flat_map(|border| border.coedges.iter().map(|c| &c.parameter_curve));
    let mut area = 0.0;
    for curve in curves {
        let points = curve.sampled(64);
        area += points
            .windows(2)
            .map(|p| (p[0][0] + p[1][0]) / 2.0 * (p[1][1] - p[0][1]))
            .sum::<f64>();
    }
    area
}

fn check(model: &Model, mesh: &Mesh, tolerance_mm: f64) {
    sound(mesh);
    assert_eq!(mesh.faces.len(), model.faces.len());
    for (face, triangles) in model.faces.iter().zip(&mesh.faces) {
        assert_eq!(
            (&face.name, face.region),
            (&triangles.name, triangles.region)
        );
        let Surface::Patches(surface) = &face.surface;
        // Within the tolerance all along the border.
        let mut seen = 0.0;
        let mut rim = 0.0;
        for triangle in triangles.triangles() {
            let [a, b, c] = mesh.corners_mm(triangle);
            seen += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0;
        }
        for edge in face
            .outer
            .coedges
            .iter()
            .chain(face.inner.iter().flat_map(|l| &l.coedges))
        {
            rim += edge.parameter_curve.arc_length();
        }
        let off = (seen - seen_area_mm2(face)).abs();
        assert!(off <= rim * tolerance_mm, "{}: {off} mm2", face.name);
        // Every vertex lies on the surface, but for half of what neighbours are apart.
        for corner in &triangles.corners {
            let [x, y, z] = mesh.vertices_mm[corner.vertex as usize];
            let off = (surface.z(x, y) - z).abs();
            assert!(
                off <= mesh.accuracy.seam_mm + 1e-9,
                "{}: {off} mm",
                face.name
            );
        }
    }
    assert!(mesh.accuracy.seam_mm <= TessellateSettings::default().sharing_mm);
}

#[test]
fn blobs_and_salt() {
    let mut models = 0;
    for seed in 0..30 {
        let method = if seed % 3 == 0 {
            Method::ShimLee
        } else {
            Method::Relief
        };
        let Some(model) = model(seed, method) else {
            continue;
        };
        models += 1;
        let settings = TessellateSettings {
            tolerance_mm: [0.01, 0.1, 0.5][seed as usize % 3],
            ..TessellateSettings::default()
        };
        match tessellate(&model, &settings, &Unmonitored) {
            Ok(mesh) => check(&model, &mesh, settings.tolerance_mm),
            Err(error) => panic!("seed {seed}: {error}"),
        }
    }
    assert!(models > 20);
}

#[test]
fn the_same_model_gives_the_same_triangles_whatever_the_threads() {
    let model = model(7, Method::Relief).unwrap();
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| tessellate(&model, &TessellateSettings::default(), &Unmonitored).unwrap())
    };
    let (one, four) = (in_pool(1), in_pool(4));
    assert!(one == four);
    let bits = |mesh: &Mesh| -> Vec<u64> {
        mesh.vertices_mm
            .iter()
            .flatten()
            .map(|c| c.to_bits())
            .collect()
    };
    assert_eq!(bits(&one), bits(&four));
}
