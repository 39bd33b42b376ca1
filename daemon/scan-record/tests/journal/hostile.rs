use proptest::prelude::*;
use scan_record::{EndCause, Ending, JournalReader, ReadError};

use crate::common::{column, journal};

fn sound() -> Vec<u8> {
    journal(&[column(0, 3), column(1, 4)], &EndCause::Complete)
}

/// Where the first column's record begins.
const FIRST_COLUMN: usize = 12 + 5 + 88 + 4;

#[test]
fn other_files_are_refused_by_name() {
    for bytes in [
        &b""[..],
        b"RELSCAN\r\n\x01\0\0\0\0",
        b"solid house",
        &[0; 64],
    ] {
        assert!(matches!(
            JournalReader::new(bytes),
            Err(ReadError::NotAJournal)
        ));
    }
    let mut newer = sound();
    newer[8] = 9;
    let error = JournalReader::new(newer.as_slice()).unwrap_err();
    assert!(error.to_string().contains("format version 9"), "{error}");
}

#[test]
fn a_damaged_header_says_where_and_what() {
    let mut bytes = sound();
    bytes[40] ^= 1;
    let error = JournalReader::new(bytes.as_slice()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the header of this scan journal (byte 12) is damaged: \
         a record does not match its checksum"
    );
    let error = JournalReader::new(&sound()[..12]).unwrap_err();
    assert!(
        error.to_string().ends_with("the file ends there"),
        "{error}"
    );
}

#[test]
fn an_impossible_length_is_refused_before_it_is_believed() {
    let mut bytes = sound();
    bytes[FIRST_COLUMN + 1..FIRST_COLUMN + 5].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut reader = JournalReader::new(bytes.as_slice()).unwrap();
    assert_eq!(reader.next_column().unwrap(), None);
    assert_eq!(
        reader.ending(),
        Some(&Ending::Damaged {
            at_byte: FIRST_COLUMN as u64,
            columns: 0,
            what: "a record claims an impossible length"
        })
    );
}

#[test]
fn any_flipped_bit_is_noticed() {
    let bytes = sound();
    for at in FIRST_COLUMN..bytes.len() {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << (at % 8);
        let mut reader = JournalReader::new(flipped.as_slice()).unwrap();
        let mut read = Vec::new();
        while let Some(column) = reader.next_column().unwrap() {
            read.push(column);
        }
        assert!(
            matches!(reader.ending(), Some(Ending::Damaged { .. })),
            "byte {at}"
        );
        for (index, got) in read.iter().enumerate() {
            assert_eq!(got, &column(index as u32, 3 + index as i32));
        }
    }
}

proptest! {
    #[test]
    fn garbage_never_panics_and_always_ends(
        keep in 0_usize..300,
        tail in proptest::collection::vec(any::<u8>(), 0..400),
    ) {
        let mut bytes = sound();
        bytes.truncate(keep);
        bytes.extend_from_slice(&tail);
        if let Ok(mut reader) = JournalReader::new(bytes.as_slice()) {
            let mut columns = 0;
            while let Some(column) = reader.next_column().unwrap() {
                columns += 1;
                prop_assert!(column.samples.len() <= scan_record::MAX_SAMPLES);
            }
            prop_assert_eq!(columns, reader.columns());
            prop_assert!(reader.ending().is_some());
        }
    }
}
