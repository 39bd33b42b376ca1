//! One scan from its start to its end.
//!
//! ```text
//! driver --> feed thread --> bounded channel --> this thread: journal, sync, acknowledge
//!                --> bounded channel --> live thread: regrid, tell
//! ```
//!
//! Everything behind the channels may block for a moment without the scanner noticing;
//! when it blocks for longer, the scanner's credit runs out and the table waits.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use jiff::Timestamp;
use relief_api::{Scan, ScanState, ScannerLink};
use scan_record::JournalWriter;
use scanner_driver::{ScanStream, Scanner, ScannerError};
use scanner_protocol::{Identity, ScanPlan};

use super::AbortRequest;
use super::heading::header;
use super::keep::Keeper;
use super::live::Live;
use super::onlookers::Onlookers;
use super::plan::ResolvedPlan;
use super::taken_up::{TakeUp, take_up};
use crate::calibration::InForce;
use crate::config::Processing;
use crate::error::panic_text;
use crate::liveness::Pulse;
use crate::service::Service;
use crate::space::Promise;
use crate::station::Station;

/// How often a scan is begun: a line that loses words may need more than one attempt.
const START_ATTEMPTS: u32 = 3;

/// Everything a scan needs to know at its start.
pub(crate) struct Ticket {
    pub(crate) station: Arc<Station>,
    pub(crate) scan: Scan,
    pub(crate) task: Task,
    pub(crate) processing: Processing,
    /// Room on the disk for its columns.
    pub(crate) room: Promise,
    pub(crate) abort: Arc<AbortRequest>,
}

/// What is to be done of it.
pub(crate) enum Task {
    /// All of it.
    Begin {
        plan: ResolvedPlan,
        identity: Box<Identity>,
    },
    /// What the service has left undone when it last ended.
    TakeUp(TakeUp),
}

/// How a scan ends that is not complete, unless it was aborted.
pub(super) struct Failure {
    state: ScanState,
    reason: String,
}

impl Failure {
    /// It is left as the end of the service left it.
    pub(super) fn not_taken_up(why: &str) -> Self {
        Self {
            state: ScanState::Interrupted,
            reason: not_taken_up(why),
        }
    }
}

impl From<String> for Failure {
    fn from(reason: String) -> Self {
        Self {
            state: ScanState::Failed,
            reason,
        }
    }
}

/// Why a scan is left as the end of the service left it.
pub(crate) fn not_taken_up(why: &str) -> String {
    format!("the service ended during the scan, which was not gone on with: {why}")
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
        (Err(failure), None) => (failure.state, Some(failure.reason)),
    };
    match &reason {
        None => tracing::info!(scan = %id, "scan complete"),
        Some(reason) => {
            tracing::warn!(scan = %id, state = state.as_str(), %reason, "scan ended early")
        }
    }
    if state != ScanState::Complete {
        // Where its journal has got no end, it keeps what was set aside for the rest.
        service.give_back_room(&id);
    }
    ticket.abort.presence.end();
    // What it did not take is free for the next scan, which may begin once this one has ended.
    drop(ticket.room);
    service.end_scan(&station, &id, state, reason);
}

/// What this gives, or that it had a defect.
pub(super) fn despite_defects<T, E: From<String>>(
    work: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        Err(E::from(format!(
            "the scan ended unexpectedly: {}; this is a defect of the program, please report it",
            panic_text(&*panic)
        )))
    })
}

fn take(service: &Arc<Service>, ticket: &Ticket, pulse: &Pulse) -> Result<(), Failure> {
    pulse.work(ticket.station.longest_wait);
    match &ticket.task {
        Task::Begin { plan, identity } => Ok(take_all(service, ticket, plan, identity, pulse)?),
        Task::TakeUp(how) => take_up(service, ticket, how, pulse),
    }
}

/// Takes a scan from its beginning. The text of an error is the scan's reason.
fn take_all(
    service: &Arc<Service>,
    ticket: &Ticket,
    plan: &ResolvedPlan,
    identity: &Identity,
    pulse: &Pulse,
) -> Result<(), String> {
    let station = &*ticket.station;
    let text = |error: ScannerError| error.to_string();
    let check_abort = || match ticket.abort.reason() {
        Some(reason) => Err(reason),
        None => Ok(()),
    };
    let scanner = &*station.scanner;
    check_abort()?;
    let mut attempts = 1;
    let stream = loop {
        match begin(scanner, &plan.plan, &ticket.abort) {
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
    ticket.abort.presence.beat();
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
    let calibration = station.calibration(identity).map_err(|e| e.to_string())?;
    let overdue = |own: &InForce| own.overdue(Timestamp::now());
    if let Some(told) = station.calibration.as_deref().and_then(overdue) {
        tracing::warn!(scan = %ticket.scan.id, scanner = station.name(), "{told}");
    }
    let mut header = header(&ticket.scan, &ticket.processing, identity, plan, info);
    header.calibration = calibration;
    if let Some(own) = &station.calibration {
        header.correction = serde_json::to_vec(own).unwrap_or_default();
    }
    // Dropped on the way out if there is no place to keep its columns, the stream itself
    // turns the laser off.
    let id = ticket.scan.id.as_str();
    let path = service.journal_path(id);
    let journal = JournalWriter::create_on(&*service.disk, &path, &header)
        .and_then(|mut journal| {
            journal.reserve(plan.plan.columns, plan.plan.samples.into())?;
            Ok(journal)
        })
        .map_err(|error| format!("{}: {error}", path.display()))?;
    let live = Live::new(service, id, &ticket.processing, &header, &plan.plan);
    let onlookers = Onlookers::new(service, station, id, header.calibration, live);
    Keeper::new(service, ticket, journal).keep_all(stream, onlookers, pulse)
}

/// Homes the table if need be, and starts.
fn begin(
    scanner: &dyn Scanner,
    plan: &ScanPlan,
    abort: &AbortRequest,
) -> Result<ScanStream, ScannerError> {
    if !scanner.status()?.homed {
        scanner.home()?;
    }
    if abort.reason().is_some() {
        return Err(ScannerError::Aborted);
    }
    scanner.start_scan(plan)
}
