//! Results that somebody says to have whole.

use relief_api::{Event, Job, JobState, SpoolEntry};

use crate::error::ServiceError;
use crate::ids::now;
use crate::service::Service;

impl Service {
    /// Notes that somebody has a result whole, on disk when this returns. Of several the first
    /// counts: a client that has not heard the answer asks again.
    pub(crate) fn acknowledge(&self, result: &str, by: &str) -> Result<Job, ServiceError> {
        let _order = self.queue.changing();
        let missing = || ServiceError::NotInSpool {
            what: result.to_owned(),
        };
        let known = self.store.job_of_result(result)?;
        let Some(mut job) = known else {
            return Err(match self.spool.entry(result)? {
                Some(_) => ServiceError::NoRecordOfResult {
                    result: result.to_owned(),
                },
                None => missing(),
            });
        };
        if job.acknowledged_at.is_some() {
            return Ok(job);
        }
        if job.state != JobState::Done || !self.spool.has(result) {
            return Err(missing());
        }
        job.acknowledged_at = Some(now());
        job.acknowledged_by = Some(by.to_owned());
        // The job's end was told when it came.
        self.store.put_job(&job)?;
        tracing::info!(job = job.id, result, by, "result acknowledged");
        self.hub.tell(Event::Job(job.clone()));
        Ok(job)
    }

    /// What is in a result's folder, and who has it.
    pub(crate) fn spool_entry(&self, result: &str) -> Result<SpoolEntry, ServiceError> {
        let Some(mut entry) = self.spool.entry(result)? else {
            return Err(ServiceError::NotInSpool {
                what: result.to_owned(),
            });
        };
        if let Some(job) = self.store.job_of_result(result)? {
            entry.acknowledged_at = job.acknowledged_at;
            entry.acknowledged_by = job.acknowledged_by;
        }
        Ok(entry)
    }
}
