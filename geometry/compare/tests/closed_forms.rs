//! Registration and distances against closed forms, free motions, and input that makes no sense.

use compare::{
    Alignment, CompareError, CompareSettings, Comparison, Freedom, NodeState, Nominal, Pose,
    Tolerance, compare,
};
use proptest::prelude::*;
use range_image::{Column, Lattice, Monitor, RangeImage, Sample, Unmonitored};

type Height<'a> = &'a dyn Fn(f64, f64) -> Option<f64>;

/// An open sheet z = f(x, y) over a square about the origin, triangles `step_mm` wide, moved.
fn sheet(height: Height<'_>, half_mm: f64, step_mm: f64, pose: &Pose) -> Nominal {
    let nodes = (2.0 * half_mm / step_mm).round() as usize + 1;
    let at = |i: usize| -half_mm + step_mm * i as f64;
    let mut numbers = vec![None; nodes * nodes];
    let mut vertices = Vec::new();
    for i in 0..nodes {
        for j in 0..nodes {
            if let Some(z) = height(at(i), at(j)) {
                numbers[i * nodes + j] = Some(vertices.len());
                vertices.push(pose.apply([at(i), at(j), z]));
            }
        }
    }
    let mut facets = Vec::new();
    for i in 0..nodes - 1 {
        for j in 0..nodes - 1 {
            let corner = |di: usize, dj: usize| numbers[(i + di) * nodes + j + dj];
            let corners = (corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
            if let (Some(a), Some(b), Some(c), Some(d)) = corners {
                facets.push([a, b, c]);
                facets.push([a, c, d]);
            }
        }
    }
    Nominal::new(&vertices, &facets).expect("a sheet")
}

/// An exact scan of z = f(x, y): nodes and samples at the same places.
fn scan(height: Height<'_>, half_mm: f64, pitch_mm: f64) -> (RangeImage, Vec<Column>) {
    let reach = (half_mm / pitch_mm).floor() as i64;
    let side = (2 * reach + 1) as usize;
    let mut image = RangeImage::masked(Lattice { pitch_mm }, -reach, -reach, side, side);
    let mut columns = Vec::new();
    for column in 0..side {
        let mut samples = Vec::new();
        for row in 0..side {
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            if let Some(z) = height(x, y) {
                image.set_z_mm(column, row, Some(z));
                samples.push(Sample {
                    y_mm: y,
                    z_mm: z,
                    intensity: 255,
                });
            }
        }
        columns.push(Column::new(image.x_mm(column), samples));
    }
    (image, columns)
}

fn held(
    (image, columns): &(RangeImage, Vec<Column>),
    nominal: &Nominal,
    alignment: Alignment,
) -> Result<Comparison, CompareError> {
    let settings = CompareSettings {
        alignment,
        tolerance: Some(Tolerance {
            lower_mm: -0.05,
            upper_mm: 0.05,
        }),
        ..CompareSettings::default()
    };
    compare(image, columns, nominal, &settings, &Unmonitored)
}

/// Hills that hold all six motions.
fn hills(x: f64, y: f64) -> Option<f64> {
    Some(3.0 * libm::sin(0.17 * x + 0.4) * libm::cos(0.13 * y) + 0.002 * x * y)
}

#[test]
fn a_known_motion_comes_back() {
    for (turn, shift) in [
        ([0.0, 0.0, 0.0], [0.3, -0.2, 0.1]),
        ([0.03, -0.02, 0.1], [2.0, 1.0, -3.0]),
        ([0.01, 0.02, -0.6], [35.0, -20.0, 15.0]),
    ] {
        let pose = Pose::new(turn, shift);
        let nominal = sheet(&hills, 40.0, 0.5, &pose);
        let found = held(&scan(&hills, 30.0, 1.0), &nominal, Alignment::BestFit).unwrap();
        let left = found.registration.pose.then(&pose.inverse());
        // Chords half a millimetre long lie up to 0.003 mm off these hills.
        for corner in [[-30.0, -30.0, 0.0], [30.0, -30.0, 0.0], [0.0, 30.0, 0.0]] {
            let off = left
                .apply(corner)
                .iter()
                .zip(corner)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(off < 0.004, "{turn:?}: {off}");
        }
        assert!(found.passed() && found.registration.free.is_empty());
        assert!(found.statistics.rms_mm < 0.003, "{:?}", found.statistics);
    }
}

#[test]
fn distances_go_along_the_normal_and_are_positive_outside() {
    // A slope of 45 degrees, raised by 0.3 mm along z, is 0.3 / sqrt 2 off.
    let slope = |x: f64, _: f64| Some(x);
    let raised = |x: f64, _: f64| Some(x + 0.3);
    let nominal = sheet(&slope, 30.0, 5.0, &Pose::IDENTITY);
    let found = held(&scan(&raised, 20.0, 0.5), &nominal, Alignment::AsPlaced).unwrap();
    let expected = 0.3 / 2.0_f64.sqrt();
    for state in &found.states {
        if let NodeState::Compared(deviation) = state {
            assert!((deviation - expected).abs() < 1e-9, "{deviation}");
        }
    }
    assert!((found.statistics.mean_mm - expected).abs() < 1e-9);
    assert_eq!(found.within_share, Some(0.0));
    assert_eq!(found.regions.len(), 1);
    assert!((found.regions[0].deviation_mm - expected).abs() < 1e-9);
    let inside = held(
        &scan(&slope, 20.0, 0.5),
        &sheet(&raised, 30.0, 5.0, &Pose::IDENTITY),
        Alignment::AsPlaced,
    );
    assert!((inside.unwrap().statistics.mean_mm + expected).abs() < 1e-9);
}

#[test]
fn what_a_plane_a_cylinder_and_a_sphere_leave_free_is_told() {
    let plane = |x: f64, y: f64| Some(0.2 * x - 0.1 * y);
    let cylinder = |_: f64, y: f64| (y.abs() < 20.0).then(|| (900.0 - y * y).sqrt() - 30.0);
    let sphere = |x: f64, y: f64| {
        let rest = 900.0 - x * x - y * y;
        (rest > 500.0).then(|| rest.sqrt() - 30.0)
    };
    // Lifted, so that there is something to fit.
    let pose = Pose::new([0.0; 3], [0.0, 0.0, 0.4]);
    for (name, height, slides, turns) in [
        ("plane", &plane as Height<'_>, 2, 1),
        ("cylinder", &cylinder, 1, 1),
        ("sphere", &sphere, 0, 3),
    ] {
        let found = held(
            &scan(height, 19.0, 0.5),
            &sheet(height, 25.0, 0.5, &pose),
            Alignment::BestFit,
        )
        .unwrap();
        let is_slide = |free: &&Freedom| matches!(free, Freedom::Sliding { .. });
        let free = &found.registration.free;
        assert_eq!(
            free.iter().filter(is_slide).count(),
            slides,
            "{name}: {free:?}"
        );
        assert_eq!(free.len(), slides + turns, "{name}: {free:?}");
        assert!(found.passed(), "{name}: {:?}", found.regions);
        assert!(
            found.statistics.rms_mm < 0.005,
            "{name}: {:?}",
            found.statistics
        );
        // What is free stays: the plane is lifted along its normal and slides nowhere else.
        let [x, y, z] = found.registration.pose.apply([0.0; 3]);
        assert!(
            x.abs() < 0.1 && y.abs() < 0.1 && (z - 0.4).abs() < 0.03,
            "{name}: {x} {y} {z}"
        );
        for freedom in free {
            match (name, freedom) {
                (
                    "plane",
                    Freedom::Sliding {
                        direction: [x, y, z],
                    },
                ) => {
                    assert!((0.2 * x - 0.1 * y - z).abs() < 1e-6, "{freedom:?}");
                }
                ("cylinder", Freedom::Sliding { direction }) => {
                    assert!(direction[0] > 0.9999, "{freedom:?}");
                }
                (
                    "cylinder",
                    Freedom::Turning {
                        axis, through_mm, ..
                    },
                ) => {
                    assert!(axis[0] > 0.9999, "{freedom:?}");
                    // Facets a degree apart let the axis be known to half their width.
                    assert!(
                        through_mm[1].abs() < 0.5 && (through_mm[2] + 29.6).abs() < 0.5,
                        "{freedom:?}"
                    );
                }
                _ => {}
            }
        }
    }
}

#[test]
fn what_is_hidden_and_what_is_behind_is_not_compared() {
    // A box 10 mm high whose lower side is 1 mm behind its upper one: a plate.
    let corner = |i: usize| {
        let side = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
        [
            side(1, -20.0, 20.0),
            side(2, -20.0, 20.0),
            side(4, 0.0, 1.0),
        ]
    };
    let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let facets: Vec<[usize; 3]> = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .collect();
    let nominal = Nominal::new(&vertices, &facets).unwrap();
    // The scan shows the upper side 0.8 mm too low, nearer to the lower side.
    let low = |_: f64, _: f64| Some(0.2);
    let found = held(&scan(&low, 25.0, 0.5), &nominal, Alignment::AsPlaced).unwrap();
    assert!(
        (found.statistics.mean_mm + 0.8).abs() < 1e-9,
        "{:?}",
        found.statistics
    );
    assert!(
        (found.seen_area_mm2 - 1600.0).abs() < 60.0,
        "{}",
        found.seen_area_mm2
    );
    // What lies beside it belongs to something else or to its edge.
    assert!(found.count(|state| state == NodeState::Foreign) > 1000);

    let turned: Vec<[usize; 3]> = facets.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inside_out = Nominal::new(&vertices, &turned).unwrap();
    assert_eq!(
        inside_out.remarks(),
        ["the mesh is inside out and was turned"]
    );
    let same = held(&scan(&low, 25.0, 0.5), &inside_out, Alignment::AsPlaced).unwrap();
    assert_eq!(same.statistics, found.statistics);
}

#[test]
fn units_and_places_that_cannot_be_meant_are_told() {
    let inches = |x: f64, y: f64| hills(25.4 * x, 25.4 * y).map(|z| z / 25.4);
    let nominal = sheet(&inches, 1.5, 0.1, &Pose::IDENTITY);
    let error = held(&scan(&hills, 38.0, 1.0), &nominal, Alignment::BestFit).unwrap_err();
    assert!(
        error.to_string().contains("in inches it would fit"),
        "{error}"
    );
    let away = sheet(&hills, 40.0, 1.0, &Pose::new([0.0; 3], [500.0, 0.0, 0.0]));
    let error = held(&scan(&hills, 30.0, 1.0), &away, Alignment::AsPlaced).unwrap_err();
    assert!(matches!(error, CompareError::NoOverlap { .. }), "{error}");
    // Nothing like the nominal: mountains twenty times as high.
    let mountains = |x: f64, y: f64| Some(40.0 * libm::sin(0.3 * x) * libm::sin(0.3 * y));
    let error = held(&scan(&mountains, 30.0, 1.0), &away, Alignment::BestFit).unwrap_err();
    assert!(
        matches!(error, CompareError::NotRegistered { .. }),
        "{error}"
    );
    let few = held(&scan(&hills, 2.0, 1.0), &away, Alignment::BestFit).unwrap_err();
    assert!(
        matches!(few, CompareError::NothingMeasured { nodes: 25 }),
        "{few}"
    );
}

#[test]
fn the_number_of_threads_and_a_caller_who_leaves() {
    struct Gone;
    impl Monitor for Gone {
        fn is_cancelled(&self) -> bool {
            true
        }
        fn progress(&self, _: f64) {}
    }
    let pose = Pose::new([0.02, 0.0, 0.5], [20.0, 5.0, 1.0]);
    let nominal = sheet(&hills, 40.0, 1.0, &pose);
    let scanned = scan(&hills, 30.0, 1.0);
    let by = |threads| {
        let found = regrid::with_threads(threads, || held(&scanned, &nominal, Alignment::BestFit));
        let found = found.unwrap().unwrap();
        (found.registration, found.states, found.regions)
    };
    assert_eq!(by(1), by(3));
    let settings = CompareSettings::default();
    let gone = compare(&scanned.0, &scanned.1, &nominal, &settings, &Gone).unwrap_err();
    assert!(matches!(gone, CompareError::Cancelled(_)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Any mesh and any heights give a comparison or an error, and finite numbers.
    #[test]
    fn anything_gives_a_comparison_or_an_error(
        vertices in prop::collection::vec(prop::array::uniform3(-20.0..20.0_f64), 3..12),
        picks in prop::collection::vec(prop::array::uniform3(0_usize..12), 1..12),
        heights in prop::collection::vec(prop::option::weighted(0.8, -9.0..9.0_f64), 100),
        is_fit in any::<bool>(),
    ) {
        let Ok(nominal) = Nominal::new(&vertices, &picks) else { return Ok(()) };
        let height = |x: f64, y: f64| {
            let cell = |c: f64| ((c + 10.0) / 2.0).clamp(0.0, 9.0) as usize;
            heights[cell(x) * 10 + cell(y)]
        };
        let alignment = if is_fit { Alignment::BestFit } else { Alignment::AsPlaced };
        if let Ok(found) = held(&scan(&height, 10.0, 1.0), &nominal, alignment) {
            prop_assert!(found.statistics.rms_mm.is_finite());
            prop_assert!((0.0..=1.0).contains(&found.covered_share));
            prop_assert!(found.regions.iter().all(|region| region.deviation_mm.is_finite()));
        }
    }
}
