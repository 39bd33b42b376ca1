//! NC code to the letter, and read back.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::bench;

use bench::{graph, machine, surface};
use range_image::Unmonitored;
use toolpath::{
    Arc, Dialect, Header, Machine, Move, Operation, Pattern, Plane, Settings, Travel, duration,
    plan,
};

fn header() -> Header {
    Header {
        title: "part (1) \u{e4}".to_owned(),
        author: "relief".to_owned(),
        timestamp: "2026-01-02".to_owned(),
    }
}

fn set_up(dialect: Dialect) -> Machine {
    let level = surface(&graph([30.0, 20.0], 5.0, |_, _| 0.0));
    Machine {
        dialect,
        decimals: 3,
        program: 12,
        coolant: true,
        acceleration_mm_per_s2: None,
        ..machine(&level, &["ball:6"])
    }
}

fn tiny() -> Operation {
    let hump = Arc {
        plane: Plane::Zx,
        counter_clockwise: true,
        centre_mm: [5.0, 0.0, 0.0],
    };
    Operation {
        name: "finishing".to_owned(),
        tool: 3,
        cutter: "ball:6".parse().unwrap(),
        spindle_rpm: 12_000.0,
        coolant: true,
        passes: 1,
        moves: vec![
            Move::rapid([0.0, 0.0, 15.0]),
            Move::rapid([0.0, 0.0, 1.0]),
            Move::line([0.0, 0.0, 0.0], 300.0),
            Move {
                travel: Travel::Arc(hump),
                to_mm: [10.0, 0.0, 0.0],
                feed_mm_per_min: 1200.0,
            },
            Move::line([10.0, 0.5, 0.0], 1200.0),
            Move::line([-0.0625, 0.5, 0.0], 1200.0),
            Move::rapid([-0.0625, 0.5, 15.0]),
        ],
    }
}

fn written(machine: &Machine, operations: &[Operation]) -> String {
    let mut code = Vec::new();
    toolpath::write(machine, operations, &header(), &mut code).unwrap();
    String::from_utf8(code).unwrap()
}

#[test]
fn a_program_for_linuxcnc() {
    let code = written(&set_up(Dialect::LinuxCnc), &[tiny()]);
    let expected = "%\n(program 12)\n(model: part  1  ?)\n(relief 2026-01-02)\n(T3 ball:6: finishing)\n\
        G21 G90 G94 G17\nG40 G49 G80\nG64 P0.001\nG54\n(finishing)\nG53 G0 Z0\nG17\nT3 M6\n\
        S12000 M3\nG0 X0 Y0\nG43 H3 Z15\nM8\nZ1\nG1 Z0 F300\nG18 G3 X10 Z0 I5 K0 F1200\nG1 Y0.5\n\
        X-0.063\nG0 Z15\nM9\nM5\nG53 G0 Z0\nG17\nM30\n%\n";
    assert_eq!(code, expected);
}

#[test]
fn a_program_for_fanuc() {
    let code = written(&set_up(Dialect::Fanuc), &[tiny()]);
    let expected = "%\nO0012\n(MODEL: PART  1  ?)\n(RELIEF 2026-01-02)\n(T3 BALL:6: FINISHING)\n\
        G21 G90 G94 G17\nG40 G49 G80\nG54\n(FINISHING)\nG91 G28 Z0.\nG90 G17\nT3 M6\nS12000 M3\n\
        G0 X0. Y0.\nG43 H3 Z15.\nM8\nZ1.\nG1 Z0. F300.\nG18 G3 X10. Z0. I5. K0. F1200.\nG1 Y0.5\n\
        X-0.063\nG0 Z15.\nM9\nM5\nG91 G28 Z0.\nG90 G17\nM30\n%\n";
    assert_eq!(code, expected);
}

/// Reads words of a letter and a number; knows only what this writes.
fn read_back(code: &str) -> Vec<Move> {
    let (mut at, mut feed, mut motion, mut plane) = ([0.0; 3], 0.0, 0, Plane::Xy);
    let mut moves = Vec::new();
    for line in code.lines().filter(|line| !line.starts_with(['(', '%'])) {
        if line.contains("G53") || line.contains("G28") {
            continue;
        }
        let (mut to, mut off, mut moved) = (at, [0.0; 3], false);
        for word in line.split(' ') {
            let (letter, number) = word.split_at(1);
            let number: f64 = number.parse().unwrap();
            match (letter, number as i32) {
                ("G", g @ 0..=3) => motion = g,
                ("G", 17) => plane = Plane::Xy,
                ("G", 18) => plane = Plane::Zx,
                ("G", 19) => plane = Plane::Yz,
                ("F", _) => feed = number,
                _ => {
                    if let Some(axis) = "XYZ".find(letter) {
                        to[axis] = number;
                        moved = true;
                    }
                    if let Some(axis) = "IJK".find(letter) {
                        off[axis] = number;
                    }
                }
            }
        }
        if moved {
            let travel = match motion {
                0 => Travel::Rapid,
                1 => Travel::Line,
                turn => Travel::Arc(Arc {
                    plane,
                    counter_clockwise: turn == 3,
                    centre_mm: std::array::from_fn(|k| at[k] + off[k]),
                }),
            };
            moves.push(Move {
                travel,
                to_mm: to,
                feed_mm_per_min: if motion == 0 { 0.0 } else { feed },
            });
            at = to;
        }
    }
    moves
}

