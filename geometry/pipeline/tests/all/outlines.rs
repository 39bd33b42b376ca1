//! Outlines are settled by samples, and the nodes beside them by the outlines.

use pipeline::{Outcome, Settings, process, process_columns};
use range_image::{Column, RangeImage, Sample, Unmonitored};
use reconstruct::EdgeOrigin;

const PITCH_MM: f64 = 0.5;

/// A tilted plane seen where `is_there` says so.
fn columns(is_there: impl Fn(f64, f64) -> bool) -> Vec<Column> {
    scanned(|x_mm, y_mm| is_there(x_mm, y_mm).then_some(10.0 + 0.2 * x_mm - 0.1 * y_mm))
}

/// A surface z(x, y), at heights that differ from column to column.
fn scanned(z_mm: impl Fn(f64, f64) -> Option<f64>) -> Vec<Column> {
    (-60..=60)
        .map(|i| {
            let x_mm = PITCH_MM * f64::from(i);
            let samples = (-66..=66).filter_map(|j| {
                // As of a laser whose angle is stepped.
                let i = f64::from(i);
                let t = f64::from(j) + (0.37 * i + 0.0123 * i * i).fract();
                let y_mm = 0.45 * t * (1.0 + 0.001 * t);
                z_mm(x_mm, y_mm).map(|z_mm| Sample {
                    y_mm,
                    z_mm,
                    intensity: 200,
                })
            });
            Column::new(x_mm, samples.collect())
        })
        .collect()
}

fn made(columns: &[Column]) -> (RangeImage, Outcome) {
    process_columns(columns, &Settings::new(PITCH_MM), &Unmonitored).expect("a plane is met")
}

/// How far a model of one face lies off an outline, root mean square, pitches; `off_mm` is how
/// far a point lies outside.
fn rms_pitches(outcome: &Outcome, off_mm: impl Fn(f64, f64) -> f64) -> f64 {
    let model = &outcome.reconstruction.model;
    assert_eq!(model.faces.len(), 1);
    let offs: Vec<f64> = model
        .edges
        .iter()
        .flat_map(|edge| edge.path.sampled(2_000))
        .map(|[x, y]| off_mm(x, y) / PITCH_MM)
        .collect();
    (offs.iter().map(|off| off * off).sum::<f64>() / offs.len() as f64).sqrt()
}

/// Nodes on the wrong side of an outline in the nodes that the reconstruction is held against.
fn wrong_nodes(image: &RangeImage, off_mm: impl Fn(f64, f64) -> f64) -> usize {
    let nodes = (0..image.columns()).flat_map(|c| (0..image.rows()).map(move |r| (c, r)));
    nodes
        .filter(|&(column, row)| {
            let is_there = off_mm(image.x_mm(column), image.y_mm(row)) < 0.0;
            is_there != image.z_mm(column, row).is_some()
        })
        .count()
}

fn holds(off_mm: impl Fn(f64, f64) -> f64 + Copy, most_pitches: f64) {
    let (image, by_samples) = made(&columns(|x, y| off_mm(x, y) < 0.0));
    let by_nodes = process(&image, &Settings::new(PITCH_MM), &Unmonitored).expect("a plane is met");
    assert!(by_nodes.settled.is_none());

    let rms = [&by_samples, &by_nodes].map(|outcome| rms_pitches(outcome, off_mm));
    assert!(rms[0] < most_pitches, "{rms:?}");
    assert!(rms[0] < 0.7 * rms[1], "{rms:?}");

    let settled = by_samples
        .settled
        .as_ref()
        .expect("samples settle the outlines");
    assert!(settled.dropped + settled.filled > 0);
    let wrong = [&settled.image, &image].map(|image| wrong_nodes(image, off_mm));
    assert!(2 * wrong[0] < wrong[1], "{wrong:?}");
    // A node that got a value got that of the plane.
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            let Some(z_mm) = settled.image.z_mm(column, row) else {
                continue;
            };
            let plane_mm = 10.0 + 0.2 * image.x_mm(column) - 0.1 * image.y_mm(row);
            assert!((z_mm - plane_mm).abs() < 0.01, "{column}, {row}: {z_mm}");
        }
    }
    // What the reconstruction is held against is the settled image.
    let metrics = &by_samples.reconstruction.metrics;
    assert_eq!((metrics.lost_nodes, metrics.invented_nodes), (0, 0));
}

