//! The service at work for as long as one likes: do memory, descriptors and threads stay flat?
//!
//! ```sh
//! cargo xtask soak --minutes 60
//! ```

mod process;
mod trend;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use relief_api::{Event, Job, JobState, Rerun, Scan, ScanState, StartScan, path};
use relief_tests::rig::{Client, Events, Program, small_house};

use process::sample;
use trend::{Sample, Trend};

/// Old scans go, as they would where the service is left alone, from the first minutes on.
const SETTINGS: &str = "\
[storage]
reserve_mb = 1
scans_mb = 20
[log]
level = \"error\"
format = \"text\"";

/// Keep the service at work, and watch its memory, descriptors and threads
#[derive(Debug, Parser)]
#[command(name = "soak", version)]
struct Options {
    /// For how long
    #[arg(long, value_name = "N", default_value_t = 60.0)]
    minutes: f64,
    /// The program; beside this one if not given
    #[arg(long, value_name = "FILE")]
    reliefd: Option<PathBuf>,
    /// By how many megabytes memory may grow between the second third and the last
    #[arg(long, value_name = "MB", default_value_t = 6.0)]
    within_mb: f64,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let soak = || -> Result<()> {
        tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()?
            .block_on(run(&options))
    };
    match soak() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("soak: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// What was done.
#[derive(Default)]
struct Done {
    scans: u32,
    aborted: u32,
    results: u32,
}

async fn run(options: &Options) -> Result<()> {
    ensure!(
        options.minutes > 0.0,
        "a soak takes some time: --minutes 1, say"
    );
    let program = match &options.reliefd {
        Some(program) => program.clone(),
        None => std::env::current_exe()?.with_file_name("reliefd"),
    };
    let folder = tempfile::Builder::new().prefix("soak-").tempdir()?;
    let scanner = small_house().serve_pty(None)?;
    let mut service = Program::start(&program, folder.path(), scanner.port(), SETTINGS)?;
    service.ready().await?;
    let client = service.client().clone();
    let longest = Duration::from_secs_f64(options.minutes * 60.0);
    let begun = Instant::now();
    let (mut trend, mut done) = (Trend::default(), Done::default());
    let mut told = 0;
    while begun.elapsed() < longest {
        round(&client, &mut done)
            .await
            .context("the service does not do its work")?;
        service.idle().await?;
        clear(&folder.path().join("spool"))?;
        let sample = sample(service.id(), begun.elapsed())?;
        trend.add(sample);
        let minute = (begun.elapsed().as_secs_f64() / 60.0) as u32;
        if minute > told {
            told = minute;
            eprintln!("minute {minute}: {sample}");
        }
    }
    service.end()?;
    println!(
        "{} scans ({} of them aborted), {} results in {:.1} minutes",
        done.scans,
        done.aborted,
        done.results,
        begun.elapsed().as_secs_f64() / 60.0
    );
    trend.tell();
    trend.check(options.within_mb)
}

/// A scan to its result, one that is aborted, a rerun, and somebody who looks on.
async fn round(client: &Client, done: &mut Done) -> Result<()> {
    let mut events = client.events().await?;
    let request = StartScan {
        name: "soak".into(),
        ..StartScan::default()
    };
    let scan: Scan = client.post(path::SCANS, &request).await?;
    let scan = events.scan_complete(&scan.id).await?;
    done.scans += 1;
    let first = *scan.jobs.first().context("a complete scan has a job")?;
    result(client, &mut events, first).await?;
    let job: Job = client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await?;
    result(client, &mut events, job.id).await?;
    done.results += 2;

    let cut: Scan = client.post(path::SCANS, &request).await?;
    // It may be over before the wish arrives.
    let _: Result<Scan> = client.ask(&path::scan_abort(&cut.id)).await;
    let mut cut: Scan = client.get(&path::scan(&cut.id)).await?;
    if !cut.state.is_over() {
        cut = events.scan_over(&cut.id).await?;
    }
    done.scans += 1;
    match cut.state {
        ScanState::Aborted => done.aborted += 1,
        ScanState::Complete => {
            for &job in &cut.jobs {
                result(client, &mut events, job).await?;
                done.results += 1;
            }
        }
        other => bail!("the scan is {}: {:?}", other.as_str(), cut.reason),
    }
    Ok(())
}

async fn result(client: &Client, events: &mut Events, id: u64) -> Result<()> {
    let mut job: Job = client.get(&path::job(id)).await?;
    if !job.state.is_over() {
        let over = |event: &Event| match event {
            Event::Job(job) if job.id == id && job.state.is_over() => Some(job.clone()),
            _ => None,
        };
        job = events.until(over).await?.1;
    }
    ensure!(job.state == JobState::Done, "{job:?}");
    Ok(())
}

/// Results that are left before they are removed, as whoever fetches them does; else hours
/// would fill the disk.
const RESULTS: usize = 100;

fn clear(spool: &Path) -> Result<()> {
    let results = std::fs::read_dir(spool)?.collect::<Result<Vec<_>, _>>()?;
    if results.len() > RESULTS {
        for result in results {
            std::fs::remove_dir_all(result.path())?;
        }
    }
    Ok(())
}

impl std::fmt::Display for Sample {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:.1} MB, {} descriptors, {} threads",
            self.memory_bytes as f64 * 1e-6,
            self.descriptors,
            self.threads
        )
    }
}
