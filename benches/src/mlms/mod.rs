//! The kernel of MLMS: a plane of least median for a window of samples.

mod textbook;

use anyhow::{Context, Result, ensure};
use regrid::LeastMedian;

use crate::floor;
use crate::row::Row;
use crate::scan::Uniform;
use crate::timing::race;

/// Windows of one size; so many that neither side learns them by heart.
const WINDOWS: usize = 20_000;
const NOISE_MM: f64 = 0.05;
/// Share of samples that are anywhere within 20 mm.
const OUTLIERS: f64 = 0.2;

/// Samples of a window and planes drawn.
const SIZES: [(usize, usize); 4] = [(32, 32), (32, 128), (32, 256), (49, 128)];

/// Planes by lanes against the textbook's, on the same core, in turns.
pub(crate) fn rows(short: bool) -> Result<Vec<Row>> {
    let sizes = if short { &SIZES[..2] } else { &SIZES[..] };
    sizes.iter().map(|size| row(*size, short)).collect()
}

fn row((samples, planes): (usize, usize), short: bool) -> Result<Row> {
    let windows = windows(samples, if short { WINDOWS / 10 } else { WINDOWS });
    let mut finder = LeastMedian::default();
    for (seed, window) in windows.iter().enumerate() {
        let ours = finder.plane(window, planes, seed as u64);
        let theirs = textbook::least_median(window, planes, seed as u64);
        ensure!(
            agree(ours, theirs),
            "window {seed} of {samples} samples, {planes} planes: {ours:?} is not {theirs:?}"
        );
    }
    let [ours_s, theirs_s] = race(
        || sum(&windows, |window, seed| finder.plane(window, planes, seed)),
        || {
            sum(&windows, |window, seed| {
                textbook::least_median(window, planes, seed)
            })
        },
    );
    let each_ns = |seconds: f64| 1e9 * seconds / windows.len() as f64;
    Ok(Row {
        stage: "MLMS kernel",
        size: format!("M = {samples}, N_s = {planes}"),
        unit: "node",
        ns: each_ns(ours_s),
        floor_ns: Some(floor::ns(floor::least_median(samples, planes))),
        peer: Some(("textbook", theirs_s / ours_s)),
    })
}

/// Prints windows with the textbook's answers, a line of JSON each.
pub(crate) fn print_answers(number: usize) -> Result<()> {
    for (samples, planes) in SIZES {
        for (seed, window) in windows(samples, number).iter().enumerate() {
            let answer = textbook::least_median(window, planes, seed as u64);
            let (plane, median) = answer.context("all triples are collinear")?;
            let line = serde_json::json!({
                "samples": window,
                "planes": planes,
                "seed": seed,
                "plane": plane,
                "median": median,
            });
            println!("{line}");
        }
    }
    Ok(())
}

/// The best plane is the same one, solved in two ways.
fn agree(ours: Option<([f64; 3], f64)>, theirs: Option<([f64; 3], f64)>) -> bool {
    match (ours, theirs) {
        (Some((ours, _)), Some((theirs, _))) => ours
            .iter()
            .zip(theirs)
            .all(|(ours, theirs)| (ours - theirs).abs() <= 1e-9 * (1.0 + theirs.abs())),
        (None, None) => true,
        _ => false,
    }
}

type Answer = Option<([f64; 3], f64)>;

/// Something of all answers, so that none is left out as unused.
fn sum(windows: &[Vec<[f64; 3]>], mut find: impl FnMut(&[[f64; 3]], u64) -> Answer) -> f64 {
    let heights = windows
        .iter()
        .enumerate()
        .filter_map(|(seed, window)| find(window, seed as u64));
    heights.map(|(plane, _)| plane[2]).sum()
}

/// Windows as nodes have them: noisy samples of a slanted plane around (0, 0), nearest first, some
/// of them outliers.
pub(crate) fn windows(samples: usize, number: usize) -> Vec<Vec<[f64; 3]>> {
    let mut random = Uniform::new(1995);
    let side = (samples as f64).sqrt();
    let window = |_| {
        let slopes = [0.6 * random.draw() - 0.3, 0.6 * random.draw() - 0.3];
        let mut window: Vec<[f64; 3]> = (0..samples)
            .map(|_| {
                let (x, y) = (side * (random.draw() - 0.5), side * (random.draw() - 0.5));
                let noise = random.normal();
                let z = if random.draw() < OUTLIERS {
                    40.0 * random.draw() - 20.0
                } else {
                    slopes[0] * x + slopes[1] * y + NOISE_MM * noise
                };
                [x, y, 100.0 + z]
            })
            .collect();
        window.sort_by(|a, b| {
            let distance2 = |s: &[f64; 3]| s[0] * s[0] + s[1] * s[1];
            distance2(a).total_cmp(&distance2(b))
        });
        window
    };
    (0..number).map(window).collect()
}
