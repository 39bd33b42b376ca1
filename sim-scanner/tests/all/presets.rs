//! Statistics of the presets against those measured on real scanners.
//!
//! The real objects are not modelled. A seated animal of balls and rods stands in for the
//! sculptures of the Cyberware scans (all slopes, overhangs, shadows), a groove for the target
//! of the RF627 profiles. So bands, not single figures, are compared, and only what the
//! scanner rather than the object decides has a narrow one.

#![allow(clippy::panic)] // A test that panics has failed.

use sim_scanner::config::{Object, SimConfig};
use sim_scanner::noise::Kind;
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scanner::{Column, Scanner, Sweep};
use sim_scanner::source::Source;
use sim_scanner::truth::SampleTruth;

struct Scan {
    scanner: Scanner,
    columns: Vec<(Column, Vec<SampleTruth>)>,
}

fn scan(object: &str, preset: Preset, every: u32, overrides: Overrides, repeat: u64) -> Scan {
    let config = SimConfig {
        object: Object::BuiltIn(object.into()),
        preset,
        overrides,
        seed: 11,
        ..SimConfig::default()
    };
    let Source::Simulated { scanner, proposed } = config.source().expect("built in") else {
        panic!("simulated")
    };
    let sweep: Sweep = proposed;
    let columns = (0..sweep.columns)
        .step_by(every as usize)
        .map(|index| scanner.column_with_truth(&sweep, repeat, index))
        .collect();
    Scan {
        scanner: *scanner,
        columns,
    }
}

/// What can be told from the reported samples alone.
#[derive(Debug)]
struct Seen {
    spacing_mm: f64,
    spacing_cv: f64,
    spacing_least_mm: f64,
    spacing_most_mm: f64,
    backward: f64,
    gaps: f64,
}

fn seen(scan: &Scan) -> Seen {
    let mut spacings = Vec::new();
    let (mut pairs, mut backward) = (0, 0);
    let (mut missing, mut spanned) = (0, 0);
    for (column, _) in &scan.columns {
        let returns: Vec<(usize, f64)> = column
            .samples
            .iter()
            .enumerate()
            .filter(|(_, sample)| !sample.no_return)
            .map(|(i, sample)| (i, scan.scanner.reported_point_mm(column, sample).y))
            .collect();
        if let (Some(first), Some(last)) = (returns.first(), returns.last()) {
            spanned += last.0 - first.0 + 1;
            missing += last.0 - first.0 + 1 - returns.len();
        }
        for pair in returns.windows(2) {
            pairs += 1;
            backward += usize::from(pair[1].1 <= pair[0].1);
            if pair[1].0 == pair[0].0 + 1 {
                spacings.push(pair[1].1 - pair[0].1);
            }
        }
    }
    spacings.sort_by(f64::total_cmp);
    // Steps from one surface to another are no spacing of samples: one in 200 at either end.
    let trimmed = &spacings[spacings.len() / 200..spacings.len() - spacings.len() / 200];
    let mean = trimmed.iter().sum::<f64>() / trimmed.len() as f64;
    let variance =
        trimmed.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / trimmed.len() as f64;
    Seen {
        spacing_mm: mean,
        spacing_cv: variance.sqrt() / mean,
        spacing_least_mm: trimmed[0],
        spacing_most_mm: trimmed[trimmed.len() - 1],
        backward: backward as f64 / pairs as f64,
        gaps: missing as f64 / spanned as f64,
    }
}

/// Range errors of the readings of a kind, by the slope where they were taken.
fn errors(scan: &Scan, kind: Kind, slopes: core::ops::Range<f64>) -> Vec<f64> {
    let mut errors = Vec::new();
    for (column, truths) in &scan.columns {
        for (sample, truth) in column.samples.iter().zip(truths) {
            let (Some(range_mm), Some(cos)) = (truth.range_mm, truth.incidence_cos) else {
                continue;
            };
            let slope = (1.0 / (cos * cos) - 1.0).sqrt();
            if truth.kind == Some(kind) && slopes.contains(&slope) {
                let laser = scan
                    .scanner
                    .optics
                    .laser_mm(scan.scanner.x_mm(column.table_counts));
                let point = scan.scanner.reported_point_mm(column, sample);
                errors.push(point.distance(laser) - range_mm);
            }
        }
    }
    errors
}

