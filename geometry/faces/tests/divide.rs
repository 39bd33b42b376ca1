//! Regions taken apart and joined where their surfaces are known.

use faces::{Observations, divide};
use nalgebra::Vector3;
use range_image::{Lattice, NodeQuality, RangeImage, RegionMap, Unmonitored};
use shapes::Sample;

const PITCH_MM: f64 = 0.45;
const NOISE_MM: f64 = 0.05;
const SIDE: usize = 70;

/// Random numbers, the same in every run.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normal, by the sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A scan of a surface, z by x and y in millimetres, with these labels.
fn divided(
    z_mm: impl Fn(f64, f64) -> f64,
    label: impl Fn(usize, usize) -> u16,
) -> (RangeImage, RegionMap) {
    let mut random = Random(7);
    let lattice = Lattice { pitch_mm: PITCH_MM };
    let mut image = RangeImage::masked(lattice, 0, 0, SIDE, SIDE);
    let (mut samples, mut labels) = (Vec::new(), Vec::new());
    for column in 0..SIDE {
        for row in 0..SIDE {
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            let node_noise_mm = 0.2 * NOISE_MM * random.normal();
            image.set_z_mm(column, row, Some(z_mm(x, y) + node_noise_mm));
            let quality = NodeQuality {
                inliers: 20,
                samples: 22,
                scale_mm: NOISE_MM as f32,
                nearest_mm: 0.1,
            };
            image.set_quality(column, row, quality);
            let (x, y) = (
                x + PITCH_MM * (random.uniform() - 0.5),
                y + PITCH_MM * (random.uniform() - 0.5),
            );
            let sample = Sample {
                point_mm: Vector3::new(x, y, z_mm(x, y) + NOISE_MM * random.normal()),
                ray: Vector3::z(),
                sigma_mm: NOISE_MM,
            };
            samples.push((column * SIDE + row, sample));
            labels.push(label(column, row));
        }
    }
    let observations = Observations::new(SIDE * SIDE, &samples, 1.0);
    let regions = RegionMap::new(&image, labels);
    let divided = divide(&image, &regions, &observations, &Unmonitored).expect("not cancelled");
    (image, divided.regions)
}

/// Two planes at a right angle, seen at 45 degrees each, with a fillet of 6 mm between them: from
/// x = 15.75 mm on so far to either side.
const MIDDLE_MM: f64 = 15.75;
const RADIUS_MM: f64 = 6.0;

fn filleted(x: f64, _: f64) -> f64 {
    let half = RADIUS_MM * core::f64::consts::FRAC_1_SQRT_2;
    let from = (x - MIDDLE_MM).abs();
    if from > half {
        half - from
    } else {
        libm::sqrt(RADIUS_MM * RADIUS_MM - from * from) - half
    }
}

#[test]
fn a_fillet_is_taken_from_its_planes() {
    let (image, regions) = divided(filleted, |_, _| 1);
    assert_eq!(regions.regions(), 3, "{:?}", regions.node_counts());
    let half = RADIUS_MM * core::f64::consts::FRAC_1_SQRT_2;
    let (mut wrong, mut far) = (0, 0.0_f64);
    for column in 0..SIDE {
        let from = image.x_mm(column) - MIDDLE_MM;
        for row in 0..SIDE {
            let expected = match from {
                from if from < -half => 1,
                from if from <= half => 2,
                _ => 3,
            };
            if regions.label(column, row) != expected {
                wrong += 1;
                far = far.max((from.abs() - half).abs());
            }
        }
    }
    // Where the planes go over into the fillet they are off it by 0.03 mm at 0.6 mm.
    assert!(wrong < SIDE * SIDE / 25, "{wrong} nodes, up to {far} mm");
    assert!(far < 3.0 * PITCH_MM, "{far}");
}

