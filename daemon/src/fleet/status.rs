//! The fleet at a glance, for the API.

use std::time::Duration;

use job_queue::jetstream::{Depth, Node, Role};
use relief_api::{Fleet as Shown, FleetBench, FleetJobs, FleetWorker, Priority};

use super::Fleet;
use crate::service::{Service, lock};

impl Service {
    /// Workers elsewhere, and the jobs that go to them, as they are.
    pub(crate) fn fleet_status(&self) -> Shown {
        if let Some(fleet) = self.fleet.get() {
            fleet.look();
        }
        self.fleet_known()
    }

    /// The same as of the last look, without asking the servers.
    pub(crate) fn fleet_known(&self) -> Shown {
        self.fleet.get().map_or_else(
            || Shown {
                bench: self.bench.to_string(),
                ..Shown::default()
            },
            |fleet| fleet.shown(),
        )
    }
}

impl Fleet {
    fn shown(&self) -> Shown {
        let seen = lock(&self.seen).clone();
        let of = |role| seen.nodes.iter().filter(move |node| node.role == role);
        let is_connected = self.queue.is_connected();
        Shown {
            is_used: true,
            bench: self.bench.to_string(),
            servers: self.config.servers.clone(),
            is_connected,
            away_s: (!is_connected).then(|| self.away_for().as_secs()),
            problem: match self.queue.wait_connected(Duration::ZERO) {
                Ok(()) => lock(&self.trouble).clone(),
                Err(error) => Some(error.to_string()),
            },
            handed_over: lock(&self.handed).len(),
            most_handed_over: self.window(),
            jobs: seen.depth.as_ref().map(jobs),
            workers: of(Role::Worker).map(worker).collect(),
            benches: of(Role::Bench).map(bench).collect(),
        }
    }
}

fn jobs(depth: &Depth) -> FleetJobs {
    let waiting = |priority| depth.waiting.get(&priority).copied().unwrap_or_default();
    FleetJobs {
        waiting_high: waiting(Priority::High),
        waiting_normal: waiting(Priority::Normal),
        waiting_low: waiting(Priority::Low),
        running: depth.running,
        oldest_s: depth.oldest_s,
    }
}

fn worker(node: &Node) -> FleetWorker {
    FleetWorker {
        name: node.name.clone(),
        version: node.version.clone(),
        formats: node.formats,
        memory_mib: node.memory_mib,
        tools: node.tools.clone(),
        threads: node.threads,
        busy_with: node.busy_with.as_ref().map(ToString::to_string),
        since: node.since.clone(),
    }
}

fn bench(node: &Node) -> FleetBench {
    FleetBench {
        name: node.name.clone(),
        version: node.version.clone(),
        waiting: node.waiting,
        since: node.since.clone(),
    }
}
