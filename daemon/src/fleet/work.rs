//! Work on jobs by the service itself, where it has NATS: on those of all benches, or on its own
//! alone while the servers are away.

use std::sync::Arc;
use std::time::Duration;

use job_queue::Worker;

use super::Fleet;
use super::remote::Remote;
use super::worker::memory_mib;
use crate::config::Role;
use crate::jobs::{Embedded, Hand, Local, be_nice};
use crate::service::Service;

/// How long it waits for an order before it looks around.
const LOOK: Duration = Duration::from_secs(1);

/// Works until the service stops: on jobs of all benches, if that is its role, and on its own when
/// the servers are away. Runs on a thread of its own.
pub(super) fn work(service: &Arc<Service>, fleet: &Arc<Fleet>) {
    be_nice();
    let name = std::thread::current().name().unwrap_or("worker").to_owned();
    let pulse = service.liveness.begin(name.clone());
    let config = service.config();
    let is_to_stop = |longest| service.wait_for_stop(longest);
    let local = Hand {
        queue: &Embedded(Arc::clone(service)),
        worker: &Worker::named(&name),
        craft: &Local(service),
        pulse: &pulse,
        is_to_stop: &is_to_stop,
    };
    let mut worker = Worker::named(&format!("{}-{name}", fleet.bench));
    worker.tools.clone_from(&fleet.config.tools);
    let share = || memory_mib(config.queue.workers);
    worker.memory_mib = Some(fleet.config.memory_mib.unwrap_or_else(share));
    let works = config.has(Role::Work);
    if works {
        fleet.attendance.comes(&worker, service.threads_of_a_job());
    }
    let remote = Remote {
        name: &worker.name,
        depot: &fleet.depot,
        folder: &service.elsewhere_dir(),
        threads: &|| service.threads_of_a_job(),
        is_to_stop: &is_to_stop,
        attendance: &fleet.attendance,
    };
    let others = Hand {
        queue: &*fleet.queue,
        worker: &worker,
        craft: &remote,
        pulse: &pulse,
        is_to_stop: &is_to_stop,
    };
    while !service.wait_for_stop(Duration::ZERO) {
        if fleet.is_done_here() {
            local.work_once(LOOK);
        } else if works && fleet.queue.is_connected() {
            others.work_once(LOOK);
        } else {
            service.wait_for_stop(LOOK);
        }
    }
}
