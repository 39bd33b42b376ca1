//! The stream of orders, and the buckets of standings, benches and workers.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::time::Duration;

use async_nats::Client;
use async_nats::jetstream::kv::Store;
use async_nats::jetstream::stream::{
    Config, DiscardPolicy, LastRawMessageErrorKind, RetentionPolicy, Stream,
};
use async_nats::jetstream::{self, Context};

use super::names::Names;
use super::options::{ANSWER, Options};
use crate::QueueError;

/// After how long a bench or worker that gives no sign of life is not listed any more.
const NODE_AGE: Duration = Duration::from_secs(60);

/// What the server keeps for all.
#[derive(Debug)]
pub(crate) struct Stores {
    pub(crate) context: Context,
    pub(crate) client: Client,
    /// What requests begin with.
    pub(crate) api: String,
    pub(crate) orders: Stream,
    pub(crate) standings: Store,
    pub(crate) nodes: Store,
}

impl Stores {
    /// Finds them, or makes those that are missing.
    pub(crate) async fn open(
        client: Client,
        options: &Options,
        names: &Names,
    ) -> Result<Self, QueueError> {
        let mut context = jetstream::with_prefix(client.clone(), &options.api());
        context.set_timeout(ANSWER);
        let orders = Config {
            name: names.orders(),
            description: Some("orders that wait for a worker".to_owned()),
            subjects: vec![names.every_order()],
            retention: RetentionPolicy::WorkQueue,
            discard: DiscardPolicy::New,
            // The same turn has the same subject: it cannot be there twice.
            max_messages_per_subject: 1,
            discard_new_per_subject: true,
            max_messages: i64::try_from(options.quota_jobs).unwrap_or(i64::MAX),
            num_replicas: options.replicas,
            ..Config::default()
        };
        let orders = find_or_make(&context, orders, options.makes_missing).await?;
        let config = &orders.cached_info().config;
        if config.retention != RetentionPolicy::WorkQueue
            || config.max_messages_per_subject != 1
            || !config.discard_new_per_subject
        {
            return Err(QueueError::Refused(format!(
                "the stream {} keeps its messages otherwise than orders have to be kept \
                 (retention workqueue, one message for each subject, new ones discarded): remove \
                 it, or give another prefix",
                names.orders()
            )));
        }
        let standings = bucket(
            &context,
            options,
            names.standings(),
            "where orders stand",
            Duration::ZERO,
        );
        let standings = standings.await?;
        let nodes = bucket(
            &context,
            options,
            names.nodes(),
            "benches and workers",
            NODE_AGE,
        );
        let nodes = nodes.await?;
        Ok(Self {
            context,
            client,
            api: options.api(),
            orders,
            standings,
            nodes,
        })
    }
}

async fn bucket(
    context: &Context,
    options: &Options,
    name: String,
    description: &str,
    max_age: Duration,
) -> Result<Store, QueueError> {
    let config = Config {
        name: format!("KV_{name}"),
        description: Some(description.to_owned()),
        subjects: vec![format!("$KV.{name}.>")],
        max_messages_per_subject: 1,
        discard: DiscardPolicy::New,
        max_age,
        allow_rollup: true,
        deny_delete: true,
        // Read from the leader alone: a follower may not have yet what speaks for an order.
        allow_direct: false,
        num_replicas: options.replicas,
        ..Config::default()
    };
    let stream = find_or_make(context, config, options.makes_missing).await?;
    Ok(Store {
        stream_name: format!("KV_{name}"),
        prefix: format!("$KV.{name}."),
        put_prefix: None,
        // Between domains a bucket is written by way of the API alone.
        use_jetstream_prefix: options.domain.is_some(),
        name,
        stream,
    })
}

/// A stream, which is made if it is missing and may be made.
pub(crate) async fn find_or_make(
    context: &Context,
    config: Config,
    makes_missing: bool,
) -> Result<Stream, QueueError> {
    use async_nats::jetstream::context::GetStreamErrorKind::JetStream;
    let (name, most) = (config.name.clone(), config.max_bytes);
    let error = match context.get_stream(&name).await {
        Ok(stream) => return Ok(stream),
        Err(error) => error,
    };
    if !matches!(error.kind(), JetStream(error) if error.code() == 404) {
        return Err(QueueError::Away(format!("stream {name}: {error}")));
    }
    if !makes_missing {
        return Err(QueueError::Away(format!(
            "NATS has no stream {name} yet: a bench makes it when it first offers a job"
        )));
    }
    let error = match context.create_stream(config).await {
        Ok(stream) => return Ok(stream),
        Err(error) => error,
    };
    if error.to_string().contains("insufficient storage") {
        return Err(QueueError::Full(format!(
            "NATS cannot promise the {most} bytes of {name}: lower the bench's quota, or give the \
             servers more room (max_file_store)"
        )));
    }
    // Somebody else may have been faster, with other limits.
    let found = context.get_stream(&name).await;
    found.map_err(|_| QueueError::Away(format!("stream {name} cannot be made: {error}")))
}

/// Whether a message is still in the stream.
pub(crate) async fn is_there(stream: &Stream, sequence: u64) -> Result<bool, QueueError> {
    match stream.get_raw_message(sequence).await {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(false),
        Err(error) => Err(QueueError::Away(format!("a message: {error}"))),
    }
}

/// A name that no other has.
pub(crate) fn random_name() -> String {
    // The keys of the standard library's hash maps are random.
    let number = || RandomState::new().build_hasher().finish();
    format!("{:016x}{:016x}", number(), number())
}
