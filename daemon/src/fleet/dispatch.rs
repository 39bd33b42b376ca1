//! Takes jobs out of the service's own queue for as long as there is somebody for them elsewhere.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

use super::hand_over::HandOver;
use super::{Fleet, Handed};
use crate::service::{Service, lock};

/// How long it waits for a job before it looks around.
const LOOK: Duration = Duration::from_millis(250);
/// Bytes of stack of a thread that mostly waits.
const STACK_BYTES: usize = 512 << 10;

/// Hands over until the service stops. Runs on a thread of its own.
pub(super) fn dispatch(service: &Arc<Service>, fleet: &Arc<Fleet>) {
    let mut threads: Vec<JoinHandle<()>> = Vec::new();
    while !service.wait_for_stop(Duration::ZERO) {
        threads.retain(|thread| !thread.is_finished());
        if !fleet.queue.is_connected() || threads.len() >= fleet.window() {
            service.wait_for_stop(LOOK);
            continue;
        }
        let Some((order, flag)) = service.queue.take(|_| true, LOOK) else {
            continue;
        };
        let id = order.key.job;
        service.queue.waits_elsewhere(id, true);
        let handed = service.job(id).map_or_else(
            |_| Handed::default(),
            |job| Handed {
                scan: job.scan,
                scanner: job.scanner,
                chunks: Vec::new(),
                heard: None,
            },
        );
        lock(&fleet.handed).insert(id, handed);
        let hand_over = HandOver {
            service: Arc::clone(service),
            fleet: Arc::clone(fleet),
            taken: order.clone(),
            flag: Arc::clone(&flag),
        };
        let fleet_of_thread = Arc::clone(fleet);
        let started = std::thread::Builder::new()
            .name(format!("job-{id}"))
            .stack_size(STACK_BYTES)
            .spawn(move || {
                let may_be_left = hand_over.see_through();
                lock(&fleet_of_thread.handed).remove(&id);
                // Not before: as long as it is on its way, nothing of it is cleared up.
                if may_be_left {
                    fleet_of_thread.has_left.store(true, Ordering::Relaxed);
                }
            });
        match started {
            Ok(thread) => threads.push(thread),
            Err(error) => {
                tracing::error!(job = id, %error, "cannot start a thread for a job; trying again");
                lock(&fleet.handed).remove(&id);
                service.queue.end(id, &flag);
                service.queue.add(order);
                service.wait_for_stop(LOOK);
            }
        }
    }
    fleet.board.wake();
    for thread in threads {
        if thread.join().is_err() {
            tracing::error!("a thread that followed a job ended by a panic");
        }
    }
}
