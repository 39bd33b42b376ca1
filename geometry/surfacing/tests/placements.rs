//! Knots and surfaces of data whose best answer is known.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

mod common;

use common::{draws, face, franke, grid, peaks, waves};
use range_image::{Monitor, Unmonitored};
use std::sync::atomic::{AtomicUsize, Ordering};
use surfacing::{
    Breaks, HeightGrid, Knots, LineKind, Made, Placement, Settings, SurfaceError, fit_with, make,
};

fn made(grid: &HeightGrid, tolerance_mm: f64, placement: Placement) -> Made {
    let settings = Settings {
        placement,
        ..Settings::new(tolerance_mm)
    };
    make(grid, &settings, &Unmonitored).unwrap()
}

/// Fewest control points of any numbers of equal spans that come as near.
fn fewest_uniform(grid: &HeightGrid, max_mm: f64) -> usize {
    let mut fewest = usize::MAX;
    for u in 1..grid.columns() - 3 {
        for v in 1..grid.rows() - 3 {
            let count = (u + 3) * (v + 3);
            let knots = Knots {
                u: Breaks::uniform(grid.columns(), u),
                v: Breaks::uniform(grid.rows(), v),
            };
            if count < fewest && fit_with(grid, &knots).is_ok_and(|(_, max, _)| max <= max_mm) {
                fewest = count;
            }
        }
    }
    fewest
}

#[test]
fn a_cubic_needs_no_inner_knots() {
    let cubic = |x: f64, y: f64| 4.0 - 3.0 * x * x * x + 2.0 * x * y * y - 5.0 * y * y * y + x;
    let grid = grid(30, 25, 0.5, cubic);
    for placement in Placement::ALL {
        let made = made(&grid, 1e-6, placement);
        // The polyline of a curve has vertices whatever its degree.
        if placement != Placement::Polyline {
            assert_eq!(made.report.of_pieces, [[4, 4]], "{placement:?}");
        }
        assert!(
            made.report.max_mm < 1e-11,
            "{placement:?}: {:?}",
            made.report
        );
        let surface = &made.pieces[0].surface;
        // x and y of the surface are its parameters, and z holds between the nodes.
        for (x, y) in [(0.013, 0.987), (0.5, 0.333), (1.0, 0.0)] {
            let place = [-3.0 + 14.5 * x, 5.0 + 12.0 * y];
            let p = surface.evaluate(place[0], place[1]);
            assert!((p[0] - place[0]).abs() < 1e-12 && (p[1] - place[1]).abs() < 1e-12);
            assert!((p[2] - cubic(x, y)).abs() < 1e-10, "{p:?}");
        }
    }
}

#[test]
fn the_knots_of_a_spline_are_found_again() {
    // Cubic splines with two knots along x and one along y.
    let cube = |t: f64| t.max(0.0) * t.max(0.0) * t.max(0.0);
    let spline = |x: f64, y: f64| {
        x * x - 40.0 * cube(x - 0.3) + 90.0 * cube(x - 0.62) + 30.0 * cube(y - 0.45) - y
    };
    let made = made(&grid(81, 61, 0.5, spline), 0.01, Placement::Optimal);
    let knots = &made.pieces[0].knots;
    assert_eq!((knots.u.inner().len(), knots.v.inner().len()), (2, 1));
    for (found, known) in knots.u.inner().iter().zip([24.0, 49.6]) {
        assert!((found - known).abs() < 2.0, "{found} {known}");
    }
    assert!((knots.v.inner()[0] - 27.0).abs() < 2.0, "{knots:?}");
}

