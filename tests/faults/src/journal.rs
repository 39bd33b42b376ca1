//! A scan's journal in memory, byte for byte as on disk.

use anyhow::Result;
use range_image::{Calibration, calibration::Head};
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample};

/// Keeps columns as the service does.
#[derive(Debug)]
pub struct Journal(JournalWriter<Vec<u8>>);

impl Journal {
    /// An empty journal.
    ///
    /// # Errors
    /// What the writer refuses.
    pub fn new() -> Result<Self> {
        let header = Header {
            calibration: Calibration {
                table_origin_mm: 0.0,
                table_count_mm: 0.01,
                head: Head::Cartesian { count_mm: 0.1 },
                correction: None,
            },
            column_pitch_mm: 0.5,
            sample_spacing_mm: 0.5,
            identity: Vec::new(),
            plan: Vec::new(),
            settings: Vec::new(),
            metadata: Vec::new(),
            correction: Vec::new(),
        };
        Ok(Self(JournalWriter::new(Vec::new(), &header)?))
    }

    /// Adds a column.
    ///
    /// # Errors
    /// When it is not the next.
    pub fn append(&mut self, column: scanner_driver::RawColumn) -> Result<()> {
        anyhow::ensure!(
            column.index == self.0.columns(),
            "column {} after {} columns",
            column.index,
            self.0.columns()
        );
        let samples = column.samples.into_iter().map(|sample| RawSample {
            lateral_counts: sample.lateral_counts,
            range_counts: sample.range_counts,
            intensity: sample.intensity,
            saturated: sample.saturated,
        });
        self.0.append(&RawColumn {
            index: column.index,
            table_counts: column.table_counts,
            dropouts: column.dropouts,
            samples: samples.collect(),
        })?;
        Ok(())
    }

    /// The bytes of the finished journal.
    ///
    /// # Errors
    /// What the writer refuses.
    pub fn finish(self) -> Result<Vec<u8>> {
        Ok(self.0.finish(&EndCause::Complete)?)
    }
}
