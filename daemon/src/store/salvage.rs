//! Records that are damaged: what can still be read is kept, and the file is moved aside.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use redb::{Database, ReadableDatabase, ReadableTable};
use relief_api::{Job, JobId, Scan};
use storage::Disk;

use super::error::{StoreError, is_damage};
use super::record::decode;
use super::{CACHE_BYTES, JOBS, SCANS, open_database, put_new};
use crate::error::panic_text;

/// What is wrong with the file.
#[derive(Debug)]
pub(super) struct Damage(String);

/// Rows as they are kept.
#[derive(Debug, Default)]
struct Rows {
    scans: Vec<(String, Vec<u8>)>,
    jobs: Vec<(JobId, Vec<u8>)>,
    /// What could not be read.
    lost: Vec<String>,
}

impl Rows {
    /// As many as can be read.
    fn read(database: &impl ReadableDatabase) -> Self {
        let mut rows = Self::default();
        let mut read = || -> Result<(), redb::Error> {
            let transaction = database.begin_read()?;
            for row in transaction.open_table(SCANS)?.iter()? {
                let (id, bytes) = row?;
                rows.scans
                    .push((id.value().to_owned(), bytes.value().to_vec()));
            }
            for row in transaction.open_table(JOBS)?.iter()? {
                let (id, bytes) = row?;
                rows.jobs.push((id.value(), bytes.value().to_vec()));
            }
            Ok(())
        };
        let what = match catch_unwind(AssertUnwindSafe(&mut read)) {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(panic) => Some(panic_text(&*panic).to_owned()),
        };
        rows.lost.extend(what);
        rows
    }

    /// Leaves out and names what is no record. That of a newer service is an error.
    fn check(&mut self, path: &Path) -> Result<(), StoreError> {
        let mut newer = None;
        let lost = &mut self.lost;
        let mut sound = |name: String, error: Option<StoreError>| match error {
            None => true,
            Some(error @ StoreError::Newer { .. }) => {
                newer = Some(error);
                true
            }
            Some(error) => {
                lost.push(format!("{name}: {error}"));
                false
            }
        };
        self.scans.retain(|(id, bytes)| {
            let error = decode::<Scan>(path, bytes).err();
            sound(format!("the scan {id}"), error)
        });
        self.jobs.retain(|(id, bytes)| {
            let error = decode::<Job>(path, bytes).err();
            sound(format!("the job {id}"), error)
        });
        newer.map_or(Ok(()), Err)
    }
}

/// Opens the file, if every record in it can be read.
pub(super) fn open_whole(
    disk: &dyn Disk,
    path: &Path,
) -> Result<Result<Database, Damage>, StoreError> {
    let database = match catch_unwind(AssertUnwindSafe(|| open_database(disk, path))) {
        Ok(Ok(database)) => database,
        Ok(Err(error)) if is_damage(&error) => return Ok(Err(Damage(error.to_string()))),
        Ok(Err(error)) => return Err(StoreError::of(path, &error)),
        Err(panic) => return Ok(Err(Damage(panic_text(&*panic).to_owned()))),
    };
    let mut rows = Rows::read(&database);
    rows.check(path)?;
    match rows.lost.first() {
        None => Ok(Ok(database)),
        Some(what) => Ok(Err(Damage(what.clone()))),
    }
}

/// Moves the file aside, and puts a new one in its place with what can be read of it.
pub(super) fn replace(disk: &dyn Disk, path: &Path, damage: &Damage) -> Result<(), StoreError> {
    let mut rows = match catch_unwind(|| {
        Database::builder()
            .set_cache_size(CACHE_BYTES)
            .open_read_only(path)
    }) {
        Ok(Ok(database)) => Rows::read(&database),
        _ => Rows::default(),
    };
    rows.check(path)?;
    let aside = free_name(path);
    let put = || -> Result<(), redb::Error> {
        disk.rename(path, &aside)?;
        put_new(disk, path)?;
        let database = open_database(disk, path)?;
        let transaction = database.begin_write()?;
        {
            let mut scans = transaction.open_table(SCANS)?;
            for (id, bytes) in &rows.scans {
                scans.insert(id.as_str(), bytes.as_slice())?;
            }
            let mut jobs = transaction.open_table(JOBS)?;
            for (id, bytes) in &rows.jobs {
                jobs.insert(id, bytes.as_slice())?;
            }
        }
        transaction.commit()?;
        Ok(database.close()?)
    };
    put().map_err(|error| StoreError::of(path, &error))?;
    tracing::error!(
        file = %path.display(),
        aside = %aside.display(),
        scans = rows.scans.len(),
        jobs = rows.jobs.len(),
        damage = %damage.0,
        "the records were damaged: the file is moved aside, what could be read of it is kept, \
         and the rest is looked for in the scans' journals"
    );
    for lost in &rows.lost {
        tracing::error!(%lost, "a record is lost");
    }
    Ok(())
}

/// A name beside the file that nothing has.
fn free_name(path: &Path) -> PathBuf {
    let stamp = Timestamp::now().strftime("%Y%m%dT%H%M%SZ").to_string();
    let mut number = 0;
    loop {
        let ending = match number {
            0 => format!("damaged-{stamp}"),
            number => format!("damaged-{stamp}-{number}"),
        };
        let aside = path.with_extension(ending);
        if !aside.exists() {
            return aside;
        }
        number += 1;
    }
}
