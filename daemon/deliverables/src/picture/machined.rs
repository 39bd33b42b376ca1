//! How far a machined surface lies off its model.

use colorous::RED_BLUE;
use range_image::RangeImage;

use super::canvas::{Canvas, Rgb};
use super::plot::Plot;
use super::scale::{LEAST_PLOT, ROOM, Scale};

/// Beside the model, and at its walls.
const NONE: Rgb = [205, 208, 212];
/// Share of the nodes whose colours are not those of the scale's ends.
const WITHIN: f64 = 0.98;

/// Deviations as colour: red where material is left, blue where too much is gone.
pub(super) fn draw(image: &RangeImage, name: &str, subtitle: &str) -> Canvas {
    let known = image.raw_z_mm().iter().filter(|z| z.is_finite());
    let mut sizes: Vec<f64> = known.map(|z| z.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let index = (WITHIN * sizes.len() as f64) as usize;
    let limit = sizes.get(index.min(sizes.len().saturating_sub(1)));
    let limit = limit.copied().unwrap_or(1.0).max(1e-4);
    let scale = Scale {
        heading: "above model (mm)",
        low: -limit,
        high: limit,
        open: true,
        colour: &|share| {
            // The palette goes from red to blue.
            let colour = RED_BLUE.eval_continuous(1.0 - share);
            [colour.r, colour.g, colour.b]
        },
    };
    let mut plot = Plot::new(image, name, subtitle, ROOM, LEAST_PLOT);
    plot.cover(NONE);
    plot.paint(image, |column, row| {
        image.z_mm(column, row).map(|value| scale.of(value))
    });
    scale.draw(&mut plot);
    plot.axes(image);
    plot.canvas
}
