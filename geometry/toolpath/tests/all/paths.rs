//! Whole plans: no gouge, cusps as demanded, and what cannot be milled.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::bench;

use bench::{Facets, graph, machine, relief, surface};
use range_image::Unmonitored;
use toolpath::{
    Cuboid, Cutter, Fixture, HeightField, Machine, Pattern, Plan, Settings, Surface, ToolpathError,
    Travel, plan,
};

/// As `cargo xtask full` sets it: there surfaces are larger, and shapes more.
fn is_second_tier() -> bool {
    std::env::var_os("RELIEF_SEEDS").is_some()
}

/// A size for the second tier; the first has half of it along both axes.
fn size([x, y]: [f64; 2]) -> [f64; 2] {
    if is_second_tier() {
        [x, y]
    } else {
        [x / 2.0, y / 2.0]
    }
}

fn settings(cutter: &str, scallop_mm: f64) -> Settings {
    Settings {
        scallop_mm,
        ..Settings::finishing(cutter.parse().unwrap())
    }
}

fn planned(surface: &Surface, machine: &Machine, settings: &Settings) -> Plan {
    plan(surface, machine, settings, &Unmonitored).unwrap()
}

/// z of the normal of the surface that a cutter's tip stays on.
fn flatness(surface: &Surface, cutter: &Cutter, [x, y]: [f64; 2]) -> f64 {
    let tip = |at: [f64; 2]| surface.drop_cutter(cutter, at).unwrap().z_mm;
    let step = 1e-4;
    let gx = (tip([x + step, y]) - tip([x - step, y])) / (2.0 * step);
    let gy = (tip([x, y + step]) - tip([x, y - step])) / (2.0 * step);
    1.0 / (1.0 + gx * gx + gy * gy).sqrt()
}

/// How much deeper than a cutter that just touches the path goes, along the normal, and how much
/// higher, at points that are denser than any sample of it.
fn depth_and_rise(surface: &Surface, plan: &Plan) -> (f64, f64) {
    let operation = plan.operations.last().unwrap();
    let (mut deepest, mut highest) = (0.0_f64, 0.0_f64);
    let mut from = operation.moves[0].to_mm;
    for step in &operation.moves {
        for to in step.points_mm(from, 1e-6) {
            let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
            let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
            let count = (length / 0.011).ceil().max(1.0) as usize;
            for k in 0..=count {
                let share = k as f64 / count as f64;
                let at: [f64; 3] = std::array::from_fn(|i| from[i] + share * way[i]);
                if let Some(tip) = surface.drop_cutter(&operation.cutter, [at[0], at[1]]) {
                    let depth = tip.z_mm - at[2];
                    if depth > deepest {
                        let flat = flatness(surface, &operation.cutter, [at[0], at[1]]);
                        deepest = deepest.max(depth * flat);
                    }
                    if step.travel != Travel::Rapid && way[2] == 0.0 {
                        highest = highest.max(at[2] - tip.z_mm);
                    }
                }
            }
            from = to;
        }
    }
    (deepest, highest)
}

/// Deepest gouge and largest leftover by the simulation, away from the outline.
fn simulated(surface: &Surface, machine: &Machine, plan: &Plan, pitch_mm: f64) -> (f64, f64, f64) {
    simulated_at(0.5, surface, machine, plan, pitch_mm)
}

/// The same; a fine one at a share of the way along x.
fn simulated_at(
    share: f64,
    surface: &Surface,
    machine: &Machine,
    plan: &Plan,
    pitch_mm: f64,
) -> (f64, f64, f64) {
    let [low, high] = surface.bounds_mm();
    let inset = 3.0;
    let mut within = [0, 1].map(|k| [low[k] + inset, high[k] - inset]);
    if pitch_mm < 0.05 {
        // Fine enough for the tops of cusps, on a strip across the passes.
        let middle = low[0] + share * (high[0] - low[0]);
        within[0] = [middle - 0.5, middle + 0.5];
    }
    let field = HeightField::of_stock(&machine.stock, within, pitch_mm).unwrap();
    let removal = field.remove(&plan.operations, &Unmonitored).unwrap();
    let deviations = removal.field.deviations_mm(surface);
    let (mut gouge, mut left) = (0.0_f64, 0.0_f64);
    for deviation in deviations.into_iter().flatten() {
        gouge = gouge.max(-deviation);
        left = left.max(deviation);
    }
    (gouge, left, removal.rapid_cut_mm)
}

