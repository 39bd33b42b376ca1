//! The comparison itself.

use std::path::{Path, PathBuf};

use compare::{CompareError, Nominal};
use deliverables::{ComparisonReport, write_atomically};
use jiff::Timestamp;
use range_image::Column;
use regrid::Roi;
use serde::Serialize;

use super::{Args, nominal, summary};
use crate::command::shown::{self, Shown};
use crate::command::{grid, pages, places};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Compared {
    /// Whether nothing lies significantly beyond the limits.
    pub(super) passed: bool,
    /// The map that was drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) map: Option<PathBuf>,
    pub(super) report: ComparisonReport,
}

/// Compares; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let compared = shown::work("the comparison", move |shown| compare_files(&args, shown)).await?;
    for warning in &compared.report.warnings {
        eprintln!("relief: note: {warning}");
    }
    output::either(json, &compared, summary::told)?;
    if compared.passed {
        return Ok(());
    }
    Err(Failure::Failed(summary::verdict(&compared.report)))
}

fn compare_files(args: &Args, shown: &Shown) -> Result<Compared, Failure> {
    let settings = args.settings()?;
    args.report.as_deref().map_or(Ok(()), places::check_file)?;
    args.map.as_deref().map_or(Ok(()), places::check_file)?;
    pages::check(&args.page)?;
    // The nominal first: it is the quicker one to be refused.
    let nominal = nominal::read(&args.nominal, args.nominal_unit_mm())?;
    let input = grid::scan(&args.scan, args.units())?;
    let regrid = args.grid.apply(input.settings().regrid)?;
    let image = grid::image(&input, &regrid, &args.scan, shown)?;
    shown.begin("compare");
    let columns = cropped(&input.columns, &regrid.roi);
    let compared = regrid::with_threads(regrid.threads, || {
        compare::compare(&image, &columns, &nominal, &settings, shown)
    })
    .map_err(|error| Failure::at("cannot compare", &error))?;
    let comparison = compared.map_err(|error| refused(args, &error))?;
    let mut map = Vec::new();
    if args.map.is_some() || !args.page.is_empty() {
        let title = title(args);
        deliverables::picture::write_deviations(
            &image,
            &comparison,
            settings.tolerance,
            &title,
            &mut map,
        )
        .map_err(|error| Failure::at("cannot draw the map", &error))?;
    }
    if let Some(path) = &args.map {
        write_atomically::<std::io::Error>(path, |sink| sink.write_all(&map))
            .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
    }
    let time = scanned(args, input.timestamp);
    let warnings = remarks(args, input.notes, &nominal);
    let source = file_name(&args.nominal);
    let nominal = (source, &nominal);
    let report = ComparisonReport::new(
        &comparison,
        &image,
        &settings,
        input.scan,
        nominal,
        warnings,
    );
    if let Some(path) = &args.report {
        write_atomically::<deliverables::DeliverError>(path, |sink| {
            serde_json::to_writer_pretty(&mut *sink, &report)?;
            Ok(sink.write_all(b"\n")?)
        })
        .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    }
    if !args.page.is_empty() {
        let page = deliverables::comparison_page(&report, &title(args), time, map);
        pages::write(&args.page, &page)?;
    }
    Ok(Compared {
        passed: report.passed,
        map: args.map.clone(),
        report,
    })
}

/// What is odd about the files, each named.
fn remarks(args: &Args, of_scan: Vec<String>, nominal: &Nominal) -> Vec<String> {
    let of_scan = of_scan
        .iter()
        .map(|note| format!("{}: {note}", args.scan.display()));
    let of_nominal = nominal
        .remarks()
        .iter()
        .map(|remark| format!("{}: {remark}", args.nominal.display()));
    of_scan.chain(of_nominal).collect()
}

fn title(args: &Args) -> String {
    format!(
        "{} against {}",
        file_name(&args.scan),
        file_name(&args.nominal)
    )
}

/// When the scan was taken, or when its file was last changed.
fn scanned(args: &Args, kept: Option<Timestamp>) -> Timestamp {
    let changed = || {
        let changed = std::fs::metadata(&args.scan).and_then(|file| file.modified());
        Timestamp::try_from(changed.ok()?).ok()
    };
    kept.or_else(changed).unwrap_or(Timestamp::UNIX_EPOCH)
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// The samples in the region of interest.
fn cropped(columns: &[Column], roi: &Roi) -> Vec<Column> {
    let holds = |(low, high): (f64, f64), value: f64| (low..=high).contains(&value);
    let inside = columns
        .iter()
        .filter(|column| holds(roi.x_mm, column.x_mm()));
    inside
        .map(|column| {
            let samples = column.samples().iter().copied();
            let samples = samples.filter(|s| holds(roi.y_mm, s.y_mm) && holds(roi.z_mm, s.z_mm));
            Column::new(column.x_mm(), samples.collect())
        })
        .collect()
}

fn refused(args: &Args, error: &CompareError) -> Failure {
    let (scan, nominal) = (args.scan.display(), args.nominal.display());
    let hint = match error {
        CompareError::Cancelled(_) => return Failure::Interrupted,
        CompareError::Units { .. } => {
            "say so with --units for the scan or, where the nominal is an STL file, with \
             --nominal-units"
        }
        CompareError::NoOverlap { .. } => {
            "both must be in one frame, x along the table, y up, z towards the camera; else leave \
             --align at best-fit"
        }
        CompareError::NotRegistered { .. } => {
            "check that the nominal shows the scanned side towards +z, leave out what is not the \
             part with --roi-x-mm, --roi-y-mm and --roi-z-mm, or choose a larger --limit-mm"
        }
        CompareError::NothingMeasured { .. } => "check the region of interest and the pitch",
        _ => return Failure::Failed(format!("{scan} against {nominal}: {error}")),
    };
    Failure::Failed(format!("{scan} against {nominal}: {error}; {hint}"))
}
