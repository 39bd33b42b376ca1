//! Work that is done again and again, for instructions to be counted: whatever more turns take
//! more is the work's own.

use std::hint::black_box;

use anyhow::{Context, Result};
use pipeline::Outcome;
use range_image::{Column, RangeImage, RegionMap, Unmonitored};
use reconstruct::{ReconstructSettings, reconstruct};
use regrid::{Estimator, LeastMedian};
use segment::{SegmentSettings, segment};

use crate::mlms::windows;
use crate::scan::house;
use crate::stages::{iges_file, modelled, regridded};

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
        let image = scan()?.image;
        for _ in 0..times {
            black_box(segmented(&image)?);
        }
        Ok(image.valid_nodes())
    }),
    ("reconstruct", |times| {
        let image = scan()?.image;
        let regions = segmented(&image)?;
        let settings = ReconstructSettings::default();
        for _ in 0..times {
            black_box(reconstruct(&image, &regions, &settings, &Unmonitored)?);
        }
        Ok(image.valid_nodes())
    }),
    ("model", |times| {
        let scan = scan()?;
        for _ in 0..times {
            black_box(scan.modelled()?);
        }
        Ok(scan.image.valid_nodes())
    }),
    ("iges", |times| {
        let scan = scan()?;
        let outcome = scan.modelled()?;
        for _ in 0..times {
            black_box(iges_file(&outcome)?);
        }
        Ok(scan.image.valid_nodes())
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

struct Scan {
    columns: Vec<Column>,
    pitch_mm: f64,
    image: RangeImage,
}

impl Scan {
    fn modelled(&self) -> Result<Outcome> {
        modelled(&self.image, &self.columns, self.pitch_mm)
    }
}

/// A scan on its grid, by the estimator that takes a twentieth of the other's instructions: what follows
/// is counted, and this has to be done first each time.
fn scan() -> Result<Scan> {
    let (columns, pitch_mm) = house(SCAN.0, SCAN.1);
    let image = regridded(&columns, pitch_mm, Estimator::LeastMedian)?;
    Ok(Scan {
        columns,
        pitch_mm,
        image,
    })
}

fn segmented(image: &RangeImage) -> Result<RegionMap> {
    Ok(segment(image, &SegmentSettings::default(), &Unmonitored)?)
}
