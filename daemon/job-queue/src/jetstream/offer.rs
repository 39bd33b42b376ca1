//! What a bench does: offers, takes back, forgets.

use async_nats::jetstream::consumer::{AckPolicy, pull};
use async_nats::jetstream::context::{PublishError, PublishErrorKind};
use async_nats::jetstream::stream::LastRawMessageErrorKind;
use relief_api::JobState;

use super::kept::{Kept, TRIES, crowded};
use super::names::Line;
use super::stores::Stores;
use super::{Shared, locked};
use crate::order::{JobKey, Order};
use crate::queue::{Ending, QueueError};

/// How an order that is offered stood before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stood {
    /// Not at all.
    New,
    /// It waits or runs.
    Before,
    /// There is nothing to wait for: it is over, or there is one of a later turn.
    Over,
}

impl Shared {
    pub(super) async fn offer(&self, order: &Order) -> Result<(), QueueError> {
        let subject = self.names.order(order)?;
        let line = Line::of(order)?;
        let payload = serde_json::to_vec(order).map_err(|error| QueueError::Damaged {
            what: format!("the order of job {}", order.key),
            why: error.to_string(),
        })?;
        let stores = self.stores().await?;
        // Before its message, which speaks for nothing without it.
        let stood = self.stand(&stores, order).await?;
        if stood == Stood::Over {
            return Ok(());
        }
        for last in [false, true] {
            let stores = self.stores().await?;
            self.serve(&stores, &line).await?;
            match publish(&stores, &subject, &payload).await {
                Ok(()) if stood == Stood::Before && !last => {
                    tracing::warn!(job = %order.key, "the servers had lost an order: it is put again");
                    break;
                }
                Ok(()) => break,
                Err(error) if error.kind() == PublishErrorKind::StreamNotFound && !last => {
                    self.doubt_stores().await;
                }
                Err(error) => {
                    let text = error.to_string();
                    // It waits already, or is a worker's.
                    if text.contains("maximum messages per subject") {
                        if last || !self.is_dead(&stores, &subject, &line).await? {
                            break;
                        }
                        tracing::warn!(job = %order.key, "the servers give an order to nobody any more: it is put anew");
                        self.withdraw(&stores, &order.key, order.turn).await?;
                        continue;
                    }
                    return Err(refusal(&text, self.options.quota_jobs));
                }
            }
        }
        self.ring(&stores, &line.consumer()).await;
        Ok(())
    }

    /// Keeps that the order waits, unless it does already.
    async fn stand(&self, stores: &Stores, order: &Order) -> Result<Stood, QueueError> {
        for _ in 0..TRIES {
            let found = stores.read(&order.key).await?;
            if let Some((kept, _)) = &found
                && kept.standing.turn >= order.turn
            {
                let waits = kept.standing.turn == order.turn && !kept.is_over();
                return Ok(if waits { Stood::Before } else { Stood::Over });
            }
            let revision = found.as_ref().map(|(_, revision)| *revision);
            let waits = Kept::waiting(order.turn);
            if !stores.write(&order.key, &waits, revision).await? {
                continue;
            }
            if let Some((earlier, _)) = found {
                self.withdraw(stores, &order.key, earlier.standing.turn)
                    .await?;
            }
            return Ok(Stood::New);
        }
        Err(crowded(&order.key))
    }

    /// Whether the server has a message and gives it to nobody any more, since it believes, as after
    /// it was killed, that a worker has answered it.
    async fn is_dead(
        &self,
        stores: &Stores,
        subject: &str,
        line: &Line,
    ) -> Result<bool, QueueError> {
        let away = |error: &dyn std::fmt::Display| QueueError::Away(format!("{subject}: {error}"));
        let found = stores.orders.get_last_raw_message_by_subject(subject).await;
        let message = match found {
            Ok(message) => message,
            // Answered meanwhile.
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => {
                return Ok(false);
            }
            Err(error) => return Err(away(&error)),
        };
        let info = stores.orders.consumer_info(line.consumer()).await;
        let info = info.map_err(|error| away(&error))?;
        let was_given_out = message.sequence <= info.delivered.stream_sequence;
        let is_answered =
            message.sequence <= info.ack_floor.stream_sequence || info.num_ack_pending == 0;
        Ok(was_given_out && is_answered)
    }

