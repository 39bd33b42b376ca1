//! What is measured of the fleet: enough to decide how many workers there should be.

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::{Registry, Unit};
use relief_api::Fleet;

use super::gauges::{Real, whole};

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfPriority {
    priority: &'static str,
}

#[derive(Debug, Default)]
pub(super) struct OfFleet {
    connected: Gauge,
    handed_over: Gauge,
    waiting: Family<OfPriority, Gauge>,
    at_benches: Gauge,
    running: Gauge,
    oldest: Real,
    workers: Gauge,
    idle: Gauge,
    benches: Gauge,
}

impl OfFleet {
    pub(super) fn register(&self, registry: &mut Registry) {
        registry.register(
            "fleet_connected",
            "1 while a NATS server is reached",
            self.connected.clone(),
        );
        registry.register(
            "fleet_handed_over",
            "Jobs of this service that were handed over and are not over",
            self.handed_over.clone(),
        );
        registry.register(
            "fleet_jobs_waiting",
            "Jobs of all benches that wait for a worker, as of the last look",
            self.waiting.clone(),
        );
        registry.register(
            "fleet_jobs_at_benches",
            "Jobs of all benches that wait there for their turn to be handed over",
            self.at_benches.clone(),
        );
        registry.register(
            "fleet_jobs_running",
            "Jobs of all benches that workers have",
            self.running.clone(),
        );
        registry.register_with_unit(
            "fleet_oldest_job",
            "For how long the oldest job has waited that no worker had yet",
            Unit::Seconds,
            self.oldest.clone(),
        );
        registry.register(
            "fleet_workers",
            "Workers that are there",
            self.workers.clone(),
        );
        registry.register(
            "fleet_workers_idle",
            "Workers that have no job",
            self.idle.clone(),
        );
        registry.register(
            "fleet_benches",
            "Benches that are there",
            self.benches.clone(),
        );
    }

    pub(super) fn measure(&self, fleet: &Fleet) {
        self.connected.set(fleet.is_connected.into());
        self.handed_over.set(whole(fleet.handed_over as u64));
        let jobs = fleet.jobs.clone().unwrap_or_default();
        for (priority, count) in [
            ("high", jobs.waiting_high),
            ("normal", jobs.waiting_normal),
            ("low", jobs.waiting_low),
        ] {
            let labels = OfPriority { priority };
            self.waiting.get_or_create(&labels).set(whole(count));
        }
        let at_benches = fleet.benches.iter().map(|bench| bench.waiting).sum();
        self.at_benches.set(whole(at_benches));
        self.running.set(whole(jobs.running));
        self.oldest.set(jobs.oldest_s.unwrap_or_default());
        self.workers.set(whole(fleet.workers.len() as u64));
        let is_idle = |worker: &&relief_api::FleetWorker| worker.busy_with.is_none();
        let idle = fleet.workers.iter().filter(is_idle).count();
        self.idle.set(whole(idle as u64));
        self.benches.set(whole(fleet.benches.len() as u64));
    }
}
