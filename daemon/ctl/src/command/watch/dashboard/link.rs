//! The line to the service, taken up again whenever it is lost.

use std::time::Duration;

use relief_api::{Event, Job, JobList, ScanImage, Status, path};
use tokio::sync::mpsc::Sender;
use tokio::sync::mpsc::error::SendError;
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

use crate::failure::with_causes;
use crate::service::{Client, Events, ServiceError};

/// How often the service is asked for its status: no event tells of room and waiting jobs, and a
/// service that is silent may hang.
const ASK_EVERY: Duration = Duration::from_secs(1);
/// A service that says nothing for so long does not work.
const PATIENCE: Duration = Duration::from_secs(5);
/// Waits between attempts to reach it, the last of them for ever.
const WAITS_MS: [u64; 4] = [250, 500, 1000, 2000];
/// Jobs that are asked for.
const JOBS: usize = 50;

/// Most nodes of a range image that are asked for: more than most terminals have dots.
const NODES: usize = 100_000;

/// What is heard of the service.
#[derive(Debug)]
pub(super) enum Word {
    /// It is there.
    Connected,
    /// It is gone, and why.
    Lost(String),
    /// Something happened.
    Event(Box<Event>),
    /// How it stands.
    Status(Box<Status>),
    /// Its latest jobs, newest first.
    Jobs(Vec<Job>),
    /// The range image of a scan under way as far as it has come.
    Image(Box<ScanImage>),
    /// What came of something that was asked of it.
    Answer(Result<String, String>),
}

/// Tells all that is heard until nobody listens.
pub(super) async fn keep(client: Client, first: Events, words: Sender<Word>) {
    let mut events = Some(first);
    let mut attempts = 0;
    loop {
        let stream = match events.take() {
            Some(events) => Ok(events),
            None => match timeout(PATIENCE, client.events()).await {
                Ok(stream) => stream.map_err(|error| with_causes(&error)),
                Err(_) => Err("the service does not answer".to_owned()),
            },
        };
        let lost = match stream {
            Ok(stream) => {
                attempts = 0;
                match listen(&client, stream, &words).await {
                    Ok(why) => why,
                    Err(_) => return,
                }
            }
            Err(why) => why,
        };
        if words.send(Word::Lost(lost)).await.is_err() {
            return;
        }
        let wait = WAITS_MS.get(attempts).or(WAITS_MS.last());
        sleep(Duration::from_millis(wait.copied().unwrap_or_default())).await;
        attempts += 1;
    }
}

/// Passes on what a stream tells; gives why it ended.
async fn listen(
    client: &Client,
    mut events: Events,
    words: &Sender<Word>,
) -> Result<String, SendError<Word>> {
    words.send(Word::Connected).await?;
    let mut asking = interval(ASK_EVERY);
    asking.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut wants_jobs = true;
    // Scans whose columns of before are known.
    let mut pictured = Vec::new();
    loop {
        if wants_jobs {
            match ask::<JobList>(client, &format!("{}?limit={JOBS}", path::JOBS)).await {
                Ok(mut list) => {
                    list.jobs.truncate(JOBS);
                    words.send(Word::Jobs(list.jobs)).await?;
                }
                Err(why) => return Ok(why),
            }
            wants_jobs = false;
        }
        tokio::select! {
            event = events.next() => match event {
                Ok(Some(event)) => {
                    wants_jobs = matches!(event, Event::Lagged { .. });
                    if wants_jobs {
                        pictured.clear();
                    }
                    words.send(Word::Event(Box::new(event))).await?;
                }
                Ok(None) => return Ok("the service has ended".to_owned()),
                Err(error) => return Ok(with_causes(&error)),
            },
            _ = asking.tick() => match ask(client, path::STATUS).await {
                Ok(status) => {
                    let scans = under_way(&status);
                    words.send(Word::Status(Box::new(status))).await?;
                    pictured.retain(|id| scans.contains(id));
                    for id in scans {
                        // Where it has none yet, it is asked for once more.
                        let image = format!("{}?most_nodes={NODES}", path::scan_image(&id));
                        if !pictured.contains(&id) && let Ok(image) = ask(client, &image).await {
                            words.send(Word::Image(Box::new(image))).await?;
                            pictured.push(id);
                        }
                    }
                }
                Err(why) => return Ok(why),
            },
        }
    }
}

/// Ids of the scans under way.
fn under_way(status: &Status) -> Vec<String> {
    let scans = status.scanners.iter().map(|scanner| scanner.scan.as_ref());
    let mut ids: Vec<String> = scans
        .chain([status.scan.as_ref()])
        .flatten()
        .map(|scan| scan.id.clone())
        .collect();
    ids.dedup();
    ids
}

async fn ask<T: serde::de::DeserializeOwned>(client: &Client, path: &str) -> Result<T, String> {
    let asked: Result<T, ServiceError> = match timeout(PATIENCE, client.get(path)).await {
        Ok(asked) => asked,
        Err(_) => return Err("the service does not answer".to_owned()),
    };
    asked.map_err(|error| with_causes(&error))
}