#[test]
fn a_circle_is_found_between_the_nodes() {
    holds(|x, y| libm::hypot(x - 0.13, y + 0.07) - 20.3, 0.03);
}

#[test]
fn a_turned_square_is_found_between_the_nodes() {
    let (sin, cos) = libm::sincos(0.3);
    holds(
        |x, y| {
            let (a, b) = (cos * x + sin * y - 0.1, cos * y - sin * x + 0.2);
            a.abs().max(b.abs()) - 17.2
        },
        0.03,
    );
}

#[test]
fn a_slot_is_found_better_than_by_nodes() {
    let (sin, cos) = libm::sincos(0.2);
    let off_mm = |x: f64, y: f64| {
        let (a, b) = (cos * x + sin * y - 0.1, cos * y - sin * x + 0.2);
        libm::hypot((a.abs() - 10.0).max(0.0), b) - 11.3
    };
    let (image, outcome) = made(&columns(|x, y| off_mm(x, y) < 0.0));
    let by_nodes = process(&image, &Settings::new(PITCH_MM), &Unmonitored).expect("a plane is met");
    let rms = [&outcome, &by_nodes].map(|outcome| rms_pitches(outcome, off_mm));
    assert!(rms[0] < 0.1 && rms[0] < 0.7 * rms[1], "{rms:?}");
}

/// Whether any outline of a model was told by samples.
fn is_told(outcome: &Outcome) -> bool {
    let edges = &outcome.reconstruction.model.edges;
    edges.iter().any(|edge| edge.origin == EdgeOrigin::Measured)
}

#[test]
fn a_plate_before_a_table_ends_where_the_samples_say() {
    let off_mm = |x: f64, y: f64| libm::hypot(x - 0.13, y + 0.07) - 15.3;
    let columns = scanned(|x, y| {
        Some(if off_mm(x, y) < 0.0 {
            12.0 + 0.2 * x
        } else {
            0.0
        })
    });
    let (_, outcome) = made(&columns);
    assert!(
        !outcome.background.regions.is_empty(),
        "the table is left out"
    );
    assert!(is_told(&outcome));
    let rms = rms_pitches(&outcome, off_mm);
    assert!(rms < 0.03, "{rms}");
}

#[test]
fn the_foot_of_a_part_is_told_by_no_samples() {
    // A frustum on a table: samples go on from its flank to the table.
    let radius = |x: f64, y: f64| libm::hypot(x - 0.13, y + 0.07);
    let stray = |x: f64, y: f64| 0.02 * libm::sin(1e4 * x) * libm::sin(1e5 * y);
    let columns = scanned(|x, y| Some((22.3 - radius(x, y)).clamp(0.0, 9.0) + stray(x, y)));
    let (_, outcome) = made(&columns);
    assert!(
        !outcome.background.regions.is_empty(),
        "the table is left out"
    );
    assert!(!is_told(&outcome));
    let model = &outcome.reconstruction.model;
    let outer = model.edges.iter().flat_map(|edge| edge.path.sampled(500));
    let outer: Vec<f64> = outer
        .map(|[x, y]| radius(x, y))
        .filter(|r| *r > 18.0)
        .collect();
    assert!(outer.len() >= 500);
    let farthest = outer.iter().map(|r| (r - 22.3).abs()).fold(0.0, f64::max);
    assert!(farthest < PITCH_MM, "{farthest}");
}

#[test]
fn what_lies_beyond_the_region_of_interest_is_not_there() {
    // Columns beyond it lie near the outline that it cuts.
    for limit_mm in [10.0, 10.1, 10.2, 10.3, 10.4] {
        let columns = columns(|_, _| true);
        let mut settings = Settings::new(PITCH_MM);
        settings.regrid.roi.x_mm = (-limit_mm, limit_mm);
        settings.regrid.roi.y_mm = (-7.3, 8.1);
        let (_, outcome) = process_columns(&columns, &settings, &Unmonitored).expect("a plane");
        let model = &outcome.reconstruction.model;
        assert!(is_told(&outcome), "it ends like any other surface");
        // Up to the place of the first sample that is left out.
        let farthest_mm = [10.5, 8.1 + PITCH_MM];
        for [x, y] in model.edges.iter().flat_map(|edge| edge.path.sampled(500)) {
            assert!(x.abs() < farthest_mm[0], "{x} beyond {limit_mm}");
            assert!(y < farthest_mm[1] && y > -7.3 - PITCH_MM, "{y}");
        }
    }
}

