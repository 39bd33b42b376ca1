//! A bench with workers elsewhere: does every job come home once, whatever dies in between, and
//! how much faster are two workers than one?
//!
//! ```sh
//! cargo xtask study fleet                       # 200 jobs, four workers, three servers
//! cargo xtask study fleet --speed               # one worker against two
//! cargo xtask study fleet --cost                # what the queue costs by itself
//! ```
//!
//! Needs `nats-server`, or another program of it that `RELIEF_NATS_SERVER` names. A bench takes scans, and does their jobs itself; then each scan is
//! processed again and again by workers in processes of their own, while workers, the server that
//! leads and the links are killed and cut at moments drawn from a seed. Each result is held
//! against the one that the bench has made itself.

mod bench;
mod cluster;
mod cost;
mod outage;
mod speed;
mod trouble;
mod workers;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Parser;
use relief_api::{Job, JobState, Rerun, path};

use bench::{Bench, Files, files_of};
use cluster::{Cluster, Link, urls};
use trouble::Trouble;
use workers::Hire;

/// How long a worker may be silent before another gets its job.
const SILENCE_S: u32 = 3;
/// Where no job has come to its end for so long, none will.
const GUARD: Duration = Duration::from_secs(300);
/// How long what is left on the servers may take to be cleared up.
const CLEARED: Duration = Duration::from_secs(120);

/// Work on many jobs elsewhere while workers, servers and links die
#[derive(Debug, Parser)]
#[command(name = "study-fleet", version)]
struct Options {
    /// Jobs
    #[arg(long, value_name = "N", default_value_t = 200)]
    jobs: usize,
    /// Workers
    #[arg(long, value_name = "N", default_value_t = 4)]
    workers: usize,
    /// Servers: 1, 3 or 5
    #[arg(long, value_name = "N", default_value_t = 3)]
    servers: usize,
    /// Scans whose jobs they are
    #[arg(long, value_name = "N", default_value_t = 4)]
    scans: usize,
    /// Seed of what happens when
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Seconds between two troubles, as a rule
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    pause_s: f64,
    /// Measure how much faster two workers are than one, with nothing in their way
    #[arg(long)]
    speed: bool,
    /// Measure what the queue and its object store cost, with jobs that do nothing
    #[arg(long, conflicts_with = "speed")]
    cost: bool,
    /// Measure a scan during which the servers are gone for so many seconds
    #[arg(long, value_name = "S", conflicts_with_all = ["speed", "cost"])]
    outage_s: Option<u32>,
    /// Folder of reliefd and relief; that of this program if not given
    #[arg(long, value_name = "DIR")]
    programs: Option<PathBuf>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let study = || -> Result<()> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()?;
        if options.speed {
            runtime.block_on(speed::measure(&options))
        } else if options.cost {
            runtime.block_on(cost::measure())
        } else if let Some(seconds) = options.outage_s {
            let outage = Duration::from_secs(seconds.into());
            runtime.block_on(outage::measure(&options, outage))
        } else {
            runtime.block_on(run(&options))
        }
    };
    match study() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-fleet: {error:#}");
            ExitCode::FAILURE
        }
    }
}

impl Options {
    fn program(&self, name: &str) -> Result<PathBuf> {
        let folder = match &self.programs {
            Some(folder) => folder.clone(),
            None => std::env::current_exe()?
                .parent()
                .map(Path::to_owned)
                .unwrap_or_default(),
        };
        let program = folder.join(name);
        ensure!(
            program.is_file(),
            "there is no {}: build it first (cargo xtask study fleet does), or name its folder \
             with --programs",
            program.display()
        );
        Ok(program)
    }
}

/// The same again of scans, in turn.
async fn order(bench: &Bench, scans: &[String], jobs: usize) -> Result<BTreeMap<u64, String>> {
    let mut orders = BTreeMap::new();
    for scan in scans.iter().cycle().take(jobs) {
        let again = Rerun::default();
        let client = bench.client();
        let job: Job = client.post(&path::scan_rerun(scan), &again).await?;
        orders.insert(job.id, scan.clone());
    }
    Ok(orders)
}

/// Whether it was set aside since its workers died.
fn is_set_aside(job: &Job) -> bool {
    let error = job.error.as_deref().unwrap_or_default();
    job.state == JobState::Failed && error.contains("workers in a row")
}

