//! How far the measured nodes lie off the trimmed faces: the deviation map of a model.

use colorous::RED_BLUE;
use range_image::RangeImage;
use reconstruct::Model;

use super::borders;
use super::canvas::{Canvas, Rgb, Weight};
use super::plot::{FAINT, Plot};
use super::scale::{LEAST_PLOT, ROOM, Scale};
use crate::deviations::Deviations;

/// Nodes under no face: darker than the white of a deviation of zero.
const NONE: Rgb = [205, 208, 212];

/// Deviations as colour: red towards the camera, blue away from it.
pub(super) fn draw(
    image: &RangeImage,
    deviations: &Deviations<'_>,
    model: &Model,
    name: &str,
) -> Canvas {
    let limit = deviations.limit_mm();
    let subtitle = match (deviations.rms_mm(), deviations.quantile_mm(0.95)) {
        (Some(rms), Some(most)) => format!(
            "deviation of {} nodes from faces, along normals: rms {rms:.3}, 95 % within {most:.3} mm",
            deviations.nodes(),
        ),
        _ => "deviation from faces: no face lies under any node".to_owned(),
    };
    let scale = Scale {
        heading: "deviation (mm)",
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
        deviations.at(column, row).map(|value| scale.of(value))
    });
    borders::draw_thin(&mut plot, image, model);
    if deviations.nodes() == 0 {
        plot.note("no face lies under any node", Weight::Regular, FAINT);
    }
    scale.draw(&mut plot);
    plot.axes(image);
    plot.canvas
}
