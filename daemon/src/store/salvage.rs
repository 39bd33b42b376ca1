//! Records that are damaged: what can still be read is kept, and the file is moved aside.

use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use redb::{Database, Key, ReadableDatabase, ReadableTable, TableDefinition, TableHandle};
use relief_api::{Delivery, Job, JobId, Scan};
use storage::{Disk, remove_file_if_there};

use super::error::{StoreError, is_damage};
use super::messages::{LOG, Message, WAITING};
use super::record::decode;
use super::{CACHE_BYTES, JOBS, SCANS, open_database, sync_folder};
use crate::error::panic_text;

/// Ends the name of a file with what could be read of a damaged one, until that is moved aside ...
const FILLED: &str = "redb.salvaged";
/// ... to a name that goes on so.
const ASIDE: &str = "damaged-";

/// What is wrong with the file.
#[derive(Debug)]
pub(super) struct Damage(String);

/// Rows as they are kept.
#[derive(Debug, Default)]
struct Rows {
    scans: Vec<(String, Vec<u8>)>,
    jobs: Vec<(JobId, Vec<u8>)>,
    waiting: Vec<((String, u64), Vec<u8>)>,
    log: Vec<((String, u64), Vec<u8>)>,
    /// What could not be read.
    lost: Vec<String>,
}

/// The rows of one table that can be read, in the order of their keys. What cannot be read is
/// passed over as far as may be: rows are read up to it from either end.
fn read_table<K: Key, T: Ord>(
    database: &impl ReadableDatabase,
    definition: TableDefinition<'_, K, &[u8]>,
    key: impl Fn(K::SelfType<'_>) -> T,
    lost: &mut Vec<String>,
) -> Vec<(T, Vec<u8>)> {
    let mut found = BTreeMap::new();
    let mut read = |backwards: bool| -> Result<(), redb::Error> {
        let table = database.begin_read()?.open_table(definition)?;
        let mut rows = table.iter()?;
        let mut next = || {
            if backwards {
                rows.next_back()
            } else {
                rows.next()
            }
        };
        while let Some(row) = next() {
            let (id, bytes) = row?;
            found.insert(key(id.value()), bytes.value().to_vec());
        }
        Ok(())
    };
    for backwards in [false, true] {
        let what = match catch_unwind(AssertUnwindSafe(|| read(backwards))) {
            // Of a version that had no such table.
            Ok(Ok(()) | Err(redb::Error::TableDoesNotExist(_))) => break,
            Ok(Err(error)) => error.to_string(),
            Err(panic) => panic_text(&*panic).to_owned(),
        };
        lost.push(format!("{}: {what}", definition.name()));
    }
    found.into_iter().collect()
}

fn owned((receiver, number): (&str, u64)) -> (String, u64) {
    (receiver.to_owned(), number)
}

impl Rows {
    /// As many as can be read.
    fn read(database: &impl ReadableDatabase) -> Self {
        let mut lost = Vec::new();
        Self {
            scans: read_table(database, SCANS, str::to_owned, &mut lost),
            jobs: read_table(database, JOBS, |id| id, &mut lost),
            waiting: read_table(database, WAITING, owned, &mut lost),
            log: read_table(database, LOG, owned, &mut lost),
            lost,
        }
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
        self.waiting.retain(|((receiver, number), bytes)| {
            let error = decode::<Message>(path, bytes).err();
            sound(format!("the message {number} to {receiver}"), error)
        });
        self.log.retain(|((receiver, number), bytes)| {
            let error = decode::<Delivery>(path, bytes).err();
            sound(
                format!("the entry {number} of the log of {receiver}"),
                error,
            )
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

/// Moves the file aside, and puts a new one in its place with what can be read of it. The new one
/// is complete before the old one moves: [`take_up`] ends what is cut short between the two.
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
    let filled = path.with_extension(FILLED);
    let put = || -> Result<(), redb::Error> {
        remove_file_if_there(disk, &filled)?;
        let database = open_database(disk, &filled)?;
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
            for (definition, rows) in [(WAITING, &rows.waiting), (LOG, &rows.log)] {
                let mut table = transaction.open_table(definition)?;
                for ((receiver, number), bytes) in rows {
                    table.insert((receiver.as_str(), *number), bytes.as_slice())?;
                }
            }
        }
        transaction.commit()?;
        database.close()?;
        disk.rename(path, &aside)?;
        disk.rename(&filled, path)?;
        Ok(sync_folder(disk, path)?)
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

/// Where there is no file: puts the one in its place that [`replace`] has filled, if it was cut
/// short. True if there is a file then.
pub(super) fn take_up(disk: &dyn Disk, path: &Path) -> Result<bool, StoreError> {
    let filled = path.with_extension(FILLED);
    if filled.exists() {
        disk.rename(&filled, path)
            .and_then(|()| sync_folder(disk, path))
            .map_err(|error| StoreError::of(path, &error.into()))?;
        tracing::warn!(
            file = %path.display(),
            "the records were damaged when the service last ran: what could be read of them is kept"
        );
        return Ok(true);
    }
    let beside = path.parent().and_then(|folder| fs::read_dir(folder).ok());
    let aside = path.with_extension(ASIDE);
    for entry in beside.into_iter().flatten().flatten() {
        let found = entry.path();
        let name = found.to_string_lossy();
        if name.starts_with(&*aside.to_string_lossy()) {
            tracing::warn!(
                file = %path.display(),
                aside = %found.display(),
                "there are no records, but damaged ones that were moved aside: scans are looked \
                 for in their journals"
            );
        }
    }
    Ok(false)
}

/// A name beside the file that nothing has.
fn free_name(path: &Path) -> PathBuf {
    let stamp = Timestamp::now().strftime("%Y%m%dT%H%M%SZ").to_string();
    let mut number = 0;
    loop {
        let ending = match number {
            0 => format!("{ASIDE}{stamp}"),
            number => format!("{ASIDE}{stamp}-{number}"),
        };
        let aside = path.with_extension(ending);
        if !aside.exists() {
            return aside;
        }
        number += 1;
    }
}

#[cfg(test)]
mod tests;
