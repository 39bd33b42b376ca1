//! A scanner behind a transport: a thread that owns the transport, and its handle.

mod attached;
mod backoff;
mod clock;
mod stream;
mod worker;

pub use attached::{SerialScanner, UsbScanner};

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use scanner_protocol::{Faults, Identity, ScanPlan};

use crate::error::ScannerError;
use crate::recovery::InterruptedScan;
use crate::scanner::{DeviceStatus, ScanInfo, ScanStream, Scanner, StreamControl, StreamItem};
use crate::session::{Answer, Command};
use crate::settings::LinkSettings;
use crate::transport::Connector;

/// Calls that may wait for the device's thread. It takes them every few milliseconds.
const WAITING_CALLS: usize = 64;

/// What the device's thread is told.
enum Call {
    Do(Command, SyncSender<Result<Outcome, ScannerError>>),
    Identify(SyncSender<Result<Outcome, ScannerError>>),
    Acknowledge(ScanNumber, u32),
    CloseScan(ScanNumber),
    Resume(SyncSender<Result<Outcome, ScannerError>>),
    Pause(SyncSender<Result<Outcome, ScannerError>>),
    TakeUp(
        Box<InterruptedScan>,
        SyncSender<Result<Outcome, ScannerError>>,
    ),
    Shutdown,
}

/// What a call comes to.
enum Outcome {
    Done,
    Status(DeviceStatus),
    Identity(Box<Identity>),
    Scan(ScanInfo, ScanNumber, Receiver<StreamItem>),
}

/// Tells scans of one driver apart, so that a late acknowledgement never counts for
/// another scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ScanNumber(u64);

/// A scanner behind any transport.
///
/// A thread of its own owns the transport. It connects at once, and again with growing
/// pauses whenever the connection is lost; a call made meanwhile has it try at once.
/// Dropping this turns the laser off and stops the table.
pub struct LinkScanner {
    calls: SyncSender<Call>,
    thread: Option<JoinHandle<()>>,
}

impl LinkScanner {
    /// Starts the thread. Whether the device can be reached shows with the first call.
    ///
    /// # Errors
    /// [`ScannerError::Settings`] if the settings contradict themselves, or no thread can
    /// be had.
    pub fn start(
        connector: impl Connector + 'static,
        settings: LinkSettings,
    ) -> Result<Self, ScannerError> {
        settings.validate()?;
        let (calls, inbox) = sync_channel(WAITING_CALLS);
        let thread = std::thread::Builder::new()
            .name("scanner".to_owned())
            .spawn(move || worker::Worker::new(Box::new(connector), settings, inbox).run())
            .map_err(|error| {
                ScannerError::Settings(format!("cannot start the scanner's thread: {error}"))
            })?;
        Ok(Self {
            calls,
            thread: Some(thread),
        })
    }

    /// Moves the table to a position and waits until it is there.
    ///
    /// # Errors
    /// What the device refuses or reports.
    pub fn move_table(&self, table_counts: i32) -> Result<(), ScannerError> {
        self.run(Command::Move(table_counts)).map(|_| ())
    }

    /// Switches the laser by hand, as for adjustment. A scan switches it by itself.
    ///
    /// # Errors
    /// What the device refuses or reports.
    pub fn set_laser(&self, on: bool) -> Result<(), ScannerError> {
        self.run(Command::Laser(on)).map(|_| ())
    }

    /// Clears those of these faults whose cause is gone. A device of version 1 of the protocol
    /// clears all such faults.
    ///
    /// # Errors
    /// [`ScannerError::Fault`] with those that remain.
    pub fn clear_faults(&self, faults: Faults) -> Result<(), ScannerError> {
        self.run(Command::ClearFaults(faults)).map(|_| ())
    }

    fn run(&self, command: Command) -> Result<Outcome, ScannerError> {
        self.call(|reply| Call::Do(command, reply))
    }

    fn stream(&self, outcome: Outcome) -> Result<ScanStream, ScannerError> {
        match outcome {
            Outcome::Scan(info, number, items) => {
                let control = StreamEnd {
                    number,
                    calls: self.calls.clone(),
                };
                Ok(ScanStream::new(info, items, Arc::new(control)))
            }
            _ => Err(ScannerError::Closed),
        }
    }

    fn call(
        &self,
        call: impl FnOnce(SyncSender<Result<Outcome, ScannerError>>) -> Call,
    ) -> Result<Outcome, ScannerError> {
        let (reply, outcome) = sync_channel(1);
        self.calls
            .send(call(reply))
            .map_err(|_| ScannerError::Closed)?;
        outcome.recv().map_err(|_| ScannerError::Closed)?
    }
}

impl Scanner for LinkScanner {
    fn identify(&self) -> Result<Identity, ScannerError> {
        match self.call(Call::Identify)? {
            Outcome::Identity(identity) => Ok(*identity),
            _ => Err(ScannerError::Closed),
        }
    }

    fn home(&self) -> Result<(), ScannerError> {
        self.run(Command::Home).map(|_| ())
    }

    fn status(&self) -> Result<DeviceStatus, ScannerError> {
        match self.run(Command::Status)? {
            Outcome::Status(status) => Ok(status),
            _ => Err(ScannerError::Closed),
        }
    }

    fn start_scan(&self, plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
        self.stream(self.run(Command::Scan(*plan))?)
    }

    fn take_up_scan(&self, scan: InterruptedScan) -> Result<ScanStream, ScannerError> {
        let scan = Box::new(scan);
        self.stream(self.call(|reply| Call::TakeUp(scan, reply))?)
    }

    fn resume_scan(&self) -> Result<(), ScannerError> {
        self.call(Call::Resume).map(|_| ())
    }

    fn pause_scan(&self) -> Result<(), ScannerError> {
        self.call(Call::Pause).map(|_| ())
    }

    fn abort(&self) -> Result<(), ScannerError> {
        self.run(Command::Abort).map(|_| ())
    }
}

impl Drop for LinkScanner {
    fn drop(&mut self) {
        // The thread may have ended already; then there is nothing to stop.
        let _ = self.calls.send(Call::Shutdown);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl std::fmt::Debug for LinkScanner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("LinkScanner")
    }
}

/// A stream's way back to the device's thread.
struct StreamEnd {
    number: ScanNumber,
    calls: SyncSender<Call>,
}

impl StreamControl for StreamEnd {
    fn acknowledge(&self, column: u32) {
        // Without the thread there is no device to tell.
        let _ = self.calls.send(Call::Acknowledge(self.number, column));
    }

    fn close(&self) {
        let _ = self.calls.send(Call::CloseScan(self.number));
    }
}

impl From<Answer> for Outcome {
    fn from(answer: Answer) -> Self {
        match answer {
            Answer::Done => Self::Done,
            Answer::Status(status) => Self::Status(status),
            // The thread makes the stream itself; see `Worker::event`.
            Answer::Scan(_) => Self::Done,
        }
    }
}
