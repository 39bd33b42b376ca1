//! Placements of knots beside each other, and fairing of noisy points.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use range_image::{Column, Sample, Unmonitored};
use regrid::RegridSettings;
use scan_files::{ReadOptions, Units};
use serde::Serialize;
use surfacing::{
    Breaks, Features, HeightGrid, Knots, Placement, Settings, curvature_variation, fit_with, make,
};

use crate::bound;
use crate::common::{draws, face, franke, grid, peaks};
use crate::lines;
use crate::told::Told;

/// What fairing must bring the variation of curvature that is by noise down by.
const LEAST_FALL: f64 = 10.0;

/// The name of a grid with masked nodes.
const HOLED: &str = "franke, holes";

const HEAD: &str = "# B-spline surfaces, measured

`cargo xtask study surfaces --write --scan bun000.ply` makes this page; the scan is a view of the Stanford
bunny, whose flank by itself has no masked nodes.

Control points of `relief surface` by each placement of knots, and the greatest deviation from the
grid. *Uniform 2^k* doubles spans. *Fewest of any equal spans* is the least number of control points
of all pairs of counts of equal spans, fitted by least squares, that are as near as `optimal` is;
masked grids have none. Where it is less than twice as many, a search over places of up to 4
knots along x and along y says with how many control points no knots whatever come within the
tolerance: along each line of the grid a surface is a spline with the knots of that direction,
and how near the best of these comes is bounded from below by what least squares leave of the worst
line. It is a search, with places up to a twentieth of the grid apart before the best are moved,
and so no proof.

The closed forms (`geometry/surfacing/tests/common`) are 200 mm wide.

";

const FAIRING: &str = "
Fairing: variation of curvature is the mean square of the third derivative along x and y, mm^-4, over
what no feature line crosses. The truth has some of its own, below which nothing brings it that
keeps the shape: *would fall by* is what is left when all noise, and only noise, is gone. *Noise's
own* compares the variation of what noise adds to the truth with that of what fairing leaves
beside it.
";

/// What the judge is told: the grid, and what our surfaces of it come to.
#[derive(Serialize)]
struct Case {
    name: String,
    columns: usize,
    rows: usize,
    /// Column by column; null where masked.
    z_mm: Vec<Option<f64>>,
    ours: Vec<Ours>,
}

#[derive(Serialize)]
struct Ours {
    tolerance_mm: f64,
    control_points: usize,
    max_mm: f64,
    rms_mm: f64,
}

