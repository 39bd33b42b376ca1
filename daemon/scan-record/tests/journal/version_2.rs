//! The bytes of format version 2, which has a correction. Do not edit: files like this one are on
//! users' disks, so a byte that changes means that the change is wrong, not the test.

use range_image::Correction;
use scan_record::{EndCause, Header, JournalReader, JournalWriter, ReadError};

use crate::common::{column, header, journal};

fn corrected() -> Header {
    let mut header = header();
    header.calibration.correction = Some(Correction::from_array([
        0.5, -0.125, 2.0, 0.0625, 1.0, -2.0, 4.0, 0.25, -0.5, 0.03125,
    ]));
    header.correction = b"why".to_vec();
    header
}

/// What stands behind the metadata: ten numbers, three bytes.
#[rustfmt::skip]
const CORRECTION: &[u8] = &[
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xe0, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xc0, 0xbf,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x40, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xb0, 0x3f,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xf0, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xc0,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x10, 0x40, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xd0, 0x3f,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xe0, 0xbf, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xa0, 0x3f,
    0x03, 0x00, 0x00, 0x00, 0x77, 0x68, 0x79,
];

fn written(header: &Header) -> Vec<u8> {
    let mut writer = JournalWriter::new(Vec::new(), header).expect("memory takes it");
    writer.append(&column(0, 2)).expect("memory takes it");
    writer.finish(&EndCause::Complete).expect("memory takes it")
}

#[test]
fn a_correction_stands_behind_the_metadata() {
    let bytes = written(&corrected());
    // As version 1, but for the version, the length of the header and its checksum.
    let plain = journal(&[column(0, 2)], &EndCause::Complete);
    assert_eq!(bytes[8..12], [2, 0, 0, 0]);
    let payload = 17..17 + 88;
    assert_eq!(bytes[payload.clone()], plain[payload.clone()]);
    let behind = payload.end..payload.end + CORRECTION.len();
    assert_eq!(&bytes[behind.clone()], CORRECTION);
    assert_eq!(bytes[behind.end + 4..], plain[payload.end + 4..]);
}

#[test]
fn a_correction_is_read_again_and_used() {
    let bytes = written(&corrected());
    let mut reader = JournalReader::new(bytes.as_slice()).unwrap();
    assert_eq!(reader.header(), &corrected());
    let calibration = reader.header().calibration;
    let raw = reader.next_column().unwrap().unwrap();
    assert_eq!(raw, column(0, 2), "counts stay as they were");
    let (with, without) = (
        raw.calibrated(&calibration),
        raw.calibrated(&calibration.as_announced()),
    );
    assert_ne!(with, without);
}

#[test]
fn versions_are_not_taken_for_each_other() {
    for (header, version) in [(corrected(), 1), (header(), 2)] {
        let mut bytes = written(&header);
        bytes[8] = version;
        let error = JournalReader::new(bytes.as_slice()).unwrap_err();
        assert!(matches!(error, ReadError::DamagedHeader { .. }), "{error}");
    }
}

#[test]
fn a_correction_of_no_scanner_is_refused() {
    let mut header = corrected();
    header.calibration.correction = Some(Correction {
        table_scale: f64::NAN,
        ..Correction::default()
    });
    let error = JournalReader::new(written(&header).as_slice()).unwrap_err();
    assert!(error.to_string().contains("a scale is off"), "{error}");
}
