//! Surfaces that are there already, and borders that follow the nodes as closely as is asked.

#![allow(clippy::unwrap_used)]

use nurbs::PatchSurface;
use range_image::image::{Lattice, RangeImage};
use range_image::{RegionMap, Unmonitored};
use reconstruct::{
    Evidence, Fitted, ReconstructError, ReconstructSettings, Reconstruction, Surface, check,
};

const COLUMNS: usize = 40;
const ROWS: usize = 30;
const CLOSEST: u8 = 3;

/// A roof with an oblique ridge, each flank one patch.
fn flanks() -> [(PatchSurface, usize); 2] {
    let breaks = |nodes: usize| vec![-5.0, nodes as f64 + 5.0];
    let third = |nodes: usize, k: usize| -5.0 + (nodes as f64 + 10.0) * k as f64 / 3.0;
    [1.0, -1.0].map(|side| {
        let z = |i: usize, j: usize| side * past(third(COLUMNS, i), third(ROWS, j));
        let patch = PatchSurface::through_thirds(breaks(COLUMNS), breaks(ROWS), z);
        (patch.unwrap(), 4)
    })
}

/// Past the ridge of the roof.
fn past(x: f64, y: f64) -> f64 {
    0.3 * (x - 20.3) + 0.1 * (y - 14.6)
}

/// The roof, two of whose nodes far past the ridge are of the other flank.
fn ragged() -> (RangeImage, RegionMap) {
    let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, COLUMNS, ROWS);
    let mut labels = vec![0; COLUMNS * ROWS];
    for (n, label) in labels.iter_mut().enumerate() {
        let (i, j) = (n / ROWS, n % ROWS);
        let past = past(i as f64, j as f64);
        image.set_z_mm(i, j, Some(-past.abs()));
        let is_astray = matches!((i, j), (20 | 21, 15));
        *label = if past < 0.0 || is_astray { 1 } else { 2 };
    }
    let map = RegionMap::new(&image, labels);
    (image, map)
}

fn made(closeness: Option<Vec<u8>>) -> (RegionMap, Reconstruction) {
    let (image, map) = ragged();
    let settings = ReconstructSettings::default();
    let fitted = Fitted::given(&image, &map, &flanks(), &settings, &Unmonitored).unwrap();
    let fitted = match closeness {
        Some(closeness) => fitted.closely(closeness),
        None => fitted,
    };
    let made = fitted
        .reconstruct(Evidence::default(), &Unmonitored)
        .unwrap();
    assert_eq!(check::model(&made.model), Ok(()));
    (map, made)
}

/// Nodes on a face of another region.
fn astray(map: &RegionMap, made: &Reconstruction) -> usize {
    let faces = made
        .face_at
        .iter()
        .map(|k| made.model.faces[*k as usize - 1].region);
    faces.zip(map.raw_labels()).filter(|(a, b)| a != *b).count()
}

#[test]
fn faces_lie_on_the_surfaces_that_are_given() {
    let (map, made) = made(None);
    assert_eq!(made.model.faces.len(), 2);
    for (face, (given, numbers)) in made.model.faces.iter().zip(flanks()) {
        let Surface::Patches(own) = &face.surface;
        assert_eq!(*own, given);
        let fit = made
            .regions
            .iter()
            .find(|fit| fit.label == face.region)
            .unwrap();
        assert_eq!(fit.parameters, numbers);
    }
    // The crease runs where they intersect, past the nodes that have strayed.
    assert!(astray(&map, &made) > 0);
}

#[test]
fn borders_follow_the_nodes_where_that_is_asked() {
    let mut closeness = vec![0; COLUMNS * ROWS];
    closeness[20 * ROWS + 15] = CLOSEST;
    let (map, made) = made(Some(closeness));
    assert_eq!(astray(&map, &made), 0);
}

#[test]
fn a_surface_for_each_region_is_asked_for() {
    let (image, map) = ragged();
    let settings = ReconstructSettings::default();
    let refused = Fitted::given(&image, &map, &flanks()[..1], &settings, &Unmonitored);
    let error = refused.err().unwrap();
    assert_eq!(
        error,
        ReconstructError::Surfaces {
            regions: 2,
            surfaces: 1
        }
    );
    assert_eq!(error.to_string(), "1 surfaces were given for 2 regions");
}

/// A cone of radius 11 on ground that falls away before x = 21, where its foot is the rim of a step: a fifth
/// of the border.
#[test]
fn a_foot_that_becomes_a_step_is_followed_all_around() {
    const SIDE: usize = 60;
    let radius = |x: f64, y: f64| libm::hypot(x - 30.2, y - 29.7);
    let cone = |x: f64, y: f64| 0.9 * (11.0 - radius(x, y));
    let ground = |x: f64, _: f64| -2.0 * (21.0 - x).max(0.0);
    let breaks: Vec<f64> = (0..=2 * (SIDE + 10))
        .map(|k| k as f64 / 2.0 - 5.0)
        .collect();
    let given = [&ground as &dyn Fn(f64, f64) -> f64, &cone].map(|z| {
        let third = |k: usize| k as f64 / 6.0 - 5.0;
        let at = |i: usize, j: usize| z(third(i), third(j));
        let patches = PatchSurface::through_thirds(breaks.clone(), breaks.clone(), at);
        (patches.unwrap(), 4)
    });
    let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, SIDE, SIDE);
    let mut labels = vec![0; SIDE * SIDE];
    for (n, label) in labels.iter_mut().enumerate() {
        let (i, j) = (n / SIDE, n % SIDE);
        let (x, y) = (i as f64, j as f64);
        let is_on_cone = radius(x, y) < 11.0;
        let z = if is_on_cone { cone(x, y) } else { ground(x, y) };
        image.set_z_mm(i, j, Some(z));
        *label = if is_on_cone { 2 } else { 1 };
    }
    let map = RegionMap::new(&image, labels);
    let settings = ReconstructSettings::default();
    let fitted = Fitted::given(&image, &map, &given, &settings, &Unmonitored).unwrap();
    let made = fitted
        .reconstruct(Evidence::default(), &Unmonitored)
        .unwrap();
    assert_eq!(check::model(&made.model), Ok(()));
    let astray = astray(&map, &made);
    // Led straight past the step, 20 of them.
    assert!(astray <= 8, "{astray} nodes");
}