#[test]
fn what_is_written_is_what_was_planned() {
    let surface = surface(&bench::relief(12, [24.0, 18.0], 0.4));
    for (dialect, decimals) in [(Dialect::LinuxCnc, 4), (Dialect::Fanuc, 3)] {
        for angle_deg in [0.0, 90.0] {
            let machine = Machine {
                dialect,
                decimals,
                ..machine(&surface, &["ball:6"])
            };
            let settings = Settings {
                scallop_mm: 0.05,
                angle_deg,
                ..Settings::finishing("ball:6".parse().unwrap())
            };
            let planned = plan(&surface, &machine, &settings, &Unmonitored).unwrap();
            let code = written(&machine, &planned.operations);
            let ours = &planned.operations[0].moves;
            // The first move is made in two: across, and down to where lengths count.
            let read = read_back(&code).split_off(1);
            assert_eq!(read.len(), ours.len());
            let mut arcs = 0;
            for (read, ours) in read.iter().zip(ours) {
                assert_eq!(read.to_mm, ours.to_mm);
                assert!((read.feed_mm_per_min - ours.feed_mm_per_min).abs() <= 0.05);
                match (&read.travel, &ours.travel) {
                    (Travel::Arc(a), Travel::Arc(b)) => {
                        arcs += 1;
                        assert_eq!(
                            (a.plane, a.counter_clockwise),
                            (b.plane, b.counter_clockwise)
                        );
                        for axis in a.plane.axes() {
                            assert!((a.centre_mm[axis] - b.centre_mm[axis]).abs() < 1e-9);
                        }
                    }
                    (a, b) => assert_eq!(a, b),
                }
            }
            assert!(arcs > 20, "{arcs}");
        }
    }
}

#[test]
fn times_are_lengths_by_speeds_and_longer_with_acceleration() {
    let mut machine = set_up(Dialect::LinuxCnc);
    let time = duration(&machine, &tiny());
    let around = core::f64::consts::PI * 5.0;
    let cutting = 1.0 / 300.0 + (around + 0.5 + 10.0625) / 1200.0;
    assert!((time.cutting_s - 60.0 * cutting).abs() < 1e-9, "{time:?}");
    assert!(
        (time.rapid_mm - 29.0).abs() < 1e-9 && (time.rapid_s - 29.0 / 5000.0 * 60.0).abs() < 1e-9
    );
    machine.acceleration_mm_per_s2 = Some(200.0);
    let slow = duration(&machine, &tiny());
    assert!(slow.cutting_s > time.cutting_s && slow.cutting_s < 3.0 * time.cutting_s);
    assert_eq!(slow.cutting_mm, time.cutting_mm);
}

/// A line that leads nowhere is left out, and must not turn the next one into a rapid move.
#[test]
fn what_is_left_out_is_not_remembered() {
    let mut operation = tiny();
    operation.moves = vec![
        Move::rapid([0.0, 0.0, 1.0]),
        Move::line([0.0, 0.0, 1.000_001], 300.0),
        Move::line([0.0, 0.0, -5.0], 300.0),
    ];
    let code = written(&set_up(Dialect::LinuxCnc), &[operation]);
    assert!(code.contains("\nG1 Z-5 F300\n"), "{code}");
}

#[test]
fn a_tool_changes_after_all_is_up_and_still_and_turns_before_it_cuts() {
    let code = written(&set_up(Dialect::LinuxCnc), &[tiny(), tiny()]);
    let second = code.rmatch_indices("(finishing)").next().unwrap().0;
    let before = code[..second].rfind("G53 G0 Z0");
    let order = ["G53 G0 Z0", "T3 M6", "S12000 M3", "G0 X0 Y0", "G43 H3 Z15"];
    let after = &code[second..];
    let places: Vec<usize> = order[1..]
        .iter()
        .map(|word| after.find(word).unwrap())
        .collect();
    assert!(places.is_sorted(), "{code}");
    let is_up = before.is_some() || after.find(order[0]) < after.find(order[1]);
    let stop = code[..second + places[0]].rfind("M5").unwrap();
    assert!(is_up && stop > code.find("M3").unwrap(), "{code}");
}

