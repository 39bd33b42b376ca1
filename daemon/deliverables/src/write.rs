//! From an outcome to the files of a directory.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use jiff::Timestamp;
use page::Page;
use pipeline::{Observer, Outcome, Settings, Stage};
use range_image::{Cancelled, Monitor, RangeImage};
use rayon::prelude::*;
use storage::{Disk, LocalDisk, remove_file_if_there};

use reconstruct::RegionFit;

use crate::export::{CadOptions, WriteError, file_stem, write_iges, write_step};
use crate::extras::Extras;
use crate::file::write_synced;
use crate::filed::{PageFormat, PageFormats, scan_page};
use crate::further::write_further;
use crate::manifest::{MANIFEST_NAME, Manifest, ManifestFile};
use crate::meshes::{MeasuredPoints, write_meshes};
use crate::picture;
use crate::report::{Report, ScanReport};
use crate::stopwatch::Stopwatch;
use crate::view::{VIEW_NAME, ViewError, write_view};

/// Everything that is told about one processed scan.
#[derive(Debug, Clone)]
pub struct Inputs<'a> {
    /// Name of the part or scan.
    pub name: &'a str,
    /// When the scan was taken; stands in every file instead of the present time.
    pub timestamp: Timestamp,
    /// The range image.
    pub image: &'a RangeImage,
    /// What became of it.
    pub outcome: &'a Outcome,
    /// The settings that were used.
    pub settings: &'a Settings,
    /// About the CAD files.
    pub cad: &'a CadOptions,
    /// The samples, for files of them.
    pub points: Option<MeasuredPoints<'a>>,
    /// In which forms the page is left.
    pub page: PageFormats,
    /// Where the samples came from.
    pub scan: ScanReport,
    /// What the user should know about the source, before the pipeline's own warnings.
    pub warnings: Vec<String>,
    /// Versions of further programs that took part, by name (the scanner's firmware).
    pub versions: BTreeMap<String, String>,
}

