//! Who is there: benches and workers.

use std::time::Duration;

use async_nats::jetstream::kv::Operation;
use serde::{Deserialize, Serialize};

use super::{CALL, JetStreamQueue, Shared, Stores};
use crate::order::JobKey;
use crate::queue::QueueError;

/// How often a bench or worker tells that it is there.
pub const BEAT: Duration = Duration::from_secs(15);

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// It has scanners, and offers jobs.
    Bench,
    /// It works on jobs.
    Worker,
}

/// A bench or worker, as it describes itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// What it is.
    pub role: Role,
    /// Its name.
    pub name: String,
    /// Version of the program.
    pub version: String,
    /// Oldest and newest format of orders that it knows.
    pub formats: (u32, u32),
    /// Memory that a job may take, in MiB, if that is bounded.
    #[serde(default)]
    pub memory_mib: Option<u64>,
    /// What is installed.
    #[serde(default)]
    pub tools: Vec<String>,
    /// What it works on.
    #[serde(default)]
    pub busy_with: Option<JobKey>,
    /// Threads that a job has.
    #[serde(default)]
    pub threads: u32,
    /// Jobs that a bench has not handed over yet.
    #[serde(default)]
    pub waiting: u64,
    /// When it started, as it says.
    pub since: String,
}

impl JetStreamQueue {
    /// Tells that a bench or worker is there: every [`BEAT`], and whenever something changes.
    /// Whoever does not for a minute is not listed any more.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn beat(&self, node: &Node) -> Result<(), QueueError> {
        let value = serde_json::to_vec(node).map_err(|error| QueueError::Damaged {
            what: format!("what {} tells of itself", node.name),
            why: error.to_string(),
        })?;
        self.shared.run(CALL, async {
            let stores = self.shared.stores().await?;
            let put = stores.nodes.put(self.shared.node_key(node), value.into());
            put.await.map(drop).map_err(|error| away(&error))
        })
    }

    /// Tells that a bench or worker ends.
    ///
    /// # Errors
    /// As [`JetStreamQueue::beat`].
    pub fn leave(&self, node: &Node) -> Result<(), QueueError> {
        self.shared.run(CALL, async {
            let stores = self.shared.stores().await?;
            let delete = stores.nodes.delete(self.shared.node_key(node));
            delete.await.map_err(|error| away(&error))
        })
    }

    /// Benches and workers that are there, by name.
    ///
    /// # Errors
    /// Any but [`QueueError::Lost`].
    pub fn nodes(&self) -> Result<Vec<Node>, QueueError> {
        self.shared.run(CALL, async {
            let stores = self.shared.stores().await?;
            let mut nodes = Vec::new();
            for key in Stores::keys(&stores.nodes, ">").await? {
                let entry = stores
                    .nodes
                    .entry(key)
                    .await
                    .map_err(|error| away(&error))?;
                let put = entry.filter(|entry| entry.operation == Operation::Put);
                // What another version wrote may be something else.
                if let Some(node) = put.and_then(|put| serde_json::from_slice(&put.value).ok()) {
                    nodes.push(node);
                }
            }
            nodes.sort_by(|a: &Node, b: &Node| a.name.cmp(&b.name));
            Ok(nodes)
        })
    }
}

impl Shared {
    /// Each worker has a key of its own, though names may be the same.
    fn node_key(&self, node: &Node) -> String {
        let name = plain(&node.name);
        match node.role {
            Role::Bench => format!("bench.{name}"),
            Role::Worker => format!("worker.{name}.{}", self.instance),
        }
    }

    /// The server's clock: no other one is compared with its times.
    pub(crate) async fn server_time(
        &self,
        stores: &Stores,
    ) -> Result<async_nats::datetime::DateTime, QueueError> {
        let key = format!("clock.{}", plain(&self.options.name));
        let put = stores.nodes.put(&key, "now".into()).await;
        let revision = put.map_err(|error| away(&error))?;
        let message = stores.nodes.stream.get_raw_message(revision).await;
        Ok(message.map_err(|error| away(&error))?.time)
    }
}

fn away(error: &dyn std::fmt::Display) -> QueueError {
    QueueError::Away(format!("benches and workers: {error}"))
}

/// A name as part of a key.
fn plain(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || matches!(c, '-' | '_') {
            c
        } else {
            '_'
        }
    };
    if name.is_empty() {
        "_".to_owned()
    } else {
        name.chars().map(plain).collect()
    }
}