type Surface = (&'static str, fn(f64, f64) -> f64, [f64; 3]);

/// Measures, prints tables, leaves data and a page; fails where a bar is missed.
pub(crate) fn measure(
    short: bool,
    scan: Option<&Path>,
    only: Option<&str>,
    data: Option<&Path>,
    page: Option<&Path>,
) -> Result<()> {
    let is_wanted = |name: &str| only.is_none_or(|word| name.contains(word));
    let surfaces: [Surface; 3] = [
        ("franke", franke, [0.5, 0.1, 0.02]),
        ("peaks", peaks, [0.5, 0.1, 0.02]),
        ("face", face, [0.5, 0.1, 0.02]),
    ];
    let side = if short { 61 } else { 121 };
    let mut told = Told::default();
    told.page.push_str(HEAD);
    told.head(&[
        "surface",
        "tolerance mm",
        "uniform 2^k",
        "max mm",
        "polyline",
        "max mm",
        "derivative",
        "max mm",
        "optimal",
        "max mm",
        "rms mm",
        "fewest of any equal spans",
        "ratio",
        "no knots with fewer than",
        "ratio of that",
    ]);
    for (name, z, tolerances) in surfaces.into_iter().filter(|s| is_wanted(s.0)) {
        let grid = grid(side, side, 200.0 / (side - 1) as f64, z);
        let tolerances = if short {
            &tolerances[1..2]
        } else {
            &tolerances[..]
        };
        let case = compare(name, &grid, tolerances, &mut told)?;
        leave(data, &case)?;
    }
    if is_wanted(HOLED) {
        let tolerances = if short { &[0.1][..] } else { &[0.5, 0.1][..] };
        let case = compare(HOLED, &holed(side)?, tolerances, &mut told)?;
        leave(data, &case)?;
    }
    if let Some(path) = scan {
        let whole = recorded(path, None)?;
        let flank = recorded(path, Some([(-20.0, 40.0), (55.0, 92.0)]))?;
        for (name, grid, tolerances) in [
            ("scan, flank", &flank, &[1.0, 0.5, 0.2][..]),
            ("scan, whole", &whole, &[5.0, 2.0][..]),
        ]
        .into_iter()
        .filter(|scan| is_wanted(scan.0))
        {
            let case = compare(name, grid, tolerances, &mut told)?;
            leave(data, &case)?;
        }
    }
    if only.is_none_or(|word| word == "lines") {
        lines::measure(short, &mut told)?;
    }
    if only.is_none_or(|word| word == "fairing") {
        fairings(short, surfaces, &mut told)?;
    }
    if let Some(path) = page {
        fs::write(path, &told.page).with_context(|| format!("cannot write {}", path.display()))?;
    }
    if !told.missed.is_empty() {
        bail!("missed:\n  {}", told.missed.join("\n  "));
    }
    Ok(())
}

fn fairings(short: bool, surfaces: [Surface; 3], told: &mut Told) -> Result<()> {
    told.line(FAIRING);
    told.head(&[
        "surface with noise of 0.05 mm, 200 mm wide",
        "pitch mm",
        "bound mm",
        "variation of the truth",
        "before",
        "after",
        "falls by",
        "would fall by, down to the truth's",
        "noise's own falls by",
        "greatest move mm",
        "at the bound",
        "rms to the truth before mm",
        "after mm",
    ]);
    // A scanner's pitch, and a coarser one, at which shape is much of the variation.
    let sides: &[usize] = if short { &[161] } else { &[401, 161] };
    for (name, z, _) in surfaces {
        for &side in sides {
            for bound_mm in [0.05, 0.15] {
                fairing(name, z, bound_mm, side, told)?;
            }
        }
    }
    Ok(())
}

/// Franke's function with a round hole, and without a corner beyond an oblique border.
fn holed(side: usize) -> Result<HeightGrid> {
    let whole = grid(side, side, 200.0 / (side - 1) as f64, franke);
    let share = |k: usize| k as f64 / (side - 1) as f64;
    let z = whole.raw_z_mm().iter().enumerate().map(|(n, z)| {
        let (x, y) = (share(n / side), share(n % side));
        let (a, b) = (x - 0.375, y - 0.57);
        if a * a + b * b < 0.0245 || x + y > 1.65 {
            f64::NAN
        } else {
            *z
        }
    });
    Ok(whole.with_z(z.collect())?)
}

fn compare(name: &str, grid: &HeightGrid, tolerances: &[f64], told: &mut Told) -> Result<Case> {
    let mut ours = Vec::new();
    for &tolerance_mm in tolerances {
        let mut cells = vec![name.to_owned(), tolerance_mm.to_string()];
        for placement in Placement::ALL {
            let settings = Settings {
                placement,
                ..Settings::new(tolerance_mm)
            };
            let report = make(grid, &settings, &Unmonitored)?.report;
            cells.push(report.control_points.to_string());
            cells.push(format!("{:.4}", report.max_mm));
            if placement == Placement::Optimal {
                cells.push(format!("{:.4}", report.rms_mm));
                let fewest = fewest_uniform(grid, report.max_mm);
                let fewest_told = fewest.map_or("-".to_owned(), |n| n.to_string());
                let ratio =
                    fewest.map_or(f64::INFINITY, |n| n as f64 / report.control_points as f64);
                cells.extend([
                    fewest_told,
                    fewest.map_or("-".to_owned(), |_| format!("{ratio:.2}")),
                ]);
                // Where it is less than 2, whether it could have been.
                let bound = (ratio < 2.0).then(|| bound::fewest(grid, tolerance_mm));
                let best = bound.zip(fewest).map(|(bound, n)| n as f64 / bound as f64);
                cells.push(bound.map_or("-".to_owned(), |n| n.to_string()));
                cells.push(best.map_or("-".to_owned(), |best| format!("{best:.2}")));
                if ratio < 2.0 && best.is_none_or(|best| best >= 2.0) {
                    told.missed.push(format!(
                        "{name} at {tolerance_mm} mm: equal spans take only {ratio:.2} times as many control points"
                    ));
                }
                ours.push(Ours {
                    tolerance_mm,
                    control_points: report.control_points,
                    max_mm: report.max_mm,
                    rms_mm: report.rms_mm,
                });
                let doubled: usize = cells[2].parse().unwrap_or(0);
                let near: f64 = cells[3].parse().unwrap_or(f64::INFINITY);
                if near <= tolerance_mm && 2 * report.control_points > doubled {
                    told.missed.push(format!(
                        "{name} at {tolerance_mm} mm: {} control points are more than half of {doubled} with spans doubled",
                        report.control_points
                    ));
                }
            }
        }
        told.line(&format!("| {} |", cells.join(" | ")));
    }
    Ok(Case {
        name: name.to_owned(),
        columns: grid.columns(),
        rows: grid.rows(),
        z_mm: grid
            .raw_z_mm()
            .iter()
            .map(|z| (!z.is_nan()).then_some(*z))
            .collect(),
        ours,
    })
}

/// Fewest control points of any numbers of equal spans that come as near; full grids only,
/// since each of some ten thousand fits of others takes a second.
fn fewest_uniform(grid: &HeightGrid, max_mm: f64) -> Option<usize> {
    if !grid.is_full() {
        return None;
    }
    let mut fewest = None;
    for u in 1..grid.columns() - 3 {
        for v in 1..grid.rows() - 3 {
            let count = (u + 3) * (v + 3);
            if fewest.is_some_and(|fewest| count >= fewest) {
                break;
            }
            let knots = Knots {
                u: Breaks::uniform(grid.columns(), u),
                v: Breaks::uniform(grid.rows(), v),
            };
            if fit_with(grid, &knots).is_ok_and(|(_, max, _)| max <= max_mm) {
                fewest = Some(count);
            }
        }
    }
    fewest
}

fn fairing(
    name: &str,
    z: fn(f64, f64) -> f64,
    bound_mm: f64,
    side: usize,
    told: &mut Told,
) -> Result<()> {
    let truth = grid(side, side, 200.0 / (side - 1) as f64, z);
    let noise = draws(side * side);
    let measured = truth.raw_z_mm().iter().zip(&noise);
    let measured = truth.with_z(measured.map(|(z, d)| z + 0.05 * d).collect())?;
    let (faired, report) = surfacing::fair(&measured, bound_mm, &Unmonitored)?;
    let rms = |z: &[f64]| {
        let squares = z
            .iter()
            .zip(truth.raw_z_mm())
            .map(|(z, t)| (z - t) * (z - t));
        (squares.sum::<f64>() / z.len() as f64).sqrt()
    };
    // Over the same differences as the report's: those that no feature of the measured grid crosses.
    let features = Features::of(&measured, measured.noise_mm());
    let floor = curvature_variation(&truth, &features);
    let left = truth.raw_z_mm().iter().zip(&faired).map(|(t, z)| z - t);
    let left = curvature_variation(&truth.with_z(left.collect())?, &features);
    let added = noise.iter().map(|d| 0.05 * d).collect();
    let added = curvature_variation(&truth.with_z(added)?, &features);
    let (before, after) = (rms(measured.raw_z_mm()), rms(&faired));
    let falls = report.variation_before / report.variation_after;
    told.line(&format!(
        "| {name} | {:.2} | {bound_mm} | {floor:.3e} | {:.3e} | {:.3e} | {falls:.1} | {:.1} | {:.1} | {:.4} | {} | {before:.4} | {after:.4} |",
        truth.pitch_mm(),
        report.variation_before,
        report.variation_after,
        report.variation_before / floor,
        added / left,
        report.greatest_move_mm,
        report.at_bound
    ));
    if report.greatest_move_mm > bound_mm {
        told.missed
            .push(format!("{name}: a point moved over its bound"));
    }
    if added / left < LEAST_FALL {
        told.missed.push(format!(
            "{name} at {:.2} mm, bound {bound_mm} mm: variation by noise falls by {:.1} only",
            truth.pitch_mm(),
            added / left
        ));
    }
    if after >= before {
        told.missed
            .push(format!("{name}: fairing led away from the truth"));
    }
    Ok(())
}

/// A recorded scan on the grid of its density, or what of it lies within limits in x and y.
fn recorded(path: &Path, limits_mm: Option<[(f64, f64); 2]>) -> Result<HeightGrid> {
    let options = ReadOptions {
        units: Some(Units::Metre),
        ..ReadOptions::default()
    };
    let scan = scan_files::read(path, &options)?;
    let mut settings = RegridSettings::with_pitch(scan.recommended_pitch_mm());
    if let Some([x_mm, y_mm]) = limits_mm {
        settings.roi.x_mm = x_mm;
        settings.roi.y_mm = y_mm;
    }
    let columns = scan.columns.into_iter().map(|column| {
        let samples = column.samples.into_iter().map(|sample| Sample {
            y_mm: sample.y_mm,
            z_mm: sample.z_mm,
            intensity: sample.intensity,
        });
        Column::new(column.x_mm, samples.collect())
    });
    let image = regrid::regrid(columns, &settings, &Unmonitored)
        .with_context(|| format!("cannot regrid {}", path.display()))?;
    Ok(HeightGrid::from_image(&image)?)
}

fn leave(data: Option<&Path>, case: &Case) -> Result<()> {
    let Some(folder) = data else { return Ok(()) };
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = folder.join(format!("{}.json", case.name.replace(", ", "-")));
    let text = serde_json::to_string(case)?;
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
}
