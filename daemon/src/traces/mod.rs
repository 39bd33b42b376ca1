//! Traces for an OpenTelemetry collector (OTLP over HTTP, as JSON): how long scans took, and jobs
//! with their stages.
//!
//! ```text
//! a scan's or job's record, once it has ended --> spans --> thread --> collector
//! ```
//!
//! Nobody waits for the collector, and nothing is kept for it: what it does not take in time is
//! lost, and the log says so once. [`crate::receivers`] are for what must arrive.

mod spans;

use std::collections::HashMap;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use async_trait::async_trait;
use axum::body::Bytes;
use axum::http::{HeaderName, HeaderValue};
use opentelemetry::KeyValue;
use opentelemetry_http::{HttpClient, HttpError};
use opentelemetry_otlp::{Protocol, SpanExporter as Exporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SpanData, SpanExporter};
use relief_api::{Job, Scan};
use ureq::Agent;
use ureq::http::{Request, Response};

use crate::config::TracesConfig;
use crate::receivers::{FileError, agent, host_name, read_secret};

/// What waits for the collector at most: records of scans and jobs.
const MOST_WAITING: usize = 256;
/// Spans in a request at most.
const MOST_AT_ONCE: usize = 512;
/// Bytes of an answer that are looked at.
const MOST_ANSWER_BYTES: u64 = 1 << 16;
/// How long the end of the service waits for the collector.
const FAREWELL: Duration = Duration::from_secs(3);
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// Tells a collector, if there is one.
#[derive(Debug, Default)]
pub(crate) struct Traces {
    line: Mutex<Option<Line>>,
}

/// The way to the thread that tells.
#[derive(Debug)]
struct Line {
    waiting: SyncSender<Vec<SpanData>>,
    thread: JoinHandle<()>,
    /// What was lost is told once.
    has_lost: bool,
}

/// The collector cannot be told.
#[derive(Debug, thiserror::Error)]
#[error("[traces] {0}")]
pub struct TracesError(String);

/// Posts what the exporter has put into words.
#[derive(Debug)]
struct Poster(Agent);

#[async_trait]
impl HttpClient for Poster {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        // On the thread of the traces, where nobody else waits.
        let (head, body) = request.into_parts();
        let answer = self.0.run(Request::from_parts(head, &body[..]))?;
        let (head, mut body) = answer.into_parts();
        let body = body.with_config().limit(MOST_ANSWER_BYTES).read_to_vec()?;
        Ok(Response::from_parts(head, body.into()))
    }
}

/// Fields of a request, of the lines of a file.
fn headers_in(path: &Path) -> Result<HashMap<String, String>, FileError> {
    const KEY: &str = "headers_file";
    let text = read_secret(KEY, "fields", path)?;
    let mut headers = HashMap::new();
    for (number, line) in text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
    {
        let parts = line
            .split_once(':')
            .map(|(name, value)| (name, value.trim()));
        let sound = parts.filter(|(name, value)| {
            let is_name = HeaderName::from_bytes(name.as_bytes()).is_ok();
            is_name && HeaderValue::from_str(value).is_ok()
        });
        let Some((name, value)) = sound else {
            // Without the line itself, which may be secret.
            let message = format!(
                "{} is to hold lines such as \"authorization: Bearer ...\"; line {} is none",
                path.display(),
                number + 1
            );
            return Err(FileError::new(KEY, message));
        };
        headers.insert(name.to_owned(), value.to_owned());
    }
    Ok(headers)
}

/// Looks at the files that the section names.
pub(crate) fn check_files(config: &TracesConfig) -> Result<(), FileError> {
    parts(config).map(drop)
}

/// What files make of a configuration: who posts, and with which fields.
fn parts(config: &TracesConfig) -> Result<(Agent, HashMap<String, String>), FileError> {
    let headers = config.headers_file.as_deref().map(headers_in);
    let url = config.collector.as_deref().unwrap_or_default();
    let agent = agent(url, config.ca_file.as_deref(), config.timeout())?;
    Ok((agent, headers.transpose()?.unwrap_or_default()))
}

