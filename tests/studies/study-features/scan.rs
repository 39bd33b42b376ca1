//! The simulated scanner before a part: a `.scan` file as the service keeps it, and beside it, for
//! the judge alone, how much of each face was seen.

use std::fs;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, Result};
use range_image::{Calibration, calibration::Head};
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample};
use serde::Serialize;
use sim_scanner::noise::Kind;
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scanner::{HeadKind, Scanner, Sweep};

use crate::part::{self, Conditions};

/// The head tells ranges this finely: what is studied is noise, not rounding.
const RANGE_COUNT_MM: f64 = 0.001;
/// Free space that the preset leaves around what is to be seen, on either side.
const MARGIN_MM: f64 = 3.0;

/// What only the simulator knows of a scan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Seen {
    /// Samples in the file.
    pub(crate) samples: u64,
    /// Those that the part sent back, outliers included, and those of the table.
    pub(crate) on_part: u64,
    pub(crate) on_table: u64,
    /// Of each face the readings with noise alone.
    pub(crate) faces: Vec<u64>,
}

/// Scans a part of a folder into `NAME.scan` and `NAME.seen.json`.
pub(crate) fn scan(folder: &Path, name: &str) -> Result<Seen> {
    let (scene, faces, conditions) = part::read(folder, name)?;
    let [low, high] = conditions.view_mm;
    let rows = (high[1] - low[1] + 2.0 * MARGIN_MM) / conditions.pitch_mm;
    let overrides = Overrides {
        samples: Some(libm::ceil(rows) as u32 + 1),
        pitch_mm: Some(conditions.pitch_mm),
        range_count_mm: Some(RANGE_COUNT_MM),
        noise_mm: Some(conditions.noise_mm),
        outliers: Some(conditions.outliers),
        mixed: Some(conditions.mixed),
        dropouts: Some(conditions.dropouts),
        glare: Some(conditions.glare),
        glare_width_deg: Some(conditions.glare_width_deg),
        standoff_mm: conditions.standoff_mm,
        ..Overrides::default()
    };
    let (mut scanner, sweep) = Preset::Paper.set_up(scene, &overrides, conditions.seed)?;
    scanner.optics.spot_radius_mm = conditions.spot_radius_mm;
    if let Some(baseline_mm) = conditions.baseline_mm {
        scanner.optics.baseline_mm = (0.0, baseline_mm);
    }
    let mut seen = Seen {
        samples: 0,
        on_part: 0,
        on_table: 0,
        faces: vec![0; faces],
    };
    let mut journal = JournalWriter::new(Vec::new(), &header(&scanner, &sweep)?)?;
    let mut kept = 0;
    for index in 0..sweep.columns {
        let (column, truths) = scanner.column_with_truth(&sweep, 0, index);
        if !is_within(&conditions, 0, scanner.x_mm(column.table_counts)) {
            continue;
        }
        let mut raw = RawColumn {
            index: kept,
            table_counts: column.table_counts,
            ..RawColumn::default()
        };
        for (sample, truth) in column.samples.iter().zip(&truths) {
            let place = truth.point_mm;
            if place.is_some_and(|place| !is_within(&conditions, 1, place.y)) {
                continue;
            }
            if sample.no_return {
                raw.dropouts += 1;
                continue;
            }
            raw.samples.push(RawSample {
                lateral_counts: sample.lateral_counts,
                range_counts: sample.range_counts,
                intensity: sample.intensity,
                saturated: sample.saturated,
            });
            seen.samples += 1;
            match truth.face {
                Some(face) if face.body == 0 => {
                    seen.on_part += 1;
                    if truth.kind == Some(Kind::Clean)
                        && let Some(count) = seen.faces.get_mut(face.face)
                    {
                        *count += 1;
                    }
                }
                Some(_) => seen.on_table += 1,
                None => {}
            }
        }
        journal.append(&raw)?;
        kept += 1;
    }
    let bytes = journal.finish(&EndCause::Complete)?;
    write(&folder.join(format!("{name}.scan")), &bytes)?;
    let told = serde_json::to_vec(&seen)?;
    write(&folder.join(format!("{name}.seen.json")), &told)?;
    Ok(seen)
}

/// Whether a coordinate, 0 for x and 1 for y, lies in the window of the scan, if there is one.
fn is_within(conditions: &Conditions, axis: usize, at_mm: f64) -> bool {
    conditions.window_mm.is_none_or(|[low, high]| {
        let (low, high) = (low.get(axis), high.get(axis));
        low.is_none_or(|low| at_mm >= *low) && high.is_none_or(|high| at_mm <= *high)
    })
}

fn header(scanner: &Scanner, sweep: &Sweep) -> Result<Header> {
    let HeadKind::Polar {
        angle_count_nrad,
        range_count_nm,
    } = scanner.head.kind
    else {
        anyhow::bail!("the preset's head is polar");
    };
    let angle_count_rad = f64::from(angle_count_nrad) * 1e-9;
    let origin_mm = scanner.x_mm(0);
    let (low, high) = scanner.scene.object_extent_mm();
    let standoff_mm = scanner.optics.camera_z_mm - (low.z + high.z) / 2.0;
    Ok(Header {
        calibration: Calibration {
            table_origin_mm: origin_mm,
            table_count_mm: scanner.mechanics.count_mm(),
            head: Head::Polar {
                camera_y_mm: scanner.optics.camera_y_mm,
                camera_z_mm: scanner.optics.camera_z_mm,
                angle_count_rad,
                range_count_mm: f64::from(range_count_nm) * 1e-6,
            },
            correction: None,
        },
        column_pitch_mm: f64::from(sweep.pitch_counts) * scanner.mechanics.count_mm(),
        sample_spacing_mm: f64::from(sweep.lateral_step_counts) * angle_count_rad * standoff_mm,
        identity: Vec::new(),
        plan: Vec::new(),
        settings: Vec::new(),
        metadata: Vec::new(),
        correction: Vec::new(),
    })
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// Scans those parts of a folder that have no scan yet, on all processors.
pub(crate) fn all(folder: &Path, names: &[String]) -> Result<()> {
    let open = Mutex::new(names.iter());
    let next = || open.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = || -> Result<()> {
        while let Some(name) = next() {
            // Written last: where it is, the scan is whole.
            if folder.join(format!("{name}.seen.json")).exists() {
                continue;
            }
            let seen = scan(folder, name).with_context(|| format!("part {name}"))?;
            eprintln!(
                "{name}: {} samples, {} of the part, {} of the table",
                seen.samples, seen.on_part, seen.on_table
            );
        }
        Ok(())
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker
                .join()
                .map_err(|_| anyhow::anyhow!("a scan was lost to a panic"))?
        })
    })
}
