//! Damaged scan files for every reader: none may panic, hang, or take memory without bound.
//!
//! A file is known by its number; [`run`] reads it with every reader, whatever its format.

mod dice;
mod mutate;
mod seeds;
mod small;
mod worst;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use range_image::{Column, Sample, Unmonitored};
use scan_files::{PointScan, ReadOptions, Unpacked, read_from};
use scan_record::JournalReader;

pub use dice::Dice;
pub use mutate::{Mutant, mutant};
pub use seeds::{Seed, seeds};
pub use small::{MOST_SMALL_BYTES, Small, small};
pub use worst::{Worst, worst};

/// Longest time that all readers together may take for one file. They need milliseconds;
/// the rest is for machines with other work.
pub const MOST_TIME: Duration = Duration::from_secs(60);
/// Most memory that they may take.
pub const MOST_BYTES: usize = 1 << 30;
/// A grid for what has been read has so many nodes at most.
const MOST_NODES: f64 = 40_000.0;
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// What is wanted.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// The first file.
    pub first: u64,
    /// How many files.
    pub files: u64,
    /// Every so many files, what could be read also goes on to a model; 0 for none.
    pub through_every: u64,
}

/// Measures memory.
pub trait Meter: Sync {
    /// Bytes in use now; what was the most is forgotten.
    fn begin(&self) -> usize;
    /// Most bytes in use since.
    fn peak(&self) -> usize;
}

/// What a run measured.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// For each format of the sound file: damaged files, and those that some reader took.
    pub formats: BTreeMap<&'static str, (u64, u64)>,
    /// Files whose points went on to a model, and models made.
    pub through: (u64, u64),
    /// Numbers of the files at which a reader panicked, and what it said.
    pub panics: Vec<(u64, String)>,
    /// Longest time for one file, and which.
    pub longest: (Duration, u64),
    /// Most memory for one file, bytes, and which.
    pub most_bytes: (usize, u64),
}

/// Reads the files with all readers.
///
/// # Errors
/// When a reader hangs: nothing can end it but the end of the process.
pub fn run(wanted: &Wanted, meter: &dyn Meter, shown: impl Fn(u64)) -> Result<Figures> {
    let seeds = seeds()?;
    let mut figures = Figures::default();
    let (orders, received) = channel::<(Vec<u8>, bool)>();
    let (replies, answers) = channel();
    let worker = std::thread::Builder::new().name("readers".into());
    let worker = worker.spawn(move || {
        for (bytes, through) in received {
            let read = catch_unwind(AssertUnwindSafe(|| read_all(&bytes, through)));
            if replies.send(read.map_err(|panic| text(&*panic))).is_err() {
                return;
            }
        }
    })?;
    for number in wanted.first..wanted.first + wanted.files {
        let mutant = mutant(&seeds, number)?;
        let through = wanted.through_every > 0 && number % wanted.through_every == 0;
        let before = meter.begin();
        let begun = Instant::now();
        orders
            .send((mutant.bytes, through))
            .context("the readers' thread is gone")?;
        let answer = match answers.recv_timeout(MOST_TIME) {
            Ok(answer) => answer,
            Err(RecvTimeoutError::Timeout) => {
                bail!("file {number} ({}): a reader hangs", mutant.format)
            }
            Err(RecvTimeoutError::Disconnected) => bail!("file {number}: the readers are gone"),
        };
        figures.longest = figures.longest.max((begun.elapsed(), number));
        let bytes = meter.peak().saturating_sub(before);
        figures.most_bytes = figures.most_bytes.max((bytes, number));
        let (files, taken) = figures.formats.entry(mutant.format).or_default();
        *files += 1;
        match answer {
            Ok(read) => {
                *taken += u64::from(read.taken);
                figures.through.0 += u64::from(read.went_on);
                figures.through.1 += u64::from(read.model);
            }
            Err(said) => figures.panics.push((number, said)),
        }
        shown(number);
    }
    drop(orders);
    worker
        .join()
        .map_err(|panic| anyhow::anyhow!(text(&*panic)))?;
    Ok(figures)
}

/// What came of a file.
#[derive(Debug, Clone, Copy, Default)]
struct Read {
    /// Some reader took it.
    taken: bool,
    /// Its points went on.
    went_on: bool,
    /// They became a model.
    model: bool,
}

fn read_all(bytes: &[u8], through: bool) -> Read {
    let options = ReadOptions::default();
    let scan = read_from(bytes, "mutant", &options);
    let unpacked = || Unpacked::new(bytes, "mutant");
    let points = unpacked()
        .ok()
        .and_then(|source| cad_exchange::iges::read_points(source).ok())
        .and_then(|points| scan_files::from_points_mm(points, "mutant", &options).ok());
    let model = unpacked()
        .ok()
        .and_then(|source| cad_exchange::iges::read_model(source).ok());
    let journal = unpacked().ok().and_then(|source| journal(source).ok());
    let cloud = scan.ok().or(points);
    let mut read = Read {
        taken: cloud.is_some() || model.is_some() || journal.is_some(),
        ..Read::default()
    };
    if !through {
        return read;
    }
    let columns = cloud.map(columns).or(journal);
    if let Some((columns, pitch_mm)) = columns {
        read.went_on = true;
        read.model = is_model(&columns, pitch_mm);
    }
    read
}

fn columns(scan: PointScan) -> (Vec<Column>, f64) {
    let pitch_mm = scan.recommended_pitch_mm();
    let columns = scan.columns.into_iter().map(|column| {
        let samples = column.samples.into_iter().map(|sample| Sample {
            y_mm: sample.y_mm,
            z_mm: sample.z_mm,
            intensity: sample.intensity,
        });
        Column::new(column.x_mm, samples.collect())
    });
    (columns.collect(), pitch_mm)
}

/// As far as the records are sound, as the service reads it.
fn journal(source: impl std::io::Read) -> Result<(Vec<Column>, f64)> {
    let mut journal = JournalReader::new(source)?;
    let header = journal.header().clone();
    let mut columns = Vec::new();
    while let Some(raw) = journal.next_column()? {
        columns.push(raw.calibrated(&header.calibration));
    }
    let pitch_mm =
        scan_files::recommended_pitch_mm(header.column_pitch_mm, header.sample_spacing_mm);
    Ok((columns, pitch_mm))
}

/// The rest of the road, on a grid that is coarse enough for it to be short.
fn is_model(columns: &[Column], pitch_mm: f64) -> bool {
    let area_mm2 = pipeline::Extent::of(columns).map_or(0.0, |extent| {
        let [width, height] = extent.sides_mm();
        width * height
    });
    let pitch_mm = pitch_mm.max((area_mm2 / MOST_NODES).sqrt());
    // Asked as `relief convert` does, which must not panic either.
    if pipeline::no_surface(columns, pitch_mm).is_some() {
        return false;
    }
    let settings = pipeline::Settings::new(pitch_mm);
    pipeline::process_columns(columns, &settings, &Unmonitored).is_ok()
}

/// What a panic said.
fn text(panic: &(dyn std::any::Any + Send)) -> String {
    let words = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let owned = || panic.downcast_ref::<String>().cloned();
    words.or_else(owned).unwrap_or_else(|| "no words".into())
}
