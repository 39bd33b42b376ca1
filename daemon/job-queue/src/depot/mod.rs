//! Journals and results on their way: bytes in an object store, beside the queue.
//!
//! A bench puts a scan's journal there before it offers a job, and a worker puts what it made
//! before it settles the job; the order and the outcome carry the [`Parcel`] or [`Bundle`] by
//! which the other finds it. What is fetched is what was put, or an error: everything is held
//! against its SHA-256, which the parcel brings along by another way.

mod bundle;
mod object;
mod parcel;
mod sweep;

use std::collections::HashMap;
use std::fmt;
use std::future::Future;
use std::io::{Read, Write};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_nats::jetstream::object_store::ObjectStore;
use async_nats::jetstream::stream::{Config, DiscardPolicy, Stream};
use futures_util::StreamExt;
use futures_util::stream;

pub use bundle::{Bundle, BundledFile};
pub use parcel::{CHUNK_BYTES, Chunk, Parcel};
pub use sweep::{Stored, Swept};

use crate::jetstream::{JetStreamQueue, Shared, find_or_make, locked};
use crate::order::BenchName;
use crate::queue::QueueError;
use parcel::{Measured, cut};

/// How long a few chunks may take, on a slow network.
const LONGEST: Duration = Duration::from_secs(120);
/// Chunks that are on their way at once.
const AT_ONCE: usize = 4;

/// What bytes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// What a scanner saw. Where it is there already, it is not put again.
    Journal,
    /// What a worker made.
    Result,
}

impl Kind {
    /// Begins the names of its objects.
    #[must_use]
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Journal => "j-",
            Self::Result => "r-",
        }
    }
}

/// Where benches and workers leave bytes for each other: a bucket for each bench.
#[derive(Clone)]
pub struct Depot {
    shared: Arc<Shared>,
    open: Arc<Mutex<HashMap<BenchName, (u64, Bucket)>>>,
}

impl fmt::Debug for Depot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Depot").finish_non_exhaustive()
    }
}

/// A bench's bucket.
#[derive(Clone)]
pub(crate) struct Bucket {
    pub(crate) name: String,
    pub(crate) objects: ObjectStore,
    pub(crate) stream: Stream,
}

impl JetStreamQueue {
    /// The depot on the same connection, for as long as this queue lives.
    #[must_use]
    pub fn depot(&self) -> Depot {
        Depot {
            shared: self.share(),
            open: Arc::default(),
        }
    }
}

impl Depot {
    /// Puts one chunk of at most [`CHUNK_BYTES`].
    ///
    /// # Errors
    /// [`QueueError::Full`] if the bench's quota is used up; any but [`QueueError::Lost`].
    pub fn put_chunk(
        &self,
        bench: &BenchName,
        kind: Kind,
        raw: &[u8],
    ) -> Result<Chunk, QueueError> {
        let chunk = Measured::of(kind).add(raw)?;
        self.run(async {
            let bucket = self.bucket(bench).await?;
            bucket.put(kind, &chunk, raw, false).await
        })?;
        Ok(chunk)
    }

    /// Puts all that can be read, cut into chunks.
    ///
    /// # Errors
    /// As [`Depot::put_chunk`]; [`QueueError::Damaged`] if it cannot be read.
    pub fn put(
        &self,
        bench: &BenchName,
        kind: Kind,
        from: &mut dyn Read,
    ) -> Result<Parcel, QueueError> {
        self.put_all(bench, kind, from, false)
    }

    /// The same, whatever the servers say they have already: somebody has not found it, or not whole.
    ///
    /// # Errors
    /// As [`Depot::put`].
    pub fn put_anew(
        &self,
        bench: &BenchName,
        kind: Kind,
        from: &mut dyn Read,
    ) -> Result<Parcel, QueueError> {
        self.put_all(bench, kind, from, true)
    }

    fn put_all(
        &self,
        bench: &BenchName,
        kind: Kind,
        from: &mut dyn Read,
        anew: bool,
    ) -> Result<Parcel, QueueError> {
        let mut measured = Measured::of(kind);
        let mut ended = false;
        while !ended {
            let mut raws = Vec::new();
            while raws.len() < AT_ONCE && !ended {
                match cut(from)? {
                    Some(raw) => raws.push((measured.add(&raw)?, raw)),
                    None => ended = true,
                }
            }
            let puts = raws.iter().map(|(chunk, raw)| async move {
                let bucket = self.bucket(bench).await?;
                bucket.put(kind, chunk, raw, anew).await
            });
            let all = async {
                stream::iter(puts)
                    .buffered(AT_ONCE)
                    .collect::<Vec<_>>()
                    .await
            };
            self.run(async { all.await.into_iter().collect::<Result<(), _>>() })?;
        }
        Ok(measured.end())
    }

