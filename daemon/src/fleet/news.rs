//! What is told of this bench's orders.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use job_queue::Standing;
use job_queue::jetstream::News;
use relief_api::{Event, JobId, JobState};

use super::Fleet;
use super::hand_over::is_of;
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
                if let Some(standing) = &standing {
                    fleet.forget_unwanted(service, key.job, standing);
                }
                fleet.board.put(key.job, standing);
            }
            Ok(News::Progress {
                key,
                stage,
                fraction,
                seconds,
            }) => {
                let handed = lock(&fleet.handed).get(&key.job).cloned();
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

impl Fleet {
    /// Takes back an order that nobody here waits for: of a job that was done here meanwhile, or is
    /// not known.
    fn forget_unwanted(&self, service: &Service, job: JobId, standing: &Standing) {
        if lock(&self.handed).contains_key(&job) {
            return;
        }
        let wanted = match service.store.job(job) {
            // One that waits here will be handed over, and finds it.
            Ok(Some(job)) => job.state == JobState::Queued && is_of(&job, standing),
            Ok(None) => false,
            // Another time.
            Err(_) => true,
        };
        if wanted {
            return;
        }
        self.has_left.store(true, Ordering::Relaxed);
        let key = self.key(job);
        tracing::info!(job = %key, "taking back a job that is not wanted elsewhere any more");
        if let Err(error) = self.queue.forget(&key) {
            tracing::debug!(job = %key, %error, "cannot take back a job; it is tried again");
        }
    }
}
