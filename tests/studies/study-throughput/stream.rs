//! A scan through the service as fast as it takes it, from a device in memory to a journal on disk
//! and a grid of one node for every two samples.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use relief_api::{Scan, ScanState, StartScan, path};
use relief_tests::rig::{Client, GUARD, config};
use reliefd::config::Estimator;
use reliefd::{Config, Daemon};
use scan_files::ReadOptions;
use scanner_driver::LinkSettings;
use sim_scanner::device::DeviceSettings;
use sim_scanner::replay::Replay;
use sim_scanner::source::Source;
use throughput::memory;

pub(crate) const TABLE_HEAD: &str = "\
| live range image | samples per column | columns | nodes for each sample | samples/s |
| --- | ---: | ---: | ---: | ---: |";

/// Distance of columns, and of nodes.
const PITCH_MM: f64 = 0.1;
/// Distance of samples: two to a node.
const SAMPLE_MM: f64 = 0.5 * PITCH_MM;
const NOISE_MM: f64 = 0.02;
const SAMPLES: u32 = 2000;
/// Enough for some ten seconds each.
const COLUMNS: u32 = 1500;
const SHORT_COLUMNS: u32 = 150;
/// How often the scan is asked how far it is.
const PAUSE: Duration = Duration::from_millis(10);

/// What the live range image is made by, and the distance of its nodes: hardly any at all tells what
/// driver and journal take by themselves.
const LIVE: [(&str, Estimator, f64); 3] = [
    (
        "MLMS, hardly any node",
        Estimator::LeastMedian,
        20.0 * PITCH_MM,
    ),
    ("MLMS", Estimator::LeastMedian, PITCH_MM),
    ("consensus", Estimator::Consensus, PITCH_MM),
];

/// One scan.
pub(crate) struct Row {
    live: &'static str,
    pitch_mm: f64,
    columns: u32,
    samples_per_s: f64,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nodes = PITCH_MM * SAMPLE_MM / (self.pitch_mm * self.pitch_mm);
        write!(
            f,
            "| {} | {SAMPLES} | {} | {nodes:.3} | {:.0} |",
            self.live, self.columns, self.samples_per_s
        )
    }
}

pub(crate) fn study(short: bool) -> Result<Vec<Row>> {
    let columns = if short { SHORT_COLUMNS } else { COLUMNS };
    println!("{TABLE_HEAD}");
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()?;
    let source = sheet(columns)?;
    let mut rows = Vec::new();
    for (live, estimator, pitch_mm) in LIVE {
        let change = |config: &mut Config| {
            config.regrid.estimator = Some(estimator);
            config.regrid.pitch_mm = Some(pitch_mm);
        };
        let samples_per_s = runtime.block_on(scan(&source, change, columns))?;
        let row = Row {
            live,
            pitch_mm,
            columns,
            samples_per_s,
        };
        println!("{row}");
        rows.push(row);
    }
    Ok(rows)
}

/// A bent, noisy sheet as a recording, which takes the device no time to measure.
fn sheet(columns: u32) -> Result<Source> {
    // Noise that looks like none of the sheet's own shape.
    let noise = |column: u32, sample: u32| {
        let mixed = (column * SAMPLES + sample).wrapping_mul(2_654_435_769);
        NOISE_MM * (f64::from(mixed >> 8) / f64::from(1 << 23) - 1.0)
    };
    let points = (0..columns).flat_map(|column| {
        (0..SAMPLES).map(move |sample| {
            let (x, y) = (f64::from(column) * PITCH_MM, f64::from(sample) * SAMPLE_MM);
            [x, y, 0.001 * x * y + noise(column, sample)]
        })
    });
    let scan = scan_files::from_points_mm(points, "a sheet", &ReadOptions::default())?;
    let replay = Replay::new(&scan)?;
    let uniform = replay.into_uniform().context("it is not evenly spaced")?;
    Ok(Source::Replay(uniform))
}

/// Samples a second from when the first columns are kept to the end of the scan, with all columns
/// in the journal and all nodes in the grid.
async fn scan(source: &Source, change: impl FnOnce(&mut Config), columns: u32) -> Result<f64> {
    let folder = tempfile::tempdir()?;
    let settings = DeviceSettings {
        line_rate_hz: None,
        table_speed_mm_s: f64::INFINITY,
        ..DeviceSettings::default()
    };
    let attached = memory(source.clone(), settings)?;
    let link = LinkSettings {
        credits: 64,
        ..LinkSettings::default()
    };
    let (scanner, device) = attached.driven(link)?;
    let mut config = config(folder.path(), "memory".as_ref());
    change(&mut config);
    let daemon = Daemon::start_with(config, Arc::new(scanner)).await?;
    let client = Client::new(daemon.socket());
    let begun = Instant::now();
    let scan: Scan = loop {
        match client.post(path::SCANS, &StartScan::default()).await {
            Ok(scan) => break scan,
            // The device is looked for.
            Err(error) if begun.elapsed() > GUARD => return Err(error),
            Err(_) => tokio::time::sleep(PAUSE).await,
        }
    };
    let at = path::scan(&scan.id);
    // What comes before the first columns is the table's way.
    let mut first = None;
    let (from, before, end) = loop {
        let now: Scan = client.get(&at).await?;
        if now.columns > 0 {
            first.get_or_insert_with(|| (Instant::now(), now.columns));
        }
        match (now.state, first) {
            (ScanState::Complete, Some((from, before))) => break (from, before, now),
            (ScanState::Starting | ScanState::Scanning, _) => tokio::time::sleep(PAUSE).await,
            (state, _) => bail!("the scan is {}: {:?}", state.as_str(), now.reason),
        }
    };
    let took_s = from.elapsed().as_secs_f64();
    ensure!(end.columns == columns, "{} columns were kept", end.columns);
    daemon.shutdown().await;
    drop(device);
    Ok(f64::from(columns - before) * f64::from(SAMPLES) / took_s)
}
