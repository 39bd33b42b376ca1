//! Scan files of every kind the program knows, as columns.

mod format;

use std::fs::File;
use std::io::BufRead;
use std::path::Path;

use deliverables::ScanReport;
use jiff::Timestamp;
use pipeline::Settings;
use range_image::{Column, Sample};
use reliefd::calibration::InForce;
use reliefd::config::Processing;
use scan_files::{PointScan, ReadOptions, ScanFileError, Units, Unpacked, recommended_pitch_mm};
use scan_record::{Ending, JournalReader};

use crate::failure::Failure;
use format::Format;

/// Said of files of other formats.
const NOT_READ: &str = "which is not read";
/// Most samples of a journal that are held in memory: twice as many as of a cloud, since
/// they come in columns and need no sorting.
const MOST_SAMPLES: u64 = 1 << 25;

/// A scan file's content.
#[derive(Debug)]
pub(crate) struct Input {
    /// The columns in the order of the file.
    pub(crate) columns: Vec<Column>,
    /// Where in a column's plane its rays come from, y and z in millimetres, if that is known.
    pub(crate) camera_mm: Option<[f64; 2]>,
    /// Distance of neighbouring columns, millimetres.
    pub(crate) column_pitch_mm: f64,
    /// Distance of neighbouring samples in a column, millimetres.
    pub(crate) sample_spacing_mm: f64,
    /// What the report says about the scan.
    pub(crate) scan: ScanReport,
    /// Processing settings kept with the scan, where there are some.
    pub(crate) processing: Option<Processing>,
    /// Name kept with the scan, where there is one.
    pub(crate) name: Option<String>,
    /// When it was taken, where the file says so.
    pub(crate) timestamp: Option<Timestamp>,
    /// What was decided or is missing, for the user.
    pub(crate) notes: Vec<String>,
    /// Why the coordinates are probably in another unit, if so; one of the notes, too.
    pub(crate) units_suspected: Option<String>,
}

impl Input {
    /// The distance of the grid's nodes that fits the density of the samples.
    pub(crate) fn pitch_mm(&self) -> f64 {
        recommended_pitch_mm(self.column_pitch_mm, self.sample_spacing_mm)
    }

    /// The settings with which the service would process this scan: those kept with it,
    /// else the defaults for its density.
    pub(crate) fn settings(&self) -> Settings {
        match &self.processing {
            Some(kept) => kept.pipeline_settings(self.column_pitch_mm, self.sample_spacing_mm),
            None => Settings::new(self.pitch_mm()),
        }
    }
}

/// Reads a scan file; the format is told by its content.
pub(crate) fn read(path: &Path, units: Option<Units>) -> Result<Input, Failure> {
    let name = path.display().to_string();
    if path.is_dir() {
        return Err(Failure::Failed(format!(
            "{name} is a directory; name a scan file in it"
        )));
    }
    let file =
        File::open(path).map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
    let mut source = Unpacked::new(file, &name).map_err(told)?;
    let format = Format::of(source.head(), path);
    let packed = source.layers() > 0;
    let mut input = match by_format(format, &mut source, &name, units) {
        Ok(input) => input,
        Err(failure) => {
            // Damage in compressed data first shows as content that makes no sense.
            let damage = source.damage().filter(|_| format != Format::Text);
            return Err(match (damage, format.hint(path)) {
                (Some(damage), _) => told(damage),
                // Where it is known what the file is, its name does not matter.
                (None, Some(hint)) if !failure.to_string().contains(NOT_READ) => {
                    Failure::Failed(format!("{failure}; {hint}"))
                }
                (None, _) => failure,
            });
        }
    };
    input.notes.extend(format.note(path, packed));
    Ok(input)
}

fn by_format(
    format: Format,
    source: &mut Unpacked<'_>,
    name: &str,
    units: Option<Units>,
) -> Result<Input, Failure> {
    let options = ReadOptions {
        units,
        ..ReadOptions::default()
    };
    let scan = match format {
        Format::Journal => return journal(source, name),
        Format::Iges => {
            let points = cad_exchange::iges::read_points(source)
                .map_err(|error| Failure::at(name, &error))?;
            scan_files::from_points_mm(points, name, &options).map_err(told)?
        }
        Format::Text | Format::Ply => {
            scan_files::read_unpacked(source, name, &options).map_err(told)?
        }
    };
    Ok(from_points(scan, name))
}

/// The reader's own words, but for what it cannot know: which formats are read here.
fn told(error: ScanFileError) -> Failure {
    const READ: &str = "expected lines of `x y z`, PLY, IGES with points (106, 116) or a .scan \
                        journal, each plain or gzip-compressed";
    Failure::Failed(match error {
        ScanFileError::OtherFormat { file, format } => {
            format!("{file}: is {format}, {NOT_READ}; {READ}")
        }
        ScanFileError::NotText { file, byte, value } => format!(
            "{file}: byte {byte} (value {value:#04x}) cannot be part of a text file; {READ}"
        ),
        other => other.to_string(),
    })
}

