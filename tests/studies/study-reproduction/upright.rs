//! The house upright, so that silhouettes run along the axes of the grid. The cylinder has none:
//! where its side ends, light comes back no more, which is no straight line.

use std::ops::RangeInclusive;

use anyhow::{Context, Result, bail};
use pipeline::Settings;
use range_image::Unmonitored;
use rayon::prelude::*;
use relief_tests::intervals::{AxisSilhouette, Spots, axis_silhouettes};
use relief_tests::outline::{polygon, scan};
use sim_scanner::preset::Preset;
use sim_scanner::scene::{Scene, figures};
use sim_scanner::source::Source;
use sim_scanner::truth::faces;

use crate::conditions::{SEEDS, Subject};
use crate::tables::{number, table};

/// Lean of the top towards the camera, as in the paper's poses, degrees.
const LEAN_DEG: f64 = 42.0;

/// A silhouette, and in which scan it was met.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub(crate) seed: u64,
    pub(crate) face: usize,
    pub(crate) pitch_mm: f64,
    pub(crate) silhouette: AxisSilhouette,
}

/// All silhouettes along an axis, of scans with these seeds.
///
/// # Errors
/// When a scan cannot be taken, or a true face has no region.
pub(crate) fn measure(seeds: RangeInclusive<u64>) -> Result<Vec<Found>> {
    let seeds: Vec<u64> = seeds.collect();
    let found: Vec<Vec<Found>> = seeds.into_par_iter().map(of).collect::<Result<_>>()?;
    Ok(found.into_iter().flatten().collect())
}

fn of(seed: u64) -> Result<Vec<Found>> {
    let mut source = Subject::House.config(seed).source()?;
    let Source::Simulated { scanner, proposed } = &mut source else {
        bail!("a recording has no truth");
    };
    let pose = figures::Pose {
        yaw_rad: 0.0,
        pitch_rad: LEAN_DEG.to_radians(),
        roll_rad: 0.0,
    };
    scanner.scene = Scene::new(vec![figures::house_in(pose)], Preset::Paper.material());
    let (scanner, sweep) = (scanner.clone(), *proposed);
    let (columns, pitch_mm) = scan(&source, &scanner)?;
    let mut settings = Settings::new(pitch_mm).with_seed(seed);
    settings.regrid.threads = 1;
    let (_, outcome) = pipeline::process_columns(&columns, &settings, &Unmonitored)?;
    let model = &outcome.reconstruction.model;

    let spots = Spots::of(&scanner, &sweep);
    let truths = faces(&scanner)?;
    let mut found = Vec::new();
    for truth in &truths {
        let outline: Vec<[f64; 2]> = truth.outline_mm.iter().map(|p| [p.x, p.y]).collect();
        let centre = middle(&outline);
        let loops = model.faces.iter().map(|face| polygon(model, &face.outer));
        let off = |drawn: &Vec<[f64; 2]>| {
            let [x, y] = middle(drawn);
            libm::hypot(x - centre[0], y - centre[1])
        };
        let nearest = loops.min_by(|a, b| off(a).total_cmp(&off(b)));
        let drawn = nearest
            .filter(|drawn| off(drawn) < NEAR_MM)
            .with_context(|| format!("seed {seed}: no face is near {centre:?}"))?;
        let of_face = axis_silhouettes(&drawn, truth, &truths, &spots, pitch_mm);
        found.extend(of_face.into_iter().map(|silhouette| Found {
            seed,
            face: truth.id.face,
            pitch_mm,
            silhouette,
        }));
    }
    Ok(found)
}

/// A face whose middle lies so near to that of a true one is that.
const NEAR_MM: f64 = 2.0;

/// The centroid of a polygon's area.
fn middle(polygon: &[[f64; 2]]) -> [f64; 2] {
    let next = polygon.iter().cycle().skip(1);
    let (mut sum, mut area) = ([0.0; 2], 0.0);
    for (a, b) in polygon.iter().zip(next) {
        let doubled = a[0] * b[1] - b[0] * a[1];
        sum = [0, 1].map(|d| sum[d] + doubled * (a[d] + b[d]) / 3.0);
        area += doubled;
    }
    sum.map(|sum| sum / area)
}

/// One row for each silhouette: the widest interval and the worst over the seeds.
pub(crate) fn intervals(found: &[Found]) -> String {
    let heads = [
        "silhouette: x; y from and to, mm",
        "interval, pitches",
        "beyond it, pitches",
        "off the true one, pitches",
        "scans, number",
    ];
    let mut rows: Vec<Vec<String>> = Vec::new();
    let first = found.iter().filter(|f| f.seed == *SEEDS.start());
    for of_first in first {
        let same = |f: &&Found| {
            f.face == of_first.face && f.silhouette.ends_mm == of_first.silhouette.ends_mm
        };
        let most = |figure: fn(&AxisSilhouette) -> f64| {
            let each = found.iter().filter(same);
            each.map(|f| figure(&f.silhouette) / f.pitch_mm)
                .fold(0.0, f64::max)
        };
        let [from, to] = of_first.silhouette.ends_mm;
        rows.push(vec![
            format!(
                "{:.1}; {:.1} to {:.1}; {:.1}",
                from[0], from[1], to[0], to[1]
            ),
            number(most(|s| s.width_mm), 2),
            number(most(|s| s.beyond_mm), 3),
            number(most(|s| s.off_mm), 2),
            number(found.iter().filter(same).count() as f64, 0),
        ]);
    }
    table(&heads, &rows)
}
