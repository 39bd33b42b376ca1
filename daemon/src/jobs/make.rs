//! What an attempt at a job makes: from the kept columns to a folder of deliverables.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use deliverables::{
    CadOptions, DeliverError, Entities, Inputs, LengthUnit, MeasuredPoints, PageFormats, Pictures,
    ScanReport, Schema, Stopwatch,
};
use pipeline::{Observer, PipelineError, Stage, View};
use range_image::{Cancelled, Lattice, Monitor, RangeImage};
use regrid::RegridSettings;
use relief_api::{Job, Scan};
use scan_record::{Ending, Header, JournalReader, ReadError};
use storage::Disk;

use super::kept_columns::{Held, KeptColumns};
use super::kept_processing;
use super::progress::Progress;
use crate::acquisition::grid_file;
use crate::calibration::InForce;
use crate::config::{PageChoice, Processing, StepChoice, StepUnits};
use crate::fit::Fit;
use crate::spool::SpoolError;

/// Why an attempt led to nothing.
pub(crate) enum Halt {
    /// It was asked to stop.
    Asked,
    /// It cannot be done, or not now.
    Failed {
        /// Why not.
        error: String,
        /// What to do about it.
        hint: Option<String>,
    },
}

impl Halt {
    pub(crate) fn failed(error: impl std::fmt::Display, hint: Option<&str>) -> Self {
        Self::Failed {
            error: error.to_string(),
            hint: hint.map(str::to_owned),
        }
    }
}

impl From<Cancelled> for Halt {
    fn from(_: Cancelled) -> Self {
        Self::Asked
    }
}

impl From<PipelineError> for Halt {
    fn from(error: PipelineError) -> Self {
        match error {
            PipelineError::Cancelled => Self::Asked,
            other => Self::failed(&other, other.hint()),
        }
    }
}

impl From<DeliverError> for Halt {
    fn from(error: DeliverError) -> Self {
        match error {
            DeliverError::Cancelled(_) => Self::Asked,
            other => Self::failed(
                other,
                Some("see that the spool can be written and has room, then retry the job"),
            ),
        }
    }
}

impl From<SpoolError> for Halt {
    fn from(error: SpoolError) -> Self {
        let hint = error.hint();
        Self::failed(error, Some(&hint))
    }
}

impl From<ReadError> for Halt {
    fn from(error: ReadError) -> Self {
        Self::failed(error, None)
    }
}

/// What an attempt works on. It may be on another machine than the scanner.
pub(crate) struct Workpiece<'a> {
    /// Where files are written.
    pub(crate) disk: &'a dyn Disk,
    pub(crate) job: &'a Job,
    pub(crate) scan: &'a Scan,
    /// The scan's columns.
    pub(crate) journal: &'a Path,
    /// The range image that was made while the scanner moved, and with which settings.
    pub(crate) grid: Option<(&'a Path, &'a RegridSettings)>,
    pub(crate) threads: usize,
    pub(crate) pictures: Pictures,
    /// The empty folder in which the result is made.
    pub(crate) incoming: &'a Path,
}

