//! One scan taken down one road, and every figure of it.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use deliverables::{CadOptions, Stopwatch};
use jiff::Timestamp;
use pipeline::{Method, Outcome, Settings};
use range_image::{Column, RangeImage, RegionMap, Unmonitored};
use reconstruct::metrics::{Metrics, compare};
use relief_tests::outline::{polygon, scan};
use relief_tests::trimming::{Trimming, distinct_corners};
use sim_scanner::scanner::Scanner;
use sim_scanner::source::Source;
use sim_scanner::truth::{VisibleFace, faces};

use crate::conditions::{COLUMNS, SAMPLES, Subject};
use crate::regions::{RegionFigures, figures};
use crate::true_image::TrueImage;

/// A simulated scan with what is really there.
pub(crate) struct Scan {
    subject: Subject,
    seed: u64,
    scanner: Scanner,
    columns: Vec<Column>,
    pitch_mm: f64,
    faces: Vec<VisibleFace>,
}

impl Scan {
    pub(crate) fn take(subject: Subject, seed: u64) -> Result<Self> {
        let source = subject.config(seed).source()?;
        let Source::Simulated { scanner, proposed } = &source else {
            bail!("a recording has no truth");
        };
        ensure!(
            (proposed.columns, proposed.samples) == (COLUMNS, SAMPLES),
            "the scan has {} columns of {} samples",
            proposed.columns,
            proposed.samples
        );
        let (columns, pitch_mm) = scan(&source, scanner)?;
        Ok(Self {
            subject,
            seed,
            faces: faces(scanner)?,
            scanner: scanner.as_ref().clone(),
            columns,
            pitch_mm,
        })
    }
}

/// What came of a scan on one road.
pub(crate) struct Run {
    pub(crate) subject: Subject,
    pub(crate) method: Method,
    pub(crate) seed: u64,
    pub(crate) image: RangeImage,
    pub(crate) outcome: Outcome,
    pub(crate) truth: TrueImage,
    /// Labels for the subject's regions, in their order; `None` for a face that no region
    /// has the most of its nodes on.
    pub(crate) labels: Vec<Option<u16>>,
    pub(crate) iges: Vec<u8>,
    pub(crate) figures: Figures,
}

/// Everything that is measured of a run.
#[derive(Debug, Clone)]
pub(crate) struct Figures {
    pub(crate) pitch_mm: f64,
    /// One for each of the subject's regions.
    pub(crate) regions: Vec<Option<RegionFigures>>,
    /// Faces of the model.
    pub(crate) faces: usize,
    /// The restored image against the range image and against the truth.
    pub(crate) whole: [Metrics; 2],
    /// Against the range image as regridded, before nodes beside outlines were decided anew.
    pub(crate) as_regridded: Metrics,
    /// The range image against the truth.
    pub(crate) regridded: Metrics,
    pub(crate) trimming: Trimming,
    pub(crate) vertices: usize,
    pub(crate) corners: usize,
    /// By name of the stage.
    pub(crate) seconds: BTreeMap<String, f64>,
}

/// Takes a scan down a road. `threads` is 0 for as many as there are.
pub(crate) fn run(scan: &Scan, method: Method, threads: usize) -> Result<Run> {
    let mut settings = Settings::new(scan.pitch_mm)
        .with_method(method)
        .with_seed(scan.seed);
    settings.regrid.threads = threads;
    let watch = Stopwatch::new(&Unmonitored);
    let (image, outcome) = pipeline::process_columns(&scan.columns, &settings, &watch)?;
    let mut seconds = watch.read();

    let begun = Instant::now();
    let mut iges = Vec::new();
    let (model, cad) = (&outcome.reconstruction.model, CadOptions::default());
    let name = scan.subject.name();
    deliverables::write_iges(model, name, Timestamp::UNIX_EPOCH, &cad, &mut iges)?;
    seconds.insert("export".to_owned(), begun.elapsed().as_secs_f64());

    let truth = TrueImage::around(&image, &scan.scanner);
    let restored = truth.on_this_grid(&outcome.reconstruction.restored);
    let labels = labels(scan.subject, &image, &outcome.regions, &truth);
    let regions = scan
        .subject
        .regions()
        .iter()
        .zip(&labels)
        .map(|(region, label)| {
            let measure = |label| figures(&image, &outcome, &truth, label, region.face);
            label.map(measure).transpose()
        })
        .collect::<Result<_>>()?;
    let figures = Figures {
        pitch_mm: scan.pitch_mm,
        regions,
        faces: model.faces.len(),
        whole: [
            outcome.reconstruction.metrics,
            compare(&truth.image, &restored),
        ],
        as_regridded: compare(&image, &outcome.reconstruction.restored),
        regridded: compare(&truth.image, &truth.on_this_grid(&image)),
        trimming: trimming(scan, &outcome, &labels)?,
        vertices: model.vertices.len(),
        corners: distinct_corners(&scan.faces),
        seconds,
    };
    Ok(Run {
        subject: scan.subject,
        method,
        seed: scan.seed,
        image,
        outcome,
        truth,
        labels,
        iges,
        figures,
    })
}

/// For each of the subject's regions the label that has the most nodes on its face, if that
/// label has the most of its own nodes there, too.
fn labels(
    subject: Subject,
    image: &RangeImage,
    map: &RegionMap,
    truth: &TrueImage,
) -> Vec<Option<u16>> {
    let mut shared: BTreeMap<(usize, u16), usize> = BTreeMap::new();
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            let label = map.label(column, row);
            if let (true, Some((_, face))) = (label > 0, truth.at(image, column, row)) {
                *shared.entry((face, label)).or_default() += 1;
            }
        }
    }
    // Of equals the first counts, which is the last of the reversed.
    let most = |chosen: &dyn Fn(&(usize, u16)) -> bool| {
        let among = shared.iter().rev().filter(|(pair, _)| chosen(pair));
        among
            .max_by_key(|(_, nodes)| **nodes)
            .map(|(pair, _)| *pair)
    };
    subject
        .regions()
        .iter()
        .map(|region| {
            let (face, label) = most(&|pair| pair.0 == region.face)?;
            (most(&|pair| pair.1 == label)?.0 == face).then_some(label)
        })
        .collect()
}

/// The faces' outer loops against the true outlines. A true face without a region has none.
fn trimming(scan: &Scan, outcome: &Outcome, labels: &[Option<u16>]) -> Result<Trimming> {
    let model = &outcome.reconstruction.model;
    let mut trimming = Trimming::default();
    for (region, label) in scan.subject.regions().iter().zip(labels) {
        let truth = scan.faces.iter().find(|f| f.id.face == region.face);
        let truth = truth.with_context(|| format!("the {} is not seen", region.name))?;
        let drawn = model.faces.iter().filter(|f| Some(f.region) == *label);
        // Of a region in pieces the longest loop counts.
        let longest = drawn
            .map(|face| polygon(model, &face.outer))
            .max_by_key(Vec::len);
        if let Some(longest) = longest {
            trimming.add(&longest, truth, &scan.faces);
        }
    }
    Ok(trimming)
}
