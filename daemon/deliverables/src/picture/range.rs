//! The range image in colours, with its scale.

use colorous::VIRIDIS;
use range_image::RangeImage;

use super::canvas::{Canvas, Weight};
use super::plot::{FAINT, Plot, dimmed, shade};
use super::scale::{LEAST_PLOT, ROOM, Scale};

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
    let mut plot = Plot::new(image, name, &subtitle, ROOM, LEAST_PLOT);
    if let Some((low, high)) = image.z_extent_mm() {
        let scale = Scale {
            heading: "z (mm)",
            low,
            high,
            open: false,
            colour: &|share| {
                let colour = VIRIDIS.eval_continuous(share);
                [colour.r, colour.g, colour.b]
            },
        };
        plot.paint(image, |column, row| {
            let z = image.z_mm(column, row)?;
            let joined = |c: usize, r: usize| {
                image
                    .z_mm(c, r)
                    .is_some_and(|other| (other - z).abs() <= STEP_PITCHES * image.pitch_mm())
            };
            let light = 0.72 + 0.36 * shade(image, column, row, joined);
            Some(dimmed(scale.of(z), light.min(1.0)))
        });
        scale.draw(&mut plot);
    } else {
        plot.note("nothing measured", Weight::Regular, FAINT);
    }
    plot.axes(image);
    plot.canvas
}
