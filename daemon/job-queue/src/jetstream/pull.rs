//! The next message of a line.

use std::time::Duration;

use async_nats::StatusCode;
use async_nats::jetstream::Message;
use futures_util::StreamExt;

use super::options::ANSWER;
use super::stores::Stores;
use crate::queue::QueueError;

/// How long a request stays that the server does not answer at once: it believes that there is
/// something, which others were given or which was taken back, and keeps the request for what may
/// come.
const PATIENCE: Duration = Duration::from_millis(500);

/// What the server has in a line.
pub(super) enum Pulled {
    /// An order.
    Message(Box<Message>),
    /// Nothing now.
    Nothing,
    /// The line is not there any more, or moves to another server.
    Gone(String),
}

/// Asks for the next message of a consumer.
pub(super) async fn pull(stores: &Stores, consumer: &str) -> Result<Pulled, QueueError> {
    let away = |why: &dyn std::fmt::Display| QueueError::Away(format!("the next order: {why}"));
    let stream = &stores.orders.cached_info().config.name;
    let subject = format!("{}.CONSUMER.MSG.NEXT.{stream}.{consumer}", stores.api);
    let client = &stores.client;
    let inbox = client.new_inbox();
    let mut answers = client
        .subscribe(inbox.clone())
        .await
        .map_err(|error| away(&error))?;
    let request = r#"{"batch":1,"no_wait":true}"#;
    let asked = client
        .publish_with_reply(subject, inbox, request.into())
        .await;
    asked.map_err(|error| away(&error))?;
    let answer = match tokio::time::timeout(PATIENCE, answers.next()).await {
        Ok(answer) => answer,
        Err(_) => {
            // Taken back; what is on its way already still comes before the end of the answers.
            let back = answers.drain().await;
            back.map_err(|error| away(&error))?;
            match tokio::time::timeout(ANSWER, answers.next()).await {
                Ok(answer) => answer,
                Err(_) => return Err(away(&"no answer")),
            }
        }
    };
    let Some(answer) = answer else {
        // Asked for its figures, a server counts anew, and believes it no more.
        let _ = stores.orders.consumer_info(consumer).await;
        return Ok(Pulled::Nothing);
    };
    Ok(match answer.status {
        None | Some(StatusCode::OK) => Pulled::Message(Box::new(Message {
            message: answer,
            context: stores.context.clone(),
        })),
        // No messages; or as many requests as messages.
        Some(StatusCode::NOT_FOUND | StatusCode::TIMEOUT) => Pulled::Nothing,
        Some(status) => Pulled::Gone(format!(
            "{status} {}",
            answer.description.unwrap_or_default()
        )),
    })
}
