//! What can go wrong between the host and a scanner, in words for its user.

use std::time::Duration;

use scanner_protocol::{Faults, RejectReason};

/// Why a scanner did not do what was asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScannerError {
    /// There is no such port.
    #[error(
        "there is no port {port}: is the scanner plugged in and switched on? \
         `relief doctor` lists the ports there are"
    )]
    NoSuchPort {
        /// The port's path.
        port: String,
    },
    /// The scanner is not among the USB devices.
    #[error(
        "there is no scanner {wanted} on USB: is it plugged in and switched on? \
         There is: {present}"
    )]
    NotOnUsb {
        /// Numbers, and serial number if one is asked for.
        wanted: String,
        /// What is there instead.
        present: String,
    },
    /// Several USB devices fit.
    #[error(
        "several scanners {wanted} are on USB, with the serial numbers {serials}: \
         say which is meant by its serial number"
    )]
    ManyOnUsb {
        /// Numbers asked for.
        wanted: String,
        /// The serial numbers that are there.
        serials: String,
    },
    /// The USB device has the right numbers, but is no scanner.
    #[error("the USB device {device} is no scanner of ours: {why}")]
    NotAScannerOnUsb {
        /// The device.
        device: String,
        /// What is missing.
        why: String,
    },
    /// A driver or another program has the scanner's interface.
    #[error("the USB scanner {device} is in use by {}", .holder.as_deref().unwrap_or(SOME_PROGRAM))]
    UsbBusy {
        /// The device.
        device: String,
        /// The kernel's driver, or name and process id of the program, where it could be
        /// found out.
        holder: Option<String>,
    },
    /// The USB device may not be used.
    #[error(
        "no permission to use the USB scanner {device}: its file {node} belongs to the group \
         `{group}`; install the udev rules for scanners, plug it in anew, and add the user of \
         this program to the group that they name"
    )]
    UsbPermission {
        /// The device.
        device: String,
        /// Its device file.
        node: String,
        /// The group that may use it, by name or number.
        group: String,
    },
    /// Another program has the port.
    #[error("the port {port} is in use by {}", .holder.as_deref().unwrap_or(SOME_PROGRAM))]
    PortBusy {
        /// The port's path.
        port: String,
        /// Name and process id of the program, where it could be found out.
        holder: Option<String>,
    },
    /// The port may not be opened.
    #[error(
        "no permission to open {port}: it belongs to the group `{group}`; \
         add the user of this program to that group and log in again"
    )]
    Permission {
        /// The port's path.
        port: String,
        /// The group that may open it, by name or number.
        group: String,
    },
    /// The system keeps this program from the port, whatever groups its user is in.
    #[error(
        "the system keeps this program from {port}, whatever its group: where systemd runs it, \
         DeviceAllow= of its unit must name the port's kind, and the unit be started anew"
    )]
    Forbidden {
        /// The port's path.
        port: String,
    },
    /// The path is not a serial port.
    #[error("{port} is not a serial port")]
    NotAPort {
        /// The path.
        port: String,
    },
    /// The operating system refused.
    #[error("{port}: {message}")]
    Port {
        /// The port's path.
        port: String,
        /// What the operating system says.
        message: String,
    },
    /// The scanner is another one than it has to be.
    #[error("the scanner on {place} has the serial number {found}, and not {wanted}")]
    WrongScanner {
        /// Where it is.
        place: String,
        /// What it says.
        found: String,
        /// What it has to say.
        wanted: String,
    },
    /// The driver itself failed.
    #[error("the scanner's driver had a defect, and has begun anew: {what}; please report it")]
    Defect {
        /// What it said.
        what: String,
    },
    /// Something answers, but it is no scanner of ours.
    #[error("{port} answers, but not as a scanner: {heard}")]
    WrongDevice {
        /// The port's path.
        port: String,
        /// What came instead.
        heard: String,
    },
    /// The device speaks other versions of the protocol.
    #[error(
        "the scanner speaks versions {device_min} to {device_max} of the protocol, this program \
         {host_min} to {host_max}: renew the older of the two"
    )]
    Version {
        /// The device's oldest version.
        device_min: u8,
        /// The device's newest version.
        device_max: u8,
        /// This program's oldest version.
        host_min: u8,
        /// This program's newest version.
        host_max: u8,
    },
    /// Nothing came in time.
    #[error("{port}: no {awaited} from the scanner within {} s", .after.as_secs_f64())]
    Timeout {
        /// The port's path.
        port: String,
        /// What was awaited.
        awaited: &'static str,
        /// How long.
        after: Duration,
    },
    /// The device refused a command.
    #[error("the scanner refused to {command}: {reason}{}", detail_text(*.reason, *.detail))]
    Refused {
        /// What it was asked to do.
        command: &'static str,
        /// Why it refused.
        reason: RejectReason,
        /// More about the reason.
        detail: u32,
    },
    /// The device reports faults.
    #[error("the scanner reports: {0}")]
    Fault(Faults),
    /// The connection is gone.
    #[error("lost the connection to the scanner on {port}: {why}")]
    LostConnection {
        /// The port's path.
        port: String,
        /// How it was noticed.
        why: String,
    },
    /// The device started anew on its own: its position is not known any more.
    #[error("the scanner has restarted ({cause}); its table must be homed again")]
    Restarted {
        /// Why, as far as the device said.
        cause: String,
    },
    /// This program itself ended in mid-scan, and was started again.
    #[error("{PROGRAM_ENDED}{}", .before.as_deref().map(before_that).unwrap_or_default())]
    ProgramEnded {
        /// What a person was told before, who has not yet said a word.
        before: Option<String>,
    },
    /// The device stopped because it did not hear from the host in time.
    #[error("the scanner stopped by itself, since it did not hear from this computer in time")]
    DeadMan,
    /// The table stopped on its way, and no fault says why: a greeting that came late over a
    /// line with buffers does that.
    #[error("the scanner's table stopped before it had arrived")]
    Halted,
    /// Somebody pressed stop on the device.
    #[error("the scan was stopped at the scanner")]
    StoppedAtDevice,
    /// A column did not arrive whole however often it was asked for.
    #[error(
        "column {column} did not arrive whole in {attempts} attempts: the line is too bad \
         (cable, baud rate, interference)"
    )]
    ColumnLost {
        /// Index of the column.
        column: u32,
        /// How often it was asked for.
        attempts: u32,
    },
    /// The device breaks the rules of the protocol.
    #[error("the scanner breaks the protocol: {0}")]
    Protocol(String),
    /// What was measured before an interruption is not what is measured after it.
    #[error(
        "the object or the table has moved: what led up to column {column} was measured again, and \
         {how}"
    )]
    Moved {
        /// Index of the last column measured again.
        column: u32,
        /// How it differs, with figures.
        how: String,
    },
    /// Another scanner is there than the one that the scan was begun with.
    #[error("the scan was begun with the scanner {wanted}, and {found} is connected")]
    OtherScanner {
        /// Model and serial number of the right one.
        wanted: String,
        /// Those of the one that is there.
        found: String,
    },
    /// The scanner came back with another calibration.
    #[error("the scanner has been calibrated anew since the scan was begun")]
    OtherCalibration,
    /// A scan that was interrupted earlier cannot be taken up.
    #[error("{0}")]
    NotTakenUp(String),
    /// A person has asked for a pause.
    #[error("paused on request")]
    PausedOnRequest,
    /// No scan runs that could be paused.
    #[error("no scan is running")]
    NothingToPause,
    /// The scan could not go on after a pause, or has not begun yet.
    #[error("the scan cannot be paused: {0}")]
    CannotPause(String),
    /// No scan is paused.
    #[error("no scan is paused")]
    NothingPaused,
    /// A scan runs already.
    #[error("a scan is running already")]
    ScanRunning,
    /// Somebody called for an end.
    #[error("aborted")]
    Aborted,
    /// The settings contradict themselves.
    #[error("{0}")]
    Settings(String),
    /// The driver has been shut down.
    #[error("the scanner's driver has been shut down")]
    Closed,
}

