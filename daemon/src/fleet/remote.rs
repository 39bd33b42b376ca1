//! How a result is made far from its bench: columns come from the bench's depot, and the result
//! goes there.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use deliverables::Pictures;
use job_queue::depot::{Depot, Kind};
use job_queue::{Lease, Order, QueueError};
use range_image::Monitor;
use storage::LocalDisk;

use super::attendance::Attendance;
use super::order::{Answer, Delivered, Work};
use crate::jobs::{Craft, Halt, Made, Names, Progress, Workpiece};

/// How long it waits before it tries again what the servers did not do.
const PAUSE: Duration = Duration::from_secs(1);
/// How often it looks for columns before it says that they are not there: a server that has just
/// begun to lead may not know yet what it has.
const LOOKS: u32 = 4;

/// Makes results for benches elsewhere.
pub(super) struct Remote<'a> {
    pub(super) name: &'a str,
    pub(super) depot: &'a Depot,
    /// Where files are kept while a job is worked on.
    pub(super) folder: &'a Path,
    /// Threads of a job.
    pub(super) threads: &'a dyn Fn() -> usize,
    /// Waits so long, and tells whether the worker is to stop.
    pub(super) is_to_stop: &'a (dyn Fn(Duration) -> bool + Sync),
    pub(super) attendance: &'a Attendance,
}

impl Craft for Remote<'_> {
    fn make(&self, lease: &dyn Lease, progress: &Progress<'_>) -> Made {
        self.attendance.is_at(self.name, Some(&lease.order().key));
        let made = self.deliver(lease, progress);
        self.attendance.is_at(self.name, None);
        match made {
            Ok((result, left_out)) => Made::Done { result, left_out },
            Err(Halt::Asked) => Made::Stopped,
            Err(Halt::Failed { error, hint }) => Made::Failed { error, hint },
        }
    }

    fn names(&self, order: &Order) -> Names {
        let scan = order.body.pointer("/scan/id");
        Names {
            job: order.key.to_string(),
            scan: scan
                .and_then(serde_json::Value::as_str)
                .unwrap_or_default()
                .to_owned(),
        }
    }

    fn discard(&self, lease: &dyn Lease) {
        let folder = self.folder_of(lease);
        if folder.exists()
            && let Err(error) = std::fs::remove_dir_all(&folder)
        {
            tracing::warn!(folder = %folder.display(), %error, "cannot remove what a job has left");
        }
    }
}

impl Remote<'_> {
    fn folder_of(&self, lease: &dyn Lease) -> PathBuf {
        self.folder
            .join(format!("{}-{}", self.name, lease.order().key))
    }

    fn deliver(
        &self,
        lease: &dyn Lease,
        progress: &Progress<'_>,
    ) -> Result<(serde_json::Value, Vec<String>), Halt> {
        let order = lease.order();
        let bench = &order.key.bench;
        let work: Work = serde_json::from_value(order.body.clone()).map_err(|error| {
            let error = format!(
                "this worker cannot read the order of job {}: {error}",
                order.key
            );
            Halt::failed(
                error,
                Some("run the same version of Relief on benches and workers"),
            )
        })?;
        // Of an attempt that ended with its process.
        self.discard(lease);
        let folder = self.folder_of(lease);
        let incoming = folder.join("result");
        let journal = folder.join("journal.scan");
        let here = |path: &Path| {
            let path = path.display().to_string();
            move |error: std::io::Error| {
                Halt::failed(
                    format!("the worker {} cannot write {path}: {error}", self.name),
                    Some("make room on the worker's disk, then retry the job"),
                )
            }
        };
        std::fs::create_dir_all(&incoming).map_err(here(&incoming))?;

        progress.begin("fetch");
        let mut looks = 1;
        let fetched = self.patiently(progress, || {
            let file = File::create(&journal).map_err(here(&journal))?;
            let mut file = BufWriter::new(file);
            let fetched = self
                .depot
                .fetch(bench, Kind::Journal, &work.journal, &mut file);
            file.flush().map_err(here(&journal))?;
            Ok(match fetched {
                Err(QueueError::Damaged { what, why }) if looks < LOOKS => {
                    looks += 1;
                    Err(QueueError::Away(format!("{what}: {why}")))
                }
                Err(QueueError::Damaged { what, why }) => Ok(Err(format!("{what}: {why}"))),
                other => other.map(Ok),
            })
        })?;
        if let Err(missing) = fetched {
            return Ok((told(&Answer::Missing(missing))?, Vec::new()));
        }
        let piece = Workpiece {
            disk: &LocalDisk,
            job: &work.job,
            scan: &work.scan,
            journal: &journal,
            grid: None,
            threads: (self.threads)(),
            pictures: Pictures::Drawn,
            incoming: &incoming,
        };
        let left_out = piece.make(progress)?;
        progress.check()?;
        progress.begin("deliver");
        let bundle = self.patiently(progress, || {
            Ok(self.depot.put_bundle(
                bench,
                Kind::Result,
                files_in(&incoming).map_err(here(&incoming))?,
            ))
        })?;
        self.discard(lease);
        let delivered = Delivered {
            bundle,
            version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        Ok((told(&Answer::Delivered(delivered))?, left_out))
    }

    /// Does something with the servers, for as long as they are away.
    fn patiently<T>(
        &self,
        progress: &Progress<'_>,
        mut attempt: impl FnMut() -> Result<Result<T, QueueError>, Halt>,
    ) -> Result<T, Halt> {
        loop {
            progress.check()?;
            match attempt()? {
                Ok(done) => return Ok(done),
                Err(error @ (QueueError::Away(_) | QueueError::Full(_))) => {
                    tracing::warn!(%error, "trying again");
                    if (self.is_to_stop)(PAUSE) {
                        return Err(Halt::Asked);
                    }
                }
                Err(error) => return Err(Halt::failed(error, None)),
            }
        }
    }
}

fn told(answer: &Answer) -> Result<serde_json::Value, Halt> {
    serde_json::to_value(answer)
        .map_err(|error| Halt::failed(format!("the result cannot be told: {error}"), None))
}

/// The files of a folder, by name.
fn files_in(folder: &Path) -> std::io::Result<Vec<(String, Box<dyn std::io::Read>)>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort();
    let open = |name: String| {
        let file: Box<dyn std::io::Read> = Box::new(File::open(folder.join(&name))?);
        Ok((name, file))
    };
    names.into_iter().map(open).collect()
}
