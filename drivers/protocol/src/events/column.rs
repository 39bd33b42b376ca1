//! A column's samples, in fragments, and its end.

use crate::message::Message;
use crate::wire::{MessageError, Reader, Wire, Writer, message};

/// Most samples in a fragment with evenly spaced laterals.
pub const UNIFORM_SAMPLES: usize = 15;

/// Most samples in a fragment that lists its laterals.
pub const LISTED_SAMPLES: usize = 10;

/// What the head says about one sample.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reading {
    /// Distance along the ray, or z, counts. 0 without return.
    pub range_counts: i32,
    /// Brightness of the returned light. 0 without return.
    pub intensity: u8,
    /// No light came back: there is no range.
    pub no_return: bool,
    /// The light was brighter than the head can measure: the range is doubtful.
    pub saturated: bool,
}

impl Reading {
    /// No light came back.
    pub const NO_RETURN: Self = Self {
        range_counts: 0,
        intensity: 0,
        no_return: true,
        saturated: false,
    };
}

impl Wire for Reading {
    fn put(&self, out: &mut Writer) {
        self.range_counts.put(out);
        self.intensity.put(out);
        (u8::from(self.no_return) | u8::from(self.saturated) << 1).put(out);
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        let range_counts = Wire::get(input)?;
        let intensity = Wire::get(input)?;
        let flags = u8::get(input)?;
        if flags & !3 != 0 {
            return Err(MessageError::BadValue);
        }
        Ok(Self {
            range_counts,
            intensity,
            no_return: flags & 1 != 0,
            saturated: flags & 2 != 0,
        })
    }
}

/// A reading and where it was taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sample {
    /// Angle of the ray, or y, counts.
    pub lateral_counts: i32,
    /// What the head says.
    pub reading: Reading,
}

/// The laterals of a fragment, with the readings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Laterals {
    /// Sample `i` of the fragment is at `first_counts + i * step_counts`.
    Uniform {
        /// Lateral of the fragment's first sample, counts.
        first_counts: i32,
        /// From sample to sample, counts.
        step_counts: i32,
        /// The readings.
        readings: heapless::Vec<Reading, UNIFORM_SAMPLES>,
    },
    /// Each sample comes with its lateral.
    Listed(heapless::Vec<Sample, LISTED_SAMPLES>),
}

/// Some consecutive samples of a column. Each fragment tells all that is needed to place
/// it, so that fragments may come in any order and more than once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnFragment {
    /// The scan's number.
    pub scan_id: u16,
    /// Index of the column in the scan.
    pub column: u32,
    /// Index of the fragment in the column.
    pub fragment: u16,
    /// Number of fragments of the column.
    pub fragments: u16,
    /// Index in the column of the fragment's first sample.
    pub first_sample: u16,
    /// Where the table was, counts.
    pub table_counts: i32,
    /// Samples of the fragment.
    pub laterals: Laterals,
}

impl ColumnFragment {
    /// Number of samples of the fragment.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.laterals {
            Laterals::Uniform { readings, .. } => readings.len(),
            Laterals::Listed(samples) => samples.len(),
        }
    }

    /// Whether it has no sample. The decoder lets none of these through.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The samples. Laterals beyond the range of their type are held at its end.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        (0..self.len()).filter_map(|i| match &self.laterals {
            Laterals::Uniform {
                first_counts,
                step_counts,
                readings,
            } => readings.get(i).map(|&reading| Sample {
                // The index is below UNIFORM_SAMPLES.
                lateral_counts: first_counts.saturating_add(step_counts.saturating_mul(i as i32)),
                reading,
            }),
            Laterals::Listed(samples) => samples.get(i).copied(),
        })
    }
}

impl Message for ColumnFragment {
    const KIND: u8 = 0xc2;
    const NAME: &'static str = "ColumnFragment";

    fn encode(&self, out: &mut Writer) {
        self.scan_id.put(out);
        self.column.put(out);
        self.fragment.put(out);
        self.fragments.put(out);
        self.first_sample.put(out);
        self.table_counts.put(out);
        // Both layouts hold far fewer than 256 samples.
        let count = self.len() as u8;
        match &self.laterals {
            Laterals::Uniform {
                first_counts,
                step_counts,
                readings,
            } => {
                0_u8.put(out);
                count.put(out);
                first_counts.put(out);
                step_counts.put(out);
                for reading in readings {
                    reading.put(out);
                }
            }
            Laterals::Listed(samples) => {
                1_u8.put(out);
                count.put(out);
                for sample in samples {
                    sample.lateral_counts.put(out);
                    sample.reading.put(out);
                }
            }
        }
    }

    fn decode(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        let scan_id = Wire::get(input)?;
        let column = Wire::get(input)?;
        let fragment: u16 = Wire::get(input)?;
        let fragments: u16 = Wire::get(input)?;
        let first_sample: u16 = Wire::get(input)?;
        let table_counts = Wire::get(input)?;
        let layout = u8::get(input)?;
        let count = u8::get(input)?;
        let end = usize::from(first_sample) + usize::from(count);
        if fragment >= fragments
            || fragments > crate::MAX_COLUMN_FRAGMENTS
            || count == 0
            || end > usize::from(crate::MAX_COLUMN_SAMPLES)
        {
            return Err(MessageError::BadValue);
        }
        let laterals = match layout {
            0 => {
                let first_counts = Wire::get(input)?;
                let step_counts = Wire::get(input)?;
                let mut readings = heapless::Vec::new();
                for _ in 0..count {
                    let reading = Wire::get(input)?;
                    readings.push(reading).map_err(|_| MessageError::BadValue)?;
                }
                Laterals::Uniform {
                    first_counts,
                    step_counts,
                    readings,
                }
            }
            1 => {
                let mut samples = heapless::Vec::new();
                for _ in 0..count {
                    let sample = Sample {
                        lateral_counts: Wire::get(input)?,
                        reading: Wire::get(input)?,
                    };
                    samples.push(sample).map_err(|_| MessageError::BadValue)?;
                }
                Laterals::Listed(samples)
            }
            _ => return Err(MessageError::BadValue),
        };
        Ok(Self {
            scan_id,
            column,
            fragment,
            fragments,
            first_sample,
            table_counts,
            laterals,
        })
    }
}

message! {
    /// The end of a column, sent after its last fragment. A column without samples consists
    /// of this alone.
    ColumnEnd = 0xc3 {
        /// The scan's number.
        scan_id: u16,
        /// Index of the column in the scan.
        column: u32,
        /// Where the table was, counts.
        table_counts: i32,
        /// Number of fragments of the column.
        fragments: u16,
        /// Number of samples of the column.
        samples: u16,
    }
}
