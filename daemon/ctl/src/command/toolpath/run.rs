//! The planning itself.

use std::path::{Path, PathBuf};

use deliverables::{MachineFile, MillError, OperationFigures, SimulationFigures, write_atomically};
use serde::Serialize;
use toolpath::{Surface, ToolpathError};

use super::{Args, model, summary};
use crate::command::places;
use crate::command::shown::{self, Shown};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Planned {
    pub(super) output: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) picture: Option<PathBuf>,
    pub(super) triangles: usize,
    pub(super) operations: Vec<OperationFigures>,
    pub(super) total_s: f64,
    pub(super) simulation: SimulationFigures,
    pub(super) warnings: Vec<String>,
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
    let written: Vec<&Path> = std::iter::once(output.as_path())
        .chain(args.picture.as_deref())
        .collect();
    let read = [
        ("model", args.model.as_path()),
        ("machine's file", &args.machine),
    ];
    places::check_files(&written, &read)?;
    let timestamp = args.timestamp()?;
    let cannot_use = |why: String| Failure::Failed(why);
    let machine =
        MachineFile::read(&args.machine).map_err(|error| cannot_use(error.to_string()))?;
    let machine = machine
        .machine()
        .map_err(|why| cannot_use(format!("{}: {why}", args.machine.display())))?;
    let (vertices, triangles) = model::read(&args.model)?;
    let refused = |error: MillError| match error {
        MillError::Toolpath(ToolpathError::Cancelled(_)) => Failure::Interrupted,
        MillError::Toolpath(ToolpathError::Machine(error)) => {
            Failure::at(args.machine.display(), &error)
        }
        MillError::Coarse {
            pitch_mm,
            radius_mm,
        } => Failure::Usage(format!(
            "a simulation every {pitch_mm} mm would not see cutters of radius {radius_mm} mm; \
             choose --pitch-mm {} or less",
            radius_mm / 2.0
        )),
        other => Failure::at(args.model.display(), &other),
    };
    let surface = Surface::new(&vertices, &triangles).map_err(|error| refused(error.into()))?;
    shown.begin("passes");
    let simulating = || shown.begin("simulate");
    let milled = deliverables::mill(
        &surface,
        &machine,
        &settings,
        args.pitch_mm,
        shown,
        &simulating,
    )
    .map_err(refused)?;
    let title = file_name(&args.model);
    if let Some(path) = &args.picture {
        write_atomically::<std::io::Error>(path, |sink| milled.draw(&title, sink))
            .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
    }
    write_atomically::<std::io::Error>(&output, |sink| {
        milled.write(&machine, &title, timestamp, sink)
    })
    .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let operations = milled.operations(&machine);
    Ok(Planned {
        output,
        picture: args.picture.clone(),
        triangles: surface.triangles(),
        total_s: operations.iter().map(|o| o.time_s).sum(),
        operations,
        simulation: milled.simulation,
        warnings: milled.plan.notes,
    })
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