impl Workpiece<'_> {
    /// Makes the job's result; gives what is not in it that was asked for, and why.
    pub(crate) fn make(&self, progress: &Progress<'_>) -> Result<Vec<String>, Halt> {
        let (job, scan) = (self.job, self.scan);
        let mut journal = JournalReader::open(self.journal)?;
        let header = journal.header().clone();
        let processing = kept_processing(&header.settings)
            .and_then(|kept| {
                kept.with_overrides(&job.settings)
                    .map_err(|e| e.to_string())
            })
            .map_err(|error| Halt::failed(error, None))?;
        let mut settings =
            processing.pipeline_settings(header.column_pitch_mm, header.sample_spacing_mm);
        settings.regrid.threads = self.threads;

        let watch = Stopwatch::new(progress);
        let (image, mut kept, held) = match self.streamed(&settings.regrid) {
            Some(image) => {
                let (kept, held) = count(&mut journal, &header, progress)?;
                (image, kept, held)
            }
            None => {
                watch.stage(Stage::Regrid);
                let mut fit = Fit::of_journal(&settings.regrid, self.journal);
                regrid(
                    &mut journal,
                    &header,
                    &settings.regrid,
                    &mut fit,
                    scan,
                    &watch,
                )?
            }
        };
        let columns = KeptColumns {
            path: self.journal,
            held: held.columns,
            camera_mm: header.calibration.camera_mm(),
        };
        let view = &kept.view;
        let outcome = pipeline::process_in_view(&image, Some(&columns), view, &settings, &watch)
            .map_err(|error| self.explained(error, kept.samples))?;
        kept.warnings.extend(pipeline::unusual_size(&image));
        let timestamp = scan
            .started_at
            .parse()
            .map_err(|error| Halt::failed(format!("the scan's time is damaged: {error}"), None))?;
        let overdue = |own: InForce| own.overdue(timestamp);
        kept.warnings
            .extend(InForce::kept_with(&header).and_then(overdue));
        let cad = cad_options(&processing, scan)?;
        let inputs = Inputs {
            name: &job.name,
            timestamp,
            image: &image,
            outcome: &outcome,
            settings: &settings,
            cad: &cad,
            points: Some(MeasuredPoints(&columns)),
            page: page_formats(&processing),
            scan: scan_report(scan, &header, &kept),
            warnings: kept.warnings,
            versions: versions(&header),
        };
        let delivered =
            deliverables::write(self.disk, self.incoming, &inputs, self.pictures, &watch)?;
        Ok(delivered.left_out)
    }

    /// The error in terms of what was measured, where that alone explains it.
    fn explained(&self, error: PipelineError, samples: u64) -> Halt {
        let unexplained = matches!(
            error,
            PipelineError::NothingMeasured | PipelineError::NoSurface { .. }
        );
        if unexplained && samples <= MOST_EXPLAINED_SAMPLES {
            let why = || -> Result<Option<String>, ReadError> {
                let mut journal = JournalReader::open(self.journal)?;
                let header = journal.header().clone();
                let mut columns = Vec::new();
                while let Some(raw) = journal.next_column()? {
                    columns.push(raw.calibrated(&header.calibration));
                }
                Ok(pipeline::no_surface(&columns, header.column_pitch_mm))
            };
            if let Ok(Some(why)) = why() {
                return Halt::failed(
                    format!("scan {}: {why}", self.job.scan),
                    PipelineError::NothingMeasured.hint(),
                );
            }
        }
        error.into()
    }

    /// The range image that was made while the scanner moved, if it is the one wanted. It is
    /// the same, bit for bit, as regridding would give.
    fn streamed(&self, settings: &RegridSettings) -> Option<RangeImage> {
        let (path, made) = self.grid?;
        // The number of threads leaves no trace in the result.
        let same = RegridSettings {
            threads: settings.threads,
            ..*made
        } == *settings;
        if !same {
            return None;
        }
        let lattice = Lattice {
            pitch_mm: settings.pitch_mm,
        };
        grid_file::read(path, lattice)
            .inspect_err(|error| tracing::warn!(scan = %self.job.scan, %error, "regridding anew"))
            .ok()
    }
}

/// Larger scans than this are not read again to find out why there is no surface.
const MOST_EXPLAINED_SAMPLES: u64 = 1 << 22;

/// What the journal held.
#[derive(Default, Clone)]
struct Kept {
    columns: u64,
    samples: u64,
    dropouts: u64,
    /// Where the table was, columns without samples included.
    view: View,
    warnings: Vec<String>,
}

impl Kept {
    fn add(&mut self, column: &scan_record::RawColumn, header: &Header) {
        let x = header.calibration.x_mm(column.table_counts);
        let (low, high) = self.view.x_mm.unwrap_or((x, x));
        self.view.x_mm = Some((low.min(x), high.max(x)));
        self.columns += 1;
        self.samples += column.samples.len() as u64;
        self.dropouts += u64::from(column.dropouts);
    }

    fn end(&mut self, ending: Option<&Ending>) {
        match ending {
            Some(Ending::Closed(scan_record::EndCause::Complete)) | None => {}
            Some(other) => self.warnings.push(format!("the scan is {other}")),
        }
    }
}

type Journal = JournalReader<std::io::BufReader<std::fs::File>>;

/// Counts what the journal holds, and whether it is whole.
fn count(
    journal: &mut Journal,
    header: &Header,
    progress: &Progress<'_>,
) -> Result<(Kept, Held), Halt> {
    let (mut kept, mut held) = (Kept::default(), Held::none_yet());
    while let Some(column) = journal.next_column()? {
        kept.add(&column, header);
        if held.columns.is_some() {
            held.add(column.calibrated(&header.calibration));
        }
        progress.check()?;
    }
    kept.end(journal.ending());
    Ok((kept, held))
}

/// Ends the regridding when the journal cannot be read on.
struct Reading<'a> {
    watch: &'a Stopwatch<'a>,
    broken: AtomicBool,
}

impl Monitor for Reading<'_> {
    fn is_cancelled(&self) -> bool {
        self.broken.load(Ordering::Relaxed) || self.watch.is_cancelled()
    }

    fn progress(&self, fraction: f64) {
        self.watch.progress(fraction);
    }
}

