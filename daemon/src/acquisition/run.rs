//! One scan from its start to its end.
//!
//! ```text
//! driver --> feed thread --> bounded channel --> this thread: journal, sync,
//!                                                acknowledge, regrid, tell
//! ```
//!
//! Everything behind the channel may block for a moment without the scanner noticing;
//! when it blocks for longer, the scanner's credit runs out and the table waits.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Instant;

use range_image::{Calibration, Column, GridColumn};
use regrid::Regridder;
use relief_api::{Event, LiveColumn, Scan, ScanState, ScannerLink};
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample};
use scanner_driver::{Pause, ScanProgress, ScanStream, Scanner, ScannerError};
use scanner_protocol::Identity;

use super::grid_file::GridFile;
use super::plan::ResolvedPlan;
use super::{AbortRequest, calibration};
use crate::config::{JournalConfig, Processing};
use crate::error::panic_text;
use crate::fit::Fit;
use crate::liveness::Pulse;
use crate::service::{KeptGrid, Service};
use crate::space::Promise;
use crate::station::Station;

/// How often a scan is begun: a line that loses words may need more than one attempt.
const START_ATTEMPTS: u32 = 3;

/// Columns between the driver and the journal.
const CHANNEL_COLUMNS: usize = 64;

/// Everything a scan needs to know at its start.
pub(crate) struct Ticket {
    pub(crate) station: Arc<Station>,
    pub(crate) scan: Scan,
    pub(crate) plan: ResolvedPlan,
    pub(crate) identity: Identity,
    pub(crate) processing: Processing,
    /// Room on the disk for its columns.
    pub(crate) room: Promise,
    pub(crate) abort: Arc<AbortRequest>,
}

/// Takes the scan, keeps it, and queues its job. Never fails: what goes wrong becomes the
/// scan's state.
pub(crate) fn run(service: &Arc<Service>, ticket: Ticket) {
    let id = ticket.scan.id.clone();
    let station = Arc::clone(&ticket.station);
    let pulse = service.liveness.begin(station.loop_name("scan"));
    // A defect in the taking of one scan must not keep the scanner busy for ever. What the
    // panic passes on its way drops the stream, which turns the laser off.
    let outcome = despite_defects(|| take(service, &ticket, &pulse));
    let (state, reason) = match (outcome, ticket.abort.reason()) {
        (Ok(()), _) => (ScanState::Complete, None),
        (Err(_), Some(reason)) => (ScanState::Aborted, Some(reason)),
        (Err(problem), None) => (ScanState::Failed, Some(problem)),
    };
    match &reason {
        None => tracing::info!(scan = %id, "scan complete"),
        Some(reason) => {
            tracing::warn!(scan = %id, state = state.as_str(), %reason, "scan ended early")
        }
    }
    // What it did not take is free for the next scan, which may begin once this one has ended.
    drop(ticket.room);
    service.end_scan(&station, &id, state, reason);
}

/// What this gives, or that it had a defect.
fn despite_defects<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        Err(format!(
            "the scan ended unexpectedly: {}; this is a defect of the program, please report it",
            panic_text(&*panic)
        ))
    })
}

/// The text of an error is the scan's reason.
fn take(service: &Arc<Service>, ticket: &Ticket, pulse: &Pulse) -> Result<(), String> {
    let station = &*ticket.station;
    pulse.work(station.longest_wait);
    let text = |error: ScannerError| error.to_string();
    let check_abort = || match ticket.abort.reason() {
        Some(reason) => Err(reason),
        None => Ok(()),
    };
    let scanner = &*station.scanner;
    check_abort()?;
    let mut attempts = 1;
    let stream = loop {
        match begin(scanner, ticket) {
            Ok(stream) => break stream,
            Err(error) if error.may_pass() && attempts < START_ATTEMPTS => {
                tracing::warn!(scan = %ticket.scan.id, %error, "the scan is begun anew");
                attempts += 1;
            }
            Err(error) => return Err(text(error)),
        }
        check_abort()?;
        pulse.beat();
    };
    // Once more: an abort that came just before the start found nothing to stop. Dropping
    // the stream turns the laser off.
    check_abort()?;
    let info = stream.info();
    tracing::info!(
        scan = %ticket.scan.id,
        scanner = station.name(),
        columns = info.columns,
        "scan begins"
    );
    service.note_scanner(station, ScannerLink::Scanning, None);
    let scan = station.update_active(|scan| {
        scan.columns_planned = info.columns;
        scan.state = ScanState::Scanning;
    });
    if let Some(scan) = scan {
        service.keep_scan(&scan).map_err(|e| e.to_string())?;
    }
    let header = header(ticket, f64::from(info.spacing_um) * 1e-3);
    // Dropped on the way out if there is no place to keep its columns, the stream itself
    // turns the laser off.
    Keeper::new(service, ticket, &header)?.keep_all(stream, pulse)
}

