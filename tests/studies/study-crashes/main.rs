//! `kill -9` at random moments: does the service keep its word?
//!
//! The program `reliefd` takes scan after scan from a simulated scanner, and is killed at a
//! moment drawn from a seed, anywhere from its start to the publication. It is started again
//! on what it left, killed again, and so on, in one and the same folder.
//!
//! ```sh
//! cargo xtask study crashes --kills 300
//! ```

mod figures;
mod promises;
mod service;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Parser;
use relief_api::{Scan, ScanState, StartScan, Status, path};
use relief_tests::mutations::Dice;
use relief_tests::rig::{Client, GUARD, Program, small_house};
use sim_scanner::config::SimConfig;
use sim_scanner::control::Control;
use sim_scanner::device::{DeviceSettings, Event as Happened};

use figures::{Figures, Phase};
use promises::Promises;
use service::Heard;

/// The scanner is soon ready for the next after its host was killed.
const SETTINGS: &str = "\
request_timeout_ms = 200
dead_man_ms = 600
[log]
level = \"warn\"
format = \"text\"";

/// Kill the service at random moments of scan and job
#[derive(Debug, Parser)]
#[command(name = "study-crashes", version)]
struct Options {
    /// How often it is killed
    #[arg(long, value_name = "N", default_value_t = 300)]
    kills: u32,
    /// Seed of the moments
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The program; beside this one if not given
    #[arg(long, value_name = "FILE")]
    reliefd: Option<PathBuf>,
}

/// Of so many kills some fall everywhere.
const MANY: u32 = 100;

fn main() -> ExitCode {
    let options = Options::parse();
    let study = || -> Result<()> {
        tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()?
            .block_on(run(&options))
    };
    match study() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-crashes: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// A scan of half a second, so that moments fall into it.
fn bench() -> SimConfig {
    let house = small_house();
    SimConfig {
        device: DeviceSettings {
            line_rate_hz: Some(120.0),
            dead_man_min: Duration::from_millis(50),
            ..house.device
        },
        ..house
    }
}

async fn run(options: &Options) -> Result<()> {
    let program = match &options.reliefd {
        Some(program) => program.clone(),
        None => std::env::current_exe()?.with_file_name("reliefd"),
    };
    ensure!(
        program.is_file(),
        "there is no {}: build it first (cargo xtask study crashes does), or name it with --reliefd",
        program.display()
    );
    let folder = tempfile::Builder::new().prefix("crashes-").tempdir()?;
    let scanner = bench().serve_pty(None)?;
    let mut control = scanner.control();
    let mut dice = Dice::new(options.seed);
    let mut promises = Promises::new(folder.path());
    let mut figures = Figures::default();

    let mut pace = Pace::measure(&program, folder.path(), scanner.port(), &mut promises).await?;
    for kill in 1..=options.kills {
        control.skip_events();
        let point = Point::draw(&mut dice);
        // A little more than it takes as a rule, so that the ends are met too.
        let moment = pace
            .of(point)
            .mul_f64(1.2 * dice.below(1_000) as f64 / 1_000.0);
        let wait_for_jobs = dice.once_in(2);
        let mut service = Program::start(&program, folder.path(), scanner.port(), SETTINGS)?;
        let mut round = Round::default();
        live(
            &mut service,
            &mut promises,
            &mut round,
            point,
            wait_for_jobs,
        )
        .await
        .with_context(|| format!("before kill {kill}"))?;
        tokio::time::sleep(moment).await;
        service.kill()?;
        if let Some(heard) = &mut round.heard {
            for result in heard.rest().await {
                promises.published(&result);
            }
        }
        let acknowledged = acknowledged(&mut control);
        if let Some(scan) = &round.scan {
            promises.acknowledged(scan, acknowledged);
        }
        figures.add(round.phase(acknowledged, &promises));
        // Before anybody could mend it.
        promises
            .check_spool()
            .with_context(|| format!("after kill {kill}"))?;

        if kill % 10 == 0 || kill == options.kills {
            let mut service = Program::start(&program, folder.path(), scanner.port(), SETTINGS)?;
            service.ready().await?;
            none_under_way(service.client()).await?;
            promises
                .check(service.client())
                .await
                .with_context(|| format!("after kill {kill}"))?;
            service.end()?;
            // Other work on the machine comes and goes.
            pace = Pace::measure(&program, folder.path(), scanner.port(), &mut promises).await?;
            eprintln!("kill {kill}: {} scans, all is well", promises.scans());
        }
    }
    figures.tell();
    if options.kills >= MANY {
        figures.check()?;
    }
    let (scans, columns, results) = (promises.scans(), promises.columns(), promises.results());
    println!(
        "{scans} scans, {columns} acknowledged columns, {results} results: nothing lost, \
         nothing half, nothing twice; {} scans were cut short and went on to their end, {} jobs \
         were given up after three kills and asked for again",
        promises.gone_on_with(),
        promises.given_up()
    );
    Ok(())
}

/// After what the moment of a kill is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Point {
    /// The process was started.
    Started,
    /// The scan was accepted.
    Accepted,
    /// All columns were kept.
    Complete,
    /// The result was told.
    Published,
}

impl Point {
    fn draw(dice: &mut Dice) -> Self {
        match dice.below(12) {
            0..2 => Self::Started,
            2..6 => Self::Accepted,
            6..11 => Self::Complete,
            _ => Self::Published,
        }
    }
}

/// How long things take as a rule.
struct Pace {
    start: Duration,
    scan: Duration,
    job: Duration,
}

