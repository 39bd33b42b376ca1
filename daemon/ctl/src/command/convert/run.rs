//! The conversion itself.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use deliverables::{
    DeliverError, Inputs, ManifestFile, MeasuredPoints, PageFormats, Report, Stopwatch, WriteError,
    mesh_report, write_atomically,
};
use pipeline::{Extent, InMemory, Observer, PipelineError, Settings, Stage};
use range_image::Monitor;
use serde::Serialize;

use super::Args;
use super::args::OutputFormat;
use crate::command::{pages, places};
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::output;
use crate::progress::Progress;

/// Samples closer than this are rather in another unit.
const FINEST_PITCH_MM: f64 = 0.001;

/// What `--json` prints.
#[derive(Serialize)]
struct Converted {
    output: PathBuf,
    file: ManifestFile,
    /// Where the points were written, if they were.
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<PathBuf>,
    report: Report,
    /// Remarks on the input, told on standard error.
    #[serde(skip)]
    notes: Vec<String>,
}

/// Shows the stages on standard error; ends them on Ctrl-C.
struct Shown {
    stop: AtomicBool,
    shown: Mutex<Option<(Stage, Progress)>>,
}

impl Monitor for Shown {
    fn is_cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn progress(&self, fraction: f64) {
        if let Ok(mut shown) = self.shown.lock()
            && let Some((_, bar)) = shown.as_mut()
        {
            bar.at(fraction, "");
        }
    }
}

impl Observer for Shown {
    fn stage(&self, stage: Stage) {
        if let Ok(mut shown) = self.shown.lock() {
            if let Some((_, bar)) = shown.take() {
                bar.finish("done");
            }
            *shown = Some((stage, Progress::share(stage.as_str())));
        }
    }
}

impl Shown {
    fn end(&self, message: &str) {
        if let Ok(mut shown) = self.shown.lock()
            && let Some((_, bar)) = shown.take()
        {
            bar.finish(message);
        }
    }
}

/// Converts; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let shown = std::sync::Arc::new(Shown {
        stop: AtomicBool::new(false),
        shown: Mutex::new(None),
    });
    let worker = std::sync::Arc::clone(&shown);
    let mut work = tokio::task::spawn_blocking(move || convert(&args, &worker));
    let joined = tokio::select! {
        joined = &mut work => joined,
        _ = tokio::signal::ctrl_c() => {
            shown.stop.store(true, Ordering::Relaxed);
            work.await
        }
    };
    let converted = joined.map_err(|error| Failure::at("the conversion broke off", &error))??;
    for note in &converted.notes {
        eprintln!("relief: note: {note}");
    }
    output::either(json, &converted, told)
}