/// Readings next to the end of a run or to a step edge, and how many of them are mixed.
fn at_edges(scan: &Scan) -> (usize, usize) {
    const STEP_MM: f64 = 3.0;
    let (mut edges, mut mixed) = (0, 0);
    for (_, truths) in &scan.columns {
        let far = |a: &SampleTruth, b: Option<&SampleTruth>| match (
            a.range_mm,
            b.and_then(|b| b.range_mm),
        ) {
            (Some(a), Some(b)) => (a - b).abs() > STEP_MM,
            (Some(_), None) => true,
            _ => false,
        };
        for (i, truth) in truths.iter().enumerate().filter(|(_, t)| t.kind.is_some()) {
            let before = i.checked_sub(1).and_then(|i| truths.get(i));
            if far(truth, before) || far(truth, truths.get(i + 1)) {
                edges += 1;
                mixed += usize::from(truth.kind == Some(Kind::Mixed));
            }
        }
    }
    (edges, mixed)
}

/// Standard deviation from the median of the absolute errors.
fn robust_sigma(mut errors: Vec<f64>) -> f64 {
    assert!(errors.len() > 200, "too few: {}", errors.len());
    errors.iter_mut().for_each(|e| *e = e.abs());
    errors.sort_by(f64::total_cmp);
    1.4826 * errors[errors.len() / 2]
}

fn share(errors: &[f64], beyond: f64) -> f64 {
    errors.iter().filter(|e| e.abs() > beyond).count() as f64 / errors.len() as f64
}

#[track_caller]
fn within(what: &str, value: f64, band: core::ops::RangeInclusive<f64>) {
    assert!(band.contains(&value), "{what}: {value} is outside {band:?}");
}

#[test]
fn cyberware_scans_look_like_the_real_ones() {
    let scan = scan("figure", Preset::Cyberware, 1, Overrides::default(), 0);
    let seen = seen(&scan);
    println!("{seen:?}");
    within("spacing (mm)", seen.spacing_mm, 1.3..=1.5);
    within("CV of the spacing", seen.spacing_cv, 0.06..=0.11);
    within("share running backwards", seen.backward, 0.0003..=0.0024);
    within("share in gaps", seen.gaps, 0.01..=0.12);

    let flat = errors(&scan, Kind::Clean, 0.0..0.3);
    println!(
        "{} {} {}",
        robust_sigma(flat.clone()),
        robust_sigma(errors(&scan, Kind::Clean, 0.9..1.1)),
        robust_sigma(errors(&scan, Kind::Clean, 1.8..2.6))
    );
    within(
        "noise on flat parts (mm)",
        robust_sigma(flat.clone()),
        0.04..=0.07,
    );
    let steep = errors(&scan, Kind::Clean, 0.9..1.1);
    within("noise at slope 1 (mm)", robust_sigma(steep), 0.06..=0.08);
    let steeper = errors(&scan, Kind::Clean, 1.8..2.6);
    within("noise beyond (mm)", robust_sigma(steeper), 0.10..=0.13);
    let sigma = robust_sigma(flat.clone());
    println!(
        "{} {}",
        share(&flat, 5.0 * sigma),
        share(&flat, 10.0 * sigma)
    );
    within("beyond 5 sigma", share(&flat, 5.0 * sigma), 0.015..=0.03);
    within(
        "beyond 10 sigma",
        share(&flat, 10.0 * sigma),
        0.0004..=0.005,
    );
}

