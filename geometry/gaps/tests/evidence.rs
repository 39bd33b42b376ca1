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

/// What a ray that would meet the sheet at x and y brings: how far above it, or nothing.
type Scene = dyn Fn(f64, f64, &mut u64) -> Option<f64>;

struct Scanned {
    image: RangeImage,
    regions: RegionMap,
    columns: Vec<Column>,
}

/// A sheet over x and y.
type Sheet = fn(f64, f64) -> f64;

/// A sheet sampled with half the pitch; nodes have values where at least half of what their square holds
/// came back from the sheet or from what stands higher, or nearly all from what lies lower: three regions.
fn scanned_on(sheet: Sheet, scene: &Scene) -> Scanned {
    let mut seed = 7;
    let mut columns = Vec::new();
    let lattice = Lattice { pitch_mm: PITCH_MM };
    let mut image = RangeImage::masked(lattice, 0, 0, COLUMNS, ROWS);
    let mut labels = vec![0_u16; COLUMNS * ROWS];
    let mut sent = vec![0_u32; COLUMNS * ROWS];
    let mut heights = vec![[(0_u32, 0.0_f64); 3]; COLUMNS * ROWS];
    for k in 0..2 * COLUMNS - 1 {
        let x = 0.5 * PITCH_MM * k as f64;
        let mut samples = Vec::new();
        for step in 0..2 * ROWS - 1 {
            let t = (0.5 * PITCH_MM * step as f64 - CAMERA_MM[0]) / CAMERA_MM[1];
            // Where the ray meets the sheet.
            let mut y = 0.0;
            for _ in 0..20 {
                y = CAMERA_MM[0] + t * (CAMERA_MM[1] - sheet(x, y));
            }
            let column = ((x / PITCH_MM).round() as usize).min(COLUMNS - 1);
            let row = ((y / PITCH_MM).round().max(0.0) as usize).min(ROWS - 1);
            let node = column * ROWS + row;
            sent[node] += 1;
            let Some(off) = scene(x, y, &mut seed) else {
                continue;
            };
            let off = off + 0.02 * (drawn(&mut seed) - 0.5);
            let z = sheet(x, y) + off;
            samples.push(Sample {
                y_mm: CAMERA_MM[0] + t * (CAMERA_MM[1] - z),
                z_mm: z,
                intensity: 200,
            });
            let own = &mut heights[node][usize::from(off > 1.0) + 2 * usize::from(off < -1.0)];
            // Samples lie beside the node: what the sheet rises to it counts, too.
            own.0 += 1;
            own.1 += off + sheet(column as f64 * PITCH_MM, row as f64 * PITCH_MM);
        }
        columns.push(Column::new(x, samples));
    }
    for (node, own) in heights.iter().enumerate() {
        for ((label, (count, sum)), share) in (1..).zip(own).zip([0.5, 0.5, 0.9]) {
            if *count > 0 && f64::from(*count) >= share * f64::from(sent[node]) {
                let z = sum / f64::from(*count);
                image.set_z_mm(node / ROWS, node % ROWS, Some(z));
                labels[node] = label;
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

fn scanned(scene: &Scene) -> Scanned {
    scanned_on(sheet, scene)
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

fn sheet(x: f64, _: f64) -> f64 {
    5.0 + 0.2 * x
}

#[test]
fn an_opening_that_shows_something_below_is_kept() {
    let scene = |x: f64, y: f64, seed: &mut u64| match far(x, y) < 3.0 {
        true => (drawn(seed) < 0.3).then_some(-20.0),
        false => Some(0.0),
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
    let scene = |x: f64, y: f64, _: &mut u64| (far(x, y) >= 3.0).then_some(0.0);
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
            assert!(
                (z - sheet(asked.image.x_mm(column), 0.0)).abs() < 0.02,
                "{z}"
            );
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
        (drawn(seed) >= lost).then_some(0.0)
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
        (true, _) => Some(8.0),
        (_, true) => None,
        _ => Some(0.0),
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
        assert!(
            (z - sheet(found.image.x_mm(column), 0.0)).abs() < 0.05,
            "{z}"
        );
    }
}

#[test]
fn the_same_is_said_by_nodes_alone_where_there_are_no_rays() {
    let scene = |x: f64, y: f64, _: &mut u64| (far(x, y) >= 3.0).then_some(0.0);
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

#[test]
fn what_is_kept_by_name_stays_whatever_else_is_closed() {
    let scene = |x: f64, y: f64, _: &mut u64| (far(x, y) >= 3.0).then_some(0.0);
    let settings = Settings {
        mode: Mode::All,
        keep_mm: vec![[14.0, 12.0]],
        ..Settings::default()
    };
    let found = closed(&scanned(&scene), &settings);
    assert_eq!(found.gaps.len(), 1);
    assert_eq!(found.gaps[0].decision, Decision::Kept);
    assert_eq!(found.gaps[0].cause, Cause::Asked);
    assert!(found.filled.is_empty());
}

#[test]
fn what_is_too_wide_or_open_to_the_border_is_left() {
    let scene = |x: f64, y: f64, _: &mut u64| (far(x, y) >= 3.0 && x + y >= 4.0).then_some(0.0);
    let settings = Settings {
        mode: Mode::All,
        max_size_mm: 4.0,
        ..Settings::default()
    };
    let found = closed(&scanned(&scene), &settings);
    let [gap] = found.gaps.as_slice() else {
        unreachable!("the corner is no hole: {:?}", found.gaps)
    };
    assert_eq!((gap.decision, gap.cause), (Decision::Kept, Cause::Size));
    assert!(found.filled.is_empty());
}

#[test]
fn on_a_steep_slope_what_comes_back_is_known_as_the_surface() {
    let steep: Sheet = |x, y| 5.0 + 0.2 * x + 1.2 * y;
    let scene =
        |x: f64, y: f64, seed: &mut u64| (far(x, y) >= 3.0 || drawn(seed) < 0.3).then_some(0.0);
    let found = closed(&scanned_on(steep, &scene), &auto());
    let large = found.gaps.iter().max_by_key(|gap| gap.nodes).unwrap();
    assert_eq!(large.decision, Decision::Closed);
    let inside = large.evidence.unwrap().inside;
    assert!(inside.on_surface > 3, "{inside:?}");
    assert_eq!((inside.below, inside.above), (0, 0));
}

#[test]
fn surfaces_that_meet_in_a_gap_meet_in_its_filling() {
    let scene =
        |x: f64, y: f64, seed: &mut u64| (far(x, y) >= 3.0 || drawn(seed) < 0.2).then_some(0.0);
    let mut roof = scanned_on(|x, _| 20.0 - 0.6 * (x - 15.0).abs(), &scene);
    let mut labels = roof.regions.raw_labels().to_vec();
    for (node, label) in labels.iter_mut().enumerate() {
        if *label == 1 && node / ROWS > 30 {
            *label = 2;
        }
    }
    roof.regions = RegionMap::new(&roof.image, labels);
    let found = closed(&roof, &auto());
    assert!(found.filled.len() > 60, "{}", found.filled.len());
    for node in &found.filled {
        let (column, row) = (node / ROWS, node % ROWS);
        let x = found.image.x_mm(column);
        let z = found.image.z_mm(column, row).unwrap();
        assert!((z - 20.0 + 0.6 * (x - 15.0).abs()).abs() < 0.1, "{x}: {z}");
        // Beside the ridge either will do.
        if (x - 15.0).abs() > 0.6 {
            let side = if x < 15.0 { 1 } else { 2 };
            assert_eq!(found.regions.label(column, row), side, "{x}");
        }
    }
}

/// An opening of 8 mm across of whose floor, 9 mm lower, a sensor to the right sees what lies more than
/// so far to the left of the right wall; nothing comes back from a ring of half a millimetre at the wall.
fn pit(seen_from_mm: f64) -> Scanned {
    let scene = move |x: f64, y: f64, _: &mut u64| match far(x, y) {
        off if off >= 4.0 => Some(0.0),
        off if off >= 3.5 => None,
        _ => {
            let wall = 15.0 + (16.0 - (y - 12.0).powi(2)).max(0.0).sqrt();
            (wall - x > seen_from_mm).then_some(-9.0)
        }
    };
    scanned(&scene)
}

#[test]
fn a_floor_goes_on_to_the_wall_that_hides_it_and_the_top_does_not_cover_it() {
    let pit = pit(2.0);
    let found = closed(&pit, &auto());
    assert!(found.filled.len() > 20, "{:?}", found.gaps);
    for node in &found.filled {
        assert!(is_floor(&found.image, *node), "{node}");
    }
}

fn is_floor(image: &RangeImage, node: usize) -> bool {
    let (column, row) = (node / ROWS, node % ROWS);
    let z = image.z_mm(column, row);
    z.is_some_and(|z| (z - sheet(image.x_mm(column), 0.0) + 9.0).abs() < 1.0)
}

#[test]
fn a_small_floor_is_not_carried_on_to_more_than_there_is_of_it() {
    let pit = pit(6.2);
    let all = 0..COLUMNS * ROWS;
    let floor = all.filter(|node| is_floor(&pit.image, *node)).count();
    let found = closed(&pit, &auto());
    let filled = found.filled.iter();
    let given = filled.filter(|node| is_floor(&found.image, **node)).count();
    assert!(floor >= 6, "{floor}");
    assert!(given <= floor, "{given} of {floor}: {:?}", found.gaps);
}