#[test]
fn half_as_many_control_points_as_uniform_knots_at_the_same_greatest_error() {
    type Surface = (&'static str, fn(f64, f64) -> f64, f64);
    let surfaces: [Surface; 3] = [
        ("franke", franke, 0.02),
        ("peaks", peaks, 0.1),
        ("face", face, 0.5),
    ];
    for (name, z, tolerance_mm) in surfaces {
        let grid = grid(81, 81, 2.0, z);
        let optimal = made(&grid, tolerance_mm, Placement::Optimal).report;
        assert!(optimal.max_mm <= tolerance_mm, "{name}");
        let uniform = fewest_uniform(&grid, optimal.max_mm);
        assert!(
            2 * optimal.control_points <= uniform,
            "{name}: {} against {uniform}",
            optimal.control_points
        );
    }
}

#[test]
fn a_ridge_does_not_ring() {
    // A roof over its whole length, off the nodes: 12 mm high.
    let roof = |x: f64, y: f64| 12.0 * (1.0 - (x - 0.437).abs() / 0.563) + waves(x, y);
    let grid = grid(81, 61, 1.0, roof);
    let made = made(&grid, 0.02, Placement::Optimal);
    let knots = made.pieces[0].knots.u.inner();
    let at_ridge = knots.iter().filter(|t| (**t - 0.437 * 80.0).abs() < 1e-3);
    assert_eq!(at_ridge.count(), 3, "{knots:?}");
    // Densely across the ridge, between nodes, too.
    let surface = &made.pieces[0].surface;
    let mut overshoot = 0.0_f64;
    for step in 0..=8000 {
        let (x, y) = (f64::from(step) / 8000.0, 0.32);
        let z = surface.evaluate(-3.0 + 80.0 * x, 5.0 + 60.0 * y)[2];
        overshoot = overshoot.max((z - roof(x, y)).abs());
    }
    assert!(overshoot < 0.02 * 12.0, "{overshoot}");
    // The pieces of the surface meet on the ridge.
    let parts = made.pieces[0].parts();
    assert_eq!(parts.len(), 2);
    let ridge = parts[0].u_knots().domain().1;
    assert_eq!(ridge, parts[1].u_knots().domain().0);
    for y in [5.0, 31.7, 65.0] {
        let (a, b) = (parts[0].evaluate(ridge, y), parts[1].evaluate(ridge, y));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}

#[test]
fn a_step_parts_the_surface_and_does_not_ring() {
    let step = |x: f64, y: f64| waves(x, y) + if x > 0.503 { 8.0 } else { 0.0 };
    let made = made(&grid(81, 61, 1.0, step), 0.02, Placement::Optimal);
    assert_eq!(made.report.lines.len(), 1);
    assert_eq!(made.report.lines[0].kind, LineKind::Step);
    assert_eq!(made.pieces.len(), 2);
    assert_eq!(
        (made.pieces[0].columns.end, made.pieces[1].columns.start),
        (41, 41)
    );
    for piece in &made.pieces {
        let (first, last) = piece.surface.u_knots().domain();
        for k in 0..=2000 {
            let x = first + (last - first) * f64::from(k) / 2000.0;
            let share = (x + 3.0) / 80.0;
            let z = piece.surface.evaluate(x, 24.0)[2];
            let truth = step(
                if first > 30.0 {
                    share.max(0.504)
                } else {
                    share
                },
                19.0 / 60.0,
            );
            assert!((z - truth).abs() < 0.02 * 8.0, "{z} {truth} at {x}");
        }
    }
}

#[test]
fn holes_ask_for_no_knots_and_the_rest_is_as_near() {
    let whole = grid(81, 71, 1.0, franke);
    let mut z = whole.raw_z_mm().to_vec();
    for (n, z) in z.iter_mut().enumerate() {
        let (x, y) = ((n / 71) as f64 - 30.0, (n % 71) as f64 - 40.0);
        // A round hole, and the corner beyond an oblique border.
        if x * x + y * y < 150.0 || x + y > 55.0 {
            *z = f64::NAN;
        }
    }
    let holed = whole.with_z(z).unwrap();
    assert!(holed.valid_nodes() < 5000);
    let (full, masked) = (
        made(&whole, 0.1, Placement::Optimal).report,
        made(&holed, 0.1, Placement::Optimal).report,
    );
    assert!(masked.max_mm <= 0.1);
    assert!(
        masked.control_points <= full.control_points + full.control_points / 4,
        "{} {}",
        masked.control_points,
        full.control_points
    );
    // Where there are no data the surface neither swings nor breaks.
    let made = made(&holed, 0.1, Placement::Optimal);
    for (_, _, z) in made.pieces.iter().flat_map(|p| {
        (0..=40).map(move |k| {
            let x = -3.0 + 2.0 * f64::from(k);
            (x, 75.0, p.surface.evaluate(x, 75.0)[2])
        })
    }) {
        assert!(z.abs() < 60.0, "{z}");
    }
}

#[test]
fn noise_asks_for_no_knots_when_the_tolerance_allows_for_it() {
    let clean = grid(101, 101, 1.0, waves);
    let z = clean.raw_z_mm().iter().zip(draws(101 * 101));
    let noisy = clean
        .with_z(z.map(|(z, d)| z + 0.05 * d).collect())
        .unwrap();
    let report = made(&noisy, 0.25, Placement::Optimal).report;
    assert!(
        (report.noise_mm - 0.05).abs() < 0.004,
        "{}",
        report.noise_mm
    );
    assert!(report.control_points <= 64, "{:?}", report.of_pieces);
    // The noise is left in the deviations, where it belongs.
    assert!((report.rms_mm - 0.05).abs() < 0.015, "{}", report.rms_mm);
}

#[test]
fn what_cannot_be_is_told() {
    let grid = grid(20, 20, 1.0, |x, y| franke(x, y) + 3.0 * libm::sin(40.0 * x));
    let refused = |settings: Settings| make(&grid, &settings, &Unmonitored).unwrap_err();
    assert!(matches!(
        refused(Settings::new(0.0)),
        SurfaceError::Setting { .. }
    ));
    let unfair = Settings {
        fair_mm: Some(-1.0),
        ..Settings::new(0.1)
    };
    assert!(refused(unfair).to_string().contains("bound of fairing"));
    match refused(Settings::new(1e-18)) {
        SurfaceError::OutOfReach { best_mm, .. } => assert!(best_mm > 0.0 && best_mm < 1e-10),
        other => panic!("{other}"),
    }
    // With knots at nearly all nodes it does come as near as rounding.
    assert!(made(&grid, 1e-9, Placement::Optimal).report.max_mm <= 1e-9);
}

/// Ends the work when it has been asked so many times whether to.
struct Ends(AtomicUsize);

impl Monitor for Ends {
    fn is_cancelled(&self) -> bool {
        let left = self.0.load(Ordering::Relaxed);
        self.0.store(left.saturating_sub(1), Ordering::Relaxed);
        left == 0
    }

    fn progress(&self, _: f64) {}
}

#[test]
fn the_work_ends_when_it_is_asked_to() {
    let whole = grid(61, 61, 1.0, peaks);
    let mut z = whole.raw_z_mm().to_vec();
    z[1700..1730].fill(f64::NAN);
    let holed = whole.with_z(z).unwrap();
    for grid in [whole, holed] {
        for asked in [0, 10, 100, 1000, 3000] {
            let ends = Ends(AtomicUsize::new(asked));
            let ended = make(&grid, &Settings::new(0.05), &ends);
            assert!(matches!(ended, Err(SurfaceError::Cancelled(_))), "{asked}");
        }
    }
}

#[test]
fn the_result_does_not_depend_on_the_threads() {
    let grid = grid(61, 61, 1.0, peaks);
    let settings = Settings {
        fair_mm: Some(0.05),
        ..Settings::new(0.2)
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| make(&grid, &settings, &Unmonitored).unwrap())
    };
    let (one, four) = (with(1), with(4));
    assert_eq!(one.pieces, four.pieces);
    assert_eq!(one.report, four.report);
}
