//! How much there is to do.

use std::collections::BTreeMap;

use futures_util::TryStreamExt;

use super::names::Line;
use super::{CALL, JetStreamQueue, Shared};
use crate::queue::QueueError;
use relief_api::Priority;

/// How much there is to do.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Depth {
    /// Orders that wait, by priority; all priorities are there.
    pub waiting: BTreeMap<Priority, u64>,
    /// Orders that workers have, or had and that are about to be given out again.
    pub running: u64,
    /// For how long the oldest of those waits that no worker had yet, by the server's clock;
    /// `None` if none does.
    pub oldest_s: Option<f64>,
}

impl JetStreamQueue {
    /// How much there is to do, of all benches.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn depth(&self) -> Result<Depth, QueueError> {
        self.shared.run(CALL, self.shared.depth())
    }
}

impl Shared {
    async fn depth(&self) -> Result<Depth, QueueError> {
        let stores = self.stores().await?;
        let away = |error: &dyn std::fmt::Display| QueueError::Away(format!("the orders: {error}"));
        let consumers: Vec<_> = stores
            .orders
            .consumers()
            .try_collect()
            .await
            .map_err(|error| away(&error))?;
        let mut depth = Depth {
            waiting: Priority::ALL.into_iter().map(|one| (one, 0)).collect(),
            ..Depth::default()
        };
        let mut oldest = None;
        for info in consumers {
            let Some(line) = Line::parse(&info.name) else {
                continue;
            };
            depth.running += info.num_ack_pending as u64;
            *depth.waiting.entry(line.priority).or_default() += info.num_pending;
            if info.num_pending > 0 {
                let next = stores
                    .orders
                    .raw_message_builder()
                    .next_by_subject(self.names.filter(&line))
                    .sequence(info.delivered.stream_sequence + 1)
                    .send()
                    .await;
                if let Ok(message) = next
                    && oldest.is_none_or(|oldest| message.time < oldest)
                {
                    oldest = Some(message.time);
                }
            }
        }
        if let Some(oldest) = oldest {
            let now = self.server_time(&stores).await?;
            depth.oldest_s = Some((now - oldest).as_seconds_f64().max(0.0));
        }
        Ok(depth)
    }
}
