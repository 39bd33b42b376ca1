//! Whatever the labels, the model keeps its promises.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::common;

use common::noise;
use range_image::image::{Lattice, RangeImage};
use range_image::{RegionMap, Unmonitored};
use reconstruct::{Method, ReconstructError, ReconstructSettings, check, reconstruct};

/// Blobs of labels with a share of nodes thrown at random.
fn map(seed: u64, columns: usize, rows: usize, labels: u16, salt: f64) -> (RangeImage, RegionMap) {
    let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -7, 3, columns, rows);
    let wave = |c: usize, r: usize, s: u64| {
        let (a, b) = (noise(1, 1, seed + s) * 0.3, noise(2, 2, seed + s) * 0.3);
        libm::sin(a * c as f64 + b * r as f64 + noise(3, 3, seed + s) * 3.0)
    };
    let mut all = Vec::with_capacity(columns * rows);
    for c in 0..columns {
        for r in 0..rows {
            let height = wave(c, r, 10) + wave(c, r, 20) + wave(c, r, 30);
            let mut label = ((height + 3.0) / 6.0 * f64::from(labels + 1)).floor() as u16;
            if noise(c, r, seed + 40).abs() < salt {
                label = (noise(c, r, seed + 50).abs() * 1000.0) as u16 % (labels + 1);
            }
            if label > 0 {
                let z = height + 0.05 * noise(c, r, seed + 60);
                image.set_z_mm(c, r, Some(z));
            }
            all.push(label);
        }
    }
    let map = RegionMap::new(&image, all);
    (image, map)
}

fn keeps_its_promises(image: &RangeImage, map: &RegionMap, settings: &ReconstructSettings) {
    match reconstruct(image, map, settings, &Unmonitored) {
        Ok(done) => {
            if let Err(faults) = check::model(&done.model) {
                let regions: Vec<_> = map.raw_labels().chunks(map.rows()).collect();
                for r in (0..map.rows()).rev() {
                    let line: String = regions
                        .iter()
                        .map(|c| char::from_digit(u32::from(c[r]) % 36, 36).unwrap())
                        .collect();
                    println!("{line}");
                }
                panic!(
                    "{} faults: {:?}",
                    faults.len(),
                    &faults[..faults.len().min(5)]
                );
            }
            assert!(done.restored.valid_nodes() > 0);
        }
        Err(ReconstructError::NoFaces { .. } | ReconstructError::NoRegions) => {}
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn blobs_and_salt() {
    for seed in 0..200 {
        let labels = 1 + (seed % 5) as u16;
        let salt = [0.0, 0.0, 0.05, 0.3][seed as usize % 4];
        let (image, map) = map(seed * 1000, 30 + seed as usize % 17, 36, labels, salt);
        let method = if seed % 3 == 0 {
            Method::ShimLee
        } else {
            Method::Relief
        };
        let settings = ReconstructSettings {
            method,
            ..Default::default()
        };
        keeps_its_promises(&image, &map, &settings);
    }
}

#[test]
fn pure_salt_and_pepper() {
    for seed in 0..40 {
        let (image, map) = map(seed * 777 + 5, 24, 24, 3, 9.0);
        for min_piece_nodes in [4, 12] {
            let settings = ReconstructSettings {
                min_piece_nodes,
                min_hole_nodes: 1,
                ..Default::default()
            };
            keeps_its_promises(&image, &map, &settings);
        }
    }
}

#[test]
fn the_same_input_gives_the_same_model() {
    let (image, map) = map(4242, 60, 50, 4, 0.05);
    let settings = ReconstructSettings::default();
    let first = reconstruct(&image, &map, &settings, &Unmonitored).unwrap();
    let second = reconstruct(&image, &map, &settings, &Unmonitored).unwrap();
    assert!(first.model == second.model);
    let bits = |r: &RangeImage| r.raw_z_mm().iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    assert!(bits(&first.restored) == bits(&second.restored));
    assert_eq!(first.metrics, second.metrics);
}
