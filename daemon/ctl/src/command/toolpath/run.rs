//! The planning itself.

use std::path::{Path, PathBuf};

use deliverables::write_atomically;
use range_image::{Lattice, RangeImage};
use serde::Serialize;
use toolpath::{Header, HeightField, Machine, Plan, Surface, ToolpathError, Travel};

use super::{Args, machine, model, summary};
use crate::command::shown::{self, Shown};
use crate::command::{convert, places};
use crate::failure::Failure;
use crate::output;

/// Nodes along the longer side of the simulation, and the finest that it is.
const NODES: f64 = 1000.0;
const FINEST_MM: f64 = 0.02;

/// A program that cuts deeper than this, millimetres, is not written.
const MOST_GOUGE_MM: f64 = 0.01;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Planned {
    pub(super) output: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) picture: Option<PathBuf>,
    pub(super) triangles: usize,
    pub(super) operations: Vec<Told>,
    pub(super) total_s: f64,
    pub(super) simulation: Simulation,
    pub(super) warnings: Vec<String>,
}

/// An operation in numbers.
#[derive(Serialize)]
pub(super) struct Told {
    pub(super) name: String,
    pub(super) tool: u32,
    pub(super) cutter: String,
    pub(super) spindle_rpm: f64,
    pub(super) passes: usize,
    pub(super) moves: usize,
    pub(super) arcs: usize,
    pub(super) cutting_mm: f64,
    pub(super) rapid_mm: f64,
    pub(super) time_s: f64,
}

/// What the simulated removal left.
#[derive(Serialize)]
pub(super) struct Simulation {
    pub(super) pitch_mm: f64,
    pub(super) nodes: usize,
    /// Deepest that it cut below the model.
    pub(super) gouge_mm: f64,
    /// Most that it left on the model, and what it left at most on 95 of 100 nodes.
    pub(super) leftover_mm: f64,
    pub(super) leftover_95_mm: f64,
}

/// Plans; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let plan = move |shown: &Shown| {
        regrid::with_threads(args.threads, || mill(&args, shown))
            .map_err(|error| Failure::at("cannot plan", &error))
            .and_then(|planned| planned)
    };
    let planned = shown::work("the planning", plan).await?;
    for warning in &planned.warnings {
        eprintln!("relief: note: {warning}");
    }
    output::either(json, &planned, summary::told)
}

fn mill(args: &Args, shown: &Shown) -> Result<Planned, Failure> {
    let settings = args.settings()?;
    let output = args.output();
    places::check_file(&output)?;
    for input in [&args.model, &args.machine] {
        for written in std::iter::once(&output).chain(&args.picture) {
            if convert::same_file(input, written) {
                return Err(Failure::Usage(format!(
                    "{} is read, and cannot be written as well; choose another name",
                    input.display()
                )));
            }
        }
    }
    args.picture.as_deref().map_or(Ok(()), places::check_file)?;
    let timestamp = args.timestamp()?;
    let machine = machine::read(&args.machine)?;
    let (vertices, triangles) = model::read(&args.model)?;
    let refused = |error: ToolpathError| match error {
        ToolpathError::Cancelled(_) => Failure::Interrupted,
        ToolpathError::Machine(error) => Failure::at(args.machine.display(), &error),
        other => Failure::at(args.model.display(), &other),
    };
    let surface = Surface::new(&vertices, &triangles).map_err(refused)?;
    shown.begin("passes");
    let plan = toolpath::plan(&surface, &machine, &settings, shown).map_err(refused)?;
    shown.begin("simulate");
    let pitch_mm = args.pitch_mm.unwrap_or_else(|| pitch_mm(&surface));
    let finest = [Some(settings.finish), settings.rough]
        .into_iter()
        .flatten();
    let radius_mm = finest
        .map(|cutter| cutter.radius_mm())
        .fold(f64::INFINITY, f64::min);
    if pitch_mm > radius_mm / 2.0 {
        return Err(Failure::Usage(format!(
            "a simulation every {pitch_mm} mm would not see cutters of radius {radius_mm} mm; \
             choose --pitch-mm {} or less",
            radius_mm / 2.0
        )));
    }
    let field = simulated(&surface, &machine, &plan, pitch_mm, shown).map_err(refused)?;
    let deviations = field.deviations_mm(&surface);
    let simulation = measured(&field, &deviations);
    if simulation.nodes == 0 {
        return Err(Failure::Failed(format!(
            "{}: no place of the model could be simulated; choose a finer --pitch-mm",
            args.model.display()
        )));
    }
    if simulation.gouge_mm > MOST_GOUGE_MM {
        return Err(Failure::Failed(format!(
            "{}: the simulation cuts {:.4} mm too deep; nothing is written. Please report it with the \
             model and the machine's file",
            args.model.display(),
            simulation.gouge_mm
        )));
    }
    if let Some(path) = &args.picture {
        let image = image(&field, &deviations);
        let (low, high) = (-simulation.gouge_mm, simulation.leftover_mm);
        let subtitle = format!(
            "machined surface above the model: {low:+.4} to {high:+.4} mm, 95 % within {:.4} mm",
            simulation.leftover_95_mm
        );
        write_atomically::<std::io::Error>(path, |sink| {
            deliverables::picture::write_machined(&image, &file_name(&args.model), &subtitle, sink)
        })
        .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
    }
    let header = Header {
        title: file_name(&args.model),
        author: format!("relief {}", env!("CARGO_PKG_VERSION")),
        timestamp: timestamp.to_string(),
    };
    write_atomically::<std::io::Error>(&output, |mut sink| {
        toolpath::write(&machine, &plan.operations, &header, &mut sink)
    })
    .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let operations = told(&machine, &plan);
    Ok(Planned {
        output,
        picture: args.picture.clone(),
        triangles: surface.triangles(),
        total_s: operations.iter().map(|o| o.time_s).sum(),
        operations,
        simulation,
        warnings: plan.notes,
    })
}