#[test]
fn the_ends_of_cyberware_runs_curl() {
    let scan = scan("figure", Preset::Cyberware, 1, Overrides::default(), 0);
    let mixed = errors(&scan, Kind::Mixed, 0.0..3.0);
    let (edges, bent) = at_edges(&scan);
    println!("{bent} of {edges} bent");
    within("share of bent ends", bent as f64 / edges as f64, 0.1..=0.8);
    let curls: Vec<f64> = mixed.iter().map(|e| e.abs()).filter(|e| *e < 3.0).collect();
    println!("{}", curls.iter().sum::<f64>() / curls.len() as f64);
    within(
        "mean curl (mm)",
        curls.iter().sum::<f64>() / curls.len() as f64,
        0.3..=0.7,
    );
}

#[test]
fn rf627_profiles_look_like_the_real_ones() {
    let scan_1 = scan("groove", Preset::Rf627, 10, Overrides::default(), 0);
    let seen = seen(&scan_1);
    println!("{seen:?}");
    within("spacing (mm)", seen.spacing_mm, 0.140..=0.155);
    within("CV of the spacing", seen.spacing_cv, 0.07..=0.13);
    within("least spacing (mm)", seen.spacing_least_mm, 0.09..=0.12);
    within("greatest spacing (mm)", seen.spacing_most_mm, 0.18..=0.30);

    // The same profile again: what repeats is frozen to the surface.
    let scan_2 = scan("groove", Preset::Rf627, 10, Overrides::default(), 1);
    let mut differences = Vec::new();
    for ((a, truths), (b, _)) in scan_1.columns.iter().zip(&scan_2.columns) {
        for ((a, b), truth) in a.samples.iter().zip(&b.samples).zip(truths) {
            let flat = truth.incidence_cos.is_some_and(|cos| cos > 0.95);
            if flat && !a.no_return && !b.no_return && truth.kind == Some(Kind::Clean) {
                differences.push(f64::from(a.range_counts - b.range_counts) * 1e-3);
            }
        }
    }
    let repeat_mm = robust_sigma(differences) / 2_f64.sqrt();
    println!("{repeat_mm}");
    within("noise that differs (mm)", repeat_mm, 0.007..=0.009);
    let total_mm = robust_sigma(errors(&scan_1, Kind::Clean, 0.0..0.3));
    let frozen_mm = (total_mm * total_mm - repeat_mm * repeat_mm).sqrt();
    println!("{total_mm} {frozen_mm}");
    within("noise that stays (mm)", frozen_mm, 0.015..=0.021);
}

#[test]
fn paper_scans_have_the_size_noise_and_counts_of_the_paper() {
    let scan = scan("house", Preset::Paper, 1, Overrides::default(), 0);
    assert_eq!(scan.columns.len(), 240);
    assert!(
        scan.columns
            .iter()
            .all(|(c, truths)| c.samples.len() == 256 && truths.len() == 256)
    );
    let seen = seen(&scan);
    println!("{seen:?}");
    // The fan spreads the samples over the object's 100 mm and a margin.
    within("spacing (mm)", seen.spacing_mm, 0.40..=0.50);
    within("share in gaps", seen.gaps, 0.0..=0.01);
    assert_eq!(seen.backward, 0.0);
    let (edges, mixed) = at_edges(&scan);
    within("mixed at steps", mixed as f64 / edges as f64, 0.01..=0.2);
    for (column, _) in &scan.columns {
        for sample in column.samples.iter().filter(|sample| !sample.no_return) {
            assert!((7000..=8000).contains(&sample.range_counts));
        }
    }

    // Counts of 0.1 mm add their own error to the noise of 0.05 mm; finer ones do not.
    let fine = Overrides {
        range_count_mm: Some(0.001),
        ..Overrides::default()
    };
    let fine = self::scan("house", Preset::Paper, 2, fine, 0);
    for (slopes, at) in [(0.5..0.9, 0.7_f64), (0.9..1.4, 1.15)] {
        let errors = errors(&fine, Kind::Clean, slopes.clone());
        if errors.len() > 200 {
            let expected = 0.05 * (1.0 + at * at).sqrt();
            within(
                "noise (mm)",
                robust_sigma(errors),
                expected * 0.85..=expected * 1.15,
            );
        }
    }
}

