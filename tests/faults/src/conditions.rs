//! What a scan is to suffer, and how it went.

use std::time::Duration;

use scanner_driver::{Pause, ScannerError};
use sim_scanner::fault::{FaultSpec, Strikes};

/// What a scan is to suffer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Conditions {
    /// Seed of all that is drawn.
    pub seed: u64,
    /// Faults of line and device.
    pub faults: FaultSpec,
    /// What goes wrong with the host.
    pub host: HostFaults,
    /// A person pauses the scan, at this rate per column.
    pub pause: f64,
    /// The person at first lets the scan go on without having put anything right.
    pub careless: bool,
    /// Both ends see at once that the cable is out, as on USB; otherwise bytes are lost.
    pub feels_the_plug: bool,
}

/// What goes wrong with the host, at rates per column that it is handed.
#[derive(Debug, Clone, Copy, Default)]
pub struct HostFaults {
    /// It does nothing for up to 20 s.
    pub sleep: f64,
    /// It does nothing for longer than the laser may stay off without a person's word: at
    /// least 16 minutes, at most an hour.
    pub long_sleep: f64,
    /// Its clock leaps ahead by 1 s to 400 s; every other time that of the device does so
    /// with it, as where both are in a machine that is suspended.
    pub clock_jump: f64,
}

/// The host does nothing for a while, as a computer that sleeps.
pub const HOST_SLEEP: &str = "host-sleep";

/// The host sleeps for so long that a person must look.
pub const LONG_SLEEP: &str = "long-sleep";

/// Clocks jump: the device's, the host's, or both.
pub const CLOCK_JUMP: &str = "clock-jump";

/// A person pauses the scan.
pub const PAUSE: &str = "pause";

/// How a scan went.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The journal, if every column is in it.
    pub journal: Option<Vec<u8>>,
    /// Why it ended otherwise.
    pub error: Option<ScannerError>,
    /// The object was moved before enough of it was measured for anybody to notice: it was
    /// measured where it stood then, or cannot be put back since it was measured in two places.
    pub moved_before_it_was_seen: bool,
    /// How often which fault struck, from the start of the simulation to its end.
    pub strikes: Strikes,
    /// The pauses that a person had to end.
    pub attended: Vec<Pause>,
    /// All pauses, by whoever ended them.
    pub pauses: u32,
    /// What was told of pauses, and when since the start.
    pub told: Vec<(Duration, String)>,
    /// Columns measured, those measured again included.
    pub measured: u64,
    /// Columns of the scan.
    pub columns: u32,
    /// Simulated time from the scan's start to its end.
    pub took: Duration,
}