fn from_points(scan: PointScan, name: &str) -> Input {
    let samples = scan.points() as u64;
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
    Input {
        column_pitch_mm: scan.column_pitch_mm,
        sample_spacing_mm: scan.sample_spacing_mm,
        scan: ScanReport {
            source: file_name(name),
            columns: columns.len() as u64,
            samples,
            ..ScanReport::default()
        },
        columns,
        camera_mm: None,
        processing: None,
        name: None,
        timestamp: None,
        notes: scan.notes,
        units_suspected: scan.units_suspected,
    }
}

/// The service's own journal: counts, brought to millimetres by the kept calibration.
fn journal(reader: impl BufRead, name: &str) -> Result<Input, Failure> {
    let failed = |error: scan_record::ReadError| Failure::at(name, &error);
    let mut journal = JournalReader::new(reader).map_err(failed)?;
    let header = journal.header().clone();
    let mut columns = Vec::new();
    let (mut samples, mut dropouts) = (0, 0);
    while let Some(raw) = journal.next_column().map_err(failed)? {
        samples += raw.samples.len() as u64;
        dropouts += u64::from(raw.dropouts);
        columns.push(raw.calibrated(&header.calibration));
        // A column without samples needs memory, too.
        if samples + columns.len() as u64 > MOST_SAMPLES {
            return Err(Failure::Failed(format!(
                "{name}: holds more than {MOST_SAMPLES} samples, the most that are read; let the \
                 service process it (relief rerun), or scan in parts"
            )));
        }
    }
    let mut notes = Vec::new();
    if let Some(ending) = journal.ending()
        && *ending != Ending::Closed(scan_record::EndCause::Complete)
    {
        notes.push(format!("the scan is {ending}"));
    }
    // What the service kept with the scan; a journal of another writer may lack it.
    let kept: Option<relief_api::Scan> = serde_json::from_slice(&header.metadata).ok();
    let started_at: Option<Timestamp> = kept.as_ref().and_then(|scan| scan.started_at.parse().ok());
    let calibration = InForce::kept_with(&header);
    notes.extend(
        calibration
            .as_ref()
            .zip(started_at)
            .and_then(|(own, at)| own.overdue(at)),
    );
    let identity: serde_json::Value = serde_json::from_slice(&header.identity).unwrap_or_default();
    let field = |key: &str| identity.get(key).and_then(|value| value.as_str());
    let source = match (field("model"), field("serial")) {
        (Some(model), Some(serial)) => format!("{model}, serial number {serial}"),
        _ => file_name(name),
    };
    let text = |text: &String| (!text.is_empty()).then(|| text.clone());
    Ok(Input {
        camera_mm: header.calibration.camera_mm(),
        column_pitch_mm: positive(header.column_pitch_mm).unwrap_or_else(|| spacing_x(&columns)),
        sample_spacing_mm: positive(header.sample_spacing_mm)
            .unwrap_or_else(|| spacing_y(&columns)),
        scan: ScanReport {
            id: kept.as_ref().map(|scan| scan.id.clone()),
            scanner: kept.as_ref().and_then(|scan| text(&scan.scanner)),
            source,
            operator: kept.as_ref().and_then(|scan| text(&scan.operator)),
            part: kept.as_ref().and_then(|scan| text(&scan.part)),
            note: kept.as_ref().and_then(|scan| text(&scan.note)),
            columns: columns.len() as u64,
            samples,
            dropouts: Some(dropouts),
            calibration: calibration.map(|own| own.report(started_at)),
        },
        columns,
        processing: serde_json::from_slice(&header.settings).ok(),
        timestamp: started_at,
        name: kept.map(|scan| scan.name),
        notes,
        units_suspected: None,
    })
}

fn positive(length_mm: f64) -> Option<f64> {
    (length_mm.is_finite() && length_mm > 0.0).then_some(length_mm)
}

fn spacing_x(columns: &[Column]) -> f64 {
    let steps = columns.windows(2).filter_map(|pair| match pair {
        [a, b] => Some((b.x_mm() - a.x_mm()).abs()),
        _ => None,
    });
    median(steps.collect())
}

fn spacing_y(columns: &[Column]) -> f64 {
    let steps = columns.iter().flat_map(|column| {
        column.samples().windows(2).filter_map(|pair| match pair {
            [a, b] => Some(b.y_mm - a.y_mm),
            _ => None,
        })
    });
    median(steps.collect())
}

/// The middle value; NaN, which no setting accepts, where there is none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn file_name(name: &str) -> String {
    Path::new(name).file_name().map_or_else(
        || name.to_owned(),
        |file| file.to_string_lossy().into_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_spacing_is_taken_from_the_columns() {
        let sample = |y_mm: f64| Sample {
            y_mm,
            z_mm: 0.0,
            intensity: 255,
        };
        let column = |x: f64| Column::new(x, [0.0, 0.5, 1.0, 7.0].map(sample).to_vec());
        let columns = [column(3.0), column(2.75), column(2.5), column(0.0)];
        assert_eq!((spacing_x(&columns), spacing_y(&columns)), (0.25, 0.5));
        assert!(spacing_x(&[]).is_nan());
    }
}
