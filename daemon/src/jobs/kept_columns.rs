//! The columns of a scan, to be gone through several times: in memory where they are few.

use std::path::Path;

use pipeline::{Columns, ReadAgainError};
use range_image::Column;
use scan_record::JournalReader;

/// The columns of a journal: held in memory, or read anew each time.
pub(super) struct KeptColumns<'a> {
    pub(super) path: &'a Path,
    pub(super) held: Option<Vec<Column>>,
    pub(super) camera_mm: Option<[f64; 2]>,
}

impl Columns for KeptColumns<'_> {
    fn visit(&self, take: &mut dyn FnMut(&Column) -> bool) -> Result<(), ReadAgainError> {
        if let Some(held) = &self.held {
            held.iter().all(take);
            return Ok(());
        }
        let mut journal = JournalReader::open(self.path)?;
        let calibration = journal.header().calibration;
        while let Some(raw) = journal.next_column()? {
            if !take(&raw.calibrated(&calibration)) {
                break;
            }
        }
        Ok(())
    }

    fn camera_mm(&self) -> Option<[f64; 2]> {
        self.camera_mm
    }
}

/// Samples of a scan that is held in memory, at most: 25 megabytes. They are gone through some five times,
/// and would be read and decoded each time.
const MOST_HELD_SAMPLES: usize = 1 << 20;

/// The columns of a scan that is small enough.
pub(super) struct Held {
    /// `None` once there are too many samples.
    pub(super) columns: Option<Vec<Column>>,
    samples: usize,
}

impl Held {
    pub(super) fn none_yet() -> Self {
        Self {
            columns: Some(Vec::new()),
            samples: 0,
        }
    }

    pub(super) fn add(&mut self, column: Column) {
        self.samples += column.samples().len();
        match &mut self.columns {
            Some(columns) if self.samples <= MOST_HELD_SAMPLES => columns.push(column),
            columns => *columns = None,
        }
    }
}

#[cfg(test)]
mod tests {
    use range_image::Sample;

    use super::*;

    #[test]
    fn a_scan_is_held_as_long_as_it_is_small() {
        let column = |x_mm, samples: usize| {
            let sample = |k| Sample {
                y_mm: k as f64,
                z_mm: 0.0,
                intensity: 0,
            };
            Column::new(x_mm, (0..samples).map(sample).collect())
        };
        let mut held = Held::none_yet();
        held.add(column(0.0, MOST_HELD_SAMPLES - 1));
        held.add(column(1.0, 1));
        assert_eq!(held.columns.as_ref().map(Vec::len), Some(2));
        held.add(column(2.0, 1));
        assert!(held.columns.is_none());
        held.add(column(3.0, 1));
        assert!(held.columns.is_none(), "the beginning is gone");
    }
}
