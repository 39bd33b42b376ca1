//! A small scan, and a medium that forgets what was not synced.
#![allow(dead_code, reason = "each test program uses its part")]

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use range_image::{Calibration, calibration::Head};
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample, Storage};

pub(crate) fn header() -> Header {
    Header {
        calibration: Calibration {
            table_origin_mm: -60.0,
            table_count_mm: 0.01,
            head: Head::Polar {
                camera_y_mm: 5.0,
                camera_z_mm: 750.0,
                angle_count_rad: 1e-6,
                range_count_mm: 0.1,
            },
            correction: None,
        },
        column_pitch_mm: 0.5,
        sample_spacing_mm: 0.4,
        identity: b"id".to_vec(),
        plan: b"plan".to_vec(),
        settings: Vec::new(),
        metadata: b"m".to_vec(),
        correction: Vec::new(),
    }
}

pub(crate) fn column(index: u32, samples: i32) -> RawColumn {
    RawColumn {
        index,
        table_counts: index as i32 * 50 - 7,
        dropouts: index,
        samples: (0..samples)
            .map(|k| RawSample {
                lateral_counts: k * 500 - 1_000,
                range_counts: 7_000 + k,
                intensity: (200 - k) as u8,
                saturated: k == 1,
            })
            .collect(),
    }
}

pub(crate) fn journal(columns: &[RawColumn], cause: &EndCause) -> Vec<u8> {
    let mut writer =
        JournalWriter::new(Medium::default(), &header()).expect("this medium takes everything");
    for column in columns {
        writer.append(column).expect("this medium takes everything");
    }
    writer
        .finish(cause)
        .expect("this medium takes everything")
        .written
}

/// Keeps what was written and how much of it was synced; full after `room` bytes.
#[derive(Debug)]
pub(crate) struct Medium {
    pub(crate) written: Vec<u8>,
    pub(crate) synced: usize,
    pub(crate) room: usize,
    pub(crate) released: Arc<AtomicBool>,
}

impl Default for Medium {
    fn default() -> Self {
        Self {
            written: Vec::new(),
            synced: 0,
            room: usize::MAX,
            released: Arc::default(),
        }
    }
}

impl Write for Medium {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(self.room - self.written.len());
        if taken == 0 && !bytes.is_empty() {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.written.extend_from_slice(&bytes[..taken]);
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Storage for Medium {
    fn sync_data(&mut self) -> io::Result<()> {
        self.synced = self.written.len();
        Ok(())
    }

    fn release(&mut self) -> io::Result<()> {
        self.released.store(true, Ordering::Relaxed);
        Ok(())
    }
}
