//! How far the measured nodes lie off the trimmed faces.

use colorous::RED_BLUE;
use range_image::RangeImage;
use reconstruct::Model;

use super::borders;
use super::canvas::{Canvas, Rgb, Weight};
use super::plot::{FAINT, Plot};
use super::scale::{LEAST_PLOT, ROOM, Scale};

/// Share of the residuals that the colours tell apart; the rest is shown as beyond.
const TOLD_APART: f64 = 0.98;
/// Nodes without a residual: darker than the white of a residual of zero.
const NONE: Rgb = [205, 208, 212];

/// Measured minus fitted z as colour: red towards the camera, blue away from it.
pub(super) fn draw(image: &RangeImage, restored: &RangeImage, model: &Model, name: &str) -> Canvas {
    let residual = |column: usize, row: usize| -> Option<f64> {
        Some(image.z_mm(column, row)? - restored.z_mm(column, row)?)
    };
    let mut sizes: Vec<f64> = (0..image.columns())
        .flat_map(|column| (0..image.rows()).map(move |row| (column, row)))
        .filter_map(|(column, row)| residual(column, row))
        .map(f64::abs)
        .collect();
    sizes.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let rank = (sizes.len().saturating_sub(1) as f64 * share).round() as usize;
        sizes.get(rank).copied().unwrap_or(0.0)
    };
    let rms = (sizes.iter().map(|r| r * r).sum::<f64>() / sizes.len().max(1) as f64).sqrt();
    let subtitle = format!(
        "measured minus fitted z: rms {rms:.3} mm, 95 % within {:.3} mm, {} nodes",
        at(0.95),
        sizes.len()
    );
    let limit = round_up(at(TOLD_APART));
    let scale = Scale {
        heading: "residual (mm)",
        low: -limit,
        high: limit,
        open: true,
        colour: &|share| {
            // The palette goes from red to blue.
            let colour = RED_BLUE.eval_continuous(1.0 - share);
            [colour.r, colour.g, colour.b]
        },
    };
    let mut plot = Plot::new(image, name, &subtitle, ROOM, LEAST_PLOT);
    plot.cover(NONE);
    plot.paint(image, |column, row| {
        residual(column, row).map(|value| scale.of(value))
    });
    borders::draw_thin(&mut plot, image, model);
    if sizes.is_empty() {
        plot.note("no face lies under any node", Weight::Regular, FAINT);
    }
    scale.draw(&mut plot);
    plot.axes(image);
    plot.canvas
}

/// The next 1, 2 or 5 times a power of ten, at least a micrometre.
fn round_up(value: f64) -> f64 {
    let value = if value.is_finite() {
        value.max(1e-3)
    } else {
        1.0
    };
    let decade = libm::pow(10.0, libm::floor(libm::log10(value)));
    let step = [1.0, 2.0, 5.0].into_iter().find(|m| m * decade >= value);
    step.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_round() {
        for (value, limit) in [
            (0.0, 0.001),
            (0.0432, 0.05),
            (0.05, 0.05),
            (0.0501, 0.1),
            (1.3, 2.0),
            (f64::NAN, 1.0),
        ] {
            assert!((round_up(value) - limit).abs() < 1e-12, "{value}");
        }
    }
}
