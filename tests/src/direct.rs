//! The other road: from a scan to a CAD file without a service, as `relief convert` takes it.

use std::fs::File;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use deliverables::CadOptions;
use jiff::Timestamp;
use pipeline::{InMemory, Settings};
use range_image::{Column, Sample, Unmonitored};
use relief_api::Scan;
use scan_files::{ReadOptions, recommended_pitch_mm};
use scan_record::JournalReader;

/// What stands in the CAD file and cannot be taken from a bare scan file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Name of the part.
    pub name: String,
    /// The time in the file.
    pub timestamp: Timestamp,
    /// The author.
    pub author: String,
}

impl Label {
    /// What the service writes into the CAD file of a scan.
    ///
    /// # Errors
    /// When the scan's time is none.
    pub fn of(scan: &Scan) -> Result<Self> {
        Ok(Self {
            name: scan.name.clone(),
            timestamp: scan.started_at.parse()?,
            author: scan.operator.clone(),
        })
    }
}

/// The CAD file of a service's journal, with the default settings.
///
/// # Errors
/// When any stage fails.
pub fn journal(path: &Path, label: &Label, threads: usize) -> Result<Vec<u8>> {
    let mut journal = JournalReader::open(path)?;
    let header = journal.header().clone();
    let mut columns = Vec::new();
    while let Some(raw) = journal.next_column()? {
        columns.push(raw.calibrated(&header.calibration));
    }
    let pitch_mm = recommended_pitch_mm(header.column_pitch_mm, header.sample_spacing_mm);
    let camera_mm = header.calibration.camera_mm();
    columns_to_iges(&columns, camera_mm, pitch_mm, label, threads)
}

/// The CAD file of a scan file of another program, with the default settings.
///
/// # Errors
/// When any stage fails.
pub fn scan_file(path: &Path, label: &Label, threads: usize) -> Result<Vec<u8>> {
    let name = path.display().to_string();
    let scan = scan_files::read_from(File::open(path)?, &name, &ReadOptions::default())?;
    let pitch_mm = recommended_pitch_mm(scan.column_pitch_mm, scan.sample_spacing_mm);
    let columns: Vec<Column> = scan
        .columns
        .into_iter()
        .map(|column| {
            let samples = column.samples.into_iter().map(|sample| Sample {
                y_mm: sample.y_mm,
                z_mm: sample.z_mm,
                intensity: sample.intensity,
            });
            Column::new(column.x_mm, samples.collect())
        })
        .collect();
    columns_to_iges(&columns, None, pitch_mm, label, threads)
}

fn columns_to_iges(
    columns: &[Column],
    camera_mm: Option<[f64; 2]>,
    pitch_mm: f64,
    label: &Label,
    threads: usize,
) -> Result<Vec<u8>> {
    let mut settings = Settings::new(pitch_mm);
    settings.regrid.threads = threads;
    let (_, outcome) =
        pipeline::process_scan(&InMemory { columns, camera_mm }, &settings, &Unmonitored)?;
    let cad = CadOptions {
        author: label.author.clone(),
        ..CadOptions::default()
    };
    let mut iges = Vec::new();
    let model = &outcome.reconstruction.model;
    deliverables::write_iges(model, &label.name, label.timestamp, &cad, &mut iges)?;
    Ok(iges)
}

/// Names the program `relief`, for checks that it gives the same as the library.
pub const PROGRAM_VARIABLE: &str = "RELIEF_BIN";

/// The CAD file that `relief convert` makes, if [`PROGRAM_VARIABLE`] names the program.
///
/// # Errors
/// When it fails, and what it said.
pub fn program(input: &Path, label: &Label, output: &Path) -> Result<Option<Vec<u8>>> {
    let Some(program) = std::env::var_os(PROGRAM_VARIABLE) else {
        println!("{PROGRAM_VARIABLE} names no program: `relief convert` itself is not compared");
        return Ok(None);
    };
    let done = Command::new(&program)
        .arg("convert")
        .arg(input)
        .arg("--output")
        .arg(output)
        .args(["--name", &label.name])
        .args(["--author", &label.author])
        .args(["--timestamp", &label.timestamp.to_string()])
        .output()
        .with_context(|| format!("cannot start {}", program.display()))?;
    let said = String::from_utf8_lossy(&done.stderr);
    ensure!(done.status.success(), "relief convert: {said}");
    Ok(Some(std::fs::read(output)?))
}
