//! The stages from columns to an IGES file, each on one thread.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::Result;
use cad_exchange::iges;
use pipeline::{InMemory, Observer, Outcome, Settings, Stage, View};
use range_image::{Column, Monitor, RangeImage, Unmonitored};
use regrid::{Estimator, RegridSettings, regrid};

use crate::row::Row;
use crate::scan::house;
use crate::timing::seconds;

/// Turns of which the fastest counts.
const TURNS: usize = 3;

/// Columns and samples of each.
const SIZES: [(u32, u32); 2] = [(240, 256), (480, 512)];

pub(crate) fn rows(short: bool) -> Result<Vec<Row>> {
    let sizes = if short { &SIZES[..1] } else { &SIZES[..] };
    let mut rows = Vec::new();
    for (columns, samples) in sizes {
        rows.extend(scan_rows(*columns, *samples)?);
    }
    Ok(rows)
}

fn scan_rows(columns: u32, samples: u32) -> Result<Vec<Row>> {
    let (scanned, pitch_mm) = house(columns, samples);
    let size = format!("{columns} x {samples}");
    let row = |stage, nodes: usize, seconds: f64| Row {
        stage,
        size: size.clone(),
        unit: "node",
        ns: 1e9 * seconds / nodes.max(1) as f64,
        floor_ns: None,
        peer: None,
    };
    let mut rows = Vec::new();
    for (stage, estimator) in [
        ("regrid, MLMS", Estimator::LeastMedian),
        ("regrid, consensus", Estimator::Consensus),
    ] {
        let (mut nodes, mut fastest_s) = (0, f64::INFINITY);
        for _ in 0..TURNS {
            let begun = Instant::now();
            let image = regridded(&scanned, pitch_mm, estimator)?;
            fastest_s = fastest_s.min(begun.elapsed().as_secs_f64());
            nodes = image.valid_nodes();
        }
        rows.push(row(stage, nodes, fastest_s));
    }
    let mut fastest = [f64::INFINITY; 3];
    let mut nodes = 0;
    for _ in 0..TURNS {
        let watch = Watch::default();
        let (image, outcome) = processed(&scanned, pitch_mm, &watch)?;
        nodes = image.valid_nodes();
        let end = Instant::now();
        let mut file = Ok(Vec::new());
        let written_s = seconds(|| file = iges_file(&outcome));
        file?;
        let begun = |stage| watch.begun(stage);
        if let (Some(segment), Some(reconstruct)) =
            (begun(Stage::Segment), begun(Stage::Reconstruct))
        {
            fastest[0] = fastest[0].min((reconstruct - segment).as_secs_f64());
            fastest[1] = fastest[1].min((end - reconstruct).as_secs_f64());
        }
        fastest[2] = fastest[2].min(written_s);
    }
    let stages = ["segment", "reconstruct", "IGES file"];
    rows.extend(
        stages
            .into_iter()
            .zip(fastest)
            .map(|(stage, seconds)| row(stage, nodes, seconds)),
    );
    Ok(rows)
}

pub(crate) fn regridded(
    columns: &[Column],
    pitch_mm: f64,
    estimator: Estimator,
) -> Result<RangeImage> {
    let settings = RegridSettings::with_pitch(pitch_mm).with_estimator(estimator);
    let settings = RegridSettings {
        threads: 1,
        ..settings
    };
    Ok(regrid(columns.iter().cloned(), &settings, &Unmonitored)?)
}

pub(crate) fn processed(
    columns: &[Column],
    pitch_mm: f64,
    observer: &dyn Observer,
) -> Result<(RangeImage, Outcome)> {
    let mut settings = Settings::new(pitch_mm);
    settings.regrid.threads = 1;
    Ok(pipeline::process_columns(columns, &settings, observer)?)
}

/// From the range image to the model, with the samples at hand.
pub(crate) fn modelled(image: &RangeImage, columns: &[Column], pitch_mm: f64) -> Result<Outcome> {
    let mut settings = Settings::new(pitch_mm);
    settings.regrid.threads = 1;
    let scan = InMemory {
        columns,
        camera_mm: None,
    };
    let view = View::default();
    Ok(pipeline::process_in_view(
        image,
        Some(&scan),
        &view,
        &settings,
        &Unmonitored,
    )?)
}

pub(crate) fn iges_file(outcome: &Outcome) -> Result<Vec<u8>> {
    let mut file = Vec::new();
    let options = iges::WriteOptions::new("house", "20260101.000000");
    iges::write(&outcome.reconstruction.model, &options, &mut file)?;
    Ok(file)
}

/// When each stage began.
#[derive(Default)]
pub(crate) struct Watch(Mutex<Vec<(Stage, Instant)>>);

impl Watch {
    pub(crate) fn begun(&self, wanted: Stage) -> Option<Instant> {
        let stages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = stages.iter().find(|(stage, _)| *stage == wanted);
        found.map(|(_, begun)| *begun)
    }
}

impl Monitor for Watch {
    fn is_cancelled(&self) -> bool {
        false
    }

    fn progress(&self, _fraction: f64) {}
}

impl Observer for Watch {
    fn stage(&self, stage: Stage) {
        let mut stages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        stages.push((stage, Instant::now()));
    }
}