fn pitch_mm(surface: &Surface) -> f64 {
    let [low, high] = surface.bounds_mm();
    let longer = (high[0] - low[0]).max(high[1] - low[1]);
    (longer / NODES).max(FINEST_MM)
}

/// The stock over the surface after all operations; a rapid move into material is a defect of
/// ours, and no program is written then.
fn simulated(
    surface: &Surface,
    machine: &Machine,
    plan: &Plan,
    pitch_mm: f64,
    shown: &Shown,
) -> Result<HeightField, ToolpathError> {
    let within = [0, 1].map(|axis| within_mm(surface, machine, plan, axis));
    let field = HeightField::of_stock(&machine.stock, within, pitch_mm)?;
    let removal = field.remove(&plan.operations, shown)?;
    if removal.rapid_cut_mm > 0.0 {
        return Err(ToolpathError::RapidCut {
            depth_mm: removal.rapid_cut_mm,
            at_mm: removal.rapid_cut_at_mm,
        });
    }
    Ok(removal.field)
}

/// The stock along an axis as far as tools come: beside the model as well.
fn within_mm(surface: &Surface, machine: &Machine, plan: &Plan, axis: usize) -> [f64; 2] {
    let [low, high] = surface.bounds_mm();
    let [from, to] = machine.stock.axis(axis);
    let radii = plan.operations.iter().map(|o| o.cutter.radius_mm());
    let aside = 2.0 * radii.fold(0.0, f64::max);
    [
        (low[axis] - aside).max(from).min(low[axis]),
        (high[axis] + aside).min(to).max(high[axis]),
    ]
}

fn measured(field: &HeightField, deviations: &[Option<f64>]) -> Simulation {
    let mut known: Vec<f64> = deviations.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * known.len().saturating_sub(1) as f64).round() as usize;
        known.get(index).copied().unwrap_or(0.0)
    };
    Simulation {
        pitch_mm: field.pitch_mm,
        nodes: known.len(),
        gouge_mm: (-at(0.0)).max(0.0),
        leftover_mm: at(1.0).max(0.0),
        leftover_95_mm: at(0.95).max(0.0),
    }
}

/// The deviations as an image, for the picture.
fn image(field: &HeightField, deviations: &[Option<f64>]) -> RangeImage {
    let lattice = Lattice {
        pitch_mm: field.pitch_mm,
    };
    let first = |axis: usize| (field.origin_mm[axis] / field.pitch_mm).round() as i64;
    let mut image = RangeImage::masked(lattice, first(0), first(1), field.columns, field.rows);
    for (node, deviation) in deviations.iter().enumerate() {
        image.set_z_mm(node % field.columns, node / field.columns, *deviation);
    }
    image
}

fn told(machine: &Machine, plan: &Plan) -> Vec<Told> {
    let of = |operation: &toolpath::Operation| {
        let time = toolpath::duration(machine, operation);
        let arcs = operation.moves.iter();
        let arcs = arcs.filter(|step| matches!(step.travel, Travel::Arc(_)));
        Told {
            name: operation.name.clone(),
            tool: operation.tool,
            cutter: operation.cutter.to_string(),
            spindle_rpm: operation.spindle_rpm,
            passes: operation.passes,
            moves: operation.moves.len(),
            arcs: arcs.count(),
            cutting_mm: time.cutting_mm,
            rapid_mm: time.rapid_mm,
            time_s: time.total_s(),
        }
    };
    plan.operations.iter().map(of).collect()
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