#[test]
fn each_sort_of_mistake_comes_at_its_rate() {
    let quiet = Overrides {
        noise_mm: Some(0.0),
        range_count_mm: Some(1e-4),
        mixed: Some(0.0),
        dropouts: Some(0.0),
        ..Overrides::default()
    };
    let exact = scan("house", Preset::Paper, 4, quiet, 0);
    let clean = errors(&exact, Kind::Clean, 0.0..20.0);
    assert!(clean.iter().all(|e| e.abs() < 1e-4), "nothing but counts");
    assert!(errors(&exact, Kind::Mixed, 0.0..20.0).is_empty());

    let count = |scan: &Scan, kind| errors(scan, kind, 0.0..20.0).len() as f64;
    let all = clean.len() as f64;
    let uniform = Overrides {
        outliers: Some(0.1),
        ..quiet
    };
    let uniform = scan("house", Preset::Paper, 4, uniform, 0);
    within("uniform", count(&uniform, Kind::Outlier) / all, 0.09..=0.11);
    let outliers = errors(&uniform, Kind::Outlier, 0.0..20.0);
    assert!(outliers.iter().any(|e| *e > 20.0) && outliers.iter().any(|e| *e < -20.0));

    let one_sided = Overrides {
        outliers_one_sided: Some(0.05),
        ..quiet
    };
    let one_sided = scan("house", Preset::Paper, 4, one_sided, 0);
    let outliers = errors(&one_sided, Kind::Outlier, 0.0..20.0);
    within("one-sided", outliers.len() as f64 / all, 0.04..=0.06);
    assert!(
        outliers.iter().all(|e| *e <= 1e-4),
        "all before the surface"
    );

    let clusters = Overrides {
        outlier_clusters: Some(0.01),
        ..quiet
    };
    let clusters = scan("house", Preset::Paper, 4, clusters, 0);
    // Runs are 5.5 long on average.
    within(
        "clustered",
        count(&clusters, Kind::Outlier) / all,
        0.04..=0.07,
    );

    let dropouts = Overrides {
        dropouts: Some(0.05),
        ..quiet
    };
    let dropouts = scan("house", Preset::Paper, 4, dropouts, 0);
    let kept = |range: core::ops::Range<f64>| {
        let left = errors(&dropouts, Kind::Clean, range.clone()).len() as f64;
        left / errors(&exact, Kind::Clean, range).len() as f64
    };
    assert!(kept(0.0..1.0) > kept(1.0..20.0), "more are lost at a slant");
    within("lost", 1.0 - kept(0.0..20.0), 0.06..=0.5);

    let mixed = Overrides {
        mixed: Some(1.0),
        ..quiet
    };
    let mixed = scan("house", Preset::Paper, 4, mixed, 0);
    assert!(count(&mixed, Kind::Mixed) > 50.0);
}

#[test]
fn a_column_is_the_same_whenever_it_is_asked_for() {
    let config = SimConfig {
        overrides: Overrides {
            outliers: Some(0.05),
            outlier_clusters: Some(0.01),
            jitter_mm: Some(0.05),
            ..Overrides::default()
        },
        ..SimConfig::default()
    };
    let Source::Simulated { scanner, proposed } = config.source().expect("built in") else {
        panic!("simulated")
    };
    let forwards: Vec<Column> = (0..30)
        .map(|i| scanner.column(&proposed, 0, 100 + i))
        .collect();
    let backwards: Vec<Column> = (0..30)
        .rev()
        .map(|i| scanner.column(&proposed, 0, 100 + i))
        .collect();
    assert!(forwards.iter().eq(backwards.iter().rev()));
    assert_ne!(
        forwards[0].samples,
        scanner.column(&proposed, 1, 100).samples
    );
}
