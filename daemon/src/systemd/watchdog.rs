//! The watchdog's food.
//!
//! There is no timer that feeds whatever happens. Each meal is earned: a task of the runtime
//! that serves the API has a blocking thread ask the service for its status, as a request
//! would, and look at all loops. A runtime whose threads are stuck, a lock that is never given
//! back, a loop that does not turn: each of them lets the watchdog starve, and systemd puts
//! another service in this one's place. The scanner meanwhile turns its laser off by itself.

use std::sync::Arc;
use std::time::{Duration, Instant};

use relief_api::{Scan, ScanState, ScannerStatus, Status};
use sd_notify::NotifyState;

use crate::liveness::Stuck;
use crate::service::Service;

/// How often the status is told where nobody watches.
const UNWATCHED: Duration = Duration::from_secs(5);

/// Meals in the watchdog's time: one may come late, and one be lost.
const MEALS: u32 = 4;

/// Tells how the service does. It keeps nothing alive.
#[derive(Clone)]
pub struct Health(Arc<Service>);

impl std::fmt::Debug for Health {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Health")
    }
}

impl Health {
    pub(crate) fn new(service: &Arc<Service>) -> Self {
        Self(Arc::clone(service))
    }

    /// One line on what the service does, if all of it is alive. May block.
    pub(super) fn look(&self) -> Result<String, Stuck> {
        self.0.liveness.check(Instant::now())?;
        Ok(line(&self.0.status()))
    }
}

pub(super) fn interval(watchdog: Option<Duration>) -> Duration {
    watchdog.map_or(UNWATCHED, |longest| UNWATCHED.min(longest / MEALS))
}

/// Looks and tells, for ever.
pub(super) async fn run(
    interval: Duration,
    look: impl Fn() -> Result<String, Stuck> + Clone + Send + 'static,
    tell: impl Fn(&[NotifyState<'_>]),
) {
    loop {
        match tokio::task::spawn_blocking(look.clone()).await {
            Ok(Ok(status)) => {
                tell(&[NotifyState::Watchdog, NotifyState::Status(&status)]);
            }
            Ok(Err(stuck)) => {
                tracing::error!(%stuck, "the service is not well");
                tell(&[NotifyState::Status(&stuck.to_string())]);
            }
            Err(error) => tracing::error!(%error, "cannot see how the service does"),
        }
        tokio::time::sleep(interval).await;
    }
}

fn line(status: &Status) -> String {
    let mut line = match status.scanners.as_slice() {
        several @ [_, _, ..] => several
            .iter()
            .map(|one| format!("{}: {}", one.status.name, of_one(&one.status, &one.scan)))
            .collect::<Vec<_>>()
            .join("; "),
        _ => of_one(&status.scanner, &status.scan),
    };
    if status.jobs_running + status.jobs_queued > 0 {
        line += &format!(
            "; jobs: {} running, {} waiting",
            status.jobs_running, status.jobs_queued
        );
    }
    // Whatever a device says of itself: another line would be another message to systemd.
    line.replace(char::is_control, " ")
}

fn of_one(scanner: &ScannerStatus, scan: &Option<Scan>) -> String {
    match (scan, &scanner.problem) {
        (Some(scan), _) => {
            let (columns, planned) = (scan.columns, scan.columns_planned);
            let paused = match (scan.state, &scan.reason) {
                (ScanState::Paused, Some(reason)) => format!(", paused: {reason}"),
                (ScanState::Paused, None) => ", paused".into(),
                _ => String::new(),
            };
            format!("scan {}: {columns} of {planned} columns{paused}", scan.id)
        }
        (None, Some(problem)) => format!("no scan; scanner in trouble: {problem}"),
        (None, None) => format!("no scan; scanner {}", scanner.link.as_str()),
    }
}

#[cfg(test)]
mod tests;
