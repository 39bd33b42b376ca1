//! Samples that are borne out, brought onto a grid.

use range_image::{Column, Lattice, RangeImage};
use rayon::prelude::*;

/// Most nodes of the image: features are some ten pitches wide, so that finer scans than this are
/// told apart by fewer nodes, and measured on all of their samples.
const MOST_NODES: f64 = 250_000.0;
/// Half the side of the window that a node takes samples from, pitches.
const REACH: f64 = 0.75;
/// Samples of one surface differ by so many deviations of their noise at most.
const DEVIATIONS: f64 = 4.0;
/// Steepest slope within one window, rise over run.
const SLOPE: f64 = 1.0;
/// Nodes may stray by this share of the pitch; the segmentation is made for an eighth.
const NOISE_SHARE: f64 = 0.1;
/// Largest half side of the window that nodes are smoothed over, nodes.
const SMOOTH_MOST: usize = 3;

/// The range image of what is borne out, which takes in all columns and at least these y; `pitches_mm` are the distances of columns and samples.
pub(super) fn image(
    columns: &[Column],
    supported: &[Vec<bool>],
    y_mm: [f64; 2],
    pitches_mm: [f64; 2],
    noise_mm: f64,
) -> RangeImage {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for (column, kept) in columns.iter().zip(supported) {
        for (sample, _) in column.samples().iter().zip(kept).filter(|(_, k)| **k) {
            for (axis, value) in [column.x_mm(), sample.y_mm].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
    }
    if low[0].is_finite() {
        let x_mm = [columns.first(), columns.last()].map(|c| c.map_or(low[0], Column::x_mm));
        low = [low[0].min(x_mm[0]), low[1].min(y_mm[0])];
        high = [high[0].max(x_mm[1]), high[1].max(y_mm[1])];
    }
    let [width, height] = [high[0] - low[0], high[1] - low[1]];
    let coarsest = (width * height / MOST_NODES).sqrt();
    let pitch_mm = pitches_mm[0].max(pitches_mm[1]).max(coarsest);
    let lattice = Lattice { pitch_mm };
    if !(width >= 0.0 && height >= 0.0) {
        return RangeImage::masked(lattice, 0, 0, 0, 0);
    }
    let first = low.map(|value| lattice.first_at_or_above(value));
    let last = high.map(|value| lattice.last_at_or_below(value));
    let count = |axis: usize| usize::try_from(last[axis] - first[axis] + 1).unwrap_or(0);
    let (wide, tall) = (count(0), count(1));
    let mut image = RangeImage::masked(lattice, first[0], first[1], wide, tall);
    let nodes: Vec<Vec<f64>> = (0..wide)
        .into_par_iter()
        .map(|i| {
            let x_mm = lattice.line_mm(first[0] + i as i64);
            let reach = REACH * pitch_mm;
            let from = columns.partition_point(|c| c.x_mm() < x_mm - reach);
            let to = columns.partition_point(|c| c.x_mm() <= x_mm + reach);
            let mut around = Vec::new();
            (0..tall)
                .map(|j| {
                    let y_mm = lattice.line_mm(first[1] + j as i64);
                    around.clear();
                    for (column, kept) in columns[from..to].iter().zip(&supported[from..to]) {
                        let samples = column.samples();
                        let start = samples.partition_point(|s| s.y_mm < y_mm - reach);
                        for (sample, kept) in samples[start..].iter().zip(&kept[start..]) {
                            if sample.y_mm > y_mm + reach {
                                break;
                            }
                            if *kept {
                                let (dx, dy) = (column.x_mm() - x_mm, sample.y_mm - y_mm);
                                around.push((dx * dx + dy * dy, sample.z_mm));
                            }
                        }
                    }
                    agreed(&around, DEVIATIONS * noise_mm + SLOPE * reach)
                })
                .collect()
        })
        .collect();
    for (i, column) in nodes.iter().enumerate() {
        for (j, z_mm) in column.iter().enumerate() {
            image.set_z_mm(i, j, (!z_mm.is_nan()).then_some(*z_mm));
        }
    }
    smoothed(&image, noise_mm, pitches_mm)
}

/// Mean of the samples that agree with the nearest; NaN of none.
fn agreed(around: &[(f64, f64)], within_mm: f64) -> f64 {
    let nearest = around.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, z_mm)) = nearest else {
        return f64::NAN;
    };
    let near = around.iter().filter(|(_, z)| (z - z_mm).abs() <= within_mm);
    let (sum, count) = near.fold((0.0, 0), |(sum, count), (_, z)| (sum + z, count + 1));
    sum / f64::from(count)
}

/// Each node the mean of those around it that are on its surface as far as noise lets it be told
/// (a sigma filter, Lee 1983), over as wide a window as brings the noise down to a share of the
/// pitch.
fn smoothed(image: &RangeImage, noise_mm: f64, pitches_mm: [f64; 2]) -> RangeImage {
    let pitch_mm = image.pitch_mm();
    let wanted = NOISE_SHARE * pitch_mm;
    let samples_each = (pitch_mm / pitches_mm[0]) * (pitch_mm / pitches_mm[1]);
    let share = wanted / (noise_mm / samples_each.max(1.0).sqrt());
    let reach = (0..SMOOTH_MOST)
        .find(|k| (2 * k + 1) as f64 * share >= 1.0)
        .unwrap_or(SMOOTH_MOST);
    if reach == 0 {
        return image.clone();
    }
    let (wide, tall) = (image.columns(), image.rows());
    let within = 3.0 * noise_mm + pitch_mm * reach as f64 * 0.1;
    let z = image.raw_z_mm();
    let columns: Vec<Vec<f64>> = (0..wide)
        .into_par_iter()
        .map(|i| {
            let around = i.saturating_sub(reach)..(i + reach + 1).min(wide);
            (0..tall)
                .map(|j| {
                    let own = z[i * tall + j];
                    let rows = j.saturating_sub(reach)..(j + reach + 1).min(tall);
                    let (mut sum, mut count) = (0.0, 0);
                    for c in around.clone() {
                        for other in &z[c * tall + rows.start..c * tall + rows.end] {
                            if (other - own).abs() <= within {
                                sum += other;
                                count += 1;
                            }
                        }
                    }
                    if count == 0 {
                        f64::NAN
                    } else {
                        sum / f64::from(count)
                    }
                })
                .collect()
        })
        .collect();
    let mut smooth = image.masked_like();
    for (i, column) in columns.iter().enumerate() {
        for (j, z_mm) in column.iter().enumerate() {
            smooth.set_z_mm(i, j, (!z_mm.is_nan()).then_some(*z_mm));
        }
    }
    smooth
}