    /// Writes what a parcel tells of.
    ///
    /// # Errors
    /// [`QueueError::Damaged`] with the chunk that is missing or is not what was put, or if it
    /// cannot be written; any but [`QueueError::Lost`] and [`QueueError::Full`]. Part of it may
    /// have been written.
    pub fn fetch(
        &self,
        bench: &BenchName,
        kind: Kind,
        parcel: &Parcel,
        to: &mut dyn Write,
    ) -> Result<(), QueueError> {
        parcel.check()?;
        let mut measured = Measured::default();
        let mut first = 0;
        for chunks in parcel.chunks.chunks(AT_ONCE) {
            let of = parcel.chunks.len();
            let gets = chunks.iter().enumerate().map(|(n, chunk)| async move {
                let what = format!("chunk {} of {of} ({})", first + n + 1, chunk.object(kind));
                let bucket = self.bucket(bench).await?;
                bucket.get(kind, chunk, &what).await
            });
            let all = async {
                stream::iter(gets)
                    .buffered(AT_ONCE)
                    .collect::<Vec<_>>()
                    .await
            };
            let raws: Result<Vec<_>, _> = self.run(async { Ok(all.await) })?.into_iter().collect();
            for raw in raws? {
                measured.add(&raw)?;
                to.write_all(&raw).map_err(|error| QueueError::Damaged {
                    what: "where a parcel is to be written".to_owned(),
                    why: error.to_string(),
                })?;
            }
            first += chunks.len();
        }
        if measured.end().sha256 == parcel.sha256 {
            Ok(())
        } else {
            Err(QueueError::Damaged {
                what: format!("a parcel of {} bytes", parcel.bytes),
                why: "its chunks are whole, but it is not what was put".to_owned(),
            })
        }
    }

    /// Removes chunks. Those that are not there are none of the bench's worries.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn remove(
        &self,
        bench: &BenchName,
        kind: Kind,
        chunks: &[Chunk],
    ) -> Result<(), QueueError> {
        for chunk in chunks {
            self.run(async {
                let bucket = self.bucket(bench).await?;
                bucket.remove(&chunk.object(kind)).await
            })?;
        }
        Ok(())
    }

    fn run<T>(&self, work: impl Future<Output = Result<T, QueueError>>) -> Result<T, QueueError> {
        self.shared.run(LONGEST, work)
    }

    /// The bench's bucket; looked for anew after each connection.
    async fn bucket(&self, bench: &BenchName) -> Result<Bucket, QueueError> {
        let times = self.shared.link.times();
        if let Some((at, bucket)) = locked(&self.open).get(bench)
            && *at == times
        {
            return Ok(bucket.clone());
        }
        let bucket = self.open(bench).await?;
        locked(&self.open).insert(bench.clone(), (times, bucket.clone()));
        Ok(bucket)
    }

    async fn open(&self, bench: &BenchName) -> Result<Bucket, QueueError> {
        let options = &self.shared.options;
        let stores = self.shared.stores().await?;
        let name = self.shared.names.depot(bench);
        let max_bytes = options
            .quota_bytes
            .map_or(-1, |most| i64::try_from(most).unwrap_or(i64::MAX));
        // As any other client would make it.
        let config = Config {
            name: format!("OBJ_{name}"),
            description: Some(format!("journals and results of {bench}")),
            subjects: vec![format!("$O.{name}.C.>"), format!("$O.{name}.M.>")],
            max_bytes,
            discard: DiscardPolicy::New,
            allow_rollup: true,
            allow_direct: true,
            num_replicas: options.replicas,
            ..Config::default()
        };
        let stream = find_or_make(&stores.context, config, options.makes_missing).await?;
        let objects = stores.context.get_object_store(&name).await;
        let objects = objects.map_err(|error| QueueError::Away(format!("{name}: {error}")))?;
        Ok(Bucket {
            name,
            objects,
            stream,
        })
    }
}
