//! What a scanner is to the rest of the program.
//!
//! The trait knows neither ports nor frames, so that a scanner may also be two devices, a
//! motor stage and a profile sensor, behind one implementation.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use scanner_protocol::{Activity, Faults, Identity, ScanPlan};

use crate::error::ScannerError;
use crate::recovery::{InterruptedScan, Pause};

/// A scanner: a table that carries the object past a measuring head.
///
/// All methods block until the device has answered or failed to; each may be called from
/// any thread.
pub trait Scanner: Send + Sync {
    /// Who the device is, what its counts mean, and what it can do.
    ///
    /// # Errors
    /// What keeps the device from being reached.
    fn identify(&self) -> Result<Identity, ScannerError>;

    /// Drives the table to its reference mark, and waits until it is there.
    ///
    /// # Errors
    /// What the device refuses or reports.
    fn home(&self) -> Result<(), ScannerError>;

    /// How the device does now.
    ///
    /// # Errors
    /// What keeps the device from being reached.
    fn status(&self) -> Result<DeviceStatus, ScannerError>;

    /// Starts a scan; its columns come through the stream.
    ///
    /// # Errors
    /// What the device refuses, or [`ScannerError::ScanRunning`].
    fn start_scan(&self, plan: &ScanPlan) -> Result<ScanStream, ScannerError>;

    /// Takes up a scan that the program was in when it last ended: it is paused until its last
    /// columns have been measured again and are as they were. The device need not be there yet.
    /// If a person was waited for, or it has been longer than the laser may go on by itself, it
    /// waits for [`Scanner::resume_scan`].
    ///
    /// # Errors
    /// [`ScannerError::NotTakenUp`] if this scanner cannot do so; [`ScannerError::ScanRunning`].
    fn take_up_scan(&self, scan: InterruptedScan) -> Result<ScanStream, ScannerError> {
        drop(scan);
        Err(ScannerError::NotTakenUp(
            "scans of this scanner do not go on after an interruption".to_owned(),
        ))
    }

    /// Lets a paused scan go on: a person has looked, and says that nothing stands in the way.
    ///
    /// # Errors
    /// [`ScannerError::NothingPaused`].
    fn resume_scan(&self) -> Result<(), ScannerError> {
        Err(ScannerError::NothingPaused)
    }

    /// Stops the running scan between two columns, until [`Scanner::resume_scan`]. One that is
    /// paused already goes on by itself no more; where a person is waited for, nothing changes. The
    /// scanner has closed the scan, and so turned the laser off, when this returns.
    ///
    /// # Errors
    /// [`ScannerError::NothingToPause`]; [`ScannerError::CannotPause`] if the scan could not go on
    /// afterwards, or is just being begun. After any other error the scan is paused, but the device
    /// could not be reached: it stops by itself after its dead-man time.
    fn pause_scan(&self) -> Result<(), ScannerError> {
        Err(ScannerError::CannotPause(
            "scans of this scanner do not go on after a pause".to_owned(),
        ))
    }

    /// Turns the laser off and stops the table at once. A running scan's stream ends with
    /// [`ScannerError::Aborted`], as does whatever else is waited for.
    ///
    /// # Errors
    /// What keeps the device from being reached; it then stops by itself after its dead-man
    /// time.
    fn abort(&self) -> Result<(), ScannerError>;
}

/// How a device does.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceStatus {
    /// What it is at.
    pub activity: Activity,
    /// Whether the table's position is known.
    pub homed: bool,
    /// Whether the laser is on.
    pub laser_on: bool,
    /// Its faults.
    pub faults: Faults,
    /// Where the table is, counts; `None` until homed.
    pub table_counts: Option<i32>,
    /// Temperature of the head, degrees Celsius, if it is measured.
    pub temperature_c: Option<f64>,
    /// Time since the device started (wraps after 49 days).
    pub uptime: Duration,
    /// How the line has been since the connection was made.
    pub line: LineCounts,
}

/// How good a line has been.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Good frames received.
    pub frames: u64,
    /// Damaged frames, and stretches of garbage, received.
    pub bad_frames: u64,
    /// Requests that had to be repeated.
    pub retries: u64,
    /// Requests for missing fragments.
    pub resends: u64,
}

/// What the device said when it accepted a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanInfo {
    /// Columns that will come.
    pub columns: u32,
    /// Nominal distance between neighbouring samples of a column, micrometres.
    pub spacing_um: u32,
    /// Whether laterals within a column are evenly spaced.
    pub uniform: bool,
}

/// One column as measured, in counts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RawColumn {
    /// Index in the scan, from 0.
    pub index: u32,
    /// Where the table was, counts.
    pub table_counts: i32,
    /// The samples with a return, in the order measured.
    pub samples: Vec<RawSample>,
    /// Number of samples without a return; they are not among `samples`.
    pub dropouts: u32,
}

