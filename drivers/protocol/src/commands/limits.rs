//! Asking what the device can do.

use crate::commands::ScanPlan;
use crate::message::Request;
use crate::wire::message;

message! {
    /// Asks for the [`Limits`].
    GetLimits = 0x04 {}
}

message! {
    /// What the device can do. All bounds are inclusive.
    Limits = 0x84 {
        /// Lowest table position, counts.
        table_min_counts: i32,
        /// Highest table position, counts.
        table_max_counts: i32,
        /// Lowest lateral (angle, or y for Cartesian heads), counts.
        lateral_min_counts: i32,
        /// Highest lateral, counts.
        lateral_max_counts: i32,
        /// Columns per second at best, thousandths of a hertz; 0 if not known.
        max_line_rate_millihz: u32,
        /// Most columns in a scan.
        max_columns: u32,
        /// Most samples in a column.
        max_samples: u16,
        /// Columns the device keeps for resending: it is never granted more than this
        /// many beyond those acknowledged. At least 1.
        max_credits: u16,
        /// Shortest exposure, microseconds.
        min_exposure_us: u32,
        /// Longest exposure, microseconds.
        max_exposure_us: u32,
        /// Shortest dead-man time, milliseconds.
        min_dead_man_ms: u16,
        /// Longest dead-man time, milliseconds.
        max_dead_man_ms: u16,
        /// A scan of all that the device has in view, at its own pace and pitch: what a host
        /// asks for that has no wishes.
        proposed: ScanPlan,
    }
}

impl Request for GetLimits {
    type Reply = Limits;
}
