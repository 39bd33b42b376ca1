//! Truth and labels side by side.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};
use range_image::RangeImage;
use relief_tests::scenes::View;

use crate::material::Subject;
use crate::methods::Labelled;

/// Columns of black between two panels.
const GAP: usize = 6;

/// Writes one PNG: the range image as light from the upper left, the truth, and the labels of
/// each method. Regions too small to count are grey in the truth.
pub(crate) fn write(
    folder: &Path,
    subject: &Subject,
    image: &RangeImage,
    view: View,
    labels: &[Labelled],
) -> Result<()> {
    let truth = &subject.truth;
    let (columns, rows) = (truth.columns, truth.rows);
    let z_mm = truth.gather(image, image.raw_z_mm(), view.factor(), f64::NAN);
    let mut panels = vec![shaded(&z_mm, columns, rows, truth.lattice.pitch_mm)];
    let colour = |label: &u16| {
        if *label != 0 && !truth.counts(*label) {
            [110; 3]
        } else {
            paint(*label)
        }
    };
    panels.push(truth.labels.iter().map(colour).collect());
    for labelled in labels {
        let machine = truth.gather(image, &labelled.labels, view.factor(), 0);
        panels.push(machine.iter().map(|label| paint(*label)).collect());
    }
    let width = panels.len() * (columns + GAP) - GAP;
    let mut pixels = vec![0_u8; width * rows * 3];
    for (k, panel) in panels.iter().enumerate() {
        for column in 0..columns {
            for row in 0..rows {
                let x = k * (columns + GAP) + column;
                // Rows go up, lines of a picture down.
                let at = ((rows - 1 - row) * width + x) * 3;
                pixels[at..at + 3].copy_from_slice(&panel[column * rows + row]);
            }
        }
    }
    let name = format!(
        "{}-{}-{}.png",
        subject.set.name(),
        subject.seed,
        view.name()
    );
    let path = folder.join(name);
    let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), width as u32, rows as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(())
}

/// Neighbouring labels far apart in hue; black for none.
fn paint(label: u16) -> [u8; 3] {
    if label == 0 {
        return [0; 3];
    }
    let hue = (f64::from(label) * 0.618_033_988_75).fract() * 6.0;
    let light = [1.0, 0.75, 0.55][usize::from(label) % 3];
    let part = |offset: f64| {
        let h = (hue + offset).rem_euclid(6.0);
        let up = ((h - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        (40.0 + 215.0 * up * light) as u8
    };
    [part(0.0), part(4.0), part(2.0)]
}

fn shaded(z_mm: &[f64], columns: usize, rows: usize, pitch_mm: f64) -> Vec<[u8; 3]> {
    let at = |column: usize, row: usize| {
        let inside = column < columns && row < rows;
        if inside {
            z_mm[column * rows + row]
        } else {
            f64::NAN
        }
    };
    (0..columns)
        .flat_map(|column| (0..rows).map(move |row| (column, row)))
        .map(|(column, row)| {
            let here = at(column, row);
            if here.is_nan() {
                return [0, 0, 60];
            }
            let slope = |other: f64| {
                if other.is_nan() {
                    0.0
                } else {
                    (other - here) / pitch_mm
                }
            };
            let (p, q) = (slope(at(column + 1, row)), slope(at(column, row + 1)));
            let light = (1.0 + 0.5 * p - 0.5 * q) / (1.0 + p * p + q * q).sqrt() / 1.23;
            [(60.0 + 195.0 * light.clamp(0.0, 1.0)) as u8; 3]
        })
        .collect()
}
