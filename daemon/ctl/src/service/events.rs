//! The service's events, as they come in (server-sent events).

use http_body_util::BodyExt;
use hyper::body::Incoming;
use relief_api::Event;

use super::{Endpoint, ServiceError};

/// An event larger than this is not from our service.
const MAX_EVENT_BYTES: usize = 16 << 20;

/// A stream of events.
pub(crate) struct Events {
    endpoint: Endpoint,
    body: Incoming,
    parser: Parser,
}

impl Events {
    pub(super) fn new(endpoint: Endpoint, body: Incoming) -> Self {
        Self {
            endpoint,
            body,
            parser: Parser::default(),
        }
    }

    /// The next event; `None` when the service has ended the stream. Kinds of event that
    /// this program does not know are passed over. Safe to drop while waiting.
    pub(crate) async fn next(&mut self) -> Result<Option<Event>, ServiceError> {
        loop {
            while let Some(data) = self.parser.next_data() {
                if let Ok(event) = serde_json::from_str(&data) {
                    return Ok(Some(event));
                }
            }
            let Some(frame) = self.body.frame().await else {
                return Ok(None);
            };
            let frame = frame.map_err(|error| ServiceError::Broken {
                endpoint: self.endpoint.clone(),
                detail: error.to_string(),
            })?;
            if let Some(bytes) = frame.data_ref() {
                self.parser.push(bytes);
            }
            if self.parser.pending() > MAX_EVENT_BYTES {
                return Err(ServiceError::NotOurs {
                    endpoint: self.endpoint.clone(),
                    detail: format!("an event has more than {MAX_EVENT_BYTES} bytes"),
                });
            }
        }
    }
}

/// Splits the bytes of an event stream into the `data` of its events, however the bytes
/// are cut (WHATWG HTML, section 9.2.6).
#[derive(Default)]
struct Parser {
    bytes: Vec<u8>,
    start: usize,
    data: Vec<String>,
}

impl Parser {
    fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.start);
        self.start = 0;
        self.bytes.extend_from_slice(bytes);
    }

    fn pending(&self) -> usize {
        self.bytes.len() - self.start + self.data.iter().map(String::len).sum::<usize>()
    }

    fn next_data(&mut self) -> Option<String> {
        loop {
            let rest = self.bytes.get(self.start..)?;
            let end = rest.iter().position(|&b| b == b'\n')?;
            let line = String::from_utf8_lossy(rest.get(..end)?).into_owned();
            self.start += end + 1;
            let line = line.strip_suffix('\r').unwrap_or(&line);
            if line.is_empty() {
                if !self.data.is_empty() {
                    return Some(std::mem::take(&mut self.data).join("\n"));
                }
            } else if let Some(value) = line.strip_prefix("data:") {
                self.data
                    .push(value.strip_prefix(' ').unwrap_or(value).to_owned());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_out_whole_however_the_bytes_are_cut() {
        let stream =
            b": hello\n\nevent: job\ndata: {\"a\":\ndata: 1}\n\ndata:x\r\n\r\nid: 7\n\ndata: cut";
        for cut in 1..stream.len() {
            let mut parser = Parser::default();
            let mut found = Vec::new();
            for piece in stream.chunks(cut) {
                parser.push(piece);
                found.extend(std::iter::from_fn(|| parser.next_data()));
            }
            assert_eq!(found, ["{\"a\":\n1}", "x"], "pieces of {cut}");
        }
    }
}
