//! A scan through the service on a disk that takes its time.

use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use relief_api::StartScan;
use relief_tests::rig::{GUARD, Rig, journal_columns, small_house};
use sim_scanner::config::SimConfig;
use sim_scanner::control::Control;
use sim_scanner::device::{DeviceSettings, Event};
use sim_scanner::preset::Overrides;
use storage::{Deed, HinderedDisk, Hindrance};

pub(crate) const TABLE_HEAD: &str = "\
| disk takes per sync, ms | line rate, Hz | columns | columns/s | table waits for the disk | columns lost | journal as on the quick disk |
| ---: | ---: | ---: | ---: | ---: | ---: | --- |";

/// What a sync of a journal takes besides what it does.
const DELAYS_MS: [u64; 5] = [0, 10, 50, 200, 500];
const SHORT_DELAYS_MS: [u64; 2] = [0, 200];
const LINE_RATES_HZ: [Option<f64>; 2] = [None, Some(50.0)];
const COLUMNS: u32 = 200;
const SHORT_COLUMNS: u32 = 60;

/// The disk of a lab that syncs to a slow medium.
#[derive(Debug, Clone)]
struct Slow(Duration);

impl Hindrance for Slow {
    fn before(&self, deed: Deed, path: &Path) -> io::Result<()> {
        if deed == Deed::SyncFile && path.extension().is_some_and(|e| e == "scan") {
            std::thread::sleep(self.0);
        }
        Ok(())
    }
}

/// One scan on one disk.
pub(crate) struct Row {
    delay_ms: u64,
    line_rate_hz: Option<f64>,
    columns: u32,
    took: Duration,
    waited: Duration,
    lost: u32,
    same: bool,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rate = self
            .line_rate_hz
            .map_or("unlimited".to_owned(), |rate| rate.to_string());
        let took_s = self.took.as_secs_f64();
        write!(
            f,
            "| {} | {rate} | {} | {:.0} | {:.0} % | {} | {} |",
            self.delay_ms,
            self.columns,
            f64::from(self.columns) / took_s,
            100.0 * self.waited.as_secs_f64() / took_s,
            self.lost,
            if self.same { "byte for byte" } else { "NO" },
        )
    }
}

pub(crate) fn study(short: bool) -> Result<Vec<Row>> {
    let (delays, columns) = if short {
        (&SHORT_DELAYS_MS[..], SHORT_COLUMNS)
    } else {
        (&DELAYS_MS[..], COLUMNS)
    };
    println!("{TABLE_HEAD}");
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    let mut rows = Vec::new();
    for line_rate_hz in LINE_RATES_HZ {
        let mut quick = None;
        for &delay_ms in delays {
            let (row, journal) = runtime.block_on(scan(delay_ms, line_rate_hz, columns))?;
            let row = Row {
                same: *quick.get_or_insert_with(|| journal.clone()) == journal,
                ..row
            };
            println!("{row}");
            ensure!(row.lost == 0 && row.same, "a slow disk costs columns");
            rows.push(row);
        }
    }
    Ok(rows)
}

/// The row, and what the journal holds behind its header.
async fn scan(delay_ms: u64, line_rate_hz: Option<f64>, columns: u32) -> Result<(Row, Vec<u8>)> {
    let house = small_house();
    let config = SimConfig {
        overrides: Overrides {
            columns: Some(columns),
            ..house.overrides
        },
        device: DeviceSettings {
            line_rate_hz,
            ..house.device
        },
        ..house
    };
    let disk = HinderedDisk(Slow(Duration::from_millis(delay_ms)));
    let rig = Rig::start_on(&config, Arc::new(disk), |_| {}).await?;
    let mut control = rig.control()?;
    control.skip_events();
    let mut events = rig.client().events().await?;
    let watched = tokio::task::spawn_blocking(move || watch(&mut control));
    let scan = rig.scan(&StartScan::default()).await?;
    let (took, waited) = watched.await??;
    let scan = events.scan_complete(&scan.id).await?;
    let journal = rig.journal(&scan.id).await?;
    let kept = journal_columns(&journal)?.len() as u32;
    let journal = behind_the_header(&std::fs::read(&journal)?)?;
    rig.end().await?;
    let row = Row {
        delay_ms,
        line_rate_hz,
        columns,
        took,
        waited,
        lost: columns - kept,
        same: true,
    };
    Ok((row, journal))
}

/// From the first column until the host closes the scan, all columns of which it then has: how long
/// that took, and how much of it the device waited for the host.
fn watch(control: &mut Control) -> Result<(Duration, Duration)> {
    control.wait_for(GUARD, |event| matches!(event, Event::ColumnSent(_)))?;
    let (start, before) = (Instant::now(), control.line_use());
    control.wait_for(GUARD, |event| *event == Event::ScanClosed)?;
    let waited = control.line_use().waited_for_host - before.waited_for_host;
    Ok((start.elapsed(), waited))
}

/// Name and time of a scan stand in the header: all else must be the same.
fn behind_the_header(journal: &[u8]) -> Result<Vec<u8>> {
    /// Magic, version, reserved; kind of the first record.
    const BEFORE_LENGTH: usize = 13;
    const LENGTH: usize = 4;
    const CHECKSUM: usize = 4;
    let length = journal
        .get(BEFORE_LENGTH..BEFORE_LENGTH + LENGTH)
        .and_then(|bytes| bytes.try_into().ok())
        .map(u32::from_le_bytes)
        .context("no header")?;
    let end = BEFORE_LENGTH + LENGTH + length as usize + CHECKSUM;
    Ok(journal.get(end..).context("half a header")?.to_vec())
}