#[test]
fn what_is_of_one_surface_stays_whole() {
    let plane = |x: f64, y: f64| 0.2 * x - 0.1 * y;
    assert_eq!(divided(plane, |_, _| 1).1.regions(), 1);
    let waves = |x: f64, y: f64| 1.5 * libm::sin(x / 9.0) * libm::cos(y / 8.0);
    assert_eq!(divided(waves, |_, _| 1).1.regions(), 1);
}

#[test]
fn a_plate_that_a_scanner_sees_wavy_stays_whole() {
    // Strips of it are planes, turned by 2 degrees against each other.
    let wavy = |x: f64, _: f64| 0.1 * x + 0.08 * libm::asin(libm::sin(x / 4.0));
    assert_eq!(divided(wavy, |_, _| 1).1.regions(), 1);
}

#[test]
fn a_surface_that_was_cut_is_joined_and_another_is_not() {
    let cylinder = |x: f64, _: f64| libm::sqrt(40.0 * 40.0 - (x - MIDDLE_MM).powi(2));
    let halves = |column, _| if column < SIDE / 3 { 1 } else { 2 };
    assert_eq!(divided(cylinder, halves).1.regions(), 1);
    let (_, roof) = divided(|x, _| -0.2 * (x - MIDDLE_MM).abs(), halves);
    assert_eq!(roof.regions(), 2);
    // The border was a third in; the ridge is in the middle.
    let counts = roof.node_counts();
    let even = counts
        .iter()
        .filter(|count| count.abs_diff(SIDE * SIDE / 2) < 2 * SIDE);
    assert_eq!(even.count(), 2, "{counts:?}");
}

#[test]
fn a_border_stays_where_it_is_between_regions_that_are_whole() {
    // One column beside the ridge.
    let halves = |column, _| if column < SIDE / 2 - 1 { 1 } else { 2 };
    let (_, roof) = divided(|x, _| -0.2 * (x - MIDDLE_MM).abs(), halves);
    let moved = (0..SIDE)
        .flat_map(|column| (0..SIDE).map(move |row| (column, row)))
        .filter(|&(column, row)| roof.label(column, row) != halves(column, row));
    assert_eq!(moved.count(), 0);
}

#[test]
fn a_rim_is_taken_from_the_plane_that_it_hardly_disturbs() {
    let (edge_mm, from_mm) = (27.0, 22.0);
    let rounded = |x: f64, y: f64| {
        let over = if y < from_mm {
            0.0
        } else {
            (x - edge_mm).max(0.0)
        };
        libm::sqrt(RADIUS_MM * RADIUS_MM - over * over)
    };
    let (image, regions) = divided(rounded, |_, _| 1);
    assert_eq!(regions.regions(), 2, "{:?}", regions.node_counts());
    let is_right = |column: usize, row: usize| {
        let is_rim = image.x_mm(column) >= edge_mm && image.y_mm(row) >= from_mm;
        (regions.label(column, row) == 1) != is_rim
    };
    let nodes = (0..SIDE * SIDE).map(|k| (k / SIDE, k % SIDE));
    let right = nodes
        .filter(|(column, row)| is_right(*column, *row))
        .count();
    assert!(right > SIDE * SIDE - SIDE, "{right}");
}

#[test]
fn nodes_at_a_ragged_border_go_to_the_surface_that_they_lie_on() {
    let ridge = (MIDDLE_MM / PITCH_MM).round() as usize;
    // The second was cut, and is joined.
    let ragged = |column, row| {
        if column + row * 7 % 3 < ridge + 1 {
            1
        } else if row < SIDE / 2 {
            2
        } else {
            3
        }
    };
    let (_, regions) = divided(|x, _| -0.2 * (x - MIDDLE_MM).abs(), ragged);
    assert_eq!(regions.regions(), 2);
    let is_wrong = |column: usize, row: usize| {
        column != ridge && (regions.label(column, row) == 1) != (column < ridge)
    };
    let wrong = (0..SIDE * SIDE)
        .filter(|k| is_wrong(k / SIDE, k % SIDE))
        .count();
    assert!(wrong <= 3, "{wrong}");
}
