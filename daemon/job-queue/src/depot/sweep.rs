//! What is in a bucket, and what is there in vain.

use std::collections::{BTreeSet, HashSet};
use std::time::{Duration, SystemTime};

use async_nats::datetime::DateTime;
use async_nats::jetstream::object_store::ObjectInfo;
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE;
use futures_util::{StreamExt, TryStreamExt, stream};

use super::{AT_ONCE, Bucket, Depot};
use crate::order::BenchName;
use crate::queue::QueueError;

/// An object in a bench's bucket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// Its name.
    pub name: String,
    /// Bytes that it takes, packed.
    pub bytes: u64,
    /// When it was put, by the server's clock.
    pub at: SystemTime,
}

/// What was removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Swept {
    /// Objects that nobody needs.
    pub objects: u64,
    /// Bytes that these took, packed.
    pub bytes: u64,
    /// Messages of objects that were never finished.
    pub orphan_messages: u64,
}

/// An object as the server has it.
struct Found {
    name: String,
    /// Unless it was marked as deleted, or cannot be read.
    info: Option<ObjectInfo>,
    at: DateTime,
}

impl Depot {
    /// All objects of a bench, by name.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn list(&self, bench: &BenchName) -> Result<Vec<Stored>, QueueError> {
        let found = self.run(async {
            let bucket = self.bucket(bench).await?;
            bucket.found().await
        })?;
        let stored = found.into_iter().filter_map(|found| {
            let info = found.info?;
            let nanos = u64::try_from(found.at.unix_timestamp_nanos()).unwrap_or(0);
            Some(Stored {
                name: found.name,
                bytes: info.size as u64,
                at: SystemTime::UNIX_EPOCH + Duration::from_nanos(nanos),
            })
        });
        let mut stored: Vec<_> = stored.collect();
        stored.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(stored)
    }

    /// Removes what is older than `grace`, by the server's clock, and is not `needed`: objects by
    /// their names, and the bytes of objects that were never finished. These stay while something
    /// needed is not found: a server that has just begun to lead may not know yet what it has, and
    /// whose bytes they are.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`]. Some of it may have been removed.
    pub fn sweep(
        &self,
        bench: &BenchName,
        needed: &HashSet<String>,
        grace: Duration,
    ) -> Result<Swept, QueueError> {
        let (bucket, subjects, found, now) = self.run(async {
            let bucket = self.bucket(bench).await?;
            // Bytes before descriptions: an object that is finished in between is no orphan.
            let subjects = bucket.subjects("C").await?;
            let found = bucket.found().await?;
            let stores = self.shared.stores().await?;
            let now = self.shared.server_time(&stores).await?;
            Ok((bucket, subjects, found, now))
        })?;
        let old = |at: DateTime| now - at >= grace;
        let mut swept = Swept::default();
        let mut named = HashSet::new();
        let mut unseen: HashSet<&String> = needed.iter().collect();
        for Found { name, info, at } in found {
            let wanted = info.is_some() && needed.contains(&name);
            if wanted {
                unseen.remove(&name);
            }
            if wanted || !old(at) {
                named.extend(info.map(|info| bucket.bytes(&info.nuid)));
                continue;
            }
            self.run(bucket.remove_found(&name, info.as_ref()))?;
            if let Some(info) = info {
                swept.objects += 1;
                swept.bytes += info.size as u64;
            }
        }
        if !unseen.is_empty() {
            return Ok(swept);
        }
        for subject in subjects.difference(&named.into_iter().collect()) {
            swept.orphan_messages += self.run(async {
                match bucket.last(subject).await? {
                    Some(last) if old(last.time) => bucket.purge(subject).await,
                    _ => Ok(0),
                }
            })?;
        }
        Ok(swept)
    }
}

impl Bucket {
    /// Subjects of descriptions (`M`) or of bytes (`C`).
    async fn subjects(&self, part: &str) -> Result<BTreeSet<String>, QueueError> {
        let filter = format!("$O.{}.{part}.>", self.name);
        let subjects = self.stream.info_with_subjects(filter).await;
        let subjects = subjects.map_err(|error| self.away(&error))?;
        subjects
            .map_ok(|(subject, _)| subject)
            .try_collect()
            .await
            .map_err(|error| self.away(&error))
    }

    async fn found(&self) -> Result<Vec<Found>, QueueError> {
        let subjects = self.subjects("M").await?;
        let prefix = self.description("");
        let found = subjects.iter().map(|subject| {
            let name = subject
                .strip_prefix(&prefix)
                .and_then(|name| URL_SAFE.decode(name).ok())
                .and_then(|name| String::from_utf8(name).ok());
            async move {
                // Nobody of ours gives a name that is none.
                let Some(name) = name else {
                    return Ok(None);
                };
                let message = self.last(subject).await?;
                Ok(message.map(|message| {
                    let info: Option<ObjectInfo> = serde_json::from_slice(&message.payload).ok();
                    Found {
                        name,
                        info: info.filter(|info| !info.deleted),
                        at: message.time,
                    }
                }))
            }
        });
        stream::iter(found)
            .buffered(AT_ONCE * 4)
            .try_filter_map(async |found| Ok(found))
            .try_collect()
            .await
    }

    async fn remove_found(&self, name: &str, info: Option<&ObjectInfo>) -> Result<(), QueueError> {
        self.purge(&self.description(name)).await?;
        if let Some(info) = info {
            self.purge(&self.bytes(&info.nuid)).await?;
        }
        Ok(())
    }
}
