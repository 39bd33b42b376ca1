//! The servers are gone for two minutes in the middle of a scan.
//!
//! The same scan is taken twice: with the servers there, and with the bench's link to them cut. How
//! fast its columns come is compared, over the time for which the link was cut. Then its job is to be
//! handed over by itself, and its result held against the bench's own.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use relief_api::{Event, Fleet, Job, JobState, Rerun, Scan, ScanState, StartScan, path};
use relief_tests::rig::small_house;
use sim_scanner::config::SimConfig;
use sim_scanner::device::DeviceSettings;
use sim_scanner::preset::Overrides;

use crate::bench::{Bench, files_of};
use crate::cluster::{Cluster, Link, urls};
use crate::workers::Hire;
use crate::{CLEARED, Options, SILENCE_S};

/// Columns and rays: three columns a second, when the servers are away for two minutes.
const SIZE: (u32, u32) = (480, 128);
/// Of the scan's time, what it goes on before the link is cut and after.
const BEFORE: Duration = Duration::from_secs(10);
/// A scan or job may take so much longer than it should.
const GUARD: Duration = Duration::from_secs(300);

pub(crate) async fn measure(options: &Options, outage: Duration) -> Result<()> {
    let folder = tempfile::Builder::new().prefix("fleet-").tempdir()?;
    let measured = measure_in(folder.path(), options, outage).await;
    measured.map_err(|error| {
        let kept = folder.keep();
        error.context(format!(
            "what the programs have told is in {}",
            kept.display()
        ))
    })
}

async fn measure_in(folder: &Path, options: &Options, outage: Duration) -> Result<()> {
    let long = outage + 2 * BEFORE;
    let house = small_house();
    let scanner = SimConfig {
        overrides: Overrides {
            columns: Some(SIZE.0),
            samples: Some(SIZE.1),
            ..house.overrides
        },
        device: DeviceSettings {
            line_rate_hz: Some(f64::from(SIZE.0) / long.as_secs_f64()),
            ..house.device
        },
        ..house
    };
    let mut bench = Bench::before(&options.program("reliefd")?, folder, &scanner).await?;
    let cluster = Cluster::start(options.servers)?;
    let link = Link::to(&cluster.ports())?;
    bench
        .join(&urls(link.ports()), options.servers, SILENCE_S)
        .await?;
    let hire = Hire {
        program: options.program("relief")?,
        servers: urls(&cluster.ports()),
        folder: folder.to_owned(),
        silence_s: SILENCE_S,
    };
    let worker = hire.start("hand-1")?;
    while !fleet(&bench).await?.is_connected {
        tokio::time::sleep(Duration::from_millis(100)).await;
    }

    let there = scan(&bench, outage, None).await?;
    let away = scan(&bench, outage, Some(&link)).await?;
    let over = job_over(&bench, &away.id).await?;
    let handed_over = away.ended.elapsed();
    let memory_mib = worker.most_memory_mib()?;
    let elsewhere = files_of(&bench.spool().join(&over.result))?;
    ensure!(over.worker.as_deref() == Some("hand-1"), "{over:?}");
    job_over(&bench, &there.id).await?;
    bench.is_cleared_up(&cluster, CLEARED).await?;

    bench.part().await?;
    let again: Job = bench
        .client()
        .post(&path::scan_rerun(&away.id), &Rerun::default())
        .await?;
    let own = done(&bench, again.id).await?;
    ensure!(
        files_of(&bench.spool().join(&own.result))? == elsewhere,
        "another result than the bench's own"
    );
    println!(
        "{} columns of {} rays; servers away for {:.0} s: the scan took {:.2} s, and {:.2} s with \
         them there ({:.4} times as long); the longest wait for a column {:.0} ms and {:.0} ms; \
         {} columns came meanwhile, and {} with the servers there; the result was there {:.1} s \
         after the scan's end, done once by {} in {} attempt(s), the same bytes as the bench's \
         own, nothing left on the servers; the worker took at most {memory_mib:.0} MiB",
        SIZE.0,
        SIZE.1,
        outage.as_secs_f64(),
        away.seconds,
        there.seconds,
        away.seconds / there.seconds,
        1e3 * away.longest_s,
        1e3 * there.longest_s,
        away.amid,
        there.amid,
        handed_over.as_secs_f64(),
        over.worker.as_deref().unwrap_or_default(),
        over.attempts,
    );
    Ok(())
}

async fn fleet(bench: &Bench) -> Result<Fleet> {
    bench.client().get(path::FLEET).await
}

/// How a scan went.
struct Took {
    id: String,
    ended: Instant,
    /// From its first column to its last.
    seconds: f64,
    /// Longest time between two columns.
    longest_s: f64,
    /// Columns that came while the link was cut, or would have been.
    amid: u32,
}

/// Takes a scan, and cuts this link for so long.
async fn scan(bench: &Bench, outage: Duration, link: Option<&Link>) -> Result<Took> {
    let mut events = bench.client().events().await?;
    let request = StartScan {
        name: "house".to_owned(),
        ..StartScan::default()
    };
    let scan: Scan = bench.client().post(path::SCANS, &request).await?;
    let begun = Instant::now();
    let mut first = None;
    let (mut last, mut longest, mut amid) = (begun, Duration::ZERO, 0);
    let mut was_amid = false;
    loop {
        ensure!(begun.elapsed() < outage + GUARD, "the scan takes too long");
        match events
            .next()
            .await?
            .context("the service says nothing more")?
        {
            Event::Column { scan: of, .. } if of == scan.id => {
                let now = Instant::now();
                if first.is_some() {
                    longest = longest.max(now - last);
                }
                last = now;
                let since = now - *first.get_or_insert(now);
                let is_amid = (BEFORE..BEFORE + outage).contains(&since);
                if let Some(link) = link
                    && is_amid != was_amid
                {
                    let told = fleet(bench).await?;
                    ensure!(
                        told.is_connected == is_amid,
                        "at {since:.1?} the servers were not what they should be: {told:?}"
                    );
                    link.cut(is_amid);
                }
                was_amid = is_amid;
                amid += u32::from(is_amid);
            }
            Event::Scan(told) if told.id == scan.id && told.state.is_over() => {
                ensure!(told.state == ScanState::Complete, "{:?}", told.reason);
                break;
            }
            _ => {}
        }
    }
    let first = first.context("no column came")?;
    Ok(Took {
        id: scan.id,
        ended: Instant::now(),
        seconds: (last - first).as_secs_f64(),
        longest_s: longest.as_secs_f64(),
        amid,
    })
}

/// Waits for the job of a scan.
async fn job_over(bench: &Bench, scan: &str) -> Result<Job> {
    let begun = Instant::now();
    loop {
        if let Some(job) = bench
            .jobs_over()
            .await?
            .into_values()
            .find(|job| job.scan == scan)
        {
            ensure!(job.state == JobState::Done, "{:?}", job.error);
            return Ok(job);
        }
        ensure!(
            begun.elapsed() < GUARD,
            "the job of scan {scan} came to no end"
        );
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

/// Waits for this job.
async fn done(bench: &Bench, id: u64) -> Result<Job> {
    let begun = Instant::now();
    loop {
        let job: Job = bench.client().get(&path::job(id)).await?;
        if job.state.is_over() {
            ensure!(job.state == JobState::Done, "{:?}", job.error);
            return Ok(job);
        }
        ensure!(begun.elapsed() < GUARD, "job {id} came to no end");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}