/// Homes the table if need be, and starts.
fn begin(scanner: &dyn Scanner, ticket: &Ticket) -> Result<ScanStream, ScannerError> {
    if !scanner.status()?.homed {
        scanner.home()?;
    }
    if ticket.abort.reason().is_some() {
        return Err(ScannerError::Aborted);
    }
    scanner.start_scan(&ticket.plan.plan)
}

/// What stands at the head of the journal.
fn header(ticket: &Ticket, sample_spacing_mm: f64) -> Header {
    let identity = &ticket.identity;
    let plan = &ticket.plan.plan;
    let json = |value: &serde_json::Value| value.to_string().into_bytes();
    Header {
        calibration: calibration(identity),
        column_pitch_mm: ticket.plan.column_pitch_mm,
        sample_spacing_mm,
        identity: json(&serde_json::json!({
            "model": identity.model.as_str(),
            "serial": identity.serial.as_str(),
            "firmware": identity.firmware.as_str(),
        })),
        plan: json(&serde_json::json!({
            "first_table_counts": plan.first_table_counts,
            "pitch_counts": plan.pitch_counts,
            "columns": plan.columns,
            "first_angle_counts": plan.first_angle_counts,
            "angle_step_counts": plan.angle_step_counts,
            "samples": plan.samples,
            "exposure_us": plan.exposure_us,
        })),
        // These types serialise to JSON whatever they hold.
        settings: serde_json::to_vec(&ticket.processing).unwrap_or_default(),
        metadata: serde_json::to_vec(&ticket.scan).unwrap_or_default(),
    }
}

/// What a column meets on its way.
struct Keeper<'a> {
    service: &'a Service,
    station: &'a Station,
    id: &'a str,
    abort: &'a AbortRequest,
    policy: JournalConfig,
    calibration: Calibration,
    journal: JournalWriter,
    live: Option<Live>,
}

/// The regridding that runs along; a scan is kept even when this fails.
struct Live {
    regridder: Regridder,
    fit: Fit,
    grid: KeptGrid,
    file: GridFile,
}

impl Live {
    /// The grid columns that this column finished.
    fn push(&mut self, column: Column) -> Result<Vec<GridColumn>, String> {
        self.fit.add(&column);
        if self.fit.is_missed() {
            let (problem, hint) = self.fit.told().unwrap_or_default();
            return Err(format!("{problem}; {hint}"));
        }
        let finished = self.regridder.push(column).map_err(|e| e.to_string())?;
        for column in &finished {
            self.file.append(column).map_err(|e| e.to_string())?;
        }
        Ok(finished)
    }
}

enum Fed {
    Column(RawColumn),
    /// The scan stands still, for this reason.
    Paused(Pause),
    Resumed,
    End(Result<(), ScannerError>),
}

impl<'a> Keeper<'a> {
    fn new(service: &'a Service, ticket: &'a Ticket, header: &Header) -> Result<Self, String> {
        let id = ticket.scan.id.as_str();
        let path = service.journal_path(id);
        let journal = JournalWriter::create_on(&*service.disk, &path, header)
            .and_then(|mut journal| {
                journal.reserve(ticket.plan.plan.columns, ticket.plan.plan.samples.into())?;
                Ok(journal)
            })
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let settings = ticket
            .processing
            .pipeline_settings(header.column_pitch_mm, header.sample_spacing_mm)
            .regrid;
        let plan = &ticket.plan.plan;
        let most_samples = plan.columns as usize * usize::from(plan.samples);
        let live = Regridder::new(settings)
            .map_err(|error| error.to_string())
            .and_then(|regridder| {
                Ok(Live {
                    regridder,
                    fit: Fit::new(&settings, most_samples),
                    file: GridFile::create(&service.grid_path(id)).map_err(|e| e.to_string())?,
                    grid: KeptGrid { settings },
                })
            })
            .inspect_err(|problem| tracing::warn!(scan = id, %problem, "no live range image"))
            .ok();
        Ok(Self {
            service,
            station: &ticket.station,
            id,
            abort: &ticket.abort,
            policy: service.config().journal,
            calibration: header.calibration,
            journal,
            live,
        })
    }

