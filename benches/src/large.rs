//! How a large scan fares, from its samples to the IGES file.

use std::fs;

use anyhow::{Context, Result};
use pipeline::{InMemory, Settings, Stage, View};
use range_image::Unmonitored;
use regrid::{Estimator, RegridSettings, regrid};

use crate::scan::house;
use crate::stages::{Watch, iges_file};
use crate::timing::seconds;

const THREADS: usize = 2;

/// Prints a row about so many columns of as many samples.
pub(crate) fn print(side: u32) -> Result<()> {
    let (columns, pitch_mm) = house(side, side);
    let settings = RegridSettings::with_pitch(pitch_mm).with_estimator(Estimator::LeastMedian);
    let settings = RegridSettings {
        threads: THREADS,
        ..settings
    };
    let mut image = None;
    let regrid_s =
        seconds(|| image = Some(regrid(columns.iter().cloned(), &settings, &Unmonitored)));
    let image = image.context("nothing was regridded")??;
    let mut settings = Settings::new(pitch_mm);
    settings.regrid.threads = THREADS;
    let scan = InMemory {
        columns: &columns,
        camera_mm: None,
    };
    let watch = Watch::default();
    let mut file = None;
    let all_s = seconds(|| {
        let made =
            pipeline::process_in_view(&image, Some(&scan), &View::default(), &settings, &watch);
        file = Some(made.map(|outcome| iges_file(&outcome)));
    });
    file.context("nothing was made")???;
    let begun = |stage| watch.begun(stage).context("a stage is missing");
    let segment_s = (begun(Stage::Reconstruct)? - begun(Stage::Segment)?).as_secs_f64();
    println!(
        "| {side} x {side} | {} | {regrid_s:.1} | {segment_s:.1} | {all_s:.1} | {} |",
        image.valid_nodes(),
        peak_mb()?
    );
    Ok(())
}

/// The most memory that the process has had, in megabytes of 2^20 bytes.
fn peak_mb() -> Result<u64> {
    let status = fs::read_to_string("/proc/self/status").context("the system tells no peak")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next());
    Ok(kilobytes
        .context("the system tells no peak")?
        .parse::<u64>()?
        / 1024)
}
