//! Keeping a scan's columns, and passing them on.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Instant;

use relief_api::{ScanState, ScannerLink};
use scan_record::{EndCause, JournalWriter, RawColumn};
use scanner_driver::ScanStream;

use super::AbortRequest;
use super::feed::{Fed, feed};
use super::onlookers::{Onlookers, Shown};
use super::run::{Ticket, despite_defects};
use crate::config::JournalConfig;
use crate::liveness::Pulse;
use crate::service::Service;
use crate::station::Station;

/// Columns between the driver and the journal.
const CHANNEL_COLUMNS: usize = 64;

/// Where columns go while they are kept.
struct Ways<'a> {
    pulse: &'a Pulse,
    acknowledge: &'a dyn Fn(u32),
    shown: SyncSender<Shown>,
}

impl Ways<'_> {
    /// Waits until all that is kept is shown: a pause is told behind the columns before it.
    fn catch_up(&self) {
        let (sender, shown) = sync_channel(1);
        if self.shown.send(Shown::Awaited(sender)).is_ok() {
            self.pulse.rest();
            // An error is the end of those who show.
            let _ = shown.recv();
        }
    }
}

/// What a column meets on its way.
pub(super) struct Keeper<'a> {
    service: &'a Service,
    station: &'a Station,
    id: &'a str,
    abort: &'a AbortRequest,
    policy: JournalConfig,
    journal: JournalWriter,
}

impl<'a> Keeper<'a> {
    /// One that keeps the columns behind those that are in the journal.
    pub(super) fn new(service: &'a Service, ticket: &'a Ticket, journal: JournalWriter) -> Self {
        Self {
            service,
            station: &ticket.station,
            id: &ticket.scan.id,
            abort: &ticket.abort,
            policy: service.config().journal,
            journal,
        }
    }

    /// Keeps all that comes, to the end, and has those who look on shown what is kept.
    pub(super) fn keep_all(
        mut self,
        stream: ScanStream,
        mut onlookers: Onlookers<'_>,
        pulse: &Pulse,
    ) -> Result<(), String> {
        let (service, station) = (self.service, self.station);
        let acknowledger = stream.acknowledger();
        let (sender, receiver) = sync_channel(CHANNEL_COLUMNS);
        let (shown, to_show) = sync_channel(CHANNEL_COLUMNS);
        let result = std::thread::scope(|scope| {
            let thread = |name| std::thread::Builder::new().name(station.loop_name(name));
            let refused = |error| format!("cannot start a thread: {error}");
            let onlookers = &mut onlookers;
            thread("scan-live")
                .spawn_scoped(scope, move || onlookers.show_all(&to_show))
                .map_err(refused)?;
            let feeder = thread("scan-feed")
                .spawn_scoped(scope, move || feed(service, station, stream, &sender))
                .map_err(refused)?;
            // The feeder has the stream: unless it is told of a defect here, too, it waits for
            // columns for which nobody acknowledges those before.
            let acknowledge = |index| acknowledger.acknowledge(index);
            let ways = Ways {
                pulse,
                acknowledge: &acknowledge,
                shown,
            };
            let result = despite_defects(|| self.drain(&receiver, &ways));
            // With the receiver gone the feeder ends at its next column; an abort wakes a
            // feeder that waits for one. With the sender gone all is shown that will be.
            drop(receiver);
            drop(ways);
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
        if result.is_ok() {
            onlookers.finish();
        }
        result
    }

    /// Keeps column after column until the end. One sync serves all columns that came
    /// while the one before was under way, or within the configured interval.
    fn drain(&mut self, receiver: &Receiver<Fed>, ways: &Ways<'_>) -> Result<(), String> {
        let pulse = ways.pulse;
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
                        self.commit(&mut batch, ways)?;
                    }
                }
                Ok(Fed::Paused {
                    reason,
                    needs_person,
                    on_request,
                }) => {
                    self.commit(&mut batch, ways)?;
                    if on_request {
                        tracing::info!(scan = self.id, %reason, "scan paused");
                    } else {
                        tracing::warn!(scan = self.id, %reason, "scan paused");
                    }
                    self.station.laser.scan_paused(&reason);
                    if needs_person {
                        self.abort.presence.withdraw();
                    } else {
                        // Somebody has been asked, and has said that it may go on.
                        self.abort.presence.restore();
                    }
                    ways.catch_up();
                    self.note_pause(Some(reason), needs_person, on_request);
                }
                Ok(Fed::Resumed) => {
                    self.commit(&mut batch, ways)?;
                    tracing::info!(scan = self.id, "scan goes on");
                    self.station.laser.scan_goes_on();
                    self.abort.presence.restore();
                    self.note_pause(None, false, false);
                    // Of a scan that was taken up nobody has asked yet; the scanner has said it.
                    if self.station.status().model.is_none()
                        && let Ok(identity) = self.station.identify()
                    {
                        self.station.note_identity(&identity);
                    }
                }
                Ok(Fed::End(end)) => {
                    self.commit(&mut batch, ways)?;
                    return end.map_err(|e| e.to_string());
                }
                Err(RecvTimeoutError::Timeout) => self.commit(&mut batch, ways)?,
                Err(RecvTimeoutError::Disconnected) => {
                    self.commit(&mut batch, ways)?;
                    return Err("the scanner's driver ended without a word".into());
                }
            }
        }
    }

    /// Tells all who look on that the scan stands still, or goes on. A pause on request is no
    /// trouble, and no webhook is told of it: whoever asked for it knows.
    fn note_pause(&self, reason: Option<String>, needs_person: bool, on_request: bool) {
        let state = match reason {
            Some(_) => ScanState::Paused,
            None => ScanState::Scanning,
        };
        let trouble = reason.clone().filter(|_| !on_request);
        let link = match trouble {
            Some(_) => ScannerLink::Trouble,
            None => ScannerLink::Scanning,
        };
        self.service.note_scanner(self.station, link, trouble);
        let scan = self.station.update_active(|scan| {
            scan.state = state;
            scan.reason = reason;
            scan.needs_person = needs_person;
        });
        // The record of a pause is for those who look; the columns do not hang on it.
        let kept = scan.map(|scan| {
            if needs_person && !on_request {
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
    fn commit(&mut self, batch: &mut Vec<RawColumn>, ways: &Ways<'_>) -> Result<(), String> {
        if batch.is_empty() {
            return Ok(());
        }
        self.journal.sync().map_err(|e| e.to_string())?;
        self.abort.presence.beat();
        for column in batch.iter() {
            (ways.acknowledge)(column.index);
        }
        let before = self.journal.columns() - batch.len() as u32;
        // Where showing takes longer than measuring, the table waits in the end.
        ways.pulse.rest();
        let metrics = &self.service.metrics;
        for (column, kept) in batch.drain(..).zip(before + 1..) {
            metrics.column_kept(self.station.name(), column.samples.len(), column.dropouts);
            self.station.update_active(|scan| scan.columns = kept);
            // Those who show have ended only for a defect, which they have told of.
            let _ = ways.shown.send(Shown::Column { column, kept });
        }
        ways.pulse.work(self.station.longest_wait);
        Ok(())
    }
}