    fn keep_all(mut self, stream: ScanStream, pulse: &Pulse) -> Result<(), String> {
        let (service, station) = (self.service, self.station);
        let acknowledger = stream.acknowledger();
        let (sender, receiver) = sync_channel(CHANNEL_COLUMNS);
        let result = std::thread::scope(|scope| {
            let feeder = std::thread::Builder::new()
                .name(station.loop_name("scan-feed"))
                .spawn_scoped(scope, move || feed(service, station, stream, &sender))
                .map_err(|error| format!("cannot start a thread: {error}"))?;
            // The feeder has the stream: unless it is told of a defect here, too, it waits for
            // columns for which nobody acknowledges those before.
            let acknowledge = |index| acknowledger.acknowledge(index);
            let result = despite_defects(|| self.drain(&receiver, pulse, &acknowledge));
            // With the receiver gone the feeder ends at its next column; an abort wakes a
            // feeder that waits for one.
            drop(receiver);
            if result.is_err()
                && !feeder.is_finished()
                && let Err(error) = station.scanner.abort()
            {
                tracing::warn!(%error, "cannot tell the scanner to stop");
            }
            result
        });
        let cause = match (&result, self.abort.reason()) {
            (Ok(()), _) => EndCause::Complete,
            (Err(_), Some(reason)) => EndCause::Aborted(reason),
            (Err(problem), None) => EndCause::Fault(problem.clone()),
        };
        let closed = self.journal.finish(&cause).map_err(|e| e.to_string());
        let result = result.and(closed.map(drop));
        if let Some(live) = self.live.take() {
            finish_live(self.service, self.id, live, result.is_ok());
        }
        result
    }

    /// Keeps column after column until the end. One sync serves all columns that came
    /// while the one before was under way, or within the configured interval.
    fn drain(
        &mut self,
        receiver: &Receiver<Fed>,
        pulse: &Pulse,
        acknowledge: &dyn Fn(u32),
    ) -> Result<(), String> {
        let mut batch: Vec<RawColumn> = Vec::new();
        let mut due = Instant::now();
        loop {
            let fed = if batch.is_empty() {
                pulse.rest();
                receiver.recv().map_err(|_| RecvTimeoutError::Disconnected)
            } else {
                receiver.recv_timeout(due.saturating_duration_since(Instant::now()))
            };
            pulse.work(self.station.longest_wait);
            match fed {
                Ok(Fed::Column(column)) => {
                    if batch.is_empty() {
                        due = Instant::now() + self.policy.interval();
                    }
                    self.journal.append(&column).map_err(|e| e.to_string())?;
                    batch.push(column);
                    if batch.len() >= self.policy.sync_columns as usize {
                        self.commit(&mut batch, acknowledge)?;
                    }
                }
                Ok(Fed::Paused(pause)) => {
                    self.commit(&mut batch, acknowledge)?;
                    let reason = pause.to_string();
                    tracing::warn!(scan = self.id, %reason, "scan paused");
                    self.station.laser.scan_paused(&reason);
                    self.note_pause(Some(reason), pause.needs_person);
                }
                Ok(Fed::Resumed) => {
                    self.commit(&mut batch, acknowledge)?;
                    tracing::info!(scan = self.id, "scan goes on");
                    self.station.laser.scan_goes_on();
                    self.note_pause(None, false);
                }
                Ok(Fed::End(end)) => {
                    self.commit(&mut batch, acknowledge)?;
                    return end.map_err(|e| e.to_string());
                }
                Err(RecvTimeoutError::Timeout) => self.commit(&mut batch, acknowledge)?,
                Err(RecvTimeoutError::Disconnected) => {
                    self.commit(&mut batch, acknowledge)?;
                    return Err("the scanner's driver ended without a word".into());
                }
            }
        }
    }

    /// Tells all who look on that the scan stands still, or goes on.
    fn note_pause(&self, reason: Option<String>, needs_person: bool) {
        let (state, link) = match reason {
            Some(_) => (ScanState::Paused, ScannerLink::Trouble),
            None => (ScanState::Scanning, ScannerLink::Scanning),
        };
        self.service
            .note_scanner(self.station, link, reason.clone());
        let scan = self.station.update_active(|scan| {
            scan.state = state;
            scan.reason = reason;
        });
        // The record of a pause is for those who look; the columns do not hang on it.
        let kept = scan.map(|scan| {
            if needs_person {
                self.service.keep_scan_telling(&scan)
            } else {
                self.service.keep_scan(&scan)
            }
        });
        if let Some(Err(error)) = kept {
            tracing::error!(scan = self.id, %error, "cannot keep the record of a scan");
        }
    }

