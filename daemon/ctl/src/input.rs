//! Scan files of every kind the program knows, as columns.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

use deliverables::ScanReport;
use flate2::bufread::MultiGzDecoder;
use jiff::Timestamp;
use pipeline::Settings;
use range_image::{Column, Sample};
use reliefd::config::Processing;
use scan_files::{PointScan, ReadOptions, Units, recommended_pitch_mm};
use scan_record::{Ending, JournalReader};

use crate::failure::Failure;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// Enough to tell the formats apart: a line of IGES and a little more.
const HEAD_BYTES: u64 = 96;
/// Column (from 0) of the section letter in a line of IGES, and its columns in all.
const IGES_SECTION_COLUMN: usize = 72;
const IGES_LINE: usize = 80;

/// A scan file's content.
#[derive(Debug)]
pub(crate) struct Input {
    /// The columns in the order of the file.
    pub(crate) columns: Vec<Column>,
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
    let failed = |error: std::io::Error| Failure::at(format!("cannot read {name}"), &error);
    let file = File::open(path).map_err(failed)?;
    let (head, plain) = peek(BufReader::with_capacity(1 << 18, file)).map_err(failed)?;
    if head.starts_with(&GZIP_MAGIC) {
        let unpacked = BufReader::with_capacity(1 << 18, MultiGzDecoder::new(plain));
        let (head, unpacked) = peek(unpacked).map_err(failed)?;
        by_format(&head, unpacked, &name, units)
    } else {
        by_format(&head, plain, &name, units)
    }
}

fn by_format(
    head: &[u8],
    reader: impl BufRead,
    name: &str,
    units: Option<Units>,
) -> Result<Input, Failure> {
    if head.starts_with(&scan_record::MAGIC) {
        return journal(reader, name);
    }
    let options = ReadOptions {
        units,
        ..ReadOptions::default()
    };
    let told = |error: scan_files::ScanFileError| Failure::Failed(error.to_string());
    let scan = if is_iges(head) {
        let points =
            cad_exchange::iges::read_points(reader).map_err(|error| Failure::at(name, &error))?;
        scan_files::from_points_mm(points, name, &options).map_err(told)?
    } else {
        scan_files::read_from(reader, name, &options).map_err(told)?
    };
    Ok(from_points(scan, name))
}

fn is_iges(head: &[u8]) -> bool {
    let line = head
        .split(|&b| b == b'\n' || b == b'\r')
        .next()
        .unwrap_or_default();
    let tail = line.get(IGES_SECTION_COLUMN + 1..IGES_LINE);
    matches!(
        line.get(IGES_SECTION_COLUMN),
        Some(b'S' | b'F' | b'B' | b'C')
    ) && tail.is_some_and(|tail| tail.iter().all(|b| b.is_ascii_digit() || *b == b' '))
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
        processing: None,
        name: None,
        timestamp: None,
        notes: scan.notes,
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
    }
    let mut notes = Vec::new();
    if let Some(ending) = journal.ending()
        && *ending != Ending::Closed(scan_record::EndCause::Complete)
    {
        notes.push(format!("the scan is {ending}"));
    }
    // What the service kept with the scan; a journal of another writer may lack it.
    let kept: Option<relief_api::Scan> = serde_json::from_slice(&header.metadata).ok();
    let identity: serde_json::Value = serde_json::from_slice(&header.identity).unwrap_or_default();
    let field = |key: &str| identity.get(key).and_then(|value| value.as_str());
    let source = match (field("model"), field("serial")) {
        (Some(model), Some(serial)) => format!("{model}, serial number {serial}"),
        _ => file_name(name),
    };
    let text = |text: &String| (!text.is_empty()).then(|| text.clone());
    Ok(Input {
        column_pitch_mm: positive(header.column_pitch_mm).unwrap_or_else(|| spacing_x(&columns)),
        sample_spacing_mm: positive(header.sample_spacing_mm)
            .unwrap_or_else(|| spacing_y(&columns)),
        scan: ScanReport {
            id: kept.as_ref().map(|scan| scan.id.clone()),
            source,
            operator: kept.as_ref().and_then(|scan| text(&scan.operator)),
            part: kept.as_ref().and_then(|scan| text(&scan.part)),
            note: kept.as_ref().and_then(|scan| text(&scan.note)),
            columns: columns.len() as u64,
            samples,
            dropouts: Some(dropouts),
        },
        columns,
        processing: serde_json::from_slice(&header.settings).ok(),
        timestamp: kept.as_ref().and_then(|scan| scan.started_at.parse().ok()),
        name: kept.map(|scan| scan.name),
        notes,
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

/// The first bytes, and a reader that still delivers them.
fn peek<R: BufRead>(mut reader: R) -> std::io::Result<(Vec<u8>, impl BufRead + use<R>)> {
    let mut head = Vec::new();
    reader.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok((head.clone(), Cursor::new(head).chain(reader)))
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
    fn iges_is_told_by_the_letter_of_its_first_line() {
        let line = |letter: char| format!("{:<72}{letter}{:>7}\n", "A scan", 1);
        assert!(is_iges(line('S').as_bytes()));
        assert!(!is_iges(line('x').as_bytes()));
        assert!(!is_iges(b"1.0 2.0 3.0\n"));
        assert!(!is_iges(&[b'S'; 96]));
    }

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
