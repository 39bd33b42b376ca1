//! Records page by page, newest first.

use redb::{Database, ReadableDatabase, ReadableTable};
use relief_api::{Job, JobId, Scan};

use super::record::decode;
use super::{JOBS, SCANS, Store, StoreError};

impl Store {
    /// The newest job that is meant.
    pub(crate) fn newest_job(
        &self,
        mut is_meant: impl FnMut(&Job) -> bool,
    ) -> Result<Option<Job>, StoreError> {
        self.with(|database: &Database| {
            let table = database.begin_read()?.open_table(JOBS)?;
            for row in table.iter()?.rev() {
                match decode::<Job>(&self.path, row?.1.value()) {
                    Ok(job) if is_meant(&job) => return Ok(Ok(Some(job))),
                    Ok(_) => {}
                    Err(error) => return Ok(Err(error)),
                }
            }
            Ok(Ok(None))
        })?
    }

    /// The job that makes, or made, this result.
    pub(crate) fn job_of_result(&self, result: &str) -> Result<Option<Job>, StoreError> {
        self.with(|database: &Database| {
            let table = database.begin_read()?.open_table(JOBS)?;
            for row in table.iter()?.rev() {
                let row = row?.1;
                // Names of results need no escapes: few records have to be decoded.
                let may_be = std::str::from_utf8(row.value()).is_ok_and(|r| r.contains(result));
                if !may_be {
                    continue;
                }
                match decode::<Job>(&self.path, row.value()) {
                    Ok(job) if job.result == result => return Ok(Ok(Some(job))),
                    Ok(_) => {}
                    Err(error) => return Ok(Err(error)),
                }
            }
            Ok(Ok(None))
        })?
    }

    /// The newest scans that are older than this one.
    pub(crate) fn scans_before(
        &self,
        before: Option<&str>,
        limit: usize,
    ) -> Result<Vec<Scan>, StoreError> {
        self.with(|database: &Database| {
            let table = database.begin_read()?.open_table(SCANS)?;
            let rows = match before {
                Some(before) => table.range(..before)?,
                None => table.iter()?,
            };
            let newest = rows.rev().take(limit).map(|row| Ok(row?.1));
            self.decode_each(newest, Some)
        })?
    }

    /// The newest jobs that are older than this one.
    pub(crate) fn jobs_before(
        &self,
        before: Option<JobId>,
        limit: usize,
    ) -> Result<Vec<Job>, StoreError> {
        self.with(|database: &Database| {
            let table = database.begin_read()?.open_table(JOBS)?;
            let rows = match before {
                Some(before) => table.range(..before)?,
                None => table.iter()?,
            };
            let newest = rows.rev().take(limit).map(|row| Ok(row?.1));
            self.decode_each(newest, Some)
        })?
    }
}