#[test]
fn no_path_gouges_a_bumpy_surface() {
    let all = [
        (1, "ball:6"),
        (2, "bull:6:1"),
        (3, "ball:4"),
        (4, "bull:8:2.5"),
    ];
    for (seed, cutter) in all.into_iter().take(if is_second_tier() { 4 } else { 2 }) {
        let surface = surface(&relief(seed, size([30.0, 24.0]), 0.3));
        let machine = machine(&surface, &[cutter]);
        let plan = planned(&surface, &machine, &settings(cutter, 0.03));
        let (deepest, _) = depth_and_rise(&surface, &plan);
        assert!(deepest < 6e-4, "{seed} {cutter}: {deepest}");
        let (gouge, _, rapid) = simulated(&surface, &machine, &plan, 0.11);
        assert!(gouge < 6e-4, "{seed} {cutter}: {gouge}");
        assert_eq!(rapid, 0.0);
    }
}

/// Planes, tilted along and across the passes, and a dome.
fn shapes() -> [(&'static str, Facets); 5] {
    let size = [24.0, 20.0];
    let dome = |x: f64, y: f64| {
        let square = (x - 12.0) * (x - 12.0) + (y - 10.0) * (y - 10.0);
        (30.0_f64 * 30.0 - square).sqrt() - 22.0
    };
    [
        ("level", graph(size, 4.0, |_, _| 2.0)),
        ("across", graph(size, 4.0, |_, y| 0.6 * y)),
        ("along", graph(size, 4.0, |x, _| 0.6 * x)),
        ("askew", graph(size, 4.0, |x, y| 0.7 * x + 0.4 * y)),
        ("dome", graph(size, 0.1, dome)),
    ]
}

#[test]
fn cusps_of_parallel_passes_are_as_high_as_asked_for() {
    // In the first tier a bull-nose is asked of two shapes only.
    let is_second_tier = is_second_tier();
    for (name, facets) in shapes() {
        let surface = surface(&facets);
        for cutter in ["ball:6", "bull:6:1.5"] {
            if cutter != "ball:6" && !(is_second_tier || ["askew", "dome"].contains(&name)) {
                continue;
            }
            let machine = machine(&surface, &[cutter]);
            let plan = planned(&surface, &machine, &settings(cutter, 0.02));
            // A bull-nose's cusps on a dome are highest midway, where slopes are across the passes: these
            // are mended, and the highest that stay are beside them.
            let shares: &[f64] = match (name, cutter) {
                ("dome", "bull:6:1.5") => &[0.5, 0.15],
                _ => &[0.5],
            };
            let mut highest = 0.0_f64;
            for share in shares {
                let (gouge, left, _) = simulated_at(*share, &surface, &machine, &plan, 0.011);
                // A bull-nose leaves nothing on what is level but between its corners.
                assert!(gouge < 4e-4, "{name} {cutter}: {gouge}");
                highest = highest.max(left);
            }
            let off = highest / 0.02 - 1.0;
            assert!(off.abs() < 0.05, "{name} {cutter}: {highest}");
        }
    }
}

#[test]
fn cusps_of_constant_scallop_passes_are_all_as_high_as_asked_for() {
    for (name, facets) in shapes() {
        let surface = surface(&facets);
        let machine = machine(&surface, &["ball:6"]);
        let settings = Settings {
            pattern: Pattern::Scallop,
            ..settings("ball:6", 0.02)
        };
        let plan = planned(&surface, &machine, &settings);
        let (gouge, left, _) = simulated(&surface, &machine, &plan, 0.011);
        assert!(gouge < 4e-4, "{name}: {gouge}");
        assert!((left / 0.02 - 1.0).abs() < 0.05, "{name}: {left}");
    }
}

#[test]
fn constant_scallop_passes_leave_no_notches_where_they_bend() {
    // A hip: two planes, one sloping along the passes and one across.
    let facets = graph([24.0, 20.0], 0.25, |x, y| 0.9 * x.min(y));
    let surface = surface(&facets);
    let machine = machine(&surface, &["ball:6"]);
    let settings = Settings {
        pattern: Pattern::Scallop,
        ..settings("ball:6", 0.02)
    };
    let plan = planned(&surface, &machine, &settings);
    let (gouge, left, _) = simulated(&surface, &machine, &plan, 0.011);
    assert!(gouge < 4e-4, "{gouge}");
    assert!((0.95..1.05).contains(&(left / 0.02)), "{left}");
}

#[test]
fn in_a_crease_no_more_is_left_than_on_its_sides() {
    // A groove that passes cross at 45 degrees, its sides sloping by the root of a half.
    let facets = graph([20.0, 16.0], 0.25, |x, y| 0.5 * (x - y).abs());
    let surface = surface(&facets);
    let machine = machine(&surface, &["ball:6"]);
    let fits_mm = 3.0 * (1.5_f64.sqrt() - 1.0);
    for pattern in [Pattern::Parallel, Pattern::Scallop] {
        let settings = Settings {
            pattern,
            ..settings("ball:6", 0.02)
        };
        let plan = planned(&surface, &machine, &settings);
        let field = HeightField::of_stock(&machine.stock, [[6.0, 11.0]; 2], 0.01).unwrap();
        let left = field.remove(&plan.operations, &Unmonitored).unwrap().field;
        let highest = (0..left.rows)
            .map(|k| left.heights_mm[k * left.columns + k] - fits_mm)
            .fold(0.0, f64::max);
        assert!(highest < 1.05 * 0.02, "{pattern:?}: {highest}");
        let (gouge, _, _) = simulated(&surface, &machine, &plan, 0.11);
        assert!(gouge < 6e-4, "{pattern:?}: {gouge}");
    }
}

#[test]
fn at_the_foot_of_walls_no_step_of_a_flat_end_is_left_too_high() {
    // Hills with a wall across the passes: in its crease a place is reached from few tips only.
    for seed in [323, 339] {
        let surface = surface(&relief(seed, [20.0, 15.0], 0.2));
        let machine = machine(&surface, &["flat:4"]);
        let plan = planned(&surface, &machine, &settings("flat:4", 0.25));
        assert_eq!(plan.notes, Vec::<String>::new(), "{seed}");
        let (deepest, _) = depth_and_rise(&surface, &plan);
        assert!(deepest < 6e-4, "{seed}: {deepest}");
    }
}

#[test]
fn roughing_leaves_the_allowance_and_clears_for_finishing() {
    let surface = surface(&relief(6, [40.0, 30.0], 0.4));
    let machine = machine(&surface, &["ball:6", "flat:8"]);
    let settings = Settings {
        rough: Some("flat:8".parse().unwrap()),
        allowance_mm: 0.4,
        ..settings("ball:6", 0.03)
    };
    let plan = planned(&surface, &machine, &settings);
    assert_eq!(plan.operations.len(), 2);
    let only = |k: usize| Plan {
        operations: vec![plan.operations[k].clone()],
        notes: Vec::new(),
    };
    let [low, high] = surface.bounds_mm();
    let within = [0, 1].map(|k| [low[k], high[k]]);
    let field = HeightField::of_stock(&machine.stock, within, 0.2).unwrap();
    let rough = field.remove(&only(0).operations, &Unmonitored).unwrap();
    assert_eq!(rough.rapid_cut_mm, 0.0);
    let mut deviations: Vec<f64> = rough
        .field
        .deviations_mm(&surface)
        .into_iter()
        .flatten()
        .collect();
    deviations.sort_by(f64::total_cmp);
    // What is left is thicker where the slope makes steps of the levels.
    assert!(deviations[0] > 0.36, "{}", deviations[0]);
    assert!(
        deviations[deviations.len() / 2] < 1.2,
        "{}",
        deviations[deviations.len() / 2]
    );
    let (gouge, _, rapid) = simulated(&surface, &machine, &plan, 0.2);
    assert!(gouge < 6e-4 && rapid == 0.0, "{gouge} {rapid}");
}

#[test]
fn passes_turn_with_their_angle() {
    let surface = surface(&relief(8, [24.0, 18.0], 0.4));
    let machine = machine(&surface, &["ball:6"]);
    let angles = [90.0, 30.0, -45.0];
    for angle_deg in angles
        .into_iter()
        .take(if is_second_tier() { 3 } else { 2 })
    {
        let settings = Settings {
            angle_deg,
            ..settings("ball:6", 0.03)
        };
        let plan = planned(&surface, &machine, &settings);
        let (deepest, _) = depth_and_rise(&surface, &plan);
        assert!(deepest < 6e-4, "{angle_deg}: {deepest}");
        let arcs = plan.operations[0].moves.iter();
        let arcs = arcs.filter(|m| matches!(m.travel, Travel::Arc(_))).count();
        assert_eq!(arcs > 50, angle_deg == 90.0, "{angle_deg}: {arcs}");
    }
}

#[test]
fn a_cylinder_is_milled_in_arcs() {
    let facets = graph([30.0, 12.0], 0.05, |x, _| {
        (400.0 - (x - 15.0) * (x - 15.0)).sqrt() - 10.0
    });
    let surface = surface(&facets);
    let machine = machine(&surface, &["ball:6"]);
    let plan = planned(&surface, &machine, &settings("ball:6", 0.05));
    let mut arcs = 0;
    let operation = &plan.operations[0];
    let mut from = operation.moves[0].to_mm;
    for step in &operation.moves {
        if let Travel::Arc(arc) = step.travel {
            // The centre of the ball is 23 mm from the axis, and its tip 3 mm lower.
            let radius = arc.radius_mm(from);
            if step.length_mm(from) > 5.0 {
                arcs += 1;
                assert!((radius - 23.0).abs() < 0.15, "{radius}");
            }
        }
        from = step.to_mm;
    }
    assert!(
        arcs >= operation.passes / 2,
        "{arcs} of {}",
        operation.passes
    );
    let moves = operation.moves.len();
    assert!(
        moves < 12 * operation.passes,
        "{moves} of {}",
        operation.passes
    );
}

#[test]
fn the_number_of_threads_changes_no_move() {
    let surface = surface(&relief(9, [24.0, 18.0], 0.4));
    let machine = machine(&surface, &["ball:6", "flat:6"]);
    let settings = Settings {
        rough: Some("flat:6".parse().unwrap()),
        ..settings("ball:6", 0.05)
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| planned(&surface, &machine, &settings))
    };
    assert_eq!(with(1), with(3));
}