/// Deliverables could not be written.
#[derive(Debug, thiserror::Error)]
pub enum DeliverError {
    /// The caller asked for an end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The CAD file could not be written.
    #[error("the CAD file cannot be written: {0}")]
    Export(#[from] WriteError),
    /// The file system refused.
    #[error("cannot write the deliverables: {0}")]
    Io(#[from] io::Error),
    /// A document could not be put into JSON.
    #[error("cannot write the report: {0}")]
    Json(#[from] serde_json::Error),
}

impl From<ViewError> for DeliverError {
    fn from(error: ViewError) -> Self {
        match error {
            ViewError::Cancelled(cancelled) => cancelled.into(),
            ViewError::Write(error) => error.into(),
        }
    }
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivered {
    /// The report, as it stands in `report.json`.
    pub report: Report,
    /// The manifest, as it stands in `manifest.json`.
    pub manifest: Manifest,
    /// Every file, the manifest last.
    pub files: Vec<ManifestFile>,
    /// What was asked for and is not there, and why; in the report's warnings, too.
    pub left_out: Vec<String>,
}

/// Names of the page are this with the ending of its form.
pub const PAGE_STEM: &str = "report";
/// Name of the report in a directory of deliverables.
pub const REPORT_NAME: &str = "report.json";
/// Name of the range image's picture.
pub const RANGE_PICTURE_NAME: &str = "range.png";
/// Name of the regions' picture.
pub const REGIONS_PICTURE_NAME: &str = "regions.png";
/// Name of the picture of the distances between nodes and trimmed faces.
pub const RESIDUALS_PICTURE_NAME: &str = "residuals.png";
/// Name of the picture of the share of inliers around each node.
pub const INLIERS_PICTURE_NAME: &str = "inliers.png";

/// Whether pictures and the view are drawn, and the model written in a second format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pictures {
    /// As long as the disk has room for them; a warning in the report if it has not.
    Drawn,
    /// The disk is nearly full: only what is not in another file is written.
    LeftOut,
}

/// What stands in the report where the STEP file is missing for want of room.
const NO_STEP: &str = "the STEP file was left out, since the disk is nearly full: make room and \
     run the scan again to have it";
/// The same of the page.
const NO_PAGE: &str = "the page was left out, since the disk is nearly full: make room and run the \
     scan again to have it";
/// The same of pictures and view.
const NO_PICTURES: &str = "the pictures and the view in three dimensions were left out, since the \
     disk is nearly full: make room and run the scan again to have them";

/// Writes `<name>.igs`, `<name>.step`, files of triangles and points, of surfaces
/// (`<name>.surface.igs`, `<name>.skin.igs`) and an NC program (`<name>.nc`) if they are asked for, the
/// pictures, `view.glb`, `report.json`, the page and `manifest.json` into an existing directory of this disk
/// that nobody else looks at, and syncs them and it. The caller then puts the directory in its
/// place by one rename.
///
/// The stopwatch that has timed the pipeline goes on with the stages here, so that the
/// report holds them all; only the time of writing report and page is missing from it.
///
/// # Errors
/// [`DeliverError`]. What was already written stays for the caller to remove.
pub fn write(
    disk: &dyn Disk,
    directory: &Path,
    inputs: &Inputs<'_>,
    pictures: Pictures,
    watch: &Stopwatch<'_>,
) -> Result<Delivered, DeliverError> {
    let model = &inputs.outcome.reconstruction.model;
    let mut files = Vec::new();

    watch.check()?;
    watch.stage(Stage::Export);
    let cad_name = format!("{}.igs", file_stem(inputs.name));
    files.push(write_synced::<DeliverError>(
        disk,
        directory,
        &cad_name,
        |sink| {
            Ok(write_iges(
                model,
                inputs.name,
                inputs.timestamp,
                inputs.cad,
                sink,
            )?)
        },
    )?);
    let step = match pictures {
        _ if inputs.cad.step.is_none() => Some(None),
        Pictures::Drawn => step_on(disk, directory, inputs)?.map(Some),
        Pictures::LeftOut => None,
    };
    let is_short_of_room = pictures == Pictures::LeftOut;
    let mut extras = Extras {
        disk,
        directory,
        is_short_of_room,
        monitor: watch,
        files: Vec::new(),
        remarks: Vec::new(),
        left_out: Vec::new(),
    };
    let mesh = write_meshes(&mut extras, inputs)?;
    watch.progress(1.0);
    let further = write_further(&mut extras, inputs, watch)?;

    watch.check()?;
    watch.stage(Stage::Pictures);
    let drawn = match pictures {
        Pictures::Drawn => pictures_on(disk, directory, inputs, watch)?,
        Pictures::LeftOut => None,
    };
    let mut report = Report::new(inputs, watch.read());
    let mut left_out = Vec::new();
    match step {
        Some(step) => files.extend(step),
        None => left_out.push(NO_STEP.to_owned()),
    }
    files.extend(extras.files);
    report.mesh = mesh;
    report.surface = further.surface;
    report.skin = further.skin;
    report.toolpath = further.toolpath;
    left_out.extend(extras.left_out);
    report.warnings.extend(extras.remarks);
    let drawings = drawn.map(|(drawings, written)| {
        files.extend(written);
        drawings
    });
    if drawings.is_none() {
        // Those that were drawn before the disk was full take the room of the report.
        for name in PICTURE_NAMES {
            remove_file_if_there(disk, &directory.join(name))?;
        }
        left_out.push(NO_PICTURES.to_owned());
    }
    report.warnings.extend(left_out.iter().cloned());
    watch.progress(1.0);

    // The page tells the report's checksum, so this is written first; once more, where there turns
    // out to be no room for the page, to say so.
    files.push(write_json(disk, directory, REPORT_NAME, &report)?);
    let page = match &drawings {
        _ if inputs.page == PageFormats::NONE => Some(Vec::new()),
        Some(drawings) => {
            let page = scan_page(&report, drawings, &files);
            let forms = with_threads(inputs, || forms_of(&page, inputs.page))??;
            page_on(disk, directory, &forms)?
        }
        None => None,
    };
    match page {
        Some(page) => files.extend(page),
        None => {
            files.pop();
            report.warnings.push(NO_PAGE.to_owned());
            left_out.push(NO_PAGE.to_owned());
            files.push(write_json(disk, directory, REPORT_NAME, &report)?);
        }
    }
    let manifest = Manifest {
        name: report.name.clone(),
        timestamp: report.timestamp.clone(),
        scanner: report.scan.scanner.clone(),
        files: files.clone(),
        versions: report.versions.clone(),
        seed: report.settings.seed,
        settings: report.settings.clone(),
    };
    files.push(write_json(disk, directory, MANIFEST_NAME, &manifest)?);
    disk.sync_dir(directory)?;
    Ok(Delivered {
        report,
        manifest,
        files,
        left_out,
    })
}

/// The STEP file; `None` where there was no room for it. What it holds is in the IGES file
/// too, so it goes before a result is given up.
fn step_on(
    disk: &dyn Disk,
    directory: &Path,
    inputs: &Inputs<'_>,
) -> Result<Option<ManifestFile>, DeliverError> {
    let name = format!("{}.step", file_stem(inputs.name));
    let model = &inputs.outcome.reconstruction.model;
    let written = write_synced::<DeliverError>(disk, directory, &name, |sink| {
        Ok(write_step(
            model,
            inputs.name,
            inputs.timestamp,
            inputs.cad,
            sink,
        )?)
    });
    match written {
        Err(error) if error.is_for_want_of_room() => {}
        other => return other.map(Some),
    }
    remove_file_if_there(disk, &directory.join(name))?;
    Ok(None)
}

pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded
    )
}

const PICTURE_NAMES: [&str; 5] = [
    RANGE_PICTURE_NAME,
    REGIONS_PICTURE_NAME,
    RESIDUALS_PICTURE_NAME,
    INLIERS_PICTURE_NAME,
    VIEW_NAME,
];

/// `None` for what there was no room for.
fn unless_full<T>(written: io::Result<T>) -> io::Result<Option<T>> {
    match written {
        Err(error) if is_full(&error) => Ok(None),
        other => other.map(Some),
    }
}

/// The page in all forms that are wanted, with the names of their files.
fn forms_of(page: &Page, formats: PageFormats) -> io::Result<Vec<(String, Vec<u8>)>> {
    let wanted: Vec<PageFormat> = formats.wanted().collect();
    let form = |format: PageFormat| {
        let name = format!("{PAGE_STEM}.{}", format.as_str());
        Ok((name, format.bytes(page)?))
    };
    wanted.into_par_iter().map(form).collect()
}

/// The page; `None` where there was no room for it. What it tells is in other files.
fn page_on(
    disk: &dyn Disk,
    directory: &Path,
    forms: &[(String, Vec<u8>)],
) -> io::Result<Option<Vec<ManifestFile>>> {
    let written = forms
        .iter()
        .map(|(name, bytes)| write_synced(disk, directory, name, |sink| sink.write_all(bytes)));
    let written = unless_full(written.collect::<io::Result<Vec<_>>>())?;
    if written.is_none() {
        for (name, _) in forms {
            remove_file_if_there(disk, &directory.join(name))?;
        }
    }
    Ok(written)
}

/// Regions up to this number stand in the legend by their labels, more by their sizes,
/// since not all of them will find room.
const LISTED_BY_LABEL: usize = 12;

/// Pictures with the names of their files, as PNG.
pub type Drawings = Vec<(&'static str, Vec<u8>)>;

/// Draws range image, regions, deviations, and the share of inliers where that is known.
///
/// # Errors
/// A picture that is too large for its format.
pub fn draw_pictures(inputs: &Inputs<'_>) -> io::Result<Drawings> {
    let (image, outcome, name) = (inputs.image, inputs.outcome, inputs.name);
    let mut largest: Vec<&RegionFit> = outcome.reconstruction.regions.iter().collect();
    if largest.len() > LISTED_BY_LABEL {
        largest.sort_by_key(|fit| (std::cmp::Reverse(fit.nodes), fit.label));
    }
    let notes: Vec<picture::RegionNote> = largest
        .into_iter()
        .map(|fit| picture::RegionNote {
            label: fit.label,
            text: format!(
                "{:>6} nodes {:>7.0} mm\u{b2}, rms {:.3} mm",
                fit.nodes, fit.area_mm2, fit.rms_mm
            ),
        })
        .collect();
    type Draw<'a> = &'a (dyn Fn(&mut Vec<u8>) -> io::Result<bool> + Sync);
    // Whether there is anything to draw.
    let draws: [(&str, Draw<'_>); 4] = [
        (RANGE_PICTURE_NAME, &|sink| {
            picture::write_range(image, name, sink).map(|()| true)
        }),
        (REGIONS_PICTURE_NAME, &|sink| {
            picture::write_regions(image, outcome, &notes, name, sink).map(|()| true)
        }),
        (RESIDUALS_PICTURE_NAME, &|sink| {
            picture::write_residuals(image, outcome, name, sink).map(|()| true)
        }),
        (INLIERS_PICTURE_NAME, &|sink| {
            let inliers = picture::inliers(image, name);
            let written = inliers.map(|inliers| inliers.write(sink));
            Ok(written.transpose()?.is_some())
        }),
    ];
    let drawn = draws.into_par_iter().filter_map(|(file, draw)| {
        let mut png = Vec::new();
        match draw(&mut png) {
            Ok(is_drawn) => is_drawn.then_some(Ok((file, png))),
            Err(error) => Some(Err(error)),
        }
    });
    drawn.collect()
}

/// Writes pictures into a directory.
///
/// # Errors
/// What the file system reports.
pub fn write_pictures(directory: &Path, drawings: &Drawings) -> io::Result<Vec<ManifestFile>> {
    keep_pictures(&LocalDisk, directory, drawings)
}

fn keep_pictures(
    disk: &dyn Disk,
    directory: &Path,
    drawings: &Drawings,
) -> io::Result<Vec<ManifestFile>> {
    let written = drawings
        .iter()
        .map(|(name, png)| write_synced(disk, directory, name, |sink| sink.write_all(png)));
    written.collect()
}

/// Pictures, and the view; `None` where there was no room for them.
fn pictures_on(
    disk: &dyn Disk,
    directory: &Path,
    inputs: &Inputs<'_>,
    monitor: &dyn Monitor,
) -> Result<Option<(Drawings, Vec<ManifestFile>)>, DeliverError> {
    let view = || {
        let mut view: Vec<u8> = Vec::new();
        write_view(inputs, monitor, &mut view).map(|()| view)
    };
    let draw = || rayon::join(|| draw_pictures(inputs), view);
    let (drawings, view) = with_threads(inputs, draw)?;
    let (drawings, view) = (drawings?, view?);
    let Some(mut written) = unless_full(keep_pictures(disk, directory, &drawings))? else {
        return Ok(None);
    };
    let view = write_synced(disk, directory, VIEW_NAME, |sink| sink.write_all(&view));
    let Some(view) = unless_full(view)? else {
        return Ok(None);
    };
    written.push(view);
    Ok(Some((drawings, written)))
}

/// Lets work share the threads that the scan is processed by.
fn with_threads<T: Send>(inputs: &Inputs<'_>, work: impl FnOnce() -> T + Send) -> io::Result<T> {
    regrid::with_threads(inputs.settings.regrid.threads, work).map_err(io::Error::other)
}

fn write_json(
    disk: &dyn Disk,
    directory: &Path,
    name: &str,
    document: &impl serde::Serialize,
) -> Result<ManifestFile, DeliverError> {
    write_synced(disk, directory, name, |sink| {
        serde_json::to_writer_pretty(&mut *sink, document)?;
        sink.write_all(b"\n")?;
        Ok(())
    })
}