/// The range image of the journal's columns.
fn regrid(
    journal: &mut Journal,
    header: &Header,
    settings: &RegridSettings,
    fit: &mut Fit,
    scan: &Scan,
    watch: &Stopwatch<'_>,
) -> Result<(RangeImage, Kept, Held), Halt> {
    let (mut kept, mut held) = (Kept::default(), Held::none_yet());
    let reading = Reading {
        watch,
        broken: AtomicBool::new(false),
    };
    let mut failure = None;
    // Column by column, so that no second copy of a large scan is ever in memory.
    let columns = std::iter::from_fn(|| match journal.next_column() {
        _ if watch.is_cancelled() => None,
        Ok(column) => column.and_then(|raw| {
            kept.add(&raw, header);
            let column = raw.calibrated(&header.calibration);
            fit.add(&column);
            if fit.is_missed() {
                reading.broken.store(true, Ordering::Relaxed);
                return None;
            }
            if held.columns.is_some() {
                held.add(column.clone());
            }
            Some(column)
        }),
        Err(error) => {
            reading.broken.store(true, Ordering::Relaxed);
            failure = Some(error);
            None
        }
    });
    let image = regrid::regrid(columns.fuse(), settings, &reading);
    if let Some(error) = failure {
        return Err(error.into());
    }
    if fit.is_missed() {
        return Err(missed(journal, header, fit, scan, watch));
    }
    let image = image.map_err(|error| {
        if watch.is_cancelled() {
            Halt::Asked
        } else {
            Halt::from(PipelineError::Regrid(error))
        }
    })?;
    kept.end(journal.ending());
    tracing::debug!(scan = %scan.id, columns = kept.columns, "regridded");
    Ok((image, kept, held))
}

/// The grid is too fine: how far the samples spread, those included that were not reached.
fn missed(
    journal: &mut Journal,
    header: &Header,
    fit: &mut Fit,
    scan: &Scan,
    watch: &Stopwatch<'_>,
) -> Halt {
    loop {
        match journal.next_column() {
            _ if watch.is_cancelled() => return Halt::Asked,
            Ok(Some(raw)) => fit.add(&raw.calibrated(&header.calibration)),
            Ok(None) => break,
            Err(error) => return error.into(),
        }
    }
    let (error, hint) = fit.told().unwrap_or_default();
    Halt::failed(format!("scan {}: {error}", scan.id), Some(&hint))
}

fn cad_options(processing: &Processing, scan: &Scan) -> Result<CadOptions, Halt> {
    let wanted = &processing.deliverables;
    let further = wanted.further();
    let further =
        further.map_err(|(section, why)| Halt::failed(format!("{section}: {why}"), None))?;
    Ok(CadOptions {
        entities: match wanted.entities {
            Some(128) => Entities::Rational128,
            Some(186) => Entities::Boundary,
            Some(190) => Entities::Analytic,
            Some(_) => Entities::Parametric114,
            None => Entities::default(),
        },
        step: match wanted.step.unwrap_or_default() {
            StepChoice::Ap242 => Some(Schema::Ap242),
            StepChoice::Ap214 => Some(Schema::Ap214),
            StepChoice::Off => None,
        },
        step_units: match wanted.step_units.unwrap_or_default() {
            StepUnits::Mm => LengthUnit::Millimetre,
            StepUnits::Inch => LengthUnit::Inch,
        },
        meshes: wanted.mesh_options(),
        further,
        author: if wanted.author.is_empty() {
            scan.operator.clone()
        } else {
            wanted.author.clone()
        },
        organisation: wanted.organisation.clone(),
    })
}

fn page_formats(processing: &Processing) -> PageFormats {
    match &processing.deliverables.page {
        None => PageFormats::BOTH,
        Some(wanted) => PageFormats {
            html: wanted.contains(&PageChoice::Html),
            pdf: wanted.contains(&PageChoice::Pdf),
        },
    }
}

/// What the journal's header says about the scanner, as far as it can be read.
fn identity(header: &Header) -> BTreeMap<String, String> {
    serde_json::from_slice(&header.identity).unwrap_or_default()
}

fn scan_report(scan: &Scan, header: &Header, kept: &Kept) -> ScanReport {
    let text = |text: &String| Some(text.clone()).filter(|text| !text.is_empty());
    let identity = identity(header);
    let field = |name: &str| identity.get(name).map_or("?", String::as_str);
    ScanReport {
        id: Some(scan.id.clone()),
        scanner: text(&scan.scanner),
        source: format!("{}, serial number {}", field("model"), field("serial")),
        operator: text(&scan.operator),
        part: text(&scan.part),
        note: text(&scan.note),
        columns: kept.columns,
        samples: kept.samples,
        dropouts: Some(kept.dropouts),
        calibration: InForce::kept_with(header).map(|own| own.report(scan.started_at.parse().ok())),
    }
}

fn versions(header: &Header) -> BTreeMap<String, String> {
    identity(header)
        .remove("firmware")
        .map(|firmware| ("scanner firmware".to_owned(), firmware))
        .into_iter()
        .collect()
}
