//! Lists of scans and jobs, whole or page by page.

use relief_api::{Job, JobId, JobList, Scan, ScanList};

use crate::error::ServiceError;
use crate::service::{Service, lock};

impl Service {
    /// The newest scans that are older than `before`, if that is given; at most `limit`.
    pub(crate) fn scans_part(
        &self,
        before: Option<String>,
        limit: Option<usize>,
    ) -> Result<ScanList, ServiceError> {
        // First: what is over by the time the records are read is newer there.
        let newer: Vec<Scan> = lock(&self.unkept)
            .iter()
            .cloned()
            .chain(self.active_scans())
            .collect();
        let mut scans = self
            .store
            .scans_before(before.as_deref(), one_more(limit))?;
        for scan in &mut scans {
            // Of two that are newer, the active one is the newest.
            if let Some(newest) = newer.iter().rfind(|newest| newest.id == scan.id) {
                scan.clone_from(newest);
            }
        }
        let more = cut(&mut scans, limit);
        let next = scans.last().filter(|_| more).map(|scan| scan.id.clone());
        Ok(ScanList { scans, next })
    }

    /// The newest jobs that are older than `before`, if that is given; at most `limit`.
    pub(crate) fn jobs_part(
        &self,
        before: Option<JobId>,
        limit: Option<usize>,
    ) -> Result<JobList, ServiceError> {
        let mut jobs: Vec<Job> = self.store.jobs_before(before, one_more(limit))?;
        let more = cut(&mut jobs, limit);
        let next = jobs.last().filter(|_| more).map(|job| job.id);
        Ok(JobList { jobs, next })
    }
}

/// One more than is wanted tells whether there are more.
fn one_more(limit: Option<usize>) -> usize {
    limit.map_or(usize::MAX, |limit| limit + 1)
}

/// Whether there were more than are wanted.
fn cut<T>(rows: &mut Vec<T>, limit: Option<usize>) -> bool {
    let more = limit.is_some_and(|limit| rows.len() > limit);
    rows.truncate(limit.unwrap_or(usize::MAX));
    more
}
