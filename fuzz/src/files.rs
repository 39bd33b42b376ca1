//! Readers of files.

use std::collections::BTreeMap;
use std::path::Path;

use crc::{CRC_32_ISO_HDLC, Crc};
use reliefd::Config;
use scan_files::{ReadOptions, read_from};
use scan_record::{Ending, JournalReader, MAX_SAMPLES};

/// Enough for a fuzzer; what many points take is measured elsewhere.
const MOST_POINTS: usize = 1 << 14;
/// Preamble of a journal, and kind and length of a record.
const PREAMBLE_BYTES: usize = 12;
const RECORD_HEAD_BYTES: usize = 5;
const CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Text, PLY, and whatever else is told by its content; plain or compressed.
pub fn scan_file(data: &[u8]) {
    let options = ReadOptions {
        max_points: MOST_POINTS,
        ..ReadOptions::default()
    };
    match read_from(data, "fuzz", &options) {
        Ok(scan) => {
            assert!(scan.points() > 0 && scan.points() <= MOST_POINTS);
            assert!(scan.columns.windows(2).all(|w| w[0].x_mm < w[1].x_mm));
            let mut samples = scan.columns.iter().flat_map(|column| &column.samples);
            assert!(samples.all(|s| s.y_mm.is_finite() && s.z_mm.is_finite()));
            assert!(scan.column_pitch_mm.is_finite() && scan.column_pitch_mm >= 0.0);
        }
        Err(error) => told(&error.to_string()),
    }
}

/// PLY alone, so that no time goes into finding its first line.
pub fn ply(data: &[u8]) {
    let kinds = ["ascii", "binary_little_endian", "binary_big_endian"];
    let Some((first, rest)) = data.split_first() else {
        return;
    };
    let kind = kinds[usize::from(*first) % kinds.len()];
    let mut file = format!("ply\nformat {kind} 1.0\n").into_bytes();
    file.extend_from_slice(rest);
    scan_file(&file);
}

/// IGES, as measured points and as a model. After a bar come the bare contents: the Global
/// section on the first line, an entity on each that follows, its directory entry's fields
/// before another bar. They are laid out in columns, which a fuzzer's insertions would else
/// break, long before they come to mean something.
pub fn iges(data: &[u8]) {
    match data.split_first() {
        Some((b'|', contents)) => read_iges(&laid_out(contents)),
        _ => read_iges(data),
    }
}

/// A STEP file, of this writer's own or as a nominal of any program's.
pub fn step(data: &[u8]) {
    if let Err(error) = cad_exchange::step::read_model(data) {
        told(&error.to_string());
    }
    let settings = solids::FacetSettings {
        tolerance_mm: 0.5,
        most: 2_000,
    };
    match cad_exchange::step::read_body(data) {
        Ok(body) => match solids::facets(&body, &settings) {
            Ok(facets) => {
                let points = facets.points_mm.len();
                assert!(facets.triangles.len() <= settings.most);
                assert!(facets.triangles.iter().flatten().all(|k| *k < points));
            }
            Err(error) => told(&error.to_string()),
        },
        Err(error) => told(&error.to_string()),
    }
}

fn read_iges(data: &[u8]) {
    match cad_exchange::iges::read_points(data) {
        Ok(points) => assert!(points.iter().flatten().all(|c| c.is_finite())),
        Err(error) => told(&error.to_string()),
    }
    if let Err(error) = cad_exchange::iges::read_model(data) {
        told(&error.to_string());
    }
}

/// Fields of a directory entry that are given, and where they stand: level, matrix and status
/// in the first line; colour and form in the second.
const ENTRY_FIELDS: [(usize, usize); 5] = [(0, 4), (0, 6), (0, 8), (1, 2), (1, 4)];