impl Pace {
    /// By a scan without a kill.
    async fn measure(
        program: &Path,
        folder: &Path,
        port: &Path,
        promises: &mut Promises,
    ) -> Result<Self> {
        let begun = Instant::now();
        let mut service = Program::start(program, folder, port, SETTINGS)?;
        let mut round = Round::default();
        live(&mut service, promises, &mut round, Point::Started, true).await?;
        service.ready().await?;
        let start = begun.elapsed();
        none_under_way(service.client()).await?;
        let begun = Instant::now();
        live(&mut service, promises, &mut round, Point::Complete, true).await?;
        ensure!(!round.failed, "the scan without a kill was not complete");
        let scan = begun.elapsed();
        let begun = Instant::now();
        round.published(promises).await?;
        let job = begun.elapsed();
        service.end()?;
        Ok(Self { start, scan, job })
    }

    fn of(&self, point: Point) -> Duration {
        match point {
            Point::Started => self.start,
            Point::Accepted => self.scan,
            // What follows the publication is short.
            Point::Complete => self.job,
            Point::Published => self.job / 4,
        }
    }
}

/// What became known of a scan before the kill.
#[derive(Default)]
struct Round {
    scan: Option<Scan>,
    heard: Option<Heard>,
    /// The scan ended with its last column.
    complete: bool,
    /// The scan ended, and not with its last column.
    failed: bool,
}

impl Round {
    /// Waits for the scan's result.
    async fn published(&mut self, promises: &mut Promises) -> Result<()> {
        if let (Some(heard), Some(scan)) = (&mut self.heard, &self.scan) {
            promises.published(&heard.published(&scan.id).await?);
        }
        Ok(())
    }

    fn phase(&self, acknowledged: u32, promises: &Promises) -> Phase {
        match &self.scan {
            None => Phase::Starting,
            Some(_) if self.failed => Phase::Failed,
            Some(scan) if promises.is_published(&scan.id) => Phase::Published,
            // The service need not tell the scanner that the last column is safe: it ends the
            // scan instead.
            Some(_) if self.complete => Phase::Job,
            Some(scan) if acknowledged >= scan.columns_planned => Phase::Job,
            Some(_) => Phase::Scan,
        }
    }
}

/// Goes on as far as the point.
async fn live(
    service: &mut Program,
    promises: &mut Promises,
    round: &mut Round,
    point: Point,
    wait_for_jobs: bool,
) -> Result<()> {
    if point == Point::Started {
        return Ok(());
    }
    service.ready().await?;
    if wait_for_jobs {
        // A scan that waits for a person would keep it from that for ever.
        none_under_way(service.client()).await?;
        service.idle().await?;
    }
    let mut heard = Heard::listen(service.client()).await?;
    // One that the last kill cut short goes on.
    let scan = match under_way(service.client()).await? {
        Some(scan) => scan,
        None => start_scan(service).await?,
    };
    promises.accepted(&scan);
    let id = scan.id.clone();
    round.scan = Some(scan);
    if point >= Point::Complete {
        let over = heard.over(&id).await?;
        // On a machine that is busy with other things the scanner may give its host up. Its
        // columns are promised all the same.
        round.complete = over.state == ScanState::Complete;
        round.failed = !round.complete;
    }
    round.heard = Some(heard);
    if point == Point::Published && !round.failed {
        round.published(promises).await?;
    }
    Ok(())
}

/// The scan under way; one that waits for a person, as after several kills in a row without a
/// new column, is told to go on.
async fn under_way(client: &Client) -> Result<Option<Scan>> {
    let status: Status = client.get(path::STATUS).await?;
    let waits = |scan: &&Scan| scan.needs_person && scan.state == ScanState::Paused;
    if let Some(scan) = status.scan.as_ref().filter(waits)
        && let Err(error) = client.ask::<Scan>(&path::scan_resume(&scan.id)).await
    {
        // It may have ended in this very moment.
        eprintln!("{}: {error:#}", scan.id);
    }
    Ok(status.scan)
}

/// Waits until no scan is under way.
async fn none_under_way(client: &Client) -> Result<()> {
    let waiting = Instant::now();
    while let Some(scan) = under_way(client).await? {
        ensure!(waiting.elapsed() < GUARD, "it goes on and on: {scan:?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    Ok(())
}

/// A scanner that has just lost its host may need a moment; whoever uses it asks again.
async fn start_scan(service: &Program) -> Result<Scan> {
    let request = StartScan {
        name: "cut".into(),
        ..StartScan::default()
    };
    let mut tries = 0;
    loop {
        match service.client().post(path::SCANS, &request).await {
            Err(error) if tries < 200 => {
                tries += 1;
                tokio::time::sleep(Duration::from_millis(20)).await;
                drop(error);
            }
            other => return other,
        }
    }
}

/// Columns that the scanner knows to be safe of the scan that began since the events were
/// skipped. What comes before its begin is of one before: the last words of a host that was
/// killed may still have been on the line.
fn acknowledged(control: &mut Control) -> u32 {
    let now = Duration::ZERO;
    let begun = |event: &Happened| matches!(event, Happened::ScanStarted { .. });
    if control.wait_for(now, begun).is_err() {
        return 0;
    }
    let mut safe = 0;
    let told = |event: &Happened| matches!(event, Happened::Acknowledged(_));
    while let Ok(Happened::Acknowledged(below)) = control.wait_for(now, told) {
        safe = safe.max(below);
    }
    safe
}
