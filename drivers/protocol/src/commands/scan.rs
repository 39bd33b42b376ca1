//! Starting a scan, and taking one up again.

use crate::message::Request;
use crate::wire::{MessageError, Reader, Wire, Writer, message};

/// Where to measure. Column `k` stands at `first_table_counts + k * pitch_counts`; sample
/// `i` of it at `first_angle_counts + i * angle_step_counts`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanPlan {
    /// Table position of the first column, counts.
    pub first_table_counts: i32,
    /// Travel from column to column, counts; negative scans backwards. Not 0.
    pub pitch_counts: i32,
    /// Number of columns. Not 0.
    pub columns: u32,
    /// Angle (lateral) of the first sample, counts.
    pub first_angle_counts: i32,
    /// Angle (lateral) from sample to sample, counts. Not 0.
    pub angle_step_counts: i32,
    /// Number of samples in a column. Not 0.
    pub samples: u16,
    /// Exposure of a sample, microseconds; 0 leaves it to the device.
    pub exposure_us: u32,
}

impl Wire for ScanPlan {
    fn put(&self, out: &mut Writer) {
        self.first_table_counts.put(out);
        self.pitch_counts.put(out);
        self.columns.put(out);
        self.first_angle_counts.put(out);
        self.angle_step_counts.put(out);
        self.samples.put(out);
        self.exposure_us.put(out);
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        Ok(Self {
            first_table_counts: Wire::get(input)?,
            pitch_counts: Wire::get(input)?,
            columns: Wire::get(input)?,
            first_angle_counts: Wire::get(input)?,
            angle_step_counts: Wire::get(input)?,
            samples: Wire::get(input)?,
            exposure_us: Wire::get(input)?,
        })
    }
}

message! {
    /// Starts a scan.
    Scan = 0x09 {
        /// The host's number for this scan; every message about it carries it, so that
        /// late frames of an earlier scan are told apart.
        scan_id: u16,
        /// Columns that may be sent before the first [`crate::commands::Grant`].
        credits: u16,
        /// Where to measure.
        plan: ScanPlan,
    }
}

message! {
    /// The scan begins. The device drives to the first column and turns the laser on.
    ScanAccepted = 0x89 {
        /// The scan's number.
        scan_id: u16,
        /// Columns that will come; a device that plays a recording may have its own number.
        columns: u32,
        /// Nominal distance between neighbouring samples of a column, micrometres.
        spacing_um: u32,
        /// Whether laterals within a column are evenly spaced.
        uniform: bool,
    }
}

impl Request for Scan {
    type Reply = ScanAccepted;
}

message! {
    /// Takes an interrupted scan up again, from one of its columns on. Columns keep the
    /// indices that they have in the plan.
    Continue = 0x0d {
        /// The host's number for what follows: another than before, so that late frames of
        /// what went before are told apart.
        scan_id: u16,
        /// Columns from `first_column` on that may be sent before the first
        /// [`crate::commands::Grant`].
        credits: u16,
        /// Index of the first column to measure: below the plan's number of columns.
        first_column: u32,
        /// Where to measure: the plan that the scan was begun with.
        plan: ScanPlan,
    }
}

message! {
    /// The scan goes on. The device drives to that column and turns the laser on.
    ScanContinued = 0x8d {
        /// The scan's number.
        scan_id: u16,
        /// Columns of the whole scan, as [`ScanAccepted`] had it.
        columns: u32,
        /// Nominal distance between neighbouring samples of a column, micrometres.
        spacing_um: u32,
        /// Whether laterals within a column are evenly spaced.
        uniform: bool,
    }
}

impl Request for Continue {
    type Reply = ScanContinued;
}