fn refused(surface: &Surface, machine: &Machine, cutter: &str) -> ToolpathError {
    plan(surface, machine, &settings(cutter, 0.02), &Unmonitored).unwrap_err()
}

#[test]
fn what_does_not_fit_is_told_by_its_axis() {
    let surface = surface(&relief(1, [30.0, 20.0], 0.5));
    let [low, high] = surface.bounds_mm();
    let sound = machine(&surface, &["ball:6", "ball:22"]);

    let told = refused(&surface, &sound, "ball:22").to_string();
    assert!(
        told.contains("larger than the relief") && told.contains("along y"),
        "{told}"
    );

    let mut short = sound.clone();
    short.travel.x_mm = [0.0, 120.0];
    let told = refused(&surface, &short, "ball:6").to_string();
    assert!(told.contains("travel along x by 10.000 mm"), "{told}");
    // The surface is within the travel, and the cutter has to go up beyond it.
    let mut low_roof = sound.clone();
    low_roof.travel.z_mm = [-150.0, -120.0 + high[2] + 1.0];
    let told = refused(&surface, &low_roof, "ball:6").to_string();
    assert!(told.contains("travel along z by 14.000 mm"), "{told}");

    let mut thin = sound.clone();
    thin.stock.z_mm = [low[2] - 1.0, high[2] - 0.5];
    let told = refused(&surface, &thin, "ball:6").to_string();
    assert!(
        told.contains("0.500 mm beyond it") && told.contains("stock.z_mm"),
        "{told}"
    );

    let mut clamped = sound.clone();
    clamped.fixtures.push(Fixture {
        name: "left clamp".to_owned(),
        place: Cuboid {
            x_mm: [-10.0, -1.0],
            y_mm: [5.0, 15.0],
            z_mm: [-5.0, high[2] + 5.0],
        },
    });
    let told = refused(&surface, &clamped, "ball:6").to_string();
    assert!(
        told.contains("would hit the fixture `left clamp` near x"),
        "{told}"
    );

    let mut low_rapids = sound.clone();
    low_rapids.safe_z_mm = high[2];
    let told = refused(&surface, &low_rapids, "ball:6").to_string();
    assert!(told.contains("must be above the stock"), "{told}");

    let told = refused(&surface, &sound, "ball:5").to_string();
    assert!(
        told.contains("no tool ball:5, only ball:6, ball:22"),
        "{told}"
    );

    let mut shallow = sound.clone();
    shallow.stock.z_mm[0] = low[2];
    let slope = bench::surface(&graph([30.0, 20.0], 5.0, |x, _| 0.8 * x));
    let steep = Machine {
        stock: Cuboid {
            x_mm: [-1.0, 31.0],
            y_mm: [-1.0, 21.0],
            z_mm: [0.0, 25.0],
        },
        safe_z_mm: 40.0,
        ..sound.clone()
    };
    let told = refused(&slope, &steep, "ball:6").to_string();
    assert!(told.contains("below the stock's bottom"), "{told}");
}

