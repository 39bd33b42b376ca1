use scan_record::{EndCause, Ending, JournalReader, JournalWriter, most_bytes};

use crate::common::{column, header, journal};

#[test]
fn what_was_written_is_read() {
    let columns = [column(0, 4), column(1, 0), column(5, 200)];
    for cause in [
        EndCause::Complete,
        EndCause::Aborted("by the operator".into()),
        EndCause::Fault("motor stalled, 40 \u{b0}C".into()),
    ] {
        let bytes = journal(&columns, &cause);
        let mut reader = JournalReader::new(bytes.as_slice()).unwrap();
        assert_eq!(reader.header(), &header());
        assert_eq!(reader.ending(), None);
        for expected in &columns {
            assert_eq!(reader.next_column().unwrap().as_ref(), Some(expected));
        }
        assert_eq!(reader.next_column().unwrap(), None);
        assert_eq!(reader.ending(), Some(&Ending::Closed(cause)));
        assert_eq!(reader.columns(), 3);
    }
}

#[test]
fn a_file_is_made_once_and_never_over_another() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.scan");
    let mut writer = JournalWriter::create(&path, &header()).unwrap();
    writer.append(&column(0, 3)).unwrap();
    writer.sync().unwrap();
    assert_eq!(
        writer.bytes(),
        std::fs::metadata(&path).unwrap().len(),
        "the count of bytes is that of the file"
    );
    writer.finish(&EndCause::Complete).unwrap();
    let error = JournalWriter::create(&path, &header()).unwrap_err();
    assert!(error.to_string().contains("File exists"), "{error}");
    let mut reader = JournalReader::open(&path).unwrap();
    assert_eq!(reader.next_column().unwrap(), Some(column(0, 3)));
}

#[test]
fn room_for_the_whole_scan_is_set_aside_and_given_back() {
    use std::os::unix::fs::MetadataExt;

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.scan");
    let taken = || std::fs::metadata(&path).unwrap().blocks() * 512;
    let mut writer = JournalWriter::create(&path, &header()).unwrap();
    writer.reserve(100, 1_000).unwrap();
    let most = most_bytes(100, 1_000);
    assert!(taken() >= 100 * 10_000, "{} bytes are set aside", taken());
    writer.append(&column(0, 3)).unwrap();
    let reason = "x".repeat(10_000);
    writer.finish(&EndCause::Fault(reason)).unwrap();
    assert!(taken() < 100_000, "{} bytes are kept", taken());
    assert!((1_002_500..1_102_500).contains(&most), "{most}");

    // As much as is foreseen is enough for the largest.
    let path = folder.path().join("b.scan");
    let mut writer = JournalWriter::create(&path, &header()).unwrap();
    for index in 0..100 {
        writer.append(&column(index, 1_000)).unwrap();
    }
    writer.finish(&EndCause::Fault("x".repeat(10_000))).unwrap();
    assert!(std::fs::metadata(&path).unwrap().len() <= most);
}

#[test]
fn a_column_is_calibrated_by_the_header() {
    let raw = column(2, 3);
    let calibrated = raw.calibrated(&header().calibration);
    assert!((calibrated.x_mm() - (-60.0 + 0.01 * 93.0)).abs() < 1e-12);
    for (sample, k) in calibrated.samples().iter().zip([0.0_f64, 1.0, 2.0]) {
        let (angle, range) = ((k * 500.0 - 1_000.0) * 1e-6, (7_000.0 + k) * 0.1);
        assert!((sample.y_mm - (5.0 + range * angle.sin())).abs() < 1e-9);
        assert!((sample.z_mm - (750.0 - range * angle.cos())).abs() < 1e-9);
    }
    assert_eq!(calibrated.samples().len(), 3);
}

#[test]
fn a_reason_of_any_length_is_cut_at_a_character() {
    let reason = "\u{e9}".repeat(3_000);
    let bytes = journal(&[], &EndCause::Fault(reason));
    let mut reader = JournalReader::new(bytes.as_slice()).unwrap();
    assert_eq!(reader.next_column().unwrap(), None);
    assert_eq!(
        reader.ending(),
        Some(&Ending::Closed(EndCause::Fault("\u{e9}".repeat(2_048))))
    );
}