/// A wedge of 16 degrees stands 2 mm above a plane, its tip at (-20, 1).
#[test]
fn a_round_part_ends_where_it_turns_away_though_its_light_falls_off_before() {
    const RADIUS_MM: f64 = 20.0;
    let half_mm = RADIUS_MM * libm::sin(75_f64.to_radians());
    let z_mm = |_: f64, y: f64| (y.abs() < half_mm).then(|| (RADIUS_MM * RADIUS_MM - y * y).sqrt());
    let dimmed = |sample: &Sample| Sample {
        intensity: (200.0 * (sample.z_mm / RADIUS_MM).powi(2)) as u8,
        ..*sample
    };
    let columns: Vec<Column> = scanned(z_mm)
        .iter()
        .map(|c| Column::new(c.x_mm(), c.samples().iter().map(dimmed).collect()))
        .collect();
    let (_, outcome) = made(&columns);
    let edges = outcome.reconstruction.model.edges.iter();
    let offs: Vec<f64> = edges
        .flat_map(|edge| edge.path.sampled(2_000))
        .filter(|[x, _]| x.abs() < 25.0)
        .map(|[_, y]| (y.abs() - half_mm) / PITCH_MM)
        .collect();
    assert!(offs.len() > 2_000);
    let rms = (offs.iter().map(|off| off * off).sum::<f64>() / offs.len() as f64).sqrt();
    assert!(rms < 0.1, "{rms}");
}

#[test]
fn the_tip_of_a_wedge_is_its_own() {
    let in_wedge = |x: f64, y: f64| x < 22.0 && (y - 1.0).abs() < 0.14 * (x + 20.0);
    let plane_mm = |x: f64, y: f64| 10.0 + 0.2 * x - 0.1 * y;
    let scan = scanned(|x, y| Some(plane_mm(x, y) + if in_wedge(x, y) { 2.0 } else { 0.0 }));
    let (image, by_samples) = made(&scan);
    let by_nodes = process(&image, &Settings::new(PITCH_MM), &Unmonitored).expect("planes are met");
    assert_eq!(by_nodes.claimed_nodes, 0);

    // Nodes of the wedge that are of the other region.
    let lost = |outcome: &Outcome| {
        let of_wedge = (
            (15.0 - image.x_mm(0)) / PITCH_MM,
            (1.0 - image.y_mm(0)) / PITCH_MM,
        );
        let regions = &outcome.regions;
        let own = regions.label(of_wedge.0 as usize, of_wedge.1 as usize);
        let nodes = (0..image.columns()).flat_map(|c| (0..image.rows()).map(move |r| (c, r)));
        let within = nodes.filter(|&(column, row)| {
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            x > -18.0 && in_wedge(x - 0.5, y) && x < 21.0
        });
        within.filter(|&(c, r)| regions.label(c, r) != own).count()
    };
    assert!(lost(&by_nodes) > 10, "{}", lost(&by_nodes));
    assert!(by_samples.claimed_nodes >= lost(&by_nodes) / 2);
    assert!(
        4 * lost(&by_samples) < lost(&by_nodes),
        "{}",
        lost(&by_samples)
    );
    // They have the wedge's height.
    let settled = by_samples.settled.as_ref().expect("nodes were claimed");
    let off_mm = |column: usize, row: usize| {
        let (x, y) = (image.x_mm(column), image.y_mm(row));
        settled.image.z_mm(column, row).map(|z| z - plane_mm(x, y))
    };
    let column = ((-14.0 - image.x_mm(0)) / PITCH_MM) as usize;
    let row = ((1.0 - image.y_mm(0)) / PITCH_MM) as usize;
    assert!(off_mm(column, row).is_some_and(|off| (off - 2.0).abs() < 0.01));
}
