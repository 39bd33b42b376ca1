//! For the judges of `tests/judges/toolpath`: surfaces from seeds, where our cutters stand on them, our
//! finishing paths, and how long it took.
//!
//! `judge_toolpath OUT FIRST_SEED SEEDS POINTS`
#![allow(
    clippy::disallowed_types,
    reason = "a program for the judge writes files and measures times"
)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a judge's program that cannot go on says where"
)]

#[path = "../tests/bench/mod.rs"]
mod bench;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Instant;

use range_image::Unmonitored;
use toolpath::{Cutter, Dialect, Header, Machine, Move, Pattern, Plan, Settings, Surface, Travel};

/// Cutters by turns.
const CUTTERS: [&str; 5] = ["ball:6", "bull:6:1", "flat:4", "ball:3", "bull:8:2.5"];
const SIZE_MM: [f64; 2] = [40.0, 30.0];
/// Distance of the points of paths that are judged.
const APART_MM: f64 = 0.02;
const REPEATS: usize = 3;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [out, first, seeds, points] = &words[..] else {
        panic!("usage: judge_toolpath OUT FIRST_SEED SEEDS POINTS");
    };
    let first: u64 = first.parse().unwrap();
    let seeds: u64 = seeds.parse().unwrap();
    for seed in first..first + seeds {
        let folder = Path::new(out).join(format!("{seed:03}"));
        fs::create_dir_all(&folder).unwrap();
        one(seed, points.parse().unwrap(), &folder);
    }
}

fn one(seed: u64, points: usize, folder: &Path) {
    let cutter_text = CUTTERS[(seed % 5) as usize];
    let cutter: Cutter = cutter_text.parse().unwrap();
    let pitch_mm = [0.35, 0.25, 0.2][(seed % 3) as usize];
    let facets = bench::relief(seed, SIZE_MM, pitch_mm);
    fs::write(folder.join("surface.stl"), bench::stl(&facets)).unwrap();
    let began = Instant::now();
    let surface = bench::surface(&facets);
    let build_s = began.elapsed().as_secs_f64();

    let mut draw = bench::Draw::new(seed + 1000);
    let places: Vec<[f64; 2]> = (0..points)
        .map(|_| {
            [
                draw.between(-2.0, SIZE_MM[0] + 2.0),
                draw.between(-2.0, SIZE_MM[1] + 2.0),
            ]
        })
        .collect();
    let mut drop_s = f64::INFINITY;
    let mut tips = Vec::new();
    for _ in 0..REPEATS {
        let began = Instant::now();
        tips = toolpath::drop_cutter(&surface, &cutter, &places, &Unmonitored).unwrap();
        drop_s = drop_s.min(began.elapsed().as_secs_f64());
    }
    let tips: Vec<f64> = places
        .iter()
        .zip(&tips)
        .flat_map(|([x, y], tip)| [*x, *y, tip.map_or(f64::NAN, |tip| tip.z_mm)])
        .collect();
    write(&folder.join("tips.f64"), &tips);

    let machine = bench::machine(&surface, &[cutter_text]);
    let settings = Settings {
        // A flat end leaves steps on slopes: what suits others would be a pass every few hundredths.
        scallop_mm: match (cutter.corner_mm() > 0.0, seed % 2) {
            (false, _) => 0.25,
            (true, 0) => 0.01,
            (true, _) => 0.03,
        },
        ..Settings::finishing(cutter)
    };
    let began = Instant::now();
    let plan = toolpath::plan(&surface, &machine, &settings, &Unmonitored).unwrap();
    let plan_s = began.elapsed().as_secs_f64();
    let moves = &plan.operations[0].moves;
    write(&folder.join("path.f64"), &path(moves));
    write(&folder.join("moves.f64"), &ends(moves));
    code(&machine, &plan, &folder.join("path.nc"));
    fs::write(
        folder.join("tool.tbl"),
        format!("T1 P1 Z0 D{}\n", 2.0 * cutter.radius_mm()),
    )
    .unwrap();

    // The other pattern, and the other dialect, whose coordinates are coarser.
    if cutter.disc_mm() == 0.0 {
        let settings = Settings {
            pattern: Pattern::Scallop,
            ..settings.clone()
        };
        program(&surface, &machine, &settings, &folder.join("scallop.nc"));
    }
    if seed.is_multiple_of(3) {
        let machine = Machine {
            dialect: Dialect::Fanuc,
            decimals: 3,
            ..machine.clone()
        };
        program(&surface, &machine, &settings, &folder.join("fanuc.nc"));
    }

    let mut told = String::new();
    let arcs = moves
        .iter()
        .filter(|m| matches!(m.travel, Travel::Arc(_)))
        .count();
    writeln!(told, "{{").unwrap();
    for (name, value) in [
        ("radius_mm", cutter.radius_mm()),
        ("corner_mm", cutter.corner_mm()),
        ("triangles", surface.triangles() as f64),
        ("build_s", build_s),
        ("drop_s", drop_s),
        ("plan_s", plan_s),
        ("moves", moves.len() as f64),
        ("arcs", arcs as f64),
        ("scallop_mm", settings.scallop_mm),
        ("passes", plan.operations[0].passes as f64),
    ] {
        writeln!(told, "  \"{name}\": {value},").unwrap();
    }
    writeln!(told, "  \"cutter\": \"{cutter_text}\"\n}}").unwrap();
    fs::write(folder.join("told.json"), told).unwrap();
}

fn program(surface: &Surface, machine: &Machine, settings: &Settings, path: &Path) {
    let plan = toolpath::plan(surface, machine, settings, &Unmonitored).unwrap();
    code(machine, &plan, path);
}

fn code(machine: &Machine, plan: &Plan, path: &Path) {
    let header = Header {
        title: "surface".to_owned(),
        author: "judge".to_owned(),
        timestamp: "2026-01-01".to_owned(),
    };
    let mut code = Vec::new();
    toolpath::write(machine, &plan.operations, &header, &mut code).unwrap();
    fs::write(path, code).unwrap();
}

/// Points all along the moves at a feed.
fn path(moves: &[Move]) -> Vec<f64> {
    let mut points = Vec::new();
    let mut from = moves[0].to_mm;
    for step in moves {
        for to in step.points_mm(from, 1e-6) {
            if step.travel != Travel::Rapid {
                let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
                let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
                let count = (length / APART_MM).ceil().max(1.0) as usize;
                for k in 1..=count {
                    let share = k as f64 / count as f64;
                    points.extend((0..3).map(|i| from[i] + share * way[i]));
                }
            }
            from = to;
        }
    }
    points
}

/// Of every move: kind (0 rapid, 1 line, 2 arc), end, and of arcs the centre and the sense.
fn ends(moves: &[Move]) -> Vec<f64> {
    let mut numbers = Vec::new();
    for step in moves {
        let (kind, centre, sense) = match &step.travel {
            Travel::Rapid => (0.0, [0.0; 3], 0.0),
            Travel::Line => (1.0, [0.0; 3], 0.0),
            Travel::Arc(arc) => {
                let sense = if arc.counter_clockwise { 1.0 } else { -1.0 };
                (2.0, arc.centre_mm, sense)
            }
        };
        numbers.push(kind);
        numbers.extend(step.to_mm);
        numbers.extend(centre);
        numbers.push(sense);
    }
    numbers
}

fn write(path: &Path, numbers: &[f64]) {
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    fs::write(path, bytes).unwrap();
}
