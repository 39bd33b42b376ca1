//! What is shown, as the service told it.

use std::collections::VecDeque;

use relief_api::{
    Event, Job, JobId, JobState, LaserEntry, LaserState, Scan, ScannerStatus, ScannerSummary,
    Status,
};

use super::keys::Question;
use super::link::Word;
use super::picture::Picture;
use super::rate::Rate;
use crate::command::watch::plain;
use crate::output;

/// Most lines of the log, results and jobs that are kept.
const MOST: usize = 50;

/// A moment.
#[derive(Debug, Clone, Default)]
pub(super) struct Now {
    /// Seconds since the start.
    pub(super) s: f64,
    /// The time of day.
    pub(super) clock: String,
}

/// A scanner, and what it is at.
#[derive(Debug)]
pub(super) struct Station {
    pub(super) status: ScannerStatus,
    pub(super) laser: Option<LaserEntry>,
    /// The scan under way, or the last that was.
    pub(super) scan: Option<Scan>,
    pub(super) picture: Picture,
    pub(super) rate: Rate,
    /// The scan that picture and rate are of.
    pictured: String,
    /// Returns in the last column, and where it was, millimetres.
    pub(super) last_column: Option<(u32, f64)>,
}

/// A job, and how far its stage is.
#[derive(Debug)]
pub(super) struct Work {
    pub(super) job: Job,
    pub(super) stage: Option<(String, f64)>,
}

/// The line to the service.
#[derive(Debug, Default)]
pub(super) enum Line {
    /// Nothing was heard yet.
    #[default]
    New,
    /// It is there.
    There,
    /// It is gone since then, and why.
    Gone { since_s: f64, why: String },
}

/// A line of the log.
#[derive(Debug)]
pub(super) struct Told {
    pub(super) clock: String,
    pub(super) text: String,
    pub(super) is_bad: bool,
}

/// Everything that is shown.
#[derive(Debug, Default)]
pub(super) struct Board {
    pub(super) line: Line,
    pub(super) service: Option<Status>,
    pub(super) stations: Vec<Station>,
    chosen: usize,
    /// Newest first.
    pub(super) works: Vec<Work>,
    /// Newest first.
    pub(super) published: VecDeque<String>,
    /// Newest last.
    pub(super) log: VecDeque<Told>,
    pub(super) question: Option<Question>,
    /// What came of the last key.
    pub(super) note: Option<Result<String, String>>,
    pub(super) shows_help: bool,
}

impl Board {
    /// The scanner that is shown in full.
    pub(super) fn selected(&self) -> Option<&Station> {
        self.stations.get(self.chosen)
    }

    /// Its place in the list.
    pub(super) fn chosen(&self) -> usize {
        self.chosen
    }

    pub(super) fn select_next(&mut self, by: isize) {
        let number = self.stations.len().max(1) as isize;
        self.chosen = (self.chosen as isize + by).rem_euclid(number) as usize;
    }

    /// Since when what is shown is old, seconds; `None` while it is not.
    pub(super) fn stale_s(&self, now: &Now) -> Option<f64> {
        match &self.line {
            Line::Gone { since_s, .. } => Some((now.s - since_s).max(0.0)),
            _ => None,
        }
    }

    /// Takes in what was heard.
    pub(super) fn hear(&mut self, word: Word, now: &Now) {
        match word {
            Word::Connected => {
                let was_gone = matches!(self.line, Line::Gone { .. });
                self.line = Line::There;
                let again = if was_gone { " again" } else { "" };
                self.tell(now, format!("connected to the service{again}"), false);
            }
            Word::Lost(why) => {
                let since_s = match &self.line {
                    Line::Gone { since_s, .. } => *since_s,
                    _ => {
                        self.tell(now, format!("connection lost: {why}"), true);
                        now.s
                    }
                };
                self.line = Line::Gone { since_s, why };
            }
            Word::Event(event) => self.event(*event, now),
            Word::Status(status) => self.status(*status),
            Word::Jobs(jobs) => {
                self.works = jobs
                    .into_iter()
                    .map(|job| Work { stage: None, job })
                    .collect();
            }
            Word::Image(image) => {
                let is_of = |station: &&mut Station| {
                    let scan = station.scan.as_ref();
                    scan.is_some_and(|scan| scan.id == image.scan)
                };
                if let Some(station) = self.stations.iter_mut().find(is_of) {
                    station.is_at(&image.scan);
                    let (columns, planned) = station.progress();
                    station.picture.lay(&image, columns, planned);
                }
            }
            Word::Answer(answer) => self.note = Some(answer),
        }
    }