impl ScannerError {
    /// Whether the same may succeed when it is tried again at once: a request that came late
    /// or twice over a bad line, or a device that has just come back.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        matches!(
            self,
            Self::LostConnection { .. }
                | Self::Restarted { .. }
                | Self::DeadMan
                | Self::Halted
                | Self::Timeout { .. }
                | Self::Refused {
                    reason: RejectReason::Busy | RejectReason::NotHomed | RejectReason::NoSession,
                    ..
                }
        )
    }
}

/// A program that this one may not see, as systemd's sandbox has it.
const SOME_PROGRAM: &str = "another program, which `sudo relief doctor` can name";

/// How [`ScannerError::ProgramEnded`] reads.
const PROGRAM_ENDED: &str = "the service ended in mid-scan and has been started again";

/// What follows it.
const BEFORE_THAT: &str = "; before that: ";

/// What was said before the program ended, however often it has done so since.
fn before_that(said: &str) -> String {
    let said = said.rsplit(BEFORE_THAT).next().unwrap_or_default();
    format!("{BEFORE_THAT}{said}")
}

/// What a reject's detail adds for the user.
fn detail_text(reason: RejectReason, detail: u32) -> String {
    match reason {
        RejectReason::TooManyColumns | RejectReason::TooManySamples => {
            format!(" (at most {detail})")
        }
        RejectReason::Faulted => format!(" ({})", Faults(detail)),
        _ => String::new(),
    }
}
