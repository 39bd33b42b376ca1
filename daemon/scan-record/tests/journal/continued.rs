//! A journal that was cut short is gone on with.

use std::fs;

use scan_record::{EndCause, JournalReader, JournalWriter, RawColumn};
use storage::LocalDisk;

use crate::common::{column, journal};

const COLUMNS: u32 = 6;

fn columns() -> Vec<RawColumn> {
    (0..COLUMNS).map(|index| column(index, 5)).collect()
}

#[test]
fn a_journal_cut_anywhere_becomes_the_same_as_one_in_one_go() {
    let columns = columns();
    let whole = journal(&columns, &EndCause::Complete);
    let header_bytes = journal_bytes_before_columns();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.scan");
    for cut in header_bytes..whole.len() {
        let mut left = whole[..cut].to_vec();
        // What a power failure may leave of blocks that were never written.
        left.resize(cut + 40, 0);
        fs::write(&path, &left).unwrap();
        let mut reader = JournalReader::open(&path).unwrap();
        assert_eq!(reader.continuation(), None);
        while reader.next_column().unwrap().is_some() {}
        let kept = reader.columns();
        let continuation = reader.continuation().unwrap();
        assert!(continuation.at_byte() as usize <= cut);

        let mut writer = JournalWriter::continue_on(&LocalDisk, &path, continuation).unwrap();
        assert_eq!(writer.columns(), kept, "cut at {cut}");
        assert_eq!(writer.bytes(), continuation.at_byte());
        for column in &columns[kept as usize..] {
            writer.append(column).unwrap();
        }
        writer.finish(&EndCause::Complete).unwrap();
        assert!(fs::read(&path).unwrap() == whole, "cut at {cut}");
    }
}

#[test]
fn no_column_is_kept_twice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.scan");
    let whole = journal(&columns(), &EndCause::Complete);
    fs::write(&path, &whole[..whole.len() - 1]).unwrap();
    let mut reader = JournalReader::open(&path).unwrap();
    while reader.next_column().unwrap().is_some() {}
    let continuation = reader.continuation().unwrap();
    let mut writer = JournalWriter::continue_on(&LocalDisk, &path, continuation).unwrap();
    let error = writer.append(&column(COLUMNS - 1, 5)).unwrap_err();
    assert!(error.to_string().contains("ascending order"), "{error}");
}

#[test]
fn one_that_has_its_end_is_not_gone_on_with() {
    let whole = journal(&columns(), &EndCause::Aborted("by hand".into()));
    let mut reader = JournalReader::new(whole.as_slice()).unwrap();
    while reader.next_column().unwrap().is_some() {}
    assert_eq!(reader.continuation(), None);
}

/// Bytes of a journal before its first column.
fn journal_bytes_before_columns() -> usize {
    // An end record is a kind, a length, a cause, a count and a checksum.
    journal(&[], &EndCause::Complete).len() - (1 + 4 + 1 + 4 + 4)
}
