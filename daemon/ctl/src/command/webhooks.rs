//! `relief webhooks`.

use relief_api::{
    Delivery, DeliveryAttempt, DeliveryList, DeliveryState, Webhook, WebhookEvent, WebhookList,
    path,
};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Show who is told by webhook, MQTT or mail, what became of the messages, and test it
///
/// A receiver of messages is a section of the service's configuration: [[webhooks]], a URL that is
/// told when a scan or a job is done; [[mqtt]], a broker; [[mail]], people who are written to. Without
/// a further word, all of them are listed with what was last tried.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Show the messages that wait for a receiver, and the latest of the others, with every attempt
    Log {
        /// The webhook, broker or mail
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
    /// Send a message of the type `test` at once, and show what comes back
    Test {
        /// The webhook, broker or mail
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.action {
        None => args.endpoint.show(path::WEBHOOKS, json, list).await,
        Some(Action::Log { name, endpoint }) => {
            let path = path::webhook_deliveries(&name);
            endpoint.show(&path, json, log).await
        }
        Some(Action::Test { name, endpoint }) => test(&name, &endpoint, json).await,
    }
}

fn list(list: &WebhookList) -> String {
    if list.webhooks.is_empty() {
        return "nobody is told: sections [[webhooks]], [[mqtt]] and [[mail]] of the configuration \
                name who is"
            .into();
    }
    let lines = list.webhooks.iter().map(|webhook| {
        let events: Vec<&str> = webhook.events.iter().map(|event| event.as_str()).collect();
        vec![
            webhook.name.clone(),
            webhook.kind.as_str().to_owned(),
            webhook.url.clone(),
            events.join(" "),
            webhook.waiting.to_string(),
            latest(webhook),
        ]
    });
    output::table(
        &["NAME", "KIND", "URL", "EVENTS", "WAITING", "LATEST"],
        &[4],
        lines,
    )
}

fn latest(webhook: &Webhook) -> String {
    let latest = match &webhook.latest {
        Some(delivery) => {
            let (event, state) = (delivery.event.as_str(), state(delivery));
            match delivery.tried.last() {
                Some(tried) => format!("{event} {state}: {}: {}", tried.at, outcome(tried)),
                None => format!("{event} {state}"),
            }
        }
        None => "nothing yet".into(),
    };
    match webhook.dropped {
        0 => latest,
        dropped => {
            let messages =
                output::counted(usize::try_from(dropped).unwrap_or(usize::MAX), "message");
            format!("{latest} ({messages} had to make room)")
        }
    }
}

fn log(list: &DeliveryList) -> String {
    if list.deliveries.is_empty() {
        return "no messages yet".into();
    }
    let lines = list.deliveries.iter().flat_map(|delivery| {
        let about = delivery.about.clone().unwrap_or_default();
        let told = vec![
            delivery.created_at.clone(),
            delivery.event.as_str().to_owned(),
            about,
            state(delivery),
        ];
        let left_out =
            delivery.attempts as usize - delivery.tried.len().min(delivery.attempts as usize);
        let earlier = (left_out > 0).then(|| {
            let left_out = output::counted(left_out, "earlier attempt");
            vec![String::new(), String::new(), String::new(), left_out]
        });
        let tried = delivery.tried.iter().map(|tried| {
            let outcome = outcome(tried);
            vec![
                String::new(),
                String::new(),
                String::new(),
                format!("{} ({} ms): {outcome}", tried.at, tried.milliseconds),
            ]
        });
        let lines: Vec<Vec<String>> = std::iter::once(told).chain(earlier).chain(tried).collect();
        lines
    });
    output::table(&["MADE", "EVENT", "ABOUT", "STATE"], &[], lines)
}

fn state(delivery: &Delivery) -> String {
    match (delivery.state, &delivery.next_attempt_at) {
        (DeliveryState::Waiting, Some(at)) => format!("waiting, next at {at}"),
        (DeliveryState::GivenUp, _) if delivery.event == WebhookEvent::Test => "not taken".into(),
        (state, _) => state.as_str().replace('_', " "),
    }
}

fn outcome(tried: &DeliveryAttempt) -> String {
    let status = tried.status.map(|status| format!("taken ({status})"));
    let told = tried.error.clone().or(status);
    // Brokers acknowledge, and say nothing.
    let told = told.unwrap_or_else(|| "taken".into());
    match &tried.answer {
        Some(answer) => format!("{told}; it said: {answer}"),
        None => told,
    }
}

async fn test(name: &str, endpoint: &EndpointArgs, json: bool) -> Result<(), Failure> {
    let client = endpoint.client()?;
    let tested: Delivery = client
        .post(&path::webhook_test(name), &serde_json::json!({}))
        .await?;
    let taken = tested.state == DeliveryState::Delivered;
    let outcome = tested.tried.last().map(outcome).unwrap_or_default();
    // Programs get the document in either case.
    if json || taken {
        output::either(json, &tested, |_| format!("{name}: {outcome}"))?;
    }
    if taken {
        Ok(())
    } else {
        Err(Failure::Failed(format!("{name} was not told: {outcome}")))
    }
}
