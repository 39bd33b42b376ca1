//! What the host asks for, a command a file, each with its typed reply.

mod abort;
mod calibration;
mod clear_faults;
mod close_scan;
mod grant;
mod heartbeat;
mod hello;
mod home;
mod identify;
mod laser;
mod limits;
mod move_table;
mod rejected;
mod resend;
mod scan;

pub use abort::{Abort, Aborted};
pub use calibration::{Calibration, GetCalibration, Head};
pub use clear_faults::{ClearFaults, ClearNamed, FaultsCleared, NamedCleared};
pub use close_scan::{CloseScan, ScanClosed};
pub use grant::Grant;
pub use heartbeat::Heartbeat;
pub use hello::{Hello, HelloReply};
pub use home::{Home, HomeStarted};
pub use identify::{Identify, Nameplate};
pub use laser::{LaserSet, SetLaser};
pub use limits::{GetLimits, Limits};
pub use move_table::{Move, MoveStarted};
pub use rejected::{RejectReason, Rejected};
pub use resend::{Missing, RESEND_BITMAP, Resend};
pub use scan::{Continue, Scan, ScanAccepted, ScanContinued, ScanPlan};
