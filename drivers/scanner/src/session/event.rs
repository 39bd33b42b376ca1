//! What goes into a session and what comes out, besides bytes.

use scanner_protocol::{Faults, Identity, ScanPlan};

use crate::error::ScannerError;
use crate::scanner::{DeviceStatus, RawColumn, ScanInfo};

/// Ties a command to its outcome. Chosen by whoever gives the command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Ticket(pub u64);

/// What a session is asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Ask for the status.
    Status,
    /// Home the table and wait for it.
    Home,
    /// Home the table for a scan that is to go on. Of the faults that need a person only those
    /// are cleared that one has `attended` to.
    HomeAgain {
        /// What a person has seen to.
        attended: Faults,
    },
    /// Move the table to a position in counts and wait for it.
    Move(i32),
    /// Switch the laser.
    Laser(bool),
    /// Clear those of these faults whose cause is gone.
    ClearFaults(Faults),
    /// Start a scan.
    Scan(ScanPlan),
    /// Stop everything.
    Abort,
}

/// A command's good outcome.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// It has been done.
    Done,
    /// The status asked for.
    Status(DeviceStatus),
    /// The scan has been accepted.
    Scan(ScanInfo),
}

/// What a session tells.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The device has identified itself; commands are carried out from now on.
    Ready(Box<Identity>),
    /// A command is done or has failed.
    Finished(Ticket, Result<Answer, ScannerError>),
    /// The next column of the scan.
    Column(RawColumn),
    /// The scan has ended; no further columns come.
    ScanOver(Result<(), ScannerError>),
    /// The session cannot go on; the transport should be opened anew.
    Lost(ScannerError),
}