#[test]
fn downwards_no_cut_is_fed_faster_than_a_plunge() {
    let step = surface(&graph(
        [30.0, 20.0],
        1.0,
        |x, _| if x > 0.0 { 4.0 } else { 0.0 },
    ));
    let machine = machine(&step, &["ball:6"]);
    let plan = plan(
        &step,
        &machine,
        &Settings::finishing("ball:6".parse().unwrap()),
        &Unmonitored,
    );
    let plan = plan.unwrap();
    let [_, plunge] = machine.feeds_mm_per_min(&machine.tools[0]);
    let mut downwards = 0;
    for operation in &plan.operations {
        for pair in operation.moves.windows(2) {
            let off = [0, 1, 2].map(|d| pair[1].to_mm[d] - pair[0].to_mm[d]);
            let length = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt();
            if off[2] < 0.0 && matches!(pair[1].travel, Travel::Line) {
                let down = pair[1].feed_mm_per_min * -off[2] / length;
                // Heights are rounded after feeds are found.
                assert!(
                    down <= 1.01 * plunge || -off[2] < 0.01,
                    "{down} at {:?}",
                    pair[1]
                );
                downwards += usize::from(-off[2] > 0.5 * length);
            }
        }
    }
    assert!(downwards > 5, "{downwards}");
}

#[test]
fn a_cutter_that_would_turn_too_fast_is_refused() {
    let level = surface(&graph([30.0, 20.0], 5.0, |_, _| 0.0));
    let mut machine = machine(&level, &["ball:6"]);
    machine.spindle_rpm = [5000.0, 24_000.0];
    machine.tools[0].speed = toolpath::Speed::Surface(100.0);
    assert_eq!(machine.validate(), Ok(()));
    // 5305 turns a minute would be 100 m a minute; the spindle turns no slower than 12000.
    machine.spindle_rpm = [12_000.0, 24_000.0];
    let error = machine.validate().unwrap_err().to_string();
    assert!(
        error.contains("surface_m_per_min") && error.contains("12000"),
        "{error}"
    );
    machine.spindle_rpm = [1000.0, 4000.0];
    assert_eq!(machine.validate(), Ok(()));
    let rpm = machine.spindle_rpm(&machine.tools[0]);
    assert!(rpm <= 4000.0, "{rpm}");
}

#[test]
fn what_would_take_gigabytes_or_be_a_guess_is_refused() {
    let wide = surface(&graph([600.0, 400.0], 20.0, |x, _| 0.1 * x));
    let mut machine = machine(&wide, &["ball:6", "flat:10"]);
    for travel in [&mut machine.travel.x_mm, &mut machine.travel.y_mm] {
        *travel = [-2000.0, 2000.0];
    }
    let refused = |machine: &Machine, settings: &Settings| {
        plan(&wide, machine, settings, &Unmonitored)
            .unwrap_err()
            .to_string()
    };
    let fine = Settings {
        scallop_mm: 1e-4,
        ..Settings::finishing("ball:6".parse().unwrap())
    };
    let error = refused(&machine, &fine);
    assert!(error.contains("choose a larger scallop"), "{error}");
    // Few places on each of very many passes.
    let long = surface(&graph([5.0, 1900.0], 5.0, |_, y| 0.001 * y));
    let mut needle = bench::machine(&long, &["ball:1"]);
    needle.travel.y_mm = [-2000.0, 2100.0];
    for pattern in [Pattern::Parallel, Pattern::Scallop] {
        let settings = Settings {
            scallop_mm: 1e-4,
            pattern,
            ..Settings::finishing("ball:1".parse().unwrap())
        };
        let error = plan(&long, &needle, &settings, &Unmonitored).unwrap_err();
        let error = error.to_string();
        assert!(
            error.contains("finishing passes: ") && error.contains("20000 at most"),
            "{error}"
        );
    }
    let rough = Settings {
        rough: Some("flat:10".parse().unwrap()),
        ..Settings::finishing("ball:6".parse().unwrap())
    };
    let mut many = machine.clone();
    (many.tools[1].step_down_mm, many.tools[1].step_over_mm) = (0.01, 0.01);
    assert!(refused(&many, &rough).contains("step_down_mm or step_over_mm"));
    many.tools[1].step_down_mm = 1e-6;
    assert!(refused(&many, &rough).contains("0.01 at least"));
    let mut twice = machine.clone();
    twice.tools[1].cutter = twice.tools[0].cutter;
    let error = refused(&twice, &fine);
    assert!(error.contains("numbers 1 and 2 both are ball:6"), "{error}");
}
