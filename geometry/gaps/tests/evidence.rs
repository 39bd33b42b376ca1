//! Holes of small scenes, made of rays as a scanner sends them: what is kept and what is closed.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use gaps::{Cause, Closed, Decision, Mode, Settings, Sight, close};
use range_image::{Cancelled, Column, Lattice, RangeImage, RegionMap, Sample, Unmonitored};

const PITCH_MM: f64 = 0.5;
const COLUMNS: usize = 60;
const ROWS: usize = 50;
const CAMERA_MM: [f64; 2] = [12.0, 700.0];

/// Numbers from 0 to 1 that are the same each time.
fn drawn(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}

/// What a ray that would meet the surface at x and y brings: z, or nothing.
type Scene = dyn Fn(f64, f64, &mut u64) -> Option<f64>;

struct Scanned {
    image: RangeImage,
    regions: RegionMap,
    columns: Vec<Column>,
}

/// A sheet z = 5 + 0.2 x, sampled with half the pitch; nodes have values where at least half of what
/// their square holds came back from the sheet or from a second surface, told apart by height.
fn scanned(scene: &Scene) -> Scanned {
    let sheet = |x: f64| 5.0 + 0.2 * x;
    let mut seed = 7;
    let mut columns = Vec::new();
    let lattice = Lattice { pitch_mm: PITCH_MM };
    let mut image = RangeImage::masked(lattice, 0, 0, COLUMNS, ROWS);
    let mut labels = vec![0_u16; COLUMNS * ROWS];
    let mut votes = vec![[0_u32; 3]; COLUMNS * ROWS];
    let mut heights = vec![[0.0_f64; 2]; COLUMNS * ROWS];
    for k in 0..2 * COLUMNS - 1 {
        let x = 0.5 * PITCH_MM * k as f64;
        let mut samples = Vec::new();
        for step in 0..2 * ROWS - 1 {
            let t = (0.5 * PITCH_MM * step as f64 - CAMERA_MM[0]) / CAMERA_MM[1];
            let y = CAMERA_MM[0] + t * (CAMERA_MM[1] - sheet(x));
            let node = ((x / PITCH_MM).round() as usize).min(COLUMNS - 1) * ROWS
                + ((y / PITCH_MM).round().max(0.0) as usize).min(ROWS - 1);
            votes[node][2] += 1;
            let Some(z) = scene(x, y, &mut seed) else {
                continue;
            };
            let z = z + 0.02 * (drawn(&mut seed) - 0.5);
            samples.push(Sample {
                y_mm: CAMERA_MM[0] + t * (CAMERA_MM[1] - z),
                z_mm: z,
                intensity: 200,
            });
            let which = usize::from(z > sheet(x) + 1.0);
            if z > sheet(x) - 1.0 {
                votes[node][which] += 1;
                // Samples lie beside the node: what the sheet rises to it counts, too.
                let column = node / ROWS;
                heights[node][which] += z - sheet(x) + sheet(column as f64 * PITCH_MM);
            }
        }
        columns.push(Column::new(x, samples));
    }
    for (node, votes) in votes.iter().enumerate() {
        for which in 0..2 {
            if 2 * votes[which] >= votes[2] && votes[which] > 0 {
                let z = heights[node][which] / f64::from(votes[which]);
                image.set_z_mm(node / ROWS, node % ROWS, Some(z));
                labels[node] = which as u16 + 1;
            }
        }
    }
    let regions = RegionMap::new(&image, labels);
    Scanned {
        image,
        regions,
        columns,
    }
}

fn closed(scanned: &Scanned, settings: &Settings) -> Closed {
    let sight = Sight {
        image: &scanned.image,
        measured: &scanned.image,
        camera_mm: Some(CAMERA_MM),
        step_mm: PITCH_MM,
        noise_mm: 0.006,
    };
    let mut visit = |take: &mut dyn FnMut(&Column) -> bool| {
        scanned.columns.iter().all(take);
        Ok::<_, Cancelled>(())
    };
    close(
        &sight,
        &scanned.regions,
        settings,
        Some(&mut visit),
        &Unmonitored,
    )
    .unwrap()
}

fn auto() -> Settings {
    Settings {
        mode: Mode::Auto,
        ..Settings::default()
    }
}

fn far(x: f64, y: f64) -> f64 {
    ((x - 15.0).powi(2) + (y - 12.0).powi(2)).sqrt()
}

fn sheet(x: f64) -> f64 {
    5.0 + 0.2 * x
}

