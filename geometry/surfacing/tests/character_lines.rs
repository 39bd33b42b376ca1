//! Character lines that run across the grid: pieces end on them, meet there, and do not ring.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

// Surfaces in closed form, as in the other tests.
#[allow(dead_code, reason = "shared with tests that need more of it")]
mod common;

use common::{draws_from, waves};
use range_image::Unmonitored;
use reconstruct::{Surface, check};
use surfacing::{HeightGrid, Made, Settings, make};

const SIDE: usize = 81;
const TOLERANCE_MM: f64 = 0.1;
const NOISE_MM: f64 = 0.02;

/// At a pitch of 1 mm; x and y as shares of the side.
fn made(z: impl Fn(f64, f64) -> f64, seed: u64, first_mm: [f64; 2]) -> Made {
    spaced(z, 1.0, seed, first_mm)
}

fn spaced(z: impl Fn(f64, f64) -> f64, pitch_mm: f64, seed: u64, first_mm: [f64; 2]) -> Made {
    // Seeds that are near to each other begin far apart.
    let mut draw = draws_from(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let share = |k: usize| k as f64 / (SIDE - 1) as f64;
    let z = (0..SIDE * SIDE)
        .map(|n| z(share(n / SIDE), share(n % SIDE)) + NOISE_MM * draw())
        .collect();
    let grid = HeightGrid::new(pitch_mm, first_mm, SIDE, SIDE, z).unwrap();
    make(&grid, &Settings::new(TOLERANCE_MM), &Unmonitored).unwrap()
}

/// Share of the side by which a place is past an oblique line.
fn past(x: f64, y: f64) -> f64 {
    0.8 * (x - 0.45) + 0.6 * (y - 0.52)
}

/// Two pieces, trimmed soundly; each against its own side carried on.
fn holds(made: &Made, sides: [&dyn Fn(f64, f64) -> f64; 2], height_mm: f64) {
    let side_mm = made.data.pitch_mm() * (SIDE - 1) as f64;
    assert!(made.report.max_mm <= TOLERANCE_MM, "{:?}", made.report);
    assert_eq!(made.report.nodes, SIDE * SIDE);
    let model = made.trimmed.as_ref().unwrap();
    assert_eq!(check::model(model), Ok(()));
    assert_eq!(model.faces.len(), 2);
    let lines = made.report.trimmed.unwrap();
    assert_eq!((lines.nodes_across, lines.left_out), (0, 0), "{lines:?}");
    assert_eq!(lines.open_mm, 0.0, "{lines:?}");
    // At every trim, too, each surface is its own side's: no overshoot of a fiftieth of the height.
    for face in &model.faces {
        let Surface::Patches(patches) = &face.surface;
        let mut worst = [0.0_f64; 2];
        for coedge in &face.outer.coedges {
            for [x, y] in coedge.parameter_curve.sampled(8) {
                let first_mm = [made.data.x_mm(0), made.data.y_mm(0)];
                let share = [x - first_mm[0], y - first_mm[1]].map(|mm| mm / side_mm);
                // The outline runs half a pitch beyond the last data points.
                if share.iter().any(|share| !(0.0..=1.0).contains(share)) {
                    continue;
                }
                for (worst, side) in worst.iter_mut().zip(sides) {
                    let off = (patches.z(x, y) - side(share[0], share[1])).abs();
                    *worst = worst.max(off);
                }
            }
        }
        let least = worst[0].min(worst[1]);
        assert!(least < 0.02 * height_mm, "{worst:?}");
    }
}

#[test]
fn oblique_ridges_part_the_surface_into_pieces_that_meet_on_them() {
    // Creases of 17 and 22 degrees.
    for (pitch_mm, fall_mm) in [(1.0, 12.0), (1.6, 25.0)] {
        let left = |x: f64, y: f64| waves(x, y) + fall_mm * (1.0 + past(x, y));
        let right = |x: f64, y: f64| waves(x, y) + fall_mm * (1.0 - past(x, y));
        let z = |x: f64, y: f64| left(x, y).min(right(x, y));
        for seed in 11..14 {
            let made = spaced(z, pitch_mm, seed, [-3.0, 5.0]);
            let height_mm = 0.728 * fall_mm;
            // From the ridge to the farther corner.
            holds(&made, [&left, &right], height_mm);
            assert!(made.report.control_points <= 150, "{:?}", made.report);
            let lines = made.report.trimmed.unwrap();
            assert!(
                (lines.meeting_mm - 101.3 * pitch_mm).abs() < 2.0,
                "{lines:?}"
            );
            assert!(lines.step_mm < pitch_mm, "{lines:?}");
            // The line is the ridge.
            let edges = made.trimmed.iter().flat_map(|model| &model.edges);
            let ridge = edges.filter(|edge| edge.kind == reconstruct::EdgeKind::Crease);
            let side_mm = 80.0 * pitch_mm;
            for [x, y] in ridge.flat_map(|edge| edge.path.sampled(8)) {
                let off_mm = past((x + 3.0) / side_mm, (y - 5.0) / side_mm) * side_mm;
                assert!(off_mm.abs() < pitch_mm, "{off_mm}");
            }
        }
    }
}

#[test]
fn oblique_and_round_steps_part_the_surface_and_do_not_ring() {
    let low = |x: f64, y: f64| waves(x, y);
    let high = |x: f64, y: f64| waves(x, y) + 8.0;
    let oblique = |x: f64, y: f64| past(x, y);
    let round = |x: f64, y: f64| 0.3 - libm::hypot(x - 0.45, y - 0.52);
    let shapes: [&dyn Fn(f64, f64) -> f64; 2] = [&oblique, &round];
    for (is_high, length_mm) in shapes.into_iter().zip([101.3, 150.8]) {
        for seed in 21..24 {
            let z = |x: f64, y: f64| {
                if is_high(x, y) > 0.0 {
                    high(x, y)
                } else {
                    low(x, y)
                }
            };
            let made = made(z, seed, [-3.0, 5.0]);
            holds(&made, [&low, &high], 8.0);
            assert!(made.report.control_points <= 100, "{:?}", made.report);
            let lines = made.report.trimmed.unwrap();
            assert!((lines.step_mm - length_mm).abs() < 3.0, "{lines:?}");
            assert_eq!(lines.meeting_mm, 0.0, "{lines:?}");
        }
    }
}

#[test]
fn a_round_ridge_with_steep_flanks_parts_the_surface_and_does_not_ring() {
    // Both flanks fall by 45 degrees at the ridge; no plane fits any window of the inner one.
    let off = |x: f64, y: f64| {
        let (x, y, radius) = (x - 0.45, y - 0.52, 0.3);
        80.0 * (x * x + y * y - radius * radius) / (2.0 * radius)
    };
    let inside = |x: f64, y: f64| waves(x, y) + off(x, y);
    let outside = |x: f64, y: f64| waves(x, y) - off(x, y);
    let z = |x: f64, y: f64| inside(x, y).min(outside(x, y));
    // Of the first, nodes at the ridge lie on the wrong side of it by their noise.
    for seed in [101, 72, 73] {
        let made = made(z, seed, [-3.0, 5.0]);
        holds(&made, [&inside, &outside], 10.0);
        assert!(made.report.control_points <= 400, "{:?}", made.report);
        let lines = made.report.trimmed.unwrap();
        assert!((lines.meeting_mm - 150.8).abs() < 2.0, "{lines:?}");
        assert!(lines.step_mm < 1.0, "{lines:?}");
    }
}

#[test]
fn a_grid_off_its_lattice_is_trimmed_where_it_lies() {
    let z = |x: f64, y: f64| waves(x, y) + if past(x, y) > 0.0 { 8.0 } else { 0.0 };
    let (on, off) = (made(z, 5, [-3.0, 5.0]), made(z, 5, [-2.73, 5.41]));
    let corners = |made: &Made| {
        let vertices = &made.trimmed.as_ref().unwrap().vertices;
        vertices
            .iter()
            .map(|v| [v.x_mm, v.y_mm])
            .collect::<Vec<_>>()
    };
    for (a, b) in corners(&on).iter().zip(corners(&off)) {
        assert!((b[0] - a[0] - 0.27).abs() < 1e-9 && (b[1] - a[1] - 0.41).abs() < 1e-9);
    }
    assert_eq!(check::model(off.trimmed.as_ref().unwrap()), Ok(()));
}

#[test]
fn lines_along_the_grid_and_smooth_shapes_are_not_trimmed() {
    let along = |x: f64, y: f64| waves(x, y) + if x > 0.503 { 8.0 } else { 0.0 };
    assert_eq!(made(along, 3, [0.0; 2]).trimmed, None);
    let smooth = made(waves, 3, [0.0; 2]);
    assert_eq!((smooth.trimmed, smooth.pieces.len()), (None, 1));
}
