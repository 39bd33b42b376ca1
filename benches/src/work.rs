//! Work that is done again and again, for instructions to be counted: whatever more turns take
//! more is the work's own.

use std::hint::black_box;

use anyhow::{Context, Result};
use pipeline::Outcome;
use range_image::{RangeImage, Unmonitored};
use reconstruct::{ReconstructSettings, reconstruct};
use regrid::{Estimator, LeastMedian};
use segment::{SegmentSettings, segment};

use crate::mlms::windows;
use crate::scan::house;
use crate::stages::{iges_file, modelled, processed, regridded};

/// Columns of the scan, and samples of each.
const SCAN: (u32, u32) = (72, 72);

/// Does its work so many times, and says how many nodes it has each time.
type Work = fn(u64) -> Result<usize>;

pub(crate) const WORK: [(&str, Work); 8] = [
    ("mlms-32", |times| Ok(mlms(32, times))),
    ("mlms-128", |times| Ok(mlms(128, times))),
    ("regrid-mlms", |times| regrid(Estimator::LeastMedian, times)),
    ("regrid-consensus", |times| {
        regrid(Estimator::Consensus, times)
    }),
    ("segment", |times| {
        let (image, _) = scan()?;
        for _ in 0..times {
            black_box(segment(&image, &SegmentSettings::default(), &Unmonitored)?);
        }
        Ok(image.valid_nodes())
    }),
    ("reconstruct", |times| {
        let (image, outcome) = scan()?;
        let settings = ReconstructSettings::default();
        for _ in 0..times {
            black_box(reconstruct(
                &image,
                &outcome.regions,
                &settings,
                &Unmonitored,
            )?);
        }
        Ok(image.valid_nodes())
    }),
    ("model", |times| {
        let (columns, pitch_mm) = house(SCAN.0, SCAN.1);
        let (image, _) = processed(&columns, pitch_mm, &Unmonitored)?;
        for _ in 0..times {
            black_box(modelled(&image, &columns, pitch_mm)?);
        }
        Ok(image.valid_nodes())
    }),
    ("iges", |times| {
        let (image, outcome) = scan()?;
        for _ in 0..times {
            black_box(iges_file(&outcome)?);
        }
        Ok(image.valid_nodes())
    }),
];

/// Does the work of this name.
pub(crate) fn work(name: &str, times: u64) -> Result<usize> {
    let found = WORK.iter().find(|(own, _)| *own == name);
    let (_, work) = found.with_context(|| format!("there is no work called {name}"))?;
    work(times)
}

fn mlms(planes: usize, times: u64) -> usize {
    let windows = windows(32, 500);
    let mut finder = LeastMedian::default();
    for _ in 0..times {
        for (seed, window) in windows.iter().enumerate() {
            black_box(finder.plane(window, planes, seed as u64));
        }
    }
    windows.len()
}

fn regrid(estimator: Estimator, times: u64) -> Result<usize> {
    let (columns, pitch_mm) = house(SCAN.0, SCAN.1);
    let mut nodes = 0;
    for _ in 0..times {
        nodes = black_box(regridded(&columns, pitch_mm, estimator)?).valid_nodes();
    }
    Ok(nodes)
}

fn scan() -> Result<(RangeImage, Outcome)> {
    let (columns, pitch_mm) = house(SCAN.0, SCAN.1);
    processed(&columns, pitch_mm, &Unmonitored)
}