fn convert(args: &Args, shown: &Shown) -> Result<Converted, Failure> {
    let output = args.output()?;
    args.check_name()?;
    let format = OutputFormat::of(&output).unwrap_or(OutputFormat::Iges);
    args.check_options(format)?;
    let points = args.points(&output)?;
    places::check_file(&output)?;
    points.map_or(Ok(()), |(path, _)| places::check_file(path))?;
    args.report.as_deref().map_or(Ok(()), places::check_file)?;
    pages::check(&args.page)?;
    args.pictures
        .as_deref()
        .map_or(Ok(()), places::check_directory)?;
    let input = input::read(&args.input, args.units())?;
    let file = args.input.display();
    if let Some(why) = pipeline::no_surface(&input.columns, input.column_pitch_mm) {
        return Err(Failure::Failed(format!("{file}: {why}")));
    }
    let settings = args
        .settings(input.settings())
        .map_err(|failure| match failure {
            Failure::Usage(_) if args.pitch_mm.is_none() && input.pitch_mm() < FINEST_PITCH_MM => {
                too_dense(&args.input, input.pitch_mm())
            }
            other => other,
        })?;
    check_extent(args, &input, &settings)?;
    let cad = args.cad(format, input.scan.operator.as_deref());
    let timestamp = args.timestamp(input.timestamp)?;
    let name = args.name(input.name.as_deref());

    let watch = Stopwatch::new(shown);
    let scan = InMemory {
        columns: &input.columns,
        camera_mm: input.camera_mm,
    };
    let processed = pipeline::process_scan(&scan, &settings, &watch);
    let (image, outcome) = processed.map_err(|error| {
        shown.end("failed");
        refused(&args.input, &error, input.units_suspected.as_deref())
    })?;
    let mut notes = input.notes;
    // Points of files have been remarked on in their own unit.
    if input.scan.dropouts.is_some() {
        notes.extend(pipeline::unusual_size(&image));
    }
    let inputs = Inputs {
        name: &name,
        timestamp,
        image: &image,
        outcome: &outcome,
        settings: &settings,
        cad: &cad,
        points: Some(MeasuredPoints(&scan)),
        page: PageFormats::NONE,
        scan: input.scan,
        warnings: notes.clone(),
        versions: std::collections::BTreeMap::default(),
    };
    watch.stage(Stage::Export);
    let model = &outcome.reconstruction.model;
    let cannot = |path: &Path, error: DeliverError| match error {
        DeliverError::Cancelled(_) => Failure::Interrupted,
        DeliverError::Export(WriteError::Io(error)) => {
            Failure::at(format!("cannot write {}", path.display()), &error)
        }
        error => Failure::at(format!("cannot write {}", path.display()), &error),
    };
    let mesh = match format {
        OutputFormat::Mesh(_) => {
            let mesh = deliverables::triangles(model, cad.meshes.tolerance_mm, &watch);
            Some(mesh.map_err(|error| Failure::Failed(format!("{file}: {error}")))?)
        }
        _ => None,
    };
    let written = write_atomically::<DeliverError>(&output, |sink| {
        match (format, &mesh) {
            (OutputFormat::Step, _) => {
                deliverables::write_step(model, &name, timestamp, &cad, sink)?;
            }
            (OutputFormat::Mesh(format), Some(mesh)) => {
                deliverables::write_triangles(mesh, format, &name, sink)?;
            }
            _ => deliverables::write_iges(model, &name, timestamp, &cad, sink)?,
        }
        Ok(())
    })
    .map_err(|error| cannot(&output, error))?;
    if let Some((path, format)) = points {
        let measured = MeasuredPoints(&scan);
        let named = (name.as_str(), timestamp);
        write_atomically::<DeliverError>(path, |sink| {
            let scan = &inputs.scan;
            Ok(deliverables::write_measured(
                measured, format, named, scan, sink,
            )?)
        })
        .map_err(|error| cannot(path, error))?;
    }
    watch.progress(1.0);
    let mut drawings = deliverables::Drawings::new();
    if args.pictures.is_some() || !args.page.is_empty() {
        watch.stage(Stage::Pictures);
        drawings = deliverables::draw_pictures(&inputs)
            .map_err(|error| Failure::at("cannot draw the pictures", &error))?;
        watch.progress(1.0);
    }
    if let Some(directory) = &args.pictures {
        fs::create_dir_all(directory)
            .and_then(|()| deliverables::write_pictures(directory, &drawings))
            .map_err(|error| {
                Failure::at(format!("cannot draw into {}", directory.display()), &error)
            })?;
    }
    let mut report = Report::new(&inputs, watch.read());
    report.mesh = mesh.as_ref().map(mesh_report);
    if !args.page.is_empty() {
        let page = deliverables::scan_page(&report, &drawings, std::slice::from_ref(&written));
        pages::write(&args.page, &page)?;
    }
    shown.end("done");
    if let Some(path) = &args.report {
        write_report(path, &report)?;
    }
    Ok(Converted {
        output,
        file: written,
        points: args.points.clone(),
        report,
        notes: notes.iter().map(|note| format!("{file}: {note}")).collect(),
    })
}

/// Refuses grids that are absurdly fine for the samples.
fn check_extent(args: &Args, input: &Input, settings: &Settings) -> Result<(), Failure> {
    let pitch_mm = settings.regrid.pitch_mm;
    let Some(extent) = Extent::within(&input.columns, &settings.regrid.roi) else {
        return Ok(());
    };
    let finest_mm = extent.finest_pitch_mm();
    if pitch_mm >= finest_mm {
        return Ok(());
    }
    let file = args.input.display();
    if args.pitch_mm.is_some() {
        return Err(Failure::Usage(format!(
            "a grid of {pitch_mm} mm is too fine for {file}: --pitch-mm {finest_mm} is the least \
             that its size and its number of samples allow"
        )));
    }
    let [width, height] = extent.sides_mm();
    Err(Failure::Failed(format!(
        "{file}: its samples ask for a grid of {pitch_mm} mm, but spread over {width:.1} x \
         {height:.1} mm, too far for it; if single points lie far from the part, leave them out \
         with --roi-x-mm and --roi-y-mm, else choose --pitch-mm {finest_mm} or more"
    )))
}

fn too_dense(input: &Path, pitch_mm: f64) -> Failure {
    Failure::Failed(format!(
        "{}: its samples ask for a grid of {pitch_mm} mm, finer than any that is offered; if its \
         coordinates are not in millimetres, say so with --units, else choose --pitch-mm",
        input.display()
    ))
}

fn write_report(path: &Path, report: &Report) -> Result<(), Failure> {
    write_atomically::<deliverables::DeliverError>(path, |sink| {
        serde_json::to_writer_pretty(&mut *sink, report)?;
        Ok(sink.write_all(b"\n")?)
    })
    .map(|_| ())
    .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))
}

fn refused(input: &Path, error: &PipelineError, suspicion: Option<&str>) -> Failure {
    if matches!(error, PipelineError::Cancelled) {
        return Failure::Interrupted;
    }
    let message = format!("{}: {error}", input.display());
    let more = suspicion.into_iter().chain(error.hint());
    Failure::Failed(more.fold(message, |message, part| format!("{message}; {part}")))
}

fn told(converted: &Converted) -> String {
    let report = &converted.report;
    let mut lines = vec![converted.output.display().to_string()];
    lines.extend(
        converted
            .points
            .iter()
            .map(|path| path.display().to_string()),
    );
    let mut report = report.clone();
    report.warnings.retain(|warning| {
        !converted
            .notes
            .iter()
            .any(|note| note.ends_with(warning.as_str()))
    });
    lines.extend(crate::summary::lines(&report));
    lines.join("\n")
}
