//! Going on with a scan that the service was in when it last ended.

use std::io::Read;
use std::path::Path;
use std::time::Duration;

use scan_record::{Continuation, EndCause, JournalReader, JournalWriter, most_bytes};

use super::columns::measured;
use super::heading::interrupted;
use super::keep::Keeper;
use super::live::Live;
use super::onlookers::Onlookers;
use super::presence::since_boot;
use super::run::{Failure, Ticket};
use crate::liveness::Pulse;
use crate::service::Service;

/// Columns that may be behind the last sound record of a journal whose writing was cut short: as
/// many as may be written between two syncs.
const UNSYNCED_COLUMNS: u32 = 1_024;

/// What the journal of a scan that was cut short says about the rest.
#[derive(Debug, Clone)]
pub(crate) struct Rest {
    /// Columns that the scan is to have.
    pub(crate) columns: u32,
    /// Most samples of a column.
    pub(crate) samples: u16,
    /// Where the journal goes on.
    pub(crate) continuation: Continuation,
}

impl Rest {
    /// What is missing in a journal whose columns have all been read.
    ///
    /// # Errors
    /// In words, why it cannot be gone on with.
    pub(crate) fn of<R: Read>(reader: &JournalReader<R>, path: &Path) -> Result<Self, String> {
        let (scan, plan) = interrupted(reader.header())
            .ok_or("its journal does not say enough about the scanner")?;
        let continuation = reader
            .continuation()
            .ok_or("its journal has not been read to its end")?;
        let bytes = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
        let behind = bytes.saturating_sub(continuation.at_byte());
        // A torn end is cut off, and what was in it measured again. More than that is no torn end.
        if behind > most_bytes(UNSYNCED_COLUMNS, plan.samples.into()) {
            return Err(format!(
                "its journal is damaged long before its end, {behind} bytes of it"
            ));
        }
        Ok(Self {
            columns: scan.info().columns,
            samples: plan.samples,
            continuation,
        })
    }
}

/// How a scan is taken up.
#[derive(Debug)]
pub(crate) struct TakeUp {
    /// When it was last seen to go on by itself, by [`since_boot`], if nobody has to be asked.
    pub(crate) seen: Option<Duration>,
    /// Why a person has to say that it may go on, however short the silence.
    pub(crate) waits_for: Option<String>,
    /// With a live range image: not if that may be what ends the service.
    pub(crate) live: bool,
}

/// Takes the rest of the scan.
pub(super) fn take_up(
    service: &Service,
    ticket: &Ticket,
    how: &TakeUp,
    pulse: &Pulse,
) -> Result<(), Failure> {
    let id = ticket.scan.id.as_str();
    let path = service.journal_path(id);
    let not = |why: &dyn std::fmt::Display| Failure::not_taken_up(&why.to_string());
    let mut reader = JournalReader::open(&path).map_err(|error| not(&error))?;
    let header = reader.header().clone();
    let (mut scan, plan) =
        interrupted(&header).ok_or_else(|| not(&"its journal says too little"))?;
    let mut live = if how.live {
        Live::new(service, id, &ticket.processing, &header, &plan)
    } else {
        Live::none(service, id)
    };
    while let Some(column) = reader.next_column().map_err(|error| not(&error))? {
        pulse.beat();
        if ticket.abort.reason().is_none() {
            live.push(column.calibrated(&header.calibration));
        }
        scan.add(measured(column)).map_err(|error| not(&error))?;
    }
    let continuation = reader
        .continuation()
        .ok_or_else(|| not(&"its journal has an end"))?;
    drop(reader);
    let journal = JournalWriter::continue_on(&*service.disk, &path, continuation);
    let mut journal = journal.map_err(|error| not(&error))?;
    let abort = || ticket.abort.reason();
    if let Some(reason) = abort() {
        return aborted(journal, reason);
    }
    journal
        .reserve(
            scan.info().columns.saturating_sub(scan.columns()),
            plan.samples.into(),
        )
        .map_err(|error| not(&error))?;
    tracing::info!(
        scan = id,
        scanner = ticket.station.name(),
        columns = scan.columns(),
        waits_for = how.waits_for,
        "a scan is taken up that was cut short when the service last ended"
    );
    scan.silent = how
        .seen
        .map_or(Duration::MAX, |seen| since_boot().saturating_sub(seen));
    scan.waits_for.clone_from(&how.waits_for);
    let scanner = &ticket.station.scanner;
    let stream = scanner.take_up_scan(scan).map_err(|error| not(&error))?;
    // An abort that came before there was a stream has found nothing to stop; one that comes from
    // now on stops the scanner. Dropped, the stream turns the laser off.
    if let Some(reason) = abort() {
        drop(stream);
        return aborted(journal, reason);
    }
    let station = &*ticket.station;
    let onlookers = Onlookers::new(service, station, id, header.calibration, live);
    Ok(Keeper::new(service, ticket, journal).keep_all(stream, onlookers, pulse)?)
}

/// Ends a scan that nobody wants any more, before it has gone on.
fn aborted(journal: JournalWriter, reason: String) -> Result<(), Failure> {
    match journal.finish(&EndCause::Aborted(reason.clone())) {
        Ok(_) => Err(Failure::from(reason)),
        Err(error) => Err(Failure::from(error.to_string())),
    }
}