async fn run(options: &Options) -> Result<()> {
    let folder = tempfile::Builder::new().prefix("fleet-").tempdir()?;
    let mut bench = Bench::alone(&options.program("reliefd")?, folder.path()).await?;
    let scans = bench.take(options.scans).await?;
    let mut expected = BTreeMap::new();
    for scan in &scans {
        expected.insert(scan.clone(), files_of(&bench.spool().join(scan))?);
    }

    let cluster = Cluster::start(options.servers)?;
    let (to_bench, to_workers) = (Link::to(&cluster.ports())?, Link::to(&cluster.ports())?);
    bench
        .join(&urls(to_bench.ports()), options.servers, SILENCE_S)
        .await?;
    let hire = Hire {
        program: options.program("relief")?,
        servers: urls(to_workers.ports()),
        folder: folder.path().to_owned(),
        silence_s: SILENCE_S,
    };
    let begun = Instant::now();
    let orders = order(&bench, &scans, options.jobs).await?;
    let mut trouble = Trouble::begin(
        options.seed,
        Duration::from_secs_f64(options.pause_s.clamp(0.1, 3600.0)),
        options.workers,
        hire,
        cluster,
        [to_bench, to_workers],
    )?;
    let (mut done, mut set_aside) = (0, 0);
    let mut last_end = Instant::now();
    while done < orders.len() {
        trouble.next().await?;
        let jobs = bench.jobs_over().await.unwrap_or_default();
        // By chance three workers in a row die with the same job: it is set aside, and somebody
        // has to look.
        for (id, job) in &jobs {
            if is_set_aside(job) {
                set_aside += 1;
                let _: Job = bench.client().ask(&path::job_retry(*id)).await?;
            }
        }
        let is_done = |id: &&u64| jobs.get(*id).is_some_and(|job| !is_set_aside(job));
        let were_done = done;
        done = orders.keys().filter(is_done).count();
        if done > were_done {
            last_end = Instant::now();
        }
        eprintln!(
            "{done} of {} jobs are over: {}",
            orders.len(),
            trouble.told()
        );
        if last_end.elapsed() >= GUARD {
            let kept = folder.keep();
            anyhow::bail!(
                "no job came to its end for {} s; what the programs have told is in {}",
                GUARD.as_secs(),
                kept.display()
            );
        }
    }
    let seconds = begun.elapsed().as_secs();
    trouble.end()?;

    let held = hold(&bench, &orders, &scans, &expected, trouble.cluster()).await;
    let (attempts, published) = match held {
        Ok(held) => held,
        Err(error) => {
            let kept = folder.keep();
            let told = trouble.cluster().told();
            return Err(error.context(format!(
                "what the programs have told is in {}; the servers have{told}",
                kept.display()
            )));
        }
    };
    println!(
        "seed {}: {} jobs of {} scans, {} workers, {} servers ({}), {seconds} s: {}; begun {attempts} \
         times, {set_aside} set aside after three deaths in a row and retried, published once each ({} told), the same bytes as here, nothing left on the servers",
        options.seed,
        orders.len(),
        scans.len(),
        options.workers,
        options.servers,
        nats_child::version()?,
        trouble.told(),
        published
    );
    Ok(())
}

/// Holds that each job was done once, and each result is what the bench has made itself; tells how
/// often jobs were begun, and of how many it was told that they are published.
async fn hold(
    bench: &Bench,
    orders: &BTreeMap<u64, String>,
    scans: &[String],
    expected: &BTreeMap<String, Files>,
    cluster: &Cluster,
) -> Result<(u32, usize)> {
    let jobs = bench.jobs_over().await?;
    let mut attempts = 0;
    for (id, scan) in orders {
        let job = &jobs[id];
        ensure!(
            job.state == JobState::Done,
            "job {id} failed: {:?}",
            job.error
        );
        attempts += job.attempts;
        let made = files_of(&bench.spool().join(&job.result))
            .with_context(|| format!("the result of job {id}"))?;
        ensure!(
            made == expected[scan],
            "job {id}: another result than the bench's own"
        );
    }
    let published = bench.published();
    for (id, times) in &published {
        ensure!(
            *times <= 1,
            "job {id} was told to be published {times} times"
        );
    }
    let results = std::fs::read_dir(bench.spool())?.count();
    ensure!(
        results == orders.len() + scans.len(),
        "{results} results of {} jobs",
        orders.len() + scans.len()
    );
    bench.is_cleared_up(cluster, CLEARED).await?;
    Ok((attempts, published.len()))
}
