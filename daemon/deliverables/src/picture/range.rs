//! The range image in colours, with its scale.

use colorous::VIRIDIS;
use range_image::RangeImage;

use super::canvas::{Canvas, Rgb, TEXT_HEIGHT, Weight};
use super::plot::{FAINT, INK, Plot, dimmed, shade, ticks};

const BAR_GAP: usize = 24;
const BAR_WIDTH: usize = 22;
const BAR_ROOM: usize = 140;
/// A jump of z larger than this many pitches is shown as a step, not as a slope.
const STEP_PITCHES: f64 = 6.0;

/// z as colour, lightly shaded so that creases show; masked nodes stay grey.
pub(super) fn draw(image: &RangeImage, name: &str) -> Canvas {
    let subtitle = format!(
        "range image, {} x {} nodes at {} mm",
        image.columns(),
        image.rows(),
        image.pitch_mm()
    );
    let mut plot = Plot::new(image, name, &subtitle, BAR_ROOM);
    if let Some((low, high)) = image.z_extent_mm() {
        plot.paint(image, |column, row| {
            let z = image.z_mm(column, row)?;
            let joined = |c: usize, r: usize| {
                image
                    .z_mm(c, r)
                    .is_some_and(|other| (other - z).abs() <= STEP_PITCHES * image.pitch_mm())
            };
            let light = 0.72 + 0.36 * shade(image, column, row, joined);
            Some(dimmed(colour(z, low, high), light.min(1.0)))
        });
        scale(&mut plot, low, high);
    } else {
        let middle = plot.top() + plot.height() / 2;
        plot.canvas
            .text(90, middle, "nothing measured", Weight::Regular, FAINT);
    }
    plot.axes(image);
    plot.canvas
}

fn colour(z: f64, low: f64, high: f64) -> Rgb {
    let share = if high > low {
        (z - low) / (high - low)
    } else {
        0.5
    };
    let colour = VIRIDIS.eval_continuous(share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}

fn scale(plot: &mut Plot, low: f64, high: f64) {
    let (left, top, height) = (plot.right() + BAR_GAP, plot.top(), plot.height());
    let span = height.saturating_sub(1).max(1) as f64;
    for y in 0..height {
        let z = high - (high - low) * y as f64 / span;
        plot.canvas
            .fill(left, top + y, BAR_WIDTH, 1, colour(z, low, high));
    }
    plot.canvas.frame(left, top, BAR_WIDTH, height, FAINT);
    plot.canvas
        .text(left, top - 26, "z (mm)", Weight::Regular, FAINT);
    for tick in ticks(low, high, height / 60) {
        let share = if high > low {
            (high - tick.value) / (high - low)
        } else {
            0.5
        };
        let y = top + (share * span).round() as usize;
        plot.canvas.fill(left + BAR_WIDTH, y, 5, 1, FAINT);
        plot.canvas.text(
            left + BAR_WIDTH + 10,
            y.saturating_sub(TEXT_HEIGHT / 2),
            &tick.text,
            Weight::Regular,
            INK,
        );
    }
}
