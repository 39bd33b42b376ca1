//! Taking up what an earlier run left, and what the disk refused to keep.

mod cut_short;

use std::fs;
use std::path::Path;

use relief_api::{Event, JobState, Scan, ScanState, WebhookEvent};
use scan_record::{EndCause, Ending, JournalReader, JournalWriter};

use crate::acquisition::Rest;
use crate::error::ServiceError;
use crate::ids::now;
use crate::service::{Service, lock};

pub(crate) use cut_short::CutShort;

/// What a journal tells of its scan, whatever became of the service meanwhile.
#[derive(Debug)]
struct Found {
    /// The record as it stood when the scan began; none if it cannot be read.
    begun: Option<Scan>,
    columns: u32,
    state: ScanState,
    reason: Option<String>,
    /// What is missing of a scan that was cut short, or why it cannot be gone on with.
    rest: Result<Rest, String>,
}

impl Found {
    fn in_journal(path: &Path) -> Self {
        let interrupted = |begun, columns, what: String, rest| Self {
            begun,
            columns,
            state: ScanState::Interrupted,
            reason: Some(format!("the service ended during the scan ({what})")),
            rest,
        };
        let mut reader = match JournalReader::open(path) {
            Ok(reader) => reader,
            Err(error) => {
                let rest = Err("there is nothing to go on from".to_owned());
                return interrupted(None, 0, error.to_string(), rest);
            }
        };
        let begun = serde_json::from_slice(&reader.header().metadata).ok();
        let failed = loop {
            match reader.next_column() {
                Ok(Some(_)) => {}
                Ok(None) => break None,
                Err(error) => break Some(error.to_string()),
            }
        };
        let columns = reader.columns();
        let (state, reason) = match reader.ending() {
            Some(Ending::Closed(EndCause::Complete)) => (ScanState::Complete, None),
            Some(Ending::Closed(EndCause::Aborted(by))) => (ScanState::Aborted, Some(by.clone())),
            Some(Ending::Closed(EndCause::Fault(what))) => (ScanState::Failed, Some(what.clone())),
            Some(damaged) => {
                let rest = Rest::of(&reader, path);
                return interrupted(begun, columns, damaged.to_string(), rest);
            }
            None => {
                let rest = Err("its journal cannot be read".to_owned());
                return interrupted(begun, columns, failed.unwrap_or_default(), rest);
            }
        };
        Self {
            begun,
            columns,
            state,
            reason,
            rest: Err("it has its end".to_owned()),
        }
    }

    /// The scan as it ended.
    fn end(self, scan: &mut Scan) {
        scan.columns = self.columns;
        scan.state = self.state;
        scan.reason = self.reason;
        scan.needs_person = false;
        scan.ended_at = Some(now());
    }
}

impl Service {
    /// What the journal of a scan tells. One that has all its columns and no end gets its end.
    fn found(&self, scan: &str) -> Found {
        let path = self.journal_path(scan);
        let mut found = Found::in_journal(&path);
        if let Ok(rest) = &found.rest
            && found.columns == rest.columns
        {
            let ended = JournalWriter::continue_on(&*self.disk, &path, rest.continuation)
                .and_then(|journal| journal.finish(&EndCause::Complete));
            match ended {
                Ok(_) => (found.state, found.reason) = (ScanState::Complete, None),
                Err(error) => found.rest = Err(error.to_string()),
            }
        }
        found
    }

    /// After a restart: notes how scans ended that were under way, and what was kept of
    /// them. One that had its last column is complete, and is processed. Gives those that can
    /// be gone on with.
    pub(crate) fn recover_scans(&self) -> Result<Vec<CutShort>, ServiceError> {
        let mut cut_short = Vec::new();
        for mut scan in self.store.scans()? {
            if scan.state.is_over() {
                continue;
            }
            let mut found = self.found(&scan.id);
            if found.state == ScanState::Interrupted {
                match self.may_go_on(&scan, &found) {
                    Ok(rest) => {
                        cut_short.push(rest);
                        continue;
                    }
                    Err(why) => {
                        let what = found.reason.take().unwrap_or_default();
                        found.reason = Some(format!("{what}, and it does not go on: {why}"));
                    }
                }
            }
            found.end(&mut scan);
            self.give_back_room(&scan.id);
            if scan.state == ScanState::Complete {
                tracing::info!(scan = %scan.id, "a scan was complete when the service last ended");
            } else {
                tracing::warn!(
                    scan = %scan.id,
                    columns = scan.columns,
                    "a scan was cut short when the service last ended"
                );
            }
            self.keep_ended(&mut scan)?;
        }
        self.forget_presences(&cut_short);
        Ok(cut_short)
    }

