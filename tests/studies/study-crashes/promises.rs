//! What the service has promised, and whether it holds.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use deliverables::{MANIFEST_NAME, Manifest};
use relief_api::{Job, JobList, JobState, Scan, ScanList, ScanState, path};
use relief_tests::rig::{Client, journal_columns};
use scan_record::RawColumn;

/// What somebody outside relies on.
pub(crate) struct Promises {
    folder: PathBuf,
    /// Columns acknowledged, by scan.
    scans: BTreeMap<String, u32>,
    /// Results that were told.
    published: BTreeSet<String>,
    /// Results that were seen whole: their files' sizes and sums, as the manifest has them.
    seen: BTreeMap<String, Vec<u8>>,
    /// Jobs that were begun too often without an end.
    given_up: u32,
    /// Complete scans that were cut short before.
    gone_on_with: usize,
    /// What every complete scan has in it: the scanner measures the same each time.
    columns: Vec<RawColumn>,
}

impl Promises {
    pub(crate) fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            scans: BTreeMap::new(),
            published: BTreeSet::new(),
            seen: BTreeMap::new(),
            given_up: 0,
            gone_on_with: 0,
            columns: Vec::new(),
        }
    }

    pub(crate) fn accepted(&mut self, scan: &Scan) {
        self.scans.entry(scan.id.clone()).or_default();
    }

    pub(crate) fn acknowledged(&mut self, scan: &Scan, columns: u32) {
        let kept = self.scans.entry(scan.id.clone()).or_default();
        *kept = columns.max(*kept);
    }

    pub(crate) fn published(&mut self, result: &str) {
        self.published.insert(result.to_owned());
    }

    pub(crate) fn is_published(&self, result: &str) -> bool {
        self.published.contains(result)
    }

    pub(crate) fn scans(&self) -> usize {
        self.scans.len()
    }

    pub(crate) fn columns(&self) -> u64 {
        self.scans.values().map(|&columns| u64::from(columns)).sum()
    }

    pub(crate) fn given_up(&self) -> u32 {
        self.given_up
    }

    pub(crate) fn gone_on_with(&self) -> usize {
        self.gone_on_with
    }

    pub(crate) fn results(&self) -> usize {
        self.seen.len()
    }

    /// Every result in the spool is whole, none has changed since it was first seen, and
    /// none that was told is missing.
    pub(crate) fn check_spool(&mut self) -> Result<()> {
        let spool = self.folder.join("spool");
        let mut there = BTreeSet::new();
        if spool.is_dir() {
            for entry in std::fs::read_dir(&spool)? {
                let name = entry?.file_name().to_string_lossy().into_owned();
                if !name.starts_with('.') {
                    there.insert(name);
                }
            }
        }
        for result in &there {
            let folder = spool.join(result);
            let manifest = std::fs::read(folder.join(MANIFEST_NAME))
                .with_context(|| format!("{result} is half a result"))?;
            if let Some(seen) = self.seen.get(result) {
                ensure!(*seen == manifest, "{result} was published twice");
                continue;
            }
            check_whole(&folder, &manifest).with_context(|| result.clone())?;
            self.seen.insert(result.clone(), manifest);
        }
        for result in self.seen.keys().chain(&self.published) {
            ensure!(there.contains(result), "the result {result} is gone");
        }
        Ok(())
    }

    /// Every promise, once the service has taken up all work again.
    pub(crate) async fn check(&mut self, client: &Client) -> Result<()> {
        let jobs = loop {
            let jobs: JobList = client.get(path::JOBS).await?;
            // One that was met by several kills in a row is given up until somebody asks.
            for job in &jobs.jobs {
                if job.state == JobState::Failed && job.cut_short > 0 {
                    let _: Job = client.ask(&path::job_retry(job.id)).await?;
                    self.given_up += 1;
                }
            }
            if jobs
                .jobs
                .iter()
                .all(|job| job.state.is_over() && job.cut_short == 0)
            {
                break jobs.jobs;
            }
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        };
        self.check_spool()?;
        let scans: ScanList = client.get(path::SCANS).await?;
        let known: BTreeMap<&str, &Scan> = scans.scans.iter().map(|s| (s.id.as_str(), s)).collect();
        for (id, &columns) in &self.scans {
            let scan = known
                .get(id.as_str())
                .with_context(|| format!("the scan {id} is lost"))?;
            ensure!(
                scan.columns >= columns,
                "{id}: {} of {columns} acknowledged columns are kept",
                scan.columns
            );
        }
        let complete = |scan: &&Scan| scan.state == ScanState::Complete;
        self.gone_on_with = scans
            .scans
            .iter()
            .filter(complete)
            .filter(|scan| scan.interruption.is_some())
            .count();
        let mut results = BTreeSet::new();
        for scan in known.values() {
            let journal = self.folder.join(format!("state/scans/{}.scan", scan.id));
            if scan.columns > 0 {
                let columns = journal_columns(&journal)?;
                ensure!(columns.len() == scan.columns as usize, "{}", scan.id);
                if scan.state == ScanState::Complete {
                    // The first of all was left alone.
                    if self.columns.is_empty() {
                        ensure!(scan.interruption.is_none(), "{} was cut short", scan.id);
                        self.columns.clone_from(&columns);
                    }
                    ensure!(columns == self.columns, "{} has other columns", scan.id);
                }
            }
            ensure!(
                scan.state != ScanState::Interrupted || scan.columns == 0,
                "{} was cut short and did not go on: {}",
                scan.id,
                scan.reason.as_deref().unwrap_or_default()
            );
            let own: Vec<_> = jobs.iter().filter(|job| job.scan == scan.id).collect();
            let wanted = usize::from(scan.state == ScanState::Complete);
            ensure!(
                own.len() == wanted,
                "{}, which is {}, has {} jobs",
                scan.id,
                scan.state.as_str(),
                own.len()
            );
            for job in own {
                ensure!(job.state == JobState::Done, "{job:?}");
                ensure!(results.insert(job.result.clone()), "{job:?}");
            }
        }
        let there: BTreeSet<String> = self.seen.keys().cloned().collect();
        ensure!(
            there == results,
            "results without a job, or jobs without one"
        );
        Ok(())
    }
}

/// The files are those that the manifest names, byte for byte.
fn check_whole(folder: &Path, manifest: &[u8]) -> Result<()> {
    let manifest: Manifest = serde_json::from_slice(manifest).context("half a manifest")?;
    for file in &manifest.files {
        let content = std::fs::File::open(folder.join(&file.name))
            .with_context(|| format!("{} is missing", file.name))?;
        ensure!(
            deliverables::sha256_of(content)? == file.sha256,
            "{} is half a file",
            file.name
        );
    }
    Ok(())
}