/// The 80-column form of the bare contents of an IGES file, without their first bar.
#[must_use]
pub fn laid_out(contents: &[u8]) -> Vec<u8> {
    let mut records = contents.split(|&b| b == b'\n');
    let global = records.next().unwrap_or_default();
    let mut file = Vec::new();
    line(&mut file, b"fuzz", b'S', 1);
    for (index, part) in global.chunks(72).enumerate() {
        line(&mut file, part, b'G', index + 1);
    }
    let (mut directory, mut parameters) = (Vec::new(), Vec::new());
    let (mut entries, mut lines) = (0, 0);
    for record in records {
        let bar = record.iter().position(|&b| b == b'|');
        let (fields, values) = match bar {
            Some(bar) => (&record[..bar], &record[bar + 1..]),
            None => (&b""[..], record),
        };
        let kind: String = values
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .map(|&b| char::from(b))
            .collect();
        let parts: Vec<&[u8]> = values.chunks(64).collect();
        let mut entry = [[b' '; 72]; 2];
        let mut put = |row: usize, field: usize, text: &[u8]| {
            for (place, &byte) in entry[row][8 * field..].iter_mut().take(8).zip(text) {
                *place = byte;
            }
        };
        put(0, 0, kind.as_bytes());
        put(1, 0, kind.as_bytes());
        put(0, 1, (lines + 1).to_string().as_bytes());
        put(1, 3, parts.len().to_string().as_bytes());
        for ((row, field), text) in ENTRY_FIELDS.iter().zip(fields.split(|&b| b == b'/')) {
            put(*row, *field, text);
        }
        for row in &entry {
            entries += 1;
            line(&mut directory, row, b'D', entries);
        }
        for part in parts {
            lines += 1;
            line(&mut parameters, part, b'P', lines);
        }
    }
    file.extend(directory);
    file.extend(parameters);
    line(&mut file, b"", b'T', 1);
    file
}

/// A line of 80 columns.
fn line(file: &mut Vec<u8>, content: &[u8], section: u8, number: usize) {
    let start = file.len();
    file.extend(content.iter().map(|&b| if b == b'\r' { b' ' } else { b }));
    file.resize(start + 72, b' ');
    file.push(section);
    file.extend(format!("{number:7}\n").into_bytes());
}

/// A journal, as it is and with every checksum made right, which else would keep the fuzzer
/// from all that is behind it.
pub fn journal(data: &[u8]) {
    read_journal(data);
    read_journal(&with_checksums(data));
}

fn read_journal(data: &[u8]) {
    let mut journal = match JournalReader::new(data) {
        Ok(journal) => journal,
        Err(error) => return told(&error.to_string()),
    };
    let calibration = journal.header().calibration;
    let mut last = None;
    while let Ok(Some(column)) = journal.next_column() {
        assert!(last.is_none_or(|last| column.index > last));
        assert!(column.samples.len() <= MAX_SAMPLES);
        last = Some(column.index);
        // Any counts, and any calibration that the header may hold.
        let _ = column.calibrated(&calibration);
    }
    match journal.ending() {
        Some(Ending::Damaged { at_byte, .. }) => assert!(*at_byte <= data.len() as u64),
        Some(Ending::Closed(_)) => {}
        None => panic!("a journal in memory has an end"),
    }
}

/// The same records, as far as their lengths make sense, with sound checksums.
fn with_checksums(data: &[u8]) -> Vec<u8> {
    let mut file = data.to_vec();
    let mut at = PREAMBLE_BYTES;
    while let Some(&[_, a, b, c, d]) = file.get(at..at + RECORD_HEAD_BYTES) {
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        let end = at.saturating_add(RECORD_HEAD_BYTES).saturating_add(length);
        let Some(record) = file.get(at..end) else {
            break;
        };
        let sum = CHECKSUM.checksum(record).to_le_bytes();
        let Some(place) = file.get_mut(end..end + sum.len()) else {
            break;
        };
        place.copy_from_slice(&sum);
        at = end + sum.len();
    }
    file
}

/// A configuration, and a setting of a scan in JSON.
pub fn config(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match Config::parse(&text, Path::new("fuzz.toml")) {
        Ok(config) => {
            // What may be read must hold together.
            let (same, _) = config.reloaded(&config);
            assert_eq!(same, config);
            let settings = config.processing().pipeline_settings(0.0, f64::NAN);
            assert!(settings.validate().is_ok());
        }
        Err(error) => told(&error.to_string()),
    }
    let (key, value) = text.split_once('=').unwrap_or((&text, "1"));
    let value = serde_json::from_str(value).unwrap_or_else(|_| value.into());
    let overrides = BTreeMap::from([(key.to_owned(), value)]);
    if let Ok(settings) = Config::default().processing().with_overrides(&overrides) {
        assert!(settings.pipeline_settings(0.0, 0.0).validate().is_ok());
    }
}

/// A refusal says something, and no more than anybody reads.
fn told(error: &str) {
    assert!(
        !error.is_empty() && error.len() < 16_384,
        "{} bytes",
        error.len()
    );
}
