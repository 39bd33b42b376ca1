//! What can be asked for at any moment.

use std::sync::atomic::AtomicU64;

use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::{Registry, Unit};
use relief_api::{LaserState, ScannerLink};

use super::fleet::OfFleet;
use super::labels::{OfPlace, OfScanner, OfState, OfVersion, OfWebhook};
use crate::service::Service;

/// A gauge of seconds or shares.
pub(super) type Real = Gauge<f64, AtomicU64>;

#[derive(Debug, Default)]
pub(super) struct Gauges {
    version: Family<OfVersion, Gauge>,
    link: Family<OfScanner, Gauge>,
    laser: Family<OfScanner, Gauge>,
    laser_time: Family<OfScanner, Real>,
    columns: Family<OfScanner, Gauge>,
    planned: Family<OfScanner, Gauge>,
    paused: Family<OfScanner, Gauge>,
    jobs: Family<OfState, Gauge>,
    kept: Family<OfPlace, Gauge>,
    free: Family<OfPlace, Gauge>,
    webhooks: Family<OfWebhook, Gauge>,
    dropped: Family<OfWebhook, Gauge>,
    fleet: OfFleet,
}

impl Gauges {
    pub(super) fn new(registry: &mut Registry) -> Self {
        let all = Self::default();
        registry.register("build_info", "1, with the version", all.version.clone());
        registry.register(
            "scanner_up",
            "1 while the scanner answers and reports no fault",
            all.link.clone(),
        );
        registry.register(
            "laser_on",
            "1 while the laser is on, 0 while it is off, -1 while that is not known",
            all.laser.clone(),
        );
        registry.register_with_unit(
            "laser_on_time",
            "How long the laser has been on since the service started",
            Unit::Seconds,
            all.laser_time.clone(),
        );
        registry.register(
            "scan_columns",
            "Columns of the scan under way so far",
            all.columns.clone(),
        );
        registry.register(
            "scan_columns_planned",
            "Columns that the scan under way will have",
            all.planned.clone(),
        );
        registry.register(
            "scan_paused",
            "1 while a scan stands still",
            all.paused.clone(),
        );
        registry.register(
            "jobs_now",
            "Jobs that wait, or that workers have",
            all.jobs.clone(),
        );
        registry.register_with_unit(
            "kept",
            "What kept scans and results take, as of the last look",
            Unit::Bytes,
            all.kept.clone(),
        );
        registry.register_with_unit(
            "free",
            "What is free where they are kept",
            Unit::Bytes,
            all.free.clone(),
        );
        registry.register(
            "webhook_waiting",
            "Messages that wait to be delivered",
            all.webhooks.clone(),
        );
        registry.register(
            "webhook_dropped",
            "Messages that had to make room for newer ones since the service started",
            all.dropped.clone(),
        );
        all.fleet.register(registry);
        all
    }

    /// Measures all of them.
    pub(super) fn measure(&self, service: &Service) {
        let version = env!("CARGO_PKG_VERSION");
        self.version.get_or_create(&OfVersion { version }).set(1);
        for station in &service.stations {
            let labels = OfScanner::new(station.name());
            let summary = station.summary();
            let up = matches!(
                summary.status.link,
                ScannerLink::Ready | ScannerLink::Scanning
            );
            self.link.get_or_create(&labels).set(up.into());
            let laser = summary
                .laser
                .map_or(LaserState::Unknown, |entry| entry.laser);
            self.laser.get_or_create(&labels).set(match laser {
                LaserState::On => 1,
                LaserState::Off => 0,
                LaserState::Unknown => -1,
            });
            let on = station.laser.on_time().as_secs_f64();
            self.laser_time.get_or_create(&labels).set(on);
            let scan = summary.scan.as_ref();
            let columns = scan.map_or(0, |scan| scan.columns);
            let planned = scan.map_or(0, |scan| scan.columns_planned);
            let paused = scan.is_some_and(|scan| scan.state == relief_api::ScanState::Paused);
            self.columns.get_or_create(&labels).set(columns.into());
            self.planned.get_or_create(&labels).set(planned.into());
            self.paused.get_or_create(&labels).set(paused.into());
        }
        let (queued, running) = service.queue.counts();
        let jobs = [
            (relief_api::JobState::Queued, queued),
            (relief_api::JobState::Running, running),
        ];
        for (state, count) in jobs {
            let labels = OfState::new(state);
            self.jobs.get_or_create(&labels).set(whole(count as u64));
        }
        let storage = service.storage_status();
        for (place, kept, free) in [
            ("scans", storage.scans_bytes, storage.scans_free_bytes),
            ("spool", storage.results_bytes, storage.results_free_bytes),
        ] {
            let labels = OfPlace { place };
            self.kept.get_or_create(&labels).set(whole(kept));
            if let Some(free) = free {
                self.free.get_or_create(&labels).set(whole(free));
            }
        }
        let fleet = service.fleet_known();
        if fleet.is_used {
            self.fleet.measure(&fleet);
        }
        for backlog in service.receivers.backlogs() {
            let labels = OfWebhook {
                webhook: backlog.name,
            };
            let waiting = whole(backlog.waiting);
            self.webhooks.get_or_create(&labels).set(waiting);
            self.dropped
                .get_or_create(&labels)
                .set(whole(backlog.dropped));
        }
    }
}

pub(super) fn whole(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