    fn event(&mut self, event: Event, now: &Now) {
        match &event {
            Event::Column { .. } | Event::Unknown | Event::Status(_) => {}
            Event::Progress { seconds: None, .. } => {}
            _ => self.tell(now, plain::line(&event), is_bad(&event)),
        }
        match event {
            Event::Status(status) => self.status(*status),
            Event::Scanner(status) => {
                if let Some(station) = self.station(&status.name) {
                    station.status = status;
                }
            }
            Event::Laser(entry) => {
                if let Some(station) = self.station(&entry.scanner) {
                    station.laser = Some(entry);
                }
            }
            Event::Scan(scan) => {
                if let Some(station) = self.station(&scan.scanner) {
                    station.scan = Some(scan);
                }
            }
            Event::Column {
                scan,
                scanner,
                columns,
                columns_planned,
                samples,
                x_mm,
                live,
                ..
            } => {
                if let Some(station) = self.station(&scanner) {
                    station.is_at(&scan);
                    station.rate.push(now.s, columns);
                    station.picture.push(&live, columns, columns_planned);
                    station.last_column = Some((samples, x_mm));
                    if let Some(known) = station.scan.as_mut().filter(|s| s.id == scan) {
                        known.columns = columns;
                        known.columns_planned = columns_planned;
                    }
                }
            }
            Event::Job(job) => self.job(job),
            Event::Progress {
                job,
                stage,
                fraction,
                seconds,
                ..
            } => {
                let fraction = if seconds.is_some() { 1.0 } else { fraction };
                if let Some(work) = self.work(job) {
                    work.stage = Some((stage, fraction));
                }
            }
            Event::Published { result, files, .. } => {
                let told = format!("{result} ({})", output::counted(files.len(), "file"));
                self.published.push_front(told);
                self.published.truncate(MOST);
            }
            Event::Lagged { .. } | Event::Unknown => {}
        }
    }

    fn status(&mut self, status: Status) {
        let summaries = if status.scanners.is_empty() {
            vec![ScannerSummary {
                status: status.scanner.clone(),
                laser: status.laser.clone(),
                scan: status.scan.clone(),
            }]
        } else {
            status.scanners.clone()
        };
        self.service = Some(status);
        let mut before = std::mem::take(&mut self.stations);
        for told in summaries {
            let known = before
                .iter()
                .position(|s| s.status.name == told.status.name);
            let mut station = match known {
                Some(index) => before.swap_remove(index),
                None => Station::new(told.status.clone()),
            };
            station.status = told.status;
            station.laser = told.laser.map(|laser| *laser);
            match told.scan {
                Some(scan) => station.scan = Some(scan),
                // It has ended, and the event that says how is on its way or was lost.
                None => station.scan = station.scan.take().filter(|scan| scan.state.is_over()),
            }
            self.stations.push(station);
        }
        self.chosen = self.chosen.min(self.stations.len().saturating_sub(1));
    }

    fn job(&mut self, job: Job) {
        if let Some(work) = self.work(job.id) {
            if job.state != JobState::Running {
                work.stage = None;
            }
            work.job = job;
            return;
        }
        self.works.push(Work { job, stage: None });
        self.works
            .sort_by_key(|work| std::cmp::Reverse(work.job.id));
        self.works.truncate(MOST);
    }

    fn work(&mut self, id: JobId) -> Option<&mut Work> {
        self.works.iter_mut().find(|work| work.job.id == id)
    }

    /// A scanner by its name; the first where services name none.
    fn station(&mut self, name: &str) -> Option<&mut Station> {
        let mut stations = self.stations.iter_mut();
        if name.is_empty() {
            return stations.next();
        }
        stations.find(|station| station.status.name == name)
    }

    fn tell(&mut self, now: &Now, text: String, is_bad: bool) {
        if self.log.len() >= MOST {
            self.log.pop_front();
        }
        self.log.push_back(Told {
            clock: now.clock.clone(),
            text,
            is_bad,
        });
    }
}

impl Station {
    fn new(status: ScannerStatus) -> Self {
        Self {
            status,
            laser: None,
            scan: None,
            picture: Picture::default(),
            rate: Rate::default(),
            pictured: String::new(),
            last_column: None,
        }
    }

    /// A picture of another scan is none of this one.
    fn is_at(&mut self, scan: &str) {
        if self.pictured != scan {
            self.pictured = scan.to_owned();
            self.picture = Picture::default();
            self.rate = Rate::default();
            self.last_column = None;
        }
    }

    /// Columns of the scan that is shown, and how many it is to have.
    fn progress(&self) -> (u32, u32) {
        let scan = self.scan.as_ref();
        scan.map_or((0, 0), |scan| (scan.columns, scan.columns_planned))
    }

    /// Whether its picture is of the scan that is shown.
    pub(super) fn is_pictured(&self) -> bool {
        self.scan
            .as_ref()
            .is_some_and(|scan| scan.id == self.pictured)
    }

    /// The laser, as far as it is known.
    pub(super) fn laser(&self) -> LaserState {
        self.laser
            .as_ref()
            .map_or(LaserState::Unknown, |entry| entry.laser)
    }
}

fn is_bad(event: &Event) -> bool {
    match event {
        Event::Scanner(scanner) => scanner.problem.is_some(),
        Event::Laser(entry) => entry.laser == LaserState::Unknown,
        Event::Scan(scan) => scan.reason.is_some(),
        Event::Job(job) => job.error.is_some(),
        Event::Lagged { .. } => true,
        _ => false,
    }
}
