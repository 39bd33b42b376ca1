//! One object of a bucket.

use async_nats::jetstream::message::StreamMessage;
use async_nats::jetstream::object_store::{ObjectInfo, PutError};
use async_nats::jetstream::stream::{DirectGetErrorKind, LastRawMessageErrorKind};
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE;
use sha2::{Digest, Sha256};

use super::parcel::hex;
use super::{Bucket, CHUNK_BYTES, Chunk, Kind};
use crate::queue::QueueError;

/// Of zstd: what more would save is not worth the time.
const LEVEL: i32 = 3;
/// What a chunk may take at most once it is packed: a little more than unpacked.
const MOST_PACKED_BYTES: usize = CHUNK_BYTES + CHUNK_BYTES / 128;

impl Bucket {
    /// Where the description of an object is.
    pub(super) fn description(&self, object: &str) -> String {
        format!("$O.{}.M.{}", self.name, URL_SAFE.encode(object))
    }

    /// Where the bytes of an object are.
    pub(super) fn bytes(&self, nuid: &str) -> String {
        format!("$O.{}.C.{nuid}", self.name)
    }

    pub(super) fn away(&self, error: &dyn std::fmt::Display) -> QueueError {
        QueueError::Away(format!("{}: {error}", self.name))
    }

    /// Puts a chunk, unless it is one of a journal that is there, or in any case.
    pub(super) async fn put(
        &self,
        kind: Kind,
        chunk: &Chunk,
        raw: &[u8],
        anew: bool,
    ) -> Result<(), QueueError> {
        let object = chunk.object(kind);
        if kind == Kind::Journal && !anew && self.info(&object).await?.is_some() {
            return Ok(());
        }
        let packed = zstd::bulk::compress(raw, LEVEL).map_err(|error| QueueError::Damaged {
            what: object.clone(),
            why: format!("it cannot be packed ({error})"),
        })?;
        let mut packed = packed.as_slice();
        let put = self.objects.put(object.as_str(), &mut packed).await;
        put.map(drop).map_err(|error| self.refusal(&error))
    }

    fn refusal(&self, error: &PutError) -> QueueError {
        let text = error.to_string();
        if text.contains("maximum bytes") || text.contains("maximum messages") {
            return QueueError::Full(format!(
                "the bucket {} has as many bytes as it may: wait until results are fetched, or \
                 raise the quota",
                self.name
            ));
        }
        if text.contains("resource") {
            return QueueError::Full(format!("NATS has no room for {} ({text})", self.name));
        }
        self.away(error)
    }

    /// Gets a chunk and holds it against its hash.
    pub(super) async fn get(
        &self,
        kind: Kind,
        chunk: &Chunk,
        what: &str,
    ) -> Result<Vec<u8>, QueueError> {
        let damaged = |why: String| QueueError::Damaged {
            what: what.to_owned(),
            why,
        };
        // An object that is put anew meanwhile has its bytes elsewhere.
        for last in [false, true] {
            let Some(info) = self.info(&chunk.object(kind)).await? else {
                return Err(damaged(format!("it is not in {}", self.name)));
            };
            if info.size > MOST_PACKED_BYTES {
                return Err(damaged(format!("it takes {} bytes", info.size)));
            }
            let Some(packed) = self.read(&info).await? else {
                if last {
                    return Err(damaged("some of its bytes are missing".to_owned()));
                }
                continue;
            };
            let size = usize::try_from(chunk.bytes).unwrap_or(usize::MAX);
            // No more is unpacked than was promised, whatever the object says.
            let raw = zstd::bulk::decompress(&packed, size.min(CHUNK_BYTES))
                .map_err(|error| damaged(format!("it cannot be unpacked ({error})")))?;
            if raw.len() as u64 != chunk.bytes || hex(&Sha256::digest(&raw)) != chunk.sha256 {
                return Err(damaged("it is not what was put".to_owned()));
            }
            return Ok(raw);
        }
        Err(damaged("it is put anew all the time".to_owned()))
    }

    /// All bytes of an object; `None` if there are fewer than it says.
    async fn read(&self, info: &ObjectInfo) -> Result<Option<Vec<u8>>, QueueError> {
        let mut packed = Vec::with_capacity(info.size);
        let subject = self.bytes(&info.nuid);
        let mut next = 1;
        while packed.len() < info.size {
            let Some(message) = self.next(&subject, next).await? else {
                return Ok(None);
            };
            if packed.len() + message.payload.len() > info.size || message.payload.is_empty() {
                return Ok(None);
            }
            packed.extend_from_slice(&message.payload);
            next = message.sequence + 1;
        }
        Ok(Some(packed))
    }

    /// The first message of a subject from this number on.
    async fn next(&self, subject: &str, from: u64) -> Result<Option<StreamMessage>, QueueError> {
        let next = self.stream.direct_get_next_for_subject(subject, Some(from));
        match next.await {
            Ok(message) => return Ok(Some(message)),
            // Whoever answered may lag behind: the leader knows.
            Err(error) if error.kind() == DirectGetErrorKind::NotFound => {}
            Err(error) => return Err(self.away(&error)),
        }
        let next = self
            .stream
            .raw_message_builder()
            .next_by_subject(subject)
            .sequence(from);
        match next.send().await {
            Ok(message) => Ok(Some(message)),
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
            Err(error) => Err(self.away(&error)),
        }
    }

    /// The last message of a subject, by the leader.
    pub(super) async fn last(&self, subject: &str) -> Result<Option<StreamMessage>, QueueError> {
        match self.stream.get_last_raw_message_by_subject(subject).await {
            Ok(message) => Ok(Some(message)),
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
            Err(error) => Err(self.away(&error)),
        }
    }

    /// What the bucket says of an object, if it has it.
    pub(super) async fn info(&self, object: &str) -> Result<Option<ObjectInfo>, QueueError> {
        let Some(message) = self.last(&self.description(object)).await? else {
            return Ok(None);
        };
        let info: ObjectInfo =
            serde_json::from_slice(&message.payload).map_err(|error| QueueError::Damaged {
                what: format!("what {} says of {object}", self.name),
                why: error.to_string(),
            })?;
        Ok((!info.deleted).then_some(info))
    }

    /// Removes an object, and leaves no mark of it.
    pub(super) async fn remove(&self, object: &str) -> Result<(), QueueError> {
        let info = self.info(object).await?;
        // First what names the bytes: these are swept should this be cut short.
        self.purge(&self.description(object)).await?;
        match info {
            Some(info) => self.purge(&self.bytes(&info.nuid)).await.map(drop),
            None => Ok(()),
        }
    }

    /// Removes the messages of a subject; gives how many there were.
    pub(super) async fn purge(&self, subject: &str) -> Result<u64, QueueError> {
        let purged = self.stream.purge().filter(subject).await;
        purged
            .map(|purged| purged.purged)
            .map_err(|error| self.away(&error))
    }
}
