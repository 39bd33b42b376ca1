//! What the device tells.

mod banner;
mod column;
mod scan_end;
mod status;

pub use banner::{Banner, ResetCause};
pub use column::{
    ColumnEnd, ColumnFragment, LISTED_SAMPLES, Laterals, Reading, Sample, UNIFORM_SAMPLES,
};
pub use scan_end::{ScanEnd, ScanEndReason};
pub use status::{Activity, Status, StatusChanged};