#[test]
fn tools_too_short_for_the_depth_are_told() {
    let surface = surface(&relief(1, size([30.0, 24.0]), 0.5));
    let [low, high] = surface.bounds_mm();
    let mut sound = machine(&surface, &["ball:6", "flat:8"]);
    sound.stock.z_mm[1] = high[2] + 6.0;
    let depth_mm = high[2] + 6.0 - low[2];
    for tool in &mut sound.tools {
        (tool.cutting_length_mm, tool.reach_mm) = (Some(depth_mm), Some(depth_mm + 1.0));
    }
    planned(&surface, &sound, &settings("ball:6", 0.05));

    let mut stubby = sound.clone();
    stubby.tools[0].cutting_length_mm = None;
    stubby.tools[0].reach_mm = Some(5.0);
    let told = refused(&surface, &stubby, "ball:6").to_string();
    assert!(
        told.contains("below the stock's top") && told.contains("its reach_mm is 5 mm"),
        "{told}"
    );
    // Roughing before does not help what holds the tool, which is above stock that stays.
    let roughed = Settings {
        rough: Some("flat:8".parse().unwrap()),
        ..settings("ball:6", 0.05)
    };
    let told = plan(&surface, &stubby, &roughed, &Unmonitored).unwrap_err();
    assert!(told.to_string().contains("its reach_mm is 5 mm"), "{told}");

    let mut blunt = sound.clone();
    blunt.tools[0].cutting_length_mm = Some(5.0);
    let told = refused(&surface, &blunt, "ball:6").to_string();
    assert!(
        told.contains("its cutting_length_mm is 5 mm") && told.contains("rough first"),
        "{told}"
    );
    planned(&surface, &blunt, &roughed);
    blunt.tools[1].cutting_length_mm = Some(1.0);
    let told = plan(&surface, &blunt, &roughed, &Unmonitored).unwrap_err();
    assert!(
        told.to_string().contains("give it a smaller step_down_mm"),
        "{told}"
    );

    let mut clamped = sound.clone();
    clamped.safe_z_mm += 30.0;
    clamped.fixtures.push(Fixture {
        name: "tall clamp".to_owned(),
        place: Cuboid {
            x_mm: [-20.0, -10.0],
            y_mm: [5.0, 15.0],
            z_mm: [-5.0, high[2] + 30.0],
        },
    });
    let told = refused(&surface, &clamped, "ball:6").to_string();
    assert!(told.contains("below the fixture `tall clamp`"), "{told}");
}

