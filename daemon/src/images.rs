//! Range images for showing: of scans under way as far as they have come, and of kept scans with
//! other settings.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, MutexGuard, TryLockError};
use std::time::{Duration, Instant};

use range_image::{Monitor, RangeImage};
use relief_api::{LiveColumn, Regrid, RegridImage, ScanImage, SettingOverrides};
use scan_record::JournalReader;

use crate::acquisition::grid_file;
use crate::error::ServiceError;
use crate::fit::Fit;
use crate::jobs::kept_processing;
use crate::service::Service;

/// Larger scans are not regridded for showing: it would take minutes, which is a job's work.
const MOST_SAMPLES: u64 = 4_000_000;

/// How long a request waits for its turn.
const LONGEST_WAIT: Duration = Duration::from_secs(10);
const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// Whether somebody still waits for an image.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted(Arc<AtomicBool>);

/// Nobody does any more once this is gone.
#[derive(Debug)]
pub(crate) struct Waiting(Wanted);

impl Wanted {
    /// Somebody waits, as long as the second of these lives.
    pub(crate) fn new() -> (Self, Waiting) {
        let wanted = Self::default();
        (wanted.clone(), Waiting(wanted))
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.0.store(true, Ordering::Relaxed);
    }
}

impl Monitor for Wanted {
    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    fn progress(&self, _fraction: f64) {}
}

impl Service {
    /// The range image of a scan: as far as it has come, or of the columns that are kept.
    pub(crate) fn scan_image(
        &self,
        id: &str,
        most_nodes: usize,
        wanted: &Wanted,
    ) -> Result<ScanImage, ServiceError> {
        let scan = self.scan(id)?;
        match grid_file::read_thinned(&self.grid_path(&scan.id), most_nodes) {
            Ok((pitch_mm, step, columns)) => Ok(ScanImage {
                scan: scan.id,
                pitch_mm,
                step,
                columns,
            }),
            Err(error) if error.kind() == io::ErrorKind::NotFound && scan.state.is_over() => {
                let asked = Regrid::default();
                let made = self.regridded(&scan.id, &asked.settings, most_nodes, wanted)?;
                Ok(made.image)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Err(ServiceError::NoImage {
                id: scan.id,
                why: "it has no range image yet".into(),
            }),
            Err(source) => Err(ServiceError::Io {
                what: self.grid_path(&scan.id).display().to_string(),
                source,
            }),
        }
    }

    /// One at a time, on one processor: scans and jobs go before pictures.
    fn turn_to_regrid(&self, wanted: &Wanted) -> Result<MutexGuard<'_, ()>, ServiceError> {
        let begun = Instant::now();
        loop {
            match self.regridding.try_lock() {
                Ok(turn) => return Ok(turn),
                // Nothing is left half done by a defect: it holds nothing but the turn.
                Err(TryLockError::Poisoned(turn)) => return Ok(turn.into_inner()),
                Err(TryLockError::WouldBlock) if wanted.is_cancelled() => {
                    return Err(ServiceError::Unwanted);
                }
                Err(TryLockError::WouldBlock) if begun.elapsed() > LONGEST_WAIT => {
                    return Err(ServiceError::Regridding);
                }
                Err(TryLockError::WouldBlock) => std::thread::sleep(LOOK_AGAIN),
            }
        }
    }

    /// What the range image of a kept scan would be with other settings.
    pub(crate) fn regridded(
        &self,
        id: &str,
        settings: &SettingOverrides,
        most_nodes: usize,
        wanted: &Wanted,
    ) -> Result<RegridImage, ServiceError> {
        let begun = Instant::now();
        let scan = self.scan(id)?;
        let nothing = |why: String| ServiceError::NothingKept {
            id: scan.id.clone(),
            why,
        };
        if !scan.state.is_over() {
            return Err(ServiceError::ScanNotOver { id: scan.id });
        }
        let _turn = self.turn_to_regrid(wanted)?;
        let path = self.journal_path(&scan.id);
        let mut journal = JournalReader::open(&path).map_err(|e| nothing(e.to_string()))?;
        let header = journal.header().clone();
        let processing = kept_processing(&header.settings)
            .map_err(&nothing)?
            .with_overrides(settings)?;
        let mut settings = processing
            .pipeline_settings(header.column_pitch_mm, header.sample_spacing_mm)
            .regrid;
        settings.threads = 1;
        let mut fit = Fit::of_journal(&settings, &path);
        let mut columns = Vec::new();
        let mut samples = 0;
        while let Some(raw) = journal.next_column().map_err(|e| nothing(e.to_string()))? {
            samples += raw.samples.len() as u64;
            if samples > MOST_SAMPLES {
                return Err(ServiceError::TooLarge {
                    id: scan.id,
                    samples,
                    most: MOST_SAMPLES,
                });
            }
            let column = raw.calibrated(&header.calibration);
            fit.add(&column);
            columns.push(column);
        }
        let refused = |why: String| ServiceError::NoImage {
            id: scan.id.clone(),
            why,
        };
        if fit.is_missed() {
            let (why, hint) = fit.told().unwrap_or_default();
            return Err(refused(format!("{why}; {hint}")));
        }
        let image = regrid::regrid(columns, &settings, wanted).map_err(|error| {
            if wanted.is_cancelled() {
                ServiceError::Unwanted
            } else {
                refused(error.to_string())
            }
        })?;
        let step = grid_file::step(image.columns() * image.rows(), most_nodes);
        Ok(RegridImage {
            image: ScanImage {
                scan: scan.id,
                pitch_mm: image.pitch_mm(),
                step: step as u32,
                columns: thinned(&image, step),
            },
            nodes: image.valid_nodes() as u64,
            noise_mm: image.noise_mm(),
            inlier_share: image.inlier_share(),
            seconds: begun.elapsed().as_secs_f64(),
        })
    }
}

/// The columns of an image, each without the nodes below the first and above the last of its
/// values.
fn thinned(image: &RangeImage, step: i64) -> Vec<LiveColumn> {
    let (i_first, j_first) = image.origin();
    let columns = (0..image.columns()).filter(|&c| (i_first + c as i64).rem_euclid(step) == 0);
    let of = |c: usize| {
        let there = |r: &usize| image.z_mm(c, *r).is_some();
        let first = (0..image.rows()).find(there)?;
        let last = (0..image.rows()).rev().find(there)?;
        let z_mm: Vec<f64> = (first..=last)
            .map(|r| image.z_mm(c, r).unwrap_or(f64::NAN))
            .collect();
        let (i, j) = (i_first + c as i64, j_first + first as i64);
        Some(grid_file::thinned(i, j, &z_mm, step))
    };
    columns.filter_map(of).collect()
}
