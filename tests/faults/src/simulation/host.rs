//! The host: driver and journal, and the service's way to begin a scan.

use std::time::Duration;

use anyhow::{Result, bail};
use scanner_driver::limits::PROOF_SAMPLES;
use scanner_driver::recovery::{Progress, Recovery};
use scanner_driver::session::{Answer, Command, Event, Session, Ticket};
use scanner_driver::{Pause, ScannerError};
use scanner_protocol::ScanPlan;

use super::surroundings::PAUSE_SOON_S;
use super::{Simulation, Stage};

/// The service's way to begin a scan: home, then scan, and anew so often if the trouble may
/// pass.
const STARTS: u32 = 3;

impl Simulation {
    pub(super) fn host_turn(&mut self) -> Result<()> {
        let shown = self.clock.shows(self.now);
        let pulled = self.device.is_unplugged() && self.conditions.feels_the_plug;
        match &mut self.session {
            None if shown >= self.connect_at && pulled => {
                self.connect_at = shown + self.settings.reconnect_first;
            }
            None if shown >= self.connect_at => {
                let settings = self.settings.clone();
                self.session = Some(Session::new("line", settings, self.next_tag, shown));
            }
            None => {}
            Some(session) => {
                if pulled {
                    session.lose(ScannerError::LostConnection {
                        port: "line".into(),
                        why: "unplugged".into(),
                    });
                }
                let bytes = self.line.for_host(self.now);
                if bytes.is_empty() {
                    session.poll(shown);
                } else {
                    session.receive(&bytes, shown);
                }
            }
        }
        self.reach_the_disk();
        self.look_after_it();
        self.pause_on_request();
        self.begin();
        self.events()?;
        if let Some(scan) = &mut self.scan {
            scan.poll(self.session.as_mut(), shown);
        }
        self.progress()?;
        if let Some(session) = &mut self.session {
            let bytes = session.take_output();
            if !self.device.is_unplugged() {
                self.line.host_says(&bytes, self.now);
            }
        }
        Ok(())
    }

    /// When the host has something to do next, by the simulation's time.
    pub(super) fn host_due(&self) -> Vec<Option<Duration>> {
        let session = self.session.as_ref().and_then(Session::deadline);
        let connect = self.session.is_none().then_some(self.connect_at);
        let scan = self.scan.as_ref().and_then(Recovery::deadline);
        let by_its_clock = [session, connect, scan];
        let mut times: Vec<Option<Duration>> = by_its_clock
            .into_iter()
            .map(|due| due.map(|shown| self.clock.time(shown)))
            .collect();
        times.push(self.line.due_for_host());
        times.push(self.person_at);
        times.push(self.pause_at);
        times.extend(self.disk.iter().map(|(time, _)| Some(*time)));
        times
    }

    fn begin(&mut self) {
        let shown = self.clock.shows(self.now);
        let Some(session) = self.session.as_mut().filter(|s| s.is_ready()) else {
            return;
        };
        let command = match (self.stage, &self.identity) {
            (Stage::Home(None), _) => Command::Home,
            (Stage::Scan(None), Some(identity)) => Command::Scan(identity.limits.proposed),
            _ => return,
        };
        self.tickets += 1;
        let ticket = Ticket(self.tickets);
        self.stage = match self.stage {
            Stage::Home(_) => Stage::Home(Some(ticket)),
            _ => Stage::Scan(Some(ticket)),
        };
        session.command(ticket, command, shown);
    }

    fn events(&mut self) -> Result<()> {
        let shown = self.clock.shows(self.now);
        while let Some(event) = self.session.as_mut().and_then(Session::next_event) {
            let event = match &mut self.scan {
                Some(scan) => scan.event(event, shown),
                None => Some(event),
            };
            match event {
                Some(Event::Ready(identity)) => self.identity = Some(identity),
                Some(Event::Finished(ticket, result)) => self.finished(ticket, result)?,
                Some(Event::Lost(_)) => {
                    let lost = self.session.take();
                    self.next_tag = lost.map_or(self.next_tag, |lost| lost.next_tag());
                    self.line.hang_up();
                    self.connect_at = shown + self.settings.reconnect_first;
                }
                Some(Event::Column(_) | Event::ScanOver(_)) | None => {}
            }
        }
        Ok(())
    }

    fn finished(&mut self, ticket: Ticket, result: Result<Answer, ScannerError>) -> Result<()> {
        match (self.stage, result) {
            (Stage::Home(Some(ours)), Ok(_)) if ours == ticket => self.stage = Stage::Scan(None),
            (Stage::Scan(Some(ours)), Ok(Answer::Scan(info))) if ours == ticket => {
                let Some(identity) = self.identity.clone() else {
                    bail!("a scan without a device");
                };
                let plan: ScanPlan = identity.limits.proposed;
                self.columns = info.columns;
                self.begun = self.now;
                self.stage = Stage::Columns;
                self.scan = Some(Recovery::begun(
                    self.settings.resume.clone(),
                    identity,
                    plan,
                    info,
                    self.clock.shows(self.now),
                ));
            }
            (Stage::Home(Some(ours)) | Stage::Scan(Some(ours)), Err(error)) if ours == ticket => {
                self.starts += 1;
                if self.starts >= STARTS || !error.may_pass() {
                    self.end(Err(error));
                } else {
                    self.stage = Stage::Home(None);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn progress(&mut self) -> Result<()> {
        while let Some(progress) = self.scan.as_mut().and_then(Recovery::next_progress) {
            match progress {
                Progress::Column(column) => {
                    if self.samples < PROOF_SAMPLES
                        && let Some(stood_mm) = self.stood_mm.get(&column.index)
                    {
                        self.stands_mm = *stood_mm;
                        self.moved_before_it_was_seen |= stood_mm.length() > 0.0;
                    }
                    self.visits = 0;
                    self.samples += column.samples.len();
                    self.hand_to_the_disk(column.index);
                    if let Some(journal) = &mut self.journal {
                        journal.append(column)?;
                    }
                    self.risk_the_host();
                    self.risk_a_pause(self.conditions.pause, PAUSE_SOON_S);
                }
                Progress::Paused(pause) => self.paused(pause),
                Progress::Resumed => {
                    self.person_at = None;
                    let words = format!("goes on [{:?}]", self.part_offset_mm());
                    self.told.push((self.now, words));
                }
                Progress::Over(result) => self.end(result),
            }
        }
        Ok(())
    }

    fn paused(&mut self, pause: Pause) {
        let words = format!(
            "after {} columns: {pause} [the object stands at {:?}]",
            pause.columns,
            self.part_offset_mm()
        );
        self.told.push((self.now, words));
        let asked = self.asked_since.unwrap_or(self.now);
        self.asked_since = pause.needs_person.then_some(asked);
        if pause.needs_person {
            self.call_the_person();
            self.attended.push(pause);
        }
        self.pauses += 1;
    }

    fn end(&mut self, result: Result<(), ScannerError>) {
        self.complete = result.is_ok();
        self.error = result.err();
        self.ended = self.now;
        self.stage = Stage::Done;
    }
}
