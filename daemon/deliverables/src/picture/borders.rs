//! The model's borders over a plot.

use range_image::RangeImage;
use reconstruct::{EdgeKind, Model};

use super::canvas::{Mask, Rgb};
use super::plot::{INK, PAPER, Plot};

/// Points drawn on each cubic piece of a border.
const POINTS_PER_PIECE: usize = 24;
/// More vertices than this are drawn small.
const MANY_VERTICES: usize = 200;
/// Borders that must not hide what they cross.
const THIN: Rgb = [70, 76, 84];

/// Borders and vertices with a white halo.
pub(super) fn draw(plot: &mut Plot, image: &RangeImage, model: &Model) {
    for (radius, paint) in [(2.4, PAPER), (1.2, INK)] {
        strokes(plot, image, model, radius, paint);
    }
    // Where ragged borders have vertices everywhere, large ones would hide the regions.
    let small = if model.vertices.len() > MANY_VERTICES {
        0.5
    } else {
        1.0
    };
    for (radius, paint) in [(4.6 * small, INK), (3.0 * small, PAPER)] {
        let mut mask = Mask::like(&plot.canvas);
        for vertex in &model.vertices {
            let here = plot.place(image, vertex.x_mm, vertex.y_mm);
            mask.stroke(here, here, radius);
        }
        plot.canvas.stencil(&mask, paint);
    }
}

/// Borders alone, as fine lines.
pub(super) fn draw_thin(plot: &mut Plot, image: &RangeImage, model: &Model) {
    strokes(plot, image, model, 0.6, THIN);
}

fn strokes(plot: &mut Plot, image: &RangeImage, model: &Model, radius: f64, paint: Rgb) {
    let mut mask = Mask::like(&plot.canvas);
    for edge in &model.edges {
        // A crease is drawn finer than a border at which the part ends.
        let radius = if edge.kind == EdgeKind::Crease {
            radius * 0.8
        } else {
            radius
        };
        let mut last: Option<[f64; 2]> = None;
        for point in edge.path.sampled(POINTS_PER_PIECE) {
            let here = plot.place(image, point[0], point[1]);
            if let Some(last) = last {
                mask.stroke(last, here, radius);
            }
            last = Some(here);
        }
    }
    plot.canvas.stencil(&mask, paint);
}