#[test]
fn an_opening_that_shows_something_below_is_kept() {
    let scene = |x: f64, y: f64, seed: &mut u64| match far(x, y) < 3.0 {
        true => (drawn(seed) < 0.3).then_some(sheet(x) - 20.0),
        false => Some(sheet(x)),
    };
    let found = closed(&scanned(&scene), &auto());
    let [gap] = found.gaps.as_slice() else {
        unreachable!("{:?}", found.gaps)
    };
    assert_eq!((gap.decision, gap.cause), (Decision::Kept, Cause::Below));
    assert!((5.0..7.0).contains(&gap.size_mm), "{}", gap.size_mm);
    assert!(found.filled.is_empty());
}

#[test]
fn an_opening_that_returns_nothing_is_kept_unless_the_user_says_otherwise() {
    let scene = |x: f64, y: f64, _: &mut u64| (far(x, y) >= 3.0).then(|| sheet(x));
    let scanned = scanned(&scene);
    let found = closed(&scanned, &auto());
    let [gap] = found.gaps.as_slice() else {
        unreachable!("{:?}", found.gaps)
    };
    assert_eq!((gap.decision, gap.cause), (Decision::Kept, Cause::NoReturn));

    for settings in [
        Settings {
            close_mm: vec![[15.5, 11.0]],
            ..auto()
        },
        Settings {
            mode: Mode::All,
            ..auto()
        },
    ] {
        let asked = closed(&scanned, &settings);
        assert_eq!(asked.gaps[0].cause, Cause::Asked);
        assert_eq!(asked.filled.len(), gap.nodes);
        for node in &asked.filled {
            let (column, row) = (node / ROWS, node % ROWS);
            let z = asked.image.z_mm(column, row).unwrap();
            assert!((z - sheet(asked.image.x_mm(column))).abs() < 0.02, "{z}");
            assert_eq!(asked.regions.label(column, row), 1);
        }
    }
    let nowhere = closed(
        &scanned,
        &Settings {
            keep_mm: vec![[2.0, 2.0]],
            ..auto()
        },
    );
    assert!(
        nowhere.warnings[0].contains("no hole"),
        "{:?}",
        nowhere.warnings
    );
}

#[test]
fn gloss_is_closed_by_what_is_lost_around_it() {
    // All is lost in the middle, and less and less around it.
    let scene = |x: f64, y: f64, seed: &mut u64| {
        let lost = (1.3 - 0.25 * (far(x, y) - 1.5).max(0.0)).clamp(0.01, 1.0);
        (drawn(seed) >= lost).then(|| sheet(x))
    };
    let found = closed(&scanned(&scene), &auto());
    let large = found.gaps.iter().max_by_key(|gap| gap.nodes).unwrap();
    assert!(large.nodes > 50, "{large:?}");
    assert_eq!(
        (large.decision, large.cause),
        (Decision::Closed, Cause::Surface)
    );
}

#[test]
fn what_a_higher_surface_hides_is_closed_and_goes_to_the_lower_one() {
    // A block of 4 by 10 mm, 8 mm high; a sensor to its right does not see 4 mm to its left.
    let is_block = |x: f64, y: f64| (15.0..19.0).contains(&x) && (7.0..17.0).contains(&y);
    let is_hidden = move |x: f64, y: f64| (11.0..15.0).contains(&x) && (7.0..17.0).contains(&y);
    let scene = move |x: f64, y: f64, _: &mut u64| match (is_block(x, y), is_hidden(x, y)) {
        (true, _) => Some(sheet(x) + 8.0),
        (_, true) => None,
        _ => Some(sheet(x)),
    };
    let scanned = scanned(&scene);
    let found = closed(&scanned, &auto());
    let hidden = found.gaps.iter().find(|gap| gap.cause == Cause::Hidden);
    let hidden = hidden.unwrap_or_else(|| unreachable!("{:?}", found.gaps));
    assert_eq!(hidden.decision, Decision::Closed);
    assert_eq!(hidden.regions, [1]);
    assert!(hidden.nodes > 120, "{}", hidden.nodes);
    for node in &found.filled {
        let (column, row) = (node / ROWS, node % ROWS);
        let z = found.image.z_mm(column, row).unwrap();
        assert!((z - sheet(found.image.x_mm(column))).abs() < 0.05, "{z}");
    }
}

#[test]
fn the_same_is_said_by_nodes_alone_where_there_are_no_rays() {
    let scene = |x: f64, y: f64, _: &mut u64| (far(x, y) >= 3.0).then(|| sheet(x));
    let scanned = scanned(&scene);
    let sight = Sight {
        image: &scanned.image,
        measured: &scanned.image,
        camera_mm: None,
        step_mm: PITCH_MM,
        noise_mm: 0.0,
    };
    let found: Result<Closed, Cancelled> =
        close(&sight, &scanned.regions, &auto(), None, &Unmonitored);
    let found = found.unwrap();
    assert_eq!(found.gaps[0].cause, Cause::NoReturn);
}