    /// After a restart: makes records of scans that have none, from their journals. That is
    /// so where the records were damaged, or a journal was put back from elsewhere.
    pub(crate) fn adopt_journals(&self) -> Result<(), ServiceError> {
        let mut names = Vec::new();
        for entry in fs::read_dir(self.scans_dir()).into_iter().flatten() {
            let Ok(entry) = entry else { continue };
            let name = entry.file_name().to_string_lossy().into_owned();
            if let Some(id) = name.strip_suffix(".scan") {
                names.push(id.to_owned());
            }
        }
        names.sort();
        for id in names {
            if self.store.scan(&id)?.is_some() {
                continue;
            }
            let mut found = self.found(&id);
            let Some(mut scan) = found.begun.take().filter(|scan| scan.id == id) else {
                tracing::error!(
                    journal = %self.journal_path(&id).display(),
                    reason = found.reason.unwrap_or_default(),
                    "a journal has no record, and none can be made of it: `relief convert` may \
                     still read it"
                );
                continue;
            };
            // What the header says of jobs and settings is of the scan's beginning.
            scan.jobs.clear();
            found.end(&mut scan);
            self.give_back_room(&scan.id);
            tracing::warn!(
                scan = %scan.id,
                columns = scan.columns,
                state = scan.state.as_str(),
                "the record of a scan was made anew from its journal"
            );
            self.keep_adopted(&mut scan)?;
        }
        Ok(())
    }

    /// Gives back what was set aside for the rest of a scan that was cut short.
    pub(crate) fn give_back_room(&self, scan: &str) {
        let path = self.journal_path(scan);
        // One that is not there is not to be made.
        let cut =
            fs::metadata(&path).and_then(|metadata| self.disk.open(&path)?.set_len(metadata.len()));
        if let Err(error) = cut {
            tracing::warn!(scan, %error, "cannot give back the room set aside for a scan");
        }
    }

    /// Keeps the record of a scan that is over, with its job if it is complete. Where the
    /// result is in the spool already, the job is found to be done. Webhooks are told.
    pub(crate) fn keep_ended(&self, scan: &mut Scan) -> Result<(), ServiceError> {
        let event = WebhookEvent::ScanEnded;
        if scan.state == ScanState::Complete && scan.jobs.is_empty() {
            let tell = |scan: &Scan| self.receivers.of_scan(event, scan);
            self.queue_first_job(scan, tell).map(drop)
        } else {
            Ok(self.put_scan_telling(scan, event)?)
        }
    }

    /// The same of a scan that ended long ago, of which nobody is told.
    fn keep_adopted(&self, scan: &mut Scan) -> Result<(), ServiceError> {
        if scan.state == ScanState::Complete && scan.jobs.is_empty() {
            self.queue_first_job(scan, |_| Vec::new()).map(drop)
        } else {
            Ok(self.store.put_scan(scan)?)
        }
    }

    /// Tries again what the disk refused to keep.
    pub(crate) fn keep_unkept(&self) {
        // While this works on them, nobody finds them missing.
        let unkept = lock(&self.unkept).clone();
        for mut scan in unkept {
            match self.keep_ended(&mut scan) {
                Ok(()) => {
                    lock(&self.unkept).retain(|other| other.id != scan.id);
                    tracing::info!(scan = %scan.id, "the record of a scan is kept at last");
                    self.hub.tell(Event::Scan(scan));
                }
                Err(error) => {
                    tracing::debug!(scan = %scan.id, %error, "the record of a scan is still not kept");
                }
            }
        }
    }

    /// After a restart: queues what waited or was under way, and notes as done what was
    /// published just before the service ended.
    pub(crate) fn recover_jobs(&self) -> Result<(), ServiceError> {
        for mut job in self.store.jobs()? {
            if job.state.is_over() {
                continue;
            }
            // The spool's names were synced when it was opened.
            if self.spool.has(&job.result) {
                self.queue.remove(job.id);
                job.state = JobState::Done;
                job.cut_short = 0;
                job.stage = None;
                job.ended_at = Some(now());
                job.directory = Some(self.spool.directory(&job.result).display().to_string());
                self.put_job(&job)?;
                continue;
            }
            if job.state == JobState::Running {
                self.take_up_job(&mut job)?;
            } else {
                self.queue.add(self.order_of(&job));
            }
        }
        Ok(())
    }
}
