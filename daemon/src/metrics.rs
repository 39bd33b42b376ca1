//! What the service counts, for Prometheus.
//!
//! Counters begin at 0 with the service, as is usual. What can be asked for at any moment is
//! measured when somebody asks.

mod fleet;
mod gauges;
mod labels;

use std::sync::Mutex;

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;
use relief_api::{Job, JobState, ScanState};
use scanner_driver::LineCounts;

use crate::service::{Service, lock};
use gauges::Gauges;
use labels::{OfEvent, OfScanner, OfStage, OfState, ScanEnd};

/// Media type of what [`Service::metrics_text`] gives.
pub(crate) const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Upper ends of the classes of seconds that a stage of a job takes.
const STAGE_SECONDS: [f64; 11] = [0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0];

/// What is counted.
#[derive(Debug)]
pub(crate) struct Metrics {
    registry: Registry,
    columns: Family<OfScanner, Counter>,
    samples: Family<OfScanner, Counter>,
    dropouts: Family<OfScanner, Counter>,
    shown: Family<OfScanner, Counter>,
    scans: Family<ScanEnd, Counter>,
    jobs: Family<OfState, Counter>,
    stages: Family<OfStage, Histogram>,
    line: Family<OfEvent, Counter>,
    gauges: Gauges,
    /// What each line had counted when it was last looked at.
    lines: Mutex<std::collections::BTreeMap<String, LineCounts>>,
}

impl Default for Metrics {
    fn default() -> Self {
        let mut registry = Registry::with_prefix("relief");
        let columns = Family::default();
        let samples = Family::default();
        let dropouts = Family::default();
        let shown = Family::default();
        let scans = Family::default();
        let jobs = Family::default();
        let line = Family::default();
        let stages = Family::new_with_constructor(histogram as fn() -> Histogram);
        registry.register("columns", "Columns safe on disk", Family::clone(&columns));
        registry.register(
            "samples",
            "Samples with a return in them",
            Family::clone(&samples),
        );
        registry.register(
            "dropouts",
            "Samples without a return in them",
            Family::clone(&dropouts),
        );
        registry.register(
            "shown_columns",
            "Columns that have been regridded while the table moved; how far behind \
             relief_columns they are is the backlog",
            Family::clone(&shown),
        );
        registry.register(
            "scans",
            "Scans that have ended, by how",
            Family::clone(&scans),
        );
        registry.register(
            "jobs",
            "Attempts at jobs that have ended, by how",
            Family::clone(&jobs),
        );
        registry.register(
            "stage_seconds",
            "How long the stages of jobs took",
            Family::clone(&stages),
        );
        registry.register(
            "line_events",
            "What happened on the line to a scanner: good frames, damaged frames, requests that \
             had to be repeated (retry), and requests for missing fragments (resend); as of the \
             last look at it, which is between scans",
            Family::clone(&line),
        );
        let gauges = Gauges::new(&mut registry);
        Self {
            registry,
            columns,
            samples,
            dropouts,
            shown,
            scans,
            jobs,
            stages,
            line,
            gauges,
            lines: Mutex::default(),
        }
    }
}

fn histogram() -> Histogram {
    Histogram::new(STAGE_SECONDS)
}

impl Metrics {
    /// A column is safe on disk.
    pub(crate) fn column_kept(&self, scanner: &str, samples: usize, dropouts: u32) {
        let labels = OfScanner::new(scanner);
        self.columns.get_or_create(&labels).inc();
        self.samples.get_or_create(&labels).inc_by(samples as u64);
        self.dropouts.get_or_create(&labels).inc_by(dropouts.into());
    }

    /// A column has been regridded, or found not to be.
    pub(crate) fn column_shown(&self, scanner: &str) {
        self.shown.get_or_create(&OfScanner::new(scanner)).inc();
    }

    /// A scan has ended.
    pub(crate) fn scan_ended(&self, scanner: &str, state: ScanState) {
        self.scans
            .get_or_create(&ScanEnd::new(scanner, state))
            .inc();
    }

    /// An attempt at a job has ended.
    pub(crate) fn job_ended(&self, job: &Job) {
        if job.state == JobState::Queued {
            return;
        }
        self.jobs.get_or_create(&OfState::new(job.state)).inc();
        for timing in &job.timings {
            let stage = OfStage::new(&timing.stage);
            self.stages.get_or_create(&stage).observe(timing.seconds);
        }
    }

    /// A line has counted this since the connection was made.
    pub(crate) fn line(&self, scanner: &str, counts: LineCounts) {
        let mut lines = lock(&self.lines);
        let before = lines.insert(scanner.to_owned(), counts).unwrap_or_default();
        // After another connection was made it begins anew.
        let is_new = counts.frames < before.frames;
        let before = if is_new {
            LineCounts::default()
        } else {
            before
        };
        for (event, now, then) in [
            ("frame", counts.frames, before.frames),
            ("bad_frame", counts.bad_frames, before.bad_frames),
            ("retry", counts.retries, before.retries),
            ("resend", counts.resends, before.resends),
        ] {
            self.line
                .get_or_create(&OfEvent::new(scanner, event))
                .inc_by(now.saturating_sub(then));
        }
    }
}

impl Service {
    /// All metrics as text.
    pub(crate) fn metrics_text(&self) -> String {
        self.metrics.gauges.measure(self);
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = encode(&mut text, &self.metrics.registry);
        text
    }
}