    /// Takes the message of a turn away. Should it stay, workers drop it.
    async fn withdraw(&self, stores: &Stores, key: &JobKey, turn: u32) -> Result<(), QueueError> {
        let subject = self.names.turn(key, turn);
        let purged = stores.orders.purge().filter(subject).await;
        purged.map_err(|error| QueueError::Away(format!("the order of job {key}: {error}")))?;
        Ok(())
    }

    /// Has a consumer for the line.
    async fn serve(&self, stores: &Stores, line: &Line) -> Result<(), QueueError> {
        let name = line.consumer();
        if locked(&self.consumers).contains(&name) {
            return Ok(());
        }
        let config = pull::Config {
            durable_name: Some(name.clone()),
            filter_subject: self.names.filter(line),
            ack_policy: AckPolicy::Explicit,
            ack_wait: self.options.ack_wait,
            // What is given out too often is told from what workers say, not counted here.
            max_deliver: -1,
            max_ack_pending: -1,
            max_waiting: 4096,
            ..pull::Config::default()
        };
        let made = stores.orders.get_or_create_consumer(&name, config).await;
        if let Err(error) = made {
            self.doubt_stores().await;
            return Err(QueueError::Away(format!("consumer {name}: {error}")));
        }
        locked(&self.consumers).insert(name);
        Ok(())
    }

    /// Tells idle workers that there is an order. Should they not hear, they look by themselves.
    pub(super) async fn ring(&self, stores: &Stores, consumer: &str) {
        let told = consumer.to_owned().into();
        let _ = stores.client.publish(self.names.bell(), told).await;
    }

    pub(super) async fn cancel(&self, key: &JobKey) -> Result<(), QueueError> {
        let stores = self.stores().await?;
        let kept = stores
            .change(key, |kept| {
                let mut kept = kept.clone();
                match kept.standing.state {
                    JobState::Queued => kept.settle_as(Ending::Cancelled),
                    JobState::Running => kept.cancel = true,
                    _ => return None,
                }
                Some(kept)
            })
            .await?;
        let Some(kept) = kept else {
            return Ok(());
        };
        let turn = kept.standing.turn;
        match kept.standing.state {
            JobState::Running => {
                let told = turn.to_string().into();
                let _ = stores.client.publish(self.names.cancel(key), told).await;
                Ok(())
            }
            JobState::Cancelled => self.withdraw(&stores, key, turn).await,
            _ => Ok(()),
        }
    }

    pub(super) async fn forget(&self, key: &JobKey) -> Result<(), QueueError> {
        let stores = self.stores().await?;
        let turn = match stores.read(key).await {
            Ok(None) => return Ok(()),
            Ok(Some((kept, _))) => Some(kept.standing.turn),
            // What cannot be read is forgotten, too.
            Err(QueueError::Damaged { .. }) => None,
            Err(error) => return Err(error),
        };
        // Purged and not marked as deleted: marks would stay for ever.
        let subject = format!("{}{key}", stores.standings.prefix);
        let purged = stores.standings.stream.purge().filter(subject).await;
        purged.map_err(|error| QueueError::Away(format!("job {key}: {error}")))?;
        match turn {
            Some(turn) => self.withdraw(&stores, key, turn).await,
            None => Ok(()),
        }
    }
}

async fn publish(stores: &Stores, subject: &str, payload: &[u8]) -> Result<(), PublishError> {
    let sent = stores
        .context
        .publish(subject.to_owned(), payload.to_vec().into())
        .await?;
    sent.await.map(drop)
}

/// Why the stream does not take an order.
fn refusal(text: &str, quota_jobs: u64) -> QueueError {
    if text.contains("maximum messages") || text.contains("maximum bytes") {
        QueueError::Full(format!(
            "{quota_jobs} orders wait or run: let workers catch up, or raise the quota"
        ))
    } else if text.contains("max payload") || text.contains("exceeds maximum") {
        QueueError::Refused(format!("an order that is too long for NATS ({text})"))
    } else {
        QueueError::Away(text.to_owned())
    }
}