    /// Syncs, and only then acknowledges and passes on.
    fn commit(
        &mut self,
        batch: &mut Vec<RawColumn>,
        acknowledge: &dyn Fn(u32),
    ) -> Result<(), String> {
        if batch.is_empty() {
            return Ok(());
        }
        self.journal.sync().map_err(|e| e.to_string())?;
        for column in batch.iter() {
            acknowledge(column.index);
        }
        let before = self.journal.columns() - batch.len() as u32;
        for (column, kept) in batch.drain(..).zip(before + 1..) {
            let scan = self.station.update_active(|scan| scan.columns = kept);
            let columns_planned = scan.map_or(0, |scan| scan.columns_planned);
            let live = self.regrid(&column);
            if self.service.hub.has_listeners() {
                self.service.hub.tell(Event::Column {
                    scan: self.id.to_owned(),
                    scanner: self.station.name().to_owned(),
                    columns: kept,
                    columns_planned,
                    samples: column.samples.len() as u32,
                    x_mm: self.calibration.x_mm(column.table_counts),
                    pitch_mm: self
                        .live
                        .as_ref()
                        .map_or(0.0, |live| live.grid.settings.pitch_mm),
                    live,
                });
            }
        }
        Ok(())
    }

    /// The grid columns that this column finished, for showing.
    fn regrid(&mut self, column: &RawColumn) -> Vec<LiveColumn> {
        let Some(live) = &mut self.live else {
            return Vec::new();
        };
        match live.push(column.calibrated(&self.calibration)) {
            Ok(finished) => finished
                .iter()
                .map(|column| LiveColumn::new(column.i, column.j_first, &column.z_mm))
                .collect(),
            Err(problem) => {
                // The job regrids from the journal and reports what is wrong.
                tracing::warn!(scan = self.id, %problem, "the live range image ends here");
                self.live = None;
                self.service.forget_grid(self.id);
                Vec::new()
            }
        }
    }
}

/// Puts the rest of the grid aside for the job, or forgets it for a scan without one.
fn finish_live(service: &Service, id: &str, mut live: Live, wanted: bool) {
    let path = service.grid_path(id);
    let rest = live.regridder.finish();
    let written = rest
        .iter()
        .try_for_each(|column| live.file.append(column))
        .and_then(|()| live.file.finish());
    match written {
        Ok(()) if wanted => service.keep_grid(id, live.grid),
        _ => service.forget_grid(id),
    }
    tracing::debug!(scan = id, grid = %path.display(), wanted, "live range image finished");
}

/// Moves columns from the driver to the channel until either ends.
fn feed(service: &Service, station: &Station, mut stream: ScanStream, sender: &SyncSender<Fed>) {
    let pulse = service.liveness.begin(station.loop_name("scan-feed"));
    let mut paused = false;
    loop {
        // The driver answers in time, if only with an error; a pause lasts as long as it does.
        if paused {
            pulse.rest();
        } else {
            pulse.work(station.longest_wait);
        }
        let fed = match stream.next_progress() {
            Ok(Some(ScanProgress::Column(column))) => Fed::Column(raw(column)),
            Ok(Some(ScanProgress::Paused(pause))) => {
                paused = true;
                Fed::Paused(pause)
            }
            Ok(Some(ScanProgress::Resumed)) => {
                paused = false;
                Fed::Resumed
            }
            Ok(None) => Fed::End(Ok(())),
            Err(error) => Fed::End(Err(error)),
        };
        let last = matches!(fed, Fed::End(_));
        // The journal may take its time: then the table waits.
        pulse.rest();
        if sender.send(fed).is_err() || last {
            return;
        }
    }
}

/// The driver's column as the journal keeps it.
fn raw(column: scanner_driver::RawColumn) -> RawColumn {
    RawColumn {
        index: column.index,
        table_counts: column.table_counts,
        dropouts: column.dropouts,
        samples: column
            .samples
            .into_iter()
            .map(|sample| RawSample {
                lateral_counts: sample.lateral_counts,
                range_counts: sample.range_counts,
                intensity: sample.intensity,
                saturated: sample.saturated,
            })
            .collect(),
    }
}