#[test]
fn settings_beyond_their_limits_are_told() {
    let surface = surface(&relief(1, [30.0, 20.0], 0.5));
    let machine = machine(&surface, &["ball:6", "flat:6"]);
    let ball: Cutter = "ball:6".parse().unwrap();
    for (settings, name) in [
        (
            Settings {
                tolerance_mm: 0.0,
                ..Settings::finishing(ball)
            },
            "tolerance_mm = 0",
        ),
        (
            Settings {
                scallop_mm: -1.0,
                ..Settings::finishing(ball)
            },
            "scallop_mm = -1",
        ),
        (
            Settings {
                scallop_mm: 2.0,
                ..Settings::finishing(ball)
            },
            "half the radius",
        ),
        (
            Settings {
                angle_deg: f64::NAN,
                ..Settings::finishing(ball)
            },
            "angle_deg = NaN",
        ),
        (
            Settings {
                allowance_mm: 0.0,
                ..Settings::finishing(ball)
            },
            "allowance_mm = 0",
        ),
        (
            Settings {
                pattern: Pattern::Scallop,
                ..Settings::finishing("flat:6".parse().unwrap())
            },
            "for ball cutters, not flat:6",
        ),
    ] {
        let told = plan(&surface, &machine, &settings, &Unmonitored).unwrap_err();
        assert!(told.to_string().contains(name), "{told}");
    }
}
