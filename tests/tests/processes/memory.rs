//! Memory of acquisition does not grow with the length of the scan.
//!
//! The service of this process takes scans of one and the same surface that are 1, 4 and
//! 12 times as long, over a pseudo-terminal. The simulated scanner, which holds the whole
//! surface, is a second process. It stops before its last column, and the scan is then
//! aborted, so that everything of an acquisition happens and nothing of a job.

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::path::Path;

use anyhow::{Result, ensure};
use relief_api::{Scan, ScanState, StartScan, path};
use relief_tests::rig::{GUARD, Rig, journal_columns, recording};
use sim_scanner::device::Event;

use crate::role::{Role, SCANNER};
use crate::{ALLOCATOR, runtime};

/// Columns of the shortest scan: more than the regridder's window and what may be in flight
/// between the driver and the disk.
const COLUMNS: u32 = 160;
/// Lengths that are measured.
const TIMES: [u32; 3] = [1, 4, 12];
const SAMPLES: u32 = 128;
/// Distance of columns and samples.
const PITCH_MM: f64 = 0.5;
/// By how much the longest may need more than the shortest. What it measures is 12 times as
/// much: kept in memory, its samples alone would be 2.7 MB, and its range image 1.8 MB.
const GROWTH_BYTES: usize = 256 * 1024;

/// Serves a recording, stops short of its last column, says so, and ends with its input.
pub(crate) fn be_the_scanner(file: &Path, columns: u32) -> Result<()> {
    let server = recording(file.to_owned()).serve_pty(None)?;
    let mut control = server.control();
    control.step_columns(Some(columns));
    println!("{}", server.port().display());
    control.wait_for(GUARD, |event| *event == Event::Acknowledged(columns))?;
    println!("done");
    std::io::stdin().read_to_end(&mut Vec::new())?;
    Ok(())
}

/// A wavy strip, `columns` long, as text.
fn write_strip(path: &Path, columns: u32) -> Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut text = String::new();
    for column in 0..columns {
        text.clear();
        let x = f64::from(column) * PITCH_MM;
        for sample in 0..SAMPLES {
            let y = f64::from(sample) * PITCH_MM;
            let z = 3.0 * (x / 7.0).sin() * (y / 9.0).cos();
            writeln!(text, "{x:.5} {y:.5} {z:.5}")?;
        }
        file.write_all(text.as_bytes())?;
    }
    Ok(file.flush()?)
}

/// Most bytes in use at one time while a scan of so many columns was taken, beyond those in
/// use before it.
fn acquire(runtime: &tokio::runtime::Runtime, folder: &Path, columns: u32) -> Result<usize> {
    let strip = folder.join(format!("{columns}.xyz"));
    write_strip(&strip, columns + 1)?;
    let mut scanner = Role::start(SCANNER, &[&strip.to_string_lossy(), &columns.to_string()])?;
    let port = scanner.line()?;
    let peak = runtime.block_on(async {
        let rig = Rig::at_port(Path::new(&port)).await?;
        let request = StartScan {
            name: "strip".into(),
            ..StartScan::default()
        };
        let before = ALLOCATOR.current_usage();
        ALLOCATOR.reset_peak_usage();
        let scan = rig.scan(&request).await?;
        // Nobody listens to the events meanwhile, so that no backlog of them is measured.
        let said = tokio::task::block_in_place(|| scanner.line())?;
        ensure!(said == "done", "the scanner says {said}");
        let mut events = rig.client().events().await?;
        let _: Scan = rig.client().ask(path::ABORT).await?;
        let mut over: Scan = rig.client().get(&path::scan(&scan.id)).await?;
        if !over.state.is_over() {
            over = events.scan_over(&scan.id).await?;
        }
        let peak = ALLOCATOR.peak_usage();
        ensure!(
            (over.state, over.columns) == (ScanState::Aborted, columns),
            "{over:?}"
        );
        let journal = rig.journal(&scan.id).await?;
        ensure!(journal_columns(&journal)?.len() == columns as usize);
        rig.end().await?;
        Ok(peak.saturating_sub(before))
    })?;
    scanner.end()?;
    Ok(peak)
}

pub(crate) fn acquisition_needs_the_same_however_long_the_scan() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let runtime = runtime()?;
    // Once for what is made at the first use of anything.
    acquire(&runtime, folder.path(), COLUMNS)?;
    let mut peaks = Vec::new();
    for times in TIMES {
        let columns = COLUMNS * times;
        let peak = acquire(&runtime, folder.path(), columns)?;
        println!(
            "{columns:>6} columns of {SAMPLES} samples: {:>7.1} KiB",
            peak as f64 / 1024.0
        );
        peaks.push(peak);
    }
    let shortest = peaks.first().copied().unwrap_or_default();
    for peak in &peaks {
        ensure!(
            *peak <= shortest + GROWTH_BYTES,
            "acquisition needs {peak} bytes instead of {shortest} for a longer scan"
        );
    }
    Ok(())
}
