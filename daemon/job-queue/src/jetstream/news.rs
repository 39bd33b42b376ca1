//! What a bench hears of its orders.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SendError, Sender, channel};
use std::time::Duration;

use async_nats::jetstream::kv::Operation;
use futures_util::{StreamExt, TryStreamExt};
use serde::{Deserialize, Serialize};

use super::kept::parse;
use super::names::parse_key;
use super::stores::Stores;
use super::{CALL, JetStreamQueue, Shared, locked};
use crate::order::{BenchName, JobKey};
use crate::queue::{QueueError, Standing};

/// How long is waited after the server has refused to tell.
const PAUSE: Duration = Duration::from_secs(1);
/// Standings that are asked for at once.
const AT_ONCE: usize = 16;

/// Something that a bench hears.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// The connection is there, and all standings are told again.
    Connected,
    /// The connection is lost.
    Away,
    /// An order stands so, or is not there any more.
    Standing(JobKey, Option<Standing>),
    /// How far a job is; nothing that is kept.
    Progress {
        /// The job.
        key: JobKey,
        /// What its worker is at.
        stage: String,
        /// Which share of that is done, from 0 to 1.
        fraction: f64,
        /// How long it took, once it is finished.
        seconds: Option<f64>,
    },
}

/// How far a job is, as it is sent.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Progress {
    pub(crate) stage: String,
    pub(crate) fraction: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) seconds: Option<f64>,
}

/// Nobody listens any more.
struct Deaf;

impl<T> From<SendError<T>> for Deaf {
    fn from(_: SendError<T>) -> Self {
        Self
    }
}

impl JetStreamQueue {
    /// Where all orders of a bench stand, those among them that are over.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn standings(&self, bench: &BenchName) -> Result<Vec<(JobKey, Standing)>, QueueError> {
        self.shared.run(CALL, async {
            let stores = self.shared.stores().await?;
            stores.standings_of(bench).await
        })
    }

    /// Tells what happens to the orders of a bench: all standings at first, then each that
    /// changes, for as long as this queue lives and somebody listens.
    #[must_use]
    pub fn news(&self, bench: &BenchName) -> Receiver<News> {
        let (tell, hear) = channel();
        let shared = Arc::clone(&self.shared);
        let bench = bench.clone();
        let task = self.shared.handle.spawn(async move {
            while report(&shared, &bench, &tell).await.is_ok() {
                tokio::time::sleep(PAUSE).await;
            }
        });
        let mut tasks = locked(&self.tasks);
        tasks.retain(|task| !task.is_finished());
        tasks.push(task);
        hear
    }
}

impl Stores {
    /// Keys in a bucket.
    pub(crate) async fn keys(
        store: &async_nats::jetstream::kv::Store,
        filter: &str,
    ) -> Result<BTreeSet<String>, QueueError> {
        let away =
            |error: &dyn std::fmt::Display| QueueError::Away(format!("{}: {error}", store.name));
        let subjects = store
            .stream
            .info_with_subjects(format!("{}{filter}", store.prefix))
            .await
            .map_err(|error| away(&error))?;
        let subjects: Vec<(String, usize)> =
            subjects.try_collect().await.map_err(|error| away(&error))?;
        Ok(subjects
            .into_iter()
            .filter_map(|(subject, _)| subject.strip_prefix(&store.prefix).map(str::to_owned))
            .collect())
    }

    async fn standings_of(&self, bench: &BenchName) -> Result<Vec<(JobKey, Standing)>, QueueError> {
        let keys = Self::keys(&self.standings, &format!("{bench}.*")).await?;
        let keys = keys.iter().filter_map(|key| parse_key(key));
        let read = async |key: JobKey| match self.read(&key).await {
            Ok(found) => Ok(found.map(|(kept, _)| (key, kept.standing))),
            // It is told of where it is asked for by itself.
            Err(QueueError::Damaged { .. }) => Ok(None),
            Err(error) => Err(error),
        };
        let mut standings: Vec<(JobKey, Standing)> = futures_util::stream::iter(keys)
            .map(read)
            .buffer_unordered(AT_ONCE)
            .try_filter_map(async |found| Ok(found))
            .try_collect()
            .await?;
        standings.sort_by(|(a, _), (b, _)| a.cmp(b));
        Ok(standings)
    }
}

/// Tells what happens until the connection is lost.
async fn report(shared: &Arc<Shared>, bench: &BenchName, tell: &Sender<News>) -> Result<(), Deaf> {
    let mut up = shared.link.watch();
    if !up.borrow_and_update().there {
        tell.send(News::Away)?;
        if up.wait_for(|up| up.there).await.is_err() {
            return Err(Deaf);
        }
    }
    let Ok(stores) = shared.stores().await else {
        return Ok(());
    };
    let subject = shared.names.every_progress(bench);
    let (Ok(mut progress), Ok(mut standings)) = (
        stores.client.subscribe(subject).await,
        stores
            .standings
            .watch_with_history(format!("{bench}.*"))
            .await,
    ) else {
        return Ok(());
    };
    tell.send(News::Connected)?;
    loop {
        tokio::select! {
            entry = standings.next() => {
                let Some(Ok(entry)) = entry else {
                    return Ok(());
                };
                let Some(key) = parse_key(&entry.key) else {
                    continue;
                };
                let standing = match entry.operation {
                    Operation::Put => parse(&key, &entry.value).ok().map(|kept| kept.standing),
                    _ => None,
                };
                tell.send(News::Standing(key, standing))?;
            }
            message = progress.next() => {
                let Some(message) = message else {
                    return Ok(());
                };
                if let Some(news) = heard(&message) {
                    tell.send(news)?;
                }
            }
            changed = up.changed() => {
                if changed.is_err() {
                    return Err(Deaf);
                }
                tell.send(News::Away)?;
                return Ok(());
            }
        }
    }
}

fn heard(message: &async_nats::Message) -> Option<News> {
    let mut tokens = message.subject.rsplitn(3, '.');
    let (job, bench) = (tokens.next()?, tokens.next()?);
    let key = parse_key(&format!("{bench}.{job}"))?;
    let progress: Progress = serde_json::from_slice(&message.payload).ok()?;
    Some(News::Progress {
        key,
        stage: progress.stage,
        fraction: progress.fraction,
        seconds: progress.seconds,
    })
}
