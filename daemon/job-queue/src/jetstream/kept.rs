//! What is kept of an order besides its message.

use async_nats::jetstream::kv::{CreateErrorKind, Operation, UpdateErrorKind};
use relief_api::JobState;
use serde::{Deserialize, Serialize};

use super::stores::Stores;
use crate::order::JobKey;
use crate::queue::{Ending, Outcome, QueueError, Standing};

/// A change is tried so often again when others change the same at the same time.
pub(crate) const TRIES: usize = 100;

/// A standing, and what only this queue needs to know. Whoever reads the bucket finds the fields
/// of [`Standing`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    /// What all know.
    #[serde(flatten)]
    pub(crate) standing: Standing,
    /// Number in the stream of the message that was taken last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) message: Option<u64>,
    /// The how manieth delivery of it was taken.
    #[serde(default)]
    pub(crate) delivery: i64,
    /// The attempt that was begun last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) lease: Option<String>,
    /// Whether the bench wants it no more.
    #[serde(default)]
    pub(crate) cancel: bool,
    /// In whose hands it was cut short, in a row.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) hands: Vec<String>,
}

impl Kept {
    /// Of an order that waits.
    pub(crate) fn waiting(turn: u32) -> Self {
        Self {
            standing: Standing {
                turn,
                state: JobState::Queued,
                attempts: 0,
                cut_short: 0,
                worker: None,
                stage: None,
                outcome: None,
            },
            message: None,
            delivery: 0,
            lease: None,
            cancel: false,
            hands: Vec::new(),
        }
    }

    /// Ends it.
    pub(crate) fn settle(&mut self, outcome: Outcome) {
        self.standing.state = outcome.ending.state();
        self.standing.cut_short = 0;
        self.standing.stage = None;
        self.standing.outcome = Some(outcome);
        self.hands.clear();
    }

    /// Ends it without anybody having worked on it.
    pub(crate) fn settle_as(&mut self, ending: Ending) {
        self.settle(Outcome {
            ending,
            timings: Vec::new(),
        });
    }

    /// Whether nothing more will come of this turn.
    pub(crate) fn is_over(&self) -> bool {
        self.standing.state.is_over()
    }
}

impl Stores {
    /// What is kept of an order, and its revision.
    pub(crate) async fn read(&self, key: &JobKey) -> Result<Option<(Kept, u64)>, QueueError> {
        let entry = self.standings.entry(key.to_string()).await;
        let entry = entry.map_err(|error| QueueError::Away(format!("job {key}: {error}")))?;
        let Some(entry) = entry.filter(|entry| entry.operation == Operation::Put) else {
            return Ok(None);
        };
        Ok(Some((parse(key, &entry.value)?, entry.revision)))
    }

    /// Keeps it if nobody else has changed it since that revision, or made it. `false` if so.
    pub(crate) async fn write(
        &self,
        key: &JobKey,
        kept: &Kept,
        revision: Option<u64>,
    ) -> Result<bool, QueueError> {
        let value = serde_json::to_vec(kept).map_err(|error| QueueError::Damaged {
            what: format!("what is to be kept of job {key}"),
            why: error.to_string(),
        })?;
        let away = |error: &dyn std::fmt::Display| QueueError::Away(format!("job {key}: {error}"));
        let key_text = key.to_string();
        match revision {
            None => match self.standings.create(key_text, value.into()).await {
                Ok(_) => Ok(true),
                Err(error) if error.kind() == CreateErrorKind::AlreadyExists => Ok(false),
                Err(error) => Err(away(&error)),
            },
            Some(revision) => {
                let updated = self.standings.update(key_text, value.into(), revision);
                match updated.await {
                    Ok(_) => Ok(true),
                    Err(error) if error.kind() == UpdateErrorKind::WrongLastRevision => Ok(false),
                    Err(error) => Err(away(&error)),
                }
            }
        }
    }

    /// Changes what is kept, as `change` says for what is there: nothing if it gives `None`.
    /// Gives what is kept then.
    pub(crate) async fn change(
        &self,
        key: &JobKey,
        change: impl Fn(&Kept) -> Option<Kept>,
    ) -> Result<Option<Kept>, QueueError> {
        for _ in 0..TRIES {
            let Some((kept, revision)) = self.read(key).await? else {
                return Ok(None);
            };
            let Some(changed) = change(&kept) else {
                return Ok(Some(kept));
            };
            if self.write(key, &changed, Some(revision)).await? {
                return Ok(Some(changed));
            }
        }
        Err(crowded(key))
    }
}

/// Others change it faster than this one can read it.
pub(crate) fn crowded(key: &JobKey) -> QueueError {
    QueueError::Away(format!("job {key} is changed by others all the time"))
}

/// Reads what is kept.
pub(crate) fn parse(key: &JobKey, value: &[u8]) -> Result<Kept, QueueError> {
    serde_json::from_slice(value).map_err(|error| QueueError::Damaged {
        what: format!("what is kept of job {key}"),
        why: error.to_string(),
    })
}