fn exporter(collector: &str, config: &TracesConfig) -> Result<Exporter, String> {
    let (agent, headers) = parts(config).map_err(|error| error.to_string())?;
    let mut exporter = Exporter::builder()
        .with_http()
        .with_http_client(Poster(agent))
        .with_headers(headers)
        .with_protocol(Protocol::HttpJson)
        .with_endpoint(format!("{}/v1/traces", collector.trim_end_matches('/')))
        .with_timeout(config.timeout())
        .build()
        .map_err(|error| error.to_string())?;
    let attributes = [
        KeyValue::new("service.name", "reliefd"),
        KeyValue::new("service.version", env!("CARGO_PKG_VERSION")),
        KeyValue::new("host.name", host_name()),
    ];
    let resource = Resource::builder_empty().with_attributes(attributes);
    exporter.set_resource(&resource.build());
    Ok(exporter)
}

impl Traces {
    /// Gets ready to tell the collector that the configuration names, if it names one.
    ///
    /// # Errors
    /// A file that it names does not work, or there are no more threads.
    pub(crate) fn start(config: &TracesConfig) -> Result<Self, TracesError> {
        let Some(collector) = config.collector.as_deref() else {
            return Ok(Self::default());
        };
        let exporter = exporter(collector, config).map_err(TracesError)?;
        let (waiting, heard) = sync_channel(MOST_WAITING);
        let thread = std::thread::Builder::new()
            .name("traces".into())
            .spawn(move || tell(&exporter, &heard))
            .map_err(|error| TracesError(format!("cannot start a thread: {error}")))?;
        let has_lost = false;
        let line = Some(Line {
            waiting,
            thread,
            has_lost,
        });
        Ok(Self {
            line: Mutex::new(line),
        })
    }

    /// A scan has ended.
    pub(crate) fn scan_ended(&self, scan: &Scan) {
        self.put(|| spans::of_scan(scan).into_iter().collect());
    }

    /// An attempt at a job has ended.
    pub(crate) fn job_ended(&self, job: &Job) {
        self.put(|| spans::of_job(job));
    }

    fn put(&self, spans: impl FnOnce() -> Vec<SpanData>) {
        let mut line = self.line.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(line) = &mut *line else { return };
        let spans = spans();
        if !spans.is_empty() && line.waiting.try_send(spans).is_err() && !line.has_lost {
            line.has_lost = true;
            tracing::warn!("traces are lost: the collector takes them too slowly");
        }
    }

    /// Tells what still waits, for a while.
    pub(crate) fn end(&self) {
        let line = self
            .line
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        let Some(line) = line else { return };
        drop(line.waiting);
        let since = Instant::now();
        while !line.thread.is_finished() && since.elapsed() < FAREWELL {
            std::thread::sleep(LOOK_AGAIN);
        }
    }
}

/// Tells the collector until nothing more comes.
fn tell(exporter: &Exporter, heard: &Receiver<Vec<SpanData>>) {
    let mut is_heard = true;
    while let Ok(mut spans) = heard.recv() {
        while spans.len() < MOST_AT_ONCE
            && let Ok(more) = heard.try_recv()
        {
            spans.extend(more);
        }
        let told = futures_executor::block_on(exporter.export(spans));
        match &told {
            Err(error) if is_heard => {
                tracing::warn!(%error, "the collector takes no traces; those of meanwhile are lost");
            }
            Ok(()) if !is_heard => tracing::info!("the collector takes traces again"),
            _ => {}
        }
        is_heard = told.is_ok();
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn fields_are_read_from_lines_and_no_line_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields");
        let write = |text: &str| {
            fs::write(&path, text).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        };
        write("authorization: Bearer hunter2\n\nx-tenant:lab\n");
        let headers = headers_in(&path).unwrap();
        assert_eq!(headers["authorization"], "Bearer hunter2");
        assert_eq!((headers["x-tenant"].as_str(), headers.len()), ("lab", 2));
        for text in [
            "x: 1\nhunter2\n",
            "x: 1\na b: hunter2\n",
            "x: 1\ny: \u{1}hunter2\n",
        ] {
            write(text);
            let error = headers_in(&path).unwrap_err().to_string();
            assert!(error.contains("line 2 is none"), "{error}");
            assert!(!error.contains("hunter2"), "{error}");
        }
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let error = headers_in(&path).unwrap_err().to_string();
        assert!(error.contains("may be used by others"), "{error}");
    }
}
