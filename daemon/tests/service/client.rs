//! Just enough HTTP to speak to the service as any client would.

use std::path::{Path, PathBuf};
use std::time::Duration;

use relief_api::{Event, Problem};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::UnixStream;

pub(crate) struct Client {
    socket: PathBuf,
}

pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

impl Reply {
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers
            .iter()
            .find(|(key, _)| key.eq_ignore_ascii_case(name))
            .map(|(_, value)| value.as_str())
    }

    fn json<T: DeserializeOwned>(&self) -> T {
        let text = String::from_utf8_lossy(&self.body);
        assert!((200..300).contains(&self.status), "{}: {text}", self.status);
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {text}"))
    }

    pub(crate) fn problem(&self) -> Problem {
        assert_eq!(self.header("content-type"), Some(Problem::MEDIA_TYPE));
        let problem: Problem = serde_json::from_slice(&self.body).unwrap();
        assert_eq!(problem.status, self.status);
        problem
    }
}

impl Client {
    pub(crate) fn new(socket: &Path) -> Self {
        Self {
            socket: socket.to_owned(),
        }
    }

    /// Sends a request and reads the whole reply. HTTP/1.0, so that it ends with the
    /// connection.
    pub(crate) async fn request(&self, method: &str, path: &str, body: Option<&str>) -> Reply {
        let stream = UnixStream::connect(&self.socket).await.unwrap();
        exchange(stream, "localhost", method, path, body).await
    }

    pub(crate) async fn get<T: DeserializeOwned>(&self, path: &str) -> T {
        self.request("GET", path, None).await.json()
    }

    pub(crate) async fn post<T: DeserializeOwned>(&self, path: &str, body: &impl Serialize) -> T {
        let body = serde_json::to_string(body).unwrap();
        self.request("POST", path, Some(&body)).await.json()
    }

    /// A POST without a body.
    pub(crate) async fn ask<T: DeserializeOwned>(&self, path: &str) -> T {
        self.request("POST", path, None).await.json()
    }

    pub(crate) async fn events(&self) -> Events {
        self.events_with("").await
    }

    /// The events since this one.
    pub(crate) async fn events_since(&self, last: &str) -> Events {
        self.events_with(&format!("Last-Event-ID: {last}\r\n"))
            .await
    }

    async fn events_with(&self, fields: &str) -> Events {
        let mut stream = UnixStream::connect(&self.socket).await.unwrap();
        let request = format!(
            "GET {} HTTP/1.0\r\nHost: localhost\r\n{fields}\r\n",
            relief_api::path::EVENTS
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut lines = BufReader::new(stream).lines();
        let first = lines.next_line().await.unwrap().unwrap();
        assert!(first.contains(" 200 "), "{first}");
        while !lines.next_line().await.unwrap().unwrap().is_empty() {}
        Events {
            lines,
            last_id: String::new(),
        }
    }
}

pub(crate) async fn exchange<S>(
    mut stream: S,
    host: &str,
    method: &str,
    path: &str,
    body: Option<&str>,
) -> Reply
where
    S: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin,
{
    let mut request = format!("{method} {path} HTTP/1.0\r\nHost: {host}\r\n");
    if let Some(body) = body {
        request += &format!(
            "Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
    } else {
        request += "\r\n";
    }
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).await.unwrap();
    let split = bytes.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
    let head = String::from_utf8(bytes[..split].to_vec()).unwrap();
    let mut lines = head.lines();
    let status = lines.next().unwrap().split(' ').nth(1).unwrap();
    Reply {
        status: status.parse().unwrap(),
        headers: lines
            .map(|line| {
                let (key, value) = line.split_once(": ").unwrap();
                (key.to_owned(), value.to_owned())
            })
            .collect(),
        body: bytes[split + 4..].to_vec(),
    }
}

/// Longer than a service has nothing to tell while a test waits for it.
const GUARD: Duration = Duration::from_secs(120);

pub(crate) struct Events {
    lines: tokio::io::Lines<BufReader<UnixStream>>,
    last_id: String,
}

impl Events {
    /// Id of the event that came last.
    pub(crate) fn last_id(&self) -> &str {
        &self.last_id
    }

    /// The next event; `None` when the service has closed the stream.
    pub(crate) async fn next(&mut self) -> Option<Event> {
        let mut kind = String::new();
        loop {
            let line = self.lines.next_line().await.unwrap()?;
            if let Some(value) = line.strip_prefix("event: ") {
                kind = value.to_owned();
            }
            if let Some(id) = line.strip_prefix("id: ") {
                id.clone_into(&mut self.last_id);
            }
            if let Some(data) = line.strip_prefix("data: ") {
                let event: Event = serde_json::from_str(data).unwrap();
                assert_eq!(event.kind(), kind);
                return Some(event);
            }
        }
    }

    /// Reads on until an event answers; gives all events up to it, and the answer.
    pub(crate) async fn until<T>(
        &mut self,
        mut find: impl FnMut(&Event) -> Option<T>,
    ) -> (Vec<Event>, T) {
        let mut seen = Vec::new();
        loop {
            let next = tokio::time::timeout(GUARD, self.next()).await;
            let event = next.unwrap_or_else(|_| panic!("nothing follows {:?}", seen.last()));
            let event = event.expect("the stream goes on");
            let found = find(&event);
            seen.push(event);
            if let Some(found) = found {
                return (seen, found);
            }
        }
    }
}
