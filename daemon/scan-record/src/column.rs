//! A column in device counts, as the scanner measured it.

use range_image::{Calibration, Column, Sample};

use crate::format::{COLUMN_HEAD_BYTES, Fields, SAMPLE_BYTES};

/// All samples of one table position, in device counts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RawColumn {
    /// Number of the column in its scan, from 0.
    pub index: u32,
    /// Position of the slide table.
    pub table_counts: i32,
    /// Rays that brought no return.
    pub dropouts: u32,
    /// The returns, as the device ordered them.
    pub samples: Vec<RawSample>,
}

/// One return, in device counts; [`Calibration`] says what they mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawSample {
    /// Angle of the ray, or y, as the head has it.
    pub lateral_counts: i32,
    /// Distance along the ray, or z.
    pub range_counts: i32,
    /// Strength of the returned light.
    pub intensity: u8,
    /// The detector was overdriven; the range is less certain.
    pub saturated: bool,
}

const FLAG_SATURATED: u8 = 1;

impl RawColumn {
    /// The column in millimetres of the part frame.
    #[must_use]
    pub fn calibrated(&self, calibration: &Calibration) -> Column {
        let samples = self
            .samples
            .iter()
            .map(|raw| {
                let at =
                    calibration.position(self.table_counts, raw.lateral_counts, raw.range_counts);
                Sample {
                    y_mm: at.y_mm,
                    z_mm: at.z_mm,
                    intensity: raw.intensity,
                }
            })
            .collect();
        Column::new(calibration.x_mm(self.table_counts), samples)
    }

    pub(crate) fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(COLUMN_HEAD_BYTES + self.samples.len() * SAMPLE_BYTES);
        out.extend_from_slice(&self.index.to_le_bytes());
        out.extend_from_slice(&self.table_counts.to_le_bytes());
        out.extend_from_slice(&self.dropouts.to_le_bytes());
        // The writer has refused more than MAX_SAMPLES.
        out.extend_from_slice(&(self.samples.len() as u32).to_le_bytes());
        for sample in &self.samples {
            out.extend_from_slice(&sample.lateral_counts.to_le_bytes());
            out.extend_from_slice(&sample.range_counts.to_le_bytes());
            out.push(sample.intensity);
            out.push(if sample.saturated { FLAG_SATURATED } else { 0 });
        }
    }

    /// `None` when the payload is not exactly one column. Unknown flags are ignored.
    pub(crate) fn decode(payload: &[u8]) -> Option<Self> {
        let mut fields = Fields(payload);
        let (index, table_counts, dropouts) = (fields.u32()?, fields.i32()?, fields.u32()?);
        let count = fields.u32()? as usize;
        if fields.0.len() != count.checked_mul(SAMPLE_BYTES)? {
            return None;
        }
        let mut samples = Vec::with_capacity(count);
        for _ in 0..count {
            samples.push(RawSample {
                lateral_counts: fields.i32()?,
                range_counts: fields.i32()?,
                intensity: fields.u8()?,
                saturated: fields.u8()? & FLAG_SATURATED != 0,
            });
        }
        Some(Self {
            index,
            table_counts,
            dropouts,
            samples,
        })
    }
}
