//! Records page by page, newest first.

use redb::{Database, ReadableDatabase, ReadableTable};
use relief_api::{Job, JobId, Scan};

use super::{JOBS, SCANS, Store, StoreError};

impl Store {
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
