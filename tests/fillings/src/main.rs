//! Holes cut from known surfaces, filled, and held against the surfaces; what solvers cost.

#[path = "../../../geometry/fill/tests/common/mod.rs"]
mod common;
mod cost;
mod score;

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;
use fill::{Kernel, Method};

use common::Shape;
use score::{Case, score};

/// Hold fillings against the surfaces that the holes were cut from.
#[derive(Debug, Parser)]
struct Options {
    /// Holes for each surface and size, each where its own seed puts it.
    #[arg(long, default_value_t = 5)]
    holes: u64,
    /// The first seed; what was tuned with has seeds below 100.
    #[arg(long, default_value_t = 100)]
    seed: u64,
    /// Sizes of holes, per cent of the surface's size.
    #[arg(long, value_delimiter = ',', default_value = "1,3,10,20,30")]
    sizes: Vec<f64>,
    /// Leave out the costs of solvers.
    #[arg(long)]
    no_costs: bool,
    /// Write the tables behind this file's text up to its first table's heading.
    #[arg(long, value_name = "FILE.md")]
    write: Option<PathBuf>,
}

/// How a hole is filled, by the name in tables.
const WAYS: [(&str, Method, Option<Kernel>); 4] = [
    ("default", Method::Relief, None),
    ("triharmonic", Method::Relief, Some(Kernel::Triharmonic)),
    ("thin plate", Method::Relief, Some(Kernel::ThinPlate)),
    ("the paper's", Method::Yoo, None),
];
const NOISE_MM: f64 = 0.05;
/// Where the tables begin in the page.
const TABLES: &str = "## Without noise\n";

fn main() -> Result<()> {
    let options = Options::parse();
    let mut page = String::from(TABLES);
    accuracy(&options, &mut page)?;
    noise(&options, &mut page)?;
    if !options.no_costs {
        cost::table(&mut page)?;
    }
    println!("{page}");
    if let Some(path) = &options.write {
        let text = fs::read_to_string(path)?;
        let head = text.split(TABLES).next().unwrap_or_default();
        fs::write(path, format!("{head}{page}"))?;
    }
    Ok(())
}

fn cases(options: &Options, noise_mm: f64) -> impl Iterator<Item = (Shape, f64, Vec<Case>)> + '_ {
    Shape::ALL.into_iter().flat_map(move |shape| {
        options.sizes.iter().map(move |&size| {
            let cases = (options.seed..options.seed + options.holes).map(|seed| Case {
                shape,
                share: size / 100.0,
                seed,
                noise_mm,
            });
            (shape, size, cases.collect())
        })
    })
}

fn accuracy(options: &Options, page: &mut String) -> Result<()> {
    writeln!(
        page,
        "\n{} holes each, seeds {} to {}. Root mean square and largest distance of new vertices, per \
         cent of the hole's diameter, of all holes; the largest angle between a new triangle on the \
         border and the surface; mean time of a hole on this machine.\n",
        options.holes,
        options.seed,
        options.seed + options.holes - 1
    )?;
    writeln!(
        page,
        "| surface | hole, % | way | rms, % | largest, % | border, degrees | time, s | left open |"
    )?;
    writeln!(
        page,
        "| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: |"
    )?;
    for (shape, size, cases) in cases(options, 0.0) {
        for (name, method, kernel) in WAYS {
            let own = score(&cases, method, kernel)?;
            writeln!(
                page,
                "| {shape:?} | {size} | {name} | {:.5} | {:.5} | {:.2} | {:.2} | {} |",
                100.0 * own.rms,
                100.0 * own.largest,
                own.border_deg,
                own.time_s,
                own.open
            )?;
        }
    }
    Ok(())
}

fn noise(options: &Options, page: &mut String) -> Result<()> {
    writeln!(page, "\n## With noise\n")?;
    writeln!(
        page,
        "Vertices moved along the normals by noise of {NOISE_MM} mm. Root mean square of all holes and of \
         the worst of them, millimetres, and the noise that was told, the mean.\n"
    )?;
    writeln!(
        page,
        "| surface | hole, % | rms, mm | worst hole, mm | told, mm | left open |"
    )?;
    writeln!(page, "| --- | ---: | ---: | ---: | ---: | ---: |")?;
    for (shape, size, cases) in cases(options, NOISE_MM) {
        let own = score(&cases, Method::Relief, None)?;
        writeln!(
            page,
            "| {shape:?} | {size} | {:.4} | {:.4} | {:.4} | {} |",
            own.rms_mm, own.worst_mm, own.told_mm, own.open
        )?;
    }
    Ok(())
}
