use std::sync::Arc;
use std::sync::atomic::Ordering;

use scan_record::{EndCause, Ending, JournalReader, JournalWriter, WriteError};

use crate::common::{Medium, column, header, journal};

#[test]
fn every_prefix_gives_every_whole_column_and_names_the_rest() {
    let columns = [column(0, 3), column(1, 1), column(2, 5)];
    let bytes = journal(&columns, &EndCause::Complete);
    // Where each record ends, from the documented sizes.
    let header_end = 12 + 5 + (8 + 8 + 1 + 32 + 16 + 16 + 2 + 4 + 1) + 4;
    let mut ends = vec![header_end];
    for column in &columns {
        ends.push(ends[ends.len() - 1] + 5 + 16 + 10 * column.samples.len() + 4);
    }
    assert_eq!(bytes.len(), ends[3] + 5 + 5 + 4);
    for length in header_end..bytes.len() {
        let whole = ends.iter().filter(|&&end| end <= length).count() - 1;
        let mut reader = JournalReader::new(&bytes[..length]).unwrap();
        for expected in &columns[..whole] {
            assert_eq!(reader.next_column().unwrap().as_ref(), Some(expected));
        }
        assert_eq!(reader.next_column().unwrap(), None, "at length {length}");
        let Some(Ending::Damaged {
            at_byte, columns, ..
        }) = reader.ending()
        else {
            panic!("length {length}: {:?}", reader.ending());
        };
        assert_eq!((*at_byte, *columns), (ends[whole] as u64, whole as u32));
    }
    let text = {
        let mut reader = JournalReader::new(&bytes[..ends[2] + 9]).unwrap();
        while reader.next_column().unwrap().is_some() {}
        reader.ending().unwrap().to_string()
    };
    assert_eq!(
        text,
        format!(
            "incomplete: at byte {} a record is cut off; 2 columns before it are kept",
            ends[2]
        )
    );
}

#[test]
fn what_was_synced_survives_losing_the_rest() {
    let mut writer = JournalWriter::new(Medium::default(), &header()).unwrap();
    for index in 0..10 {
        writer.append(&column(index, 4)).unwrap();
        if index == 6 {
            writer.sync().unwrap();
        }
    }
    let medium = writer.finish(&EndCause::Complete).unwrap();
    assert_eq!(medium.synced, medium.written.len(), "the end is synced");

    let mut writer = JournalWriter::new(Medium::default(), &header()).unwrap();
    let after_header = writer.bytes();
    for index in 0..7 {
        writer.append(&column(index, 4)).unwrap();
    }
    writer.sync().unwrap();
    let synced = writer.bytes();
    assert_eq!(synced - after_header, 7 * (5 + 16 + 40 + 4));
    let mut reader = JournalReader::new(&medium.written[..synced as usize]).unwrap();
    while reader.next_column().unwrap().is_some() {}
    assert_eq!(reader.columns(), 7);
}

#[test]
fn a_full_disk_ends_the_journal_for_good() {
    let room = journal(&[column(0, 4)], &EndCause::Complete).len() + 20;
    let medium = Medium {
        room,
        ..Medium::default()
    };
    let released = Arc::clone(&medium.released);
    let mut writer = JournalWriter::new(medium, &header()).unwrap();
    writer.append(&column(0, 4)).unwrap();
    let error = writer.append(&column(1, 4)).unwrap_err();
    assert!(matches!(error, WriteError::Io(_)), "{error}");
    assert!(matches!(
        writer.append(&column(1, 4)),
        Err(WriteError::Failed)
    ));
    assert!(matches!(writer.sync(), Err(WriteError::Failed)));
    assert!(!released.load(Ordering::Relaxed));
    assert!(matches!(
        writer.finish(&EndCause::Complete),
        Err(WriteError::Failed)
    ));
    assert!(released.load(Ordering::Relaxed), "room set aside is kept");
}

#[test]
fn columns_out_of_order_are_refused_and_harm_nothing() {
    let mut writer = JournalWriter::new(Medium::default(), &header()).unwrap();
    writer.append(&column(3, 1)).unwrap();
    let error = writer.append(&column(3, 1)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "column 3 cannot follow column 3: columns are kept in ascending order"
    );
    let error = writer.append(&column(4, 70_000)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "column 4 has 70000 samples, at most 65536 are allowed"
    );
    writer.append(&column(4, 1)).unwrap();
    let bytes = writer.finish(&EndCause::Complete).unwrap().written;
    let mut reader = JournalReader::new(bytes.as_slice()).unwrap();
    while reader.next_column().unwrap().is_some() {}
    assert_eq!(reader.ending(), Some(&Ending::Closed(EndCause::Complete)));
}