/// One sample as measured, in counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RawSample {
    /// Angle of the ray, or y.
    pub lateral_counts: i32,
    /// Distance along the ray, or z.
    pub range_counts: i32,
    /// Brightness of the returned light.
    pub intensity: u8,
    /// The light was brighter than the head can measure: the range is doubtful.
    pub saturated: bool,
}

/// What comes through a [`ScanStream`]'s channel; the end comes last.
#[derive(Debug)]
pub enum StreamItem {
    /// The next column.
    Column(RawColumn),
    /// The scan has stopped after the last column, or the reason has changed.
    Paused(Pause),
    /// The scan goes on.
    Resumed,
    /// No column will come any more.
    End(Result<(), ScannerError>),
}

/// What a scan brings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScanProgress {
    /// The next column.
    Column(RawColumn),
    /// It has stopped after the last column, or the reason has changed.
    Paused(Pause),
    /// It goes on.
    Resumed,
}

/// What a [`ScanStream`] tells its scanner.
pub trait StreamControl: Send + Sync {
    /// The column is safe.
    fn acknowledge(&self, column: u32);

    /// Nobody wants the rest of the scan.
    fn close(&self);
}

/// The columns of a running scan, in order, each once.
///
/// Columns must be acknowledged (see [`ScanStream::acknowledger`]), or the device stops for
/// want of credit. Dropping the stream ends the scan and turns the laser off.
pub struct ScanStream {
    info: ScanInfo,
    items: Receiver<StreamItem>,
    control: Arc<dyn StreamControl>,
    ended: Option<Result<(), ScannerError>>,
}

impl ScanStream {
    /// A stream over the receiving end of a bounded channel. For implementations of
    /// [`Scanner`].
    #[must_use]
    pub fn new(
        info: ScanInfo,
        items: Receiver<StreamItem>,
        control: Arc<dyn StreamControl>,
    ) -> Self {
        Self {
            info,
            items,
            control,
            ended: None,
        }
    }

    /// What the device said when it accepted the scan.
    #[must_use]
    pub fn info(&self) -> ScanInfo {
        self.info
    }

    /// The next column, pauses passed over; blocks until it is there. `None` is the regular
    /// end.
    ///
    /// # Errors
    /// Why the scan ended early; the same again when called again. Every column that
    /// arrived before comes first.
    #[allow(clippy::should_implement_trait)] // A fallible stream reads better with `?`.
    pub fn next(&mut self) -> Result<Option<RawColumn>, ScannerError> {
        loop {
            match self.next_progress()? {
                Some(ScanProgress::Column(column)) => return Ok(Some(column)),
                Some(ScanProgress::Paused(_) | ScanProgress::Resumed) => {}
                None => return Ok(None),
            }
        }
    }

    /// The next column, or word of a pause; blocks until it is there. `None` is the regular
    /// end.
    ///
    /// # Errors
    /// As [`ScanStream::next`].
    pub fn next_progress(&mut self) -> Result<Option<ScanProgress>, ScannerError> {
        if let Some(end) = &self.ended {
            return end.clone().map(|()| None);
        }
        match self.items.recv() {
            Ok(StreamItem::Column(column)) => Ok(Some(ScanProgress::Column(column))),
            Ok(StreamItem::Paused(pause)) => Ok(Some(ScanProgress::Paused(pause))),
            Ok(StreamItem::Resumed) => Ok(Some(ScanProgress::Resumed)),
            Ok(StreamItem::End(end)) => {
                self.ended = Some(end.clone());
                end.map(|()| None)
            }
            Err(_) => {
                self.ended = Some(Err(ScannerError::Closed));
                Err(ScannerError::Closed)
            }
        }
    }

    /// A handle with which whoever stores the columns says that they are safe.
    #[must_use]
    pub fn acknowledger(&self) -> Acknowledger {
        Acknowledger {
            control: Arc::clone(&self.control),
        }
    }
}

impl Drop for ScanStream {
    fn drop(&mut self) {
        self.control.close();
    }
}

impl std::fmt::Debug for ScanStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ScanStream")
            .field("info", &self.info)
            .field("ended", &self.ended)
            .finish_non_exhaustive()
    }
}

/// Says that columns are safe. Cheap to clone; outlives its stream without harm.
#[derive(Clone)]
pub struct Acknowledger {
    control: Arc<dyn StreamControl>,
}

impl Acknowledger {
    /// The column with this index is on disk: the device may forget it.
    ///
    /// Columns may be acknowledged in any order; the device is told once all earlier ones
    /// are safe as well.
    pub fn acknowledge(&self, column_index: u32) {
        self.control.acknowledge(column_index);
    }
}

impl std::fmt::Debug for Acknowledger {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Acknowledger")
    }
}
