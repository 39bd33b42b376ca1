//! What is told of this bench's orders.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use job_queue::jetstream::News;
use relief_api::Event;

use super::Fleet;
use crate::service::{Service, lock};

/// How long it waits for news before it looks whether the service stops.
const LOOK: Duration = Duration::from_millis(250);

/// Hears until the service stops. Runs on a thread of its own.
pub(super) fn hear(service: &Arc<Service>, fleet: &Arc<Fleet>) {
    let news = fleet.queue.news(&fleet.bench);
    while !service.wait_for_stop(Duration::ZERO) {
        match news.recv_timeout(LOOK) {
            Ok(News::Connected) => {
                tracing::info!("connected with NATS");
                fleet.trouble(None);
                // All that stands there is told anew; what is not has been lost.
                fleet.board.clear();
            }
            Ok(News::Away) => {
                tracing::warn!("NATS is away: jobs wait here");
                fleet.board.wake();
            }
            Ok(News::Standing(key, standing)) => {
                let unwanted = |standing| fleet.is_unwanted(service, key.job, standing);
                if standing.as_ref().is_some_and(unwanted) {
                    fleet.has_left.store(true, Ordering::Relaxed);
                }
                fleet.board.put(key.job, standing);
            }
            Ok(News::Progress {
                key,
                stage,
                fraction,
                seconds,
            }) => {
                let handed = lock(&fleet.handed).get_mut(&key.job).map(|handed| {
                    handed.heard = Some(Instant::now());
                    handed.clone()
                });
                if let Some(handed) = handed {
                    service.hub.tell(Event::Progress {
                        job: key.job,
                        scan: handed.scan,
                        scanner: handed.scanner,
                        stage,
                        fraction,
                        seconds,
                    });
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
    fleet.board.wake();
}
