//! The service's event stream, and waiting for what it tells.

use std::collections::VecDeque;

use anyhow::{Context, Result, bail};
use http_body_util::BodyExt;
use hyper::body::Incoming;
use relief_api::{Event, Job, JobId, JobState, Scan, ScanState};
use tokio::time::timeout;

use super::GUARD;

/// How many of the latest events a wait in vain shows.
const SHOWN: usize = 12;

/// Server-sent events, one after the other.
#[derive(Debug)]
pub struct Events {
    body: Incoming,
    text: Vec<u8>,
    ready: VecDeque<Event>,
}

impl Events {
    pub(super) fn new(body: Incoming) -> Self {
        Self {
            body,
            text: Vec::new(),
            ready: VecDeque::new(),
        }
    }

    /// The next event; `None` once the service has closed the stream.
    ///
    /// # Errors
    /// When the stream breaks, or an event is not what its kind says.
    pub async fn next(&mut self) -> Result<Option<Event>> {
        loop {
            if let Some(event) = self.ready.pop_front() {
                return Ok(Some(event));
            }
            let Some(frame) = self.body.frame().await else {
                return Ok(None);
            };
            let Ok(bytes) = frame?.into_data() else {
                continue;
            };
            self.text.extend_from_slice(&bytes);
            while let Some(at) = self.text.windows(2).position(|pair| pair == b"\n\n") {
                let block: Vec<u8> = self.text.drain(..at + 2).collect();
                self.ready.extend(parse(std::str::from_utf8(&block)?)?);
            }
        }
    }

    /// Reads on until an event answers; gives all events up to and with it, and the answer.
    ///
    /// # Errors
    /// When none does before the stream ends or [`GUARD`] has passed.
    pub async fn until<T>(
        &mut self,
        mut find: impl FnMut(&Event) -> Option<T>,
    ) -> Result<(Vec<Event>, T)> {
        let mut seen = Vec::new();
        let search = async {
            while let Some(event) = self.next().await? {
                let found = find(&event);
                seen.push(event);
                if found.is_some() {
                    return Ok(found);
                }
            }
            Ok::<_, anyhow::Error>(None)
        };
        let found = timeout(GUARD, search).await;
        let last = || {
            let from = seen.len().saturating_sub(SHOWN);
            format!("the last events were {:#?}", &seen[from..])
        };
        match found {
            Ok(Ok(Some(found))) => Ok((seen, found)),
            Ok(Ok(None)) => bail!("the service closed the stream; {}", last()),
            Ok(Err(error)) => Err(error.context(last())),
            Err(_) => bail!("waited {} s in vain; {}", GUARD.as_secs(), last()),
        }
    }

    /// Waits for a scan's end.
    ///
    /// # Errors
    /// As [`Events::until`].
    pub async fn scan_over(&mut self, id: &str) -> Result<Scan> {
        let over = |event: &Event| match event {
            Event::Scan(scan) if scan.id == id && scan.state.is_over() => Some(scan.clone()),
            _ => None,
        };
        Ok(self.until(over).await?.1)
    }

    /// Waits for a scan to be complete.
    ///
    /// # Errors
    /// When it ends otherwise, and how.
    pub async fn scan_complete(&mut self, id: &str) -> Result<Scan> {
        let scan = self.scan_over(id).await?;
        if scan.state != ScanState::Complete {
            bail!("the scan is {}: {:?}", scan.state.as_str(), scan.reason);
        }
        Ok(scan)
    }

    /// Waits until this many columns of a scan are on disk.
    ///
    /// # Errors
    /// As [`Events::until`].
    pub async fn columns(&mut self, id: &str, wanted: u32) -> Result<Vec<Event>> {
        let there = |event: &Event| match event {
            Event::Column { scan, columns, .. } if scan == id && *columns >= wanted => Some(()),
            _ => None,
        };
        Ok(self.until(there).await?.0)
    }

    /// Waits for a job to be told in a state.
    ///
    /// # Errors
    /// As [`Events::until`].
    pub async fn job_becomes(
        &mut self,
        id: JobId,
        wanted: impl Fn(JobState) -> bool,
    ) -> Result<Job> {
        let there = |event: &Event| match event {
            Event::Job(job) if job.id == id && wanted(job.state) => Some(job.clone()),
            _ => None,
        };
        Ok(self.until(there).await?.1)
    }

    /// Waits until a job has begun a stage.
    ///
    /// # Errors
    /// As [`Events::until`].
    pub async fn stage(&mut self, id: JobId, wanted: &str) -> Result<()> {
        let there = |event: &Event| match event {
            Event::Progress { job, stage, .. } if *job == id && stage == wanted => Some(()),
            _ => None,
        };
        self.until(there).await.map(drop)
    }
}

/// One block of the stream; comments alone (keep-alive) give nothing.
fn parse(block: &str) -> Result<Option<Event>> {
    let mut kind = None;
    let mut data = String::new();
    for line in block.lines() {
        if let Some(value) = line.strip_prefix("event:") {
            kind = Some(value.trim_start());
        } else if let Some(value) = line.strip_prefix("data:") {
            data += value.strip_prefix(' ').unwrap_or(value);
        }
    }
    if data.is_empty() {
        return Ok(None);
    }
    let event: Event = serde_json::from_str(&data).with_context(|| data.clone())?;
    if kind != Some(event.kind()) {
        bail!("an event is called {kind:?} and holds {data}");
    }
    Ok(Some(event))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_an_event_if_it_says_so() {
        let event = parse("event: lagged\ndata: {\"kind\":\"lagged\",\"missed\":3}\n\n");
        assert_eq!(event.unwrap(), Some(Event::Lagged { missed: 3 }));
        assert_eq!(parse(":\n\n").unwrap(), None);
        assert!(parse("event: job\ndata: {\"kind\":\"lagged\",\"missed\":3}\n\n").is_err());
        assert!(parse("event: job\ndata: {\n\n").is_err());
    }
}
